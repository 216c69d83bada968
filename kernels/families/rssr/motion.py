"""Motion of the spatial crank-rocker at given crank angles, and its joint records for the effects.

The records are those of :mod:`kernels.linkage.joints`; beside them stands the ellipse that the direction of the coupler
draws across the velocity of the rocker's joint.

The largest transfer functions over a grid of crank angles are the hot loop of a sweep.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2, hypotenuse
from kernels.arithmetic.intrinsics import largest, smallest
from kernels.arithmetic.sincos import sincos
from kernels.families.rssr.closure import (
    ClosurePose,
    Rocker,
    acceleration,
    jerk,
    place,
    reduce_design,
    rocker,
    velocity,
)
from kernels.jit import inline, inline_fused, kernel, kernel_fused
from kernels.linkage.crank_closure import Reduced, axial_terms, discriminant_tolerance
from kernels.linkage.outputs import write, write_number
from kernels.linkage.verdict import pose_status
from kernels.types import Array, Numbers, Status

# Pose outputs, each (n, m), and coordinates of the crank pin B and the rocker ball C; outputs of None are not computed.
Outputs = namedtuple(
    "Outputs", "psi dpsi d2psi d3psi sin_psi cos_psi discriminant pressure_angle x_b y_b z_b x_c y_c z_c"
)


@kernel
def poses(designs: Numbers, cos_phi: Numbers, sin_phi: Numbers, status: Status, out: Outputs) -> None:
    """Position, transfer functions, discriminant, pressure angle and joints of every design at its crank angles.

    Equations (2*), (3)-(5) and (13) of docs/rssr.md; joints in the fixed frame of its section 1.

    Parameters
    ----------
    designs : (n, 8) columns as `PARAMETERS` of sweep/families/rssr.py; complex128 for gradients by the complex step
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs; complex128 where they depend on the designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR or INVALID_INPUT
    psi ... z_c : (n, m) out, or None: then it is neither computed nor compiled; complex128 if an input is

    Notes
    -----
    Where the status is not OK the values are nan, except that a dead point keeps its angle (Delta = 0).
    A discriminant within its own rounding error counts as a dead point.  Outside that band its sign is right for the
    given doubles, up to the rounding of K.  ``discriminant`` is a length to the fourth power and leaves float64 at
    scales beyond 1e+-77, as inf or 0; the status is decided on Delta in units of the crank.
    Largest error over the 422 oracle rows, hard ones included: 2.1 x 2^-53 x max(cond, |y|).  A search found 134 where
    the coupler is short; :mod:`kernels.families.rssr.precise` has neither.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        two_ac = 2.0 * designs[i, 0] * designs[i, 2]
        for j in range(cos_phi.shape[1]):
            at = place(r.e, r.y0, r.ca, r.k0, r.k1, r.k2, cos_phi[row, j], sin_phi[row, j])
            tolerance = discriminant_tolerance(r, at.x, at.y, at.w)
            code = pose_status(r.valid, at.delta.real, tolerance, at.rr.real)
            status[i, j] = code
            write(out.discriminant, i, j, (at.delta * two_ac) * two_ac if r.valid else math.nan)
            t = np.sqrt(at.delta) if code == st.OK else 0.0
            has_angle = code == st.OK or code == st.DEAD_POINT
            c = (at.x * at.w + at.y * t) / at.rr if has_angle else math.nan
            s = (at.x * t - at.y * at.w) / at.rr if has_angle else math.nan
            write(out.cos_psi, i, j, -c)
            sine = 0.0 - r.branch * s  # never -0.0, which would turn the angle pi into -pi
            write(out.sin_psi, i, j, sine)
            write(out.psi, i, j, arctan2(sine, -c))
            if out.pressure_angle is not None:  # LLVM does not drop a hypotenuse that is not wanted
                # arctangent, not acos: acos loses half the digits near zero.
                across = hypotenuse(r.rocker - at.w, r.z0 - r.sa * at.v)
                write(out.pressure_angle, i, j, arctan2(across, t) if has_angle else math.nan)
            _put_joints(out, designs, i, j, r, at, c, s, has_angle)
            if out.dpsi is not None or out.d2psi is not None or out.d3psi is not None:
                to = Rocker(c, s, t, 1.0 / t if code == st.OK else math.nan)
                _put_derivatives(out, i, j, r, at, to)


