"""The rows of a box of crank-rockers on the locus, and the verdict that they prove together.

Rows of the objective are +-psi'' (or +-psi', or sin^2 of the pressure angle) at crank angles counted from the extended
position; rows of limits are those of the acceptance tests of docs/synthesis.md, of the pressure angle and of the links,
multiplied by factors that keep them finite, and those of the arrival.  Cheap rows are tried first: most boxes are
decided by limits and arrival alone.

The rows of the arrival hold for designs whose acceleration reaches the target.  Between its limits the rocker goes from
rest to rest, so its angle stays in a tube (:mod:`kernels.boxes.tube`).  The sign of F(phi, psi) on the tube's sides
tells whether it does, without solving for psi: F is a polynomial, where psi'' is a quotient of roots.  So these rows
decide boxes far larger than rows of psi'' do.  Where rho1 + rho2 may vanish the crank's length
is not known from the limit positions.  There it is a further variable between its own limits: F is linear in it, and
a (rho1 + rho2) = crank of the locus gives two more rows.
"""

from __future__ import annotations

import math

from kernels.boxes.branching import BOUND, EMPTY, OPEN, Flags, best_bound, halves, looseness, surely_negative
from kernels.boxes.tape import run
from kernels.boxes.taylor import VALUE, constant, least, sizes, up, variable
from kernels.boxes.tube import COSINES, HIGH, LOW, THETA
from kernels.families.rssr import box_turn as bt
from kernels.families.rssr.box_peaks import peak_rows
from kernels.families.rssr.box_problem import (
    AHEAD,
    FREE_AHEAD,
    FREE_LONG,
    FREE_SHORT,
    BoxQuestion,
    BoxScratch,
    acceptance_rows,
    angle_inputs,
    inputs,
    limit_rows,
    middle,
    take,
)
from kernels.families.rssr.box_turn import Formulas
from kernels.jit import inline, kernel
from kernels.types import Array


@kernel
def _passed(start: Array, pose: Array, side: int, total: float, crank: float) -> float:
    """Evaluate F at a pose of the tube for the design at the centre, times ``total``, to choose the rows."""
    n1, x1, y1, e, fs, ca, u1, v1 = start[0], start[1], start[2], start[3], start[4], start[5], start[6], start[7]
    c, s, turn_c, turn_s = pose[COSINES], pose[COSINES + 1], pose[COSINES + 2 * side], pose[COSINES + 2 * side + 1]
    u, v = u1 * c - v1 * s, v1 * c + u1 * s
    x, y = x1 * (turn_c - 1.0) - y1 * turn_s, y1 * (turn_c - 1.0) + x1 * turn_s
    return float(total * (e * x - fs * y) - crank * (n1 * (c - 1.0) + u * x + v * ca * y))


