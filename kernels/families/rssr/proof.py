"""Which crank-rockers on the locus cannot be better than a target: the rows of a box, and the search over boxes.

Rows of the objective are +-psi'' (or +-psi', or sin^2 of the pressure angle) at crank angles counted from the extended
position; rows of limits are those of the acceptance tests of docs/synthesis.md, of the pressure angle and of the links,
multiplied by what keeps them finite.  Crank angles are chosen where the design at the centre of a box has its peaks.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels._jit import inline, kernel
from kernels.families.rssr import boxes as bx
from kernels.proof.branching import (
    COMBINED, MOST_ROWS, Flags, Indices, best_bound, halves, looseness, pop, push, surely_negative,
)  # fmt: skip
from kernels.proof.slopes import CENTRE, RANGE, SLOPES, ULP, Array, constant, down, up, variable
from kernels.proof.tape import run
from kernels.sincos import sincos

POSES = 48  # of the centre design, to find the peaks
PEAKS, NECKS = 6, 3  # most rows of the objective and of the pressure angle
STEP = 2.0 * math.pi / POSES

# Kinds of rows.  Those up to BRANCH_FOLDED are the acceptance tests.
SIDE, LIMITS, CRANK_LENGTH, BRANCH_EXTENDED, BRANCH_FOLDED = range(5)
LEAST_A, MOST_A, LEAST_B, MOST_B, LEAST_C, MOST_C = range(5, 11)
PRESSURE, ABOVE, BELOW = 11, 12, 13
# What happened to a box.
OPEN, TOO_SMALL, BOUND, EMPTY = 0, 1, 2, 3


class Problem(NamedTuple):
    """What is asked of a design on the locus."""

    branch: float
    order: int  # 2: |psi''|, 1: |psi'|, 0: sin^2 of the pressure angle
    cos2: float  # least cos^2 of the pressure angle; 0 without a limit: then only the links must reach
    limits: Array  # (6,) least and most of crank, coupler, rocker; 0 and infinite without a limit
    target: float


class Rows(NamedTuple):
    """The rows of a box and the scratch of its linear program."""

    forms: Array  # (MOST_ROWS, width)
    kinds: Indices
    theta: Array
    objective: Flags
    factors: Array
    work: Array
    basis: Indices
    linear: Array
    sizes: Array
    loose: Array


@inline
def _take(rows: Rows, count: int, at: Array, form: int, kind: int, theta: float, sign: float) -> int:
    """Copy a form, or its negative, to the rows."""
    for j in range(0, at.shape[1], 2):
        p, q = at[form, j], at[form, j + 1]
        rows.forms[count, j], rows.forms[count, j + 1] = (p, q) if sign > 0.0 else (-q, -p)
    rows.kinds[count], rows.theta[count], rows.objective[count] = kind, theta, kind >= ABOVE
    return count + 1


@kernel
def _inputs(p: Problem, centre: Array, half: Array, varied: Array, given: Array, at: Array) -> None:
    """The inputs of the formulas: coordinates number ``varied[k]`` vary, the others are given."""
    for j in range(7):
        constant(at, j, given[j], given[j])
    for k in range(half.shape[0]):
        variable(at, int(varied[k]), centre[k], half, k)
    constant(at, bx.BRANCH, p.branch, p.branch)
    constant(at, bx.COS2, p.cos2, p.cos2)
    for k in range(6):
        limit = p.limits[k] if p.limits[k] < math.inf else 0.0  # rows without a limit are not taken
        square = limit * limit
        constant(at, bx.LEAST_A2 + k, down(square), up(square))


@inline
def _limit_rows(p: Problem, rows: Rows, count: int, at: Array, forms: tuple[int, int], kind: int) -> int:
    """The rows of one link's limits, where it has them."""
    link = kind - LEAST_A
    if p.limits[link] > 0.0:
        count = _take(rows, count, at, forms[0], kind, 0.0, 1.0)
    if p.limits[link + 1] < math.inf:
        count = _take(rows, count, at, forms[1], kind + 1, 0.0, 1.0)
    return count


@inline
def _middle(at: Array, form: int) -> float:
    return 0.5 * float(at[form, CENTRE] + at[form, CENTRE + 1])


