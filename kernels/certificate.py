"""Proof that no peak of a curve over the whole turn was missed: cells of crank angle, each with an enclosure.

The turn is covered cell by cell.  In each the family encloses its motion in a jet (:mod:`kernels.enclosure`), and the
cell is closed when the bound of |y| in it does not exceed the best value known by more than the wanted relative error;
otherwise a shorter cell is tried, and where a higher peak shows the search climbs it and goes on with that.  So what is
left at the end is a value that |y| takes and a bound that it exceeds nowhere.

The state is a small array, so that each family can write its own short loop around its own enclosure::

    begin(state, place, target, most)
    while state[MODE] != DONE:
        encloses = ...  # jet of the curve about state[CENTRE] with reach state[REACH]
        judge(state, encloses, at, jet, order, y)

Truncation decides whether a cell is closed, rounding does not: it is added to the bound, so a motion that float64 knows
badly gets a wide bound instead of endless cells.
"""

from __future__ import annotations

import math

from kernels._jit import inline, kernel
from kernels.enclosure import EPS, GUARD, ORDER, Array, ceiling, derivative, remainders

(MODE, CENTRE, REACH, EDGE, END, BEST, PLACE, NOISE, UPPER, TARGET, LEFT, BARREN, HERE, THERE) = range(14)
STATE = 14
CLIMB, COVER, MARCH, DONE = 0.0, 1.0, 2.0, 3.0
TURN = 2.0 * math.pi
SHARE = 0.67  # half a cell's width in reaches of its jet
WIDEST, GROWTH, FIRST, NARROWEST = 1.0, 1.5, 0.5, 1e-12
# Cells overlap by far more than angles below 16 are rounded by.
OVERLAP, SLACK = 1.0 + 2.0**-20, 2.0**-47


@inline
def begin(state: Array, place: float, target: float, most: int) -> None:
    """Start at a place where the search found the maximum; at most so many enclosures."""
    state[MODE], state[CENTRE], state[REACH], state[EDGE], state[END] = CLIMB, place, FIRST, math.nan, math.nan
    state[BEST], state[PLACE], state[NOISE], state[UPPER] = -1.0, place, 0.0, 0.0
    state[TARGET], state[LEFT], state[BARREN], state[HERE], state[THERE] = target, most, 0.0, -1.0, place


@kernel
def judge(state: Array, encloses: bool, at: Array, jet: int, order: int, y: Array) -> None:
    """Learn from the enclosure asked for, and ask for the next one.

    Parameters
    ----------
    state : of :func:`begin`
    encloses : whether the family could enclose its motion there
    at, jet : the jet whose derivative of that ``order`` is the curve
    y : (ORDER + 1,) scratch
    """
    state[LEFT] -= 1.0
    share, noise, tail = SHARE * OVERLAP + SLACK / state[REACH], 0.0, 0.0
    if encloses:
        derivative(at, jet, order, state[REACH], y)
        noise, tail = remainders(at, jet, order, state[REACH], share)
        encloses = noise + tail < math.inf  # false for nan
    if not encloses:
        _shorter(state, 0.4)
    elif state[MODE] != CLIMB or _climbed(state, y, noise):
        if state[MODE] == COVER:  # the same place with less reach has less noise
            state[BEST], state[NOISE] = abs(y[0]), noise
        _close(state, y, ORDER + 1 - order, share, noise, tail)
    if state[MODE] != DONE and not state[LEFT] > 0.0:
        state[MODE], state[UPPER] = DONE, math.inf


@inline
def _shorter(state: Array, factor: float) -> None:
    """The same place again with less reach; in a march the near edge of the cell stays."""
    state[REACH] *= factor
    if state[MODE] == MARCH:
        state[CENTRE] = state[EDGE] + SHARE * state[REACH]
    if state[REACH] < NARROWEST:
        state[MODE], state[UPPER] = DONE, math.inf


@inline
def _climbed(state: Array, y: Array, noise: float) -> bool:
    """A step of Newton's method to the summit of |y|; whether it is reached and the first cell may be about it."""
    here, sign = abs(y[0]), 1.0 if y[0] >= 0.0 else -1.0
    slope, bend = sign * y[1], 2.0 * sign * y[2]
    first = state[EDGE] != state[EDGE]  # nan until there is a cell
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
        # A cell about the summit has the sharpest bound, if it can begin at the edge.
        reach = (state[CENTRE] - state[EDGE]) / SHARE
        if 0.1 * state[REACH] < reach <= WIDEST:
            state[REACH] = reach
        state[CENTRE] = state[EDGE] + SHARE * state[REACH]
    return bool(first and at_summit)


@inline
def _close(state: Array, y: Array, count: int, share: float, noise: float, tail: float) -> None:
    """Close the cell if its bound allows, else climb a peak in it, else ask for a shorter cell."""
    # Values about other places are rounded otherwise than the best one.
    rounded = state[NOISE] if state[MODE] == MARCH else 0.0
    limit = state[BEST] * (1.0 + state[TARGET]) + rounded
    bound = ceiling(y, count, share, tail) * GUARD
    if bound <= limit:
        state[UPPER] = max(state[UPPER], (bound + noise) * GUARD)
        half = SHARE * state[REACH]
        if state[MODE] == COVER:
            state[MODE], state[END] = MARCH, state[CENTRE] - half + TURN
        state[EDGE] = state[CENTRE] + half
        state[BARREN] = 0.0
        if state[EDGE] >= state[END]:
            state[MODE] = DONE
        # Not farther than to the end, beyond which the highest peak itself stands.
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
