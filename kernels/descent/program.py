"""Quadratic program of one step of a descent: the learnt curvature, the box, the solution."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels.descent.motion import Index
from kernels.descent.rows import UNKNOWNS, Task
from kernels.jit import kernel, part
from kernels.linear.nearest_of_many import CurveRows, Nearest, nearest_of_many
from kernels.types import Array

TOLERANCE = 1e-11  # distance by which the point nearest to the centre may violate a row
NEAR = 0.15  # rows further from their bound join the quadratic program only where its step would violate them
MAX_ROUNDS, VIOLATED = 6, 1e-6  # most rounds in which rows join, and the largest violation that is none
PLACE_CURVATURE, UNKNOWN_CURVATURE = 1.0, 1e-2  # initial curvature, of the places and of the linear unknowns
REACH = 10.0  # largest step of the linear unknowns, in units of their size and of the radius
DAMPING = 0.2  # least curvature along a step, as a share of the estimate before it (Powell 1978)
LEAST_CURVATURE = 1e-6  # smallest curvature: the objective is about 1, the places run from 0 to 1
ADDED_CURVATURE = 1e-4  # curvature added in t and in the violation, which have none


class Program(NamedTuple):
    """Quadratic program in the step, in t and in the violation; ``active`` are the active rows, for the next program.

    ``rows`` (n, r) are the gradients of its rows.  ``transform`` leads to the step from coordinates in which the
    objective is the distance from ``centre``.  ``size`` are the units of the step.
    """

    rows: Array
    transform: Array
    centre: Array
    low: Array
    high: Array
    size: Array
    rhs: Array
    predicted: Array
    active: Index


@part
def no_program(task: Task) -> Program:
    """Allocate a program."""
    n, r = len(task.columns) + UNKNOWNS + 2, len(task.kinds)
    return Program(
        np.empty((n, r)), np.zeros((n, n)), np.empty(n), np.empty(n), np.empty(n - 2), np.empty(n - 2), np.empty(r),
        np.empty(r), np.zeros(n + 1, np.int64),
    )  # fmt: skip


@part
def units(x: Array, size: Array) -> None:
    """Write the units of a step: 1 for the places, the magnitudes of the linear unknowns for these, which come last."""
    n = len(size) - UNKNOWNS
    for k in range(n):
        size[k] = 1.0
    size[n] = size[n + 1] = max(abs(x[0]), abs(x[1]))
    size[n + 2] = size[n + 3] = max(abs(x[2]), abs(x[3]))
    size[n + 4] = max(abs(x[4]), 1.0)


@part
def prepare(task: Task, slopes: Array, curvature: Array, q: Program) -> None:
    """Write the part of a program that depends on the present design and curvature, but not on the box."""
    n, objective = len(q.size), 2 * len(task.cos)
    for k in range(n):
        for j in range(slopes.shape[1]):
            q.rows[k, j] = slopes[k, j] * q.size[k] / (task.unit if j < objective else 1.0)
    for j in range(slopes.shape[1]):
        q.rows[n, j], q.rows[n + 1, j] = (1.0, 0.0) if j < objective else (0.0, 1.0)
    # G = L L', and the objective is the distance in y = L' step: back is the inverse of L'.
    lower = np.zeros((n, n))
    for k in range(n):
        for i in range(k, n):
            value = curvature[i, k]
            for j in range(k):
                value -= lower[i, j] * lower[k, j]
            lower[i, k] = math.sqrt(max(value, LEAST_CURVATURE)) if i == k else value / lower[k, k]
    for k in range(n):
        for i in range(k, -1, -1):
            value = 1.0 if i == k else 0.0
            for j in range(i + 1, k + 1):
                value -= lower[j, i] * q.transform[j, k]
            q.transform[i, k] = value / lower[i, i]
    q.transform[n, n] = q.transform[n + 1, n + 1] = 1.0 / math.sqrt(ADDED_CURVATURE)
    for k in range(n):
        q.centre[k] = 0.0
    q.centre[n], q.centre[n + 1] = -q.transform[n, n], -q.transform[n, n] * task.price / task.unit


@part
def solve(task: Task, t: float, merit: float, q: Program, step: Array, weights: Array) -> float:
    """Compute step (n + 5,) and multipliers (r,) for the rows ``q.right`` at t = 0; return the promised gain."""
    n, objective = len(q.size), 2 * len(task.cos)
    for j in range(objective):
        q.rhs[j] = (q.rhs[j] + t) / task.unit
    solution = np.empty(n + 2)
    nearest = Nearest(solution, q.predicted, weights, q.active)
    rows = CurveRows(q.rhs, q.rows, task.turn_rows)
    nearest_of_many(rows, q.transform, q.centre, q.low, q.high, (NEAR, VIOLATED), MAX_ROUNDS, TOLERANCE, nearest)
    violation = 0.0
    for j in range(objective, len(weights)):
        violation = max(violation, solution[n + 1] - q.predicted[j])
    for j in range(objective):
        weights[j] /= task.unit
    for k in range(n):
        step[k] = solution[k] * q.size[k]
    promised: float = merit - (t + task.unit * solution[n] + task.price * violation)
    return promised


@part
def set_box(place: Array, t: float, unit: float, radius: float, q: Program) -> None:
    """Write the bounds of a step: the box around a design, and the range of the places."""
    n = len(place)
    for k in range(len(q.size)):
        reach = radius if k < n else REACH * radius
        q.low[k] = max(-reach, -place[k]) if k < n else -reach
        q.high[k] = min(reach, 1.0 - place[k]) if k < n else reach
    q.low[len(q.size)], q.low[len(q.size) + 1] = -t / unit, 0.0


@part
def bfgs(curvature: Array, s: Array, y: Array) -> None:
    """Update the curvature by BFGS, damped so that it stays positive definite."""
    bs = np.zeros(len(s))
    for i in range(len(s)):
        for j in range(len(s)):
            bs[i] += curvature[i, j] * s[j]
    s_bs, s_y = 0.0, 0.0
    for i in range(len(s)):
        s_bs += s[i] * bs[i]
        s_y += s[i] * y[i]
    if not s_bs > 1e-300:
        return
    theta = (1.0 - DAMPING) * s_bs / (s_bs - s_y) if s_y < DAMPING * s_bs else 1.0
    s_y = max(s_y, DAMPING * s_bs)
    for i in range(len(s)):
        y[i] = theta * y[i] + (1.0 - theta) * bs[i]
    for i in range(len(s)):
        for j in range(len(s)):
            curvature[i, j] += y[i] * y[j] / s_y - bs[i] * bs[j] / s_bs


@kernel
def reset_curvature(curvature: Array) -> None:
    """Write the initial curvature."""
    for k in range(len(curvature)):
        for i in range(len(curvature)):
            curvature[k, i] = 0.0
        curvature[k, k] = PLACE_CURVATURE if k < len(curvature) - UNKNOWNS else UNKNOWN_CURVATURE
