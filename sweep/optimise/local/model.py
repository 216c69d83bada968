"""Model of the mechanism for the searches: true extrema of a design, rows of its program, and their gradients."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Array
from sweep.optimise.extrema.gradients import gradients, reading_gradient, scalar_gradient, step_gradients, stepped
from sweep.optimise.extrema.points import STEP, Curves, Points
from sweep.optimise.local.kkt import ACTIVE, Multipliers, multipliers
from sweep.optimise.problem.program import Program
from sweep.optimise.problem.rows import Form
from sweep.optimise.problem.statement import PLACE, Problem
from sweep.reductions.steps import applying_step

FEASIBLE = 1e-9  # largest scaled violation of a feasible design
FIRST_PRICE = 10.0  # price of a unit of scaled violation when two designs are compared, until multipliers are known
SAMPLES = 256  # poses per turn on which extrema are sought
INWARD_SHARE = 0.1  # share of the way to the middle of the bounds at which equations are checked besides the start
DEPENDENT = 1e-7  # smallest singular value of normalised gradients of equations, and smallest length of one
NOT_TURNING = 1e6  # added to the violation of a design for which some limits do not exist


class Stopped(Exception):
    """The caller stops the search."""


class BudgetSpent(Stopped):
    """The start has used all its allowed evaluations."""


@dataclass(frozen=True)
class State:
    """A design with its true extrema: objective (in units of the start's) and largest scaled violation."""

    fractions: Array
    design: Array
    form: Form
    atoms: Array
    objective: float
    violation: float

    def merit(self, price: float) -> float:
        """Return objective plus price times violation; infinite if the objective does not exist."""
        return self.objective + price * self.violation

    @property
    def feasible(self) -> bool:
        """Whether every limit is kept."""
        return self.violation <= FEASIBLE

    @property
    def defined_violation(self) -> float:
        """Largest scaled violation of the limits that exist for this design."""
        return self.form.defined_violation(self.atoms)

    @property
    def elastic(self) -> float:
        """Violation that the elastic program minimises; designs that do not turn rank behind all that do."""
        return self.defined_violation if self.form.complete else self.defined_violation + NOT_TURNING


class Model:
    """One start: its signs and fixed parameters, the scale of its objective, and its stopping rules.

    Parameters
    ----------
    problem, program : problem to be minimised, and its program
    start : (P,) design; its signs are kept
    stop : asked at every evaluation; true ends the search by :class:`Stopped`
    budget : number of evaluations after which the search ends by :class:`BudgetSpent`; ``evaluations`` counts them
    """

    def __init__(
        self, problem: Problem, program: Program, start: Array, stop: Callable[[], bool], budget: float = math.inf
    ) -> None:
        self.evaluations, self.budget = 0, budget
        self.problem, self.program, self.stop, self.base = problem, program, stop, start
        self.curves = Curves(problem, program.series, program.with_angles)
        self.samples = problem.accuracy.samples or SAMPLES
        self.scale, self.price = 1.0, FIRST_PRICE
        self._scan: tuple[tuple[bytes, int], tuple[Points, bool]] | None = None  # the last one, by design and poses
        if program.objective.inner == "same":
            size = abs(self.state(problem.scaled(start[None, :])[0]).objective)
            self.scale = size if 1e-12 < size < math.inf else 1.0

    def count_evaluation(self) -> None:
        """Count one more evaluation of a design; raise :class:`Stopped` if the search is to end."""
        if self.evaluations >= self.budget:
            raise BudgetSpent
        if self.stop():
            raise Stopped
        self.evaluations += 1

    def design(self, fractions: Array) -> Array:
        """Return the design (P,) with its variables at the given fractions of their bounds."""
        return self.problem.placed(self.base, fractions)

    def state(self, fractions: Array, samples: int | None = None) -> State:
        """Return the state of a design with its true extrema, sought on ``samples`` poses and refined."""
        self.count_evaluation()
        return self.uncounted(fractions, samples)

    def uncounted(self, fractions: Array, samples: int | None = None) -> State:
        """Return the same as :meth:`Model.state` without counting the evaluation and without stopping."""
        design, samples = self.design(fractions), samples or self.samples
        key = design.tobytes(), samples
        if self._scan is None or self._scan[0] != key:  # the scale of the objective and the first state need the same
            self._scan = key, self.curves.scan(design, samples)
        points, turns = self._scan[1]
        form = self.program.lay_out(self.curves, design, points, turns, self.scale)
        atoms = self.atoms(design, form, points)
        return State(fractions, design, form, atoms, form.objective(atoms), form.violation(atoms))

    def with_points(self, state: State, extra: Points) -> Form:
        """Return the form of a design with additional points at fixed crank angles."""
        if not len(extra):
            return state.form
        points = Points.joined(state.form.points, self.curves.follow(state.design, extra))
        return self.program.lay_out(self.curves, state.design, points, state.form.complete, self.scale)

    def atoms(self, design: Array, form: Form, points: Points) -> Array:
        """Return the atoms of the form's rows: curves at the points, crank angles of the points, plain numbers."""
        scalars = self._scalars(form.scalars, design[None, :])
        return np.concatenate([points.value, points.phi, [scalars[name][0] for name in form.scalars]])

    def tracked(self, fractions: Array, form: Form, points: Points) -> tuple[Points, Array]:
        """Return the points tracked to another design, and the atoms there."""
        self.count_evaluation()
        design = self.design(fractions)
        tracked = self.curves.follow(design, points)
        return tracked, self.atoms(design, form, tracked)

    def jacobian(self, fractions: Array, form: Form, points: Points) -> Array:
        """Return gradients (R, n) of the form's rows by the scaled variables, at tracked points."""
        designs = stepped(self.problem, self.base, fractions)
        values, dphi = gradients(self.curves, designs, points, self.program.with_angles)
        scalars = self._scalar_gradients(form.scalars, fractions, designs, points, dphi)
        jacobian = np.concatenate([values, dphi, *(scalars[name][None, :] for name in form.scalars)])
        # A quantity without derivative, as the angle of a vanishing extremum, gives nan only in the rows that use it.
        undefined = ~np.isfinite(jacobian).all(axis=1)
        jacobian[undefined] = 0.0
        rows = np.asarray(form.matrix @ jacobian)
        rows[form.matrix[:, undefined].any(axis=1)] = np.nan
        return rows

    def certificate(self, state: State) -> Multipliers:
        """Return multipliers and residual of the optimality conditions at a checked design."""
        jacobian = self.jacobian(state.fractions, state.form, state.form.points)
        return multipliers(state.form, state.form.rows(state.atoms, state.objective), jacobian, state.fractions)

    def update_price(self, state: State) -> float:
        """Set the price of violations to twice the sum of the limits' multipliers (exact penalty).

        A higher price than needed forbids steps along curved limits that a later step would correct.

        Returns
        -------
        The residual of the optimality conditions; nan if active rows are not at their bounds, which makes multipliers
        meaningless.
        """
        if state.violation > ACTIVE:
            return math.nan
        duals = self.certificate(state)
        limits = [
            abs(w) for w, label in zip(duals.weights, state.form.labels, strict=True) if label.side != "objective"
        ]
        self.price = max(2.0 * float(sum(limits)), 0.5 * self.price, 1.0)
        return duals.residual

    def _scalar_gradients(
        self, names: Sequence[str], fractions: Array, designs: Any, points: Points, dphi: Array
    ) -> dict[str, Array]:
        slopes: dict[str, Array] = {}
        for name in names:
            if name in self.problem.family.parameter_names or name in self.program.pieces:
                slopes[name] = np.asarray(self._scalars((name,), designs)[name].imag / STEP, np.float64)
            elif name in self.program.readings:
                k = self.program.reading_point(name, self.curves, designs[0].real, points)
                output = self.program.readings[name].of
                nan = np.full(len(fractions), math.nan)
                slopes[name] = nan if k < 0 else reading_gradient(self.curves, designs, output, points.phi[k], dphi[k])
        rest = [name for name in names if name not in slopes]
        slopes |= step_gradients(self.problem.family, designs, rest, self.problem.accuracy)
        rest = [name for name in rest if name not in slopes]
        if rest:

            def values(rows: Array) -> Array:
                numbers = self._scalars(rest, self.problem.placed(self.base, rows))
                return np.stack([numbers[name] for name in rest], axis=1)

            slopes |= dict(zip(rest, scalar_gradient(values, fractions).T, strict=True))
        return slopes

    def _scalars(self, names: Sequence[str], designs: Any) -> dict[str, Any]:
        """Return plain numbers of designs, each (k,); every step of the family is called once for all its outputs."""
        problem, values, steps = self.problem, {}, defaultdict(list)
        for name in names:
            if name in problem.family.parameter_names:
                values[name] = designs[:, problem.family.parameter_names.index(name)]
            elif name in self.program.pieces:
                values[name] = self.program.pieces[name](designs)
            else:
                step = applying_step(problem.family, name, problem.accuracy)
                steps[name if step is None else step[0].name].append(name)
        for outputs in steps.values():
            columns = design_outputs(problem.family, designs, outputs, problem.accuracy, problem.window)
            values |= {name: np.asarray(columns[name], dtype=np.float64) for name in outputs}
        return values


def refuse_dependent(problem: Problem, program: Program, starts: Array) -> None:
    """Refuse equations of which one follows from the others, or from what the coordinates hold by construction.

    Their multipliers are not unique, so every start would stall.  Gradients at a single design may be parallel by
    accident: they have to be dependent at two designs of each start.

    Raises
    ------
    InputError
        naming the dependent equations.
    """
    if not any(r.equal for r in program.requirements):
        return
    common: set[str] | None = None
    for start in starts:
        start_point = np.clip(problem.scaled(start[None, :])[0], 0.0, 1.0)
        for fractions in (start_point, start_point + INWARD_SHARE * (0.5 - start_point)):
            model = Model(problem, program, start, lambda: False)
            state = model.uncounted(fractions)
            if not state.form.complete:
                continue
            rows = model.jacobian(fractions, state.form, state.form.points)[state.form.equal]
            if np.isfinite(rows).all():
                names = [row.name for row, equal in zip(state.form.labels, state.form.equal, strict=True) if equal]
                common = _dependent(rows, names) & (set(names) if common is None else common)
    if common:
        allowed = "equations of which none follows from the others or from what is held anyway: leave one out"
        if len(common) == 1:
            allowed = "an equation of what some variable changes: leave it out, or vary a parameter that it depends on"
        raise InputError("limits", " and ".join(sorted(common)), allowed, PLACE)


def _dependent(rows: Array, names: list[str]) -> set[str]:
    """Return the names of the rows (k, n) that take part in a linear dependency."""
    length = np.linalg.norm(rows, axis=1)
    if (length < DEPENDENT).any():
        return {name for name, size in zip(names, length, strict=True) if size < DEPENDENT}
    combinations, singular, _ = np.linalg.svd(rows / length[:, None])
    if len(singular) == len(names) and singular[-1] > DEPENDENT:
        return set()
    return {name for name, share in zip(names, combinations[:, -1], strict=True) if abs(share) > 1e-3}
