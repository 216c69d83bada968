"""Cells of crank angle, one per lane (a lane is a design): bounds of the curves on the cells, and the closing of cells.

These are the steps of :mod:`kernels.certified.covering` that all lanes make alike, without a branch, as vector code.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels.certified.jets import GUARD, LANES, NOISE, ORDER, TAIL
from kernels.jit import inline, kernel
from kernels.types import EPS, TWO_PI, Array

# Rows of a walk.  START is the edge furthest back, KEPT the reach of the march while a peak is climbed, HERE and THERE
# the highest value of that climb and its place, WHICH the number of the curve that is climbed or has kept a cell open;
# ROOM the factor of the next reach, ALONE whether the lane needs a decision of its own.
MODE, CENTRE, REACH, START, END, LEFT, KEPT, BARREN, HERE, THERE, WHICH, CELLS, ROOM, AHEAD, ALONE = (
    k * LANES for k in range(15)
)
WALK = 15 * LANES
# Rows of a curve: the edge up to which it is closed; best known value, its place and rounding error; proven bound; the
# next two closed arcs, by their middles and half their widths.  Then its coefficients and bounds on the present cell.
EDGE, BEST, PLACE, BLUR, UPPER, TOP, HALF, TOP2, HALF2 = (k * LANES for k in range(9))
Y0, Y1, Y2, Y3, Y4, Y5, Y6, OF_NOISE, OF_TAIL, WHOLE, PART, MIDDLE = (k * LANES for k in range(9, 21))
KEEP, CURVE = 9 * LANES, 21 * LANES  # rows that last for the whole walk, and all rows
CLIMB, COVER, MARCH, DONE = 0.0, 1.0, 2.0, 3.0
SHARE = 0.67  # half a cell's width in reaches of its jet
WIDEST, FIRST, FINEST = 1.0, 0.4, 1e-9
LEAST_GROWTH, MOST_GROWTH = 0.8, 1.4
REFUSED, NARROWED, HALVED = 0.4, 0.5, 0.75  # factors of the reach: no enclosure, nothing closed, the first half closed
RIVAL = 0.99  # of the best known value: a peak above this share gets an arc of its own
# The closed part is narrower than the bounded one by SLACK, which is far above the rounding of angles below 16.
SLACK = 2.0**-47
SHARE_MOST = SHARE + SLACK / FINEST + 2.0**-20
_ORDERS = 3
_NEVER_NEGATIVE = 1023


def _factors() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Tabulate the factors of the n-th derivative of x^k, of the noise and of the tail on |x| <= SHARE_MOST.

    The factor of x^k is k (k-1) ... (k-n+1).  Those of noise and tail are its largest product with SHARE_MOST^(k-n),
    over all k and over k > ORDER; the product falls with k from k = 2 ORDER on.
    """
    table = np.zeros((_ORDERS + 1, 2 * ORDER))
    for n in range(_ORDERS + 1):
        table[n, n:] = [math.perm(k, n) for k in range(n, 2 * ORDER)]
    sizes = table * SHARE_MOST ** np.maximum(np.arange(2 * ORDER) - np.arange(_ORDERS + 1)[:, None], 0)
    return table, sizes.max(axis=1) * GUARD, sizes[:, ORDER + 1 :].max(axis=1) * GUARD


_FACTOR, _NOISE_FACTOR, _TAIL_FACTOR = _factors()


@kernel
def weigh(lanes: int, walk: Array, curve: Array, jets: Array, order: int) -> None:
    """Bound a curve on the part of each lane's cell where it is not closed yet.

    Parameters
    ----------
    lanes : number of lanes in use
    walk : (WALK,)
    curve : (CURVE,); out: the coefficients Y of the curve in z/reach, bounds of its noise and tail, its bound WHOLE on
        that part and its bound PART from the edge to the MIDDLE of that part
    jets : of the motion; the curve is its derivative of ``order`` 0 to 3
    """
    for i in range(lanes):
        per = 1.0 / walk[REACH + i]
        scale = 1.0 if order == 0 else (per if order == 1 else (per * per if order == 2 else per * per * per))
        curve[WHOLE + i] = scale
        curve[OF_NOISE + i] = jets[NOISE * LANES + i] * (_NOISE_FACTOR[order] * scale) * GUARD
        curve[OF_TAIL + i] = jets[TAIL * LANES + i] * (_TAIL_FACTOR[order] * scale) * GUARD
    for k in range(ORDER + 1):
        # No slices, whose references would be counted; the masks tell the compiler that no index counts from the end.
        degree, to = k + order, (Y0 + k * LANES) & _NEVER_NEGATIVE
        if degree <= ORDER:
            factor, of = _FACTOR[order, degree], (degree * LANES) & _NEVER_NEGATIVE
            for i in range(lanes):
                curve[to + i] = jets[of + i] * (factor * curve[WHOLE + i])
        else:
            for i in range(lanes):
                curve[to + i] = 0.0
    _bound(lanes, walk, curve)


