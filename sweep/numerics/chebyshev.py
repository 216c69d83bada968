"""Chebyshev interpolation on a panel, vectorised over many panels."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev

from kernels.types import Array

DENSE = 33  # points at which a polynomial's maximum is bracketed, both ends included
PASSES = 8  # steps of Newton's method or bisection per bracket: a maximum is found to 1e-4 of a panel at least
NODES = 8  # nodes of a panel, both ends included: a jump just inside an end would be seen by no other node


@lru_cache
def basis() -> tuple[Array, Array]:
    """Nodes on [-1, 1], both ends included, and the matrix from values at the nodes to coefficients."""
    order = np.arange(NODES, dtype=np.float64)
    nodes: Array = -np.cos(np.pi * order / (NODES - 1))
    weights = np.where((order == 0) | (order == NODES - 1), 0.5, 1.0)
    both = weights[:, None] * weights * (2.0 / (NODES - 1))
    return nodes, both * np.cos(np.pi * np.outer(order, order[::-1]) / (NODES - 1))


def rising(x: Array) -> Array:
    """Evaluate the Chebyshev polynomials at x (m,), lowest order first, (NODES, m)."""
    return np.asarray(chebyshev.chebvander(x, NODES - 1).T, np.float64)


def product(rows: Array, matrix: Array) -> Array:
    """Matrix product with a fixed order of summation, so that a row's bits do not depend on the other rows."""
    total: Array = rows[:, 0, None] * matrix[0]
    for k in range(1, matrix.shape[0]):
        total += rows[:, k, None] * matrix[k]
    return total


def summits(series: Array, mode: int) -> tuple[Array, Array]:
    """Maxima of polynomials on [-1, 1] in the sense of ``mode``: places and heights, each (k,).

    Parameters
    ----------
    series : (k, NODES) coefficients
    mode : 0 for the largest magnitude, +1 for the largest value, -1 for the smallest (its height is the negative value)

    Notes
    -----
    Between two of the 33 points a maximum is bracketed by the sign change of the slope, even where it hardly exceeds
    both: next to an end, or as one of two maxima, it may be the largest although no point nearby is.  The points are
    denser towards the ends, as maxima may be: next to a dwell the slope vanishes at the end too.
    """
    dense: Array = -np.cos(np.pi * np.arange(DENSE) / (DENSE - 1))
    values = product(series, rising(dense))
    sense = np.sign(values) if mode == 0 else np.full(values.shape, float(mode))
    heights = sense * values
    slope, bend = (np.asarray(chebyshev.chebder(series, order, axis=1), np.float64) for order in (1, 2))
    slopes = sense * product(slope, rising(dense)[:-1])
    best = heights.argmax(axis=1)
    every = np.arange(len(series))
    x, value = dense[best], heights[every, best]

    row, column = np.nonzero((slopes[:, :-1] > 0.0) & (slopes[:, 1:] < 0.0))
    low, high, sign = dense[column], dense[column + 1], sense[row, column]
    left, right = slopes[row, column], slopes[row, column + 1]
    at = low + (high - low) * left / (left - right)
    terms, slope, bend = (np.ascontiguousarray(part[row].T) for part in (series, slope, bend))
    for _ in range(PASSES):
        uphill = sign * chebyshev.chebval(at, slope, tensor=False)
        low, high = np.where(uphill > 0.0, at, low), np.where(uphill > 0.0, high, at)
        bow = sign * chebyshev.chebval(at, bend, tensor=False)
        after = at - np.divide(uphill, bow, out=np.full(at.shape, np.inf), where=bow < 0.0)
        at = np.where((low <= after) & (after <= high), after, 0.5 * (low + high))
    top = sign * chebyshev.chebval(at, terms, tensor=False)
    order = np.argsort(top, kind="stable")  # of several maxima of a row the largest is written last
    order = order[top[order] >= value[row[order]]]
    x[row[order]], value[row[order]] = at[order], top[order]
    return x, value