@kernel
def _worst(p: BoxQuestion, start: Array, group: int, total: float, crank: float) -> int:
    """Find the pose where the centre design is farthest out of one side of the tube on one stroke; -1 for none."""
    stroke, side = p.tube.shape[0] // 2, LOW + group % 2
    sign = p.branch if side == HIGH else -p.branch
    found, lowest = -1, math.inf
    for i in range(stroke * (group // 2), stroke * (group // 2 + 1)):
        if abs(p.tube[i, side]) < math.inf:
            passed = sign * _passed(start, p.tube[i], side, total, crank)
            if passed < lowest:
                found, lowest = i, passed
    return found


@inline
def _put(
    p: BoxQuestion, f: Formulas, rows: BoxScratch, count: int, i: int, side: int, part: int, slot: int, kind: int
) -> int:
    """Add the row of a pose; return the number of rows.  ``kind`` is for the side ahead, the next kind for behind."""
    angle_inputs(rows.at, bt.COS_THETA, p.tube[i, THETA])
    angle_inputs(rows.at, bt.COS_TURN, p.tube[i, side])
    run(f.operations, f.factors, f.ends, part, rows.at, rows.ones.shape[0])
    ahead = side == HIGH
    return int(take(rows, count, f.slots[slot], kind if ahead else kind + 1, p.tube[i, THETA], 1.0 if ahead else -1.0))


@kernel
def _centre(f: Formulas, rows: BoxScratch, start: Array) -> None:
    """Write n1, X1, Y1, e, f sa, ca, u1, v1 of the design at the centre."""
    for k in range(8):
        start[k] = middle(rows.at, f.slots[bt.STARTS + 2 + k])


@kernel
def arrival_rows(p: BoxQuestion, f: Formulas, rows: BoxScratch, count: int, start: Array) -> int:
    """Add the rows that a design with the target keeps, one per stroke and side; return the number of rows."""
    _centre(f, rows, start)
    total, crank = middle(rows.at, f.slots[bt.STARTS]), middle(rows.at, f.slots[bt.STARTS + 1])
    for group in range(4):
        found = _worst(p, start, group, total, crank)
        if found >= 0:
            count = _put(p, f, rows, count, found, LOW + group % 2, bt.ARRIVAL, bt.PASSED, AHEAD)
    return count


@kernel
def free_crank_rows(p: BoxQuestion, f: Formulas, rows: BoxScratch, count: int, start: Array) -> int:
    """Add the rows of tube and locus for a crank whose length is a variable; return the number of rows.

    The poses are the worst of the centre design with its shortest, middle and longest crank.
    """
    _centre(f, rows, start)
    shortest, longest = max(p.limits[0], 0.0), p.limits[1]
    for group in range(4):
        last = -1
        for k in range(3):
            found = _worst(p, start, group, 1.0, shortest + 0.5 * k * (longest - shortest))
            if found >= 0 and found != last:
                count = _put(p, f, rows, count, found, LOW + group % 2, bt.FREE, bt.FREE_PASSED, FREE_AHEAD)
                last = found
    count = take(rows, count, f.slots[bt.FREE_CRANK], FREE_LONG, 0.0, 1.0)
    return int(take(rows, count, f.slots[bt.FREE_CRANK], FREE_SHORT, 0.0, -1.0))


@inline
def _single(rows: BoxScratch, start: int, count: int) -> int:
    """Find a row of limits from ``start`` on that is negative on the whole box; -1 where there is none."""
    found = -1
    for j in range(start, count):
        if not rows.objective[j] and surely_negative(rows.forms, j, rows.ones.shape[0], rows.total):
            found = j
    return found


@inline
def _doubtful(rows: BoxScratch, count: int, n: int) -> int:
    """Find the row of limits that is nearest to being negative on the whole box, in units of its spread."""
    found, lowest = -1, math.inf
    for j in range(count):
        if not rows.objective[j]:
            linear, square, rest = sizes(rows.forms, j, n)
            height = rows.forms[j, VALUE] / max(linear + square + rest, 1e-300)
            if height < lowest:
                found, lowest = j, height
    return found


@inline
def _lengths(f: Formulas, rows: BoxScratch) -> bool:
    """Compute the lengths of the designs; false where a divisor, or the crank's length, may vanish."""
    at, n = rows.at, rows.ones.shape[0]
    if f.slots[bt.SIGN] >= 0:
        sign = 1.0 if at[f.slots[bt.SIGNED], VALUE] > 0.0 else -1.0  # where it is not known, the run of this part fails
        constant(at, f.slots[bt.SIGN], sign, sign)
    if not run(f.operations, f.factors, f.ends, bt.LENGTHS, at, n):
        return False
    return bool(least(at[f.slots[bt.CRANK]], n) > 0.0)


@inline
def _by_target(rows: BoxScratch, count: int) -> bool:
    """Whether the multipliers use rows that hold only for designs with the target."""
    found = False
    for j in range(count):
        found = found or (rows.kinds[j] >= AHEAD and rows.factors[j] != 0.0)
    return found


@inline
def _emptied(p: BoxQuestion, rows: BoxScratch, count: int) -> tuple[int, int, float]:
    """Verdict by contradicting limits: no feasible design, or none with the target."""
    if _by_target(rows, count):
        return BOUND, count, p.target
    return EMPTY, count, math.inf


@inline
def crank_known(f: Formulas, rows: BoxScratch) -> bool:
    """Whether rho1 + rho2, by which the crank's length is divided, vanishes nowhere in the box."""
    return bool(least(rows.at[f.slots[bt.STARTS]], rows.ones.shape[0]) > 0.0)


@kernel
def _limits_alone(p: BoxQuestion, rows: BoxScratch, count: int) -> bool:
    """Whether the rows of limits contradict each other on the box; ``rows.factors`` combine them to the proof."""
    single = _single(rows, 0, count)
    if single >= 0:
        rows.factors[:] = 0.0
        rows.factors[single] = -1.0
        return True
    bound, alone = _best(rows, count)
    return bool(alone and bound > 0.0)


@inline
def _best(rows: BoxScratch, count: int) -> tuple[float, bool]:
    return best_bound(rows.forms, count, rows.objective, rows.ones, rows.linear, rows.sizes, rows.factors, rows.total)


@inline
def _undecided(rows: BoxScratch, count: int) -> None:
    """Compute how much each variable's width loosens the row of limits that is nearest to a decision."""
    rows.factors[:] = 0.0
    rows.factors[_doubtful(rows, count, rows.ones.shape[0])] = 1.0
    looseness(rows.forms, rows.factors, count, rows.ones.shape[0], rows.total, rows.loose)


@kernel
def judge(
    p: BoxQuestion, f: Formulas, low: Array, high: Array, varied: Array, given: Array, rows: BoxScratch, scratch: Array,
    used: Flags,
) -> tuple[int, int, float]:  # fmt: skip
    """Judge one box: outcome, number of rows, and the bound of the objective.

    The outcome is BOUND, EMPTY or OPEN; ``rows.factors`` combine the rows to its proof.
    """
    n = low.shape[0]
    centre, half, height, neck = scratch[0, :n], scratch[1, :n], scratch[2], scratch[3]
    halves(low, high, centre, half)
    inputs(p, centre, half, varied, given, rows.at)
    rows.factors[:] = 0.0
    rows.loose[:] = -1.0
    if not run(f.operations, f.factors, f.ends, bt.PLACE, rows.at, n):
        return OPEN, 0, 0.0
    count = acceptance_rows(p, f, rows)
    if p.tube.shape[0] > 0:
        count = arrival_rows(p, f, rows, count, height)
    if _limits_alone(p, rows, count):
        return _emptied(p, rows, count)
    if not _lengths(f, rows):
        _undecided(rows, count)
        return OPEN, count, 0.0
    first = count
    count = limit_rows(p, f, rows, count, f.early, bt.MOST_LIMITED)
    count = peak_rows(p, f, rows, count, height, neck, used)
    single = _single(rows, first, count)
    if single >= 0:
        rows.factors[:] = 0.0
        rows.factors[single] = -1.0
        return _emptied(p, rows, count)
    bound, alone = _best(rows, count)
    if alone and bound > 0.0:
        return _emptied(p, rows, count)
    if alone or not bound > 0.0:
        bound = 0.0
    elif _by_target(rows, count):
        bound = min(bound, p.target)
    best = -1
    for j in range(first, count):
        if rows.objective[j]:
            one = least(rows.forms[j], n)
            if one > bound:
                best, bound = j, one
    if best >= 0:
        rows.factors[:] = 0.0
        rows.factors[best] = 1.0
    if bound > 0.0:
        looseness(rows.forms, rows.factors, count, n, rows.total, rows.loose)
    else:
        _undecided(rows, count)
    return (BOUND if bound >= p.target else OPEN), count, bound


@kernel
def judge_any_crank(
    p: BoxQuestion, f: Formulas, low: Array, high: Array, varied: Array, given: Array, rows: BoxScratch, scratch: Array
) -> tuple[int, int, float]:
    """Judge a box as :func:`judge` does, where the crank's length does not follow from the place.

    ``rows`` is scratch for one variable more than the box has: the crank's length between its limits.
    """
    n = low.shape[0]
    centre, half, start = scratch[0, : n + 1], scratch[1, : n + 1], scratch[2]
    halves(low, high, centre[:n], half[:n])
    shortest, longest = max(p.limits[0], 0.0), p.limits[1]
    mean = 0.5 * (shortest + longest)
    half[n] = max(up(longest - mean), up(mean - shortest))
    inputs(p, centre, half, varied, given, rows.at)
    variable(rows.at, bt.ANY_CRANK, mean, half, n)
    rows.factors[:] = 0.0
    rows.loose[:] = -1.0
    if not run(f.operations, f.factors, f.ends, bt.PLACE, rows.at, n + 1):
        return OPEN, 0, 0.0
    count = free_crank_rows(p, f, rows, acceptance_rows(p, f, rows), start)
    if _limits_alone(p, rows, count):
        return _emptied(p, rows, count)
    _undecided(rows, count)
    return OPEN, count, 0.0
