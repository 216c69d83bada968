"""Spatial crank-rocker with two revolute and two ball joints (RSSR); planar four-bar for alpha = 0, f = g.

Polukhin 1971, chapter II, in the corrected and stable forms of docs/rssr.md; the equation numbers are of that page.
Everything is computed in units of the crank length, mirrored to the assembly mode +1 (psi, f -> -psi, -f together with
cos(alpha) -> -cos(alpha) in the axial product turns mode -1 into +1 and changes no bit of any magnitude).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import inline, kernel, kernel_fused
from kernels.reduce import largest, smallest

Array = NDArray[np.float64]
Status = NDArray[np.uint8]
EPS = 2.0**-53


class Design(NamedTuple):
    """Columns of the design matrix: lengths in one unit, alpha in radians, branch +1 or -1."""

    a: float
    b: float
    c: float
    e: float
    f: float
    g: float
    alpha: float
    branch: float


class Reduced(NamedTuple):
    """Per-design numbers of the closure ``X C - Y S + W = 0`` in units of the crank, mirrored to branch +1."""

    e: float  # X = e - cos phi
    y0: float  # Y = y0 + ca sin phi
    ca: float
    k0: float  # W = k0 + k1 sin phi - k2 cos phi
    k1: float
    k2: float
    w_size: float  # sum of the magnitudes whose rounding errors make up W
    coupler: float  # b/a
    rocker: float  # c/a
    z0: float  # z_B - z_C = z0 - sa sin phi
    sa: float
    branch: float
    valid: bool


@inline
def axial_square(f: float, g: float, alpha: float) -> tuple[float, float]:
    """f^2 + g^2 - 2 f g cos(alpha) and the magnitude of its terms, without cancellation near alpha = 0, pi; (K*)."""
    if math.cos(alpha) >= 0.0:
        h = math.sin(0.5 * alpha)
        near, far = (f - g) * (f - g), 4.0 * f * g * h * h
        return near + far, near + abs(far)
    h = math.cos(0.5 * alpha)
    near, far = (f + g) * (f + g), 4.0 * f * g * h * h
    return near - far, near + abs(far)


@inline
def reduce_design(designs: Array, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for zero or negative lengths and for what is not finite."""
    _, exponent = math.frexp(designs[i, 2])
    unit = math.ldexp(1.0, -exponent)
    a, b, c = designs[i, 0] * unit, designs[i, 1] * unit, designs[i, 2] * unit
    e, f, g = designs[i, 3] * unit, designs[i, 4] * unit, designs[i, 5] * unit
    alpha, branch = designs[i, 6], designs[i, 7]
    sa, ca = math.sin(alpha), math.cos(alpha)
    q, q_size = axial_square(f, g, alpha)
    square = (c - b) * (c + b) + (a * a + e * e) + q
    per_a, per_c = 1.0 / a, 1.0 / c
    k0, k1, k2 = 0.5 * square * per_c * per_a, g * sa * per_c, e * per_c
    size = 0.5 * (abs((c - b) * (c + b)) + a * a + e * e + q_size) * per_c * per_a + abs(k1) + abs(k2)
    valid = a > 0.0 and b > 0.0 and c > 0.0 and size < 1e140 and abs(alpha) < 1e5 and branch * branch == 1.0
    valid = valid and a > 1e-140 and per_a < 1e140
    return Reduced(
        e * per_a, branch * (f * sa * per_a), branch * ca, k0, k1, k2, size,
        b * per_a, c * per_a, (f * ca - g) * per_a, sa, branch, valid,
    )  # fmt: skip


@inline
def discriminant_tolerance(r: Reduced, x: float, y: float, w: float) -> float:
    """Rounding error of X^2+Y^2-W^2: below it, whether the links reach cannot be decided in float64 (sheet 1.2)."""
    mx, my, mw = abs(r.e) + 1.0, abs(r.y0) + 1.0, r.w_size
    t = 8.0 * EPS
    return t * (abs(x) * mx + abs(y) * my + abs(w) * mw) + t * t * (mx * mx + my * my + mw * mw)


