"""Motion of the planar four-bar with a guided coupler point at given crank angles.

It is the needle-bar drive of the class-208 overlock machine: Polukhin 1971, section 4.4, as worked out in
docs/guide.md; the equation numbers are of that page.  Designs may be complex128 (exact gradients by the complex step).

:func:`precise_poses` is the motion for exactly the given doubles, everything in twice the working precision.  In plain
arithmetic the discriminant of a short coupler is a small difference of large numbers, and so are the derivatives of the
deviation along a nearly straight path.
"""

from __future__ import annotations

import math
from collections import namedtuple

import numpy as np

from kernels import status as st
from kernels.arithmetic import double_double as two
from kernels.arithmetic.complex_step import arctan2, magnitude
from kernels.arithmetic.double_double import Twofold
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
from kernels.linkage.outputs import put_block, write
from kernels.linkage.verdict import pose_status
from kernels.types import EPS, Array, Status

# Shares of the crank and of the rocker in the coupler point, along and across the line; the rocker; T.
# ``t``: root of the discriminant with the sign of the branch.
Point = namedtuple("Point", "b_along b_across c_along c_across cos_psi sin_psi t")


# Pose outputs, each (n, m), and joints (6, n, m); outputs of None are not computed.
Outputs = namedtuple("Outputs", "s ds d2s d3s dev ddev d2dev discriminant pressure_angle joints")


@kernel
def poses(designs: Array, cos_phi: Array, sin_phi: Array, status: Status, out: Outputs) -> None:
    """Travel along the line, deviation across it, and their derivatives, of every design at its crank angles.

    Equations (1)-(6) of docs/guide.md.

    Parameters
    ----------
    designs : (n, 9) columns as `PARAMETERS` of sweep/families/guide.py
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR or INVALID_INPUT
    s ... pressure_angle : (n, m) out [length; rad], or None: then it is neither computed nor compiled
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
            bx, by, cx, cy = r.a * u, r.a * v, r.e + r.c * cos_psi, r.c * sin_psi
            mx, my = bx + (r.xi * (cx - bx) - r.eta * (cy - by)), by + (r.xi * (cy - by) + r.eta * (cx - bx))
            put_block(out.joints, i, j, (bx, by, cx, cy, mx, my), r.unit)
            # The crank's and the rocker's share of the coupler point, in the frame of the line.
            b_along, b_across = r.p_along * u - r.p_across * v, r.p_along * v + r.p_across * u
            c_along = r.q_along * cos_psi - r.q_across * sin_psi
            c_across = r.q_along * sin_psi + r.q_across * cos_psi
            write(out.s, i, j, (b_along + c_along + r.along0) * r.unit)
            write(out.dev, i, j, (b_across + c_across + r.across0) * r.unit)
            # without a branch: arithmetic whose results are not wanted is dropped by the compiler
            point = Point(b_along, b_across, c_along, c_across, cos_psi, sin_psi, t)
            _put_derivatives(out, i, j, r, at, point, code == st.OK)


@inline
def _put_derivatives(out: Outputs, i: int, j: int, r: Reduced, at: ClosurePose, point: Point, regular: bool) -> None:
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
    designs : (n, 9) columns as `PARAMETERS` of sweep/families/guide.py
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


BAND = 4.0 * EPS  # effect of rounding the given numbers on Delta: a dead point rounded to float64 is still one


@inline
def _times(a: Twofold, b: Twofold, c: Twofold, d: Twofold) -> tuple[Twofold, Twofold]:
    """Return (a + i b)(c + i d)."""
    return (
        two.subtract(two.multiply(a, c), two.multiply(b, d)),
        two.add(two.multiply(a, d), two.multiply(b, c)),
    )


@inline
def _dot(a: Twofold, b: Twofold, c: Twofold, d: Twofold) -> Twofold:
    """Return (a, b) . (c, d)."""
    return two.add(two.multiply(a, c), two.multiply(b, d))


# Frame of the guiding line: direction, (l/b) e^{-i lam} of the coupler point, and the unit of length.
Line = namedtuple("Line", "cl sl qx qy unit")


# Crank pin B, coupler d = C - B and rocker c k as vectors, and the two products of d with the rocker.
# ``rise``: d . c k', half the derivative of d . d by the rocker angle; ``inward``: d . c k.
Pose = namedtuple("Pose", "bx by dx dy cx cy rise inward")


@inline
def _carried(bx: Twofold, by: Twofold, dx: Twofold, dy: Twofold, line: Line) -> tuple[Twofold, Twofold]:
    """Return e^{-i lam} b + q d: along and across the line, of a point or a derivative of it."""
    along, across = _times(bx, by, line.cl, (-line.sl[0], -line.sl[1]))
    more, above = _times(dx, dy, line.qx, line.qy)
    return two.add(along, more), two.add(across, above)


@kernel
def precise_poses(designs: Array, cos_phi: Array, sin_phi: Array, status: Status, out: Outputs) -> None:
    """Poses as of the module ``motion``, correct to a few roundings, for float64 designs only.

    Notes
    -----
    (cos phi, sin phi) give the direction of the crank, its length is the crank's.  With d = C - B and d . d = b^2 the
    derivatives follow from d . d' = 0, d . d'' = -d' . d', d . d''' = -3 d' . d''; the coupler point is B + (l/b) d.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        a, b, c, e, unit = r.a, r.b, r.c, r.e, r.unit
        two_c = 2.0 * c * unit * unit
        per_c, per_b = two.divide((1.0, 0.0), (c, 0.0), 1.0 / c), two.divide((1.0, 0.0), (b, 0.0), 1.0 / b)
        square = two.add(two.two_product(a, a), two.two_product(e, e))
        square = two.add(two.multiply(two.two_sum(c, -b), two.two_sum(c, b)), square)
        k0 = two.multiply(two.scale(square, 0.5), per_c)
        k2 = two.multiply(two.two_product(a, e), per_c)
        sl, cl = two.sine_cosine(designs[i, 6])
        per_unit = 1.0 / unit
        lx, ly = two.scale(per_b, designs[i, 4] * per_unit), two.scale(per_b, designs[i, 5] * per_unit)
        qx, qy = _times(lx, ly, cl, (-sl[0], -sl[1]))
        h = designs[i, 7] * per_unit
        line = Line(cl, sl, qx, qy, unit)
        for j in range(cos_phi.shape[1]):
            u, v = two.unit_vector(cos_phi[row, j], sin_phi[row, j])
            bx, by = two.scale(u, a), two.scale(v, a)
            x = two.subtract((e, 0.0), bx)
            w = two.subtract(k0, two.multiply(k2, u))
            rr = _dot(x, by, x, by)
            delta = two.subtract(rr, two.multiply(w, w))
            tolerance = BAND * (abs(x[0]) * r.x_size + abs(by[0]) * a + abs(w[0]) * r.w_size)
            tolerance += BAND * BAND * (r.x_size * r.x_size + a * a + r.w_size * r.w_size)
            code = pose_status(r.valid, delta[0], tolerance, rr[0])
            status[i, j] = code
            write(out.discriminant, i, j, (delta[0] * two_c) * two_c if r.valid else math.nan)
            assembled = code == st.OK or code == st.DEAD_POINT
            root = two.root(delta) if code == st.OK else (0.0, 0.0)
            t = two.scale(root, r.branch)
            per_rr = 1.0 / rr[0] if assembled else math.nan
            cos_psi = two.divide(_dot(x, by, (-w[0], -w[1]), (-t[0], -t[1])), rr, per_rr)
            sin_psi = two.divide(two.subtract(two.multiply(by, w), two.multiply(x, t)), rr, per_rr)
            cx, cy = two.scale(cos_psi, c), two.scale(sin_psi, c)  # the rocker; its pin is at (e, 0) + this
            dx, dy = two.add(x, cx), two.subtract(cy, by)
            if out.pressure_angle is not None:
                across_c = abs(two.subtract((c, 0.0), w)[0])
                write(out.pressure_angle, i, j, math.atan2(across_c, root[0]) if assembled else math.nan)
            mx, my = _times(dx, dy, lx, ly)
            at_joints = (bx[0], by[0], e + cx[0], cy[0], two.add(bx, mx)[0], two.add(by, my)[0])
            put_block(out.joints, i, j, at_joints, unit)
            if out.s is not None or out.dev is not None:
                along, across = _carried(bx, by, dx, dy, line)
                write(out.s, i, j, along[0] * unit)
                write(out.dev, i, j, two.add(across, (-h, 0.0))[0] * unit)
            at = Pose(bx, by, dx, dy, cx, cy, two.scale(t, c), two.scale(two.subtract((c, 0.0), w), c))
            _put_precise_derivatives(out, i, j, at, line, code == st.OK)


