"""Both chains of the feed mechanism: the rocker that drives the rack along, the eccentric that lifts it.

Equations (1)-(8) of docs/feed.md.  Lengths are divided by a power of two near the lift coupler, so no scale of the
drawing costs a bit.  Designs may be complex128 (exact gradients by the complex step).
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import hypotenuse, unit_near
from kernels.jit import inline
from kernels.linkage.driven_ball import Crank, Swung, pin_path, reduce_crank, swing
from kernels.linkage.verdict import follower_status
from kernels.types import EPS, Array


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``."""

    rocker: Crank  # drive of the horizontal chain, spatial or planar
    arm: Any
    cos_arm: Any
    sin_arm: Any
    dh: Any
    x_ecc: Any
    y_ecc: Any
    r_ecc: Any
    cos_ecc: Any
    sin_ecc: Any
    q: Any
    fx: Any
    fy: Any
    tx: Any
    ty: Any
    plate: Any
    bar_branch: float
    unit: float
    valid: bool


# A driven point with its first two derivatives by phi; the angle of a driven link, with the names of `Swung`.
Driven = namedtuple("Driven", "x y x1 y1 x2 y2")
Turned = namedtuple("Turned", "cos sin first second status")


@inline
def reduce_design(designs: Array, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for zero or negative lengths and for numbers that are not finite."""
    unit, per_unit = unit_near(designs[i, 13])
    rocker = reduce_crank(designs[i], per_unit, designs[i, 21].real)
    arm, dh, de = designs[i, 7] * per_unit, designs[i, 8], designs[i, 12]
    fx, fy = designs[i, 14] * per_unit, designs[i, 15] * per_unit
    tx = (designs[i, 16] + designs[i, 18] * designs[i, 19]) * per_unit
    ty, plate, q = designs[i, 17] * per_unit, designs[i, 20] * per_unit, designs[i, 13] * per_unit
    x_ecc, y_ecc, r_ecc = designs[i, 9] * per_unit, designs[i, 10] * per_unit, designs[i, 11] * per_unit
    size = abs(arm.real) + abs(x_ecc.real) + abs(y_ecc.real) + abs(r_ecc.real)
    size += abs(fx.real) + abs(fy.real) + abs(tx.real) + abs(ty.real) + abs(plate.real) + q.real
    valid = rocker.valid and q.real > 0.0 and size < 1e140 and abs(dh.real) < 1e5 and abs(de.real) < 1e5
    branch = designs[i, 22].real
    valid = valid and branch * branch == 1.0
    return Reduced(
        rocker, arm, np.cos(dh), np.sin(dh), dh, x_ecc, y_ecc, r_ecc, np.cos(de), np.sin(de), q, fx, fy, tx, ty, plate,
        branch, unit, valid,
    )  # fmt: skip


@inline
def rocker_pin(r: Crank, arm: Any, cos_arm: Any, sin_arm: Any, u: Any, v: Any) -> tuple[Swung, Driven]:
    """Angle of the rocker, (1)-(3), and pin H of its arm, (4)."""
    turn = swing(pin_path(r, u, v), r.size, r.b, r.c, r.branch)
    foot = Driven(r.e, 0.0 * r.e, 0.0 * r.e, 0.0 * r.e, 0.0 * r.e, 0.0 * r.e)
    return turn, carried(foot, turn, arm * cos_arm, arm * sin_arm)


@inline
def eccentric(x0: Any, y0: Any, radius: Any, cos: Any, sin: Any, u: Any, v: Any) -> Driven:
    """Centre of an eccentric that stands ahead of the crank by the angle with that cosine and sine; (5)."""
    x, y = radius * (u * cos - v * sin), radius * (v * cos + u * sin)
    return Driven(x0 + x, y0 + y, -y, x, -x, -y)


@inline
def bar_angle(r: Reduced, h: Driven, e: Driven) -> Turned:
    """Rack's angle chi; (6)-(8)."""
    wx, wy = h.x - e.x, h.y - e.y
    w, f = hypotenuse(wx, wy), hypotenuse(r.fx, r.fy)
    # Heron's product: the triangle of H, E, F without squares of its sides
    product = ((w + f) - r.q) * ((w + f) + r.q) * (r.q - (w - f)) * (r.q + (w - f))
    size = w.real + f.real + r.q.real
    code = follower_status(True, not (w.real > 0.0 and f.real > 0.0), product.real, 16.0 * EPS * size**4)
    root = r.bar_branch * (np.sqrt(product) if code == st.OK else 0.0 * product)
    a1, a2 = 2.0 * (wx * r.fx + wy * r.fy), 2.0 * (wy * r.fx - wx * r.fy)
    # q^2 - |f|^2 - |w|^2 without the square of the longer one, which may be all but that of q
    longer, shorter = (w, f) if w.real > f.real else (f, w)
    a3 = (r.q - longer) * (r.q + longer) - shorter * shorter
    per_rr = 1.0 / (4.0 * (w * f) * (w * f)) if code in (st.OK, st.DEAD_POINT) else math.nan * w
    cos, sin = (a1 * a3 - a2 * root) * per_rr, (a2 * a3 + a1 * root) * per_rr
    gx, gy = cos * r.fx - sin * r.fy, sin * r.fx + cos * r.fy
    vx, vy = wx + gx, wy + gy
    per_turn = -2.0 / root if code == st.OK else math.nan * root  # w.(i g) = -root/2
    x1, y1, x2, y2 = h.x1 - e.x1, h.y1 - e.y1, h.x2 - e.x2, h.y2 - e.y2
    one = -(vx * x1 + vy * y1) * per_turn
    sx, sy = x1 - one * gy, y1 + one * gx
    two = -(sx * sx + sy * sy + vx * x2 + vy * y2 - one * one * (vx * gx + vy * gy)) * per_turn
    return Turned(cos, sin, one, two, code)


@inline
def carried(at: Driven, turn: Any, x: Any, y: Any) -> Driven:
    """Return the point of a link at (x, y) from its point ``at``, with its derivatives; (9)."""
    one, two = turn.first, turn.second
    gx, gy = turn.cos * x - turn.sin * y, turn.sin * x + turn.cos * y
    return Driven(
        at.x + gx, at.y + gy, at.x1 - one * gy, at.y1 + one * gx,
        at.x2 - two * gy - one * one * gx, at.y2 + two * gx - one * one * gy,
    )  # fmt: skip
