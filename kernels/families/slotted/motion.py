"""Motion of the slotted link at given crank angles: driven angle, ball along the slot, derivatives, pressure angle."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.complex_step import arctan2, hypotenuse, magnitude
from kernels.families.slotted.closure import EPS, Numbers, Reduced, Status, reduce_design
from kernels.verdict import pose_status


class Slide(NamedTuple):
    """Place of the ball along the slot and its derivatives [length], each (n, m) out, or None: not computed."""

    rho: Numbers | None
    drho: Numbers | None
    d2rho: Numbers | None
    d3rho: Numbers | None


class Ball(NamedTuple):
    """Ball from the point D, the arm's part across the slot, and the closure's numbers, for one crank angle."""

    code: int
    x: Any
    y: Any
    z: Any
    arm: Any  # 0 for the fork slot
    q: Any  # distance of the ball from the slot's parallel through the driven axis
    rr: Any
    delta: Any  # rho^2


@inline
def _closure(r: Reduced, u: Any, v: Any, is_bar: bool) -> Ball:
    """Return the ball, status and discriminants of both parts of the closure, (1), (2)."""
    x, y, z = r.a * u - r.e, r.y0 + r.ka * v, r.z0 - r.na * v
    error = 8.0 * EPS
    code = st.OK if r.valid else st.INVALID_INPUT
    # the bar: how far the ball stands off the plane of the axis and the bar
    arm, arm_size = 0.0 * x, 0.0
    if is_bar:
        square = (r.k - z) * (r.k + z)
        band = error * (r.k.real * r.k.real + abs(z.real) * r.z_size) + error * error * r.z_size * r.z_size
        if square.real > band:
            arm = r.tau * np.sqrt(square)
            # the root's error is that of the square over twice the root: without bound where the arm turns parallel
            arm_size = (r.k.real * r.k.real + abs(z.real) * r.z_size) / abs(arm.real)
        elif code == st.OK:
            code = st.SINGULAR if square.real >= -band else st.NOT_ASSEMBLED
    q = r.s + arm
    rr = x * x + y * y
    delta = rr - q * q
    q_size = abs(r.s.real) + arm_size
    # what rounding makes of delta: of the products to first order, and of the squares of the errors where both vanish
    tolerance = error * (abs(x.real) * r.x_size + abs(y.real) * r.y_size + abs(q.real) * q_size)
    tolerance += error * error * (r.x_size * r.x_size + r.y_size * r.y_size + q_size * q_size)
    if code == st.OK:
        code = pose_status(True, delta.real, tolerance, rr.real)
    return Ball(code, x, y, z, arm, q, rr, delta)


@kernel
def poses(
    designs: Numbers,
    cos_phi: Numbers,
    sin_phi: Numbers,
    status: Status,
    psi: Numbers | None,
    dpsi: Numbers | None,
    d2psi: Numbers | None,
    d3psi: Numbers | None,
    sin_psi: Numbers | None,
    cos_psi: Numbers | None,
    slide: Slide,
    discriminant: Numbers | None,
    pressure_angle: Numbers | None,
    joints: Numbers | None,
) -> None:
    """Compute the angle of the driven link, place of the ball along the slot, and derivatives,
    of every design and crank angle.

    Equations (1)-(7) of docs/slotted.md.

    Parameters
    ----------
    designs : (n, 9) columns of :class:`Design`; k = 0 is the fork slot, k > 0 the bar
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR or INVALID_INPUT
    psi ... cos_psi : (n, m) out [rad; 1], or None: what is None is neither computed nor compiled
    slide : record of (n, m) arrays [length] or None
    discriminant, pressure_angle : (n, m) out [1; rad], or None
    joints : (6, n, m) out, ball x y z and the point of the slot or bar that guides it x y z, or None

    Notes
    -----
    Where the status is not OK the values are nan, except that a dead point (the ball on the foot of the slot, rho = 0)
    keeps its position.  SINGULAR: the ball lies on the driven axis, or the arm k is parallel to it.
    Measured: errors below 1.5 x 2^-53 max(cond, |y|) over the oracle table.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        is_bar = r.k.real > 0.0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            ball = _closure(r, u, v, is_bar)
            code = ball.code
            status[i, j] = code
            if discriminant is not None:
                discriminant[i, j] = _both_parts(r, ball, is_bar) if r.valid else math.nan
            has_angle = code == st.OK or code == st.DEAD_POINT
            p = r.branch * np.sqrt(ball.delta) if code == st.OK else 0.0 * ball.delta
            per_rr = 1.0 / ball.rr if has_angle else math.nan
            c = (ball.x * p + ball.y * ball.q) * per_rr
            s = (ball.y * p - ball.x * ball.q) * per_rr + 0.0  # never -0.0, which would turn pi into -pi
            if cos_psi is not None:
                cos_psi[i, j] = c
            if sin_psi is not None:
                sin_psi[i, j] = s
            if psi is not None:
                psi[i, j] = arctan2(s, c)
            if slide.rho is not None:
                _put(slide.rho, i, j, p * r.unit if has_angle else math.nan)
            if pressure_angle is not None:
                pressure_angle[i, j] = _pressure_angle(r, ball, p, is_bar) if has_angle else math.nan
            if joints is not None:
                _put_joints(joints, designs, i, j, r, ball, v, p, c, s, has_angle)
            if (
                dpsi is not None or d2psi is not None or d3psi is not None
                or slide.drho is not None or slide.d2rho is not None or slide.d3rho is not None
            ):  # fmt: skip
                w, w1, w2, p1, p2, p3 = _derivatives(r, ball, u, v, c, s, p, is_bar)
                if dpsi is not None:
                    dpsi[i, j] = w
                if d2psi is not None:
                    d2psi[i, j] = w1
                if d3psi is not None:
                    d3psi[i, j] = w2
                _put(slide.drho, i, j, p1 * r.unit)
                _put(slide.d2rho, i, j, p2 * r.unit)
                _put(slide.d3rho, i, j, p3 * r.unit)