@inline
def _put_joints(
    out: Outputs, designs: Numbers, i: int, j: int, r: Reduced, at: ClosurePose, c: Any, s: Any, has_angle: bool
) -> None:
    """Write the wanted coordinates; c and s are minus cosine and minus sine of the mirrored rocker angle."""
    valid = 1.0 if r.valid else math.nan
    lift = designs[i, 4] * (r.branch * r.ca) - designs[i, 0] * (r.sa * at.v)
    write(out.x_b, i, j, valid * (designs[i, 0] * at.u))
    write(out.y_b, i, j, valid * (designs[i, 4] * r.sa + designs[i, 0] * r.branch * at.hv))
    write(out.z_b, i, j, valid * lift)
    write(out.x_c, i, j, designs[i, 3] - designs[i, 2] * c)
    write(out.y_c, i, j, -r.branch * designs[i, 2] * s)
    write(out.z_c, i, j, designs[i, 5] if has_angle else math.nan)


@inline
def _put_derivatives(out: Outputs, i: int, j: int, r: Reduced, at: ClosurePose, to: Rocker) -> None:
    """Write the wanted transfer functions up to the highest of them, mirrored back to the branch."""
    first = velocity(r.k1, r.k2, to, at)
    write(out.dpsi, i, j, -r.branch * first.p)
    if out.d2psi is not None or out.d3psi is not None:
        second = acceleration(to, at, first)
        write(out.d2psi, i, j, -r.branch * second.q)
        if out.d3psi is not None:
            write(out.d3psi, i, j, r.branch * jerk(to, at, first, second))


@kernel
def joints(designs: Array, cos_phi: Array, sin_phi: Array, motion: Array, per_pose: Array, per_design: Array) -> None:
    """Fill the records of :mod:`kernels.linkage.joints` from the motion.

    Parameters
    ----------
    designs : (n, 8);  cos_phi, sin_phi : (n, m) or (1, m)
    motion : (5, n, m), outputs cos_psi, sin_psi, dpsi, d2psi, discriminant of ``poses``
    per_pose : (n, m, PER_POSE) out;  per_design : (n, PER_DESIGN) out

    Notes
    -----
    The component t_tau of the coupler's direction along the rocker's motion has the sign of the branch.  It is taken
    from the discriminant, which keeps its digits near a dead point.
    """
    for i in range(designs.shape[0]):
        a, b, c = designs[i, 0], designs[i, 1], designs[i, 2]
        e, f, g, branch = designs[i, 3], designs[i, 4], designs[i, 5], designs[i, 7]
        sa, ca = math.sin(designs[i, 6]), math.cos(designs[i, 6])
        d = per_design[i]
        d[0], d[1], d[2], d[3], d[4], d[5] = 0.0, sa, ca, 0.0, 0.0, 1.0
        d[6], d[7], d[8], d[9], d[10], d[11] = 0.0, f * sa, f * ca, e, 0.0, g
        d[12], d[13], d[14], d[15], d[16] = a, b, c, branch, 1.0
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v, cp, sp = cos_phi[row, j], sin_phi[row, j], motion[0, i, j], motion[1, i, j]
            r = per_pose[i, j]
            r[0], r[1], r[2] = a * u, f * sa + a * (ca * v), f * ca - a * (sa * v)
            r[3], r[4], r[5] = e + c * cp, c * sp, g
            for k in range(3):
                r[6 + k] = (r[3 + k] - r[k]) / b
            r[9], r[10], r[11] = u, ca * v, -sa * v
            r[12], r[13], r[14] = -v, ca * u, -sa * u
            r[15], r[16], r[17] = cp, sp, 0.0
            r[18], r[19], r[20] = -sp, cp, 0.0
            # From the root of the discriminant: near a dead point a difference of points has no digit left.
            r[21] = branch * np.sqrt(motion[4, i, j]) / (2.0 * b * c)
            r[22], r[23] = motion[2, i, j], motion[3, i, j]


