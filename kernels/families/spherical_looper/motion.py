"""Motion of the spherical looper at given crank angles: carrier, looper, working point, their derivatives."""

from __future__ import annotations

import math
from typing import Any

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.complex_step import magnitude
from kernels.driven_ball import Path, Swung, rotated, swing
from kernels.families.spherical_looper.closure import Numbers, Reduced, Status, reduce_design
from kernels.looper_drive import pin_path
from kernels.looper_outputs import put_angle, put_loop, put_point
from kernels.vectors import Vector, add, dot, mix, turned


@inline
def _second_crank(r: Reduced, u: float, v: float) -> Path:
    """Return the ball of crank 2 from the common point Os of both axes, (2)."""
    u2, v2 = u * r.cos_offset - v * r.sin_offset, v * r.cos_offset + u * r.sin_offset
    radial = mix(r.a2 * u2, r.first, r.a2 * v2, r.second)
    tangential = mix(-r.a2 * v2, r.first, r.a2 * u2, r.second)
    back = (-tangential[0], -tangential[1], -tangential[2])
    return add(r.centre, radial), tangential, (-radial[0], -radial[1], -radial[2]), back


@inline
def _in_triad(r: Reduced, a: Vector, lift: float) -> Vector:
    """Return components in the triad of the looper's axis, from a height along it."""
    return dot(a, r.radial), dot(a, r.across), dot(a, r.axis) - lift


@inline
def _seen_from_carrier(r: Reduced, carrier: Swung, path: Path) -> Path:
    """Return the driving ball in the looper's frame, which the carrier takes along, (3)."""
    # turned back by the carrier's angle: minus the sine and minus all derivatives
    m, m1, m2, m3 = rotated(carrier.cos, -carrier.sin, -carrier.first, -carrier.second, -carrier.third, path)
    return _in_triad(r, m, r.along), _in_triad(r, m1, 0.0), _in_triad(r, m2, 0.0), _in_triad(r, m3, 0.0)


@inline
def _carried(r: Reduced, carrier: Swung, looper: Swung, fixed: Vector) -> Path:
    """Return a point fixed to the looper, from Os in fixed axes, with its derivatives, (5)."""
    none = (0.0 * fixed[0], 0.0 * fixed[0], 0.0 * fixed[0])
    # the point rests in the looper: its derivatives there are zeros of the design's own type
    path = (fixed, none, none, none)
    m, m1, m2, m3 = rotated(looper.cos, looper.sin, looper.first, looper.second, looper.third, path)
    path = (
        turned(r.radial, r.across, r.axis, m),
        turned(r.radial, r.across, r.axis, m1),
        turned(r.radial, r.across, r.axis, m2),
        turned(r.radial, r.across, r.axis, m3),
    )
    return rotated(carrier.cos, carrier.sin, carrier.first, carrier.second, carrier.third, path)


@kernel
def poses(
    designs: Numbers,
    cos_phi: Numbers,
    sin_phi: Numbers,
    status: Status,
    carrier: Numbers | None,
    carrier_loop: Numbers | None,
    looper: Numbers | None,
    looper_loop: Numbers | None,
    point: Numbers | None,
    velocity: Numbers | None,
    acceleration: Numbers | None,
    jerk: Numbers | None,
    magnitudes: Numbers | None,
    joints: Numbers | None,
) -> None:
    """Compute the carrier, looper and working point with derivatives, of every design at its crank angles.

    Equations (1)-(6) of docs/spherical_looper.md.

    Parameters
    ----------
    designs : (n, 26) columns of :class:`Design`
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, or that of the first loop that is not: NOT_ASSEMBLED, DEAD_POINT, SINGULAR (a driving ball
        on the axis it turns the link about, or the looper's ball on the looper's axis); INVALID_INPUT.  Where nothing
        but the carrier's outputs is wanted, the looper's loop does not count
    carrier, looper : (4, n, m) out, psi and chi [rad] and their three derivatives, or None
    carrier_loop, looper_loop : (2, n, m) out, discriminant [length^2] and pressure angle [rad], or None
    point, velocity, acceleration, jerk : (3, n, m) out [length], x y z of the working point and derivatives, or None
    magnitudes : (3, n, m) out [length], lengths of velocity, acceleration and jerk, or None
    joints : (12, n, m) out [length], x y z of crank pin 1, carrier's ball, crank pin 2, looper's ball, or None

    Notes
    -----
    What is None is neither computed nor compiled.  Where a loop is not OK its angle is nan (but at a dead point only
    its derivatives are), and so is what follows from it.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            first, second = pin_path(r.swings, u, v), _second_crank(r, u, v)
            drive = r.swings
            one = swing(first, drive.size, drive.b, drive.c, drive.branch)
            two = swing(_seen_from_carrier(r, one, second), r.size2, r.b2, r.c2, r.branch2)
            code = one.status if r.valid else st.INVALID_INPUT
            if (
                looper is not None or looper_loop is not None or point is not None or velocity is not None
                or acceleration is not None or jerk is not None or magnitudes is not None or joints is not None
            ):  # fmt: skip
                code = two.status if code == st.OK else code
            status[i, j] = code
            undefined = 0.0 if r.valid else math.nan
            put_angle(carrier, i, j, one, undefined)
            put_angle(looper, i, j, two, undefined)
            if carrier_loop is not None:
                put_loop(carrier_loop, i, j, one.delta, magnitude(one.root), one.across, r.unit, undefined)
            if looper_loop is not None:
                put_loop(looper_loop, i, j, two.delta, magnitude(two.root), two.across, r.unit, undefined)
            centre = (drive.e, 0.0 * drive.e, r.o)
            scale = r.unit + undefined
            path = _carried(r, one, two, r.point)
            put_point(point, velocity, acceleration, jerk, magnitudes, i, j, centre, path, scale)
            if joints is not None:
                _put_joints(joints, i, j, r, first, second, one, two, v, scale)


@inline
def _put_joints(
    joints: Numbers, i: int, j: int, r: Reduced, first: Path, second: Path, one: Swung, two: Swung, v: float, scale: Any
) -> None:
    """Write x y z of crank pin 1, carrier's ball, crank pin 2 and looper's ball [length]."""
    drive = r.swings
    centre = (drive.e, 0.0 * drive.e, r.o)
    ball, _, _, _ = _carried(r, one, two, (r.c2, 0.0 * r.c2, r.along))
    rocker = (drive.e + drive.c * one.cos, drive.c * one.sin, drive.g)
    # the height anew: the path's own is taken from the rocker's plane, and adding that again would round twice
    pin = (first[0][0] + drive.e, first[0][1], drive.lift - drive.a * (drive.sa * v))
    for k in range(3):
        joints[k, i, j] = pin[k] * scale
        joints[3 + k, i, j] = rocker[k] * scale
        joints[6 + k, i, j] = (centre[k] + second[0][k]) * scale
        joints[9 + k, i, j] = (centre[k] + ball[k]) * scale
