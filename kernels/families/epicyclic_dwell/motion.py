"""Motion of the geared dwell drive with a whole gear ratio; the equation numbers are of docs/epicyclic_dwell.md.

The pin's path is a sum of two turning vectors and the offset, so its derivatives are known to every order; those of the
output angle follow from the quotients of them.  Designs may be complex128 (exact gradients by the complex step);
decisions look at the real part.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.complex_step import arctan2

Numbers = NDArray[Any]  # float64, or complex128 for exact gradients by the complex step
Status = NDArray[np.uint8]
EPS = 2.0**-53
MOST_TEETH = 64  # largest gear ratio; the pin then turns as often per turn of the carrier


class Design(NamedTuple):
    """Columns of the design matrix, in planet radii: pin distance, offset, and the gear ratio with its kind of mesh."""

    k: float
    a: float
    n: float
    mesh: float  # +1: the planet runs outside the fixed gear, -1: inside a fixed ring


@inline
def power(u: Any, v: Any, times: int) -> tuple[Any, Any]:
    """Return the cosine and sine of ``times`` the angle, by products: each adds a rounding or two."""
    c, s = 1.0 + 0.0 * u, 0.0 * v
    while times > 0:
        if times % 2 == 1:
            c, s = c * u - s * v, c * v + s * u
        u, v = (u - v) * (u + v), 2.0 * u * v
        times //= 2
    return c, s


@kernel
def poses(
    designs: Numbers,
    cos_phi: Numbers,
    sin_phi: Numbers,
    status: Status,
    psi: Numbers | None,
    dpsi: Numbers | None,
    d2psi: Numbers | None,
    d3psi: Numbers | None,
    sin_psi: Numbers | None,
    cos_psi: Numbers | None,
    x_b: Numbers | None,
    y_b: Numbers | None,
) -> None:
    """Compute the output angle, its derivatives and the pin of every design at its carrier angles; (1)-(4).

    Parameters
    ----------
    designs : (n, 4) columns of :class:`Design`
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, SINGULAR (the pin is on the output axis within its rounding) or INVALID_INPUT
    psi ... y_b : (n, m) out, or None: what is None is neither computed nor compiled

    Notes
    -----
    Where the status is not OK the values are nan.  The angle is in (-pi, pi].
    """
    for i in range(designs.shape[0]):
        k, a, n, mesh = designs[i, 0], designs[i, 1], designs[i, 2].real, designs[i, 3].real
        arm = n + mesh
        valid = 0.0 < k.real < 1e30 and abs(a.real) < 1e30 and mesh * mesh == 1.0
        valid = valid and arm >= 1.0 and n <= MOST_TEETH and n == math.floor(n)
        times = 1
        if valid:
            times = int(arm)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            c, s = power(u, v, times)
            # the pin's own turning vector: backwards in a ring
            pc, ps = -mesh * k * c, -k * s
            x, y = arm * u + pc + a, arm * v + ps
            square = x * x + y * y
            size = arm + abs(k.real) + abs(a.real)
            code = st.OK
            if not valid or square.real != square.real:
                code = st.INVALID_INPUT
            # within its rounding error: the direction of the pin is then arbitrary
            elif square.real <= (8.0 * EPS * arm * size) ** 2:
                code = st.SINGULAR
            status[i, j] = code
            if code != st.OK:
                x, y, square = math.nan * x, math.nan * y, math.nan * square
            if x_b is not None:
                x_b[i, j] = x
            if y_b is not None:
                y_b[i, j] = y
            if psi is not None:
                psi[i, j] = arctan2(y, x)
            if sin_psi is not None or cos_psi is not None:
                distance = np.sqrt(square)
                if sin_psi is not None:
                    sin_psi[i, j] = y / distance
                if cos_psi is not None:
                    cos_psi[i, j] = x / distance
            if dpsi is not None or d2psi is not None or d3psi is not None:
                # z' = i (L e^{i phi} + m L p), m = mesh: the pin's vector turns with m L
                _put_derivatives(dpsi, d2psi, d3psi, i, j, (x, y, square), (arm * u, arm * v), (pc, ps), mesh * arm)


@inline
def _put_derivatives(
    dpsi: Numbers | None,
    d2psi: Numbers | None,
    d3psi: Numbers | None,
    i: int,
    j: int,
    pin: tuple[Any, Any, Any],
    carrier: tuple[Any, Any],
    turning: tuple[Any, Any],
    f: float,
) -> None:
    """Write the wanted derivatives of the output angle, (3).

    ``pin`` is the pin from the output axis with the square of its distance, ``carrier`` the planet's centre from the
    carrier's axis, ``turning`` the pin from that centre, which turns ``f`` times as fast.
    """
    x, y, square = pin
    au, av = carrier
    pc, ps = turning
    # z^(k) / z = r_k + i t_k; the imaginary part of the logarithm's derivatives is that of the angle
    per = 1.0 / square
    x1, y1 = -av - f * ps, au + f * pc
    r1, t1 = (x * x1 + y * y1) * per, (x * y1 - y * x1) * per
    if dpsi is not None:
        dpsi[i, j] = t1
    if d2psi is not None or d3psi is not None:
        x2, y2 = -au - f * f * pc, -av - f * f * ps
        r2, t2 = (x * x2 + y * y2) * per, (x * y2 - y * x2) * per
        if d2psi is not None:
            d2psi[i, j] = t2 - 2.0 * r1 * t1
        if d3psi is not None:
            x3, y3 = av + f * f * f * ps, -au - f * f * f * pc
            t3 = (x * y3 - y * x3) * per
            d3psi[i, j] = t3 - 3.0 * (r2 * t1 + t2 * r1) + 2.0 * (3.0 * r1 * r1 - t1 * t1) * t1
