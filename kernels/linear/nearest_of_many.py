"""Nearest point under hundreds of rows along turns, of which few are active: rows join where they are needed.

A program similar to the one before starts from the active rows of that one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.jit import inline, kernel, part
from kernels.linear.nearest import ActiveSet, Index, activate, continued, deactivate, no_active_rows, split_row
from kernels.types import Array

INDEPENDENT = 1e-12  # square of a formerly active row's remainder, relative to the row's, to be activated again


@inline
def _index_of(numbers: Index, count: int, number: int) -> int:
    """Place of a number among the first ``count``; -1 if it is not there."""
    for k in range(count):
        if numbers[k] == number:
            return k
    return -1


@part
def _warm_start(rows: Array, rhs: Array, size: Array, active: Index, centre: Array, y: Array, h: ActiveSet) -> int:
    """Activate formerly active rows, without those of negative multiplier; return the number of active rows.

    The method may start from the nearest point with these rows as equations, as long as no multiplier is negative.
    """
    n, count = rows.shape[0], 0
    for k in range(active[0]):
        p = active[1 + k]
        square = split_row(rows, p, count, h)
        if count < n and square > INDEPENDENT * size[p] * size[p]:
            activate(p, count, square, h)
            count += 1
    while count > 0:
        # With the rows N = Q R the point is centre + Q z with R' z = rhs - N' centre, the weights solve R w = z.
        for k in range(count):
            value = rhs[h.numbers[k]]
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
        deactivate(worst, count, h)
        count -= 1
    for i in range(n):
        y[i] = centre[i]
        for k in range(count):
            y[i] += h.q[i, k] * h.z[k]
    return count


@inline
def _mark_minima(values: Array, threshold: float, turns: Index, lowest: Index, marked: Index) -> None:
    """Mark the values below a bound that are local minima along a turn, or neighbours of one.

    Values that belong to no turn are marked wherever they are below.
    """
    last = turns.shape[1] - 1
    for j in range(len(values)):
        marked[j] = 1 if values[j] < threshold else 0
    for t in range(turns.shape[0]):
        for p in range(last + 1):
            before, after = turns[t, p - 1 if p > 0 else last], turns[t, p + 1 if p < last else 0]
            value = values[turns[t, p]]
            lowest[p] = 1 if value <= values[before] and value <= values[after] else 0
        for p in range(last + 1):
            if lowest[p] + lowest[p - 1 if p > 0 else last] + lowest[p + 1 if p < last else 0] == 0:
                marked[turns[t, p]] = 0


@inline
def _box_rows(low: Array, high: Array, transform: Array, rows: Array, rhs: Array, size: Array) -> None:
    """Write the bounds of the step as the first rows."""
    n = len(low)
    for k in range(n + len(high)):
        sign, i = (1.0, k) if k < n else (-1.0, k - n)
        rhs[k] = low[i] if k < n else -high[i]
        square = 0.0
        for a in range(n):
            rows[a, k] = sign * transform[i, a]
            square += transform[i, a] * transform[i, a]
        size[k] = math.sqrt(square)


@inline
def _transformed_row(slopes: Array, j: int, transform: Array, rows: Array, column: int) -> float:
    """Write row j of the program in the coordinates y; return its size."""
    square = 0.0
    for a in range(slopes.shape[0]):
        value = 0.0
        for i in range(slopes.shape[0]):
            value += transform[i, a] * slopes[i, j]
        rows[a, column] = value
        square += value * value
    return math.sqrt(square)


@inline
def _write_step(values: Array, slopes: Array, transform: Array, y: Array, step: Array, predicted: Array) -> None:
    """Write the step of a point y, and the values of the rows after the step."""
    for j in range(len(values)):
        predicted[j] = values[j]
    for i in range(len(y)):
        step[i] = 0.0
        for a in range(len(y)):
            step[i] += transform[i, a] * y[a]
        for j in range(len(values)):
            predicted[j] += step[i] * slopes[i, j]


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
    step, predicted, weights : (n,), (r,) and (r,): the step, the rows after it, and their multipliers, none negative
    active : (n + 1,) in: number of the active rows of a similar program, then these rows, from which to start; bounds
        of the box count backwards from -1.  Out: the same for this program
    """

    step: Array
    predicted: Array
    weights: Array
    active: Index


@kernel
def nearest_of_many(
    curves: CurveRows, transform: Array, centre: Array, low: Array, high: Array, near: tuple[float, float], rounds: int,
    tolerance: float, solution: Nearest,
) -> int:  # fmt: skip
    """Solve a quadratic program with hundreds of rows along turns, of which few are active.

    The step is ``transform y`` with y nearest to a centre.  Rows join where they are near their bound and lowest among
    their neighbours along a turn, and later where the step found would violate them.

    Parameters
    ----------
    curves : rows
    transform : (n, n) matrix that turns y into the step
    centre : (n,)
    low, high : (n,) and (h,) bounds of the step, of its first h elements from above
    near : value below which a row joins at first, and violation above which a row joins later
    rounds : most rounds in which rows join
    tolerance : see :func:`kernels.linear.nearest.nearest`
    solution : out

    Returns
    -------
    Status of the last round, as of :func:`kernels.linear.nearest.nearest`.
    """
    (values, slopes, turns), (step, predicted, weights, active) = curves, solution
    n, count = slopes.shape
    boxes = n + len(high)
    rows, rhs, size = np.empty((n, count + boxes)), np.empty(count + boxes), np.empty(count + boxes)
    marked, joined, lowest = np.empty(count, np.int64), np.zeros(count, np.int64), np.empty(turns.shape[1], np.int64)
    joined_rows, y, h = np.empty(count, np.int64), np.empty(n), no_active_rows(n, count + boxes)
    _box_rows(low, high, transform, rows, rhs, size)
    for i in range(n):
        y[i] = centre[i]
    _mark_minima(values, near[0], turns, lowest, marked)
    for k in range(active[0]):
        if active[1 + k] >= 0:
            marked[active[1 + k]] = 1
    total, active_count, status = boxes, -1, int(st.OK)
    for _ in range(rounds):
        for j in range(count):
            if marked[j] == 1 and joined[j] == 0:
                joined[j], joined_rows[total - boxes], rhs[total] = 1, j, -values[j]
                size[total] = _transformed_row(slopes, j, transform, rows, total)
                total += 1
        if active_count < 0:
            for k in range(active[0]):
                row = active[1 + k]
                active[1 + k] = -1 - row if row < 0 else boxes + _index_of(joined_rows, total - boxes, row)
            active_count = _warm_start(rows, rhs, size, active, centre, y, h)
        active_count, status = continued(rows, rhs, size, total, tolerance, y, h, active_count)
        _write_step(values, slopes, transform, y, step, predicted)
        _mark_minima(predicted, -near[1], turns, lowest, marked)
        new = 0
        for j in range(count):
            new += marked[j] * (1 - joined[j])
        if new == 0 or status != st.OK:
            break
    for j in range(count):
        weights[j] = 0.0
    active[0] = active_count
    for k in range(active_count):
        is_joined = h.numbers[k] >= boxes
        active[1 + k] = joined_rows[h.numbers[k] - boxes] if is_joined else -1 - h.numbers[k]
        if is_joined:
            weights[active[1 + k]] = h.weights[k]
    return status
