"""A ball on a rocker, driven through a coupler by a ball that moves in any known way, to the third derivative.

The frame is the rocker's: its axis is z, its ball moves on the circle C = c (cos psi, sin psi, 0).  The driving ball M
has the coordinates (x, y, z), and the coupler's length b is the distance of M and C.  A crank may carry M, or a link
that itself moves.  The families of the loopers and of the feed work from this.

They have the same drive, a crank about an inclined axis, a coupler and a rocker about z: X runs along the
common perpendicular from the crank's axis to the rocker's, Z along the rocker's axis; the crank's axis is
(0, sin alpha, cos alpha), as for the spatial crank-rocker (docs/rssr.md).
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np

from kernels import status as st
from kernels.arithmetic.vectors import Vector, dot
from kernels.jit import inline
from kernels.linkage.verdict import pose_status
from kernels.types import EPS

Path: TypeAlias = tuple[Vector, Vector, Vector, Vector]  # a place and its three derivatives


class Swung(NamedTuple):
    """Angle of the rocker by cosine and sine, and its derivatives; ``delta`` = r^2 - w^2 in squared lengths."""

    status: int
    cos: Any
    sin: Any
    root: Any  # sqrt(delta) with the sign of the branch: coupler times cosine of the pressure angle
    across: Any  # square of the coupler's part that does no work
    delta: Any
    first: Any
    second: Any
    third: Any


@inline
def long_rocker(b: Any, c: Any, z: Any, rr: Any, size: float) -> tuple[Any, Any, float]:
    """R^2 - W^2, c - W and the rounding error of the first, of a rocker at least twice as long as its coupler.

    R^2 = rr is the squared distance of the driving ball from the rocker's axis, W = (c^2 + R^2 + z^2 - b^2)/(2 c), and
    ``size`` is the sum of the magnitudes whose rounding errors make up the ball's place.  R, W and c are alike but for
    the coupler, so they are not subtracted as they are: with p = R - c and l = b^2 - z^2 - p^2, c - W = l/(2 c) - p and
    R^2 - W^2 = l ((R + c - b)(R + c + b) + z^2)/(4 c^2).
    """
    reach = np.sqrt(rr)
    past, far, t = reach - c, reach + c, 8.0 * EPS
    left = (b - z) * (b + z) - past * past
    error = b.real * b.real + (abs(past.real) + abs(z.real)) * (size + c.real) + t * size * size
    return left * ((far - b) * (far + b) + z * z) / (4.0 * c * c), 0.5 * left / c - past, t * error


@inline
def swing(path: Path, size: float, b: Any, c: Any, branch: float) -> Swung:
    """Angle of the rocker for one place of the driving ball.

    Parameters
    ----------
    path : the driving ball in the rocker's frame, with its derivatives; lengths near 1
    size : sum of the magnitudes whose rounding errors make up its coordinates
    b, c : coupler and rocker;  branch : sign of d(|CM|^2)/dpsi, +1 or -1

    Returns
    -------
    Swung
        status OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR (the driving ball lies on the rocker's axis, or the rocker has no
        length) or INVALID_INPUT.  At a dead point the angle is given and the derivatives are nan; where there is no
        angle all but delta is nan.
    """
    m, m1, m2, m3 = path
    x, y, z = m
    w = 0.5 * ((c - b) * (c + b) + dot(m, m)) / c
    rr = x * x + y * y
    delta = rr - w * w
    w_size = 0.5 * (abs(((c - b) * (c + b)).real) + size * size) / c.real
    t = 8.0 * EPS
    tolerance = t * ((abs(x.real) + abs(y.real)) * size + abs(w.real) * w_size) + t * t * (
        2.0 * size * size + w_size * w_size
    )
    inward = c - w  # d.k of the vector d from M to C, as d.tau is the root
    if 2.0 * b.real < c.real:
        delta, inward, tolerance = long_rocker(b, c, z, rr, size)
        w = c - inward
    # a rocker without length has no direction
    code = st.SINGULAR if c.real == 0.0 else pose_status(True, delta.real, tolerance, rr.real)
    moving = code == st.OK
    has_angle = moving or code == st.DEAD_POINT
    root = branch * np.sqrt(delta) if moving else 0.0 * delta
    per_rr = 1.0 / rr if has_angle else np.nan * rr
    cos, sin = (x * w - y * root) * per_rr, (y * w + x * root) * per_rr
    across = inward * inward + z * z if has_angle else np.nan * rr
    # d.d = b^2 gives d.d' = 0, d.d'' = -d'.d', d.d''' = -3 d'.d''
    d = (c * cos - x, c * sin - y, -z)
    if 2.0 * b.real < c.real:
        d = (inward * cos - root * sin, inward * sin + root * cos, -z)
    per = 1.0 / (c * root) if moving else np.nan * rr
    p = dot(d, m1) * per
    turn = c * p
    d1 = (-turn * sin - m1[0], turn * cos - m1[1], -m1[2])
    q = (dot(d, m2) - dot(d1, d1) + turn * p * inward) * per
    swing2, centre = c * q, turn * p
    d2 = (-swing2 * sin - centre * cos - m2[0], swing2 * cos - centre * sin - m2[1], -m2[2])
    j = (dot(d, m3) - 3.0 * dot(d1, d2) + 3.0 * turn * q * inward) * per + p * p * p
    return Swung(code, cos, sin, root, across, delta, p, q, j)


@inline
def rotated(cos: Any, sin: Any, p: Any, q: Any, j: Any, path: Path) -> Path:
    """Return a moving point turned about z by an angle that moves too: the product rule, to the third derivative.

    Parameters
    ----------
    cos, sin : of the angle;  p, q, j : its three derivatives
    path : the point before the turn, with its derivatives
    """
    m, m1, m2, m3 = path
    # derivatives of exp(i angle) are (a_k + i b_k) exp(i angle)
    a2, a3, b3 = -p * p, -3.0 * p * q, j - p * p * p
    x0, y0 = m[0], m[1]
    x1, y1 = m1[0] - p * m[1], m1[1] + p * m[0]
    x2 = m2[0] - 2.0 * p * m1[1] + a2 * m[0] - q * m[1]
    y2 = m2[1] + 2.0 * p * m1[0] + a2 * m[1] + q * m[0]
    x3 = m3[0] - 3.0 * p * m2[1] + 3.0 * (a2 * m1[0] - q * m1[1]) + a3 * m[0] - b3 * m[1]
    y3 = m3[1] + 3.0 * p * m2[0] + 3.0 * (a2 * m1[1] + q * m1[0]) + a3 * m[1] + b3 * m[0]
    return (
        (cos * x0 - sin * y0, sin * x0 + cos * y0, m[2]),
        (cos * x1 - sin * y1, sin * x1 + cos * y1, m1[2]),
        (cos * x2 - sin * y2, sin * x2 + cos * y2, m2[2]),
        (cos * x3 - sin * y3, sin * x3 + cos * y3, m3[2]),
    )


class Crank(NamedTuple):
    """Constants of one design; the crank pin is at (a cos phi, y0 + a ca sin phi, lift - a sa sin phi)."""

    a: float
    b: float
    c: float
    e: float
    sa: float
    ca: float
    y0: float
    lift: float
    g: float
    branch: float
    size: float  # sum of the magnitudes whose rounding errors make up the pin's place from the rocker's foot
    valid: bool


@inline
def reduce_crank(d: Any, per: float, branch: float) -> Crank:
    """Constants from the first seven columns of a design, a b c e f g alpha; ``per`` scales its lengths."""
    a, b, c, e, f, g = d[0] * per, d[1] * per, d[2] * per, d[3] * per, d[4] * per, d[5] * per
    sa, ca = np.sin(d[6]), np.cos(d[6])
    size = a.real + abs(e.real) + abs(f.real) + abs(g.real)
    valid = a.real > 0.0 and 0.0 < b.real < 1e140 and 0.0 < c.real < 1e140 and size < 1e140
    valid = valid and abs(d[6].real) < 1e5 and branch * branch == 1.0
    return Crank(a, b, c, e, sa, ca, f * sa, f * ca, g, branch, size, valid)


@inline
def crank_pin(r: Crank, u: Any, v: Any) -> Vector:
    """Crank pin in the frame at (cos phi, sin phi) = (u, v)."""
    return r.a * u, r.y0 + r.a * (r.ca * v), r.lift - r.a * (r.sa * v)


@inline
def pin_path(r: Crank, u: Any, v: Any) -> Path:
    """Crank pin from the foot of the rocker, (e, 0, g), with its derivatives, at (cos phi, sin phi) = (u, v)."""
    hu, hv, tu, tv = r.a * (r.ca * u), r.a * (r.ca * v), r.a * (r.sa * u), r.a * (r.sa * v)
    pin = (r.a * u - r.e, r.y0 + hv, r.lift - r.g - tv)
    return pin, (-r.a * v, hu, -tu), (-r.a * u, -hv, tv), (r.a * v, -hu, tu)
