"""One start: rounds of SLSQP, then of Newton steps, each checked against the true extrema; then polishing."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from sweep.families.base import Array
from sweep.optimise.extrema.points import Points
from sweep.optimise.extrema.scanned import STATIC
from sweep.optimise.local import newton, slsqp
from sweep.optimise.local.kkt import ACTIVE
from sweep.optimise.local.model import FEASIBLE, Model, State
from sweep.optimise.problem.on_locus import in_parameters
from sweep.optimise.problem.program import Program
from sweep.optimise.problem.rows import Form
from sweep.optimise.problem.statement import Problem

ROUNDS, CYCLES = 60, 3
PATIENCE, LATER_PATIENCE = 8, 2  # quasi-Newton rounds allowed to halve a violation, at first and after Newton rounds
NEWTON = 240  # Newton rounds: along a narrow curved valley hundreds are needed, and each gains
ON_LOCUS = 30  # Newton rounds on a locus before the parameters are tried: near its singular places they creep
KKT = 1e-6  # residual of a converged result
ROUNDING_RESIDUAL = 1e-14  # residual that no Newton round improves: SLSQP reaches corners of limits to rounding
RETURNS = 2  # returns to the last design within the limits
PRICE_GROWTH = 10.0  # factor on the price of violations if a search comes to rest outside of its limits
NEGLIGIBLE_GAIN = 1e-9  # gain of a round below which a satisfied optimality condition ends the search
MAX_ADDED = 48  # extrema of refused designs kept among the rows, since the next long step would meet them again
NEAR_ANGLE = 0.1  # largest distance that a tracked point moves by itself [rad]
NEAR = 1e-3  # scaled violation below which the objective is minimised
Propose: TypeAlias = Callable[[Model, State, Form, float, float, float | None], tuple[Array, float]]


class Descent:
    """Search from one start; ``best`` is always the best checked design so far, ``gap`` is that of the last round.

    ``best_feasible`` is the best design met within the limits, None before the first.

    Parameters
    ----------
    problem, program : problem to be minimised, and its program
    start : (P,) design; its signs are kept
    stop : asked at every evaluation; true ends the search by :class:`sweep.optimise.local.model.Stopped`
    budget : number of evaluations after which the search ends as well
    """

    def __init__(
        self, problem: Problem, program: Program, start: Array, stop: Callable[[], bool], budget: float = math.inf
    ) -> None:
        fractions = np.clip(problem.scaled(start[None, :])[0], 0.0, 1.0)
        self.model = Model(problem, program, problem.placed(start, fractions), stop, budget)
        self.gap = math.nan
        self.best_feasible: State | None = None
        self.best = self.model.state(fractions)

    @property
    def best(self) -> State:
        """Current design of the search."""
        return self._best

    @best.setter
    def best(self, new: State) -> None:
        self._best = new
        if new.feasible and (self.best_feasible is None or new.objective < self.best_feasible.objective):
            self.best_feasible = new

    def run(self) -> State:
        """Search for a feasible design first, then for the best one; polish it and verify it on a finer grid.

        A limit may have no slope beyond its bound, as ``phi0`` if a follower meets its ends twice a turn.  No step
        leads back from there, so the search resumes where it left the limits, with a higher price of violations.
        """
        self._descend()
        for _ in range(RETURNS):
            if self.best.feasible or self.best_feasible is None:
                break
            self.best = self.best_feasible
            self.model.price *= PRICE_GROWTH**CYCLES
            self._descend()
        self.return_to_feasible()
        return self.best

    def return_to_feasible(self) -> None:
        """Replace a final design outside the limits by the best one met within them."""
        if not self.best.feasible and self.best_feasible is not None:
            self.best = self.best_feasible

    def _descend(self) -> None:
        for _ in range(3):
            if not self.best.feasible:
                self._find_feasible()
            if math.isfinite(self.best.objective) and self.best.violation < NEAR:
                self._minimise()
                self.best = newton.polish(self.model, newton.repair(self.model, self.best))
            if self._verified():
                break

    def _minimise(self) -> None:
        """Minimise until the optimality conditions hold; if a locus makes that slow, continue in the parameters."""
        if self._optimal(KKT):
            return  # the start was the end of an earlier search
        in_links = in_parameters(self.model.problem, self.best.design)
        for _ in range(CYCLES):
            self._rounds(slsqp.propose, relaxed=False, tol=1e-4, rounds=8)
            if not self._optimal(ROUNDING_RESIDUAL):
                self._rounds(newton.propose, relaxed=False, tol=1e-13, rounds=NEWTON if in_links is None else ON_LOCUS)
            if self.model.certificate(self.best).residual <= KKT:
                break
            if self.best.violation > ACTIVE:
                self.model.price *= PRICE_GROWTH
            elif in_links is not None:
                self._search_in_parameters(in_links)
                in_links = None

    def _optimal(self, residual: float) -> bool:
        return self.best.violation <= ACTIVE and self.model.certificate(self.best).residual <= residual

    def _search_in_parameters(self, problem: Problem) -> None:
        """Search from the present design in other coordinates, and return to the original ones with the result."""
        model = self.model
        descent = Descent(problem, Program(problem), self.best.design, model.stop, model.budget - model.evaluations)
        try:
            descent.run()
        finally:
            model.evaluations += descent.model.evaluations
            fractions = model.problem.scaled(descent.best.design[None, :])[0]
            if np.isfinite(fractions).all():
                new = model.uncounted(np.clip(fractions, 0.0, 1.0))
                if new.merit(model.price) < self.best.merit(model.price):
                    self.best = new

    def _find_feasible(self) -> None:
        """Find the smallest relaxation of the limits: zero if a feasible design is near.

        In a narrow curved valley quasi-Newton curvature, rebuilt every round, converges slowly; then Newton rounds
        follow.
        """
        patience = PATIENCE
        for _ in range(ROUNDS):
            previous = self.best
            if math.isinf(previous.defined_violation):
                return  # a stage without a margin, as behind one that does not turn: nothing to follow
            slow = self._rounds(slsqp.propose, relaxed=True, tol=1e-4, patience=patience)
            if slow and self.best.form.complete:
                self._rounds(newton.propose, relaxed=True, tol=1e-4)
                patience = LATER_PATIENCE
            same_rows = previous.form.complete == self.best.form.complete
            if self.best.feasible or (same_rows and self.best.defined_violation > 0.999 * previous.defined_violation):
                break
        if not self.best.feasible and self.best.form.complete:
            self._rounds(newton.propose, relaxed=True, tol=1e-13)

    def _rounds(
        self, propose: Propose, relaxed: bool, tol: float, rounds: int = ROUNDS, patience: int | None = None
    ) -> bool:
        """Accept the designs that ``propose`` finds if their true extrema are better, until a round gains too little.

        A refused design shortens the next step, and its extrema missing among the rows are added to them.

        Returns
        -------
        Whether the search was slow: ``patience`` rounds in a row did not halve the violation.
        """
        radius, added, refused = 0.25, Points.of([]), False
        violations: list[float] = []
        for _ in range(rounds):
            base = self.best
            if patience is not None and base.form.complete:
                violations.append(base.defined_violation)
                if len(violations) > patience and base.defined_violation > 0.5 * violations[-1 - patience]:
                    return True
            form, t, floor = self.model.with_points(base, added), base.objective, None
            if not refused:
                atoms = base.atoms if not len(added) else self.model.atoms(base.design, form, form.points)
                form = form.near(atoms, t if math.isfinite(t) else 0.0)
            if relaxed:
                form, t, floor = form.relaxed({"rotatable"} if base.form.complete else set()), base.elastic, 0.0
                if not base.form.complete:
                    t = base.defined_violation
            fractions, predicted = propose(self.model, base, form, t, radius, floor)
            new = self.model.state(fractions)
            price = self.model.price
            gain = base.elastic - new.elastic if relaxed else base.merit(price) - new.merit(price)
            step = float(np.abs(fractions - base.fractions).max())
            if gain > 0.0:
                self.best, refused = new, False
                residual = math.nan if relaxed else self.model.update_price(new)
                radius = max(radius, min(1.0, 2.0 * step))
                actual = new.defined_violation if relaxed else new.objective
                self.gap = abs(actual - predicted) / max(abs(actual), 1e-300)
                if gain <= tol * max(abs(actual), 1.0) or (relaxed and new.feasible):
                    break
                if residual <= (KKT if gain <= NEGLIGIBLE_GAIN else 1e-2 * KKT):
                    break  # the polish covers the remaining distance in one step
            elif step < 1e-10 or gain > -1e-13 or radius < 1e-7:
                break
            else:
                radius, refused = 0.25 * min(radius, step), True
                added = Points.joined(added, self._untracked(new.form.points, form.points))
                added = added.take(slice(-MAX_ADDED, None))
        return False

    def _untracked(self, extrema: Points, tracked: Points) -> Points:
        """Return the extrema of a refused design that are not near a known point, at fixed crank angles."""
        distance = np.abs(np.remainder(extrema.phi[:, None] - tracked.phi + np.pi, 2.0 * np.pi) - np.pi)
        alike = (extrema.series[:, None] == tracked.series) & (extrema.sense[:, None] == tracked.sense)
        new = ~((distance < NEAR_ANGLE) & alike).any(axis=1)
        # Windows and passages move with the design: a fixed angle may leave them, where the limit does not apply.
        fixed = [s.window is None and s.passes is None for s in self.model.curves.series]
        new &= np.array(fixed, dtype=np.bool_)[extrema.series]
        return replace(extrema, kind=np.full(len(extrema), STATIC)).take(new)

    def _verified(self) -> bool:
        """Tell whether four times as many poses give the same extrema; if not, they become the search's extrema."""
        model = self.model
        fine = model.state(self.best.fractions, 4 * model.samples)
        if math.isfinite(self.best.objective):
            difference = abs(fine.objective - self.best.objective)
            self.gap = difference / max(abs(fine.objective), 1e-300)
            same = difference <= max(model.problem.accuracy.target or 0.0, 1e-10) * max(1.0, abs(fine.objective))
        else:
            same = True
        if same and (fine.violation <= self.best.violation + FEASIBLE or math.isinf(self.best.violation)):
            return True
        self.best, model.samples = fine, 4 * model.samples
        return False