@kernel
def poses(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    status: Status,
    psi: Array | None,
    dpsi: Array | None,
    d2psi: Array | None,
    d3psi: Array | None,
    sin_psi: Array | None,
    cos_psi: Array | None,
    discriminant: Array | None,
    pressure_angle: Array | None,
) -> None:
    """Position, transfer functions, discriminant and pressure angle of every design at its crank angles.

    Equations (2*), (3)-(5) in the form of sheet section 1.3 and cos(pressure angle) = |T|/b.

    Parameters
    ----------
    designs : (n, 8) columns of :class:`Design`
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR or INVALID_INPUT
    psi ... pressure_angle : (n, m) out, or None: what is None is neither computed nor compiled

    Notes
    -----
    Where the status is not OK the values are nan, except that a dead point keeps its angle (Delta = 0).
    The dead-point band is the rounding error of Delta itself; outside it the sign of Delta is right for the given
    doubles up to the rounding of K.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        two_ac = 2.0 * designs[i, 0] * designs[i, 2]
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            hu, hv = r.ca * u, r.ca * v
            x, y, w1 = r.e - u, r.y0 + hv, r.k2 * u - r.k1 * v
            w = r.k0 - w1
            rr = x * x + y * y
            delta = rr - w * w
            tolerance = discriminant_tolerance(r, x, y, w)
            code = st.OK
            if not r.valid or delta != delta:
                code = st.INVALID_INPUT
            elif delta < -tolerance:
                code = st.NOT_ASSEMBLED
            elif delta <= tolerance:
                # B on the rocker axis has every angle as a solution; a dead point has one.
                code = st.DEAD_POINT if rr > tolerance else st.SINGULAR
            status[i, j] = code

            if discriminant is not None:
                discriminant[i, j] = (delta * two_ac) * two_ac if r.valid else math.nan
            t = math.sqrt(delta) if code == st.OK else 0.0
            has_angle = code == st.OK or code == st.DEAD_POINT
            c = (x * w + y * t) / rr if has_angle else math.nan  # -cos psi
            s = (x * t - y * w) / rr if has_angle else math.nan  # -sin psi of the mirrored mechanism
            if cos_psi is not None:
                cos_psi[i, j] = -c
            if sin_psi is not None:
                sin_psi[i, j] = -r.branch * s
            if psi is not None:
                psi[i, j] = math.atan2(-r.branch * s, -c)
            if pressure_angle is not None:
                # atan2, not acos: acos loses half the digits near zero.
                across = math.hypot(r.rocker - w, r.z0 - r.sa * v)
                pressure_angle[i, j] = math.atan2(across, t) if has_angle else math.nan
            if dpsi is not None or d2psi is not None or d3psi is not None:
                per_t = 1.0 / t if code == st.OK else math.nan
                w_ph = r.k1 * u + r.k2 * v
                g_ph = w_ph - (v * c - hu * s)
                p = -g_ph * per_t
                if dpsi is not None:
                    dpsi[i, j] = r.branch * p
                if d2psi is not None or d3psi is not None:
                    g_phph = w1 - (u * c + hv * s)
                    g_phps = v * s + hu * c
                    q = -(g_phph + p * (2.0 * g_phps + w * p)) * per_t
                    if d2psi is not None:
                        d2psi[i, j] = r.branch * q
                    if d3psi is not None:
                        g_phphps = u * s - hv * c
                        g_phpsps = w_ph - g_ph
                        jerk = (
                            g_ph - p * (3.0 * g_phphps + p * (3.0 * g_phpsps - t * p)) - 3.0 * q * (g_phps + w * p)
                        ) * per_t
                        d3psi[i, j] = r.branch * jerk


@kernel_fused
def dense_maxima(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    min_delta: Array,
    max_abs_dpsi: Array | None,
    max_abs_d2psi: Array | None,
    max_abs_d3psi: Array | None,
) -> None:
    """Largest |psi'|, |psi''|, |psi'''| over a grid of crank angles, and the smallest Delta; the sweep's hot loop.

    Parameters
    ----------
    designs : (n, 8) columns of :class:`Design`
    cos_phi, sin_phi : (m,) the grid, shared by all designs; m a multiple of 8 is fastest
    min_delta : (n,) out, smallest Delta/b^2 on the grid; where it is not positive the maxima mean nothing
    max_abs_dpsi, max_abs_d2psi, max_abs_d3psi : (n,) out, or None: not computed, not compiled

    Notes
    -----
    Delta is clamped to a tiny positive number under the root, so the loop has no branch and vectorises;
    the unclamped minimum tells whether the clamp was used.  An invalid design has min_delta nan.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        least, m1, m2, m3 = 1e300, 0.0, 0.0, 0.0
        for j in range(cos_phi.size):
            u, v = cos_phi[j], sin_phi[j]
            hu, hv = r.ca * u, r.ca * v
            x, y, w1 = r.e - u, r.y0 + hv, r.k2 * u - r.k1 * v
            w = r.k0 - w1
            rr = x * x + y * y
            delta = rr - w * w
            least = smallest(least, delta)
            if max_abs_dpsi is not None or max_abs_d2psi is not None or max_abs_d3psi is not None:
                t = math.sqrt(largest(delta, 1e-300))
                shared = 1.0 / (rr * t)  # one division for 1/R and 1/T
                per_r, per_t = t * shared, rr * shared
                c, s = (x * w + y * t) * per_r, (x * t - y * w) * per_r
                w_ph = r.k1 * u + r.k2 * v
                g_ph = w_ph - (v * c - hu * s)
                p = g_ph * per_t  # -psi'
                if max_abs_dpsi is not None:
                    m1 = largest(m1, abs(p))
                if max_abs_d2psi is not None or max_abs_d3psi is not None:
                    g_phps = v * s + hu * c
                    q = (w1 - (u * c + hv * s) + p * (w * p - (g_phps + g_phps))) * per_t  # -psi''
                    if max_abs_d2psi is not None:
                        m2 = largest(m2, abs(q))
                    if max_abs_d3psi is not None:
                        g_phphps = u * s - hv * c
                        jerk = (
                            g_ph + p * (3.0 * g_phphps - p * (3.0 * (w_ph - g_ph) + t * p)) + 3.0 * q * (g_phps - w * p)
                        ) * per_t
                        m3 = largest(m3, abs(jerk))
        min_delta[i] = least / (r.coupler * r.coupler) if r.valid else math.nan
        if max_abs_dpsi is not None:
            max_abs_dpsi[i] = m1
        if max_abs_d2psi is not None:
            max_abs_d2psi[i] = m2
        if max_abs_d3psi is not None:
            max_abs_d3psi[i] = m3