@inline
def _put(out: Numbers | None, i: int, j: int, value: Any) -> None:
    """Write a value where it is wanted; through a function, since a field that is None cannot be written to."""
    if out is not None:
        out[i, j] = value


@inline
def _both_parts(r: Reduced, ball: Ball, is_bar: bool) -> Any:
    """Return the signed cos^2 of the pressure angle: negative where either part of the closure has no solution; (7)."""
    part = ball.delta / ball.rr
    if is_bar:
        reach = (r.k - ball.z) * (r.k + ball.z) / (r.k * r.k)
        # two negative factors must not make a positive product: the link reaches only if both are positive
        part = reach * magnitude(part) if reach.real < 0.0 else reach * part
    return part


@inline
def _pressure_angle(r: Reduced, ball: Ball, p: Any, is_bar: bool) -> Any:
    """Return the angle between force and velocity at the ball;
    the force is normal to the slot, or along the arm of the bar.
    """
    along = magnitude(p) * (magnitude(ball.arm) if is_bar else 1.0)
    across = hypotenuse(np.sqrt(ball.rr) * ball.z, ball.q * ball.arm) if is_bar else magnitude(r.s)
    # arctangent, not acos: acos loses half the digits near zero.
    return arctan2(across, along)


@inline
def _put_joints(
    joints: Numbers, designs: Numbers, i: int, j: int, r: Reduced, ball: Ball, v: Any, p: Any, c: Any, s: Any,
    has_angle: bool,
) -> None:  # fmt: skip
    """Write the ball and the point that guides it, x y z each."""
    joints[0, i, j], joints[1, i, j] = (ball.x + r.e) * r.unit, ball.y * r.unit
    joints[2, i, j] = (r.lift - r.na * v) * r.unit
    joints[3, i, j] = (r.e + p * c - r.s * s) * r.unit
    joints[4, i, j] = (p * s + r.s * c) * r.unit
    # a bar has a height of its own; the fork slot guides the ball at the ball's height
    joints[5, i, j] = designs[i, 3] if r.k.real > 0.0 else joints[2, i, j]
    if not has_angle:
        for k in range(6):
            joints[k, i, j] = math.nan


@inline
def _derivatives(
    r: Reduced, ball: Ball, u: Any, v: Any, c: Any, s: Any, p: Any, is_bar: bool
) -> tuple[Any, Any, Any, Any, Any, Any]:
    """Return the first three derivatives of psi, then of rho in units of the crank, (5), (6)."""
    z, q = ball.z, ball.q
    # at a dead point (p = 0) the position stands and the derivatives do not exist
    per_p = 1.0 / p if ball.code == st.OK else math.nan * p
    q1, q2, q3 = 0.0 * ball.x, 0.0 * ball.x, 0.0 * ball.x
    if is_bar and ball.code == st.OK:
        per_arm = 1.0 / ball.arm
        z1, z2 = -r.na * u, r.na * v
        q1 = -z * z1 * per_arm
        q2 = -(z1 * z1 + z * z2 + q1 * q1) * per_arm
        q3 = (z * z1 - 3.0 * (z1 * z2 + q1 * q2)) * per_arm
    # the ball's velocity and acceleration along and across the slot; its jerk is minus its velocity
    along1, across1 = r.ka * u * s - r.a * v * c, r.a * v * s + r.ka * u * c
    along2, across2 = -(r.a * u * c + r.ka * v * s), r.a * u * s - r.ka * v * c
    w = (across1 - q1) * per_p
    p1 = along1 + w * q
    w1 = (across2 - w * (along1 + p1) - q2) * per_p
    p2 = along2 + w * (across1 + q1) + w1 * q
    bend = across1 * (1.0 + w * w) + 2.0 * w * along2 + w1 * (along1 + 2.0 * p1) + w * p2 + q3
    w2 = -bend * per_p
    turning = 2.0 * w * across2 + w1 * across1 + w2 * q + 2.0 * w1 * q1 + w * q2
    return w, w1, w2, p1, p2, turning - along1 * (1.0 + w * w)
