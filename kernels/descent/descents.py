"""Descents by sequential quadratic programs at fixed poses; the linear unknowns are solved again after every step."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels.descent.motion import Index, Motion, gradients, moving, no_motion, nothing_moved
from kernels.descent.program import Program, begin, box, learn, no_program, prepare, solve, units
from kernels.descent.room import rooms
from kernels.descent.rows import UNKNOWNS, Task, columns_of, slopes_of, values_of, worth_of
from kernels.descent.unknowns import solved, unknowns_of
from kernels.jit import folded, inline, kernel, part
from kernels.types import Array

LOCKED = 1e6  # above the merit of any design that turns
RADIUS, LARGEST, LEAST = 0.1, 0.3, 1e-6  # half widths of the box: at the start, at most, and where a descent is at rest
SPENT = 1e-6  # promised gain, as a share of the objective, at which a descent has come to rest
RENEWED = 1e-5  # gain since the last rest, as a share of the objective, above which a descent is started again
CORRECTIONS = 3  # second-order ones of a step: without them a valley of 0.015 mm is crossed in steps of 1e-3
TRUSTED, GOOD = 0.1, 0.6  # share of the promised gain below which the box shrinks, and above which it grows
WORTH, BOX, RESTED, LOOKS = 0, 1, 2, 3  # elements of ``state``


class Design(NamedTuple):
    """Design at a place: its columns, motion, linear unknowns, room and rows."""

    place: Array
    row: Array
    at: Motion
    x: Array
    room: Array
    values: Array


@part
def _no_design(task: Task) -> Design:
    m = len(task.cos)
    return Design(
        np.empty(len(task.columns)), np.empty(task.bases.shape[1]), no_motion(m), np.ones(UNKNOWNS), np.zeros(m + 1),
        np.empty(len(task.kinds)),
    )  # fmt: skip


@part
def _copy(x: Any, out: Any) -> None:
    for k in range(len(x)):
        out[k] = x[k]


@part
def _with_room(task: Task, kind: int, d: Design, moved: Array) -> None:
    if len(task.sigma):
        rooms(task, kind, d.place, d.x, d.room, moved)


@folded
def _begun(task: Task, kind: int, d: Design) -> float:
    """Find the linear unknowns of a design at its place; return its merit, infinite where it does not turn."""
    none = np.empty((0, len(d.room)))
    columns_of(task, kind, d.place, d.row)
    if not moving(d.row, task.cos, task.sin, d.at) > 0.0:
        return math.inf
    for p in range(len(d.room)):
        d.room[p] = 0.0
    if not unknowns_of(task, d.row, d.at, d.room, d.x):
        return math.inf
    if len(task.sigma):
        _with_room(task, kind, d, none)
        if not unknowns_of(task, d.row, d.at, d.room, d.x):
            return math.inf
        _with_room(task, kind, d, none)
    values_of(task, d.row, d.at, d.x, d.room, d.values)
    return _known(worth_of(task, d.values))


@inline
def _known(worth: float) -> float:
    return worth if worth == worth else math.inf


@kernel
def begun(task: Task, kinds: Index, places: Array, x: Array, worth: Array) -> None:
    """Compute the best linear unknowns (k, 5) at places (k, n), and merits (k,), infinite where nothing turns."""
    d = _no_design(task)
    for i in range(len(places)):
        _copy(places[i], d.place)
        worth[i] = _begun(task, kinds[i], d)
        _copy(d.x, x[i])


@part
def _look(task: Task, kind: int, d: Design, slopes: Array) -> bool:
    """Compute the rows and gradients of a design; return whether the gradients are finite."""
    n, m = len(task.columns), len(task.cos)
    by, moved = nothing_moved(n, m), np.zeros((n + UNKNOWNS, m + 1))
    gradients(d.row, d.at, task.columns, task.cos, task.sin, by)
    _with_room(task, kind, d, moved)
    slopes_of(task, d.row, d.at, by, d.x, d.room, moved, d.values, slopes)
    for k in range(len(slopes)):
        for j in range(slopes.shape[1]):
            if not math.isfinite(slopes[k, j]):
                return False
    return True


@folded
def _try(task: Task, kind: int, d: Design, step: Array, out: Design, spare: Design) -> float:
    """Evaluate a step with its own linear unknowns and with the best ones there; keep the better; return its merit."""
    n, none = len(d.place), np.empty((0, len(d.room)))
    for k in range(n):
        out.place[k] = min(max(d.place[k] + step[k], 0.0), 1.0)
    for k in range(UNKNOWNS):
        out.x[k] = d.x[k] + step[n + k]
    columns_of(task, kind, out.place, out.row)
    if not moving(out.row, task.cos, task.sin, out.at) > 0.0:
        return math.inf
    _with_room(task, kind, out, none)
    values_of(task, out.row, out.at, out.x, out.room, out.values)
    own = _known(worth_of(task, out.values))
    _copy(out.place, spare.place)
    solved(task, out.row, out.at, out.x, out.room, spare.x)
    _with_room(task, kind, spare, none)
    values_of(task, out.row, out.at, spare.x, spare.room, spare.values)
    other = _known(worth_of(task, spare.values))
    if other <= own:
        _copy(spare.x, out.x)
        _copy(spare.room, out.room)
        _copy(spare.values, out.values)
    return float(min(own, other))


@part
def _copied(d: Design, out: Design) -> None:
    """Copy a design, row by row: assignments to slices take ten times as long to compile."""
    _copy(d.place, out.place)
    _copy(d.row, out.row)
    _copy(d.x, out.x)
    _copy(d.room, out.room)
    _copy(d.values, out.values)
    for k in range(len(d.at.driver)):
        _copy(d.at.driver[k], out.at.driver[k])
    for k in range(len(d.at.driven)):
        _copy(d.at.driven[k], out.at.driven[k])
    for k in range(len(d.at.pin)):
        _copy(d.at.pin[k], out.at.pin[k])
    for k in range(len(d.at.b)):
        _copy(d.at.b[k], out.at.b[k])
        _copy(d.at.w[k], out.at.w[k])


@part
def _lagrangian(slopes: Array, weights: Array, sign: float, out: Array) -> None:
    """Add the gradients of the active rows, weighted by their multipliers, times ``sign``."""
    for j in range(len(weights)):
        if weights[j] != 0.0:
            for k in range(len(out)):
                out[k] += sign * weights[j] * slopes[k, j]


@inline
def _largest(values: Array, count: int) -> float:
    """Magnitude of the objective, from its ``count`` rows."""
    t = -math.inf
    for j in range(count):
        t = max(t, -values[j])
    return t


@folded
def _tried(
    task: Task, kind: int, here: Design, worth: float, slopes: Array, q: Program, weights: Array, best: Design
) -> tuple[float, float]:
    """Solve for a step, correct it while rows are curved, keep the best design; return merit and promised gain."""
    n, r = len(q.size), len(weights)
    there, spare, step, ignored = _no_design(task), _no_design(task), np.empty(n), np.empty(r)
    t = _largest(here.values, 2 * len(task.cos))
    _copy(here.values, q.right)
    promised = solve(task, t, worth, q, step, weights)
    found = math.inf
    for correction in range(CORRECTIONS + 1):
        value = _try(task, kind, here, step, there, spare)
        if correction > 0 and not value < found:
            break
        found = value
        if not found < LOCKED:
            break
        _copied(there, best)
        if not worth - found < GOOD * promised or correction == CORRECTIONS:
            break
        _copy(there.values, q.right)
        for k in range(n):
            move = there.place[k] - here.place[k] if k < len(here.place) else there.x[k - n] - here.x[k - n]
            for j in range(r):
                q.right[j] -= move * slopes[k, j]
        solve(task, t, worth, q, step, ignored)
    return found, promised


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
    curvature : (n + 5, n + 5), in and out; see :func:`begin`
    steps : largest number of steps
    """
    here, best, q = _no_design(task), _no_design(task), no_program(task)
    n = len(q.size)
    slopes, weights, change = np.empty((n, len(here.values))), np.empty(len(here.values)), np.empty(n)
    before = np.empty(n)
    _copy(place, here.place)
    _copy(x, here.x)
    columns_of(task, kind, here.place, here.row)
    new = True
    for step in range(steps):
        if not state[BOX] > LEAST:
            break
        if step == 0:
            moving(here.row, task.cos, task.sin, here.at)
            state[LOOKS] += 1.0
            if not _look(task, kind, here, slopes):
                state[BOX] = 0.0
                break
        if new:
            units(here.x, q.size)
            prepare(task, slopes, curvature, q)
        box(here.place, _largest(here.values, 2 * len(task.cos)), task.unit, state[BOX], q)
        found, promised = _tried(task, kind, here, state[WORTH], slopes, q, weights, best)
        gain, length = state[WORTH] - found, 0.0
        for k in range(n - UNKNOWNS):
            length = max(length, abs(best.place[k] - here.place[k]))
        new = gain > 0.0
        if new:
            for k in range(n):
                change[k] = 0.0
                before[k] = here.place[k] if k < n - UNKNOWNS else here.x[k - n]
            _lagrangian(slopes, weights, 1.0, change)
            _copied(best, here)
            state[WORTH] = found
            state[LOOKS] += 1.0
            if not _look(task, kind, here, slopes):
                state[BOX] = 0.0
                break
            _lagrangian(slopes, weights, -1.0, change)
            for k in range(n):
                at = here.place[k] if k < n - UNKNOWNS else here.x[k - n]
                before[k] = (at - before[k]) / q.size[k]
                change[k] *= q.size[k]
            learn(curvature, before, change)
        if gain < TRUSTED * promised:
            state[BOX] = 0.5 * (state[BOX] if gain > 0.0 else min(state[BOX], length))
        elif gain > GOOD * promised:
            state[BOX] = min(2.0 * state[BOX], LARGEST)
        if promised <= SPENT * abs(state[WORTH]):
            state[BOX] = 0.0
        if state[BOX] <= LEAST and state[RESTED] - state[WORTH] > RENEWED * abs(state[WORTH]):
            # The learnt curvature may promise less gain than there is.
            state[RESTED], state[BOX], new = state[WORTH], RADIUS, True
            begin(curvature)
    _copy(here.place, place)
    _copy(here.x, x)


@kernel
def rows_at(task: Task, kind: int, place: Array, x: Array, values: Array, slopes: Array) -> None:
    """Compute the rows (r,) of one design that turns, and their gradients (n + 5, r) by places and unknowns."""
    d = _no_design(task)
    _copy(place, d.place)
    _copy(x, d.x)
    columns_of(task, kind, d.place, d.row)
    moving(d.row, task.cos, task.sin, d.at)
    _look(task, kind, d, slopes)
    _copy(d.values, values)
