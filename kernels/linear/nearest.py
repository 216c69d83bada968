"""The nearest point that keeps linear rows: the dual active-set method of Goldfarb and Idnani (1983).

It begins at the centre, which keeps none of them, and takes in the row that is missed most until none is.  Every step
costs one look at all rows and some hundred products, so it is quick where few of many rows hold in the end.  Rows that
join later need no new beginning: the point reached is still the nearest one that keeps those before.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.jit import inline, kernel, part
from kernels.types import Array

Index = NDArray[np.int64]

STEPS = 20  # per unknown after which it is given up
DEPENDENT = 1e-20  # square of what is left of a row across those that hold, relative to its own, that is rounding
INDEPENDENT = 1e-12  # the same of a row that held before and may hold again


class Held(NamedTuple):
    """Rows that hold, as an orthogonal triangle: ``q`` (n, n) and ``r`` (n, n), their numbers and their weights.

    ``inside`` (m,) is 1 for rows that hold; ``d``, ``z`` and ``share`` (n,) and ``room`` (m,) are used on the way.
    """

    q: Array
    r: Array
    numbers: Index
    weights: Array
    inside: Index
    d: Array
    z: Array
    share: Array
    room: Array


@inline
def _nothing_held(n: int, m: int) -> Held:
    return Held(
        np.eye(n), np.zeros((n, n)), np.empty(n, np.int64), np.zeros(n + 1), np.zeros(m, np.int64), np.empty(n),
        np.empty(n), np.empty(n), np.empty(m),
    )  # fmt: skip


@inline
def _most_missed(rows: Array, needs: Array, size: Array, m: int, y: Array, h: Held, tolerance: float) -> int:
    """Row that a point misses most, relative to its size; -1 where it keeps the first m of them."""
    for j in range(m):
        h.room[j] = -needs[j]
    for i in range(len(y)):
        factor = y[i]
        for j in range(m):
            h.room[j] += rows[i, j] * factor
    found, worst = -1, -tolerance
    for j in range(m):
        if h.inside[j] == 0 and h.room[j] < worst * size[j]:
            found, worst = j, h.room[j] / size[j]
    return found


@inline
def _shares(rows: Array, p: int, count: int, h: Held) -> float:
    """Where a row leads while the others hold (z), and how much of each of them it takes; the square of z."""
    n = rows.shape[0]
    square = 0.0
    for k in range(n):
        h.d[k] = 0.0
    for i in range(n):
        factor = rows[i, p]
        for k in range(n):
            h.d[k] += h.q[i, k] * factor
    for i in range(n):
        value = 0.0
        for k in range(count, n):
            value += h.q[i, k] * h.d[k]
        h.z[i] = value
    for k in range(count, n):
        square += h.d[k] * h.d[k]
    for k in range(count - 1, -1, -1):
        value = h.d[k]
        for j in range(k + 1, count):
            value -= h.r[k, j] * h.share[j]
        h.share[k] = value / h.r[k, k]
    return square


@inline
def _taken_in(p: int, count: int, square: float, h: Held) -> None:
    """Take a row in: a reflection turns what is left of it across the others, of that square, into one column."""
    n = len(h.d)
    first = h.d[count]
    length = -math.sqrt(square) if first > 0.0 else math.sqrt(square)
    half = square - first * length
    h.d[count] = first - length
    for i in range(n):
        value = 0.0
        for k in range(count, n):
            value += h.q[i, k] * h.d[k]
        value /= half
        for k in range(count, n):
            h.q[i, k] -= value * h.d[k]
    h.d[count] = length
    for k in range(count + 1):
        h.r[k, count] = h.d[k]
    h.numbers[count], h.inside[p] = p, 1


@inline
def _dropped(place: int, count: int, h: Held) -> None:
    """Take a row out of those that hold; rotations make the rest a triangle again."""
    n = len(h.d)
    h.inside[h.numbers[place]] = 0
    for k in range(place, count - 1):
        h.numbers[k] = h.numbers[k + 1]
        for j in range(n):
            h.r[j, k] = h.r[j, k + 1]
    for k in range(place, count):
        h.weights[k] = h.weights[k + 1]
    for k in range(place, count - 1):
        first, second = h.r[k, k], h.r[k + 1, k]
        if second != 0.0:
            length = math.hypot(first, second)
            c, s = first / length, second / length
            for i in range(n):
                x, y = h.q[i, k], h.q[i, k + 1]
                h.q[i, k], h.q[i, k + 1] = c * x + s * y, c * y - s * x
            for j in range(k, n):
                x, y = h.r[k, j], h.r[k + 1, j]
                h.r[k, j], h.r[k + 1, j] = c * x + s * y, c * y - s * x


@kernel
def _pursued(
    rows: Array, needs: Array, size: Array, m: int, tolerance: float, y: Array, h: Held, count: int
) -> tuple[int, int]:
    """Go on from a point that is the nearest with ``count`` rows held to the nearest that keeps the first m rows."""
    n = rows.shape[0]
    left, status = STEPS * n, int(st.OK)
    while status == st.OK:
        p = _most_missed(rows, needs, size, m, y, h, tolerance)
        if p < 0:
            break
        short = -h.room[p]
        h.weights[count] = 0.0
        while True:
            square = _shares(rows, p, count, h)
            full = short / square if count < n and square > DEPENDENT * size[p] * size[p] else math.inf
            part, place = math.inf, -1
            for k in range(count):
                if h.share[k] > 0.0 and h.weights[k] / h.share[k] < part:
                    part, place = h.weights[k] / h.share[k], k
            step = min(part, full)
            left -= 1
            if step == math.inf or left < 0:
                status = int(st.LIMIT_EXCEEDED) if step == math.inf else int(st.NOT_CONVERGED)
                break
            if full < math.inf:
                for i in range(n):
                    y[i] += step * h.z[i]
                short -= step * square
            for k in range(count):
                h.weights[k] -= step * h.share[k]
            h.weights[count] += step
            if full <= part:
                _taken_in(p, count, square, h)
                count += 1
                break
            _dropped(place, count, h)
            count -= 1
    return count, status


@kernel
def nearest(rows: Array, needs: Array, centre: Array, tolerance: float, y: Array, weights: Array) -> int:
    """Point nearest to a centre with ``rows.T y >= needs``.

    Parameters
    ----------
    rows : (n, m), one column for each row
    needs : (m,)
    centre : (n,)
    tolerance : distance by which a row may be missed
    y : (n,) out
    weights : (m,) out; ``y - centre = rows weights``, none is negative

    Returns
    -------
    OK, LIMIT_EXCEEDED where no point keeps all rows, or NOT_CONVERGED after twenty exchanges per unknown; then y and
    weights are as far as it came.

    Notes
    -----
    Goldfarb and Idnani 1983, with an orthogonal triangle of the rows that hold.  Against scipy's least-distance
    programs: 1e-12.
    """
    n, m = rows.shape
    h, size = _nothing_held(n, m), np.zeros(m)
    for i in range(n):
        y[i] = centre[i]
        for j in range(m):
            size[j] += rows[i, j] * rows[i, j]
    for j in range(m):
        weights[j], size[j] = 0.0, math.sqrt(size[j])
    count, status = _pursued(rows, needs, size, m, tolerance, y, h, 0)
    for k in range(count):
        weights[h.numbers[k]] = h.weights[k]
    return status


@inline
def _place_of(place: Index, count: int, number: int) -> int:
    """Place of a number that is among the first ``count``."""
    for k in range(count):
        if place[k] == number:
            return k
    return -1


@part
def _resumed(rows: Array, needs: Array, size: Array, begin: Index, centre: Array, y: Array, h: Held) -> int:
    """Let rows hold that held before, but for those with a negative weight; how many do.

    The nearest point that keeps rows as equations is where the method may go on from, as long as no weight is negative.
    """
    n, count = rows.shape[0], 0
    for k in range(begin[0]):
        p = begin[1 + k]
        square = _shares(rows, p, count, h)
        if count < n and square > INDEPENDENT * size[p] * size[p]:
            _taken_in(p, count, square, h)
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
        _dropped(worst, count, h)
        count -= 1
    for i in range(n):
        y[i] = centre[i]
        for k in range(count):
            y[i] += h.q[i, k] * h.z[k]
    return count


@inline
def _peaks(values: Array, below: float, turns: Index, lowest: Index, found: Index) -> None:
    """Mark the values below a bound that are the lowest among their neighbours along a turn, or stand beside such one.

    Those of no turn are marked wherever they are below.
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


