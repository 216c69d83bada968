"""Proof that a search has missed no peak of several curves of one motion, for designs side by side.

The turn is divided into cells of crank angle.  In each the family encloses its motion in jets
(:mod:`kernels.certified.jets`), which bound |y| there.  A cell is closed for a curve when its bound exceeds the best
known value by no more than the wanted relative error.  At the end there is a value that |y| takes somewhere, and a
bound that it exceeds nowhere.  One enclosure serves all curves of the motion.

* First the peak of every curve is climbed and an arc about it is closed by a cell centred at the summit, where the
  bound is sharpest.
* Then cells march round the turn.  Each curve has its own edge, up to which it is closed.  A cell begins at the edge
  that lies furthest back and takes along all curves whose bound holds, as far as their next closed arc, or half way
  where it holds on half of the cell only.
* Where a curve turns out to be higher than its best known value, or nearly as high, that peak is climbed and gets an
  arc of its own.  Cells closed before stay closed when the best value rises.
* A curve that cannot be proven is given up, and the others go on.

Cells are bounded and closed in all lanes at once (:mod:`kernels.certified.cells`); climbing, closing arcs and failures
need decisions of their own, which are made lane by lane (:func:`decide`).  Only the truncation of a jet
decides; rounding errors are added to the bound afterwards: a motion that float64 knows badly then gets a wide bound,
and the cells do not become shorter without end.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.certified.cells import (
    AHEAD,
    ALONE,
    BARREN,
    BEST,
    BLUR,
    CENTRE,
    CLIMB,
    COVER,
    DONE,
    EDGE,
    END,
    FINEST,
    FIRST,
    HALF,
    HALF2,
    HERE,
    KEEP,
    KEPT,
    LEFT,
    MARCH,
    MODE,
    MOST_GROWTH,
    NARROWED,
    OF_NOISE,
    PLACE,
    REACH,
    REFUSED,
    RIVAL,
    ROOM,
    SHARE,
    SLACK,
    START,
    THERE,
    TOP,
    TOP2,
    UPPER,
    WALK,
    WHICH,
    WHOLE,
    WIDEST,
    Y0,
    Y1,
    Y2,
    advance,
    march,
    past_arc,
    weigh,
)
from kernels.certified.jets import GUARD, LANES
from kernels.jit import inline, kernel
from kernels.types import EPS, Array
from kernels.types import TWO_PI as TURN

SHARPENED = 0.6  # factor of the reach where an arc cannot be closed


@inline
def begin(lane: int, walk: Array, curves: Array, places: Array, i: int, most: int) -> None:
    """Prepare the walk of design i from the places (curves, n) of the maxima found; ``most`` enclosures are allowed."""
    for row in range(0, WALK, LANES):
        walk[row + lane] = 0.0
    walk[REACH + lane], walk[LEFT + lane], walk[HERE + lane] = FIRST, most, -1.0
    for j in range(curves.shape[0]):
        for row in range(0, KEEP, LANES):
            curves[j, row + lane] = 0.0
        place = places[j, i] - TURN * math.floor(places[j, i] / TURN)
        place = place if 0.0 <= place <= TURN else 0.0  # of a nan: any place will do
        curves[j, BEST + lane], curves[j, PLACE + lane] = -1.0, place
        curves[j, TOP + lane], curves[j, TOP2 + lane] = math.inf, math.inf
    walk[CENTRE + lane] = walk[THERE + lane] = curves[0, PLACE + lane]


@kernel
def close(
    lanes: int, walk: Array, curves: Array, jets: Array, places: NDArray[np.int64], orders: NDArray[np.int64],
    good: Array, target: float,
) -> None:  # fmt: skip
    """Close the present cells of all lanes in use, and set the next cells where no decision is needed.

    Parameters
    ----------
    lanes, walk, curves, good, target : as of :func:`decide` and :func:`kernels.certified.cells.advance`
    jets, places, orders : jets of the motion; each curve is the derivative of that order of the jet at that place
    """
    for i in range(lanes):
        walk[ROOM + i], walk[AHEAD + i], walk[ALONE + i] = MOST_GROWTH, math.inf, 0.0
    for j in range(curves.shape[0]):
        curve = curves[j]
        weigh(lanes, walk, curve, jets[places[j] :], orders[j])
        advance(lanes, walk, curve, good, target, j)
    march(lanes, walk, good)


@kernel
def decide(lane: int, encloses: bool, walk: Array, curves: Array, target: float, most: int) -> None:
    """Decide about the cell of a lane that is marked ALONE, and set the lane's next cell.

    Parameters
    ----------
    lane : number of the lane
    encloses : whether the motion of its design could be enclosed
    walk, curves : (WALK,) and (number of curves, CURVE), after :func:`close`
    target : relative error within which no other peak may be higher
    most : enclosures until a curve is given up
    """
    marching = walk[MODE + lane] == MARCH
    stuck = not (walk[LEFT + lane] > 0.0 and walk[REACH + lane] > FINEST)
    if marching and not stuck:  # the peak of a rival is climbed
        walk[MODE + lane], walk[BARREN + lane], walk[HERE + lane] = CLIMB, 1.0, -1.0
        walk[KEPT + lane] = NARROWED * walk[REACH + lane]
    if not stuck and not encloses:
        walk[REACH + lane] *= REFUSED
    elif not stuck and (walk[MODE + lane] == COVER or _climb(lane, walk, curves, target)):
        _cover(lane, walk, curves, target)
    if stuck:
        _give_up(lane, walk, curves, most)


# The functions below have one exit each: with more, the references to each array are counted in every call, which took
# a third of the time.


@inline
def _next(lane: int, walk: Array) -> None:
    """Set the cell that begins at the edge furthest back."""
    walk[REACH + lane] = min(walk[REACH + lane], WIDEST)
    walk[CENTRE + lane] = walk[START + lane] + SHARE * walk[REACH + lane]


@inline
def _climb(lane: int, walk: Array, curves: Array, target: float) -> bool:
    """Make one step of Newton's method towards the summit of |y|; true if the cell can be closed at once.

    That is when the summit is reached and the cell is centred at it.
    """
    j = int(walk[WHICH + lane])
    y0, centre, reach = curves[j, Y0 + lane], walk[CENTRE + lane], walk[REACH + lane]
    here, sign = abs(y0), 1.0 if y0 >= 0.0 else -1.0
    slope, bend = sign * curves[j, Y1 + lane], 2.0 * sign * curves[j, Y2 + lane]
    higher, to = here > walk[HERE + lane], centre
    if higher:
        walk[HERE + lane], walk[THERE + lane] = here, centre
        step = -slope / bend if bend < 0.0 else math.copysign(SHARE, slope)
        step = min(max(step, -SHARE), SHARE)
        gain = abs(step * slope)
        worth = curves[j, BEST + lane] < 0.0 or here + gain > RIVAL * curves[j, BEST + lane]
        if worth and gain > (1e-3 * target + 8.0 * EPS) * here + 0.01 * curves[j, OF_NOISE + lane]:
            to = centre + step * reach
    elif abs(centre - walk[THERE + lane]) > 1e-6 * reach:
        to = 0.5 * (centre + walk[THERE + lane])
    at_summit = False
    if to != centre:
        walk[CENTRE + lane] = to
    elif walk[HERE + lane] < RIVAL * curves[j, BEST + lane]:
        _resume(lane, walk)
    else:
        at_summit = higher
        walk[MODE + lane], walk[CENTRE + lane] = COVER, walk[THERE + lane]
    return at_summit


@inline
def _cover(lane: int, walk: Array, curves: Array, target: float) -> None:
    """Close an arc about a summit; where the bound does not hold, set a shorter cell."""
    j, first = int(walk[WHICH + lane]), walk[END + lane] == 0.0
    here, blur = abs(curves[j, Y0 + lane]), curves[j, OF_NOISE + lane]
    best = here if first else max(here, curves[j, BEST + lane])
    limit = best * (1.0 + target) + (0.0 if first else max(blur, curves[j, BLUR + lane]))
    if curves[j, WHOLE + lane] <= limit and blur < math.inf:
        curves[j, UPPER + lane] = max(curves[j, UPPER + lane], (curves[j, WHOLE + lane] + blur) * GUARD)
        middle, half = walk[CENTRE + lane], SHARE * walk[REACH + lane]
        if first or here > curves[j, BEST + lane]:
            curves[j, TOP2 + lane], curves[j, HALF2 + lane] = curves[j, TOP + lane], curves[j, HALF + lane]
            curves[j, TOP + lane], curves[j, HALF + lane] = middle, half
            curves[j, BEST + lane], curves[j, PLACE + lane], curves[j, BLUR + lane] = here, middle, blur
        else:
            curves[j, TOP2 + lane], curves[j, HALF2 + lane] = middle, half
        if first:
            _next_curve(lane, walk, curves)
        else:
            _bring_arcs_ahead(lane, curves, j)
            walk[START + lane], walk[BARREN + lane] = _furthest_back(lane, curves), 0.0
            _resume(lane, walk)
    else:
        walk[REACH + lane] *= SHARPENED
        if not first and walk[REACH + lane] < 0.02 * walk[KEPT + lane]:  # there is no summit
            _resume(lane, walk)


@inline
def _bring_arcs_ahead(lane: int, curves: Array, j: int) -> None:
    """Shift a curve's closed arcs by whole turns to end ahead of its edge; move the edge past arcs it has reached."""
    edge, top, half = curves[j, EDGE + lane], curves[j, TOP + lane], curves[j, HALF + lane]
    top2, half2 = curves[j, TOP2 + lane], curves[j, HALF2 + lane]
    top += TURN * math.ceil((edge - top - half) / TURN)
    if top2 < math.inf:
        top2 += TURN * math.ceil((edge - top2 - half2) / TURN)
    edge, top = past_arc(True, edge, top, half)
    edge, top2 = past_arc(True, edge, top2, half2)
    edge, top = past_arc(True, edge, top, half)
    curves[j, EDGE + lane], curves[j, TOP + lane], curves[j, TOP2 + lane] = edge, top, top2


