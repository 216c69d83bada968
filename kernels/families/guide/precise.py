"""Motion of the guided four-bar for exactly the given doubles: everything in twice the working precision.

In plain arithmetic (:mod:`kernels.families.guide.motion`) the discriminant of a short coupler is a small difference of
large numbers, and so are the derivatives of the deviation along a nearly straight path.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kernels import status as st
from kernels.arithmetic import double_double as two
from kernels.arithmetic.double_double import Twofold
from kernels.families.guide.closure import reduce_design
from kernels.families.guide.motion import Outputs
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write
from kernels.linkage.verdict import pose_status
from kernels.types import EPS, Array, Status

BAND = 4.0 * EPS  # what rounding the given numbers does to Delta: a dead point made in float64 is still one


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


class Line(NamedTuple):
    """Frame of the guiding line: direction, (l/b) e^{-i lam} of the coupler point, and the unit of length."""

    cl: Twofold
    sl: Twofold
    qx: Twofold
    qy: Twofold
    unit: float


class Pose(NamedTuple):
    """Crank pin B, coupler d = C - B and rocker c k as vectors, and the two products of d with the rocker."""

    bx: Twofold
    by: Twofold
    dx: Twofold
    dy: Twofold
    cx: Twofold
    cy: Twofold
    rise: Twofold  # d . c k', half the derivative of d . d by the rocker angle
    inward: Twofold  # d . c k


@inline
def _carried(bx: Twofold, by: Twofold, dx: Twofold, dy: Twofold, line: Line) -> tuple[Twofold, Twofold]:
    """Return e^{-i lam} b + q d: along and across the line, of a point or a derivative of it."""
    along, across = _times(bx, by, line.cl, (-line.sl[0], -line.sl[1]))
    more, above = _times(dx, dy, line.qx, line.qy)
    return two.add(along, more), two.add(across, above)


@kernel
def precise_poses(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    status: Status,
    out: Outputs,
    joints: Array | None,
) -> None:
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
            if joints is not None:
                joints[0, i, j], joints[1, i, j] = bx[0] * unit, by[0] * unit
                joints[2, i, j], joints[3, i, j] = (e + cx[0]) * unit, cy[0] * unit
                mx, my = _times(dx, dy, lx, ly)
                joints[4, i, j], joints[5, i, j] = two.add(bx, mx)[0] * unit, two.add(by, my)[0] * unit
            if out.s is not None or out.dev is not None:
                along, across = _carried(bx, by, dx, dy, line)
                write(out.s, i, j, along[0] * unit)
                write(out.dev, i, j, two.add(across, (-h, 0.0))[0] * unit)
            if (
                out.ds is not None
                or out.d2s is not None
                or out.d3s is not None
                or out.ddev is not None
                or out.d2dev is not None
            ):
                at = Pose(bx, by, dx, dy, cx, cy, two.scale(t, c), two.scale(two.subtract((c, 0.0), w), c))
                _put_derivatives(out, i, j, at, line, code == st.OK)


@inline
def _put_derivatives(
    out: Outputs, i: int, j: int,
    at: Pose, line: Line, regular: bool,
) -> None:  # fmt: skip
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
