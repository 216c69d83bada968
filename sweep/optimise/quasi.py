"""The next design from far away: sequential quadratic programming whose curvature is learnt from the steps it makes."""

from __future__ import annotations

import numpy as np

from sweep.families.base import Array
from sweep.optimise.dense import times
from sweep.optimise.model import Model, State
from sweep.optimise.quadratic import quadratic_step
from sweep.optimise.rows import Form

ITERATIONS, PER_VARIABLE = (
    30,
    3,
)  # in few variables Newton does the rest faster
SHORTENED = 6  # times a step is halved at most, or more where its quadratic model says so
DECREASE = 1e-4  # share of the promised gain that a step must keep
DAMPED = 0.2  # least curvature along a step, as a share of what was believed (Powell 1978)
SETTLED = 1e-12  # promised gain below which the rows are as good as they get


def propose(model: Model, at: State, form: Form, t: float, radius: float, floor: float | None) -> tuple[Array, float]:
    """Minimise t under the rows of a form, at most ``radius`` away in every scaled variable.

    Parameters
    ----------
    model, at : the start and its present design
    form : rows; their points are followed as the design moves
    t : value to begin with
    radius : of the box the search may not leave
    floor : lower bound of t, if any

    Returns
    -------
    The scaled variables (n,) and the t reached with these rows.
    """
    trail = _Trail(model, form)
    low, high = np.maximum(at.fractions - radius, 0.0), np.minimum(at.fractions + radius, 1.0)
    x = np.clip(at.fractions, low, high)
    curvature = np.eye(len(x))
    for _ in range(min(ITERATIONS, PER_VARIABLE * len(x))):
        rows, jacobian = trail.rows(x, t), trail.jacobian(x)
        box = (low - x, high - x, -np.inf if floor is None else floor - t)
        step, weights = quadratic_step(curvature, jacobian, rows, form, box, model.price)
        before = t + model.price * _missed(form, rows)
        after = t + step[-1] + model.price * _missed(form, rows + times(jacobian, step))
        promised = before - after
        if not promised > SETTLED:
            break
        share, found = 1.0, False
        for _ in range(SHORTENED):
            there = np.clip(x + share * step[:-1], low, high)
            merit = t + share * step[-1] + model.price * _missed(form, trail.rows(there, t + share * step[-1]))
            if merit <= before - DECREASE * share * promised:
                found = True
                break
            # The parabola through what is known: value and slope here, value there.
            bent = share * promised / (2.0 * (merit - before + share * promised))
            share *= min(max(bent, 0.1), 0.5)
        if not found:
            break
        moved = there - x
        x, t = there, t + share * float(step[-1])
        change = times(weights, jacobian[:, :-1] - trail.jacobian(x)[:, :-1])
        curvature = learnt(curvature, moved, change)
    return x, t


def _missed(form: Form, rows: Array) -> float:
    """Largest violation of the rows; those of the objective are kept by t, which gives way."""
    return float(np.maximum(np.where(form.equal, np.abs(rows), -rows), 0.0).max(initial=0.0))


def learnt(curvature: Array, moved: Array, change: Array) -> Array:
    """BFGS update, damped so that the curvature stays positive."""
    along = times(curvature, moved)
    known, seen = float((moved * along).sum()), float((moved * change).sum())
    if not known > 1e-300:
        return curvature
    if seen < DAMPED * known:
        share = (1.0 - DAMPED) * known / (known - seen)
        change = share * change + (1.0 - share) * along
        seen = DAMPED * known
    update = curvature + np.outer(change, change) / seen - np.outer(along, along) / known
    return np.asarray(0.5 * (update + update.T), np.float64)


class _Trail:
    """Rows and gradients along one run; the points are followed from the last design that took a gradient."""

    def __init__(self, model: Model, form: Form) -> None:
        self.model, self.form = model, form
        self.origin = self.points = form.points
        self.seen = self.atoms = np.empty(0)
        self.slopes: Array | None = None

    def _move(self, x: Array) -> None:
        if not np.array_equal(self.seen, x):
            self.points, self.atoms = self.model.moved(x, self.form, self.origin)
            self.seen, self.slopes = x.copy(), None

    def rows(self, x: Array, t: float) -> Array:
        self._move(x)
        return self.form.rows(self.atoms, t)

    def jacobian(self, x: Array) -> Array:
        """Gradients (R, n + 1) by the scaled variables and by t."""
        self._move(x)
        if self.slopes is None:
            self.slopes = self.model.jacobian(x, self.form, self.points)
            if np.isfinite(self.points.value).all():
                self.origin = self.points
        return np.column_stack([np.nan_to_num(self.slopes, posinf=0.0, neginf=0.0), self.form.slack])
