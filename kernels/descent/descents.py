"""Descents by sequential quadratic programs at fixed poses; the linear unknowns are solved again after every step."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels.descent.motion import Index, Motion, empty_motion, gradients, motion_of, zero_slopes
from kernels.descent.program import Program, bfgs, no_program, prepare, reset_curvature, set_box, solve, units
from kernels.descent.room import margins_and_slopes
from kernels.descent.rows import UNKNOWNS, Task, columns_of, merit_of, rows_and_slopes, rows_of
from kernels.descent.unknowns import improved_unknowns, unknowns_of
from kernels.jit import folded, inline, kernel, part
from kernels.types import Array

LOCKED = 1e6  # above the merit of any design that turns
RADIUS, LARGEST, LEAST = 0.1, 0.3, 1e-6  # half widths of the box: at the start, at most, and where a descent is at rest
REST_GAIN = 1e-6  # promised gain, as a share of the objective, at which a descent has come to rest
RESTART_GAIN = 1e-5  # gain since the last rest, as a share of the objective, above which a descent is started again
CORRECTIONS = 3  # second-order ones of a step: without them a valley of 0.015 mm is crossed in steps of 1e-3
SHRINK_BELOW, GROW_ABOVE = 0.1, 0.6  # share of the promised gain below which the box shrinks, and above which it grows
MERIT, BOX, REST_MERIT, EVALUATIONS = 0, 1, 2, 3  # elements of ``state``


class Design(NamedTuple):
    """Design at a place: its columns, motion, linear unknowns, tolerance margins and rows."""

    place: Array
    row: Array
    motion: Motion
    x: Array
    margin: Array
    values: Array


@part
def _empty_design(task: Task) -> Design:
    m = len(task.cos)
    return Design(
        np.empty(len(task.columns)), np.empty(task.bases.shape[1]), empty_motion(m), np.ones(UNKNOWNS), np.zeros(m + 1),
        np.empty(len(task.kinds)),
    )  # fmt: skip


@part
def _copy(x: Any, out: Any) -> None:
    for k in range(len(x)):
        out[k] = x[k]


@part
def _update_margin(task: Task, kind: int, d: Design, dmargin: Array) -> None:
    if len(task.sigma):
        margins_and_slopes(task, kind, d.place, d.x, d.margin, dmargin)


@folded
def _initial_merit(task: Task, kind: int, d: Design) -> float:
    """Find the linear unknowns of a design at its place; return its merit, infinite where it does not turn."""
    no_slopes = np.empty((0, len(d.margin)))
    columns_of(task, kind, d.place, d.row)
    if not motion_of(d.row, task.cos, task.sin, d.motion) > 0.0:
        return math.inf
    for p in range(len(d.margin)):
        d.margin[p] = 0.0
    if not unknowns_of(task, d.row, d.motion, d.margin, d.x):
        return math.inf
    if len(task.sigma):
        _update_margin(task, kind, d, no_slopes)
        if not unknowns_of(task, d.row, d.motion, d.margin, d.x):
            return math.inf
        _update_margin(task, kind, d, no_slopes)
    rows_of(task, d.row, d.motion, d.x, d.margin, d.values)
    return _finite_merit(merit_of(task, d.values))


@inline
def _finite_merit(merit: float) -> float:
    return merit if merit == merit else math.inf


@kernel
def initial_merits(task: Task, kinds: Index, places: Array, x: Array, merit: Array) -> None:
    """Compute the best linear unknowns (k, 5) at places (k, n), and merits (k,), infinite where nothing turns."""
    d = _empty_design(task)
    for i in range(len(places)):
        _copy(places[i], d.place)
        merit[i] = _initial_merit(task, kinds[i], d)
        _copy(d.x, x[i])


@part
def _evaluate(task: Task, kind: int, d: Design, slopes: Array) -> bool:
    """Compute the rows and gradients of a design; return whether the gradients are finite."""
    n, m = len(task.columns), len(task.cos)
    dmotion, dmargin = zero_slopes(n, m), np.zeros((n + UNKNOWNS, m + 1))
    gradients(d.row, d.motion, task.columns, task.cos, task.sin, dmotion)
    _update_margin(task, kind, d, dmargin)
    rows_and_slopes(task, d.row, d.motion, dmotion, d.x, d.margin, dmargin, d.values, slopes)
    for k in range(len(slopes)):
        for j in range(slopes.shape[1]):
            if not math.isfinite(slopes[k, j]):
                return False
    return True


@folded
def _evaluate_step(task: Task, kind: int, d: Design, step: Array, out: Design, spare: Design) -> float:
    """Evaluate a step with its own linear unknowns and with the best ones there; keep the better; return its merit."""
    n, no_slopes = len(d.place), np.empty((0, len(d.margin)))
    for k in range(n):
        out.place[k] = min(max(d.place[k] + step[k], 0.0), 1.0)
    for k in range(UNKNOWNS):
        out.x[k] = d.x[k] + step[n + k]
    columns_of(task, kind, out.place, out.row)
    if not motion_of(out.row, task.cos, task.sin, out.motion) > 0.0:
        return math.inf
    _update_margin(task, kind, out, no_slopes)
    rows_of(task, out.row, out.motion, out.x, out.margin, out.values)
    stepped_merit = _finite_merit(merit_of(task, out.values))
    _copy(out.place, spare.place)
    improved_unknowns(task, out.row, out.motion, out.x, out.margin, spare.x)
    _update_margin(task, kind, spare, no_slopes)
    rows_of(task, out.row, out.motion, spare.x, spare.margin, spare.values)
    solved_merit = _finite_merit(merit_of(task, spare.values))
    if solved_merit <= stepped_merit:
        _copy(spare.x, out.x)
        _copy(spare.margin, out.margin)
        _copy(spare.values, out.values)
    return float(min(stepped_merit, solved_merit))


@part
def _copy_design(d: Design, out: Design) -> None:
    """Copy a design, number by number: assignments to slices take ten times as long to compile."""
    _copy(d.place, out.place)
    _copy(d.row, out.row)
    _copy(d.x, out.x)
    _copy(d.margin, out.margin)
    _copy(d.values, out.values)
    _copy(d.motion.driver.ravel(), out.motion.driver.ravel())
    _copy(d.motion.driven.ravel(), out.motion.driven.ravel())
    _copy(d.motion.pin.ravel(), out.motion.pin.ravel())
    _copy(d.motion.b.ravel(), out.motion.b.ravel())
    _copy(d.motion.w.ravel(), out.motion.w.ravel())


@part
def _lagrangian(slopes: Array, weights: Array, sign: float, out: Array) -> None:
    """Add the gradients of the active rows, weighted by their multipliers, times ``sign``."""
    for j in range(len(weights)):
        if weights[j] != 0.0:
            for k in range(len(out)):
                out[k] += sign * weights[j] * slopes[k, j]


@inline
def _objective(values: Array, count: int) -> float:
    """Magnitude of the objective, from its ``count`` rows."""
    t = -math.inf
    for j in range(count):
        t = max(t, -values[j])
    return t


@folded
def _best_step(
    task: Task, kind: int, current: Design, merit: float, slopes: Array, q: Program, weights: Array, best: Design
) -> tuple[float, float]:
    """Solve for a step, correct it while rows are curved, keep the best design; return merit and promised gain."""
    n, r = len(q.size), len(weights)
    trial, spare, step, unused = _empty_design(task), _empty_design(task), np.empty(n), np.empty(r)
    t = _objective(current.values, 2 * len(task.cos))
    _copy(current.values, q.rhs)
    promised = solve(task, t, merit, q, step, weights)
    trial_merit = math.inf
    for correction in range(CORRECTIONS + 1):
        value = _evaluate_step(task, kind, current, step, trial, spare)
        if correction > 0 and not value < trial_merit:
            break
        trial_merit = value
        if not trial_merit < LOCKED:
            break
        _copy_design(trial, best)
        if not merit - trial_merit < GROW_ABOVE * promised or correction == CORRECTIONS:
            break
        _copy(trial.values, q.rhs)
        for k in range(n):
            move = trial.place[k] - current.place[k] if k < len(current.place) else trial.x[k - n] - current.x[k - n]
            for j in range(r):
                q.rhs[j] -= move * slopes[k, j]
        solve(task, t, merit, q, step, unused)
    return trial_merit, promised


@kernel
def descend(task: Task, kind: int, place: Array, x: Array, state: Array, curvature: Array, steps: int) -> None:
    """Take ``steps`` steps of a descent, fewer if it comes to rest.

    Parameters
    ----------
    task : the problem
    kind : number of the combination of signs
    place, x : (n,) and (5,) present place and linear unknowns, in and out
    state : (4,) merit, half width of the box (0 at rest), merit at the last rest, number of gradient evaluations; in
        and out.  A descent begins with (merit, RADIUS, inf, 0), at rest where the merit is LOCKED or more.
    curvature : (n + 5, n + 5), in and out; see :func:`kernels.descent.program.reset_curvature`
    steps : largest number of steps
    """
    current, best, q = _empty_design(task), _empty_design(task), no_program(task)
    n = len(q.size)
    slopes, weights, change = np.empty((n, len(current.values))), np.empty(len(current.values)), np.empty(n)
    step_taken = np.empty(n)
    _copy(place, current.place)
    _copy(x, current.x)
    columns_of(task, kind, current.place, current.row)
    accepted = True
    for step in range(steps):
        if not state[BOX] > LEAST:
            break
        if step == 0:
            motion_of(current.row, task.cos, task.sin, current.motion)
            state[EVALUATIONS] += 1.0
            if not _evaluate(task, kind, current, slopes):
                state[BOX] = 0.0
                break
        if accepted:
            units(current.x, q.size)
            prepare(task, slopes, curvature, q)
        set_box(current.place, _objective(current.values, 2 * len(task.cos)), task.unit, state[BOX], q)
        new_merit, promised = _best_step(task, kind, current, state[MERIT], slopes, q, weights, best)
        gain, length = state[MERIT] - new_merit, 0.0
        for k in range(n - UNKNOWNS):
            length = max(length, abs(best.place[k] - current.place[k]))
        accepted = gain > 0.0
        if accepted:
            for k in range(n):
                change[k] = 0.0
                step_taken[k] = current.place[k] if k < n - UNKNOWNS else current.x[k - n]
            _lagrangian(slopes, weights, 1.0, change)
            _copy_design(best, current)
            state[MERIT] = new_merit
            state[EVALUATIONS] += 1.0
            if not _evaluate(task, kind, current, slopes):
                state[BOX] = 0.0
                break
            _lagrangian(slopes, weights, -1.0, change)
            for k in range(n):
                coordinate = current.place[k] if k < n - UNKNOWNS else current.x[k - n]
                step_taken[k] = (coordinate - step_taken[k]) / q.size[k]
                change[k] *= q.size[k]
            bfgs(curvature, step_taken, change)
        if gain < SHRINK_BELOW * promised:
            state[BOX] = 0.5 * (state[BOX] if gain > 0.0 else min(state[BOX], length))
        elif gain > GROW_ABOVE * promised:
            state[BOX] = min(2.0 * state[BOX], LARGEST)
        if promised <= REST_GAIN * abs(state[MERIT]):
            state[BOX] = 0.0
        if state[BOX] <= LEAST and state[REST_MERIT] - state[MERIT] > RESTART_GAIN * abs(state[MERIT]):
            # The learnt curvature may promise less gain than there is.
            state[REST_MERIT], state[BOX], accepted = state[MERIT], RADIUS, True
            reset_curvature(curvature)
    _copy(current.place, place)
    _copy(current.x, x)
