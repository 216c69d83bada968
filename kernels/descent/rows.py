"""Curves of a needle drive at fixed poses as rows of a program in its places and linear unknowns."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels.curves.sampled_rows import Limits, sampled_rows
from kernels.descent.motion import COSINE, CRANK_MARGIN, PIN_MARGIN, SINE, Index, Motion, Slopes
from kernels.jit import inline, part
from kernels.types import Array

# Codes of curves: both margins, the angle of stage 1, the coupler point in the frame of stage 2, then the point along
# and across the line, two codes per order of the derivative, and the deviation plus and minus its margin.
FIRST_MARGIN, SECOND_MARGIN, ANGLE, POINT_X, POINT_Y, ALONG, ACROSS, HIGH, LOW = 0, 1, 2, 3, 4, 5, 6, 11, 12
UNKNOWNS = 5  # in which the motion is linear: z1, z2 (complex) and the offset


class Task(NamedTuple):
    """Data that all descents of one problem share; places (n,) are scaled variables between 0 and 1.

    ``bases`` (k, P) are designs of all combinations of signs, with 1 for the crank of stage 2. A place moves its column
    from ``low`` to ``high``, on a logarithmic scale of that width where ``log_width`` is not 0. ``codes`` (c,) are the
    curves of ``limits``; the first two limits are the objective, a largest magnitude. ``lengths`` (q,) are columns of
    stage 2 with bounds. ``turn_rows`` (T, m) are the numbers of rows around one turn. ``kinds`` (r,) are the parts of
    the rows in the linear program of the unknowns (:mod:`kernels.descent.unknowns`). ``range_rows`` are the rows of the
    position's range, in units of ``range_units``. ``max_deviation`` and ``min_stroke`` are allowed. ``unit`` is
    the unit of the objective, ``price`` the penalty of a limit missed by its own size. ``sigma`` (P,) are standard
    deviations of the columns in manufacture, times the number of them in the margins of deviation and range; empty
    without tolerances.
    """

    bases: Array
    columns: Index
    low: Array
    high: Array
    log_width: Array
    cos: Array
    sin: Array
    codes: Index
    limits: Limits
    lengths: Index
    shortest: Array
    longest: Array
    turn_rows: Index
    kinds: Index
    range_rows: Index
    range_units: Array
    max_deviation: float
    min_stroke: float
    unit: float
    price: float
    sigma: Array


@part
def columns_of(task: Task, kind: int, place: Array, row: Array) -> None:
    """Write the columns of the design at a place."""
    for k in range(len(row)):
        row[k] = task.bases[kind, k]
    for k in range(len(task.columns)):
        if task.log_width[k] != 0.0:
            row[task.columns[k]] = task.low[k] * math.exp(place[k] * task.log_width[k])
        else:
            row[task.columns[k]] = task.low[k] + place[k] * (task.high[k] - task.low[k])


@inline
def _coordinate(z: complex, code: int) -> float:
    """Coordinate of a complex point that a curve shows: the real part along, the imaginary part across."""
    return z.real if code in (POINT_X, ALONG, ALONG + 2, ALONG + 4) else z.imag


@inline
def _factors(code: int, x: Array) -> tuple[int, complex, complex]:
    """Order of the derivative, and the factors of B and w in the point of which a curve is a coordinate."""
    z1, z2 = complex(x[0], x[1]), complex(x[2], x[3])
    if code in (POINT_X, POINT_Y):
        scale = abs(z1)
        return 0, complex(scale, 0.0), z1.conjugate() * z2 / scale
    return 0 if code >= HIGH else (code - ALONG) // 2, z1, z2


@part
def curve(code: int, motion: Motion, x: Array, margin: Array, y: Array) -> None:
    """Write one curve at m poses."""
    m = len(y)
    if code <= SECOND_MARGIN:
        for p in range(m):
            y[p] = motion.driver[CRANK_MARGIN, p] if code == FIRST_MARGIN else motion.pin[PIN_MARGIN, p]
        return
    if code == ANGLE:
        cos, sin = motion.driver[COSINE], motion.driver[SINE]
        y[0] = math.atan2(sin[0], cos[0])
        for p in range(1, m):
            c, s = cos[p] * cos[p - 1] + sin[p] * sin[p - 1], sin[p] * cos[p - 1] - cos[p] * sin[p - 1]
            y[p] = y[p - 1] + math.atan2(s, c)
        return
    order, factor_b, factor_w = _factors(code, x)
    offset = x[4] if code == ACROSS or code >= HIGH else 0.0
    for p in range(m):
        y[p] = _coordinate(factor_b * motion.b[order, p] + factor_w * motion.w[order, p], code) - offset
        if code >= HIGH:
            y[p] += margin[p] if code == HIGH else -margin[p]


@part
def _place_slopes(code: int, dmotion: Slopes, x: Array, out: Array) -> None:
    """Compute derivatives (n, m) of a curve by the columns that places move, without the tolerance margins."""
    n, m = dmotion.angle.shape
    order, factor_b, factor_w = _factors(code, x)
    for k in range(n):
        for p in range(m):
            if code <= SECOND_MARGIN:
                out[k, p] = dmotion.margins[code, k, p]
            elif code == ANGLE:
                out[k, p] = dmotion.angle[k, p]
            else:
                out[k, p] = _coordinate(factor_b * dmotion.b[order, k, p] + factor_w * dmotion.w[order, k, p], code)


@part
def by_unknowns(code: int, motion: Motion, x: Array, out: Array) -> None:
    """Compute derivatives (5, m) of a curve by the linear unknowns."""
    if code <= ANGLE:
        for k in range(UNKNOWNS):
            for p in range(out.shape[1]):
                out[k, p] = 0.0
        return
    z1, z2 = complex(x[0], x[1]), complex(x[2], x[3])
    order, _, factor_w = _factors(code, x)
    scale = abs(z1)
    by_offset = -1.0 if code == ACROSS or code >= HIGH else 0.0
    for p in range(out.shape[1]):
        b, w = motion.b[order, p], motion.w[order, p]
        if code in (POINT_X, POINT_Y):
            turned, shrink = z1.conjugate() / scale, factor_w / (scale * scale)
            out[0, p] = _coordinate((z1.real / scale) * b + (z2 / scale - shrink * z1.real) * w, code)
            out[1, p] = _coordinate((z1.imag / scale) * b - (1j * z2 / scale + shrink * z1.imag) * w, code)
            out[2, p], out[3, p] = _coordinate(turned * w, code), _coordinate(1j * turned * w, code)
        else:
            out[0, p], out[1, p] = _coordinate(b, code), _coordinate(1j * b, code)
            out[2, p], out[3, p] = _coordinate(w, code), _coordinate(1j * w, code)
        out[4, p] = by_offset


@part
def _lengths(task: Task, row: Array, x: Array, values: Array) -> None:
    """Write the last rows: lengths of stage 2 within their bounds."""
    r, scale = len(values) - 2 * len(task.lengths), math.sqrt(x[0] * x[0] + x[1] * x[1])
    for j in range(len(task.lengths)):
        length = row[task.lengths[j]] * scale
        values[r + 2 * j], values[r + 2 * j + 1] = length / task.shortest[j] - 1.0, 1.0 - length / task.longest[j]


@part
def rows_of(task: Task, row: Array, motion: Motion, x: Array, margin: Array, values: Array) -> None:
    """Compute the rows (r,) of a design: minus the objective's magnitude in the first 2 m, then limits, 0 at least.

    Parameters
    ----------
    task : the problem
    row : (P,) the design, without point, line and scale
    motion : its motion
    x : (5,) the linear unknowns
    margin : (m + 1,) tolerance margins of the deviation and of the range of the position
    values : written
    """
    m, no_slopes = len(task.cos), np.empty((0, len(values)))
    y = np.empty((len(task.codes), m))
    for c in range(len(task.codes)):
        curve(task.codes[c], motion, x, margin, y[c])
    sampled_rows(y, np.empty((len(task.codes), 0, m)), task.limits, values, no_slopes)
    for i in range(len(task.range_rows)):
        values[task.range_rows[i]] -= margin[m] / task.range_units[i]
    _lengths(task, row, x, values)


@part
def rows_and_slopes(
    task: Task, row: Array, motion: Motion, dmotion: Slopes, x: Array, margin: Array, dmargin: Array, values: Array,
    slopes: Array,
) -> None:  # fmt: skip
    """Compute rows and gradients (n + 5, r) by places and unknowns; ``dmargin`` (n + 5, m + 1) are the margins'."""
    n, m = len(dmotion.angle), len(task.cos)
    y, curve_slopes = np.empty((len(task.codes), m)), np.empty((len(task.codes), n + UNKNOWNS, m))
    for c in range(len(task.codes)):
        code = task.codes[c]
        curve(code, motion, x, margin, y[c])
        _place_slopes(code, dmotion, x, curve_slopes[c, :n])
        by_unknowns(code, motion, x, curve_slopes[c, n:])
        for k in range(n):
            column = task.columns[k]
            per = row[column] * task.log_width[k] if task.log_width[k] != 0.0 else task.high[k] - task.low[k]
            for p in range(m):
                curve_slopes[c, k, p] *= per
        if code >= HIGH:
            sign = 1.0 if code == HIGH else -1.0
            for k in range(n + UNKNOWNS):
                for p in range(m):
                    curve_slopes[c, k, p] += sign * dmargin[k, p]
    sampled_rows(y, curve_slopes, task.limits, values, slopes)
    for i in range(len(task.range_rows)):
        j, per = task.range_rows[i], 1.0 / task.range_units[i]
        values[j] -= margin[m] * per
        for k in range(n + UNKNOWNS):
            slopes[k, j] -= dmargin[k, m] * per
    _lengths(task, row, x, values)
    scale, r = math.sqrt(x[0] * x[0] + x[1] * x[1]), len(values) - 2 * len(task.lengths)
    for j in range(len(task.lengths)):
        column, below, above = task.lengths[j], r + 2 * j, r + 2 * j + 1
        for k in range(n + UNKNOWNS):
            by_scale = row[column] * x[k - n] / scale if n <= k < n + 2 else 0.0
            along = row[column] * task.log_width[k] * scale if k < n and task.columns[k] == column else by_scale
            slopes[k, below], slopes[k, above] = along / task.shortest[j], -along / task.longest[j]


@part
def merit_of(task: Task, values: Array) -> float:
    """Merit of a design that turns, from its rows: the objective plus the penalty of the worst missed limit."""
    objective, limits = math.inf, math.inf
    for j in range(len(values)):
        if j < 2 * len(task.cos):
            objective = min(objective, values[j])
        else:
            limits = min(limits, values[j])
    return task.price * max(-limits, 0.0) - objective
