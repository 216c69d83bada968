"""Room for tolerances of the deviation and the range of a needle drive, to first order, at fixed poses.

Room is the scatter by the tolerances: the distance that a design keeps from its limits.
"""

from __future__ import annotations

import math

import numpy as np

from kernels.descent.motion import (
    DIP,
    GUIDE,
    MARGIN,
    OFFSET,
    SENSE,
    SINE,
    STEP,
    TURN,
    Complex,
    Motion,
    P,
    U,
    V,
    first_stage,
    moving,
    no_motion,
)
from kernels.descent.rows import Task, columns_of
from kernels.jit import inline, part
from kernels.types import Array

EVERY_SECOND = 2  # pose is enough: the effect of tolerances changes slowly along the turn
DRIVER = 7  # dimensions of stage 1
NUMBERS = 6  # of the closure of stage 1 that depend on its dimensions
DIMENSIONS = DRIVER + 9  # and a, b, c, e, xi, eta, lam, h of stage 2 and the angle between both
MOVED = 1e-6  # step of a place for difference quotients


@inline
def _closure_by_dimensions(row: Array, out: Array) -> None:
    """Compute derivatives (7, 6) of the numbers of the closure of stage 1 by its dimensions."""
    design = row.astype(np.complex128)
    for k in range(DRIVER):
        design[k] += complex(0.0, STEP)
        r = first_stage(design)
        out[k, 0], out[k, 1], out[k, 2] = r.e.imag / STEP, r.y0.imag / STEP, r.ca.imag / STEP
        out[k, 3], out[k, 4], out[k, 5] = r.k0.imag / STEP, r.k1.imag / STEP, r.k2.imag / STEP
        design[k] = row[k]


@inline
def _of_pin(row: Array, at: Motion, p: int, out: Array) -> None:
    """Compute derivatives of the angle of the second rocker by a, b, c, e."""
    a, b, c, e = row[GUIDE], row[GUIDE + 1], row[GUIDE + 2], row[GUIDE + 3]
    u, v, cos, sin = at.driven[U, p], at.driven[V, p], at.pin[0, p], at.pin[1, p]
    t, k2 = row[GUIDE + 8] * b * math.sqrt(at.pin[DIP, p]), a * e / c
    out[0] = -(-u * cos - v * sin + (a - e * u) / c) / t
    out[1] = b / c / t
    out[2] = -(0.5 - 0.5 * (a * a + e * e - b * b) / (c * c) + k2 * u / c) / t
    out[3] = -(cos + (e - a * u) / c) / t


@part
def _by_dimensions(
    row: Array, x: Array, at: Motion, closure: Array, p: int, place: int, cos: Array, sin: Array, out: Complex
) -> None:
    """Compute derivatives of the point, along the line (real) and across, by all dimensions: row ``place``, (16,)."""
    z1, z2 = complex(x[0], x[1]), complex(x[2], x[3])
    scale, one, turned = abs(z1), first_stage(row), np.empty(4)
    b, w = at.b[0, p], at.w[0, p]
    arm = row[GUIDE + 2] * complex(at.pin[0, p], at.pin[1, p])
    swing = 1j * z2 * arm
    by_input = 1j * (z1 - z2) * b + swing * at.pin[P, p]
    c, s, t = -at.driver[TURN, p], -one.branch * at.driver[SINE, p], one.coupler * math.sqrt(at.driver[MARGIN, p])
    for k in range(DRIVER):
        across = closure[k, 1] + closure[k, 2] * sin[p]
        level = closure[k, 3] + closure[k, 4] * sin[p] - closure[k, 5] * cos[p]
        out[place, k] = row[SENSE] * one.branch * (closure[k, 0] * c - across * s - level) / t * by_input
    _of_pin(row, at, p, turned)
    k = DRIVER
    out[place, k] = ((z1 - z2) * b / row[GUIDE] + swing * turned[0]) / scale
    out[place, k + 1] = (swing * turned[1] - z2 * w / row[GUIDE + 1]) / scale
    out[place, k + 2] = (z2 * arm / row[GUIDE + 2] + swing * turned[2]) / scale
    out[place, k + 3] = (z2 + swing * turned[3]) / scale
    out[place, k + 4] = z1 * w / (scale * row[GUIDE + 1])
    out[place, k + 5] = 1j * out[place, k + 4]
    out[place, k + 6] = -1j * (z1 * b + z2 * w)
    out[place, k + 7] = complex(0.0, -1.0)
    out[place, k + 8] = by_input