@inline
def _furthest_back(lane: int, curves: Array) -> float:
    """Least edge of all curves, at which the next cell begins; infinite where all curves are given up."""
    start = math.inf
    for j in range(curves.shape[0]):
        start = min(start, curves[j, EDGE + lane])
    return start


@inline
def _resume(lane: int, walk: Array) -> None:
    """Resume the march after a climb, with the reach that it had."""
    walk[MODE + lane] = MARCH if walk[START + lane] < walk[END + lane] else DONE
    walk[REACH + lane] = walk[KEPT + lane]
    _next(lane, walk)


@inline
def _next_curve(lane: int, walk: Array, curves: Array) -> None:
    """Begin to climb the peak of the next curve; after the last curve begin the march, at the end of the first arc."""
    j = int(walk[WHICH + lane]) + 1
    if j < curves.shape[0]:
        walk[MODE + lane], walk[WHICH + lane], walk[HERE + lane] = CLIMB, j, -1.0
        walk[CENTRE + lane] = curves[j, PLACE + lane]
    else:
        start = math.inf
        for k in range(curves.shape[0]):
            if start == math.inf and curves[k, EDGE + lane] < math.inf:
                start = curves[k, TOP + lane] + curves[k, HALF + lane]
        # Both ends are closed further than that: rounding must not leave a cell of no width.
        walk[END + lane], walk[KEPT + lane] = start + TURN - 0.5 * SLACK, MOST_GROWTH * walk[REACH + lane]
        for k in range(curves.shape[0]):
            if curves[k, EDGE + lane] < math.inf:
                curves[k, EDGE + lane] = start
                _bring_arcs_ahead(lane, curves, k)
        walk[START + lane] = _furthest_back(lane, curves)
        _resume(lane, walk)