@inline
def _bound(lanes: int, walk: Array, curve: Array) -> None:
    """Bound |y| by a parabola whose curvature includes the magnitudes of all higher coefficients.

    |y(x)| <= |y0| + b x + c x^2 on |x| <= SHARE_MOST =: q, with c = +-y2 + sum |y_k| q^(k-2) + tail/q^2: a tail begins
    with x^4 at least.  About a summit of |y| in the middle of the cell the bound is sharp to third order.
    """
    q = SHARE_MOST
    for i in range(lanes):
        per = 1.0 / walk[REACH + i]
        slack = SLACK * per + 2.0**-21
        near, far = curve[TOP + i] - curve[HALF + i], curve[TOP2 + i] - curve[HALF2 + i]
        stop = near if near < far else far
        first = (curve[EDGE + i] - walk[CENTRE + i]) * per
        last = (stop - walk[CENTRE + i]) * per
        marching = walk[MODE + i] == MARCH
        first = first if marching & (first > -SHARE) else -SHARE
        last = last if marching & (last < SHARE) else SHARE
        halfway = 0.5 * (first + last)
        sign = 1.0 if curve[Y0 + i] >= 0.0 else -1.0
        a, b, bend = abs(curve[Y0 + i]), sign * curve[Y1 + i], sign * curve[Y2 + i]
        rest = curve[OF_TAIL + i] / (q * q)
        rest += abs(curve[Y3 + i]) * q + abs(curve[Y4 + i]) * (q * q)
        rest += abs(curve[Y5 + i]) * (q * q * q) + abs(curve[Y6 + i]) * (q * q * q * q)
        c = bend + rest
        # The coefficients are products of a few rounded factors, and y2 + rest may cancel.
        bent = q * (abs(curve[Y2 + i]) + rest)
        below, rounded = q * (abs(b) + bent) - a, 16.0 * EPS * (a + q * (abs(b) + bent))
        vertex = -0.5 * b / c
        summit = a + 0.5 * b * vertex
        x1, x2, x3 = first - slack, halfway + slack, last + slack
        g1, g2, g3 = a + x1 * (b + c * x1), a + x2 * (b + c * x2), a + x3 * (b + c * x3)
        half_way = g1 if g1 > g2 else g2
        half_way = summit if (c < 0.0) & (vertex > x1) & (vertex < x2) else half_way
        all_over = g1 if g1 > g3 else g3
        all_over = summit if (c < 0.0) & (vertex > x1) & (vertex < x3) else all_over
        curve[MIDDLE + i] = walk[CENTRE + i] + walk[REACH + i] * halfway
        curve[PART + i] = ((half_way if half_way > below else below) + rounded) * GUARD
        curve[WHOLE + i] = ((all_over if all_over > below else below) + rounded) * GUARD


@inline
def past_arc(marching: bool, edge: float, top: float, half: float) -> tuple[float, float]:
    """Move an edge that has reached a closed arc to the arc's end, and the arc to its copy a turn further."""
    past, end = marching & (edge >= top - half), top + half
    return (end if past & (end > edge) else edge), (top + TWO_PI if past else top)


