"""How the limit positions of a crank-rocker move with its dimensions; equation (16) of docs/synthesis.md."""

from __future__ import annotations

import math

from kernels.arithmetic.sincos import sine_cosine
from kernels.jit import inline, kernel
from kernels.types import Array

PARAMETERS = ("a", "b", "c", "e", "f", "g", "alpha")


@inline
def _at_limit(designs: Array, i: int, psi: float, phi: float, rates: Array, place: int) -> None:
    """Write dpsi/dp into rates[i, :, place] and dphi/dp into rates[i, :, place + 1], for the seven parameters p."""
    a, b, c, e = designs[i, 0], designs[i, 1], designs[i, 2], designs[i, 3]
    f, g = designs[i, 4], designs[i, 5]
    sa, ca = sine_cosine(designs[i, 6])
    s, co = sine_cosine(psi)
    v, u = sine_cosine(phi)
    # ball in the crank frame; coupler d = C - B; c T = dF/dpsi/2
    xc, yc, ze = e + c * co, c * ca * s - g * sa, c * sa * s + g * ca
    dx, dy, dz = xc - a * u, c * s - (f * sa + a * ca * v), g - (f * ca - a * sa * v)
    ct = c * (dy * co - dx * s)
    rho2 = xc * xc + yc * yc
    h = (
        a - (u * xc + v * yc),
        -b,
        dx * co + dy * s,
        dx,
        f - ze,
        dz,
        dz * (f * sa + a * ca * v) - dy * (f * ca - a * sa * v),
    )
    direct_x = (0.0, 0.0, co, 1.0, 0.0, 0.0, 0.0)
    direct_y = (0.0, 0.0, ca * s, 0.0, 0.0, -sa, -ze)
    for p in range(7):
        dpsi = -h[p] / ct
        rates[i, p, place] = dpsi
        rates[i, p, place + 1] = (
            xc * (direct_y[p] + c * ca * co * dpsi) - yc * (direct_x[p] - c * s * dpsi)
        ) / rho2  # fmt: skip


@kernel
def limit_sensitivities(
    designs: Array, psi_ext: Array, phi_ext: Array, psi_fold: Array, phi_fold: Array, rates: Array
) -> None:
    """Compute derivatives of both limit positions with respect to every dimension.

    At a limit dpsi/dphi = 0, so the limit angle of the rocker moves as the rocker does at that crank angle held fixed.

    Parameters
    ----------
    designs : (n, 8) a, b, c, e, f, g, alpha, branch
    psi_ext, phi_ext, psi_fold, phi_fold : (n,) the limit positions [rad]
    rates : (n, 7, 4) out: per dimension of PARAMETERS the derivatives of psi_ext, phi_ext, psi_fold, phi_fold
        [rad/length, 1 for alpha]; nan goes through
    """
    for i in range(designs.shape[0]):
        if math.isnan(psi_ext[i]):
            rates[i] = math.nan
        else:
            _at_limit(designs, i, psi_ext[i], phi_ext[i], rates, 0)
            _at_limit(designs, i, psi_fold[i], phi_fold[i], rates, 2)
