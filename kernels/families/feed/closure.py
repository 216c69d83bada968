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
from kernels.arithmetic.complex_step import arctan2, hypotenuse, unit_near
from kernels.jit import inline
from kernels.linkage.verdict import follower_status, pose_status
from kernels.types import EPS, Array


class Rocker(NamedTuple):
    """The four-bar of the horizontal chain in scaled lengths, spatial or planar."""

    a: Any
    c: Any
    e: Any
    y0: Any  # Y = y0 + a ca v,  Z = z0 + a sa v
    z0: Any
    ca: Any
    sa: Any
    links: Any  # (c - b)(c + b)
    reach: float  # |e| + a and so on: sums of the magnitudes whose rounding errors make up X, Y, Z
    y_reach: float
    z_reach: float
    sigma: float


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``."""

    rocker: Rocker
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


# A driven point with its first two derivatives by phi, or a driven angle with its sine and cosine.
Driven = namedtuple("Driven", "x y x1 y1 x2 y2")


@inline
def reduce_design(designs: Array, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for zero or negative lengths and for numbers that are not finite."""
    unit, per_unit = unit_near(designs[i, 13])
    a, b, c, e = designs[i, 0] * per_unit, designs[i, 1] * per_unit, designs[i, 2] * per_unit, designs[i, 3] * per_unit
    f, g, alpha = designs[i, 4] * per_unit, designs[i, 5] * per_unit, designs[i, 6]
    sa, ca = np.sin(alpha), np.cos(alpha)
    rocker = Rocker(
        a, c, e, f * sa, g - f * ca, ca, sa, (c - b) * (c + b), abs(e.real) + a.real, abs(f.real) + a.real,
        abs(g.real) + abs(f.real) + a.real, designs[i, 21].real,
    )  # fmt: skip
    arm, dh, de = designs[i, 7] * per_unit, designs[i, 8], designs[i, 12]
    fx, fy = designs[i, 14] * per_unit, designs[i, 15] * per_unit
    tx = (designs[i, 16] + designs[i, 18] * designs[i, 19]) * per_unit
    ty, plate, q = designs[i, 17] * per_unit, designs[i, 20] * per_unit, designs[i, 13] * per_unit
    x_ecc, y_ecc, r_ecc = designs[i, 9] * per_unit, designs[i, 10] * per_unit, designs[i, 11] * per_unit
    valid = a.real > 0.0 and b.real > 0.0 and c.real > 0.0 and q.real > 0.0
    size = rocker.reach + rocker.z_reach + c.real + b.real
    size += abs(arm.real) + abs(x_ecc.real) + abs(y_ecc.real) + abs(r_ecc.real)
    size += abs(fx.real) + abs(fy.real) + abs(tx.real) + abs(ty.real) + abs(plate.real) + q.real
    valid = valid and size < 1e140 and abs(alpha.real) < 1e5 and abs(dh.real) < 1e5 and abs(de.real) < 1e5
    branch = designs[i, 22].real
    valid = valid and rocker.sigma * rocker.sigma == 1.0 and branch * branch == 1.0
    return Reduced(
        rocker, arm, np.cos(dh), np.sin(dh), dh, x_ecc, y_ecc, r_ecc, np.cos(de), np.sin(de), q, fx, fy, tx, ty, plate,
        branch, unit, valid,
    )  # fmt: skip


@inline
def rocker_angle(r: Rocker, u: Any, v: Any) -> tuple[Any, Any, Any, Any, int]:
    """Cosine and sine of the rocker's angle, its first two derivatives by phi, and the status; (1)-(3)."""
    x, y, z = r.e - r.a * u, r.y0 + r.a * (r.ca * v), r.z0 + r.a * (r.sa * v)
    w = 0.5 * (r.links + (x * x + y * y + z * z)) / r.c
    rr = x * x + y * y
    delta = rr - w * w
    band = 8.0 * EPS
    # Rounding errors of X, Y, Z enter W as X/c times theirs.
    w_size = 0.5 * (abs(r.links.real) + (x * x + y * y + z * z).real) / r.c.real
    w_size += (abs(x.real) * r.reach + abs(y.real) * r.y_reach + abs(z.real) * r.z_reach) / r.c.real
    tolerance = band * (abs(x.real) * r.reach + abs(y.real) * r.y_reach + abs(w.real) * w_size)
    tolerance += band * band * (r.reach * r.reach + r.y_reach * r.y_reach + w_size * w_size)
    code = pose_status(True, delta.real, tolerance, rr.real)
    t = r.sigma * (np.sqrt(delta) if code == st.OK else 0.0 * delta)
    per_rr = 1.0 / rr if code in (st.OK, st.DEAD_POINT) else math.nan * rr
    cos, sin = -(x * w + y * t) * per_rr, (y * w - x * t) * per_rr
    per_t = 1.0 / t if code == st.OK else math.nan * t
    x1, y1, z1 = r.a * v, r.a * (r.ca * u), r.a * (r.sa * u)
    x2, y2, z2 = r.a * u, -(r.a * (r.ca * v)), -(r.a * (r.sa * v))
    one = -(x1 * cos - y1 * sin + (x * x1 + y * y1 + z * z1) / r.c) * per_t
    bend = (x1 * x1 + y1 * y1 + z1 * z1 + x * x2 + y * y2 + z * z2) / r.c
    two = -(x2 * cos - y2 * sin + bend - 2.0 * one * (x1 * sin + y1 * cos) + one * one * w) * per_t
    return cos, sin, one, two, code