@inline
def _give_up(lane: int, walk: Array, curves: Array, most: int) -> None:
    """Give up the curve that holds up the walk."""
    first, which = walk[END + lane] == 0.0, int(walk[WHICH + lane])
    if not first and curves[which, EDGE + lane] > walk[START + lane]:
        for j in range(curves.shape[0]):
            which = j if curves[j, EDGE + lane] == walk[START + lane] else which
    curves[which, EDGE + lane] = curves[which, UPPER + lane] = math.inf
    walk[LEFT + lane], walk[REACH + lane], walk[KEPT + lane] = most, FIRST, FIRST
    if first:
        _next_curve(lane, walk, curves)
    else:
        walk[START + lane] = _furthest_back(lane, curves)
        _resume(lane, walk)


@inline
def conclude(
    lane: int, curves: Array, j: int, i: int, status: NDArray[np.uint8], maximum: Array, phi: Array, error: Array
) -> None:
    """Write the proven maximum of curve j of design i and its error; arguments as of the kernel that certifies."""
    least, bound = (curves[j, BEST + lane] - curves[j, BLUR + lane]) / GUARD, curves[j, UPPER + lane]
    if bound < math.inf:
        if not least <= maximum[j, i] <= bound:
            maximum[j, i] = curves[j, BEST + lane]
            phi[j, i] = curves[j, PLACE + lane] - TURN * math.floor(curves[j, PLACE + lane] / TURN)
        error[j, i] = max(bound - maximum[j, i], maximum[j, i] - least) * GUARD
    else:
        status[j, i], error[j, i] = st.NOT_CONVERGED, math.nan
