"""The rows of a box of crank-rockers on the locus, and what they say of it together.

Rows of the objective are +-psi'' (or +-psi', or sin^2 of the pressure angle) at crank angles counted from the extended
position; rows of limits are those of the acceptance tests of docs/synthesis.md, of the pressure angle and of the links,
multiplied by what keeps them finite.  Crank angles are chosen where the design at the centre of a box has its peaks.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kernels._jit import inline, kernel
from kernels.families.rssr import box_turn as bt
from kernels.families.rssr.box_turn import Formulas
from kernels.proof.branching import (
    Flags,
    Indices,
    best_bound,
    halves,
    looseness,
    surely_negative,
)  # fmt: skip
from kernels.proof.slopes import CENTRE, RANGE, SLOPES, ULP, Array, constant, variable
from kernels.proof.tape import run
from kernels.sincos import sincos

POSES = 48  # of the centre design, to find the peaks
PEAKS, NECKS = 6, 3  # most rows of the objective and of the pressure angle
STEP = 2.0 * math.pi / POSES

# Kinds of rows: the acceptance tests, two per limited length, and those of the turn.
LIMITED, PRESSURE, ABOVE, BELOW = bt.LIMITED, 15, 16, 17
# What happened to a box.
OPEN, TOO_SMALL, BOUND, EMPTY = 0, 1, 2, 3


class Problem(NamedTuple):
    """What is asked of a design on the locus."""

    branch: float
    order: int  # 2: |psi''|, 1: |psi'|, 0: sin^2 of the pressure angle
    cos2: float  # least cos^2 of the pressure angle; 0 without a limit: then only the links must reach
    limits: Array  # (2 k,) least and most of every limited length; infinite without a limit
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
    """Compute the inputs of the formulas: coordinates number ``varied[k]`` vary, the others are given."""
    for j in range(bt.COORDINATES):
        constant(at, j, given[j], given[j])
    for k in range(half.shape[0]):
        variable(at, int(varied[k]), centre[k], half, k)
    constant(at, bt.BRANCH, p.branch, p.branch)
    constant(at, bt.COS2, p.cos2, p.cos2)
    for k in range(2 * bt.MOST_LIMITED):  # rows without a limit are not taken
        limit = p.limits[k] if k < p.limits.shape[0] and abs(p.limits[k]) < math.inf else 0.0
        constant(at, bt.LIMITS + k, limit, limit)


@inline
def _limit_rows(p: Problem, f: Formulas, rows: Rows, count: int, at: Array, first: int, last: int) -> int:
    """Return the rows of the limits number ``first`` to ``last`` - 1, where there are such."""
    for k in range(2 * first, min(2 * last, p.limits.shape[0])):
        if abs(p.limits[k]) < math.inf:
            count = _take(rows, count, at, f.slots[LIMITED + k], LIMITED + k, 0.0, 1.0)
    return count


@inline
def _middle(at: Array, form: int) -> float:
    return 0.5 * float(at[form, CENTRE] + at[form, CENTRE + 1])


@kernel
def _centre_curve(p: Problem, f: Formulas, at: Array, height: Array, neck: Array) -> None:
    """Compute the objective with its sign, and Delta/b^2, of the centre design at POSES crank angles;
    for the choice of rows.
    """
    place = f.slots[bt.CENTRES :]
    a, e, fs, aca = _middle(at, place[0]), _middle(at, place[1]), _middle(at, place[2]), _middle(at, place[3])
    k0, k1, k2, b2 = _middle(at, place[4]), _middle(at, place[5]), _middle(at, place[6]), _middle(at, place[7])
    u1, v1 = _middle(at, place[8]), _middle(at, place[9])
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
    """Return where a parabola through three values one apart has its summit, counted from the middle one."""
    bend = below - 2.0 * here + above
    return 0.5 * (below - above) / bend if bend < 0.0 else 0.0


@inline
def _next_peak(height: Array, sign: float, used: Flags) -> int:
    """Return the highest local maximum of sign * height that was not used; -1 where there is none."""
    found = -1
    for i in range(POSES):
        here = sign * height[i]
        peak = here > sign * height[i - 1] and here >= sign * height[(i + 1) % POSES]
        if peak and used[i] == 0 and (found < 0 or here > sign * height[found]):
            found = i
    if found >= 0:
        used[found] = 1
    return found


@inline
def _place_of(height: Array, sign: float, i: int) -> float:
    below, here, above = sign * height[i - 1], sign * height[i], sign * height[(i + 1) % POSES]
    return STEP * (i + _summit(below, here, above))


@inline
def _at_angle(f: Formulas, at: Array, theta: float, half: Array) -> None:
    """Compute the closure at a crank angle after the extended position.

    :func:`sincos` errs by less than a unit of its last place, so the intervals hold the exact sine and cosine.
    """
    s, c = sincos(theta)
    constant(at, bt.COS_THETA, c - 2.0 * ULP, c + 2.0 * ULP)
    constant(at, bt.SIN_THETA, s - 2.0 * ULP, s + 2.0 * ULP)
    run(f.operations, f.factors, f.ends, bt.CLOSURE, at, half)


@kernel
def _turn_rows(
    p: Problem, f: Formulas, rows: Rows, count: int, at: Array, half: Array, height: Array, neck: Array, used: Flags
) -> int:
    """Return rows of the pressure angle and of the objective, at the peaks of the centre design."""
    _centre_curve(p, f, at, height, neck)
    used[:] = 0
    for _ in range(NECKS):
        i = _next_peak(neck, -1.0, used)
        if i >= 0:
            theta = _place_of(neck, -1.0, i)
            _at_angle(f, at, theta, half)
            count = _take(rows, count, at, f.slots[bt.PRESSURE], PRESSURE, theta, 1.0)
    used[:] = 0
    part = bt.MOTION if p.order > 0 else bt.ANGLE
    form = f.slots[bt.SIN2 + p.order]
    for k in range(PEAKS):
        sign = 1.0 if k < PEAKS // 2 or p.order == 0 else -1.0
        if k == PEAKS // 2 and p.order > 0:
            used[:] = 0
        i = _next_peak(height, sign, used)
        if i >= 0 and sign * height[i] > 0.0:
            theta = _place_of(height, sign, i)
            _at_angle(f, at, theta, half)
            if run(f.operations, f.factors, f.ends, part, at, half):
                count = _take(rows, count, at, form, ABOVE if sign > 0.0 else BELOW, theta, sign)
    return count


@inline
def _single(rows: Rows, start: int, count: int) -> int:
    """Return a row of limits from ``start`` on that is negative on the whole box; -1 where there is none."""
    found = -1
    for j in range(start, count):
        if not rows.objective[j] and surely_negative(rows.forms, j):
            found = j
    return found


@inline
def _doubtful(rows: Rows, count: int, half: Array) -> int:
    """Return the row of limits that is nearest to being negative on the whole box, in units of its spread."""
    found, lowest = -1, math.inf
    for j in range(count):
        if not rows.objective[j]:
            spread = 0.0
            for k in range(half.shape[0]):
                low, high = rows.forms[j, SLOPES + 2 * k], rows.forms[j, SLOPES + 2 * k + 1]
                spread += max(abs(low), abs(high)) * half[k]
            height = (rows.forms[j, CENTRE] + rows.forms[j, CENTRE + 1]) / max(spread, 1e-300)
            if height < lowest:
                found, lowest = j, height
    return found


@inline
def _lengths(f: Formulas, at: Array, half: Array) -> bool:
    """Return the lengths of the designs; false where a divisor may vanish, or the crank."""
    if f.slots[bt.SIGN] >= 0:
        sign = 1.0 if at[f.slots[bt.SIGNED], CENTRE] > 0.0 else -1.0  # where it is not known, this part ends anyway
        constant(at, f.slots[bt.SIGN], sign, sign)
    if not run(f.operations, f.factors, f.ends, bt.LENGTHS, at, half):
        return False
    return bool(at[f.slots[bt.CRANK], RANGE] > 0.0)


@kernel
def judge(
    p: Problem, f: Formulas, low: Array, high: Array, varied: Array, given: Array, at: Array, rows: Rows,
    scratch: Array, used: Flags,
) -> tuple[int, int, float]:  # fmt: skip
    """Return what can be said of one box: outcome, number of rows, and the bound of the objective.

    The outcome is BOUND, EMPTY or OPEN; ``rows.factors`` combine the rows to what it says.
    """
    n = low.shape[0]
    centre, half, height, neck = scratch[0, :n], scratch[1, :n], scratch[2], scratch[3]
    halves(low, high, centre, half)
    _inputs(p, centre, half, varied, given, at)
    rows.factors[:] = 0.0
    rows.loose[:] = -1.0
    if not run(f.operations, f.factors, f.ends, bt.PLACE, at, half):
        return OPEN, 0, 0.0
    count = 0
    for kind in range(LIMITED):
        count = _take(rows, count, at, f.slots[bt.ACCEPTANCE + kind], kind, 0.0, 1.0)
    count = _limit_rows(p, f, rows, count, at, 0, f.early)
    empty = _single(rows, 0, count)
    if empty < 0:
        start = count
        if _lengths(f, at, half):
            count = _limit_rows(p, f, rows, count, at, f.early, bt.MOST_LIMITED)
            count = _turn_rows(p, f, rows, count, at, half, height, neck, used)
            empty = _single(rows, start, count)
    if empty >= 0:
        rows.factors[empty] = -1.0
        return EMPTY, count, math.inf
    bound, limits_alone = best_bound(
        rows.forms, count, rows.objective, half, rows.work, rows.basis, rows.linear, rows.sizes, rows.factors
    )
    if limits_alone and bound > 0.0:
        return EMPTY, count, math.inf
    best = -1
    if limits_alone:
        bound = 0.0
    for j in range(count):
        if rows.objective[j] and rows.forms[j, RANGE] > bound:
            best, bound = j, rows.forms[j, RANGE]
    if best >= 0:
        rows.factors[:] = 0.0
        rows.factors[best] = 1.0
    if bound <= 0.0:  # nothing was proven: halve what keeps a limit from emptying the box
        doubtful = _doubtful(rows, count, half)
        rows.factors[:] = 0.0
        rows.factors[doubtful] = 1.0
    looseness(rows.forms, rows.factors, count, half, rows.loose)
    return (BOUND if bound >= p.target else OPEN), count, max(bound, 0.0)
