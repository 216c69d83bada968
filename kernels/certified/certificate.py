"""Proof that a search has missed no peak of a curve y(phi) over the whole turn.

The turn is divided into cells of crank angle.  In each cell the family encloses its motion in a jet
(:mod:`kernels.certified.enclosure`), which bounds |y| there.  A cell is closed when this bound exceeds the best known
value by no more than the wanted relative error.  Otherwise a shorter cell is tried; where |y| turns out to be higher
than the best known value, the peak is climbed first and becomes the best known value.  At the end there is a value that
|y| takes somewhere, and a bound that it exceeds nowhere.

The walk is a state machine whose state is a small array, so that each family can write its own short loop around its
own enclosure::

    begin(state, place, target, most)
    while state[MODE] != DONE:
        encloses = ...  # jet of the curve about state[CENTRE] with reach state[REACH]
        judge(state, encloses, at, jet, order, y)

Only the truncation of the jet decides whether a cell is closed.  The rounding errors are added to the bound afterwards:
a motion that float64 knows badly then gets a wide bound, and the cells do not become shorter without end.
"""

from __future__ import annotations

import math

from kernels import status as st
from kernels.certified.enclosure import EPS, GUARD, ORDER, Array, ceiling, derivative, remainders
from kernels.jit import inline, kernel
from kernels.types import TWO_PI, Status

(MODE, CENTRE, REACH, EDGE, END, BEST, PLACE, NOISE, UPPER, TARGET, LEFT, BARREN, HERE, THERE) = range(14)
STATE = 14
CLIMB, COVER, MARCH, DONE = 0.0, 1.0, 2.0, 3.0
# CLIMB goes to the summit of a peak, COVER closes the first cell about it, MARCH goes from there round the turn.
SHARE = 0.67  # half a cell's width in reaches of its jet
WIDEST, GROWTH, FIRST, NARROWEST = 1.0, 1.5, 0.5, 1e-12
# Cells overlap by far more than angles below 16 are rounded by.
OVERLAP, SLACK = 1.0 + 2.0**-20, 2.0**-47


@inline
def begin(state: Array, place: float, target: float, most: int) -> None:
    """Prepare a walk from the crank angle ``place`` of the maximum found, with ``most`` enclosures at most."""
    state[MODE], state[CENTRE], state[REACH], state[EDGE], state[END] = CLIMB, place, FIRST, math.nan, math.nan
    state[BEST], state[PLACE], state[NOISE], state[UPPER] = -1.0, place, 0.0, 0.0
    state[TARGET], state[LEFT], state[BARREN], state[HERE], state[THERE] = target, most, 0.0, -1.0, place


@kernel
def judge(state: Array, encloses: bool, at: Array, jet: int, order: int, y: Array) -> None:
    """Take the enclosure that the state asked for, decide about its cell, and ask for the next one.

    Parameters
    ----------
    state : of :func:`begin`
    encloses : whether the family could enclose its motion about state[CENTRE] with reach state[REACH]
    at, jet : the jet whose derivative of that ``order`` is the curve
    y : (ORDER + 1,) scratch
    """
    share, noise, tail = share_of(state), 0.0, 0.0
    if encloses:
        derivative(at, jet, order, state[REACH], y)
        noise, tail = remainders(at, jet, order, state[REACH], share)
    decide(state, encloses, y, order, share, noise, tail)


@inline
def share_of(state: Array) -> float:
    """Half the width of a cell in reaches of its jet, with what cells overlap by."""
    share: float = SHARE * OVERLAP + SLACK / state[REACH]
    return share


@kernel
def decide(state: Array, encloses: bool, y: Array, order: int, share: float, noise: float, tail: float) -> None:
    """Decide about the cell that the state asked for, and ask for the next one.

    Parameters
    ----------
    state, encloses, order : as of :func:`judge`
    y : coefficients of the curve in z/reach, the derivative of that order
    share : of :func:`share_of`
    noise, tail : bounds of its remainders on |z| <= share reach
    """
    state[LEFT] -= 1.0
    if not (encloses and noise + tail < math.inf):  # false for nan
        _shorter(state, 0.4)
    elif state[MODE] != CLIMB or _climbed(state, y, noise):
        if state[MODE] == COVER:  # the same place with less reach has less noise
            state[BEST], state[NOISE] = abs(y[0]), noise
        _close(state, y, ORDER + 1 - order, share, noise, tail)
    if state[MODE] != DONE and not state[LEFT] > 0.0:
        state[MODE], state[UPPER] = DONE, math.inf


