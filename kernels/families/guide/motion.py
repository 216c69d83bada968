"""Motion of the planar four-bar whose coupler point is guided along a line, at given crank angles.

It is the needle-bar drive of the class-208 overlock machine: Polukhin 1971, section 4.4, as worked out in
docs/guide.md; the equation numbers are of that page.  Designs may be complex128 (exact gradients by the complex step).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.complex_step import arctan2, magnitude
from kernels.families.guide.closure import Array, Place, Reduced, Status, discriminant_tolerance, place, reduce_design
from kernels.families.guide.derivatives import acceleration, jerk, velocity
from kernels.verdict import pose_status


class Point(NamedTuple):
    """Shares of the crank and of the rocker in the coupler point, along and across the line; the rocker; T."""

    b_along: Any
    b_across: Any
    c_along: Any
    c_across: Any
    cos_psi: Any
    sin_psi: Any
    t: Any  # root of the discriminant with the sign of the branch


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
            at = place(r, cos_phi[row, j], sin_phi[row, j])
            u, v, x, y, w = at.u, at.v, at.x, at.y, at.w
            tolerance = discriminant_tolerance(r, x, y, w)
            code = pose_status(r.valid, at.delta.real, tolerance, at.rr.real)
            status[i, j] = code
            if discriminant is not None:
                discriminant[i, j] = (at.delta * two_c) * two_c if r.valid else math.nan
            root = np.sqrt(at.delta) if code == st.OK else 0.0 * at.delta
            assembled = code == st.OK or code == st.DEAD_POINT
            t = r.branch * root
            per_rr = 1.0 / at.rr if assembled else math.nan * at.rr
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
            # The crank's and the rocker's share of the coupler point, in the frame of the line.
            b_along, b_across = r.p_along * u - r.p_across * v, r.p_along * v + r.p_across * u
            c_along = r.q_along * cos_psi - r.q_across * sin_psi
            c_across = r.q_along * sin_psi + r.q_across * cos_psi
            if s is not None:
                s[i, j] = (b_along + c_along + r.along0) * r.unit
            if dev is not None:
                dev[i, j] = (b_across + c_across + r.across0) * r.unit
            if ds is not None or d2s is not None or d3s is not None or ddev is not None or d2dev is not None:
                point = Point(b_along, b_across, c_along, c_across, cos_psi, sin_psi, t)
                _put_derivatives(ds, d2s, d3s, ddev, d2dev, i, j, r, at, point, code == st.OK)


@inline
def _put_derivatives(
    ds: Array | None, d2s: Array | None, d3s: Array | None, ddev: Array | None, d2dev: Array | None, i: int, j: int,
    r: Reduced, at: Place, point: Point, regular: bool,
) -> None:  # fmt: skip
    """Write the wanted derivatives up to the highest of them; (5)."""
    b_along, b_across, c_along, c_across, cos_psi, sin_psi, t = point
    per_t = 1.0 / t if regular else math.nan * t
    first = velocity(r, at, cos_psi, sin_psi, per_t)
    psi1 = first.p
    if ds is not None:
        ds[i, j] = -(b_across + psi1 * c_across) * r.unit
    if ddev is not None:
        ddev[i, j] = (b_along + psi1 * c_along) * r.unit
    if d2s is not None or d3s is not None or d2dev is not None:
        psi2 = acceleration(r, at, first, per_t)
        if d2s is not None:
            d2s[i, j] = -(b_along + psi2 * c_across + psi1 * psi1 * c_along) * r.unit
        if d2dev is not None:
            d2dev[i, j] = (psi2 * c_along - psi1 * psi1 * c_across - b_across) * r.unit
        if d3s is not None:
            psi3 = jerk(at, first, psi2, t, per_t)
            turning = (psi3 - psi1 * psi1 * psi1) * c_across
            d3s[i, j] = (b_across - turning - 3.0 * psi1 * psi2 * c_along) * r.unit
