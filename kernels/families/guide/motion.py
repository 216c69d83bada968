"""Motion of the planar four-bar with a guided coupler point at given crank angles, and what the parameters do to it.

It is the needle-bar drive of the class-208 overlock machine: Polukhin 1971, section 4.4, as worked out in
docs/guide.md; the equation numbers are of that page.  Designs may be complex128 (exact gradients by the complex step).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2, magnitude
from kernels.families.guide.closure import (
    ClosurePose,
    Reduced,
    acceleration,
    discriminant_tolerance,
    jerk,
    place,
    reduce_design,
    velocity,
)
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write
from kernels.linkage.verdict import pose_status
from kernels.types import EPS, Array, Status


class Point(NamedTuple):
    """Shares of the crank and of the rocker in the coupler point, along and across the line; the rocker; T."""

    b_along: Any
    b_across: Any
    c_along: Any
    c_across: Any
    cos_psi: Any
    sin_psi: Any
    t: Any  # root of the discriminant with the sign of the branch


class Outputs(NamedTuple):
    """Pose outputs, each (n, m), or None: what is None is not computed."""

    s: Array | None
    ds: Array | None
    d2s: Array | None
    d3s: Array | None
    dev: Array | None
    ddev: Array | None
    d2dev: Array | None
    discriminant: Array | None
    pressure_angle: Array | None


@kernel
def poses(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    status: Status,
    out: Outputs,
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
            at = place(r, cos_phi[row, j], sin_phi[row, j])
            u, v, x, y, w = at.u, at.v, at.x, at.y, at.w
            tolerance = discriminant_tolerance(r, x, y, w)
            code = pose_status(r.valid, at.delta.real, tolerance, at.rr.real)
            status[i, j] = code
            write(out.discriminant, i, j, (at.delta * two_c) * two_c if r.valid else math.nan)
            root = np.sqrt(at.delta) if code == st.OK else 0.0 * at.delta
            assembled = code == st.OK or code == st.DEAD_POINT
            t = r.branch * root
            per_rr = 1.0 / at.rr if assembled else math.nan * at.rr
            cos_psi, sin_psi = -(x * w + y * t) * per_rr, (y * w - x * t) * per_rr
            # atan2, not acos: acos loses half the digits near zero.
            write(out.pressure_angle, i, j, arctan2(magnitude(r.c - w), root) if assembled else math.nan)
            if joints is not None:
                bx, by, cx, cy = r.a * u, r.a * v, r.e + r.c * cos_psi, r.c * sin_psi
                joints[0, i, j], joints[1, i, j] = bx * r.unit, by * r.unit
                joints[2, i, j], joints[3, i, j] = cx * r.unit, cy * r.unit
                joints[4, i, j] = (bx + (r.xi * (cx - bx) - r.eta * (cy - by))) * r.unit
                joints[5, i, j] = (by + (r.xi * (cy - by) + r.eta * (cx - bx))) * r.unit
            # The crank's and the rocker's share of the coupler point, in the frame of the line.
            b_along, b_across = r.p_along * u - r.p_across * v, r.p_along * v + r.p_across * u
            c_along = r.q_along * cos_psi - r.q_across * sin_psi
            c_across = r.q_along * sin_psi + r.q_across * cos_psi
            write(out.s, i, j, (b_along + c_along + r.along0) * r.unit)
            write(out.dev, i, j, (b_across + c_across + r.across0) * r.unit)
            if (
                out.ds is not None
                or out.d2s is not None
                or out.d3s is not None
                or out.ddev is not None
                or out.d2dev is not None
            ):
                point = Point(b_along, b_across, c_along, c_across, cos_psi, sin_psi, t)
                _put_derivatives(out, i, j, r, at, point, code == st.OK)


@inline
def _put_derivatives(
    out: Outputs, i: int, j: int,
    r: Reduced, at: ClosurePose, point: Point, regular: bool,
) -> None:  # fmt: skip
    """Write the wanted derivatives up to the highest of them; (5)."""
    b_along, b_across, c_along, c_across, cos_psi, sin_psi, t = point
    per_t = 1.0 / t if regular else math.nan * t
    first = velocity(r, at, cos_psi, sin_psi, per_t)
    psi1 = first.p
    write(out.ds, i, j, -(b_across + psi1 * c_across) * r.unit)
    write(out.ddev, i, j, (b_along + psi1 * c_along) * r.unit)
    if out.d2s is not None or out.d3s is not None or out.d2dev is not None:
        psi2 = acceleration(r, at, first, per_t)
        write(out.d2s, i, j, -(b_along + psi2 * c_across + psi1 * psi1 * c_along) * r.unit)
        write(out.d2dev, i, j, (psi2 * c_along - psi1 * psi1 * c_across - b_across) * r.unit)
        if out.d3s is not None:
            psi3 = jerk(at, first, psi2, t, per_t)
            turning = (psi3 - psi1 * psi1 * psi1) * c_across
            write(out.d3s, i, j, (b_across - turning - 3.0 * psi1 * psi2 * c_along) * r.unit)


@kernel
def point_shares(designs: Array, shares: Array) -> None:
    """Compute the guided point as a combination of the two turning angles, (4).

    Travel is s = p1 u - p2 v + q1 C - q2 S + a constant, deviation is dev = p2 u + p1 v + q2 C + q1 S + constant.

    Parameters
    ----------
    designs : (n, 9) columns of :class:`Design`
    shares : (n, 8) out [length]; p1, p2, q1, q2, bounds of the rounding errors of the p and of the q, the constant of
        dev and a bound of its rounding error
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        reach = abs(r.xi) + abs(r.eta)
        shares[i, 0], shares[i, 1] = r.p_along * r.unit, r.p_across * r.unit
        shares[i, 2], shares[i, 3] = r.q_along * r.unit, r.q_across * r.unit
        # l/b is rounded once, sine and cosine to one unit in the last place, then two products and two sums.
        shares[i, 4], shares[i, 5] = 10.0 * EPS * r.a * (1.0 + reach) * r.unit, 8.0 * EPS * r.c * reach * r.unit
        shares[i, 6] = r.across0 * r.unit
        shares[i, 7] = 10.0 * EPS * reach * abs(r.e) * r.unit + 2.0 * EPS * abs(designs[i, 7])