@kernel
def _centre_curve(p: Problem, at: Array, height: Array, neck: Array) -> None:
    """Objective with its sign, and Delta/b^2, of the centre design at POSES crank angles; for the choice of rows."""
    a, e, fs, aca = (_middle(at, bx.CENTRES[0]), _middle(at, bx.CENTRES[1]), _middle(at, bx.CENTRES[2]), _middle(at, bx.CENTRES[3]))  # fmt: skip
    k0, k1, k2, b2 = (_middle(at, bx.CENTRES[4]), _middle(at, bx.CENTRES[5]), _middle(at, bx.CENTRES[6]), _middle(at, bx.CENTRES[7]))  # fmt: skip
    u1, v1 = _middle(at, bx.CENTRES[8]), _middle(at, bx.CENTRES[9])
    for i in range(POSES):
        s, c = sincos(i * STEP)
        u, v = u1 * c - v1 * s, v1 * c + u1 * s
        x, y, w = e - a * u, fs + aca * v, k0 + k1 * v - k2 * u
        r = x * x + y * y
        delta = r - w * w
        neck[i], height[i] = delta / b2, 0.0
        if p.order == 0:
            height[i] = 1.0 - neck[i]
        elif delta > 0.0:
            t = p.branch * math.sqrt(delta)
            cos, sin = -(x * w + y * t) / r, (y * w - x * t) / r
            first = -(a * v * cos - aca * u * sin + k1 * u + k2 * v) / t
            second = a * u * cos + aca * v * sin - k1 * v + k2 * u
            second = -(second + first * (-2.0 * (a * v * sin + aca * u * cos) + w * first)) / t
            height[i] = second if p.order == 2 else first


@inline
def _summit(below: float, here: float, above: float) -> float:
    """Where a parabola through three values one apart has its summit, counted from the middle one."""
    bend = below - 2.0 * here + above
    return 0.5 * (below - above) / bend if bend < 0.0 else 0.0


@inline
def _next_peak(height: Array, sign: float, used: Flags) -> int:
    """The highest local maximum of sign * height that was not used; -1 where there is none."""
    found = -1
    for i in range(POSES):
        here = sign * height[i]
        if used[i] == 0 and here > sign * height[i - 1] and here >= sign * height[(i + 1) % POSES]:
            if found < 0 or here > sign * height[found]:
                found = i
    if found >= 0:
        used[found] = 1
    return found


@inline
def _place_of(height: Array, sign: float, i: int) -> float:
    below, here, above = sign * height[i - 1], sign * height[i], sign * height[(i + 1) % POSES]
    return STEP * (i + _summit(below, here, above))


@inline
def _at_angle(at: Array, theta: float, half: Array) -> None:
    """The closure at a crank angle after the extended position; :func:`sincos` errs by less than a unit of its last
    place, so the interval of 2 ULP holds the exact sine and cosine."""
    s, c = sincos(theta)
    constant(at, bx.COS_THETA, c - 2.0 * ULP, c + 2.0 * ULP)
    constant(at, bx.SIN_THETA, s - 2.0 * ULP, s + 2.0 * ULP)
    run(bx.OPERATIONS, bx.FACTORS, bx.ENDS, bx.CLOSURE, at, half)


@kernel
def _turn_rows(p: Problem, rows: Rows, start: int, at: Array, half: Array, height: Array, neck: Array, used: Flags) -> int:
    """Rows of the pressure angle and of the objective, at the peaks of the centre design."""
    count = _limit_rows(p, rows, start, at, bx.LIMITS_B, LEAST_B)
    _centre_curve(p, at, height, neck)
    used[:] = 0
    for _ in range(NECKS):
        i = _next_peak(neck, -1.0, used)
        if i >= 0:
            theta = _place_of(neck, -1.0, i)
            _at_angle(at, theta, half)
            count = _take(rows, count, at, bx.PRESSURE, PRESSURE, theta, 1.0)
    used[:] = 0
    form = bx.PSI2 if p.order == 2 else (bx.PSI1 if p.order == 1 else bx.SIN2)
    part = bx.MOTION if p.order > 0 else bx.ANGLE
    for k in range(PEAKS):
        sign = 1.0 if k < PEAKS // 2 or p.order == 0 else -1.0
        if k == PEAKS // 2 and p.order > 0:
            used[:] = 0
        i = _next_peak(height, sign, used)
        if i >= 0 and sign * height[i] > 0.0:
            theta = _place_of(height, sign, i)
            _at_angle(at, theta, half)
            if run(bx.OPERATIONS, bx.FACTORS, bx.ENDS, part, at, half):
                count = _take(rows, count, at, form, ABOVE if sign > 0.0 else BELOW, theta, sign)
    return count


