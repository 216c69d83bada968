"""The next design near a solution: sequential quadratic programming with the exact Hessian of the Lagrangian.

SLSQP learns curvature from the steps it makes; in a narrow curved valley (a straightness of 0.05 mm on links of 50 mm)
it needs hundreds.  Here the curvature comes from differences of exact gradients, so a few steps do.
"""

from __future__ import annotations

import numpy as np

from sweep.families.base import Array
from sweep.optimise.certificate import ACTIVE, Multipliers, multipliers
from sweep.optimise.model import FEASIBLE, Model, State
from sweep.optimise.points import Index
from sweep.optimise.rows import Form

CORRECTIONS = 8  # of a step along curved limits, each two or three milliseconds
LOST = 1.0  # scaled violation that no correction mends, above all of links that do not reach: the step must be shorter
DIFFERENCE = 1e-5  # of the scaled variables; gradients are good to 1e-12, so the Hessian is to 1e-5
FLAT = 1e-6  # smallest curvature of the quadratic model: the objective is about 1, the variables run from 0 to 1
RANK = 1e-9  # singular values below, relative to the largest, are rounding
BEND = 1e-4  # curvature lent to t and to the violation, which have none; it changes multipliers by 1e-4 of the step


def propose(model: Model, at: State, form: Form, t: float, radius: float, floor: float | None) -> tuple[Array, float]:
    """Minimise the quadratic model of the Lagrangian under linear rows, with a second-order correction.

    Parameters and results are those of :func:`sweep.optimise.slsqp.propose`.
    """
    points = form.points
    jacobian = np.nan_to_num(model.jacobian(at.fractions, form, points))
    rows = form.rows(model.atoms(at.design, form, points), t)
    # Of a design that misses its limits a little, the rows that will hold are not all at their bounds.
    found = multipliers(form, rows, jacobian, at.fractions, max(ACTIVE, 10.0 * min(at.violation, 1e-3)))
    curvature = hessian(model, at, form, found, np.arange(len(at.fractions)))
    curvature = _upward(curvature, _holding(jacobian, form, found))
    full = np.column_stack([jacobian, form.slack])
    low, high = np.maximum(-radius, -at.fractions), np.minimum(radius, 1.0 - at.fractions)
    box = (low, high, -np.inf if floor is None else floor - t)
    step = _quadratic(curvature, full, rows, form, box, model.price)
    best, value = step, np.inf
    for _ in range(CORRECTIONS):
        there = np.clip(at.fractions + step[:-1], 0.0, 1.0)
        _, atoms = model.moved(there, form, points)
        true = form.rows(atoms, t + step[-1])
        missed = float(np.maximum(np.where(form.equal, np.abs(true), -true), 0.0).max(initial=0.0))
        merit = step[-1] + model.price * missed
        if not merit < value:
            break
        best, value = step, merit
        if missed <= FEASIBLE or missed > LOST:
            break
        # The rows bend away from their tangents: aim beside by what was missed.
        step = _quadratic(curvature, full, true - full @ step, form, box, model.price)
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


def _holding(jacobian: Array, form: Form, found: Multipliers) -> Array:
    """Give gradients whose null space are the steps that keep the active set.

    Such a step changes no active limit and no bound, and it changes all active rows of the objective alike.
    """
    active = found.weights != 0.0
    slack, weights = form.slack[active], found.weights[active]
    sinking = weights * slack @ jacobian[active] / max(float(weights @ slack), 1e-300)
    rows = jacobian[active] - slack[:, None] * sinking
    return np.concatenate([rows, np.eye(jacobian.shape[1])[found.at_bound]])


def _upward(curvature: Array, held: Array) -> Array:
    """The curvature with negative parts made positive, along the rows that hold (their null space) and across apart.

    Along them the curvature decides how far to go; across, the rows do.  Turned positive in one go, the strong
    curvature across would stiffen a flat valley, and every step along it would be a hundred times too short.
    """
    _, sizes, axes = np.linalg.svd(held)
    rank = int((sizes > RANK * sizes.max(initial=1e-300)).sum())
    out = np.zeros_like(curvature)
    for part in (axes[:rank], axes[rank:]):
        if len(part):
            values, turned = np.linalg.eigh(part @ curvature @ part.T)
            own = part.T @ turned
            out += (own * np.maximum(np.abs(values), FLAT)) @ own.T
    return out


def _quadratic(
    curvature: Array, full: Array, rows: Array, form: Form, box: tuple[Array, Array, float], price: float
) -> Array:
    """Step (d, t) that makes t + d'Hd/2 + price v small; every limit's linear row may be missed by v.

    A least-distance problem, solved by non-negative least squares (Lawson and Hanson 1974, chapter 23): in the axes of
    the curvature, which is positive, the objective is the distance from a point.
    """
    from scipy.optimize import nnls

    n = len(curvature)
    values, axes = np.linalg.eigh(curvature)
    stiffness = np.concatenate([np.maximum(values, 0.5 * FLAT), [BEND, BEND]])
    back = np.zeros((n + 2, n + 2))
    back[:n, :n], back[n, n], back[n + 1, n + 1] = axes, 1.0, 1.0
    back /= np.sqrt(stiffness)
    centre = back.T @ np.concatenate([np.zeros(n), [1.0, price]])
    gives = np.array([label.side != "objective" for label in form.labels], dtype=np.float64)
    linear = np.column_stack([full, gives])
    twice = np.column_stack([-full, gives])[form.equal]
    low, high, floor = box
    unit = np.eye(n + 2)
    sides = np.concatenate([linear, twice, unit[:n], -unit[:n], unit[n:]])
    bounds = np.concatenate([rows, -rows[form.equal], -low, high, [-floor, 0.0]])
    known = np.isfinite(bounds)
    original, bounds = sides[known], bounds[known]
    sides = original @ back
    # sides @ (y - centre) + bounds >= 0, |y| smallest
    size = np.linalg.norm(sides, axis=1)
    size[size == 0.0] = 1.0
    sides, needs = sides / size[:, None], (sides @ centre - bounds) / size
    target = np.zeros(n + 3)
    target[-1] = 1.0
    matrix = np.concatenate([sides.T, needs[None, :]])
    held = nnls(matrix, target)[0]
    left = matrix @ held - target
    if not abs(left[-1]) > 1e-300:
        return np.zeros(n + 1)
    step = back @ (-left[:-1] / left[-1] - centre)
    # A straightness of 0.01 mm on links of 100 mm has slopes of 1e4: the rows that hold must hold to the last digit.
    original, offsets = original[held > 0.0], bounds[held > 0.0]
    for _ in range(2):
        step -= np.linalg.lstsq(original, original @ step + offsets, rcond=1e-13)[0]
    return np.asarray(step[: n + 1], np.float64)


def repair(model: Model, state: State) -> State:
    """Bring a nearly feasible design within its limits by small steps that mend violated rows and keep close ones."""
    for _ in range(5):
        if state.feasible or not state.violation < 1e-2:
            break
        c = state.form.rows(state.atoms, state.objective)
        limits = np.array([label.side != "objective" for label in state.form.labels], dtype=np.bool_)
        close = limits & ((c <= ACTIVE) | state.form.equal)
        wanted = np.where(state.form.equal, -c, np.maximum(-c, 0.0))[close]
        jacobian = np.nan_to_num(model.jacobian(state.fractions, state.form, state.form.points))[close]
        step = np.linalg.lstsq(jacobian, wanted, rcond=1e-12)[0]
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
