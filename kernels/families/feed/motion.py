"""Motion of the rack over the crank angle: angles, points, path of a tooth, weighted difference of the closure."""

from __future__ import annotations

import math
from typing import Any

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.families.feed.closure import (
    Array,
    Driven,
    Reduced,
    Status,
    angle_of,
    bar_angle,
    eccentric,
    point_of_rack,
    reduce_design,
    rocker_angle,
    rocker_pin,
)

# What poses writes, in order: angles, their derivatives, points of the rack, derivatives of the tooth.
OUTPUTS = (
    "psi_plus_dh", "dpsi", "d2psi", "chi", "dchi", "d2chi", "x_h", "y_h", "x_e", "y_e", "x_f", "y_f",
    "x_t", "y_t", "dx_t", "dy_t", "d2x_t", "d2y_t",
)  # fmt: skip


@inline
def rack_at(
    r: Reduced, u: Any, v: Any
) -> tuple[tuple[Any, Any, Any, Any], tuple[Any, Any, Any, Any], Driven, Driven, int]:
    """Return the rocker and rack as (cos, sin, first, second derivative), pins H and E, and the status of the pose."""
    cos, sin, one, two, code = rocker_angle(r.rocker, u, v)
    h = rocker_pin(r, cos, sin, one, two)
    e = eccentric(r.x_ecc, r.y_ecc, r.r_ecc, r.cos_ecc, r.sin_ecc, u, v)
    bar_cos, bar_sin, bar_one, bar_two, bar_code = bar_angle(r, h, e)
    if not r.valid:
        code = st.INVALID_INPUT
    # The rocker's status comes first, but its dead point still has a position: a rack that has none is worse.
    if code == st.OK or (code == st.DEAD_POINT and bar_code in (st.NOT_ASSEMBLED, st.SINGULAR)):
        code = bar_code
    return (cos, sin, one, two), (bar_cos, bar_sin, bar_one, bar_two), h, e, code


@inline
def tooth_at(r: Reduced, u: Any, v: Any) -> tuple[Driven, int]:
    """Return the path of the tooth and the status of the pose."""
    _, bar, h, _, code = rack_at(r, u, v)
    return point_of_rack(h, bar[0], bar[1], bar[2], bar[3], r.tx, r.ty), code


@kernel
def poses(designs: Array, cos_phi: Array, sin_phi: Array, status: Status, outputs: Array) -> None:
    """Compute angles of rocker and rack, points of the rack and path of the tooth; (1)-(9) of docs/feed.md.

    Parameters
    ----------
    designs : (n, 23) columns of :class:`kernels.families.feed.Design`
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR or INVALID_INPUT, of the rocker or of the rack
    outputs : (18, n, m) out in the order of :data:`OUTPUTS` [rad, length]

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
            f = point_of_rack(h, bar[0], bar[1], bar[2], bar[3], r.fx, r.fy)
            t = point_of_rack(h, bar[0], bar[1], bar[2], bar[3], r.tx, r.ty)
            values = (
                (angle_of(rocker[0], rocker[1]) + r.dh) * room, rocker[2] * room, rocker[3] * room,
                angle_of(bar[0], bar[1]) * room, bar[2] * room, bar[3] * room,
                h.x * scale, h.y * scale, e.x * scale, e.y * scale, f.x * scale, f.y * scale,
                t.x * scale, t.y * scale, t.x1 * scale, t.y1 * scale, t.x2 * scale, t.y2 * scale,
            )  # fmt: skip
            for k in range(18):
                outputs[k, i, j] = values[k]


@kernel
def differences(designs: Array, cos_phi: Array, sin_phi: Array, chi: Array, status: Status, dq: Array) -> None:
    """Compute the weighted difference |F - E|^2 - q^2 of the lift coupler for a rack at prescribed angles;
    (10) of docs/feed.md.

    Parameters
    ----------
    designs : (n, 23) columns of :class:`kernels.families.feed.Design`
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    chi : (n, m) prescribed angles of the rack [rad]
    status : (n, m) out, of the rocker alone;  dq : (n, m) out [length^2]; nan where the rocker is not assembled
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            cos, sin, one, two, code = rocker_angle(r.rocker, u, v)
            status[i, j] = code if r.valid else st.INVALID_INPUT
            h = rocker_pin(r, cos, sin, one, two)
            e = eccentric(r.x_ecc, r.y_ecc, r.r_ecc, r.cos_ecc, r.sin_ecc, u, v)
            x, y = math.cos(chi[i, j]), math.sin(chi[i, j])
            dx, dy = h.x + x * r.fx - y * r.fy - e.x, h.y + y * r.fx + x * r.fy - e.y
            # product of difference and sum: the squares nearly cancel for a good coupler, that is where it matters
            length = math.sqrt(dx * dx + dy * dy)
            value = (length - r.q) * (length + r.q)
            assembled = status[i, j] == st.OK or status[i, j] == st.DEAD_POINT
            dq[i, j] = (value * r.unit) * r.unit if assembled else math.nan


@kernel
def lift_rows(designs: Array, cos_phi: Array, sin_phi: Array, chi: Array, status: Status, rows: Array) -> None:
    """Compute the weighted difference as a linear form of the lift coupler's dimensions; (10) of docs/feed.md.

    |F - E|^2 - q^2 = rows[0] fx + rows[1] fy + rows[2] - p0 with p0 = q^2 - fx^2 - fy^2.

    Parameters
    ----------
    designs : (n, 23) columns of :class:`kernels.families.feed.Design`; q sets the scale only, fx, fy are not used
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    chi : (n, m) prescribed angles of the rack [rad]
    status : (n, m) out, of the rocker alone;  rows : (5, n, m) out [length, length, length^2] and the pin H (x, y)
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            cos, sin, one, two, code = rocker_angle(r.rocker, u, v)
            status[i, j] = code if r.valid else st.INVALID_INPUT
            h = rocker_pin(r, cos, sin, one, two)
            e = eccentric(r.x_ecc, r.y_ecc, r.r_ecc, r.cos_ecc, r.sin_ecc, u, v)
            wx, wy = h.x - e.x, h.y - e.y
            x, y = math.cos(chi[i, j]), math.sin(chi[i, j])
            assembled = status[i, j] == st.OK or status[i, j] == st.DEAD_POINT
            unit = r.unit if assembled else math.nan
            rows[0, i, j], rows[1, i, j] = 2.0 * (wx * x + wy * y) * unit, 2.0 * (wy * x - wx * y) * unit
            # one factor after the other: the square of the unit leaves float64 before the length^2 does
            rows[2, i, j] = ((wx * wx + wy * wy) * unit) * unit
            rows[3, i, j], rows[4, i, j] = h.x * unit, h.y * unit
