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


class ActiveSet(NamedTuple):
    """Active rows in an orthogonal factorisation, ``q`` (n, n) and ``r`` (n, n); their numbers and multipliers.

    Where no point satisfies all rows, the number of the contradicting row stands behind those of the active rows, and
    ``shares`` combines the active rows into it.  ``active`` (m,) is 1 for active rows; ``d``, ``z`` and ``shares`` (n,)
    and ``slack`` (m,) are scratch.
    """

    q: Array
    r: Array
    numbers: Index
    weights: Array
    active: Index
    d: Array
    z: Array
    shares: Array
    slack: Array


@inline
def no_active_rows(n: int, m: int) -> ActiveSet:
    """Allocate the state without active rows."""
    return ActiveSet(
        np.eye(n), np.zeros((n, n)), np.empty(n + 1, np.int64), np.zeros(n + 1), np.zeros(m, np.int64), np.empty(n),
        np.empty(n), np.empty(n), np.empty(m),
    )  # fmt: skip


@inline
def _most_violated(rows: Array, rhs: Array, size: Array, m: int, y: Array, h: ActiveSet, tolerance: float) -> int:
    """Find the row that a point violates most, relative to the row's size; -1 where it satisfies the first m rows."""
    for j in range(m):
        h.slack[j] = -rhs[j]
    for i in range(len(y)):
        factor = y[i]
        for j in range(m):
            h.slack[j] += rows[i, j] * factor
    index, worst = -1, -tolerance
    for j in range(m):
        if h.active[j] == 0 and h.slack[j] < worst * size[j]:
            index, worst = j, h.slack[j] / size[j]
    return index


@inline
def split_row(rows: Array, p: int, count: int, h: ActiveSet) -> float:
    """Split row p into a remainder z across the active rows and the ``shares`` of each; return the square of z."""
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
            value -= h.r[k, j] * h.shares[j]
        h.shares[k] = value / h.r[k, k]
    return square


@inline
def activate(p: int, count: int, square: float, h: ActiveSet) -> None:
    """Add row p to the active rows: a reflection turns its remainder, of that square, into one column."""
    n = len(h.d)
    leading = h.d[count]
    norm = -math.sqrt(square) if leading > 0.0 else math.sqrt(square)
    scale = square - leading * norm
    h.d[count] = leading - norm
    for i in range(n):
        value = 0.0
        for k in range(count, n):
            value += h.q[i, k] * h.d[k]
        value /= scale
        for k in range(count, n):
            h.q[i, k] -= value * h.d[k]
    h.d[count] = norm
    for k in range(count + 1):
        h.r[k, count] = h.d[k]
    h.numbers[count], h.active[p] = p, 1


@inline
def deactivate(place: int, count: int, h: ActiveSet) -> None:
    """Remove the active row at ``place``; rotations make the rest a triangle again."""
    n = len(h.d)
    h.active[h.numbers[place]] = 0
    for k in range(place, count - 1):
        h.numbers[k] = h.numbers[k + 1]
        for j in range(n):
            h.r[j, k] = h.r[j, k + 1]
    for k in range(place, count):
        h.weights[k] = h.weights[k + 1]
    for k in range(place, count - 1):
        first, second = h.r[k, k], h.r[k + 1, k]
        if second != 0.0:
            norm = math.hypot(first, second)
            c, s = first / norm, second / norm
            for i in range(n):
                x, y = h.q[i, k], h.q[i, k + 1]
                h.q[i, k], h.q[i, k + 1] = c * x + s * y, c * y - s * x
            for j in range(k, n):
                x, y = h.r[k, j], h.r[k + 1, j]
                h.r[k, j], h.r[k + 1, j] = c * x + s * y, c * y - s * x


@kernel
def continued(
    rows: Array, rhs: Array, size: Array, m: int, tolerance: float, y: Array, h: ActiveSet, count: int
) -> tuple[int, int]:
    """Continue from the nearest point with ``count`` active rows to the nearest that satisfies the first m rows."""
    n = rows.shape[0]
    remaining, status = STEPS * n, int(st.OK)
    while status == st.OK:
        p = _most_violated(rows, rhs, size, m, y, h, tolerance)
        if p < 0:
            break
        violation = -h.slack[p]
        h.weights[count] = 0.0
        while True:
            square = split_row(rows, p, count, h)
            full = violation / square if count < n and square > DEPENDENT * size[p] * size[p] else math.inf
            partial, blocking = math.inf, -1
            for k in range(count):
                if h.shares[k] > 0.0 and h.weights[k] / h.shares[k] < partial:
                    partial, blocking = h.weights[k] / h.shares[k], k
            step = min(partial, full)
            remaining -= 1
            if step == math.inf or remaining < 0:
                h.numbers[count] = p
                status = int(st.LIMIT_EXCEEDED) if step == math.inf else int(st.NOT_CONVERGED)
                break
            if full < math.inf:
                for i in range(n):
                    y[i] += step * h.z[i]
                violation -= step * square
            for k in range(count):
                h.weights[k] -= step * h.shares[k]
            h.weights[count] += step
            if full <= partial:
                activate(p, count, square, h)
                count += 1
                break
            deactivate(blocking, count, h)
            count -= 1
    return count, status


@kernel
def nearest_with(rows: Array, rhs: Array, centre: Array, tolerance: float, y: Array, h: ActiveSet) -> tuple[int, int]:
    """Find the point of :func:`nearest`; return number of active rows and status.  ``h`` is :func:`no_active_rows`."""
    n, m = rows.shape
    size = np.zeros(m)
    for i in range(n):
        y[i] = centre[i]
        for j in range(m):
            size[j] += rows[i, j] * rows[i, j]
    for j in range(m):
        size[j] = math.sqrt(size[j])
    return continued(rows, rhs, size, m, tolerance, y, h, 0)


@kernel
def nearest(rows: Array, rhs: Array, centre: Array, tolerance: float, y: Array, weights: Array) -> int:
    """Find the point nearest to a centre that satisfies ``rows.T y >= rhs``.

    Parameters
    ----------
    rows : (n, m), one column for each row
    rhs : (m,)
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
    h = no_active_rows(*rows.shape)
    count, status = nearest_with(rows, rhs, centre, tolerance, y, h)
    for j in range(len(weights)):
        weights[j] = 0.0
    for k in range(count):
        weights[h.numbers[k]] = h.weights[k]
    return status
