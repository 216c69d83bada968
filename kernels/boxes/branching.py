"""Branch and bound over boxes of designs: the bound that the rows of a box prove together.

A row is a function of the design, enclosed over a box as a form (:mod:`kernels.boxes.taylor`).  Rows of the objective
are at most the value t of a design; rows of limits are at least 0 in a feasible one.  With multipliers that are not
negative, l_j for rows a_j of the objective and m_i for rows b_i of limits,

    t >= t sum l_j >= sum l_j a_j(x) - sum m_i b_i(x),   sum l_j <= 1                                                (1)

for every feasible design of the box.  Without rows of the objective the right side can only be positive where there is
no feasible design.  A family writes the loop around its own rows; the pieces are here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.boxes.taylor import LINEAR, ROUNDING, TINY, VALUE, least, up
from kernels.jit import inline, kernel
from kernels.linear.nearest import nearest_with, no_active_rows
from kernels.types import Array

Indices = NDArray[np.int64]
Flags = NDArray[np.uint8]

MOST_ROWS = 40
COMBINED = 7  # rows that a proof combines at most: two more than the linear program may have variables
LENT = 1e-4  # root of the curvature added in d, in units of the box, and in t
PROGRAM_ROUNDING = 1e-12
# Outcome of a box: undecided, undecided and too small to be halved, no design below the target, none feasible.
OPEN, TOO_SMALL, BOUND, EMPTY = range(4)


@inline
def halves(low: Array, high: Array, centre: Array, half: Array) -> None:
    """Compute the rounded centre of a box, and half widths that reach both ends from it."""
    for k in range(centre.shape[0]):
        centre[k] = 0.5 * (low[k] + high[k])
        half[k] = max(up(high[k] - centre[k]), up(centre[k] - low[k]))


@kernel
def multipliers(rows: Array, count: int, objective: NDArray[np.uint8], half: Array, out: Array) -> int:
    """Find the multipliers of the best bound (1) over a box by a small linear program.

        minimise t   subject to   a_j + g_j d <= t,   b_i + h_i d >= 0,   |d_k| <= half_k,   t >= 0                  (2)

    With a very small curvature added in d and t the solution is the feasible point nearest to a centre far away
    (:mod:`kernels.linear.nearest`).  Where (2) has no solution, the contradicting rows prove that the box holds no
    feasible design.

    The multipliers come from ordinary rounding.  The bound is computed from them with outward rounding
    (:func:`combined`), so a wrong digit here can cost tightness and nothing else.

    Parameters
    ----------
    rows : (m, 1 + n), the first ``count`` of them used: value at the centre and slopes of each row
    objective : (m,) whether a row is of the objective; the other rows are limits
    half : (n,) half the widths of the box
    out : (m,) the multipliers, not negative

    Returns
    -------
    OK; LIMIT_EXCEEDED where the rows contradict each other on the box; NOT_CONVERGED, with multipliers that are valid
    but not the best.
    """
    n, scale = half.shape[0], 0.0
    sides, needs = np.zeros((n + 1, count + 2 * n + 1)), np.zeros(count + 2 * n + 1)
    centre, y, held = np.zeros(n + 1), np.empty(n + 1), no_active_rows(n + 1, count + 2 * n + 1)
    for j in range(count):
        sign = -1.0 if objective[j] else 1.0
        needs[j], scale = -sign * rows[j, 0], max(scale, abs(rows[j, 0]))
        for k in range(n):
            sides[k, j] = sign * rows[j, 1 + k] * half[k] / LENT
        sides[n, j] = 1.0 / LENT if objective[j] else 0.0
    for k in range(n):
        sides[k, count + k], sides[k, count + n + k] = 1.0 / LENT, -1.0 / LENT
        needs[count + k] = needs[count + n + k] = -1.0
    sides[n, count + 2 * n], centre[n] = 1.0 / LENT, -1.0 / LENT
    found, status = nearest_with(sides, needs, centre, PROGRAM_ROUNDING * max(scale, 1e-300) * LENT, y, held)
    out[:] = 0.0
    for k in range(found):
        if held.numbers[k] < count:
            out[held.numbers[k]] = max(-held.shares[k] if status == st.LIMIT_EXCEEDED else held.weights[k], 0.0)
    if status == st.LIMIT_EXCEEDED and held.numbers[found] < count:
        out[held.numbers[found]] = 1.0
    return int(status)


@kernel
def combined(rows: Array, factors: Array, count: int, n: int, total: Array) -> float:
    """Lower bound of the sum of factors_j row_j over the box, rounding included.

    The form of the sum is written to ``total``.
    """
    last, size = total.shape[0] - 1, 0.0
    total[:] = 0.0
    for j in range(count):
        factor = factors[j]
        if factor != 0.0:
            for k in range(last):
                term = factor * rows[j, k]
                total[k] += term
                size += abs(term)
            total[last] += abs(factor) * rows[j, last]
    # the sum of at most MOST_ROWS terms errs by less than MOST_ROWS units of 2^-53 of their magnitudes
    total[last] = total[last] * (1.0 + ROUNDING) + (size * ROUNDING + TINY)
    return float(least(total, n))


@kernel
def _linear(rows: Array, count: int, objective: Flags, n: int, out: Array, sizes: Array) -> None:
    """Linearise the rows: value at the centre, moved by the bound of all nonlinear terms, and slopes; limits scaled."""
    last = rows.shape[1] - 1
    for j in range(count):
        sign = -1.0 if objective[j] else 1.0
        open_, size, place = rows[j, last], abs(rows[j, VALUE]), LINEAR + n
        for k in range(n):
            out[j, 1 + k] = rows[j, LINEAR + k]
            size += abs(out[j, 1 + k])
            open_ += max(sign * rows[j, place], 0.0)
            for m in range(place + 1, place + n - k):
                open_ += abs(rows[j, m])
            place += n - k
        out[j, 0] = rows[j, VALUE] + sign * open_
        sizes[j] = 1.0 if objective[j] or size == 0.0 else 1.0 / size
        for k in range(n + 1):
            out[j, k] *= sizes[j]


@kernel
def best_bound(
    rows: Array, count: int, objective: Flags, half: Array, linear: Array, sizes: Array, factors: Array, total: Array
) -> tuple[float, bool]:
    """Compute the best bound (1) of a box, and whether limits alone make it: a positive one then empties the box.

    Parameters
    ----------
    rows : (m, width) forms, the first ``count`` of them used
    objective : (m,) which rows are the objective's
    half : (n,) ones: the variables of forms go from -1 to 1
    linear, sizes, total : scratch of (m, n + 1), (m,), (width,)
    factors : (m,) out, l_j, and -m_i; zero beyond ``count``
    """
    n = half.shape[0]
    _linear(rows, count, objective, n, linear, sizes)
    scale = 0.0
    for j in range(count):
        if objective[j]:
            scale = max(scale, abs(linear[j, 0]))
    # Rows of the objective are scaled to the size of the limits, so that one tolerance serves both.
    per_scale = 1.0 / scale if scale > 0.0 else 1.0
    for j in range(count):
        if objective[j]:
            for k in range(n + 1):
                linear[j, k] *= per_scale
    impossible = multipliers(linear, count, objective, half, factors) == st.LIMIT_EXCEEDED
    weight = 0.0
    for j in range(count):
        if not objective[j]:
            factors[j] *= -sizes[j] * (scale if not impossible and scale > 0.0 else 1.0)
        elif impossible:
            factors[j] = 0.0
        else:
            weight += factors[j]
    if weight > 1.0 - ROUNDING:  # the sum of the factors as they are stored must not be above 1
        for j in range(count):
            factors[j] /= weight * (1.0 + 2.0 * ROUNDING)
    return combined(rows, factors, count, n, total), impossible


@kernel
def looseness(rows: Array, factors: Array, count: int, n: int, total: Array, out: Array) -> None:
    """Compute how much each variable's width loosens the bound, to choose the variable to halve.

    It is the size of the variable's linear and quadratic terms in the sum of the rows.  The remainder of the sum is
    shared out in proportion to the linear terms of the single rows.
    """
    combined(rows, factors, count, n, total)
    own = 0.0
    place = LINEAR + n
    for k in range(n):
        out[k] = 0.0
    for k in range(n):
        out[k] += abs(total[LINEAR + k]) + abs(total[place])
        for m in range(k + 1, n):
            mixed = 0.5 * abs(total[place + m - k])
            out[k] += mixed
            out[m] += mixed
        place += n - k
        for j in range(count):
            own += abs(factors[j] * rows[j, LINEAR + k])
    if own > 0.0:
        for k in range(n):
            for j in range(count):
                out[k] += total[total.shape[0] - 1] * abs(factors[j] * rows[j, LINEAR + k]) / own


@kernel
def surely_negative(rows: Array, j: int, n: int, total: Array) -> bool:
    """Whether the row is proven to be negative on the whole box."""
    for k in range(total.shape[0] - 1):
        total[k] = -rows[j, k]
    total[total.shape[0] - 1] = rows[j, total.shape[0] - 1]
    return bool(least(total, n) > 0.0)
