"""Rows of pressure angle and objective, at the crank angles where the design at the centre of a box has its peaks."""

from __future__ import annotations

import math

from kernels.arithmetic.sincos import sincos
from kernels.boxes.branching import Flags
from kernels.boxes.tape import run
from kernels.families.rssr import box_turn as bt
from kernels.families.rssr.box_problem import (
    ABOVE,
    BELOW,
    PRESSURE,
    BoxQuestion,
    BoxScratch,
    angle_inputs,
    middle,
    take,
)
from kernels.families.rssr.box_turn import Formulas
from kernels.jit import inline, kernel
from kernels.types import Array

POSES = 48  # of the centre design, to find the peaks
PEAKS, NECKS = 6, 3  # most rows of the objective and of the pressure angle
STEP = 2.0 * math.pi / POSES


@kernel
def _centre_curve(p: BoxQuestion, f: Formulas, at: Array, height: Array, neck: Array) -> None:
    """Compute objective with sign and Delta/b^2 of the centre design at POSES crank angles, to choose the rows."""
    place = f.slots[bt.CENTRES :]
    a, e, fs, aca = middle(at, place[0]), middle(at, place[1]), middle(at, place[2]), middle(at, place[3])
    k0, k1, k2, b2 = middle(at, place[4]), middle(at, place[5]), middle(at, place[6]), middle(at, place[7])
    u1, v1 = middle(at, place[8]), middle(at, place[9])
    for i in range(POSES):
        s, c = sincos(i * STEP)
        u, v = u1 * c - v1 * s, v1 * c + u1 * s
        x, y, w = e - a * u, fs + aca * v, k0 + k1 * v - k2 * u
        r = x * x + y * y
        delta = r - w * w
        neck[i], height[i] = delta / b2, 0.0
        if p.order == 0:
            height[i] = 1.0 - neck[i]
        elif delta > 0.0:
            t = p.branch * math.sqrt(delta)
            cos, sin = -(x * w + y * t) / r, (y * w - x * t) / r
            first = -(a * v * cos - aca * u * sin + k1 * u + k2 * v) / t
            second = a * u * cos + aca * v * sin - k1 * v + k2 * u
            second = -(second + first * (-2.0 * (a * v * sin + aca * u * cos) + w * first)) / t
            height[i] = second if p.order == 2 else first


@inline
def _summit(below: float, here: float, above: float) -> float:
    """Place of the summit of a parabola through three values one apart, counted from the middle one."""
    bend = below - 2.0 * here + above
    return 0.5 * (below - above) / bend if bend < 0.0 else 0.0


@inline
def _next_peak(height: Array, sign: float, used: Flags) -> int:
    """Find the highest local maximum of sign * height not used yet; -1 where there is none."""
    found = -1
    for i in range(POSES):
        here = sign * height[i]
        peak = here > sign * height[i - 1] and here >= sign * height[(i + 1) % POSES]
        if peak and used[i] == 0 and (found < 0 or here > sign * height[found]):
            found = i
    if found >= 0:
        used[found] = 1
    return found


@inline
def _place_of(height: Array, sign: float, i: int) -> float:
    below, here, above = sign * height[i - 1], sign * height[i], sign * height[(i + 1) % POSES]
    return STEP * (i + _summit(below, here, above))


@inline
def _at_angle(f: Formulas, rows: BoxScratch, theta: float) -> None:
    """Compute the closure at a crank angle after the extended position."""
    angle_inputs(rows.at, bt.COS_THETA, theta)
    run(f.operations, f.factors, f.ends, bt.CLOSURE, rows.at, rows.ones.shape[0])


@kernel
def peak_rows(
    p: BoxQuestion, f: Formulas, rows: BoxScratch, count: int, height: Array, neck: Array, used: Flags
) -> int:
    """Add rows of pressure angle and objective at the peaks of the centre design; return the number of rows."""
    _centre_curve(p, f, rows.at, height, neck)
    used[:] = 0
    for _ in range(NECKS):
        i = _next_peak(neck, -1.0, used)
        if i >= 0:
            theta = _place_of(neck, -1.0, i)
            _at_angle(f, rows, theta)
            count = take(rows, count, f.slots[bt.PRESSURE], PRESSURE, theta, 1.0)
    used[:] = 0
    part = bt.MOTION if p.order > 0 else bt.ANGLE
    form = f.slots[bt.SIN2 + p.order]
    for k in range(PEAKS):
        sign = 1.0 if k < PEAKS // 2 or p.order == 0 else -1.0
        if k == PEAKS // 2 and p.order > 0:
            used[:] = 0
        i = _next_peak(height, sign, used)
        if i >= 0 and sign * height[i] > 0.0:
            theta = _place_of(height, sign, i)
            _at_angle(f, rows, theta)
            if run(f.operations, f.factors, f.ends, part, rows.at, rows.ones.shape[0]):
                count = take(rows, count, form, ABOVE if sign > 0.0 else BELOW, theta, sign)
    return count
