"""Nearest point under hundreds of rows along turns, of which few are active: rows join where they are needed.

A program similar to the one before starts from the active rows of that one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.jit import inline, kernel, part
from kernels.linear.nearest import Held, Index, dropped, nothing_held, pursued, shares, taken_in
from kernels.types import Array

INDEPENDENT = 1e-12  # square of a formerly active row's remainder, relative to the row's, to be activated again


@inline
def _place_of(place: Index, count: int, number: int) -> int:
    """Place of a number among the first ``count``; -1 if it is not there."""
    for k in range(count):
        if place[k] == number:
            return k
    return -1


@part
def _resumed(rows: Array, needs: Array, size: Array, begin: Index, centre: Array, y: Array, h: Held) -> int:
    """Activate formerly active rows, without those of negative multiplier; return the number of active rows.

    The method may start from the nearest point with these rows as equations, as long as no multiplier is negative.
    """
    n, count = rows.shape[0], 0
    for k in range(begin[0]):
        p = begin[1 + k]
        square = shares(rows, p, count, h)
        if count < n and square > INDEPENDENT * size[p] * size[p]:
            taken_in(p, count, square, h)
            count += 1
    while count > 0:
        # With the rows N = Q R the point is centre + Q z with R' z = needs - N' centre, the weights solve R w = z.
        for k in range(count):
            value = needs[h.numbers[k]]
            for i in range(n):
                value -= rows[i, h.numbers[k]] * centre[i]
            for j in range(k):
                value -= h.r[j, k] * h.z[j]
            h.z[k] = value / h.r[k, k]
        worst, least = -1, 0.0
        for k in range(count - 1, -1, -1):
            value = h.z[k]
            for j in range(k + 1, count):
                value -= h.r[k, j] * h.weights[j]
            h.weights[k] = value / h.r[k, k]
            if h.weights[k] < least:
                worst, least = k, h.weights[k]
        if worst < 0:
            break
        dropped(worst, count, h)
        count -= 1
    for i in range(n):
        y[i] = centre[i]
        for k in range(count):
            y[i] += h.q[i, k] * h.z[k]
    return count


@inline
def _peaks(values: Array, below: float, turns: Index, lowest: Index, found: Index) -> None:
    """Mark the values below a bound that are local minima along a turn, or neighbours of one.

    Values that belong to no turn are marked wherever they are below.
    """
    last = turns.shape[1] - 1
    for j in range(len(values)):
        found[j] = 1 if values[j] < below else 0
    for t in range(turns.shape[0]):
        for p in range(last + 1):
            before, after = turns[t, p - 1 if p > 0 else last], turns[t, p + 1 if p < last else 0]
            here = values[turns[t, p]]
            lowest[p] = 1 if here <= values[before] and here <= values[after] else 0
        for p in range(last + 1):
            if lowest[p] + lowest[p - 1 if p > 0 else last] + lowest[p + 1 if p < last else 0] == 0:
                found[turns[t, p]] = 0


@inline
def _box_rows(low: Array, high: Array, back: Array, rows: Array, needs: Array, size: Array) -> None:
    """Write the bounds of the step as the first rows."""
    n = len(low)
    for k in range(n + len(high)):
        sign, i = (1.0, k) if k < n else (-1.0, k - n)
        needs[k] = low[i] if k < n else -high[i]
        square = 0.0
        for a in range(n):
            rows[a, k] = sign * back[i, a]
            square += back[i, a] * back[i, a]
        size[k] = math.sqrt(square)


@inline
def _own_row(slopes: Array, j: int, back: Array, rows: Array, place: int) -> float:
    """Write row j of the program in the coordinates y; return its size."""
    square = 0.0
    for a in range(slopes.shape[0]):
        value = 0.0
        for i in range(slopes.shape[0]):
            value += back[i, a] * slopes[i, j]
        rows[a, place] = value
        square += value * value
    return math.sqrt(square)


@inline
def _stepped(values: Array, slopes: Array, back: Array, y: Array, step: Array, there: Array) -> None:
    """Write the step of a point y, and the values of the rows after the step."""
    for j in range(len(values)):
        there[j] = values[j]
    for i in range(len(y)):
        step[i] = 0.0
        for a in range(len(y)):
            step[i] += back[i, a] * y[a]
        for j in range(len(values)):
            there[j] += step[i] * slopes[i, j]


class CurveRows(NamedTuple):
    """Rows of a program, ``values + step slopes >= 0``.

    Parameters
    ----------
    values, slopes : (r,) and (n, r)
    turns : (T, m) numbers of the rows that form one curve around its turn
    """

    values: Array
    slopes: Array
    turns: Index


class Nearest(NamedTuple):
    """Solution of a program.

    Parameters
    ----------
    step, there, weights : (n,), (r,) and (r,): the step, the rows after it, and their multipliers, none negative
    begin : (n + 1,) in: number of the active rows of a similar program, then these rows, from which to start; bounds of
        the box count backwards from -1.  Out: the same for this program
    """

    step: Array
    there: Array
    weights: Array
    begin: Index


@kernel
def nearest_of_many(
    of: CurveRows, back: Array, centre: Array, low: Array, high: Array, near: tuple[float, float], rounds: int,
    tolerance: float, found: Nearest,
) -> int:  # fmt: skip
    """Solve a quadratic program with hundreds of rows along turns, of which few are active.

    The step is ``back y`` with y nearest to a centre.  Rows join where they are near their bound and lowest among their
    neighbours along a turn, and later where the step found would violate them.

    Parameters
    ----------
    of : rows
    back : (n, n) matrix that turns y into the step
    centre : (n,)
    low, high : (n,) and (h,) bounds of the step, of its first h elements from above
    near : value below which a row joins at first, and violation above which a row joins later
    rounds : most rounds in which rows join
    tolerance : see :func:`kernels.linear.nearest.nearest`
    found : out

    Returns
    -------
    Status of the last round, as of :func:`kernels.linear.nearest.nearest`.
    """
    (values, slopes, turns), (step, there, weights, begin) = of, found
    n, count = slopes.shape
    boxes = n + len(high)
    rows, needs, size = np.empty((n, count + boxes)), np.empty(count + boxes), np.empty(count + boxes)
    more, joined, lowest = np.empty(count, np.int64), np.zeros(count, np.int64), np.empty(turns.shape[1], np.int64)
    place, y, h = np.empty(count, np.int64), np.empty(n), nothing_held(n, count + boxes)
    _box_rows(low, high, back, rows, needs, size)
    for i in range(n):
        y[i] = centre[i]
    _peaks(values, near[0], turns, lowest, more)
    for k in range(begin[0]):
        if begin[1 + k] >= 0:
            more[begin[1 + k]] = 1
    total, held, status = boxes, -1, int(st.OK)
    for _ in range(rounds):
        for j in range(count):
            if more[j] == 1 and joined[j] == 0:
                joined[j], place[total - boxes], needs[total] = 1, j, -values[j]
                size[total] = _own_row(slopes, j, back, rows, total)
                total += 1
        if held < 0:
            for k in range(begin[0]):
                number = begin[1 + k]
                begin[1 + k] = -1 - number if number < 0 else boxes + _place_of(place, total - boxes, number)
            held = _resumed(rows, needs, size, begin, centre, y, h)
        held, status = pursued(rows, needs, size, total, tolerance, y, h, held)
        _stepped(values, slopes, back, y, step, there)
        _peaks(there, -near[1], turns, lowest, more)
        new = 0
        for j in range(count):
            new += more[j] * (1 - joined[j])
        if new == 0 or status != st.OK:
            break
    for j in range(count):
        weights[j] = 0.0
    begin[0] = held
    for k in range(held):
        own = h.numbers[k] >= boxes
        begin[1 + k] = place[h.numbers[k] - boxes] if own else -1 - h.numbers[k]
        if own:
            weights[begin[1 + k]] = h.weights[k]
    return status