@kernel
def dev_sensitivities(designs: Array, cos_phi: Array, sin_phi: Array, sensitivities: Array, status: Status) -> None:
    """Compute partial derivatives of dev with respect to phi, a, b, c, e, xi, eta, lam, h; (8).

    Parameters
    ----------
    designs : (n, 9) columns of :class:`Design`
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    sensitivities : (9, n, m) out [1 or length/rad]; nan where the status is not OK
    status : (n, m) out, as of :func:`poses`
    """
    poses(designs, cos_phi, sin_phi, status, Outputs(None, None, None, None, None, None, None, None, None), None)
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        cl, sl = np.cos(designs[i, 6]), np.sin(designs[i, 6])
        for j in range(cos_phi.shape[1]):
            if status[i, j] != st.OK:
                for k in range(9):
                    sensitivities[k, i, j] = math.nan
                continue
            at = place(r, cos_phi[row, j], sin_phi[row, j])
            u, v, x, y, w = at.u, at.v, at.x, at.y, at.w
            t = r.branch * np.sqrt(at.delta)
            cos_psi, sin_psi = -(x * w + y * t) / at.rr, (y * w - x * t) / at.rr
            cx, cy = r.e + r.c * cos_psi, r.c * sin_psi
            dx, dy = (cx - r.a * u) / r.b, (cy - y) / r.b
            # What moves the point across the line: a turn of the coupler, a shift of the point along it and across it.
            turn_across = (r.xi * dx - r.eta * dy) * cl + (r.xi * dy + r.eta * dx) * sl
            d_across, id_across = dy * cl - dx * sl, dx * cl + dy * sl
            # A parameter p turns the coupler by (C_p + c psi_p k' - B_p) . (i d)/b, where k' . (i d) is the cosine of
            # the pressure angle at C.
            k_turn = sin_psi * dy + cos_psi * dx
            per_t = 1.0 / t
            crank_radial, crank_tangential = u * cx + v * cy, u * cy - v * cx
            # The rocker pin moves by c psi_p, where psi_p = -h_p/(c T).
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
