"""Formulas over boxes of designs, for the comparison of enclosures in ``tests/bench/enclosures.py``.

The formulas are those of the proofs (docs/proof.md): the tape of ``kernels/families/rssr/box_locus.py``.  Each
arithmetic runs the same operations on the same boxes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.boxes.tape import run
from kernels.boxes.taylor import ROUNDING, least, variable, width
from kernels.families.rssr import box_locus
from kernels.families.rssr import box_turn as bt
from kernels.jit import kernel
from sweep.proof.question import Question

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]

ANGLE_ERROR = 2.0**-51  # of the sines and cosines that are given
WANTED = {"psi''": bt.PSI2, "Delta - b^2 cos^2": bt.PRESSURE, "F": bt.PASSED}


@dataclass(frozen=True)
class Formula:
    """Operations of :mod:`kernels.boxes.tape`, and the forms where the results stand that are compared."""

    operations: Numbers
    factors: Array
    forms: int
    wanted: Numbers


@dataclass(frozen=True)
class Boxes:
    """Boxes of designs: the forms ``given`` are numbers known to ``error``, the forms ``varied`` go over the box."""

    given: Numbers  # (k,)
    values: Array  # (m, k)
    errors: Array  # (k,)
    varied: Numbers  # (n,)
    centre: Array  # (m, n)
    half: Array

    def __len__(self) -> int:
        return len(self.centre)

    def taken(self, which: Any) -> Boxes:
        """Some of them."""
        return replace(self, values=self.values[which], centre=self.centre[which], half=self.half[which])

    def sized(self, sides: Array) -> Boxes:
        """Boxes about the same centres with these sides."""
        return replace(self, half=np.broadcast_to(0.5 * sides, self.centre.shape).copy())

    def at(self, xi: Array) -> Boxes:
        """The designs at one place of every box, from -1 to 1, as boxes without width."""
        return replace(self, centre=self.centre + xi * self.half, half=np.zeros_like(self.half))

    def halved(self, k: int) -> Boxes:
        """Both halves of every box along variable k."""
        half = self.half.copy()
        half[:, k] *= 0.5
        step = np.zeros_like(half)
        step[:, k] = half[:, k]
        parts = (replace(self, centre=self.centre + sign * step, half=half) for sign in (-1.0, 1.0))
        return joined(*parts)


def joined(first: Boxes, second: Boxes) -> Boxes:
    """All boxes of two sets over the same formula."""
    names = ("values", "centre", "half")
    return replace(first, **{n: np.concatenate([getattr(first, n), getattr(second, n)]) for n in names})


def formula_of(question: Question) -> tuple[Formula, Any]:
    """Everything from the coordinates to psi'' and F at one crank angle, and the recorded tape."""
    recorded = box_locus.by_rocker() if "psi_ext" in question.provable.coordinates else box_locus.by_axes()
    parts = (bt.PLACE, bt.ARRIVAL, bt.LENGTHS, bt.CLOSURE, bt.MOTION)
    rows = np.concatenate([np.arange(recorded.ends[p], recorded.ends[p + 1]) for p in parts])
    wanted = recorded.slots[list(WANTED.values())]
    return Formula(recorded.operations[rows], recorded.factors[rows], recorded.forms, wanted), recorded


def mechanisms(question: Question, count: int, seed: int = 1) -> tuple[Formula, Boxes]:
    """Crank-rockers at random in the space, each at a crank angle where its pressure angle is within the limit."""
    formula, recorded = formula_of(question)
    rng, found = np.random.default_rng(seed), []
    while sum(map(len, found)) < count:
        boxes = _drawn(question, recorded, rng, 2000)
        at = _values(formula, recorded, boxes)
        accepted = at[:, recorded.slots[bt.ACCEPTANCE : bt.ACCEPTANCE + 5]].min(axis=1) > 0.0
        reached = (at[:, recorded.slots[bt.PRESSURE]] > 0.0) & np.isfinite(at[:, recorded.slots[bt.PSI2]])
        found.append(boxes.taken(accepted & reached & (at[:, recorded.slots[bt.CRANK]] > 0.0)))
    whole = found[0]
    for more in found[1:]:
        whole = joined(whole, more)
    return formula, whole.taken(slice(count))


def _drawn(question: Question, recorded: Any, rng: np.random.Generator, count: int) -> Boxes:
    """Places at random, each with a crank angle and a rocker angle somewhere on its way."""
    n, swing = len(question.names), question.given[0]
    centre = rng.uniform(question.low, question.high, (count, n))
    theta, turned = rng.uniform(0.0, 2.0 * np.pi, count), swing * rng.uniform(0.1, 0.9, count)
    coordinates = np.broadcast_to(question.given, (count, bt.COORDINATES))
    varied = question.free.astype(np.int64)
    columns = {j: coordinates[:, j] for j in range(bt.COORDINATES) if j not in varied}
    columns |= {bt.COS_THETA: np.cos(theta), bt.SIN_THETA: np.sin(theta)}
    columns |= {bt.COS_TURN: np.cos(turned), bt.SIN_TURN: np.sin(turned)}
    columns |= {bt.BRANCH: np.full(count, question.branch), bt.COS2: np.full(count, question.cos2)}
    columns |= {bt.LIMITS + k: np.zeros(count) for k in range(2 * bt.MOST_LIMITED)}
    columns |= {bt.ANY_CRANK: np.zeros(count)}
    errors = np.zeros(len(columns))
    for k, form in enumerate(columns):
        errors[k] = ANGLE_ERROR if form in (bt.COS_THETA, bt.SIN_THETA, bt.COS_TURN, bt.SIN_TURN) else 0.0
    given, values = np.array(list(columns)), np.column_stack(list(columns.values()))
    boxes = Boxes(given, values, errors, varied, centre, np.zeros((count, n)))
    if recorded.slots[bt.SIGN] < 0:
        return boxes
    # the sign of det is a number of its own: that of the place, since no box across det = 0 has lengths
    sign_form = recorded.slots[bt.SIGN]
    at = forms_of(formula_of(question)[0], replace_column(boxes, sign_form, np.ones(count)))
    return replace_column(boxes, sign_form, np.sign(at[:, recorded.slots[bt.SIGNED], 0]))


def replace_column(boxes: Boxes, form: int, values: Array) -> Boxes:
    """The same boxes with one more given number."""
    return replace(
        boxes, given=np.append(boxes.given, form), values=np.column_stack([boxes.values, values]),
        errors=np.append(boxes.errors, 0.0),
    )  # fmt: skip


def _values(formula: Formula, recorded: Any, boxes: Boxes) -> Array:
    """All numbers of the designs at the centres; nan from where a formula has no value."""
    return forms_of(formula, boxes)[:, :, 0]


def forms_of(formula: Formula, boxes: Boxes) -> Array:
    """All Taylor models of the boxes, (m, forms, width); nan where a box has no enclosure."""
    found = np.full((len(boxes), formula.forms, width(boxes.centre.shape[1])), np.nan)
    _run_all(*arguments(formula, boxes), found)
    return found


def taylor(formula: Formula, boxes: Boxes) -> tuple[Array, Array]:
    """Ends of the wanted numbers over every box by Taylor models; nan where there is no enclosure."""
    low, high = (np.full((len(boxes), len(formula.wanted)), np.nan) for _ in range(2))
    _taylor(*arguments(formula, boxes), formula.wanted, formula.forms, low, high)
    return low, high


def arguments(formula: Formula, boxes: Boxes) -> tuple[Any, ...]:
    """What the kernels of this comparison take, whatever their arithmetic."""
    return (
        formula.operations, formula.factors, boxes.given, boxes.values, boxes.errors, boxes.varied, boxes.centre,
        boxes.half,
    )  # fmt: skip


@kernel
def _inputs(given: Any, values: Array, errors: Array, varied: Any, centre: Array, half: Array, at: Array) -> None:
    last = at.shape[1] - 1
    for j in range(given.shape[0]):
        at[given[j], :] = 0.0
        at[given[j], 0], at[given[j], last] = values[j], errors[j] * (1.0 + ROUNDING)
    for k in range(varied.shape[0]):
        variable(at, int(varied[k]), centre[k], half, k)


@kernel
def _run_all(
    operations: Any, factors: Array, given: Any, values: Array, errors: Array, varied: Any, centre: Array, half: Array,
    out: Array,
) -> None:  # fmt: skip
    ends = np.array([0, operations.shape[0]])
    for i in range(centre.shape[0]):
        _inputs(given, values[i], errors, varied, centre[i], half[i], out[i])
        run(operations, factors, ends, 0, out[i], varied.shape[0])


@kernel
def _taylor(
    operations: Any, factors: Array, given: Any, values: Array, errors: Array, varied: Any, centre: Array, half: Array,
    wanted: Any, forms: int, low: Array, high: Array,
) -> None:  # fmt: skip
    n = varied.shape[0]
    at, form, ends = np.zeros((forms, width(n))), np.zeros(width(n)), np.array([0, operations.shape[0]])
    for i in range(centre.shape[0]):
        _inputs(given, values[i], errors, varied, centre[i], half[i], at)
        if not run(operations, factors, ends, 0, at, n):
            continue
        for j in range(wanted.shape[0]):
            low[i, j] = least(at[wanted[j]], n)
            form[:] = -at[wanted[j]]
            form[-1] = -form[-1]
            high[i, j] = -least(form, n)
