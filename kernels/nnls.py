"""Non-negative least squares (Lawson and Hanson 1974, chapter 23), in one order of summation on every machine."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import inline, kernel

Array = NDArray[np.float64]
Index = NDArray[np.int64]

PER_COLUMN = 6  # exchanges per column after which it is given up
DEPENDENT = 1e-14  # a column of which less than this part is left depends on those that are held


@inline
def _solved(a: Array, b: Array, held: Index, count: int, z: Array) -> None:
    """Substitute back in the triangle of the held columns."""
    for k in range(count - 1, -1, -1):
        value = b[k]
        for j in range(k + 1, count):
            value -= a[k, held[j]] * z[j]
        z[k] = value / a[k, held[k]]


@inline
def _taken(a: Array, b: Array, row: int, column: int, first: float, vector: Array) -> None:
    """Reflect all columns and the right side so that ``column`` vanishes below ``row``; ``first`` is what is left."""
    m, n = a.shape
    for i in range(row, m):
        vector[i] = a[i, column]
    vector[row] -= first
    divisor = first * vector[row]
    for j in range(n + 1):
        value = 0.0
        for i in range(row, m):
            value += vector[i] * (a[i, j] if j < n else b[i])
        value /= divisor
        for i in range(row, m):
            if j < n:
                a[i, j] += value * vector[i]
            else:
                b[i] += value * vector[i]
    a[row, column] = first
    for i in range(row + 1, m):
        a[i, column] = 0.0


@inline
def _dropped(a: Array, b: Array, held: Index, count: int, place: int) -> None:
    """Take a column out of the triangle; rotations make the rest a triangle again."""
    n = a.shape[1]
    for k in range(place, count - 1):
        held[k] = held[k + 1]
        x, y = a[k, held[k]], a[k + 1, held[k]]
        length = math.hypot(x, y)
        c, s = (x / length, y / length) if length > 0.0 else (1.0, 0.0)
        for j in range(n):
            u, v = a[k, j], a[k + 1, j]
            a[k, j], a[k + 1, j] = c * u + s * v, c * v - s * u
        u, v = b[k], b[k + 1]
        b[k], b[k + 1] = c * u + s * v, c * v - s * u
        a[k + 1, held[k]] = 0.0


@inline
def _next(a: Array, b: Array, inside: Index, count: int, refused: Index) -> tuple[int, float]:
    """Return the column whose growth lessens the distance most, and what a reflection leaves of it;
    -1 where none does.
    """
    m, n = a.shape
    best, largest, first = -1, 0.0, 0.0
    for j in range(n):
        if inside[j] or refused[j]:
            continue
        slope, below, above = 0.0, 0.0, 0.0
        for i in range(m):
            if i < count:
                above += a[i, j] * a[i, j]
            else:
                slope += a[i, j] * b[i]
                below += a[i, j] * a[i, j]
        if slope > largest:
            if below <= DEPENDENT * DEPENDENT * above:
                refused[j] = 1
            else:
                length = math.sqrt(below)
                best, largest, first = j, slope, (-length if a[count, j] > 0.0 else length)
    return best, first


@kernel
def nnls(matrix: Array, target: Array, x: Array) -> int:
    """Return the smallest ``|matrix x - target|`` with x >= 0.

    Parameters
    ----------
    matrix : (m, n); columns should be of one size, since the steepest is taken first
    target : (m,)
    x : (n,) out

    Returns
    -------
    OK, or NOT_CONVERGED after six exchanges per column: then x is the best that was reached, not negative all the same.

    Notes
    -----
    Lawson and Hanson's algorithm: columns enter a triangle by reflections and leave it by rotations.  Against
    scipy's: 1e-13 times the condition number of the columns that are held.
    """
    m, n = matrix.shape
    a, b = matrix.copy(), target.copy()
    held, inside, refused = np.empty(m, np.int64), np.zeros(n, np.int64), np.zeros(n, np.int64)
    z, vector = np.zeros(m), np.empty(m)
    count = 0
    for j in range(n):
        x[j] = 0.0
    left = PER_COLUMN * n
    while count < m:
        column, first = _next(a, b, inside, count, refused)
        if column < 0:
            return int(st.OK)
        # What the new column would get must be positive; rounding in a nearly dependent one may say otherwise.
        value = 0.0
        for i in range(count, m):
            value += (a[i, column] - (first if i == count else 0.0)) * b[i]
        top = b[count] + value / first
        if not top / first > 0.0:
            refused[column] = 1
            continue
        _taken(a, b, count, column, first, vector)
        held[count], inside[column] = column, 1
        count += 1
        refused[:] = 0
        _solved(a, b, held, count, z)
        while True:
            left -= 1
            if left < 0:
                return int(st.NOT_CONVERGED)
            share, place = 2.0, -1
            for k in range(count):
                if z[k] <= 0.0:
                    own = x[held[k]] / (x[held[k]] - z[k]) if x[held[k]] != z[k] else 0.0
                    if own < share:
                        share, place = own, k
            if place < 0:
                break
            for k in range(count):
                x[held[k]] += share * (z[k] - x[held[k]])
            gone = held[place]
            while place >= 0:
                gone = held[place]
                _dropped(a, b, held, count, place)
                x[gone], inside[gone] = 0.0, 0
                count -= 1
                place = -1
                for k in range(count):
                    if x[held[k]] <= 0.0:
                        place = k
            _solved(a, b, held, count, z)
        for k in range(count):
            x[held[k]] = z[k]
    return int(st.OK)
