"""Motion of the rack over the crank angle, and entry and leaving of a tooth as events; (3)-(14) of docs/feed.md."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2
from kernels.curves.root_search import false_position
from kernels.families.feed.closure import (
    Driven,
    Reduced,
    Turned,
    bar_angle,
    carried,
    eccentric,
    reduce_design,
    rocker_pin,
)
from kernels.jit import inline, kernel
from kernels.linkage.driven_ball import Swung
from kernels.types import TWO_PI, Array, Status


@inline
def rack_at(r: Reduced, u: Any, v: Any) -> tuple[Swung, Turned, Driven, Driven, int]:
    """Rocker and rack, pins H and E, and the status of the pose."""
    rocker, h = rocker_pin(r.rocker, r.arm, r.cos_arm, r.sin_arm, u, v)
    e = eccentric(r.x_ecc, r.y_ecc, r.r_ecc, r.cos_ecc, r.sin_ecc, u, v)
    bar = bar_angle(r, h, e)
    code = rocker.status if r.valid else st.INVALID_INPUT
    # The rocker's status comes first, but its dead point still has a position: a rack that has none is worse.
    if code == st.OK or (code == st.DEAD_POINT and bar.status in (st.NOT_ASSEMBLED, st.SINGULAR)):
        code = bar.status
    return rocker, bar, h, e, code


@inline
def tooth_at(r: Reduced, u: Any, v: Any) -> tuple[Driven, int]:
    """Path of the tooth and the status of the pose."""
    _, bar, h, _, code = rack_at(r, u, v)
    return carried(h, bar, r.tx, r.ty), code


@kernel
def poses(designs: Array, cos_phi: Array, sin_phi: Array, status: Status, outputs: Array) -> None:
    """Compute angles of rocker and rack, points of the rack and path of the tooth; (1)-(9) of docs/feed.md.

    Parameters
    ----------
    designs : (n, 23) columns as `PARAMETERS` of sweep/families/feed.py
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR or INVALID_INPUT, of the rocker or of the rack
    outputs : (18, n, m) out in the order of `POSE_OUTPUTS` of sweep/families/feed.py [rad, length]

    Notes
    -----
    Where the status is not OK the values are nan, except that a dead point keeps its position.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            rocker, bar, h, e, code = rack_at(r, u, v)
            status[i, j] = code
            room = 1.0 if code == st.OK or code == st.DEAD_POINT else math.nan
            scale = r.unit * room
            f, t = carried(h, bar, r.fx, r.fy), carried(h, bar, r.tx, r.ty)
            values = (
                (arctan2(rocker.sin, rocker.cos) + r.dh) * room, rocker.first * room, rocker.second * room,
                arctan2(bar.sin, bar.cos) * room, bar.first * room, bar.second * room,
                h.x * scale, h.y * scale, e.x * scale, e.y * scale, f.x * scale, f.y * scale,
                t.x * scale, t.y * scale, t.x1 * scale, t.y1 * scale, t.x2 * scale, t.y2 * scale,
            )  # fmt: skip
            for k in range(18):
                outputs[k, i, j] = values[k]


@kernel
def lift_rows(designs: Array, cos_phi: Array, sin_phi: Array, chi: Array, status: Status, rows: Array) -> None:
    """Compute the weighted difference as a linear form of the lift coupler's dimensions; (10) of docs/feed.md.

    |F - E|^2 - q^2 = rows[0] fx + rows[1] fy + rows[2] - p0 with p0 = q^2 - fx^2 - fy^2.

    Parameters
    ----------
    designs : (n, 23) columns as `PARAMETERS` of sweep/families/feed.py; q sets the scale only, fx, fy are not used
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    chi : (n, m) prescribed angles of the rack [rad]
    status : (n, m) out, of the rocker alone;  rows : (5, n, m) out [length, length, length^2] and the pin H (x, y)
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            rocker, h = rocker_pin(r.rocker, r.arm, r.cos_arm, r.sin_arm, u, v)
            status[i, j] = rocker.status if r.valid else st.INVALID_INPUT
            e = eccentric(r.x_ecc, r.y_ecc, r.r_ecc, r.cos_ecc, r.sin_ecc, u, v)
            wx, wy = h.x - e.x, h.y - e.y
            x, y = math.cos(chi[i, j]), math.sin(chi[i, j])
            assembled = status[i, j] == st.OK or status[i, j] == st.DEAD_POINT
            unit = r.unit if assembled else math.nan
            rows[0, i, j], rows[1, i, j] = 2.0 * (wx * x + wy * y) * unit, 2.0 * (wy * x - wx * y) * unit
            # one factor after the other: the square of the unit leaves float64 before the length^2 does
            rows[2, i, j] = ((wx * wx + wy * wy) * unit) * unit
            rows[3, i, j], rows[4, i, j] = h.x * unit, h.y * unit


SAMPLES = 256
_PANELS, _MOST_PANELS = 16, 4096
_AREA_SETTLED = 1e-10  # relative change by halved panels, below which the error of 8 points per panel is rounding
# Gauss-Legendre, 8 points: abscissae and weights of the positive half
_NODES = (0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363)
_WEIGHTS = (0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763)


@inline
def _height(phi: float, r: Reduced, order: int) -> float:
    """Height of the tooth above the plate (order 0), or its first derivative by phi (order 1)."""
    tooth, _ = tooth_at(r, math.cos(phi), math.sin(phi))
    value: float = tooth.y - r.plate if order == 0 else tooth.y1
    return value


@inline
def _area(r: Reduced, entry: float, leave: float, panels: int) -> float:
    """Area under the path between two crank angles, by Gauss's rule on ``panels`` panels."""
    area, width = 0.0, (leave - entry) / panels
    for k in range(panels):
        middle = entry + (k + 0.5) * width
        for n in range(4):
            for side in (-1.0, 1.0):
                phi = middle + side * 0.5 * width * _NODES[n]
                tooth, _ = tooth_at(r, math.cos(phi), math.sin(phi))
                area += 0.5 * width * _WEIGHTS[n] * (tooth.y - r.plate) * tooth.x1
    return area