@inline
def _single(rows: Rows, start: int, count: int) -> int:
    """A row of limits from ``start`` on that is negative on the whole box; -1 where there is none."""
    found = -1
    for j in range(start, count):
        if not rows.objective[j] and surely_negative(rows.forms, j):
            found = j
    return found


@kernel
def judge(
    p: Problem, low: Array, high: Array, varied: Array, given: Array, at: Array, rows: Rows, scratch: Array, used: Flags
) -> tuple[int, int, float]:
    """What can be said of one box: outcome, number of rows, and the bound of the objective.

    The outcome is BOUND, EMPTY or OPEN; ``rows.factors`` combine the rows to what it says.
    """
    n = low.shape[0]
    centre, half, height, neck = scratch[0, :n], scratch[1, :n], scratch[2], scratch[3]
    halves(low, high, centre, half)
    _inputs(p, centre, half, varied, given, at)
    run(bx.OPERATIONS, bx.FACTORS, bx.ENDS, bx.PLACE, at, half)
    count = 0
    for kind in range(len(bx.ACCEPTANCE)):
        count = _take(rows, count, at, bx.ACCEPTANCE[kind], kind, 0.0, 1.0)
    count = _limit_rows(p, rows, count, at, bx.LIMITS_A, LEAST_A)
    count = _limit_rows(p, rows, count, at, bx.LIMITS_C, LEAST_C)
    rows.factors[:] = 0.0
    for k in range(n):
        rows.loose[k] = -1.0
    empty, whole = _single(rows, 0, count), False
    if empty < 0:
        start = count
        sign = 1.0 if at[bx.DETERMINANT, CENTRE] > 0.0 else -1.0  # where it is not known, the next part ends
        constant(at, bx.SIGN, sign, sign)
        whole = run(bx.OPERATIONS, bx.FACTORS, bx.ENDS, bx.LENGTHS, at, half) and at[bx.CRANK_ABOVE_ZERO, RANGE] > 0.0
        if whole:
            count = _turn_rows(p, rows, start, at, half, height, neck, used)
            empty = _single(rows, start, count)
    if empty >= 0:
        rows.factors[empty] = -1.0
        return EMPTY, count, math.inf
    bound, limits_alone = best_bound(
        rows.forms, count, rows.objective, half, rows.work, rows.basis, rows.linear, rows.sizes, rows.factors
    )
    if limits_alone:
        if bound > 0.0:
            return EMPTY, count, math.inf
        return OPEN, count, 0.0
    best = -1
    for j in range(count):
        if rows.objective[j] and rows.forms[j, RANGE] > bound:
            best, bound = j, rows.forms[j, RANGE]
    if best >= 0:
        rows.factors[:] = 0.0
        rows.factors[best] = 1.0
    if whole:
        looseness(rows.forms, rows.factors, count, half, rows.loose)
    return (BOUND if bound >= p.target else OPEN), count, max(bound, 0.0)


class Leaves(NamedTuple):
    """Boxes that were not halved: where they are and what was proven of them."""

    low: Array  # (m, n)
    high: Array
    outcome: Flags  # (m,)
    bound: Array
    kinds: Indices  # (m, COMBINED) rows that prove it, -1 where there are fewer
    theta: Array
    factors: Array