@inline
def conclude(
    state: Array, i: int, most: int, status: Status, maximum: Array, phi: Array, error: Array, cells: Array
) -> None:  # fmt: skip
    """Write what the walk of design i has proven; the arguments are those of the kernels that certify."""
    least, bound = (state[BEST] - state[NOISE]) / GUARD, state[UPPER]
    cells[i] = most - state[LEFT]
    if not bound < math.inf:
        status[i], error[i] = st.NOT_CONVERGED, math.nan
        return
    if not least <= maximum[i] <= bound:
        maximum[i], phi[i] = state[BEST], state[PLACE] - TWO_PI * math.floor(state[PLACE] / TWO_PI)
    error[i] = max(bound - maximum[i], maximum[i] - least) * GUARD


@inline
def _shorter(state: Array, factor: float) -> None:
    """Ask for a jet of less reach at the same place; a cell of the march keeps the edge at which it begins."""
    state[REACH] *= factor
    if state[MODE] == MARCH:
        state[CENTRE] = state[EDGE] + SHARE * state[REACH]
    if state[REACH] < NARROWEST:
        state[MODE], state[UPPER] = DONE, math.inf


@inline
def _climbed(state: Array, y: Array, noise: float) -> bool:
    """Make one step of Newton's method towards the summit of |y|.

    Returns true when the summit is reached and the first cell can be centred at it, so that it can be closed at once.
    """
    here, sign = abs(y[0]), 1.0 if y[0] >= 0.0 else -1.0
    slope, bend = sign * y[1], 2.0 * sign * y[2]
    first = state[EDGE] != state[EDGE]  # the edge is nan until a first cell has been closed
    if here > state[BEST]:
        state[BEST], state[PLACE], state[NOISE] = here, state[CENTRE], noise
    if here > state[HERE]:
        state[HERE], state[THERE] = here, state[CENTRE]
        step = -slope / bend if bend < 0.0 else math.copysign(SHARE, slope)
        step = min(max(step, -SHARE), SHARE)
        gain = abs(step * slope)
        worth = first or here + gain > state[BEST]
        if worth and gain > (1e-3 * state[TARGET] + 8.0 * EPS) * here + 0.01 * noise:
            state[CENTRE] += step * state[REACH]
            return False
    elif abs(state[CENTRE] - state[THERE]) > 1e-6 * state[REACH]:
        state[CENTRE] = 0.5 * (state[CENTRE] + state[THERE])
        return False
    at_summit = state[CENTRE] == state[THERE]
    state[CENTRE], state[MODE] = state[THERE], COVER if first else MARCH
    if not first:
        # A cell centred at the summit has the sharpest bound. It must begin at the edge, which fixes its reach.
        reach = (state[CENTRE] - state[EDGE]) / SHARE
        if 0.1 * state[REACH] < reach <= WIDEST:
            state[REACH] = reach
        state[CENTRE] = state[EDGE] + SHARE * state[REACH]
    return bool(first and at_summit)


@inline
def _close(state: Array, y: Array, count: int, share: float, noise: float, tail: float) -> None:
    """Close the cell if its bound is low enough; otherwise climb a higher peak in it, or ask for a shorter cell."""
    # The best value was computed about another place: its own rounding errors must not keep a cell open.
    rounded = state[NOISE] if state[MODE] == MARCH else 0.0
    limit = state[BEST] * (1.0 + state[TARGET]) + rounded
    bound = ceiling(y, count, share, tail) * GUARD
    if bound <= limit:
        state[UPPER] = max(state[UPPER], (bound + noise) * GUARD)
        half = SHARE * state[REACH]
        if state[MODE] == COVER:
            state[MODE], state[END] = MARCH, state[CENTRE] - half + TWO_PI
        state[EDGE] = state[CENTRE] + half
        state[BARREN] = 0.0
        if state[EDGE] >= state[END]:
            state[MODE] = DONE
        # The last cell ends where the first one began, at the foot of the highest peak.
        last = OVERLAP * (state[END] - state[EDGE]) / (2.0 * SHARE)
        state[REACH] = max(min(GROWTH * state[REACH], WIDEST, last), NARROWEST)
        state[CENTRE] = state[EDGE] + SHARE * state[REACH]
        return
    sign = 1.0 if y[0] >= 0.0 else -1.0
    slope, bend = sign * y[1], 2.0 * sign * y[2]
    summit = bend < 0.0 and abs(slope) < -SHARE * bend
    peak = abs(y[0]) - (0.5 * slope * slope / bend if summit else 0.0)
    promising = summit and peak > limit and abs(y[0]) > 0.9 * state[BEST] and state[BARREN] == 0.0
    higher = abs(y[0]) > limit or promising
    if state[MODE] == MARCH and higher:
        state[MODE], state[BARREN], state[HERE] = CLIMB, 1.0, -1.0
    else:
        _shorter(state, 0.5)