@inline
def rocker_pin(r: Reduced, cos: Any, sin: Any, one: Any, two: Any) -> Driven:
    """Pin H of the rocker's arm; (4)."""
    x, y = r.arm * (cos * r.cos_arm - sin * r.sin_arm), r.arm * (sin * r.cos_arm + cos * r.sin_arm)
    return Driven(r.rocker.e + x, y, -(one * y), one * x, -(two * y) - one * one * x, two * x - one * one * y)


@inline
def eccentric(x0: Any, y0: Any, radius: Any, cos: Any, sin: Any, u: Any, v: Any) -> Driven:
    """Centre of an eccentric that stands ahead of the crank by the angle with that cosine and sine; (5)."""
    x, y = radius * (u * cos - v * sin), radius * (v * cos + u * sin)
    return Driven(x0 + x, y0 + y, -y, x, -x, -y)


@inline
def bar_angle(r: Reduced, h: Driven, e: Driven) -> tuple[Any, Any, Any, Any, int]:
    """Cosine and sine of the rack's angle chi, its first two derivatives by phi, and the status; (6)-(8)."""
    wx, wy = h.x - e.x, h.y - e.y
    w, f = hypotenuse(wx, wy), hypotenuse(r.fx, r.fy)
    # Heron's product: the triangle of H, E, F without squares of its sides
    product = ((w + f) - r.q) * ((w + f) + r.q) * (r.q - (w - f)) * (r.q + (w - f))
    size = w.real + f.real + r.q.real
    code = follower_status(True, not (w.real > 0.0 and f.real > 0.0), product.real, 16.0 * EPS * size**4)
    root = r.bar_branch * (np.sqrt(product) if code == st.OK else 0.0 * product)
    a1, a2 = 2.0 * (wx * r.fx + wy * r.fy), 2.0 * (wy * r.fx - wx * r.fy)
    a3 = r.q * r.q - f * f - w * w
    per_rr = 1.0 / (4.0 * (w * f) * (w * f)) if code in (st.OK, st.DEAD_POINT) else math.nan * w
    cos, sin = (a1 * a3 - a2 * root) * per_rr, (a2 * a3 + a1 * root) * per_rr
    gx, gy = cos * r.fx - sin * r.fy, sin * r.fx + cos * r.fy
    vx, vy = wx + gx, wy + gy
    per_turn = -2.0 / root if code == st.OK else math.nan * root  # w.(i g) = -root/2
    x1, y1, x2, y2 = h.x1 - e.x1, h.y1 - e.y1, h.x2 - e.x2, h.y2 - e.y2
    one = -(vx * x1 + vy * y1) * per_turn
    sx, sy = x1 - one * gy, y1 + one * gx
    two = -(sx * sx + sy * sy + vx * x2 + vy * y2 - one * one * (vx * gx + vy * gy)) * per_turn
    return cos, sin, one, two, code


@inline
def point_of_rack(h: Driven, cos: Any, sin: Any, one: Any, two: Any, x: Any, y: Any) -> Driven:
    """Return a point fixed to the rack at (x, y) from H, with its derivatives; (9)."""
    gx, gy = cos * x - sin * y, sin * x + cos * y
    return Driven(
        h.x + gx, h.y + gy, h.x1 - one * gy, h.y1 + one * gx,
        h.x2 - two * gy - one * one * gx, h.y2 + two * gx - one * one * gy,
    )  # fmt: skip


@inline
def angle_of(cos: Any, sin: Any) -> Any:
    """Angle of a direction, in (-pi, pi]."""
    return arctan2(sin, cos)