@kernel
def nearest_of_many(
    values: Array,
    slopes: Array,
    back: Array,
    centre: Array,
    low: Array,
    high: Array,
    turns: Index,
    near: float,
    missed: float,
    rounds: int,
    tolerance: float,
    step: Array,
    there: Array,
    weights: Array,
    begin: Index,
) -> int:
    """Step of a quadratic program with hundreds of rows along turns, of which few matter.

    The step is ``back y`` with y nearest to a centre.  Rows join where they are near their bound and lowest among their
    neighbours along a turn, and later where the step found would miss them.

    Parameters
    ----------
    values, slopes : (r,) and (n, r) of the rows, ``values + step slopes >= 0``
    back : (n, n) the step's axes
    centre : (n,)
    low, high : (n,) and (h,) bounds of the step, of its first h elements from above
    turns : (T, m) numbers of the rows that are one curve around its turn
    near : values from which on rows do not join at first
    missed : by how much a row has to be missed to join later
    rounds : of joining at most
    tolerance : see :func:`nearest`
    step, there, weights : (n,), (r,) and (r,) out: the step, the rows after it, and their weights, none negative
    begin : (n + 1,) rows that held in a program like this one, and their count first, from which it goes on: those of
        the box count backwards from -1.  Written: those that hold in this one

    Returns
    -------
    Status of the last round, as of :func:`nearest`.
    """
    n, count = slopes.shape
    boxes = n + len(high)
    rows, needs, size = np.empty((n, count + boxes)), np.empty(count + boxes), np.empty(count + boxes)
    more, joined, lowest = np.empty(count, np.int64), np.zeros(count, np.int64), np.empty(turns.shape[1], np.int64)
    place, y, h = np.empty(count, np.int64), np.empty(n), _nothing_held(n, count + boxes)
    for k in range(boxes):
        sign, i = (1.0, k) if k < n else (-1.0, k - n)
        needs[k] = low[i] if k < n else -high[i]
        square = 0.0
        for a in range(n):
            rows[a, k] = sign * back[i, a]
            square += back[i, a] * back[i, a]
        size[k] = math.sqrt(square)
    for i in range(n):
        y[i] = centre[i]
    _peaks(values, near, turns, lowest, more)
    for k in range(begin[0]):
        if begin[1 + k] >= 0:
            more[begin[1 + k]] = 1
    total, held, status = boxes, -1, int(st.OK)
    for _ in range(rounds):
        for j in range(count):
            if more[j] == 1 and joined[j] == 0:
                joined[j], place[total - boxes], needs[total] = 1, j, -values[j]
                square = 0.0
                for a in range(n):
                    value = 0.0
                    for i in range(n):
                        value += back[i, a] * slopes[i, j]
                    rows[a, total] = value
                    square += value * value
                size[total] = math.sqrt(square)
                total += 1
        if held < 0:
            for k in range(begin[0]):
                number = begin[1 + k]
                begin[1 + k] = -1 - number if number < 0 else boxes + _place_of(place, total - boxes, number)
            held = _resumed(rows, needs, size, begin, centre, y, h)
        held, status = _pursued(rows, needs, size, total, tolerance, y, h, held)
        for j in range(count):
            there[j] = values[j]
        for i in range(n):
            step[i] = 0.0
            for a in range(n):
                step[i] += back[i, a] * y[a]
            for j in range(count):
                there[j] += step[i] * slopes[i, j]
        _peaks(there, -missed, turns, lowest, more)
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
