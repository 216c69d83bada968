"""Planar four-bar whose coupler point is guided along a line: the needle-bar drive of the class-208 overlock machine.

Polukhin 1971, section 4.4, as worked out in docs/guide.md; the equation numbers are of that page.  Everything is
computed in lengths divided by a power of two near the rocker length.  Designs may be complex128 (exact gradients by the
complex step); decisions look at the real part.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.complex_step import arctan2, magnitude

Array = NDArray[np.float64]
Status = NDArray[np.uint8]
EPS = 2.0**-53


class Design(NamedTuple):
    """Columns of the design matrix: lengths in one unit, lam in radians, branch +1 or -1."""

    a: float
    b: float
    c: float
    e: float
    xi: float
    eta: float
    lam: float
    h: float
    branch: float


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``: the closure X C - Y S + W = 0 and the coupler point in the line's frame.

    X = e - a cos phi, Y = a sin phi, W = k0 - k2 cos phi; along + i (dev + h) = p e^{i phi} + q (e + c e^{i psi}) / c.
    """

    a: float
    b: float
    c: float
    e: float
    k0: float
    k2: float
    x_size: float  # sums of the magnitudes whose rounding errors make up X and W
    w_size: float
    p_along: float  # a (1 - l/b) e^{-i lam}, l = xi + i eta
    p_across: float
    q_along: float  # c (l/b) e^{-i lam}
    q_across: float
    along0: float  # (l/b) e^{-i lam} e - i h
    across0: float
    xi: float  # in units of the coupler
    eta: float
    branch: float
    unit: float
    valid: bool


