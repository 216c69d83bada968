"""Question about boxes of crank-rockers on the locus, the kinds of their rows, and the scratch to judge a box."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels.arithmetic.sincos import sincos
from kernels.boxes.branching import MOST_ROWS, Flags, Indices
from kernels.boxes.taylor import VALUE, constant, variable, width
from kernels.families.rssr import box_turn as bt
from kernels.families.rssr.box_turn import Formulas
from kernels.jit import inline, kernel
from kernels.types import Array

# Kinds of rows: the acceptance tests, two per limited length, those of the turn, and those of a design that reaches the
# target: psi is in the tube.  The last four hold for any crank length between its limits that is one of the locus.
LIMITED, PRESSURE, ABOVE, BELOW, AHEAD, BEHIND = bt.LIMITED, 15, 16, 17, 18, 19
FREE_AHEAD, FREE_BEHIND, FREE_LONG, FREE_SHORT = 20, 21, 22, 23

LARGE = 1e30


class BoxQuestion(NamedTuple):
    """Objective, limits and target for designs on the locus."""

    branch: float
    order: int  # 2: |psi''|, 1: |psi'|, 0: sin^2 of the pressure angle
    cos2: float  # least cos^2 of the pressure angle; 0 without a limit: then only the links must reach
    limits: Array  # (2 k,) least and most of every limited length, the crank first; infinite without a limit
    target: float
    tube: Array  # (2 m, 9) of kernels.boxes.tube, for the target; may be empty


class BoxScratch(NamedTuple):
    """The forms of a box, its rows, and the scratch of its linear program."""

    at: Array  # (forms, width) of the formulas
    forms: Array  # (MOST_ROWS, width) of the rows
    kinds: Indices
    theta: Array
    objective: Flags
    factors: Array
    linear: Array
    sizes: Array
    loose: Array
    ones: Array
    total: Array


@kernel
def room(forms: int, n: int) -> BoxScratch:
    """Allocate the scratch for boxes of ``n`` variables."""
    return BoxScratch(
        np.zeros((forms, width(n))), np.zeros((MOST_ROWS, width(n))), np.zeros(MOST_ROWS, np.int64),
        np.zeros(MOST_ROWS), np.zeros(MOST_ROWS, np.uint8), np.zeros(MOST_ROWS),
        np.zeros((MOST_ROWS, n + 1)), np.zeros(MOST_ROWS), np.zeros(n), np.ones(n), np.zeros(width(n)),
    )  # fmt: skip


@kernel
def inputs(p: BoxQuestion, centre: Array, half: Array, varied: Array, given: Array, at: Array) -> None:
    """Write the inputs of the formulas: the coordinates of number ``varied`` span the box, the others are given."""
    for j in range(bt.COORDINATES):
        constant(at, j, given[j], given[j])
    for k in range(varied.shape[0]):
        variable(at, int(varied[k]), centre[k], half, k)
    constant(at, bt.BRANCH, p.branch, p.branch)
    constant(at, bt.COS2, p.cos2, p.cos2)
    for k in range(2 * bt.MOST_LIMITED):  # rows without a limit are not taken
        limit = p.limits[k] if k < p.limits.shape[0] and abs(p.limits[k]) < math.inf else 0.0
        constant(at, bt.LIMITS + k, limit, limit)


@kernel
def take(rows: BoxScratch, count: int, form: int, kind: int, theta: float, sign: float) -> int:
    """Copy a form, or its negative, to the rows; return the number of rows."""
    last = rows.at.shape[1] - 1
    for j in range(last):
        rows.forms[count, j] = sign * rows.at[form, j]
    rows.forms[count, last] = rows.at[form, last]
    rows.kinds[count], rows.theta[count], rows.objective[count] = kind, theta, kind in (ABOVE, BELOW)
    # a form without a bound proves nothing, and would spoil the linear program
    return count + 1 if rows.at[form, last] < LARGE else count


@kernel
def angle_inputs(at: Array, cosine: int, angle: float) -> None:
    """Write the cosine and sine of a given angle as two inputs.

    :func:`sincos` errs by less than a unit of its last place, so the intervals hold the exact sine and cosine.
    """
    s, c = sincos(angle)
    constant(at, cosine, c - 2.0**-51, c + 2.0**-51)
    constant(at, cosine + 1, s - 2.0**-51, s + 2.0**-51)


@inline
def middle(at: Array, form: int) -> float:
    """Value of a form for the design at the centre of the box."""
    return float(at[form, VALUE])


@kernel
def acceptance_rows(p: BoxQuestion, f: Formulas, rows: BoxScratch) -> int:
    """Write the first rows, acceptance tests and limits that are known without a division; return their number."""
    count = 0
    for kind in range(LIMITED):
        count = take(rows, count, f.slots[bt.ACCEPTANCE + kind], kind, 0.0, 1.0)
    return int(limit_rows(p, f, rows, count, 0, f.early))


@kernel
def limit_rows(p: BoxQuestion, f: Formulas, rows: BoxScratch, count: int, first: int, last: int) -> int:
    """Add the rows of the limits number ``first`` to ``last`` - 1 that are finite; return the number of rows."""
    for k in range(2 * first, min(2 * last, p.limits.shape[0])):
        if abs(p.limits[k]) < math.inf:
            count = take(rows, count, f.slots[LIMITED + k], LIMITED + k, 0.0, 1.0)
    return count