@kernel
def pressure_ellipse(designs: Array, ellipse: Array) -> None:
    """Compute the radial and axial component of the coupler's unit vector as functions of the crank angle.

    t_rho = (A3 + 2 c^2)/(2 b c) and t_k = (z_C - z_B)/b are of first degree in cos(phi), sin(phi) and need no rocker
    angle; sin^2(pressure angle) = t_rho^2 + t_k^2.

    Parameters
    ----------
    designs : (n, 8)
    ellipse : (n, 7) out; t_rho and t_k as constant, cosine, sine each, and the size of the terms that round
    """
    for i in range(designs.shape[0]):
        a, b, c = designs[i, 0], designs[i, 1], designs[i, 2]
        e, f, g = designs[i, 3], designs[i, 4], designs[i, 5]
        sa, ca = sincos(designs[i, 6])
        q, q_size, rise = axial_terms(f, g, designs[i, 6], ca)
        per = 1.0 / (b * c)
        out = ellipse[i]
        # The sizes of the terms are kept apart from their sums: rounding is proportional to the former.
        out[0] = 0.5 * per * (b * b + c * c - a * a - e * e - q)
        out[1], out[2] = per * (a * e), -per * (a * g * sa)
        out[3], out[4], out[5] = -rise / b, 0.0, a * sa / b
        radial = 0.5 * per * (b * b + c * c + a * a + e * e + q_size) + per * a * (abs(e) + abs(g * sa))
        out[6] = radial + (abs(g) + abs(f * ca) + a) / b


Indices: TypeAlias = NDArray[np.int64]

# The helpers of the loop below are contracted like the loop itself: a product and a sum become one instruction.
place_fused = inline_fused(place)
rocker_fused = inline_fused(rocker)
velocity_fused = inline_fused(velocity)
acceleration_fused = inline_fused(acceleration)
jerk_fused = inline_fused(jerk)


@kernel_fused
def dense_maxima(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    min_delta: Array,
    max_abs_dpsi: Array | None,
    max_abs_d2psi: Array | None,
    max_abs_d3psi: Array | None,
    at: Indices | None = None,
    values: Array | None = None,
) -> None:
    """Largest |psi'|, |psi''|, |psi'''| over a grid of crank angles, and the smallest Delta; the sweep's hot loop.

    Parameters
    ----------
    designs : (n, 8) columns as `PARAMETERS` of sweep/families/rssr.py
    cos_phi, sin_phi : (m,) the grid, shared by all designs; m a multiple of 8 is fastest
    min_delta : (n,) out, smallest Delta/b^2 on the grid; where it is not positive the maxima mean nothing
    max_abs_dpsi, max_abs_d2psi, max_abs_d3psi : (n,) out, or None: not computed, not compiled
    at : (n,) int64 out, or None: position on the grid of the largest value of the highest order wanted
    values : (m,) scratch, needed with ``at``

    Notes
    -----
    Delta is clamped to a tiny positive number under the root, so the loop has no branch and vectorises;
    the unclamped minimum tells whether the clamp was used.  An invalid design has min_delta nan.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        least, m1, m2, m3 = 1e300, 0.0, 0.0, 0.0
        for j in range(cos_phi.size):
            place = place_fused(r.e, r.y0, r.ca, r.k0, r.k1, r.k2, cos_phi[j], sin_phi[j])
            least = smallest(least, place.delta)
            if max_abs_dpsi is not None or max_abs_d2psi is not None or max_abs_d3psi is not None:
                # A clamp instead of a branch; the minimum of the discriminant itself tells that it was used.
                t = math.sqrt(largest(place.delta, 1e-300))
                rocker = rocker_fused(place, t, 1.0 / (place.rr * t))
                first = velocity_fused(r.k1, r.k2, rocker, place)
                if max_abs_dpsi is not None:
                    m1 = largest(m1, abs(first.p))
                    if values is not None:
                        values[j] = abs(first.p)
                if max_abs_d2psi is not None or max_abs_d3psi is not None:
                    second = acceleration_fused(rocker, place, first)
                    if max_abs_d2psi is not None:
                        m2 = largest(m2, abs(second.q))
                        if values is not None:
                            values[j] = abs(second.q)
                    if max_abs_d3psi is not None:
                        jerk = jerk_fused(rocker, place, first, second)
                        m3 = largest(m3, abs(jerk))
                        if values is not None:
                            values[j] = abs(jerk)
        min_delta[i] = least / (r.coupler * r.coupler) if r.valid else math.nan
        write_number(max_abs_dpsi, i, m1)
        write_number(max_abs_d2psi, i, m2)
        write_number(max_abs_d3psi, i, m3)
        if at is not None and values is not None:
            most = m3 if max_abs_d3psi is not None else (m2 if max_abs_d2psi is not None else m1)
            # The maximum is one of the stored values, so it is found again by equality.
            at[i] = 0
            for j in range(cos_phi.size):
                if values[j] == most:
                    at[i] = j
                    break