@kernel
def _record(
    leaves: Leaves, count: int, low: Array, high: Array, outcome: int, bound: float, rows: Rows, used: int
) -> int:
    """One more leaf, with the rows that prove it."""
    leaves.low[count], leaves.high[count] = low, high
    leaves.outcome[count], leaves.bound[count] = outcome, bound
    leaves.kinds[count], leaves.theta[count], leaves.factors[count] = -1, 0.0, 0.0
    place = 0
    for j in range(used):
        if rows.factors[j] != 0.0 and place < COMBINED:
            leaves.kinds[count, place], leaves.theta[count, place] = rows.kinds[j], rows.theta[j]
            leaves.factors[count, place] = rows.factors[j]
            place += 1
    return count + 1


@inline
def _to_halve(low: Array, high: Array, whole: Array, loose: Array) -> int:
    """The variable whose width costs the bound most; where that is not known, the one of the widest share."""
    best = 0
    known = loose.max() > 0.0
    for k in range(1, low.shape[0]):
        share, lead = (high[k] - low[k]) / whole[k], (high[best] - low[best]) / whole[best]
        if (loose[k] > loose[best]) if known else (share > lead):
            best = k
    return best


@kernel
def explore(
    p: Problem, low: Array, high: Array, whole: Array, varied: Array, given: Array, smallest: float, most: int,
    leaves: Leaves,
) -> tuple[int, int]:  # fmt: skip
    """Halve a box until every part is proven not to reach the target, or so many parts were judged; worst parts first.

    Parameters
    ----------
    p : what is asked
    low, high : (n,) the box, n <= 4
    whole : (n,) width of the whole space, by which widths are compared
    varied, given : (n,) which of the seven coordinates vary (inputs of :mod:`kernels.families.rssr.boxes`), and all seven
    smallest : share of ``whole`` below which a part is not halved again
    most : parts to judge
    leaves : out, of at least most + 1 rows

    Returns
    -------
    Leaves that were filled, and parts that were judged.  Leaves of outcome OPEN or TOO_SMALL are not proven; their bound
    is what is known of them.
    """
    n = low.shape[0]
    at = np.zeros((bx.FORMS, SLOPES + 2 * n))
    rows = Rows(
        np.zeros((MOST_ROWS, SLOPES + 2 * n)), np.zeros(MOST_ROWS, np.int64), np.zeros(MOST_ROWS),
        np.zeros(MOST_ROWS, np.uint8), np.zeros(MOST_ROWS), np.zeros((n + 6, n + 1)), np.zeros(n + 1, np.int64),
        np.zeros((MOST_ROWS, n + 1)), np.zeros(MOST_ROWS), np.zeros(n),
    )  # fmt: skip
    scratch, used = np.zeros((4, POSES)), np.zeros(POSES, np.uint8)
    lows, highs, bounds = np.zeros((most + 2, n)), np.zeros((most + 2, n)), np.zeros(most + 2)
    heap, depths = np.zeros(most + 2, np.int64), np.zeros(most + 2, np.int64)
    lows[0], highs[0], boxes, waiting, filled, judged = low, high, 1, 1, 0, 0
    heap[0] = 0
    while waiting > 0 and judged < most:
        box = pop(heap, waiting, bounds, depths)
        waiting -= 1
        judged += 1
        lo, hi = lows[box], highs[box]
        outcome, count, bound = judge(p, lo, hi, varied, given, at, rows, scratch, used)
        bounds[box] = max(bounds[box], bound)
        if outcome != OPEN:
            filled = _record(leaves, filled, lo, hi, outcome, bound, rows, count)
            continue
        k = _to_halve(lo, hi, whole, rows.loose)
        middle = 0.5 * (lo[k] + hi[k])
        if hi[k] - lo[k] < smallest * whole[k] or not lo[k] < middle < hi[k]:
            filled = _record(leaves, filled, lo, hi, TOO_SMALL, bounds[box], rows, 0)
            continue
        lows[boxes], highs[boxes], bounds[boxes] = lo, hi, bounds[box]
        lows[boxes, k], highs[box, k] = middle, middle
        depths[box] += 1
        depths[boxes] = depths[box]
        push(heap, waiting, bounds, depths, box)
        push(heap, waiting + 1, bounds, depths, boxes)
        waiting += 2
        boxes += 1
    for i in range(waiting):
        box = heap[i]
        filled = _record(leaves, filled, lows[box], highs[box], OPEN, bounds[box], rows, 0)
    return filled, judged
