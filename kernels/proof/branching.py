"""Branch and bound over boxes of designs: what the rows of a box prove together, and which box is next.

A row is a function of the design, enclosed over a box as a form (:mod:`kernels.proof.slopes`).  Rows of the objective
are at most the value t of a design; rows of limits are at least 0 in a feasible one.  With multipliers that are not
negative, l_j for the first and m_i for the others,

    t >= t sum l_j >= sum l_j a_j(x) - sum m_i b_i(x),   sum l_j <= 1                                                (1)

for every feasible design of the box.  Without rows of the objective the right side can only be positive where there is
no feasible design.  A family writes the loop around its own rows; the pieces are here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels._jit import inline, kernel
from kernels.proof.program import IMPOSSIBLE, multipliers
from kernels.proof.slopes import CENTRE, RANGE, SLOPES, Array, down, times, up

Indices = NDArray[np.int64]
Flags = NDArray[np.uint8]

MOST_ROWS = 40
COMBINED = 5  # rows that a proof combines at most: one more than a box may have variables


@inline
def halves(low: Array, high: Array, centre: Array, half: Array) -> None:
    """Compute the centre of a box, rounded, and half widths that reach both ends from it."""
    for k in range(centre.shape[0]):
        centre[k] = 0.5 * (low[k] + high[k])
        half[k] = max(up(high[k] - centre[k]), up(centre[k] - low[k]))


@kernel
def combined(rows: Array, factors: Array, count: int, half: Array) -> float:
    """Return a number below sum factors_j row_j over the whole box, rounding included."""
    bound = 0.0
    for j in range(count):
        if factors[j] != 0.0:
            low, _ = times(factors[j], factors[j], rows[j, CENTRE], rows[j, CENTRE + 1])
            bound = down(bound + low)
    for k in range(half.shape[0]):
        low, high = 0.0, 0.0
        for j in range(count):
            if factors[j] != 0.0:
                at = SLOPES + 2 * k
                p, q = times(factors[j], factors[j], rows[j, at], rows[j, at + 1])
                low, high = down(low + p), up(high + q)
        bound = down(bound - up(max(abs(low), abs(high)) * half[k]))
    return bound


@inline
def _linear(rows: Array, count: int, objective: Flags, half: Array, out: Array, sizes: Array) -> None:
    """Compute rows as a linear program sees them:
    the value and the middle of the slopes, less what the slopes leave open.
    """
    for j in range(count):
        low, high, open_ = rows[j, CENTRE], rows[j, CENTRE + 1], 0.0
        size = abs(low)
        for k in range(half.shape[0]):
            p, q = rows[j, SLOPES + 2 * k], rows[j, SLOPES + 2 * k + 1]
            out[j, 1 + k] = 0.5 * (p + q)
            open_ += 0.5 * (q - p) * half[k]
            size += abs(out[j, 1 + k]) * half[k]
        out[j, 0] = low - open_ if objective[j] else high + open_
        sizes[j] = 1.0 if objective[j] or size == 0.0 else 1.0 / size
        for k in range(half.shape[0] + 1):
            out[j, k] *= sizes[j]


@kernel
def best_bound(
    rows: Array, count: int, objective: Flags, half: Array, work: Array, basis: Indices, linear: Array, sizes: Array,
    factors: Array,
) -> tuple[float, bool]:  # fmt: skip
    """Return the best bound (1) of a box, and whether it is one of limits alone:
    then a positive one empties the box.

    Parameters
    ----------
    rows : (m, width) forms, the first ``count`` of them used
    objective : (m,) which rows are the objective's
    half : (n,)
    work, basis, linear, sizes : scratch of (n + 5, n + 1), (n + 1,), (m, n + 1), (m,)
    factors : (m,) out, l_j, and -m_i; zero beyond ``count``
    """
    n = half.shape[0]
    _linear(rows, count, objective, half, linear, sizes)
    scale = 0.0
    for j in range(count):
        if objective[j]:
            scale = max(scale, abs(linear[j, 0]))
    # The objective in the size of the limits, so that one notion of rounding serves both.
    per_scale = 1.0 / scale if scale > 0.0 else 1.0
    for j in range(count):
        if objective[j]:
            for k in range(n + 1):
                linear[j, k] *= per_scale
    outcome = multipliers(linear, count, objective, half, work, basis, factors)
    total = 0.0
    for j in range(count):
        if not objective[j]:
            factors[j] *= -sizes[j] * (scale if outcome != IMPOSSIBLE and scale > 0.0 else 1.0)
        elif outcome == IMPOSSIBLE:
            factors[j] = 0.0
        else:
            total = up(total + factors[j])
    if total > 1.0:
        for j in range(count):
            factors[j] = down(factors[j] / total) if objective[j] else factors[j] / total
            if objective[j] and factors[j] < 0.0:
                factors[j] = 0.0
    return combined(rows, factors, count, half), outcome == IMPOSSIBLE


@kernel
def looseness(rows: Array, factors: Array, count: int, half: Array, out: Array) -> None:
    """Compute what each variable's width costs the bound, to decide which one to halve."""
    for k in range(half.shape[0]):
        total, low, high = 0.0, 0.0, 0.0
        for j in range(count):
            p, q = rows[j, SLOPES + 2 * k], rows[j, SLOPES + 2 * k + 1]
            total += abs(factors[j]) * (q - p)
            low, high = low + min(factors[j] * p, factors[j] * q), high + max(factors[j] * p, factors[j] * q)
        out[k] = half[k] * (total + max(abs(low), abs(high)))


@inline
def surely_negative(rows: Array, j: int) -> bool:
    """Return whether no design of the box has a value of the row that is not negative."""
    return bool(rows[j, RANGE + 1] < 0.0)


@inline
def _before(bounds: Array, depths: Indices, one: int, other: int) -> bool:
    """Return whether a box comes before another: the one of lower bound, among equals the larger one."""
    if bounds[one] != bounds[other]:
        return bool(bounds[one] < bounds[other])
    return bool(depths[one] < depths[other])


@kernel
def push(heap: Indices, count: int, bounds: Array, depths: Indices, box: int) -> None:
    """Add a box to the ``count`` of a heap whose first has the least bound."""
    place = count
    while place > 0:
        above = (place - 1) // 2
        if not _before(bounds, depths, box, heap[above]):
            break
        heap[place] = heap[above]
        place = above
    heap[place] = box


@kernel
def pop(heap: Indices, count: int, bounds: Array, depths: Indices) -> int:
    """Take the box of least bound from the ``count`` of a heap."""
    first, last = heap[0], heap[count - 1]
    place, size = 0, count - 1
    while 2 * place + 1 < size:
        below = 2 * place + 1
        if below + 1 < size and _before(bounds, depths, heap[below + 1], heap[below]):
            below += 1
        if not _before(bounds, depths, heap[below], last):
            break
        heap[place] = heap[below]
        place = below
    heap[place] = last
    return int(first)
