"""Best linear unknowns of a design: point, line and scale of the guide for the least objective under its limits.

    minimise t + price v   subject to   value_j + slopes_j x + (t, v or 0) >= 0,   v >= 0

is a linear program.  A very small curvature added to it makes the solution the feasible point nearest to a centre far
away (:mod:`kernels.linear.nearest`), and changes nothing where the solution is at a vertex.
"""

from __future__ import annotations

import math

import numpy as np

from kernels import status as st
from kernels.descent.motion import Index, Motion, zero_slopes
from kernels.descent.program import ADDED_CURVATURE, TOLERANCE, units
from kernels.descent.rows import ACROSS, ALONG, ANGLE, UNKNOWNS, Task, by_unknowns, curve, rows_and_slopes
from kernels.jit import kernel, part
from kernels.linear.nearest import nearest
from kernels.types import Array

OMITTED, OBJECTIVE, SOFT, REQUIRED = 0, 1, 2, 3  # kinds of rows: left out, with t, with v, and rows that must be kept
ADDED = 1e-8  # curvature added in the unknowns, in units of their size and of the objective
EXCESS = 0.5  # price of a deviation twice as large as allowed, in strokes
SMALLEST = 1e-9  # scale below which there is no guide
DIRECTIONS = 3  # most directions along which the least scale of a guide is imposed
DISTANT = 0.3  # distance from its bound, in shares of the bound or of the objective, from which on a row is left out


@kernel
def best_unknowns(values: Array, slopes: Array, kinds: Index, size: Array, unit: float, price: float, x: Array) -> bool:
    """Solve the linear program for the best linear unknowns.

    Parameters
    ----------
    values, slopes : (r,) and (5, r) of the rows at ``x``, without t and v
    kinds : (r,) of the rows
    size, unit : (5,) units of the unknowns, and unit of t
    price : of a unit of v
    x : (5,) in and out

    Returns
    -------
    Whether there is a solution that keeps the NEEDED rows; if not, x is unchanged.
    """
    count, n = 1, UNKNOWNS + 2
    for kind in kinds:
        count += 1 if kind != OMITTED else 0
    rows, rhs, centre, y, weights = np.zeros((n, count)), np.zeros(count), np.zeros(n), np.empty(n), np.empty(count)
    unit_slack, column, check = 1.0 / math.sqrt(ADDED_CURVATURE), 1, 0.0
    rows[UNKNOWNS + 1, 0] = unit_slack
    for j in range(len(kinds)):
        if kinds[j] != OMITTED:
            scale = 1.0 / unit if kinds[j] == OBJECTIVE else 1.0
            rhs[column] = -values[j] * scale
            for k in range(UNKNOWNS):
                rows[k, column] = slopes[k, j] * scale * size[k] / math.sqrt(ADDED)
                check += rows[k, column] + rhs[column]
            if kinds[j] != REQUIRED:
                rows[UNKNOWNS if kinds[j] == OBJECTIVE else UNKNOWNS + 1, column] = unit_slack
            column += 1
    centre[UNKNOWNS], centre[UNKNOWNS + 1] = -unit_slack, -unit_slack * price / unit
    if not math.isfinite(check) or nearest(rows, rhs, centre, TOLERANCE, y, weights) != st.OK:
        return False
    for k in range(UNKNOWNS):
        x[k] += y[k] * size[k] / math.sqrt(ADDED)
    return True


@part
def improved_unknowns(task: Task, row: Array, motion: Motion, x: Array, margin: Array, out: Array) -> None:
    """Compute the best linear unknowns (5,) of a design, its rows linearised at ``x``; x itself without a solution."""
    m, r = len(task.cos), len(task.kinds)
    values, slopes, size, kinds = np.empty(r), np.empty((UNKNOWNS, r)), np.empty(UNKNOWNS), task.kinds.copy()
    rows_and_slopes(task, row, motion, zero_slopes(0, m), x, margin, np.zeros((UNKNOWNS, m + 1)), values, slopes)
    units(x, size)
    t = task.unit
    for j in range(2 * m):
        t = max(t, -values[j])
    for j in range(r):
        if (kinds[j] == SOFT and values[j] > DISTANT) or (kinds[j] == OBJECTIVE and values[j] + t > DISTANT * t):
            kinds[j] = OMITTED
    for k in range(UNKNOWNS):
        out[k] = x[k]
    best_unknowns(values, slopes, kinds, size, task.unit, task.price, out)


@part
def unknowns_of(task: Task, row: Array, motion: Motion, margin: Array, x: Array) -> bool:
    """Compute the best linear unknowns (5,) of a design under the least lengths of stage 2; whether there are any.

    Least lengths bound the modulus of z1 from below, which is not linear.  The bound is imposed on the component of z1
    along its direction without the bound, then along its direction with it.
    """
    m, zeros, angle = len(task.cos), np.zeros(UNKNOWNS), np.empty(len(task.cos))
    values, slopes, curve_slopes = np.zeros(4 * m + 2), np.zeros((UNKNOWNS, 4 * m + 2)), np.empty((UNKNOWNS, m))
    size, kinds = np.full(UNKNOWNS, task.min_stroke), np.zeros(4 * m + 2, np.int64)
    kinds[4 * m] = REQUIRED
    for block in range(2):
        by_unknowns(task.codes[0] if block == 0 else ACROSS, motion, zeros, curve_slopes)
        for p in range(m):
            for j, sign in ((2 * m * block + p, 1.0), (2 * m * block + m + p, -1.0)):
                kinds[j] = OBJECTIVE if block == 0 else SOFT
                values[j] = 0.0 if block == 0 else 1.0 - margin[p] / task.max_deviation
                for k in range(UNKNOWNS):
                    slopes[k, j] = sign * curve_slopes[k, p] / (1.0 if block == 0 else task.max_deviation)
    by_unknowns(ALONG, motion, zeros, curve_slopes)
    curve(ANGLE, motion, zeros, margin, angle)
    high, low, least = 0, 0, 0.0
    for p in range(m):
        high, low = p if angle[p] > angle[high] else high, p if angle[p] < angle[low] else low
    for k in range(UNKNOWNS):
        slopes[k, 4 * m] = (curve_slopes[k, high] - curve_slopes[k, low]) / task.min_stroke
    values[4 * m] = -1.0 - margin[m] / task.min_stroke
    for j in range(len(task.lengths)):
        least = max(least, task.shortest[j] / row[task.lengths[j]])
    for _ in range(DIRECTIONS):
        for k in range(UNKNOWNS):
            x[k] = 0.0
        if not best_unknowns(values, slopes, kinds, size, task.unit, EXCESS * task.min_stroke, x):
            return False
        scale = math.sqrt(x[0] * x[0] + x[1] * x[1])
        if not 0.0 < scale < (1.0 - 1e-6) * least:
            break
        kinds[4 * m + 1], values[4 * m + 1] = REQUIRED, -1.0
        slopes[0, 4 * m + 1], slopes[1, 4 * m + 1] = x[0] / (scale * least), x[1] / (scale * least)
    return bool(x[0] * x[0] + x[1] * x[1] > SMALLEST * SMALLEST)
