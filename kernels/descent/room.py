"""Tolerance margins of the deviation and the range of a needle drive, to first order, at fixed poses.

A margin is the scatter by the tolerances: the distance that a design keeps from its limits.
"""

from __future__ import annotations

import math

import numpy as np

from kernels.descent.motion import (
    COSINE,
    CRANK_MARGIN,
    GUIDE,
    OFFSET,
    PIN_MARGIN,
    SENSE,
    SINE,
    STEP,
    Complex,
    Motion,
    P,
    U,
    V,
    empty_motion,
    first_stage,
    motion_of,
)
from kernels.descent.rows import Task, columns_of
from kernels.jit import inline, part
from kernels.types import Array

EVERY_SECOND = 2  # pose is enough: the effect of tolerances changes slowly along the turn
DRIVER_DIMENSIONS = 7  # dimensions of stage 1
CLOSURE_NUMBERS = 6  # of the closure of stage 1 that depend on its dimensions
DIMENSIONS = DRIVER_DIMENSIONS + 9  # and a, b, c, e, xi, eta, lam, h of stage 2 and the angle between both
PLACE_STEP = 1e-6  # step of a place for difference quotients


@inline
def _closure_by_dimensions(row: Array, out: Array) -> None:
    """Compute derivatives (7, 6) of the numbers of the closure of stage 1 by its dimensions."""
    design = row.astype(np.complex128)
    for k in range(DRIVER_DIMENSIONS):
        design[k] += complex(0.0, STEP)
        stage = first_stage(design)
        out[k, 0], out[k, 1], out[k, 2] = stage.e.imag / STEP, stage.y0.imag / STEP, stage.ca.imag / STEP
        out[k, 3], out[k, 4], out[k, 5] = stage.k0.imag / STEP, stage.k1.imag / STEP, stage.k2.imag / STEP
        design[k] = row[k]


@inline
def _pin_by_dimensions(row: Array, motion: Motion, p: int, out: Array) -> None:
    """Compute derivatives of the angle of the second rocker by a, b, c, e."""
    a, b, c, e = row[GUIDE], row[GUIDE + 1], row[GUIDE + 2], row[GUIDE + 3]
    u, v, cos, sin = motion.driven[U, p], motion.driven[V, p], motion.pin[0, p], motion.pin[1, p]
    t, k2 = row[GUIDE + 8] * b * math.sqrt(motion.pin[PIN_MARGIN, p]), a * e / c
    out[0] = -(-u * cos - v * sin + (a - e * u) / c) / t
    out[1] = b / c / t
    out[2] = -(0.5 - 0.5 * (a * a + e * e - b * b) / (c * c) + k2 * u / c) / t
    out[3] = -(cos + (e - a * u) / c) / t


@part
def _by_dimensions(
    row: Array, x: Array, motion: Motion, closure: Array, p: int, index: int, cos: Array, sin: Array, out: Complex
) -> None:
    """Compute derivatives of the point, along the line (real) and across, by all dimensions: row ``index``, (16,)."""
    z1, z2 = complex(x[0], x[1]), complex(x[2], x[3])
    scale, stage, by_pin = abs(z1), first_stage(row), np.empty(4)
    b, w = motion.b[0, p], motion.w[0, p]
    arm = row[GUIDE + 2] * complex(motion.pin[0, p], motion.pin[1, p])
    swing = 1j * z2 * arm
    by_input = 1j * (z1 - z2) * b + swing * motion.pin[P, p]
    c, s = -motion.driver[COSINE, p], -stage.branch * motion.driver[SINE, p]
    t = stage.coupler * math.sqrt(motion.driver[CRANK_MARGIN, p])
    for k in range(DRIVER_DIMENSIONS):
        across = closure[k, 1] + closure[k, 2] * sin[p]
        level = closure[k, 3] + closure[k, 4] * sin[p] - closure[k, 5] * cos[p]
        out[index, k] = row[SENSE] * stage.branch * (closure[k, 0] * c - across * s - level) / t * by_input
    _pin_by_dimensions(row, motion, p, by_pin)
    k = DRIVER_DIMENSIONS
    out[index, k] = ((z1 - z2) * b / row[GUIDE] + swing * by_pin[0]) / scale
    out[index, k + 1] = (swing * by_pin[1] - z2 * w / row[GUIDE + 1]) / scale
    out[index, k + 2] = (z2 * arm / row[GUIDE + 2] + swing * by_pin[2]) / scale
    out[index, k + 3] = (z2 + swing * by_pin[3]) / scale
    out[index, k + 4] = z1 * w / (scale * row[GUIDE + 1])
    out[index, k + 5] = 1j * out[index, k + 4]
    out[index, k + 6] = -1j * (z1 * b + z2 * w)
    out[index, k + 7] = complex(0.0, -1.0)
    out[index, k + 8] = by_input


