"""One start: rounds of SLSQP on the epigraph program, each checked against the true extrema, then a Newton polish."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sweep.families.base import Array
from sweep.optimise.certificate import Multipliers, multipliers
from sweep.optimise.form import Form, Program
from sweep.optimise.gradients import gradients, scalar_gradient
from sweep.optimise.points import STATIC, Curves, Points
from sweep.optimise.problem import Problem

FEASIBLE = 1e-9  # largest scaled violation of a feasible design
ROUNDS = 25
ITERATIONS = 100
PENALTY = 100.0  # price of a unit of scaled violation when two designs are compared


class Stopped(Exception):
    """The time budget is used up, or the caller wants to stop."""


@dataclass(frozen=True)
class State:
    """A design with its true extrema: objective (in units of the start's) and largest scaled violation."""

    fractions: Array
    design: Array
    form: Form
    atoms: Array
    objective: float
    violation: float

    @property
    def merit(self) -> float:
        """Objective and violation in one number; infinite where the objective does not exist."""
        return self.objective + PENALTY * self.violation

    @property
    def feasible(self) -> bool:
        """Whether every limit is kept."""
        return self.violation <= FEASIBLE


class Descent:
    """Search from one start; ``best`` always holds the best checked design so far.

    Parameters
    ----------
    problem, program : what to minimise
    start : (P,) design; its signs are kept
    stop : asked at every evaluation; true ends the search by :class:`Stopped`
    """

    def __init__(self, problem: Problem, program: Program, start: Array, stop: Callable[[], bool]) -> None:
        self.problem, self.program, self.stop = problem, program, stop
        self.curves = Curves(problem, program.series)
        self.base = start
        self.samples = problem.accuracy.samples or 256
        self.scale = 1.0
        self.gap = math.nan
        fractions = np.clip(problem.scaled(start[None, :])[0], 0.0, 1.0)
        self.best = self.state(fractions)
        if (
            math.isfinite(self.best.objective)
            and abs(self.best.objective) > 1e-12
            and program.objective.inner == "same"
        ):
            self.scale = abs(self.best.objective)
            self.best = self.state(fractions)

    def run(self) -> State:
        """Feasible first, then optimal; the result is polished and verified on a finer grid."""
        for _ in range(4):
            if not self.best.feasible:
                self._restore()
            if math.isfinite(self.best.objective) and self.best.violation < 1e-3:
                self._rounds(relaxed=False)
                self.best = self._polish(self.best)
            if self._verified():
                break
        return self.best

    # ---- designs -----------------------------------------------------------------------------------------------

    def state(self, fractions: Array, samples: int | None = None) -> State:
        """True extrema of a design, looked for on ``samples`` poses and refined."""
        self._check()
        design = self.problem.placed(self.base, fractions)
        points, turns = self.curves.scan(design, samples or self.samples)
        form = self.program.lay_out(self.curves, design, points, turns, self.scale)
        atoms = self._atoms(fractions, form, points)
        return State(fractions, design, form, atoms, form.objective(atoms), form.violation(atoms))

    def _atoms(self, fractions: Array, form: Form, points: Points) -> Array:
        scalars = [self._scalar(name, fractions[None, :])[0] for name in form.scalars]
        return np.concatenate([points.value, points.phi, scalars])

    def _scalar(self, name: str, fractions: Array) -> Array:
        from sweep.summaries import design_outputs

        designs = np.array([self.problem.placed(self.base, row) for row in fractions])
        columns = design_outputs(self.problem.family, designs, [name], self.problem.accuracy, self.problem.window)
        return np.asarray(columns[name], dtype=np.float64)

    def linear(self, fractions: Array, form: Form, points: Points) -> tuple[Array, Array]:
        """Atoms of followed points and the gradients of the form's rows by the scaled variables."""
        design = self.problem.placed(self.base, fractions)
        values, moves = gradients(self.curves, design, points, self.program.places)
        own = [scalar_gradient(lambda f, name=name: self._scalar(name, f), fractions) for name in form.scalars]
        jacobian = np.concatenate([values, moves, *(g[None, :] for g in own)])
        # The angle of an extremum that no row asks for may have no derivative; it must not spoil the others.
        jacobian[~form.matrix.any(axis=0)] = 0.0
        return self._atoms(fractions, form, points), form.matrix @ jacobian

    def _check(self) -> None:
        if self.stop():
            raise Stopped

    # ---- rounds ------------------------------------------------------------------------------------------------

    def _restore(self) -> None:
        """Smallest relaxation of the limits: zero where a feasible design is near."""
        for _ in range(ROUNDS):
            before = self.best
            if before.form.known_violation(before.atoms) == math.inf:
                return  # the links reach nowhere: there is nothing to follow
            self._rounds(relaxed=True)
            same_rows = before.form.complete == self.best.form.complete
            if self.best.feasible or (same_rows and self._short(self.best) > 0.999 * self._short(before)):
                return

    def _short(self, state: State) -> float:
        """What the elastic program minimises; designs that do not turn yet rank behind all that do."""
        known = state.form.known_violation(state.atoms)
        return known if state.form.complete else known + FEASIBLE_FIRST

    def _rounds(self, relaxed: bool) -> None:
        radius, extra = 0.25, Points.of([])
        for _ in range(ROUNDS):
            at = self.best
            form = self._with(at, extra)
            hard = {"rotatable"} if at.form.complete else set()
            fractions, t = self._slsqp(at, form.relaxed(hard) if relaxed else form, radius, relaxed)
            new = self.state(fractions)
            if relaxed:
                gain, true = self._short(at) - self._short(new), self._short(new)
            else:
                gain, true = at.merit - new.merit, new.objective
            step = float(np.abs(fractions - at.fractions).max())
            if gain > 0.0 or (gain == 0.0 and step == 0.0):
                self.best, radius, extra = new, 4.0 * radius, Points.of([])
                self.gap = abs(true - t) / max(abs(true), 1e-300)
                settled = abs(true - t) <= 1e-10 and gain <= 1e-12
                if step < 1e-10 or settled or (relaxed and new.feasible):
                    return
            else:
                if step < 1e-9 or gain > -1e-13:
                    return
                radius = 0.25 * min(radius, step)
                still = replace(new.form.points, how=np.full(len(new.form.points), STATIC))
                plain = np.array([self.curves.series[n].window is None for n in still.series], dtype=np.bool_)
                extra = Points.joined(extra, still.take(plain))

    def _with(self, at: State, extra: Points) -> Form:
        """The form of a design with further points at fixed crank angles, where a trial design had its maxima."""
        if not len(extra):
            return at.form
        points = Points.joined(at.form.points, self.curves.follow(at.design, extra))
        return self.program.lay_out(self.curves, at.design, points, at.form.complete, self.scale)

    def _slsqp(self, at: State, form: Form, radius: float, relaxed: bool) -> tuple[Array, float]:
        from scipy.optimize import minimize

        trail = _Trail(self, form)
        n = len(at.fractions)
        t0 = (
            max(0.0, float((-form.rows(self._atoms(at.fractions, form, form.points), 0.0)).max()))
            if relaxed
            else at.objective
        )
        low, high = np.maximum(at.fractions - radius, 0.0), np.minimum(at.fractions + radius, 1.0)
        bounds = [*zip(low, high, strict=True), (0.0, None) if relaxed else (None, None)]
        gradient = np.concatenate([np.zeros(n), [1.0]])
        constraints = []
        for kind, rows in (("ineq", ~form.equal), ("eq", form.equal)):
            if rows.any():
                constraints.append(
                    {
                        "type": kind,
                        "fun": lambda z, rows=rows: trail.rows(z)[rows],
                        "jac": lambda z, rows=rows: trail.jacobian(z)[rows],
                    }
                )
        found = minimize(
            lambda z: z[-1], np.concatenate([at.fractions, [t0]]), jac=lambda z: gradient, method="SLSQP",
            bounds=bounds, constraints=constraints, options={"maxiter": ITERATIONS, "ftol": 1e-13},
        )  # fmt: skip
        z = found.x if np.isfinite(found.x).all() else np.concatenate([at.fractions, [t0]])
        return np.clip(z[:-1], low, high), float(z[-1])

    # ---- end ---------------------------------------------------------------------------------------------------

    def certificate(self, state: State) -> Multipliers:
        """Multipliers and residual of the optimality conditions at a checked design."""
        _, jacobian = self.linear(state.fractions, state.form, state.form.points)
        return multipliers(state.form, state.form.rows(state.atoms, state.objective), jacobian, state.fractions)

    def _polish(self, state: State) -> State:
        """Newton's method on the optimality conditions of the active rows; kept only while it improves them."""
        residual = self.certificate(state).residual
        for _ in range(6):
            if residual < 1e-12 and state.feasible:
                break
            fractions = self._newton(state)
            if fractions is None:
                break
            new = self.state(fractions)
            if not new.merit <= state.merit + 1e-9 * max(1.0, abs(state.merit)):
                break
            new_residual = self.certificate(new).residual
            if new_residual > 0.5 * residual and new.violation >= 0.5 * state.violation:
                break
            state, residual = new, new_residual
        return state

    def _newton(self, state: State) -> Array | None:
        _, jacobian = self.linear(state.fractions, state.form, state.form.points)
        c = state.form.rows(state.atoms, state.objective)
        found = multipliers(state.form, c, jacobian, state.fractions)
        free = np.flatnonzero(~found.at_bound)
        active = np.flatnonzero(found.weights != 0.0)
        if not len(free) or not len(active):
            return None
        hessian = np.zeros((len(free) + 1, len(free) + 1))
        for column, j in enumerate(free):
            difference = np.zeros(len(free))
            for side in (1.0, -1.0):
                moved = state.fractions.copy()
                moved[j] += side * 1e-5
                points = self.curves.follow(self.problem.placed(self.base, moved), state.form.points)
                _, near = self.linear(moved, state.form, points)
                difference += side * (found.weights @ near)[free]
            hessian[:-1, column] = -difference / 2e-5
        hessian = 0.5 * (hessian + hessian.T)
        a = np.column_stack([jacobian[np.ix_(active, free)], state.form.slack[active]])
        gradient = np.concatenate([np.zeros(len(free)), [1.0]]) - a.T @ found.weights[active]
        system = np.block([[hessian, -a.T], [a, np.zeros((len(active), len(active)))]])
        step = np.linalg.lstsq(system, np.concatenate([-gradient, -c[active]]), rcond=1e-12)[0][: len(free)]
        if not np.isfinite(step).all() or np.abs(step).max() > 0.05:
            return None
        fractions = state.fractions.copy()
        fractions[free] = np.clip(fractions[free] + step, 0.0, 1.0)
        return fractions

    def _verified(self) -> bool:
        """Whether four times as many poses show the same extrema; if not, the search goes on with them."""
        fine = self.state(self.best.fractions, 4 * self.samples)
        target = max(self.problem.accuracy.target or 0.0, 1e-10)
        finite = math.isfinite(self.best.objective)
        if finite:
            self.gap = abs(fine.objective - self.best.objective) / max(abs(fine.objective), 1e-300)
        same = not finite or abs(fine.objective - self.best.objective) <= target * max(1.0, abs(fine.objective))
        if same and (fine.violation <= self.best.violation + FEASIBLE or fine.violation == self.best.violation):
            return True
        self.best, self.samples = fine, 4 * self.samples
        return False


FEASIBLE_FIRST = 1e6


class _Trail:
    """Rows and gradients along one SLSQP run; the points are followed from the last design that took a gradient."""

    def __init__(self, descent: Descent, form: Form) -> None:
        self.descent, self.form = descent, form
        self.origin = form.points
        self.seen: Array | None = None
        self.points = form.points
        self.slopes: Array | None = None

    def _move(self, z: Array) -> None:
        if self.seen is None or not np.array_equal(self.seen, z[:-1]):
            self.descent._check()
            design = self.descent.problem.placed(self.descent.base, z[:-1])
            self.points = self.descent.curves.follow(design, self.origin)
            self.seen, self.slopes = z[:-1].copy(), None
            self.atoms = self.descent._atoms(self.seen, self.form, self.points)

    def rows(self, z: Array) -> Array:
        self._move(z)
        return self.form.rows(self.atoms, z[-1])

    def jacobian(self, z: Array) -> Array:
        self._move(z)
        if self.slopes is None:
            _, self.slopes = self.descent.linear(z[:-1], self.form, self.points)
            if np.isfinite(self.points.value).all():
                self.origin = self.points
        return np.column_stack([np.nan_to_num(self.slopes, posinf=0.0, neginf=0.0), self.form.slack])


def deadline(seconds: float | None, stop: Callable[[], bool] | None) -> Callable[[], bool]:
    """A question to ask often: is the time used up, or does the caller want to stop?"""
    end = math.inf if seconds is None else time.monotonic() + seconds
    return lambda: time.monotonic() >= end or (stop is not None and stop())
