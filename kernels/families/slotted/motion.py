"""Motion of the slotted link at given crank angles: driven angle, ball along the slot, derivatives, pressure angle."""

from __future__ import annotations

import math

import numpy as np

from kernels import status as st
from kernels._jit import kernel
from kernels.complex_step import arctan2, hypotenuse, magnitude
from kernels.families.slotted.closure import EPS, Numbers, Status, reduce_design


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
    rho: Numbers | None,
    drho: Numbers | None,
    d2rho: Numbers | None,
    d3rho: Numbers | None,
    discriminant: Numbers | None,
    pressure_angle: Numbers | None,
    joints: Numbers | None,
) -> None:
    """Angle of the driven link, place of the ball along the slot, and derivatives, of every design and crank angle.

    Equations (1)-(7) of docs/slotted.md.

    Parameters
    ----------
    designs : (n, 9) columns of :class:`Design`; k = 0 is the fork slot, k > 0 the bar
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR or INVALID_INPUT
    psi ... pressure_angle : (n, m) out [rad; length; 1], or None: what is None is neither computed nor compiled
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
                    arm_size = (r.k.real * r.k.real + abs(z.real) * r.z_size) / abs(arm.real)
                elif code == st.OK:
                    code = st.SINGULAR if square.real >= -band else st.NOT_ASSEMBLED
            q = r.s + arm
            rr = x * x + y * y
            delta = rr - q * q
            q_size = abs(r.s.real) + arm_size
            tolerance = error * (abs(x.real) * r.x_size + abs(y.real) * r.y_size + abs(q.real) * q_size)
            tolerance += error * error * (r.x_size * r.x_size + r.y_size * r.y_size + q_size * q_size)
            if code == st.OK:
                if delta.real != delta.real:
                    code = st.INVALID_INPUT
                elif delta.real < -tolerance:
                    code = st.NOT_ASSEMBLED
                elif delta.real <= tolerance:
                    code = st.DEAD_POINT if rr.real > tolerance else st.SINGULAR
            status[i, j] = code

            has_angle = code == st.OK or code == st.DEAD_POINT
            if discriminant is not None:
                # signed cos^2 of the pressure angle: negative where either part of the closure has no solution
                part = delta / rr
                if is_bar:
                    reach = (r.k - z) * (r.k + z) / (r.k * r.k)
                    part = reach * magnitude(part) if reach.real < 0.0 else reach * part
                discriminant[i, j] = part if r.valid else math.nan
            p = r.branch * np.sqrt(delta) if code == st.OK else 0.0 * delta
            per_rr = 1.0 / rr if has_angle else math.nan
            c, s = (x * p + y * q) * per_rr, (y * p - x * q) * per_rr + 0.0  # never -0.0, which would turn pi into -pi
            if cos_psi is not None:
                cos_psi[i, j] = c
            if sin_psi is not None:
                sin_psi[i, j] = s
            if psi is not None:
                psi[i, j] = arctan2(s, c)
            if rho is not None:
                rho[i, j] = p * r.unit if has_angle else math.nan
            if pressure_angle is not None:
                # The force is normal to the slot, or along the arm of the bar, and goes through the ball.
                along = magnitude(p) * (magnitude(arm) if is_bar else 1.0)
                across = hypotenuse(np.sqrt(rr) * z, q * arm) if is_bar else magnitude(r.s)
                pressure_angle[i, j] = arctan2(across, along) if has_angle else math.nan
            if joints is not None:
                joints[0, i, j], joints[1, i, j] = (x + r.e) * r.unit, y * r.unit
                joints[2, i, j] = (r.lift - r.na * v) * r.unit
                joints[3, i, j] = (r.e + p * c - r.s * s) * r.unit
                joints[4, i, j] = (p * s + r.s * c) * r.unit
                joints[5, i, j] = designs[i, 3] if is_bar else joints[2, i, j]
                if not has_angle:
                    for k in range(6):
                        joints[k, i, j] = math.nan
            if (
                dpsi is not None or d2psi is not None or d3psi is not None
                or drho is not None or d2rho is not None or d3rho is not None
            ):  # fmt: skip
                per_p = 1.0 / p if code == st.OK else math.nan * p
                q1, q2, q3 = 0.0 * x, 0.0 * x, 0.0 * x
                if is_bar and code == st.OK:
                    per_arm = 1.0 / arm
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
                if dpsi is not None:
                    dpsi[i, j] = w
                if d2psi is not None:
                    d2psi[i, j] = w1
                if d3psi is not None:
                    d3psi[i, j] = w2
                if drho is not None:
                    drho[i, j] = p1 * r.unit
                if d2rho is not None:
                    d2rho[i, j] = p2 * r.unit
                if d3rho is not None:
                    turning = 2.0 * w * across2 + w1 * across1 + w2 * q + 2.0 * w1 * q1 + w * q2
                    d3rho[i, j] = (turning - along1 * (1.0 + w * w)) * r.unit
