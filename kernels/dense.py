"""Small dense systems, some forty unknowns at most: products, orthogonal triangles, least squares, axes of symmetry.

A BLAS library chooses its kernel by the processor (and by ``OPENBLAS_CORETYPE``), and every kernel sums in an order of
its own.  Last bits decide which of two equal descents a search takes, so its results would depend on the machine.  Here
every sum runs in the order of its index and no product is contracted with a sum: one order, one result.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels._jit import inline, kernel

Array = NDArray[np.float64]
Index = NDArray[np.int64]

SWEEPS = 40  # of rotations; ten are enough, since they converge quadratically
SMALLEST = 1e-300  # a column or a rotation below is zero


@kernel
def product(a: Array, b: Array, out: Array) -> None:
    """Compute the matrix product ``out = a b`` of (m, k) and (k, n), summed in the order of k.

    Parameters
    ----------
    a, b : (m, k) and (k, n)
    out : (m, n) out
    """
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            out[i, j] = 0.0
        for l in range(a.shape[1]):  # noqa: E741
            factor = a[i, l]
            for j in range(b.shape[1]):
                out[i, j] += factor * b[l, j]


@inline
def _reflect(a: Array, first: int, column: int) -> float:
    """Turn a column below row ``first`` into a Householder vector in place; the element that is left of it.

    The vector keeps a first component of its own size (Golub and Van Loan, algorithm 5.1.1 without the scaling).
    Zero where the column is: there is nothing to reflect.
    """
    size = 0.0
    for i in range(first, a.shape[0]):
        size = max(size, abs(a[i, column]))
    if not size > SMALLEST:
        return 0.0
    square = 0.0
    for i in range(first, a.shape[0]):
        part = a[i, column] / size
        square += part * part
    length = size * math.sqrt(square)
    left = -length if a[first, column] > 0.0 else length
    a[first, column] -= left
    return left


@inline
def _reflected(a: Array, first: int, column: int, left: float, b: Array, other: int) -> None:
    """Apply the Householder vector in a column of ``a`` to a column of ``b``."""
    top = a[first, column]
    if left == 0.0 or top == 0.0:
        return
    value = 0.0
    for i in range(first, a.shape[0]):
        value += a[i, column] * b[i, other]
    value /= left * top
    for i in range(first, a.shape[0]):
        b[i, other] += value * a[i, column]


@kernel
def triangle(a: Array, order: Index, q: Array, tolerance: float) -> int:
    """Return the Householder triangle of a matrix, its largest remaining column first: ``a[:, order] = q r``.

    Parameters
    ----------
    a : (m, n) in, the triangle r out (m, n), zero below its diagonal
    order : (n,) out, column of ``a`` that stands at each place
    q : (m, m) out, orthogonal
    tolerance : of the rank, relative to the largest column

    Returns
    -------
    Rank: steps until the largest remaining column is at most ``tolerance`` times the first one.

    Notes
    -----
    Businger and Golub 1965.  Orthogonal to 1e-15; ``q r`` is ``a`` to 1e-15 of its largest column.
    """
    m, n = a.shape
    for j in range(n):
        order[j] = j
    for i in range(m):
        for j in range(m):
            q[i, j] = 1.0 if i == j else 0.0
    rank, first = 0, 0.0
    vectors, heads = np.zeros((m, n)), np.zeros(n)
    for k in range(min(m, n)):
        best, longest = k, -1.0
        for j in range(k, n):
            square = 0.0
            for i in range(k, m):
                square += a[i, j] * a[i, j]
            if square > longest:
                best, longest = j, square
        if k == 0:
            first = math.sqrt(longest)
        if not (longest > 0.0 and math.sqrt(longest) > tolerance * first):
            break
        for i in range(m):
            a[i, k], a[i, best] = a[i, best], a[i, k]
        order[k], order[best] = order[best], order[k]
        heads[k] = _reflect(a, k, k)
        for j in range(k + 1, n):
            _reflected(a, k, k, heads[k], a, j)
        for i in range(k, m):
            vectors[i, k] = a[i, k]
            a[i, k] = heads[k] if i == k else 0.0
        rank = k + 1
    for k in range(rank - 1, -1, -1):
        for j in range(k, m):
            _reflected(vectors, k, k, heads[k], q, j)
    return rank


@kernel
def least_squares(a: Array, b: Array, tolerance: float, x: Array) -> int:
    """Return the shortest x with the least ``|a x - b|`` by a complete orthogonal decomposition.

    Parameters
    ----------
    a : (m, n), left as it is
    b : (m,)
    tolerance : columns that are left with less than this part of the largest one do not count
    x : (n,) out

    Returns
    -------
    The rank.

    Notes
    -----
    Golub and Van Loan, section 5.5: a triangle from the left, and one from the right where columns are dependent.
    Against numpy's singular values: 1e-14 times the condition number.
    """
    m, n = a.shape
    r, order, q = a.copy(), np.empty(n, np.int64), np.empty((m, m))
    rank = triangle(r, order, q, tolerance)
    for j in range(n):
        x[j] = 0.0
    right = np.zeros(rank)
    for k in range(rank):
        for i in range(m):
            right[k] += q[i, k] * b[i]
    if rank == n:
        for k in range(n - 1, -1, -1):
            value = right[k]
            for j in range(k + 1, n):
                value -= r[k, j] * x[order[j]]
            x[order[k]] = value / r[k, k]
        return rank
    turned, swapped, z = np.empty((n, rank)), np.empty(rank, np.int64), np.empty((n, n))
    for k in range(rank):
        for j in range(n):
            turned[j, k] = r[k, j]
    triangle(turned, swapped, z, 0.0)
    for k in range(rank):  # forward: the transposed triangle is a lower one
        value = right[swapped[k]]
        for j in range(k):
            value -= turned[j, k] * x[j]
        x[k] = value / turned[k, k]
    shortest = np.zeros(n)
    for j in range(n):
        for k in range(rank):
            shortest[j] += z[j, k] * x[k]
    for j in range(n):
        x[order[j]] = shortest[j]
    return rank


@kernel
def symmetric_axes(a: Array, values: Array, axes: Array) -> None:
    """Compute eigenvalues and eigenvectors of symmetric matrices by Jacobi's rotations.

    Parameters
    ----------
    a : (k, n, n), left as it is; the upper triangles count
    values : (k, n) out, in ascending order
    axes : (k, n, n) out, the eigenvector of ``values[., j]`` in column j

    Notes
    -----
    Golub and Van Loan, section 8.5, cyclic.  Eigenvalues to 1e-15 of the largest; a rotation that changes no last bit
    is left out.
    """
    n = a.shape[1]
    work = np.empty((n, n))
    for number in range(a.shape[0]):
        own = axes[number]
        for i in range(n):
            for j in range(n):
                work[i, j] = a[number, i, j] if i <= j else a[number, j, i]
                own[i, j] = 1.0 if i == j else 0.0
        for _ in range(SWEEPS):
            turned = False
            for p in range(n - 1):
                for q in range(p + 1, n):
                    turned = _rotated(work, own, p, q) or turned
            if not turned:
                break
        for i in range(n):
            values[number, i] = work[i, i]
        for i in range(n - 1):  # few values: the smallest of the rest to the front
            least = i
            for j in range(i + 1, n):
                if values[number, j] < values[number, least]:
                    least = j
            if least != i:
                values[number, i], values[number, least] = values[number, least], values[number, i]
                for j in range(n):
                    own[j, i], own[j, least] = own[j, least], own[j, i]


@inline
def _rotated(a: Array, axes: Array, p: int, q: int) -> bool:
    """Turn one element off the diagonal into zero; false where it is nothing beside the diagonal."""
    n = a.shape[0]
    off, low, high = a[p, q], a[p, p], a[q, q]
    if not abs(off) > 1e-17 * (abs(low) + abs(high)) or not abs(off) > SMALLEST:
        a[p, q] = a[q, p] = 0.0
        return False
    theta = (high - low) / (2.0 * off)
    t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1.0))
    c = 1.0 / math.sqrt(t * t + 1.0)
    s = t * c
    a[p, p], a[q, q], a[p, q], a[q, p] = low - t * off, high + t * off, 0.0, 0.0
    for i in range(n):
        if i != p and i != q:
            x, y = a[i, p], a[i, q]
            a[i, p] = a[p, i] = c * x - s * y
            a[i, q] = a[q, i] = s * x + c * y
        x, y = axes[i, p], axes[i, q]
        axes[i, p] = c * x - s * y
        axes[i, q] = s * x + c * y
    return True
