"""Curves of a needle drive at fixed poses as rows of a program in its places and linear unknowns."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels.curves.sampled_rows import Limits, sampled_rows
from kernels.descent.motion import DIP, MARGIN, SINE, TURN, Index, Motion, Moved
from kernels.jit import inline, part
from kernels.types import Array

# Codes of curves: both margins, the angle of stage 1, the coupler point in the frame of stage 2, then the point along
# and across the line, two codes per order of the derivative, and the deviation plus and minus its room.
FIRST_MARGIN, SECOND_MARGIN, ANGLE, POINT_X, POINT_Y, ALONG, ACROSS, HIGH, LOW = 0, 1, 2, 3, 4, 5, 6, 11, 12
UNKNOWNS = 5  # in which the motion is linear: z1, z2 (complex) and the offset


class Task(NamedTuple):
    """Data that all descents of one problem share; places (n,) are scaled variables between 0 and 1.

    ``bases`` (k, P) are designs of all combinations of signs, with 1 for the crank of stage 2. A place moves its column
    from ``low`` to ``high``, on a logarithmic scale of that width where ``wide`` is not 0. ``codes`` (c,) are the
    curves of ``limits``; the first two limits are the objective, a largest magnitude. ``lengths`` (q,) are columns of
    stage 2 with bounds. ``turns`` (T, m) are the numbers of rows around one turn. ``kinds`` (r,) are the parts of the
    rows in the linear program of the unknowns (:mod:`kernels.descent.unknowns`). ``ranges`` are the rows of the
    position's range, in units of ``spans``. ``bound`` and ``stroke`` are the largest deviation and the least range
    allowed. ``unit`` is the unit of the objective, ``price`` the penalty of a limit missed by its own size. ``sigma``
    (P,) are standard deviations of the columns in manufacture, times the number of them that is kept from limits on
    deviation and range; empty without tolerances.
    """

    bases: Array
    columns: Index
    low: Array
    high: Array
    wide: Array
    cos: Array
    sin: Array
    codes: Index
    limits: Limits
    lengths: Index
    least: Array
    most: Array
    turns: Index
    kinds: Index
    ranges: Index
    spans: Array
    bound: float
    stroke: float
    unit: float
    price: float
    sigma: Array


@part
def columns_of(task: Task, kind: int, place: Array, row: Array) -> None:
    """Write the columns of the design at a place."""
    for k in range(len(row)):
        row[k] = task.bases[kind, k]
    for k in range(len(task.columns)):
        if task.wide[k] != 0.0:
            row[task.columns[k]] = task.low[k] * math.exp(place[k] * task.wide[k])
        else:
            row[task.columns[k]] = task.low[k] + place[k] * (task.high[k] - task.low[k])


@inline
def _part_of(z: complex, code: int) -> float:
    """Coordinate of a complex point that a curve shows: the real part along, the imaginary part across."""
    return z.real if code in (POINT_X, ALONG, ALONG + 2, ALONG + 4) else z.imag


@inline
def _shares(code: int, x: Array) -> tuple[int, complex, complex]:
    """Order of the derivative, and the factors of B and w in the point of which a curve is a coordinate."""
    z1, z2 = complex(x[0], x[1]), complex(x[2], x[3])
    if code in (POINT_X, POINT_Y):
        size = abs(z1)
        return 0, complex(size, 0.0), z1.conjugate() * z2 / size
    return 0 if code >= HIGH else (code - ALONG) // 2, z1, z2


@part
def curve(code: int, at: Motion, x: Array, room: Array, y: Array) -> None:
    """Write one curve at m poses."""
    m = len(y)
    if code <= SECOND_MARGIN:
        for p in range(m):
            y[p] = at.driver[MARGIN, p] if code == FIRST_MARGIN else at.pin[DIP, p]
        return
    if code == ANGLE:
        y[0] = math.atan2(at.driver[SINE, 0], at.driver[TURN, 0])
        for p in range(1, m):
            c = at.driver[TURN, p] * at.driver[TURN, p - 1] + at.driver[SINE, p] * at.driver[SINE, p - 1]
            s = at.driver[SINE, p] * at.driver[TURN, p - 1] - at.driver[TURN, p] * at.driver[SINE, p - 1]
            y[p] = y[p - 1] + math.atan2(s, c)
        return
    order, first, second = _shares(code, x)
    off = x[4] if code == ACROSS or code >= HIGH else 0.0
    for p in range(m):
        y[p] = _part_of(first * at.b[order, p] + second * at.w[order, p], code) - off
        if code >= HIGH:
            y[p] += room[p] if code == HIGH else -room[p]


@part
def _by_places(code: int, by: Moved, x: Array, of: Array) -> None:
    """Compute derivatives (n, m) of a curve by the columns that places move, without the room for tolerances."""
    n, m = by.angle.shape
    order, first, second = _shares(code, x)
    for k in range(n):
        for p in range(m):
            if code <= SECOND_MARGIN:
                of[k, p] = by.margins[code, k, p]
            elif code == ANGLE:
                of[k, p] = by.angle[k, p]
            else:
                of[k, p] = _part_of(first * by.b[order, k, p] + second * by.w[order, k, p], code)


@part
def by_unknowns(code: int, at: Motion, x: Array, of: Array) -> None:
    """Compute derivatives (5, m) of a curve by the linear unknowns."""
    if code <= ANGLE:
        for k in range(UNKNOWNS):
            for p in range(of.shape[1]):
                of[k, p] = 0.0
        return
    z1, z2 = complex(x[0], x[1]), complex(x[2], x[3])
    order, _, second = _shares(code, x)
    size = abs(z1)
    off = -1.0 if code == ACROSS or code >= HIGH else 0.0
    for p in range(of.shape[1]):
        b, w = at.b[order, p], at.w[order, p]
        if code in (POINT_X, POINT_Y):
            turned, less = z1.conjugate() / size, second / (size * size)
            of[0, p] = _part_of((z1.real / size) * b + (z2 / size - less * z1.real) * w, code)
            of[1, p] = _part_of((z1.imag / size) * b - (1j * z2 / size + less * z1.imag) * w, code)
            of[2, p], of[3, p] = _part_of(turned * w, code), _part_of(1j * turned * w, code)
        else:
            of[0, p], of[1, p] = _part_of(b, code), _part_of(1j * b, code)
            of[2, p], of[3, p] = _part_of(w, code), _part_of(1j * w, code)
        of[4, p] = off


@part
def _lengths(task: Task, row: Array, x: Array, values: Array) -> None:
    """Write the last rows: lengths of stage 2 within their bounds."""
    r, scale = len(values) - 2 * len(task.lengths), math.sqrt(x[0] * x[0] + x[1] * x[1])
    for j in range(len(task.lengths)):
        length = row[task.lengths[j]] * scale
        values[r + 2 * j], values[r + 2 * j + 1] = length / task.least[j] - 1.0, 1.0 - length / task.most[j]


@part
def values_of(task: Task, row: Array, at: Motion, x: Array, room: Array, values: Array) -> None:
    """Compute the rows (r,) of a design: minus the objective's magnitude in the first 2 m, then limits, 0 at least.

    Parameters
    ----------
    task : the problem
    row : (P,) the design, without point, line and scale
    at : its motion
    x : (5,) the linear unknowns
    room : (m + 1,) of the deviation and of the range of the position
    values : written
    """
    m, none = len(task.cos), np.empty((0, len(values)))
    y = np.empty((len(task.codes), m))
    for c in range(len(task.codes)):
        curve(task.codes[c], at, x, room, y[c])
    sampled_rows(y, np.empty((len(task.codes), 0, m)), task.limits, values, none)
    for i in range(len(task.ranges)):
        values[task.ranges[i]] -= room[m] / task.spans[i]
    _lengths(task, row, x, values)


@part
def slopes_of(
    task: Task, row: Array, at: Motion, by: Moved, x: Array, room: Array, moved: Array, values: Array, slopes: Array
) -> None:
    """Compute rows and their gradients (n + 5, r) by places and unknowns; ``moved`` (n + 5, m + 1) are the room's."""
    n, m = len(by.angle), len(task.cos)
    y, of = np.empty((len(task.codes), m)), np.empty((len(task.codes), n + UNKNOWNS, m))
    for c in range(len(task.codes)):
        code = task.codes[c]
        curve(code, at, x, room, y[c])
        _by_places(code, by, x, of[c, :n])
        by_unknowns(code, at, x, of[c, n:])
        for k in range(n):
            column = task.columns[k]
            per = row[column] * task.wide[k] if task.wide[k] != 0.0 else task.high[k] - task.low[k]
            for p in range(m):
                of[c, k, p] *= per
        if code >= HIGH:
            sign = 1.0 if code == HIGH else -1.0
            for k in range(n + UNKNOWNS):
                for p in range(m):
                    of[c, k, p] += sign * moved[k, p]
    sampled_rows(y, of, task.limits, values, slopes)
    for i in range(len(task.ranges)):
        j, per = task.ranges[i], 1.0 / task.spans[i]
        values[j] -= room[m] * per
        for k in range(n + UNKNOWNS):
            slopes[k, j] -= moved[k, m] * per
    _lengths(task, row, x, values)
    scale, r = math.sqrt(x[0] * x[0] + x[1] * x[1]), len(values) - 2 * len(task.lengths)
    for j in range(len(task.lengths)):
        column, below, above = task.lengths[j], r + 2 * j, r + 2 * j + 1
        for k in range(n + UNKNOWNS):
            by_scale = row[column] * x[k - n] / scale if n <= k < n + 2 else 0.0
            along = row[column] * task.wide[k] * scale if k < n and task.columns[k] == column else by_scale
            slopes[k, below], slopes[k, above] = along / task.least[j], -along / task.most[j]


@part
def worth_of(task: Task, values: Array) -> float:
    """Merit of a design that turns, from its rows: the objective plus the penalty of the worst missed limit."""
    own, others = math.inf, math.inf
    for j in range(len(values)):
        if j < 2 * len(task.cos):
            own = min(own, values[j])
        else:
            others = min(others, values[j])
    return task.price * max(-others, 0.0) - own