@inline
def _between(r: Reduced, entry: float, leave: float) -> tuple[float, float, float]:
    """Greatest height between two crank angles, area under the path, and the area's change by the last refinement."""
    rise, panels, area, change = 0.0, _PANELS, _area(r, entry, leave, _PANELS), math.inf
    while change > _AREA_SETTLED * abs(area) and panels < _MOST_PANELS:
        panels *= 2
        finer = _area(r, entry, leave, panels)
        area, change = finer, abs(finer - area)
    # the top is where the slope falls through zero: exact, where the largest of the samples would lie below it
    before, f_before = entry, _height(entry, r, 1)
    steps = 4 * _PANELS
    for k in range(1, steps + 1):
        phi = entry + (leave - entry) * (k / steps)
        f = _height(phi, r, 1)
        # equality on one side alone: a top that falls on a step is found once
        if f_before > 0.0 >= f:
            top = false_position(_height, before, phi, f_before, f, r, 1) if f < 0.0 else phi
            rise = max(rise, _height(top, r, 0))
        before, f_before = phi, f
    return rise, area, change


@kernel
def feeding(designs: Array, status: Status, outputs: Array) -> None:
    """Compute the entry and leaving of the tooth, its speed there, stitch length, rise and flatness of every design.

    Equations (11)-(14) of docs/feed.md.  If the tooth is above the plate several times, the longest counts.

    Parameters
    ----------
    designs : (n, 23) columns as `PARAMETERS` of sweep/families/feed.py
    status : (n,) out; OK, NO_EVENT (the tooth never passes the plate), or the status of the first pose that is not OK
    outputs : (10, n) out in the order of `FEEDING_OUTPUTS` of sweep/families/feed.py [rad, length, length per rad],
        then the error of the flatness; nan where the status is not OK

    Notes
    -----
    Times above or below the plate that are shorter than 1/256 of a turn may be missed.
    """
    heights = np.empty(SAMPLES)
    step = TWO_PI / SAMPLES
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        for k in range(outputs.shape[0]):
            outputs[k, i] = math.nan
        worst = st.OK if r.valid else st.INVALID_INPUT
        for j in range(SAMPLES):
            tooth, code = tooth_at(r, math.cos(j * step), math.sin(j * step))
            heights[j] = tooth.y - r.plate
            if worst == st.OK and code != st.OK:
                worst = code
        status[i] = worst
        if worst != st.OK:
            continue
        crossings, entry, leave = 0, 0.0, 0.0
        for j in range(SAMPLES):
            after = heights[(j + 1) % SAMPLES]
            if (heights[j] > 0.0) != (after > 0.0):
                crossings += 1
            if heights[j] <= 0.0 < after:
                # around the seam of the turn: a stay may begin before phi = 2 pi and end after it
                last = j + 1
                while heights[(last + 1) % SAMPLES] > 0.0:
                    last += 1
                low, high = heights[last % SAMPLES], heights[(last + 1) % SAMPLES]
                begin = false_position(_height, j * step, (j + 1) * step, heights[j], after, r, 0)
                end = false_position(_height, last * step, (last + 1) * step, low, high, r, 0)
                # the longer one of two stays may have fewer samples: the angles decide
                if end - begin > leave - entry:
                    entry, leave = begin, end
        outputs[8, i] = crossings
        if crossings == 0:
            status[i] = st.NO_EVENT
            continue
        one, _ = tooth_at(r, math.cos(entry), math.sin(entry))
        two, _ = tooth_at(r, math.cos(leave), math.sin(leave))
        rise, area, change = _between(r, entry, leave)
        stitch = two.x - one.x
        outputs[0, i], outputs[1, i], outputs[2, i] = entry % TWO_PI, leave % TWO_PI, leave - entry
        outputs[3, i], outputs[4, i], outputs[5, i] = one.y1 * r.unit, two.y1 * r.unit, stitch * r.unit
        outputs[6, i], outputs[7, i] = rise * r.unit, area / (rise * stitch)
        outputs[9, i] = change / abs(rise * stitch)