@part
def room_of(task: Task, row: Array, x: Array, at: Motion, cos: Array, sin: Array, ends: Array, out: Array) -> None:
    """Compute the room of the deviation, at m poses and between them, and of the range of the position: (2 m + 1,).

    Parameters
    ----------
    task : with ``sigma``
    row, x, at : a design that turns, its unknowns and its motion at the m poses ``cos``, ``sin``
    ends : (2,) poses where the position is highest and lowest; found and written if the first is negative
    out : written
    """
    m = len(cos)
    closure, of = np.empty((DRIVER, NUMBERS)), np.empty((m, DIMENSIONS), np.complex128)
    _closure_by_dimensions(row, closure)
    high, low, highest, lowest = 0, 0, -math.inf, math.inf
    for p in range(m):
        _by_dimensions(row, x, at, closure, p, p, cos, sin, of)
        square = 0.0
        for k in range(DIMENSIONS):
            off = of[p, k].imag * task.sigma[_column(k)]
            square += off * off
        out[2 * p] = math.sqrt(square)
        s = x[0] * at.b[0, p].real - x[1] * at.b[0, p].imag + x[2] * at.w[0, p].real - x[3] * at.w[0, p].imag
        if s > highest:
            high, highest = p, s
        if s < lowest:
            low, lowest = p, s
    if ends[0] < 0.0:
        ends[0], ends[1] = high, low
    square = 0.0
    for k in range(DIMENSIONS):
        off = (of[int(ends[0]), k].real - of[int(ends[1]), k].real) * task.sigma[_column(k)]
        square += off * off
    out[2 * m] = math.sqrt(square)
    for p in range(m):
        out[2 * p + 1] = 0.5 * (out[2 * p] + out[2 * p + 2 if p < m - 1 else 0])


@inline
def _column(k: int) -> int:
    """Column of a dimension; the columns of branches and of the coupling's sense are no dimensions."""
    return k if k < DRIVER else OFFSET if k == DIMENSIONS - 1 else k + 1


@part
def rooms(task: Task, kind: int, place: Array, x: Array, room: Array, moved: Array) -> None:
    """Compute the room (m + 1,) of a design and its derivatives (n + 5, m + 1) by places and linear unknowns.

    The derivatives are difference quotients of exact first derivatives, good to six digits; none if ``moved`` is empty.
    """
    n, half = len(place), len(task.cos) // EVERY_SECOND
    cos, sin = task.cos[::EVERY_SECOND].copy(), task.sin[::EVERY_SECOND].copy()
    row, at, ends = np.empty(task.bases.shape[1]), no_motion(half), np.full(2, -1.0)
    other, there, beside = place.copy(), x.copy(), np.empty(len(room))
    columns_of(task, kind, place, row)
    moving(row, cos, sin, at)
    room_of(task, row, x, at, cos, sin, ends, room)
    for k in range(len(moved)):
        if k < n:
            other[k] += MOVED
            columns_of(task, kind, other, row)
            step = MOVED
        else:
            columns_of(task, kind, place, row)
            step = MOVED * (abs(x[0]) + abs(x[1]) if k < n + 2 else abs(x[2]) + abs(x[3]) if k < n + 4 else 1.0)
            there[k - n] += step
        if k <= n:
            moving(row, cos, sin, at)
        room_of(task, row, there, at, cos, sin, ends, beside)
        for p in range(len(room)):
            moved[k, p] = (beside[p] - room[p]) / step
        if k < n:
            other[k] = place[k]
        else:
            there[k - n] = x[k - n]