@inline
def _put_precise_derivatives(out: Outputs, i: int, j: int, at: Pose, line: Line, regular: bool) -> None:
    """Write the wanted derivatives up to the highest of them; p, q are psi', psi''."""
    bx, by, dx, dy, cx, cy, rise, inward = at
    per_rise = 1.0 / rise[0] if regular else math.nan
    b1x, b1y = (-by[0], -by[1]), bx  # B'; B'' = -B, B''' = -B'
    p = two.divide(_dot(dx, dy, b1x, b1y), rise, per_rise)
    d1x = two.subtract(two.multiply(p, (-cy[0], -cy[1])), b1x)
    d1y = two.subtract(two.multiply(p, cx), b1y)
    if out.ds is not None or out.ddev is not None:
        along, across = _carried(b1x, b1y, d1x, d1y, line)
        write(out.ds, i, j, along[0] * line.unit)
        write(out.ddev, i, j, across[0] * line.unit)
    if out.d2s is not None or out.d3s is not None or out.d2dev is not None:
        pp = two.multiply(p, p)
        rest = two.subtract(_dot(dx, dy, bx, by), two.multiply(pp, inward))
        q = two.divide(two.add(_dot(d1x, d1y, d1x, d1y), rest), rise, per_rise)
        q = (-q[0], -q[1])
        d2x = two.subtract(two.subtract(bx, two.multiply(q, cy)), two.multiply(pp, cx))
        d2y = two.add(two.subtract(by, two.multiply(pp, cy)), two.multiply(q, cx))
        if out.d2s is not None or out.d2dev is not None:
            along, across = _carried((-bx[0], -bx[1]), (-by[0], -by[1]), d2x, d2y, line)
            write(out.d2s, i, j, along[0] * line.unit)
            write(out.d2dev, i, j, across[0] * line.unit)
        if out.d3s is not None:
            pq = two.scale(two.multiply(p, q), 3.0)
            both = two.subtract(two.scale(_dot(d1x, d1y, d2x, d2y), 3.0), two.multiply(pq, inward))
            both = two.divide(both, rise, per_rise)
            # psi''' - psi'^3
            turn = two.subtract((-p[0], -p[1]), both)
            d3x = two.subtract(two.subtract(b1x, two.multiply(turn, cy)), two.multiply(pq, cx))
            d3y = two.add(two.subtract(b1y, two.multiply(pq, cy)), two.multiply(turn, cx))
            along, _ = _carried((-b1x[0], -b1x[1]), (-b1y[0], -b1y[1]), d3x, d3y, line)
            write(out.d3s, i, j, along[0] * line.unit)