@kernel
def advance(lanes: int, walk: Array, curve: Array, good: Array, target: float, number: int) -> None:
    """Close the cells of the marching lanes for one curve, wholly or the first half, where the curve's bound holds.

    Parameters
    ----------
    lanes, walk, curve : as of :func:`weigh`, after it
    good : (LANES,) 0 where the motion could not be enclosed
    target : relative error within which no other peak may be higher
    number : of the curve, written to WHICH where it keeps a cell open

    Before the first curve ROOM is to be MOST_GROWTH, AHEAD infinite and ALONE 0.
    """
    for i in range(lanes):
        # The best value's own rounding errors, of another place, must not keep a cell open.
        limit = curve[BEST + i] * (1.0 + target) + curve[BLUR + i]
        near, far = curve[TOP + i] - curve[HALF + i], curve[TOP2 + i] - curve[HALF2 + i]
        end = walk[CENTRE + i] + SHARE * walk[REACH + i]
        stop = near if near < far else far
        to = end if end < stop else stop
        marching = (walk[MODE + i] == MARCH) & (good[i] != 0.0)
        # A bound that is infinite or no number closes nothing.
        known = curve[OF_NOISE + i] + curve[OF_TAIL + i] < math.inf
        asked = marching & known & (curve[EDGE + i] < to)
        held, partly = curve[WHOLE + i] <= limit, (curve[PART + i] <= limit) & (curve[MIDDLE + i] > curve[EDGE + i])
        closed = asked & (held | partly)
        bound = curve[WHOLE + i] if held else curve[PART + i]
        proven = (bound + curve[OF_NOISE + i]) * GUARD
        curve[UPPER + i] = proven if closed & (proven > curve[UPPER + i]) else curve[UPPER + i]
        here = curve[EDGE + i]
        here = (to if held else curve[MIDDLE + i]) if closed else here
        # A tail grows with the reach to the power four at least.
        spare = math.sqrt(math.sqrt(0.3 * (1.0 + (limit - bound) / curve[OF_TAIL + i])))
        most = MOST_GROWTH if held else HALVED
        growth = spare if spare < most else most
        growth = LEAST_GROWTH if held & (growth < LEAST_GROWTH) else growth
        growth = growth if closed else NARROWED
        walk[ROOM + i] = growth if asked & (growth < walk[ROOM + i]) else walk[ROOM + i]
        walk[WHICH + i] = number if asked & (not held) else walk[WHICH + i]
        # A peak about the cell that is higher than the best known value, or nearly as high, is climbed.
        sign = 1.0 if curve[Y0 + i] >= 0.0 else -1.0
        y0, slope, bend = sign * curve[Y0 + i], sign * curve[Y1 + i], 2.0 * sign * curve[Y2 + i]
        summit = (bend < 0.0) & (abs(slope) < -SHARE * bend) & (walk[BARREN + i] == 0.0)
        rival = (y0 > limit) | (summit & (y0 - 0.5 * slope * slope / bend > RIVAL * limit))
        walk[ALONE + i] = 1.0 if asked & (not closed) & rival else walk[ALONE + i]
        # The edge passes closed arcs that it has reached; their next copies, a turn further, lie ahead.
        here, curve[TOP + i] = past_arc(marching, here, curve[TOP + i], curve[HALF + i])
        here, curve[TOP2 + i] = past_arc(marching, here, curve[TOP2 + i], curve[HALF2 + i])
        here, curve[TOP + i] = past_arc(marching, here, curve[TOP + i], curve[HALF + i])  # the second may end in it
        curve[EDGE + i] = here
        walk[AHEAD + i] = here if here < walk[AHEAD + i] else walk[AHEAD + i]


@kernel
def march(lanes: int, walk: Array, good: Array) -> None:
    """Set the next cells of the marching lanes, and mark lanes that need a decision of their own as ALONE."""
    for i in range(lanes):
        enclosed, reach, begin = good[i] != 0.0, walk[REACH + i], walk[START + i]
        marching = walk[MODE + i] == MARCH
        moved = marching & enclosed & (walk[AHEAD + i] > begin)
        begin = walk[AHEAD + i] if moved else begin
        done = marching & (begin >= walk[END + i])
        longer = reach * (walk[ROOM + i] if moved else (NARROWED if enclosed else REFUSED))
        last = (walk[END + i] - begin) / (2.0 * SHARE) * (1.0 + 2.0**-20)
        last = last if last > 0.5 * reach else 0.5 * reach
        longer = longer if longer < WIDEST else WIDEST
        longer = longer if longer < last else last
        stays = (not marching) | ((walk[ALONE + i] != 0.0) & (not moved))
        walk[LEFT + i] -= 1.0
        walk[CELLS + i] += 1.0
        walk[START + i] = begin
        walk[BARREN + i] = 0.0 if moved else walk[BARREN + i]
        walk[REACH + i] = reach if stays else longer
        walk[CENTRE + i] = walk[CENTRE + i] if stays else begin + SHARE * longer
        walk[MODE + i] = DONE if done else walk[MODE + i]
        stuck = (walk[LEFT + i] <= 0.0) | (longer <= FINEST)
        walk[ALONE + i] = 1.0 if (not done) & (stays | stuck) else 0.0
