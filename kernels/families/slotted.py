"""Spatial slotted link: a crank whose ball runs in a fork slot, or along a bar, of the driven link (R-S-R, R-S-C-R).

A design is brought to its smallest set of numbers, and the crank for a wanted phi0 is found; then come the motion at
given crank angles, and the bodies for their loads: crank, driven link, between them an arm or a block.  Everything is
computed in lengths divided by a power of two near the crank length, so no scale of the drawing costs a bit.  Designs
may be complex128 (exact gradients by the complex step); decisions look at the real part.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2, hypotenuse, magnitude, unit_near
from kernels.arithmetic.vectors import add, cross, dot, mix, scale, spun, sub
from kernels.jit import inline, kernel
from kernels.linkage import bodies as tree
from kernels.linkage.outputs import put_block, write
from kernels.linkage.verdict import follower_status
from kernels.types import EPS, Array, Numbers, Status


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``: x = a u - e, y = y0 + ka v, z = z0 - na v (ball from the point D)."""

    a: float
    e: float
    y0: float
    ka: float
    lift: float  # f cos(alpha), the crank's centre above the origin
    z0: float
    na: float
    s: float
    k: float  # 0 for the fork slot
    tau: float
    branch: float
    x_size: float  # sums of the magnitudes whose rounding errors make up x, y and z
    y_size: float
    z_size: float
    unit: float
    valid: bool


