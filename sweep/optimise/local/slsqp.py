"""Step far from a solution: scipy's SLSQP on the epigraph program, whose rows track their extrema."""

from __future__ import annotations

from typing import Any

import numpy as np

from sweep.families.base import Array
from sweep.optimise.local.model import Model, State
from sweep.optimise.problem.rows import Form

ITERATIONS, PER_VARIABLE = 30, 3  # largest number of iterations; with few variables Newton steps finish faster
PRECISION = 1e-13  # change of t at which SLSQP ends


def propose(model: Model, base: State, form: Form, t: float, radius: float, floor: float | None) -> tuple[Array, float]:
    """Minimise t under the rows of a form, at most ``radius`` away in every scaled variable.

    Parameters
    ----------
    model, base : model of the start, and its present design
    form : rows; their points are tracked as the design moves
    t : initial value
    radius : half width of the box around the present design, in scaled variables
    floor : lower bound of t, if any

    Returns
    -------
    The scaled variables (n,) and the t reached with these rows.
    """
    from scipy.optimize import minimize

    tracked = _TrackedRows(model, form)
    low, high = np.maximum(base.fractions - radius, 0.0), np.minimum(base.fractions + radius, 1.0)
    start = np.append(np.clip(base.fractions, low, high), t)
    gradient = np.append(np.zeros(len(low)), 1.0)
    kinds = [(kind, mask) for kind, mask in (("ineq", ~form.equal), ("eq", form.equal)) if mask.any()]
    constraints = [
        {
            "type": kind,
            "fun": lambda z, mask=mask: tracked.rows(z)[mask],
            "jac": lambda z, mask=mask: tracked.jacobian(z)[mask],
        }
        for kind, mask in kinds
    ]
    run: Any = minimize
    result = run(
        lambda z: (z[-1], gradient), start, jac=True, method="SLSQP", constraints=constraints,
        bounds=[*zip(low, high, strict=True), (floor, None)],
        options={"maxiter": min(ITERATIONS, PER_VARIABLE * len(low)), "ftol": PRECISION},
    )  # fmt: skip
    z = result.x if np.isfinite(result.x).all() else start
    return np.clip(z[:-1], low, high), float(z[-1])


class _TrackedRows:
    """Rows and gradients along one run; points are tracked from the last design whose gradient was computed."""

    def __init__(self, model: Model, form: Form) -> None:
        self.model, self.form = model, form
        self.origin = self.points = form.points
        self.last = self.atoms = np.empty(0)
        self.gradients: Array | None = None

    def _move(self, x: Array) -> None:
        if not np.array_equal(self.last, x):
            self.points, self.atoms = self.model.tracked(x, self.form, self.origin)
            self.last, self.gradients = x.copy(), None

    def rows(self, z: Array) -> Array:
        """Return the rows (R,) at the scaled variables and t."""
        self._move(z[:-1])
        return self.form.rows(self.atoms, float(z[-1]))

    def jacobian(self, z: Array) -> Array:
        """Return the gradients (R, n + 1) of the rows by the scaled variables and by t."""
        self._move(z[:-1])
        if self.gradients is None:
            self.gradients = self.model.jacobian(z[:-1], self.form, self.points)
            if np.isfinite(self.points.value).all():
                self.origin = self.points
        return np.column_stack([np.nan_to_num(self.gradients, posinf=0.0, neginf=0.0), self.form.slack])