@part
def tolerance_margins(
    task: Task, row: Array, x: Array, motion: Motion, cos: Array, sin: Array, ends: Array, out: Array
) -> None:
    """Compute the margins of the deviation, at m poses and between them, and of the position's range: (2 m + 1,).

    Parameters
    ----------
    task : with ``sigma``
    row, x, motion : a design that turns, its unknowns and its motion at the m poses ``cos``, ``sin``
    ends : (2,) poses where the position is highest and lowest; found and written if the first is negative
    out : written
    """
    m = len(cos)
    closure, point_slopes = np.empty((DRIVER_DIMENSIONS, CLOSURE_NUMBERS)), np.empty((m, DIMENSIONS), np.complex128)
    _closure_by_dimensions(row, closure)
    high, low, highest, lowest = 0, 0, -math.inf, math.inf
    for p in range(m):
        _by_dimensions(row, x, motion, closure, p, p, cos, sin, point_slopes)
        square = 0.0
        for k in range(DIMENSIONS):
            deviation = point_slopes[p, k].imag * task.sigma[_column(k)]
            square += deviation * deviation
        out[2 * p] = math.sqrt(square)
        b, w = motion.b[0, p], motion.w[0, p]
        s = x[0] * b.real - x[1] * b.imag + x[2] * w.real - x[3] * w.imag
        if s > highest:
            high, highest = p, s
        if s < lowest:
            low, lowest = p, s
    if ends[0] < 0.0:
        ends[0], ends[1] = high, low
    square = 0.0
    for k in range(DIMENSIONS):
        deviation = (point_slopes[int(ends[0]), k].real - point_slopes[int(ends[1]), k].real) * task.sigma[_column(k)]
        square += deviation * deviation
    out[2 * m] = math.sqrt(square)
    for p in range(m):
        out[2 * p + 1] = 0.5 * (out[2 * p] + out[2 * p + 2 if p < m - 1 else 0])


@inline
def _column(k: int) -> int:
    """Column of a dimension; the columns of branches and of the coupling's sense are no dimensions."""
    return k if k < DRIVER_DIMENSIONS else OFFSET if k == DIMENSIONS - 1 else k + 1


@part
def margins_and_slopes(task: Task, kind: int, place: Array, x: Array, margin: Array, dmargin: Array) -> None:
    """Compute the margins (m + 1,) of a design and their derivatives (n + 5, m + 1) by places and linear unknowns.

    The derivatives are difference quotients of exact first derivatives, good to six digits; none with an empty
    ``dmargin``.
    """
    n, half = len(place), len(task.cos) // EVERY_SECOND
    cos, sin = task.cos[::EVERY_SECOND].copy(), task.sin[::EVERY_SECOND].copy()
    row, motion, ends = np.empty(task.bases.shape[1]), empty_motion(half), np.full(2, -1.0)
    moved_place, moved_x, moved_margin = place.copy(), x.copy(), np.empty(len(margin))
    columns_of(task, kind, place, row)
    motion_of(row, cos, sin, motion)
    tolerance_margins(task, row, x, motion, cos, sin, ends, margin)
    for k in range(len(dmargin)):
        if k < n:
            moved_place[k] += PLACE_STEP
            columns_of(task, kind, moved_place, row)
            step = PLACE_STEP
        else:
            columns_of(task, kind, place, row)
            step = PLACE_STEP * (abs(x[0]) + abs(x[1]) if k < n + 2 else abs(x[2]) + abs(x[3]) if k < n + 4 else 1.0)
            moved_x[k - n] += step
        if k <= n:
            motion_of(row, cos, sin, motion)
        tolerance_margins(task, row, moved_x, motion, cos, sin, ends, moved_margin)
        for p in range(len(margin)):
            dmargin[k, p] = (moved_margin[p] - margin[p]) / step
        if k < n:
            moved_place[k] = place[k]
        else:
            moved_x[k - n] = x[k - n]
