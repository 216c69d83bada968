"""Polynomials through a few values on a panel, as sums of Chebyshev polynomials; many panels at once."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

Array = NDArray[np.float64]

NODES = 8  # of a panel, its ends among them: a jump just inside would be seen by no other


@lru_cache
def basis() -> tuple[Array, Array]:
    """Return the nodes on [-1, 1], its ends among them, and the matrix that makes coefficients of values there."""
    order = np.arange(NODES, dtype=np.float64)
    nodes: Array = -np.cos(np.pi * order / (NODES - 1))
    weights = np.where((order == 0) | (order == NODES - 1), 0.5, 1.0)
    both = weights[:, None] * weights * (2.0 / (NODES - 1))
    return nodes, both * np.cos(np.pi * np.outer(order, order[::-1]) / (NODES - 1))


def at_nodes(series: Array) -> Array:
    """Return the values at the nodes, (k, NODES), of polynomials with these coefficients, (k, NODES)."""
    return product(series, rising(basis()[0]))


def rising(x: Array) -> Array:
    """Return the Chebyshev polynomials at x (m,), lowest order first, (NODES, m)."""
    found: Array = np.asarray(chebyshev.chebvander(x, NODES - 1).T, np.float64)
    return found


def product(rows: Array, matrix: Array) -> Array:
    """Return the matrix product, summed in one order: that of a library depends on how many rows there are."""
    total: Array = rows[:, 0, None] * matrix[0]
    for k in range(1, matrix.shape[0]):
        total += rows[:, k, None] * matrix[k]
    return total
