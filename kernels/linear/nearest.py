"""Nearest point that satisfies linear inequalities (rows): the dual active-set method of Goldfarb and Idnani (1983).

It begins at the centre without active rows and adds the most violated row until none is violated.  Every step costs one
evaluation of all rows and some hundred products, so it is quick where few of many rows are active in the end.  Rows
that join later need no restart: the point reached is still the nearest one that satisfies the rows before.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.jit import inline, kernel
from kernels.types import Array

Index = NDArray[np.int64]

STEPS = 20  # per unknown, after which the search is given up
DEPENDENT = 1e-20  # square of a row's remainder across the active rows, relative to the row's, that is rounding


class Held(NamedTuple):
    """Active rows in an orthogonal factorisation, ``q`` (n, n) and ``r`` (n, n); their numbers and multipliers.

    Where no point satisfies all rows, the number of the contradicting row stands behind those of the active rows, and
    ``share`` combines the active rows into it.  ``inside`` (m,) is 1 for active rows; ``d``, ``z`` and ``share`` (n,)
    and ``room`` (m,) are scratch.
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
def nothing_held(n: int, m: int) -> Held:
    """Allocate the state without active rows."""
    return Held(
        np.eye(n), np.zeros((n, n)), np.empty(n + 1, np.int64), np.zeros(n + 1), np.zeros(m, np.int64), np.empty(n),
        np.empty(n), np.empty(n), np.empty(m),
    )  # fmt: skip


@inline
def _most_missed(rows: Array, needs: Array, size: Array, m: int, y: Array, h: Held, tolerance: float) -> int:
    """Find the row that a point violates most, relative to the row's size; -1 where it satisfies the first m rows."""
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
def shares(rows: Array, p: int, count: int, h: Held) -> float:
    """Split row p into a remainder z across the active rows and a ``share`` of each of them; return the square of z."""
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
def taken_in(p: int, count: int, square: float, h: Held) -> None:
    """Add row p to the active rows: a reflection turns its remainder, of that square, into one column."""
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
def dropped(place: int, count: int, h: Held) -> None:
    """Remove the active row at ``place``; rotations make the rest a triangle again."""
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
def pursued(
    rows: Array, needs: Array, size: Array, m: int, tolerance: float, y: Array, h: Held, count: int
) -> tuple[int, int]:
    """Continue from the nearest point with ``count`` active rows to the nearest that satisfies the first m rows."""
    n = rows.shape[0]
    left, status = STEPS * n, int(st.OK)
    while status == st.OK:
        p = _most_missed(rows, needs, size, m, y, h, tolerance)
        if p < 0:
            break
        short = -h.room[p]
        h.weights[count] = 0.0
        while True:
            square = shares(rows, p, count, h)
            full = short / square if count < n and square > DEPENDENT * size[p] * size[p] else math.inf
            part, place = math.inf, -1
            for k in range(count):
                if h.share[k] > 0.0 and h.weights[k] / h.share[k] < part:
                    part, place = h.weights[k] / h.share[k], k
            step = min(part, full)
            left -= 1
            if step == math.inf or left < 0:
                h.numbers[count] = p
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
                taken_in(p, count, square, h)
                count += 1
                break
            dropped(place, count, h)
            count -= 1
    return count, status


@kernel
def nearest_with(rows: Array, needs: Array, centre: Array, tolerance: float, y: Array, h: Held) -> tuple[int, int]:
    """Find the point of :func:`nearest`; return number of active rows and status.  ``h`` is that of `nothing_held`."""
    n, m = rows.shape
    size = np.zeros(m)
    for i in range(n):
        y[i] = centre[i]
        for j in range(m):
            size[j] += rows[i, j] * rows[i, j]
    for j in range(m):
        size[j] = math.sqrt(size[j])
    return pursued(rows, needs, size, m, tolerance, y, h, 0)


@kernel
def nearest(rows: Array, needs: Array, centre: Array, tolerance: float, y: Array, weights: Array) -> int:
    """Find the point nearest to a centre that satisfies ``rows.T y >= needs``.

    Parameters
    ----------
    rows : (n, m), one column for each row
    needs : (m,)
    centre : (n,)
    tolerance : distance by which a row may be violated
    y : (n,) out
    weights : (m,) out; ``y - centre = rows weights``, none is negative

    Returns
    -------
    OK, LIMIT_EXCEEDED where no point satisfies all rows, or NOT_CONVERGED after twenty exchanges per unknown; then y
    and weights are those of the last step.

    Notes
    -----
    Goldfarb and Idnani 1983, with an orthogonal factorisation of the active rows.  Against scipy's least-distance
    programs: 1e-12.
    """
    h = nothing_held(*rows.shape)
    count, status = nearest_with(rows, needs, centre, tolerance, y, h)
    for j in range(len(weights)):
        weights[j] = 0.0
    for k in range(count):
        weights[h.numbers[k]] = h.weights[k]
    return status
