"""The multipliers that make the best bound of linear enclosures over a box: a small linear program.

    minimise t   subject to   a_j + g_j d <= t,   b_i + h_i d >= 0,   |d_k| <= half_k,   t >= 0                      (1)

with rows a_j that the objective exceeds and rows b_i that a feasible design keeps.  Dual simplex from the corner where
every d_k is at its lower end: it has one row per unknown and needs no start of its own.  Where (1) has no solution, the
ray that says so is a proof that the box holds no feasible design.

The multipliers come from ordinary rounding.  What they prove is computed afterwards with outward rounding
(:func:`kernels.boxes.branching.combined`), so a wrong digit here can cost tightness and nothing else.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels.jit import inline, kernel
from kernels.types import Array

STEPS = 60
PIVOT, ROUNDING = 1e-12, 1e-12

SOLVED, IMPOSSIBLE, STALLED = 0, 1, 2


@inline
def _row(number: int, rows: Array, count: int, objective: NDArray[np.uint8], half: Array, out: Array) -> float:
    """Compute the coefficients of one constraint, out . (d, t) >= b, and return b.

    The rows come first, then d_k >= -half_k, -d_k >= -half_k, and t >= 0 at the end.
    """
    n = half.shape[0]
    out[:] = 0.0
    if number < count:
        for k in range(n):
            out[k] = -rows[number, 1 + k] if objective[number] else rows[number, 1 + k]
        out[n] = 1.0 if objective[number] else 0.0
        return float(rows[number, 0] if objective[number] else -rows[number, 0])
    number -= count
    if number == 2 * n:
        out[n] = 1.0
        return 0.0
    out[number % n] = 1.0 if number < n else -1.0
    return -float(half[number % n])


@inline
def _most_violated(
    rows: Array, count: int, objective: NDArray[np.uint8], half: Array, scale: float, z: Array, row: Array
) -> int:
    """Return the number of the constraint that the place z = (d, t) misses most; -1 where all are kept.

    Ends of a variable count in units of the rows, so that misses can be compared.
    """
    n = half.shape[0]
    entering, worst = -1, ROUNDING * scale
    for number in range(count + 2 * n + 1):
        missing = _row(number, rows, count, objective, half, row)
        for k in range(n + 1):
            missing -= row[k] * z[k]
        if count <= number < count + 2 * n:
            missing *= scale / half[(number - count) % n]
        if missing > worst:
            entering, worst = number, missing
    return entering


@kernel
def multipliers(
    rows: Array,
    count: int,
    objective: NDArray[np.uint8],
    half: Array,
    work: Array,
    basis: NDArray[np.int64],
    out: Array,
) -> int:
    """Multipliers of the rows of (1).

    Parameters
    ----------
    rows : (m, 1 + n), the first ``count`` of them used: value at the centre and slopes of each row
    objective : (m,) whether the row is one that t exceeds; the others are limits
    half : (n,) half the widths of the box
    work : (n + 5, n + 1) scratch
    basis : (n + 1,) scratch
    out : (m,) the multipliers, not negative

    Returns
    -------
    SOLVED; IMPOSSIBLE where the rows contradict each other on the box; STALLED, with multipliers that still serve.
    """
    n = half.shape[0]
    size = n + 1
    inverse, b, z, y, w, row = work[:size], work[size], work[size + 1], work[size + 2], work[size + 3], work[size + 4]
    for k in range(size):
        basis[k] = count + k if k < n else count + 2 * n
        b[k] = _row(basis[k], rows, count, objective, half, row)
        y[k] = 0.0
        for j in range(size):
            inverse[k, j] = 1.0 if j == k else 0.0
    result = STALLED
    scale = 0.0
    for j in range(count):
        scale = max(scale, abs(rows[j, 0]))
    for _ in range(STEPS):
        for k in range(size):
            value = 0.0
            for j in range(size):
                value += inverse[k, j] * b[j]
            z[k], y[k] = value, max(inverse[n, k], 0.0)
        entering = _most_violated(rows, count, objective, half, scale, z, row)
        if entering < 0:
            result = SOLVED
            break
        right = _row(entering, rows, count, objective, half, row)
        leaving, ratio = -1, math.inf
        largest = 0.0
        for k in range(size):
            value = 0.0
            for j in range(size):
                value += row[j] * inverse[j, k]
            w[k] = value
            largest = max(largest, abs(value))
        for k in range(size):
            if w[k] > PIVOT * largest and y[k] / w[k] < ratio:
                leaving, ratio = k, y[k] / w[k]
        if leaving < 0:
            for k in range(size):
                y[k] = max(-w[k], 0.0)
            _put(out, basis, y, count)
            if entering < count:
                out[entering] += 1.0
            return IMPOSSIBLE
        for j in range(size):
            share = inverse[j, leaving] / w[leaving]
            for k in range(size):
                if k != leaving:
                    inverse[j, k] -= share * w[k]
            inverse[j, leaving] = share
        basis[leaving], b[leaving] = entering, right
    _put(out, basis, y, count)
    return result


@inline
def _put(out: Array, basis: NDArray[np.int64], y: Array, count: int) -> None:
    out[:] = 0.0
    for k in range(basis.shape[0]):
        if basis[k] < count:
            out[basis[k]] += y[k]
