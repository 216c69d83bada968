"""Step near a solution: sequential quadratic programming with the exact Hessian of the Lagrangian.

Quasi-Newton curvature converges slowly: in a narrow curved valley (a straightness of 0.05 mm on links of 50 mm) it
takes hundreds of steps.  Here the curvature comes from differences of exact gradients, so a few steps suffice.
"""

from __future__ import annotations

import numpy as np

from sweep.families.base import Array
from sweep.numerics.records import Indices
from sweep.optimise.local.kkt import ACTIVE, EDGE, Multipliers, multipliers
from sweep.optimise.local.least_squares import LEAST_CURVATURE, least_squares, quadratic_step, row_and_null_space
from sweep.optimise.local.model import FEASIBLE, Model, State
from sweep.optimise.problem.rows import Form

CORRECTIONS = 8  # second-order corrections of a step along curved limits, each two or three milliseconds
HALVINGS, ARMIJO = 4, 0.1  # halvings of a step, and the share of the promised gain that it must reach
HOPELESS = 1.0  # scaled violation beyond any correction, as of links that do not reach: the step must be shorter
DIFFERENCE = 1e-5  # step of the scaled variables; gradients are accurate to 1e-12, so the Hessian is to 1e-5
CENTRAL = 1e-6  # step of central differences
GROWTH_ALLOWED = 1e-5  # growth of the merit that is allowed between polishing steps
RANK = 1e-9  # relative singular value of active rows below which they are dependent


def propose(model: Model, base: State, form: Form, t: float, radius: float, floor: float | None) -> tuple[Array, float]:
    """Minimise the quadratic model of the Lagrangian under linear constraints, with a second-order correction.

    Parameters and results are those of :func:`sweep.optimise.local.slsqp.propose`.
    """
    points = form.points
    jacobian = np.nan_to_num(model.jacobian(base.fractions, form, points))
    rows = form.rows(model.atoms(base.design, form, points), t)
    # If a design violates its limits a little, the rows that will be active are not all at their bounds.
    duals = multipliers(form, rows, jacobian, base.fractions, max(ACTIVE, 10.0 * min(base.violation, 1e-3)))
    curvature = hessian(model, base, form, duals, np.arange(len(base.fractions)))
    curvature = _convexified(curvature, _active_gradients(jacobian, form, duals))
    slopes = np.column_stack([jacobian, form.slack])
    best, value, reach = np.zeros(len(base.fractions) + 1), np.inf, radius
    current_merit = model.price * _violation(form, rows)
    for _ in range(HALVINGS):
        box = (np.maximum(-reach, -base.fractions), np.minimum(reach, 1.0 - base.fractions))
        step, merit, promised = _corrected(model, base, form, t, (curvature, slopes, rows), (*box, floor))
        if merit < value:
            best, value = step, merit
        if merit <= current_merit - ARMIJO * promised:
            break
        # The limits curve more than the corrections can follow: shorten the step, keep the Hessian.
        reach = 0.5 * min(reach, float(np.abs(step[:-1]).max()))
    return np.clip(base.fractions + best[:-1], 0.0, 1.0), t + float(best[-1])


def _corrected(
    model: Model, base: State, form: Form, t: float, parts: tuple[Array, Array, Array],
    bounds: tuple[Array, Array, float | None],
) -> tuple[Array, float, float]:  # fmt: skip
    """Return the step corrected towards the curved rows, the merit it reaches, and the promised gain."""
    curvature, slopes, rows = parts
    low, high, floor = bounds
    box = (low, high, -np.inf if floor is None else floor - t)
    step, _ = quadratic_step(curvature, slopes, rows, form, box, model.price)
    promised = model.price * (_violation(form, rows) - _violation(form, rows + slopes @ step)) - float(step[-1])
    best, value = step, np.inf
    for _ in range(CORRECTIONS):
        trial = np.clip(base.fractions + step[:-1], 0.0, 1.0)
        _, atoms = model.tracked(trial, form, form.points)
        actual = form.rows(atoms, t + step[-1])
        violation = _violation(form, actual)
        merit = float(step[-1]) + model.price * violation
        if not merit < value:
            break
        best, value = step, merit
        if violation <= FEASIBLE or violation > HOPELESS:
            break
        # The rows are curved: shift their linear targets by the step's residual (second-order correction).
        step, _ = quadratic_step(curvature, slopes, actual - slopes @ step, form, box, model.price)
    return best, value, promised


def _violation(form: Form, rows: Array) -> float:
    return float(np.maximum(np.where(form.equal, np.abs(rows), -rows), 0.0).max(initial=0.0))


def hessian(
    model: Model, base: State, form: Form, duals: Multipliers, free: Indices, both_sides: bool = False
) -> Array:
    """Return the second derivatives of the Lagrangian by the free variables, from differences of exact gradients.

    With ``both_sides`` they are accurate to 1e-8 instead of 1e-5, for twice as many evaluations: the curvature along a
    valley may be 1e-9 of that across it.
    """

    def gradient(j: int, step: float) -> Array:
        moved = base.fractions.copy()
        moved[j] += step
        model.count_evaluation()
        points = model.curves.follow(model.design(moved), form.points)
        return np.asarray((duals.weights @ np.nan_to_num(model.jacobian(moved, form, points)))[free])

    if both_sides:
        matrix = np.array([(gradient(j, CENTRAL) - gradient(j, -CENTRAL)) / (-2.0 * CENTRAL) for j in free])
    else:
        reference = (duals.weights @ np.nan_to_num(model.jacobian(base.fractions, form, form.points)))[free]
        steps = [DIFFERENCE if base.fractions[j] <= 0.5 else -DIFFERENCE for j in free]
        matrix = np.array([(gradient(j, step) - reference) / -step for j, step in zip(free, steps, strict=True)])
    return np.asarray(0.5 * (matrix + matrix.T), np.float64)