@inline
def reduce_design(designs: Array, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for zero or negative lengths and for what is not finite."""
    _, exponent = math.frexp(designs[i, 2].real)
    unit, per_unit = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
    a, b, c, e = designs[i, 0] * per_unit, designs[i, 1] * per_unit, designs[i, 2] * per_unit, designs[i, 3] * per_unit
    lam, h, branch = designs[i, 6], designs[i, 7] * per_unit, designs[i, 8]
    xi, eta = designs[i, 4] * per_unit / b, designs[i, 5] * per_unit / b
    cl, sl = np.cos(lam), np.sin(lam)
    along, across = xi * cl + eta * sl, eta * cl - xi * sl
    k0 = 0.5 * ((c - b) * (c + b) + (a * a + e * e)) / c
    k2 = a * e / c
    w_size = 0.5 * (abs(((c - b) * (c + b)).real) + (a * a + e * e).real) / c.real + abs(k2.real)
    valid = a.real > 0.0 and b.real > 0.0 and c.real > 0.0 and w_size < 1e140 and branch.real * branch.real == 1.0
    # 0 * x is nan exactly for what is not finite
    valid = valid and abs(lam.real) < 1e5 and (0.0 * (xi + eta + h)).real == 0.0
    return Reduced(
        a, b, c, e, k0, k2, abs(e.real) + a.real, w_size,
        a * (cl - along), -a * (sl + across), c * along, c * across, along * e, across * e - h,
        xi, eta, branch, unit, valid,
    )  # fmt: skip


@kernel
def travel_shares(designs: Array, shares: Array) -> None:
    """The travel as a combination of the two turning angles, (4): s = p1 u - p2 v + q1 C - q2 S + constant.

    Parameters
    ----------
    designs : (n, 9) columns of :class:`Design`
    shares : (n, 6) out; p1, p2, q1, q2 [length], and bounds of the rounding errors of the p and of the q
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        reach = abs(r.xi) + abs(r.eta)
        shares[i, 0], shares[i, 1] = r.p_along * r.unit, r.p_across * r.unit
        shares[i, 2], shares[i, 3] = r.q_along * r.unit, r.q_across * r.unit
        # l/b is rounded once, sine and cosine to one unit in the last place, then two products and two sums.
        shares[i, 4], shares[i, 5] = 10.0 * EPS * r.a * (1.0 + reach) * r.unit, 8.0 * EPS * r.c * reach * r.unit


@inline
def discriminant_tolerance(r: Reduced, x: float, y: float, w: float) -> float:
    """Rounding error of X^2+Y^2-W^2: below it, whether the links reach cannot be decided in float64 (7)."""
    t = 8.0 * EPS
    first = abs(x.real) * r.x_size + abs(y.real) * r.a.real + abs(w.real) * r.w_size
    return t * first + t * t * (r.x_size * r.x_size + r.a.real * r.a.real + r.w_size * r.w_size)


@kernel
def poses(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    status: Status,
    s: Array | None,
    ds: Array | None,
    d2s: Array | None,
    d3s: Array | None,
    dev: Array | None,
    ddev: Array | None,
    d2dev: Array | None,
    discriminant: Array | None,
    pressure_angle: Array | None,
    joints: Array | None,
) -> None:
    """Travel along the line, deviation across it, and their derivatives, of every design at its crank angles.

    Equations (1)-(6) of docs/guide.md.

    Parameters
    ----------
    designs : (n, 9) columns of :class:`Design`
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR or INVALID_INPUT
    s ... pressure_angle : (n, m) out [length; rad], or None: what is None is neither computed nor compiled
    joints : (6, n, m) out, crank pin x y, rocker pin x y, coupler point x y, or None

    Notes
    -----
    Where the status is not OK the values are nan, except that a dead point keeps its position (Delta = 0) and the
    discriminant is always given.  Measured: errors below 2.0 x 2^-53 max(cond, |y|) over the oracle table.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        two_c = 2.0 * r.c * r.unit * r.unit
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            x, y, w = r.e - r.a * u, r.a * v, r.k0 - r.k2 * u
            rr = x * x + y * y
            delta = rr - w * w
            tolerance = discriminant_tolerance(r, x, y, w)
            code = st.OK
            if not r.valid or delta.real != delta.real:
                code = st.INVALID_INPUT
            elif delta.real < -tolerance:
                code = st.NOT_ASSEMBLED
            elif delta.real <= tolerance:
                # The crank pin on the rocker pivot leaves the rocker free; a dead point has one position.
                code = st.DEAD_POINT if rr.real > tolerance else st.SINGULAR
            status[i, j] = code

            if discriminant is not None:
                discriminant[i, j] = (delta * two_c) * two_c if r.valid else math.nan
            root = np.sqrt(delta) if code == st.OK else 0.0 * delta
            assembled = code == st.OK or code == st.DEAD_POINT
            t = r.branch * root
            per_rr = 1.0 / rr if assembled else math.nan * rr
            cos_psi, sin_psi = -(x * w + y * t) * per_rr, (y * w - x * t) * per_rr
            if pressure_angle is not None:
                # atan2, not acos: acos loses half the digits near zero.
                pressure_angle[i, j] = arctan2(magnitude(r.c - w), root) if assembled else math.nan
            if joints is not None:
                bx, by, cx, cy = r.a * u, r.a * v, r.e + r.c * cos_psi, r.c * sin_psi
                joints[0, i, j], joints[1, i, j] = bx * r.unit, by * r.unit
                joints[2, i, j], joints[3, i, j] = cx * r.unit, cy * r.unit
                joints[4, i, j] = (bx + (r.xi * (cx - bx) - r.eta * (cy - by))) * r.unit
                joints[5, i, j] = (by + (r.xi * (cy - by) + r.eta * (cx - bx))) * r.unit
            # the crank's and the rocker's share of the coupler point, in the frame of the line
            b_along, b_across = r.p_along * u - r.p_across * v, r.p_along * v + r.p_across * u
            c_along = r.q_along * cos_psi - r.q_across * sin_psi
            c_across = r.q_along * sin_psi + r.q_across * cos_psi
            if s is not None:
                s[i, j] = (b_along + c_along + r.along0) * r.unit
            if dev is not None:
                dev[i, j] = (b_across + c_across + r.across0) * r.unit
            if ds is not None or d2s is not None or d3s is not None or ddev is not None or d2dev is not None:
                per_t = 1.0 / t if code == st.OK else math.nan * t
                g_turn, g_near = r.a * (v * cos_psi - u * sin_psi), r.a * (u * cos_psi + v * sin_psi)
                g_ph = g_turn + r.k2 * v
                psi1 = -g_ph * per_t
                if ds is not None:
                    ds[i, j] = -(b_across + psi1 * c_across) * r.unit
                if ddev is not None:
                    ddev[i, j] = (b_along + psi1 * c_along) * r.unit
                if d2s is not None or d3s is not None or d2dev is not None:
                    psi2 = -(g_near + r.k2 * u + psi1 * (w * psi1 - 2.0 * g_near)) * per_t
                    if d2s is not None:
                        d2s[i, j] = -(b_along + psi2 * c_across + psi1 * psi1 * c_along) * r.unit
                    if d2dev is not None:
                        d2dev[i, j] = (psi2 * c_along - psi1 * psi1 * c_across - b_across) * r.unit
                    if d3s is not None:
                        linear = g_ph - psi1 * (3.0 * g_turn - psi1 * (3.0 * g_turn + t * psi1))
                        psi3 = (linear - 3.0 * psi2 * (w * psi1 - g_near)) * per_t
                        turning = (psi3 - psi1 * psi1 * psi1) * c_across
                        d3s[i, j] = (b_across - turning - 3.0 * psi1 * psi2 * c_along) * r.unit


@kernel
def dev_sensitivities(designs: Array, cos_phi: Array, sin_phi: Array, sensitivities: Array, status: Status) -> None:
    """Partial derivatives of dev with respect to phi, a, b, c, e, xi, eta, lam, h; (8) of docs/guide.md.

    Parameters
    ----------
    designs : (n, 9) columns of :class:`Design`
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    sensitivities : (9, n, m) out [1 or length/rad]; nan where the status is not OK
    status : (n, m) out, as of :func:`poses`
    """
    poses(designs, cos_phi, sin_phi, status, None, None, None, None, None, None, None, None, None, None)
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        cl, sl = np.cos(designs[i, 6]), np.sin(designs[i, 6])
        for j in range(cos_phi.shape[1]):
            if status[i, j] != st.OK:
                for k in range(9):
                    sensitivities[k, i, j] = math.nan
                continue
            u, v = cos_phi[row, j], sin_phi[row, j]
            x, y, w = r.e - r.a * u, r.a * v, r.k0 - r.k2 * u
            rr = x * x + y * y
            t = r.branch * np.sqrt(rr - w * w)
            cos_psi, sin_psi = -(x * w + y * t) / rr, (y * w - x * t) / rr
            cx, cy = r.e + r.c * cos_psi, r.c * sin_psi
            dx, dy = (cx - r.a * u) / r.b, (cy - y) / r.b
            # across the line: of B's own motion, of i l d (turning of the coupler), of d and i d
            turn_across = (r.xi * dx - r.eta * dy) * cl + (r.xi * dy + r.eta * dx) * sl
            d_across, id_across = dy * cl - dx * sl, dx * cl + dy * sl
            # (C_p + c psi_p k' - B_p) . (i d), the turning of the coupler; c k' . (i d) = c cos(pressure angle at C)
            k_turn = sin_psi * dy + cos_psi * dx
            per_t = 1.0 / t
            crank_radial, crank_tangential = u * cx + v * cy, u * cy - v * cx
            # psi_p = -h_p / (c T), then c psi_p in units of length
            by_phi = r.a * crank_tangential * per_t
            by_a, by_b = (crank_radial - r.a) * per_t, r.b * per_t
            by_c, by_e = (w - r.c) * per_t, -(cx - r.a * u) * per_t
            bet_phi = by_phi * k_turn - r.a * (v * dy + u * dx)
            bet_a = by_a * k_turn - (v * dx - u * dy)
            bet_c = by_c * k_turn + (sin_psi * dx - cos_psi * dy)
            bet_e = by_e * k_turn - dy
            sensitivities[0, i, j] = (r.a * (u * cl + v * sl) + bet_phi * turn_across) * r.unit
            sensitivities[1, i, j] = v * cl - u * sl + bet_a * turn_across
            sensitivities[2, i, j] = by_b * k_turn * turn_across
            sensitivities[3, i, j] = bet_c * turn_across
            sensitivities[4, i, j] = bet_e * turn_across
            sensitivities[5, i, j] = d_across
            sensitivities[6, i, j] = id_across
            mx, my = r.a * u + r.b * (r.xi * dx - r.eta * dy), y + r.b * (r.xi * dy + r.eta * dx)
            sensitivities[7, i, j] = -(mx * cl + my * sl) * r.unit
            sensitivities[8, i, j] = -1.0