@inline
def reduce_design(designs: Numbers, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for a crank of no length, k < 0 and what is not finite."""
    unit, per_unit = unit_near(designs[i, 0])
    a, e, f, g = designs[i, 0] * per_unit, designs[i, 1] * per_unit, designs[i, 2] * per_unit, designs[i, 3] * per_unit
    alpha, s, k = designs[i, 4], designs[i, 5] * per_unit, designs[i, 6] * per_unit
    tau, branch = designs[i, 7].real, designs[i, 8].real
    sa, ca = np.sin(alpha), np.cos(alpha)
    y0, ka, lift, z0, na = f * sa, a * ca, f * ca, f * ca - g, a * sa
    x_size, y_size = abs(e.real) + a.real, abs(y0.real) + abs(ka.real)
    z_size = abs(lift.real) + abs(g.real) + abs(na.real)
    valid = 0.0 < a.real <= 1.0 and x_size < 1e140 and y_size < 1e140 and z_size < 1e140
    valid = valid and 0.0 <= k.real < 1e140 and abs(s.real) < 1e140 and abs(alpha.real) < 1e5
    valid = valid and tau * tau == 1.0 and branch * branch == 1.0 and unit < math.inf
    return Reduced(a, e, y0, ka, lift, z0, na, s, k, tau, branch, x_size, y_size, z_size, unit, valid)


@kernel
def crank_of_phi0(phi0: Numbers, e: Numbers, f: Numbers, alpha: Numbers, status: Status, a: Numbers) -> None:
    """Compute the crank length a = cos(phi0/2) hypot(e, f tan(alpha)) of the fork slot with s = 0.

    Parameters
    ----------
    phi0 : (n,) crank angle of the shorter stroke between the limit positions [rad], 0 < phi0 < pi
    e, f : (n,) common perpendicular and offset of the crank plane [length];  alpha : (n,) [rad]
    status : (n,) out; OK, or NOT_ADMISSIBLE where phi0 is outside (0, pi), the driven axis meets the crank's, or
        cos(alpha) = 0 within rounding, where the projected crank circle is a segment
    a : (n,) out [length]; nan where the status is not OK
    """
    for i in range(phi0.shape[0]):
        tangent = math.tan(alpha[i])
        reach = math.hypot(e[i], f[i] * tangent)
        fine = 0.0 < phi0[i] < math.pi and 8.0 * EPS * abs(f[i]) < reach < math.inf and abs(tangent) < 1e15
        status[i] = st.OK if fine else st.NOT_ADMISSIBLE
        a[i] = math.cos(0.5 * phi0[i]) * reach if fine else math.nan


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
    """Ball, status and discriminants of both parts of the closure, (1), (2)."""
    x, y, z = r.a * u - r.e, r.y0 + r.ka * v, r.z0 - r.na * v
    error = 8.0 * EPS
    code = st.OK if r.valid else st.INVALID_INPUT
    # the bar: distance of the ball from the plane of the axis and the bar
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
    # rounding error of delta: of the products to first order, and the squares of the errors where both vanish
    tolerance = error * (abs(x.real) * r.x_size + abs(y.real) * r.y_size + abs(q.real) * q_size)
    tolerance += error * error * (r.x_size * r.x_size + r.y_size * r.y_size + q_size * q_size)
    if code == st.OK:
        code = follower_status(True, rr.real <= tolerance, delta.real, tolerance)
    return Ball(code, x, y, z, arm, q, rr, delta)


# Pose outputs, each (n, m), and joints (6, n, m); outputs of None are not computed.
Outputs = namedtuple(
    "Outputs", "psi dpsi d2psi d3psi sin_psi cos_psi rho drho d2rho d3rho discriminant pressure_angle joints"
)


@kernel
def poses(designs: Numbers, cos_phi: Numbers, sin_phi: Numbers, status: Status, out: Outputs) -> None:
    """Angle of the driven link, place of the ball along the slot, and derivatives, of every design and crank angle.

    Equations (1)-(7) of docs/slotted.md.

    Parameters
    ----------
    designs : (n, 9) columns as `PARAMETERS` of sweep/families/slotted.py; k = 0 is the fork slot, k > 0 the bar
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR or INVALID_INPUT
    out : psi and rho with their derivatives, discriminant, pressure angle, each (n, m) [rad; length; 1; rad]; joints
        (6, n, m), ball x y z and the point of the slot or bar that guides it x y z; what is None is neither computed
        nor compiled

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
            write(out.discriminant, i, j, _both_parts(r, ball, is_bar) if r.valid else math.nan)
            has_angle = code == st.OK or code == st.DEAD_POINT
            p = r.branch * np.sqrt(ball.delta) if code == st.OK else 0.0 * ball.delta
            per_rr = 1.0 / ball.rr if has_angle else math.nan
            c = (ball.x * p + ball.y * ball.q) * per_rr
            s = (ball.y * p - ball.x * ball.q) * per_rr + 0.0  # never -0.0, which would turn pi into -pi
            write(out.cos_psi, i, j, c)
            write(out.sin_psi, i, j, s)
            write(out.psi, i, j, arctan2(s, c))
            write(out.rho, i, j, p * r.unit if has_angle else math.nan)
            if out.pressure_angle is not None:  # LLVM does not drop a hypotenuse that is not wanted
                write(out.pressure_angle, i, j, _pressure_angle(r, ball, p, is_bar) if has_angle else math.nan)
            at_joints = _joints(r, designs[i, 3] / r.unit, ball, u, v, c, s)
            put_block(out.joints, i, j, at_joints, r.unit if has_angle else math.nan)
            w, w1, w2, p1, p2, p3 = _derivatives(r, ball, u, v, c, s, p, is_bar)
            write(out.dpsi, i, j, w)
            write(out.d2psi, i, j, w1)
            write(out.d3psi, i, j, w2)
            write(out.drho, i, j, p1 * r.unit)
            write(out.d2rho, i, j, p2 * r.unit)
            write(out.d3rho, i, j, p3 * r.unit)


@inline
def _both_parts(r: Reduced, ball: Ball, is_bar: bool) -> Any:
    """Signed cos^2 of the pressure angle: negative where either part of the closure has no solution; (7)."""
    part = ball.delta / ball.rr
    if is_bar:
        reach = (r.k - ball.z) * (r.k + ball.z) / (r.k * r.k)
        # two negative factors must not make a positive product: the link reaches only if both are positive
        part = reach * magnitude(part) if reach.real < 0.0 else reach * part
    return part


@inline
def _pressure_angle(r: Reduced, ball: Ball, p: Any, is_bar: bool) -> Any:
    """Angle between force and velocity at the ball.

    The force is normal to the slot, or along the arm of the bar.
    """
    along = magnitude(p) * (magnitude(ball.arm) if is_bar else 1.0)
    across = hypotenuse(np.sqrt(ball.rr) * ball.z, ball.q * ball.arm) if is_bar else magnitude(r.s)
    # arctangent, not acos: acos loses half the digits near zero.
    return arctan2(across, along)


@inline
def _joints(r: Reduced, g: Any, ball: Ball, u: Any, v: Any, c: Any, s: Any) -> tuple[Any, ...]:
    """Ball and the point that guides it, x y z each."""
    x, z = r.a * u, r.lift - r.na * v  # not from the driven axis, which would cost a short crank its digits
    # the fork slot guides the ball itself; a bar has a height of its own
    height = g + 0.0 * z if r.k.real > 0.0 else z
    return (x, ball.y, z, x + ball.arm * s, ball.y - ball.arm * c, height)


@inline
def _derivatives(
    r: Reduced, ball: Ball, u: Any, v: Any, c: Any, s: Any, p: Any, is_bar: bool
) -> tuple[Any, Any, Any, Any, Any, Any]:
    """First three derivatives of psi, then of rho in units of the crank, (5)-(6 a)."""
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
    # halves of the derivatives of the ball's squared distance from the driven axis, without a^2, which cancels in them
    far, side, tilted = r.a * r.e, r.y0 * r.ka, r.na * r.na
    h1 = (far * v + side * u) - tilted * (u * v)
    h2 = (far * u - side * v) - tilted * (u * u - v * v)
    h3 = 4.0 * tilted * (u * v) - (far * v + side * u)
    w = (across1 - q1) * per_p
    p1 = _smaller_terms(along1, w * q, h1 * per_p, -(q * q1) * per_p)
    w1 = (across2 - w * (along1 + p1) - q2) * per_p
    swung = w * (across1 + q1) + w1 * q
    p2 = _smaller_terms(along2, swung, (h2 - q * q2 - q1 * q1) * per_p, -(p1 * p1) * per_p)
    bend = across1 * (1.0 + w * w) + 2.0 * w * along2 + w1 * (along1 + 2.0 * p1) + w * p2 + q3
    w2 = -bend * per_p
    turning = 2.0 * w * across2 + w1 * across1 + w2 * q + 2.0 * w1 * q1 + w * q2
    p3 = _smaller_terms(
        turning, -along1 * (1.0 + w * w), (h3 - q * q3 - 3.0 * q1 * q2) * per_p, -3.0 * (p1 * p2) * per_p
    )
    return w, w1, w2, p1, p2, p3


@inline
def _smaller_terms(one: Any, two: Any, other_one: Any, other_two: Any) -> Any:
    """Sum of two terms, of two pairs with the same sum that whose terms are smaller: it loses fewer digits."""
    if abs(other_one.real) + abs(other_two.real) < abs(one.real) + abs(two.real):
        return other_one + other_two
    return one + two


@kernel
def links(designs: Array, cos_phi: Array, sin_phi: Array, motion: Array, out: tree.Links) -> None:
    """Fill the bodies, freedoms and closing lines of every pose; t, n and rho are those of docs/slotted.md.

    The arm slides along the bar by rho and tilts about it.  In the fork slot (k = 0) a block takes its place, which
    moves with the ball and slides along t and along the driven axis.  The loop is closed at the ball.

    Parameters
    ----------
    designs : (n, 9);  cos_phi, sin_phi : (n, m) or (1, m)
    motion : (7, n, m), outputs cos_psi, sin_psi, dpsi, d2psi, rho, drho, d2rho of ``poses``
    out : crank, driven link, arm or block; four freedoms, three lines: the ball, whose forces act on the arm
    """
    for i in range(designs.shape[0]):
        d = designs[i]
        shaft, k, pivot = tree.main_shaft(d[4], d[2]), (0.0, 0.0, 1.0), (d[1], 0.0, d[3])
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(motion.shape[2]):
            dpsi, d2psi = motion[2, i, j], motion[3, i, j]
            rho, drho, d2rho = motion[4, i, j], motion[5, i, j], motion[6, i, j]
            bodies, axes = out.bodies[i, j], out.axes[i, j]
            crank, ball = tree.put_crank(bodies[0], axes[0], shaft, d[0], cos_phi[row, j], sin_phi[row, j])
            t = (motion[0, i, j], motion[1, i, j], 0.0)
            n = cross(k, t)
            driven = tree.put_turning(bodies[1], pivot, k, t, dpsi, d2psi)
            tree.put(axes[1], k)
            tree.put(axes[2], t)
            tree.put_ball(out.lines[i, j], ball)
            if d[6] == 0.0:
                block = tree.Moving(
                    ball, tree.velocity_at(crank, ball), tree.acceleration_at(crank, ball), driven.omega, driven.eps
                )  # fmt: skip
                tree.put_body(bodies[2], block, n, t, cross(n, t), ball)
                tree.put(axes[3], k)
                out.freedoms[i, 3, 1] = tree.SLIDE
            else:
                foot = add(pivot, mix(rho, t, d[5], n))
                arm = sub(ball, foot)
                # Seen from the driven link the foot slides and the arm tilts about the bar, t x arm per radian.
                slid, swept = scale(drho, t), cross(t, arm)
                v = add(tree.velocity_at(driven, foot), slid)
                a = add(tree.acceleration_at(driven, foot), scale(d2rho, t))
                a = add(a, scale(2.0, cross(driven.omega, slid)))
                per = 1.0 / dot(swept, swept)
                tilt = per * dot(swept, sub(sub(tree.velocity_at(crank, ball), v), cross(driven.omega, arm)))
                omega = mix(1.0, driven.omega, tilt, t)
                # eps = psi'' k + tilt'' t + tilt' psi' k x t; tilt'' from the ball's acceleration
                known = mix(1.0, driven.eps, tilt, cross(driven.omega, t))
                left = sub(sub(tree.acceleration_at(crank, ball), a), spun(omega, known, arm))
                eps = mix(1.0, known, per * dot(swept, left), t)
                x = scale(1.0 / d[6], arm)
                tree.put_body(bodies[2], tree.Moving(foot, v, a, omega, eps), x, t, cross(x, t), foot)
                tree.put(axes[3], t)