def _active_gradients(jacobian: Array, form: Form, duals: Multipliers) -> Array:
    """Return gradients (rows) whose null space contains the steps that keep the active set.

    Such a step changes no active limit and no bound, and it changes all active rows of the objective equally.
    """
    active = duals.weights != 0.0
    slack, weights = form.slack[active], duals.weights[active]
    common = (weights * slack) @ jacobian[active] / max(float((weights * slack).sum()), 1e-300)
    rows = jacobian[active] - slack[:, None] * common
    return np.concatenate([rows, np.eye(jacobian.shape[1])[duals.at_bound]])


def _convexified(curvature: Array, active: Array) -> Array:
    """Return the Hessian with its negative eigenvalues made positive.

    The null space of the active rows and its complement are treated separately.  In the null space the curvature
    determines the length of a step, in the complement the rows do.  Treated together, the strong curvature of the
    complement would stiffen a flat valley, and every step along it would be a hundred times too short.
    """
    out = np.zeros_like(curvature)
    for basis in row_and_null_space(active, RANK):
        if len(basis):
            eigenvalues, vectors = np.linalg.eigh(basis @ curvature @ basis.T)
            directions = basis.T @ vectors
            out += (directions * np.maximum(np.abs(eigenvalues), LEAST_CURVATURE)) @ directions.T
    return out


def repair(model: Model, state: State) -> State:
    """Move a nearly feasible design within its limits by small steps that correct violated rows and keep close ones."""
    for _ in range(5):
        if state.feasible or not state.violation < 1e-2:
            break
        rows = state.form.rows(state.atoms, state.objective)
        limits = np.array([label.side != "objective" for label in state.form.labels], dtype=np.bool_)
        active = limits & ((rows <= ACTIVE) | state.form.equal)
        correction = np.where(state.form.equal, -rows, np.maximum(-rows, 0.0))[active]
        jacobian = np.nan_to_num(model.jacobian(state.fractions, state.form, state.form.points))[active]
        # A variable that leaves its bound slightly would lose its multiplier: variables at bounds move only if
        # necessary.
        inside = (state.fractions > EDGE) & (state.fractions < 1.0 - EDGE)
        new = state
        for free in (inside, np.ones_like(inside)):
            step = np.where(free, least_squares(jacobian * free, correction, 1e-12), 0.0)
            new = model.state(np.clip(state.fractions + step, 0.0, 1.0))
            if new.violation < state.violation:
                break
        if not new.violation < state.violation:
            break
        state = new
    return state


def polish(model: Model, state: State) -> State:
    """Take Newton steps on the optimality conditions of the active rows, as long as they reduce the residual."""
    residual, first, size = model.certificate(state).residual, state, max(1.0, abs(state.objective))
    best = state
    for _ in range(6):
        if not residual > 1e-12 and state.feasible:
            break
        fractions = _kkt_step(model, state)
        if fractions is None:
            break
        new = model.state(fractions)
        # A step misses a curved limit by the square of its length; the next step corrects that.
        if not new.merit(model.price) <= first.merit(model.price) + GROWTH_ALLOWED * size:
            break
        new_residual = model.certificate(new).residual
        if new_residual > 0.5 * residual and new.violation >= 0.5 * state.violation:
            break
        state, residual = new, new_residual
        if new.merit(model.price) <= first.merit(model.price) + 1e-9 * size:
            best = new
    return best


def _kkt_step(model: Model, state: State) -> Array | None:
    jacobian = model.jacobian(state.fractions, state.form, state.form.points)
    rows = state.form.rows(state.atoms, state.objective)
    duals = multipliers(state.form, rows, jacobian, state.fractions)
    free, active = np.flatnonzero(~duals.at_bound), np.flatnonzero(duals.weights != 0.0)
    if not len(free) or not len(active):
        return None
    n = len(free)
    system = np.zeros((n + 1 + len(active), n + 1 + len(active)))
    system[:n, :n] = hessian(model, state, state.form, duals, free, both_sides=True)
    active_jacobian = np.column_stack([jacobian[np.ix_(active, free)], state.form.slack[active]])
    system[: n + 1, n + 1 :], system[n + 1 :, : n + 1] = -active_jacobian.T, active_jacobian
    gradient = np.concatenate([np.zeros(n), [1.0]]) - active_jacobian.T @ duals.weights[active]
    step = least_squares(system, -np.concatenate([gradient, rows[active]]), 1e-12)[:n]
    if not np.isfinite(step).all() or np.abs(step).max() > 0.05:
        return None
    fractions = state.fractions.copy()
    fractions[free] = np.clip(fractions[free] + step, 0.0, 1.0)
    return fractions
