"""The next design from near by: sequential quadratic programming with the exact Hessian of the Lagrangian.

SLSQP learns curvature from the steps it makes; in a narrow curved valley (a straightness of 0.05 mm on links of 50 mm)
it needs hundreds.  Here the curvature comes from differences of exact gradients, so a few steps do.
"""

from __future__ import annotations

import numpy as np

from sweep.families.base import Array
from sweep.optimise.certificate import Multipliers, multipliers
from sweep.optimise.form import Form
from sweep.optimise.model import Model, State
from sweep.optimise.points import Index
from sweep.optimise.slsqp import minimise_last

DIFFERENCE = 1e-5  # of the scaled variables; gradients are good to 1e-12, so the Hessian is to 1e-5
QUADRATIC_ITERATIONS = 60


def propose(model: Model, at: State, form: Form, t: float, radius: float, floor: float | None) -> tuple[Array, float]:
    """Minimise the quadratic model of the Lagrangian under linear rows, with a second-order correction.

    Parameters and results are those of :func:`sweep.optimise.slsqp.propose`.
    """
    points = form.points
    jacobian = np.nan_to_num(model.jacobian(at.fractions, form, points))
    rows = form.rows(model.atoms(at.fractions, form, points), t)
    found = multipliers(form, rows, jacobian, at.fractions)
    curvature = hessian(model, at, form, found, np.arange(len(at.fractions)))
    full = np.column_stack([jacobian, form.slack])
    low, high = np.maximum(-radius, -at.fractions), np.minimum(radius, 1.0 - at.fractions)
    bounds = [*zip(low, high, strict=True), (None if floor is None else floor - t, None)]
    step = _quadratic(curvature, full, rows, form, bounds)
    best, value = step, np.inf
    for _ in range(2):
        there = np.clip(at.fractions + step[:-1], 0.0, 1.0)
        _, atoms = model.moved(there, form, points)
        true = form.rows(atoms, t + step[-1])
        merit = step[-1] + model.price * float(
            np.maximum(np.where(form.equal, np.abs(true), -true), 0.0).max(initial=0.0)
        )
        if not merit < value - 1e-14:
            break
        best, value = step, merit
        # The rows bend away from their tangents: aim beside by what was missed.
        step = _quadratic(curvature, full, true - full @ step, form, bounds)
    return np.clip(at.fractions + best[:-1], 0.0, 1.0), t + float(best[-1])


def hessian(model: Model, at: State, form: Form, found: Multipliers, free: Index) -> Array:
    """Second derivatives of the Lagrangian by the free variables, from differences of exact gradients."""
    base = found.weights @ np.nan_to_num(model.jacobian(at.fractions, form, form.points))
    columns = []
    for j in free:
        moved = at.fractions.copy()
        step = DIFFERENCE if moved[j] <= 0.5 else -DIFFERENCE
        moved[j] += step
        points, _ = model.moved(moved, form, form.points)
        columns.append((found.weights @ np.nan_to_num(model.jacobian(moved, form, points)) - base)[free] / -step)
    square = np.array(columns)
    return np.asarray(0.5 * (square + square.T), np.float64)


def _quadratic(curvature: Array, full: Array, rows: Array, form: Form, bounds: list[tuple[object, object]]) -> Array:
    """Step (n + 1,) that makes t + half the curvature small under linear rows within bounds."""
    n = len(curvature)

    def model(z: Array) -> tuple[float, Array]:
        bent = curvature @ z[:n]
        return float(z[n] + 0.5 * z[:n] @ bent), np.concatenate([bent, [1.0]])

    return minimise_last(
        np.zeros(n + 1), bounds, form.equal, lambda z: rows + full @ z, lambda z: full, QUADRATIC_ITERATIONS, model
    )


def repair(model: Model, state: State) -> State:
    """Bring a nearly feasible design back within its limits by the smallest steps that meet the violated rows."""
    for _ in range(5):
        if state.feasible or not state.violation < 1e-2:
            break
        c = state.form.rows(state.atoms, state.objective)
        limits = np.array([label.side != "objective" for label in state.form.labels], dtype=np.bool_)
        missed = limits & ((c < 0.0) | state.form.equal)
        jacobian = np.nan_to_num(model.jacobian(state.fractions, state.form, state.form.points))[missed]
        step = np.linalg.lstsq(jacobian, -c[missed], rcond=1e-12)[0]
        new = model.state(np.clip(state.fractions + step, 0.0, 1.0))
        if not new.violation < state.violation:
            break
        state = new
    return state


def polish(model: Model, state: State) -> State:
    """Newton's method on the optimality conditions of the active rows; kept only while it improves them."""
    residual = model.certificate(state).residual
    for _ in range(6):
        if not residual > 1e-12 and state.feasible:
            break
        fractions = _conditions_step(model, state)
        if fractions is None:
            break
        new = model.state(fractions)
        if not new.merit(model.price) <= state.merit(model.price) + 1e-9 * max(1.0, abs(state.objective)):
            break
        new_residual = model.certificate(new).residual
        if new_residual > 0.5 * residual and new.violation >= 0.5 * state.violation:
            break
        state, residual = new, new_residual
    return state


def _conditions_step(model: Model, state: State) -> Array | None:
    jacobian = model.jacobian(state.fractions, state.form, state.form.points)
    c = state.form.rows(state.atoms, state.objective)
    found = multipliers(state.form, c, jacobian, state.fractions)
    free, active = np.flatnonzero(~found.at_bound), np.flatnonzero(found.weights != 0.0)
    if not len(free) or not len(active):
        return None
    n = len(free)
    system = np.zeros((n + 1 + len(active), n + 1 + len(active)))
    system[:n, :n] = hessian(model, state, state.form, found, free)
    a = np.column_stack([jacobian[np.ix_(active, free)], state.form.slack[active]])
    system[: n + 1, n + 1 :], system[n + 1 :, : n + 1] = -a.T, a
    gradient = np.concatenate([np.zeros(n), [1.0]]) - a.T @ found.weights[active]
    step = np.linalg.lstsq(system, -np.concatenate([gradient, c[active]]), rcond=1e-12)[0][:n]
    if not np.isfinite(step).all() or np.abs(step).max() > 0.05:
        return None
    fractions = state.fractions.copy()
    fractions[free] = np.clip(fractions[free] + step, 0.0, 1.0)
    return fractions
