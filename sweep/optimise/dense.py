"""Matrices of the search: products, least squares and axes whose last bits are the same on every machine.

numpy's and scipy's go to a BLAS library, which sums in another order on another processor; a search that meets two
equally good ways then takes another one.  These wrap :mod:`kernels.dense`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from kernels import dense, nnls
from sweep.families.base import Array


def times(a: Any, b: Any) -> Array:
    """Return ``a @ b`` of two matrices, or of a matrix and a vector on either side."""
    left, right = np.asarray(a, np.float64), np.asarray(b, np.float64)
    first = np.ascontiguousarray(left.reshape(1, -1) if left.ndim == 1 else left)
    second = np.ascontiguousarray(right.reshape(-1, 1) if right.ndim == 1 else right)
    out = np.empty((first.shape[0], second.shape[1]))
    dense.product(first, second, out)
    return out.reshape(left.shape[:-1] + right.shape[1:])


def least_squares(a: Array, b: Array, tolerance: float) -> Array:
    """Return the shortest x with the least ``|a x - b|``;
    what depends on other columns up to ``tolerance`` does not count.
    """
    x = np.zeros(a.shape[1])
    if a.size:
        dense.least_squares(np.ascontiguousarray(a, np.float64), np.ascontiguousarray(b, np.float64), tolerance, x)
    return x


def non_negative(a: Array, b: Array) -> Array:
    """Return the smallest ``|a x - b|`` with x >= 0."""
    x = np.zeros(a.shape[1])
    if a.size:
        nnls.nnls(np.ascontiguousarray(a, np.float64), np.ascontiguousarray(b, np.float64), x)
    return x


def symmetric(a: Array) -> tuple[Array, Array]:
    """Return eigenvalues and eigenvectors (in columns) of a symmetric matrix (n, n) or of a stack (k, n, n)."""
    stack = np.ascontiguousarray(a.reshape(-1, *a.shape[-2:]), np.float64)
    values, axes = np.empty(stack.shape[:2]), np.empty(stack.shape)
    dense.symmetric_axes(stack, values, axes)
    return values.reshape(a.shape[:-1]), axes.reshape(a.shape)


def split(rows: Array, tolerance: float) -> tuple[Array, Array]:
    """Return orthonormal directions (k, n) that rows (m, n) span, and those (n - k, n) that all of them leave alone."""
    n = rows.shape[1]
    turned = np.ascontiguousarray(rows.T, np.float64)
    order, q = np.empty(len(rows), np.int64), np.empty((n, n))
    rank = dense.triangle(turned, order, q, tolerance)
    return np.ascontiguousarray(q[:, :rank].T), np.ascontiguousarray(q[:, rank:].T)
