"""Rows that hold for designs whose acceleration reaches the target: the rocker is where it can be in time.

Between its limits the rocker goes from rest to rest, so its angle stays in a tube (:mod:`kernels.boxes.tube`).  Whether
it does is told by the sign of F(phi, psi) on the tube's sides, without solving for psi: a polynomial, where psi'' is a
quotient of roots.  So these rows decide boxes far larger than rows of psi'' do.

Where rho1 + rho2 may vanish the crank's length is not known from the limit positions.  There it is a further variable
between its own limits: F is linear in it, and a (rho1 + rho2) = crank of the locus gives two more rows.
"""

from __future__ import annotations

import math

from kernels.boxes.tape import run
from kernels.boxes.tube import COSINES, HIGH, LOW, THETA
from kernels.families.rssr import box_turn as bt
from kernels.families.rssr.box_problem import (
    AHEAD,
    FREE_AHEAD,
    FREE_LONG,
    FREE_SHORT,
    Problem,
    Room,
    angle_inputs,
    middle,
    take,
)
from kernels.families.rssr.box_turn import Formulas
from kernels.jit import inline, kernel
from kernels.types import Array


@kernel
def _passed(start: Array, pose: Array, side: int, total: float, crank: float) -> float:
    """Return F at a pose of the tube for the design at the centre, times ``total``; for the choice of rows."""
    n1, x1, y1, e, fs, ca, u1, v1 = start[0], start[1], start[2], start[3], start[4], start[5], start[6], start[7]
    c, s, turn_c, turn_s = pose[COSINES], pose[COSINES + 1], pose[COSINES + 2 * side], pose[COSINES + 2 * side + 1]
    u, v = u1 * c - v1 * s, v1 * c + u1 * s
    x, y = x1 * (turn_c - 1.0) - y1 * turn_s, y1 * (turn_c - 1.0) + x1 * turn_s
    return float(total * (e * x - fs * y) - crank * (n1 * (c - 1.0) + u * x + v * ca * y))


@kernel
def _worst(p: Problem, start: Array, group: int, total: float, crank: float) -> int:
    """Return the pose at which the centre design is farthest out of one side of the tube on one stroke; -1 for none."""
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
def _put(p: Problem, f: Formulas, rows: Room, count: int, i: int, side: int, part: int, slot: int, kind: int) -> int:
    """Return the number of rows after one was added; ``kind`` is that of the side ahead, the next one that behind."""
    angle_inputs(rows.at, bt.COS_THETA, p.tube[i, THETA])
    angle_inputs(rows.at, bt.COS_TURN, p.tube[i, side])
    run(f.operations, f.factors, f.ends, part, rows.at, rows.ones.shape[0])
    ahead = side == HIGH
    return int(take(rows, count, f.slots[slot], kind if ahead else kind + 1, p.tube[i, THETA], 1.0 if ahead else -1.0))


@kernel
def _centre(f: Formulas, rows: Room, start: Array) -> None:
    """Compute n1, X1, Y1, e, f sa, ca, u1, v1 of the design at the centre."""
    for k in range(8):
        start[k] = middle(rows.at, f.slots[bt.STARTS + 2 + k])


@kernel
def arrival_rows(p: Problem, f: Formulas, rows: Room, count: int, start: Array) -> int:
    """Return the number of rows with those that a design with the target keeps, one per stroke and side of the tube."""
    _centre(f, rows, start)
    total, crank = middle(rows.at, f.slots[bt.STARTS]), middle(rows.at, f.slots[bt.STARTS + 1])
    for group in range(4):
        found = _worst(p, start, group, total, crank)
        if found >= 0:
            count = _put(p, f, rows, count, found, LOW + group % 2, bt.ARRIVAL, bt.PASSED, AHEAD)
    return count


@kernel
def free_crank_rows(p: Problem, f: Formulas, rows: Room, count: int, start: Array) -> int:
    """Return the number of rows with those of the tube and of the locus for a crank whose length is a variable.

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
