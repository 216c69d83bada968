"""Small dense systems of linear equations inside compiled loops: Gaussian elimination with row pivots."""

from __future__ import annotations

import math

from kernels.jit import inline
from kernels.types import Array


@inline
def eliminate(rows: Array, least: float) -> bool:
    """Solve rows (K, K + R) for their last R columns in place; false where a pivot is below ``least``.

    Gaussian elimination.  Rows are brought to one size first: some are moments, some are forces.
    """
    n, width, solvable = rows.shape[0], rows.shape[1], True
    for i in range(n):
        size = 0.0
        for j in range(n):
            size = max(size, abs(rows[i, j]))
        scale = 1.0 / size if size > 0.0 else math.nan
        for j in range(width):
            rows[i, j] *= scale
    for j in range(n):
        pivot, largest = j, abs(rows[j, j])
        for i in range(j + 1, n):
            size = abs(rows[i, j])
            pivot, largest = (i, size) if size > largest else (pivot, largest)
        solvable = solvable and largest >= least
        if pivot != j:
            for column in range(j, width):
                rows[j, column], rows[pivot, column] = rows[pivot, column], rows[j, column]
        scale = 1.0 / rows[j, j]
        for i in range(j + 1, n):
            factor = rows[i, j] * scale
            if factor != 0.0:
                for column in range(j + 1, width):
                    rows[i, column] -= factor * rows[j, column]
        rows[j, j] = scale
    for j in range(n - 1, -1, -1):
        for column in range(n, width):
            value = rows[j, column]
            for i in range(j + 1, n):
                value -= rows[j, i] * rows[i, column]
            rows[j, column] = value * rows[j, j]
    return solvable
