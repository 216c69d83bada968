"""Motion of the spatial crank-rocker at given crank angles: position, transfer functions, joints, pressure angle."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2, hypotenuse
from kernels.families.rssr.closure import (
    ClosurePose,
    Numbers,
    Reduced,
    Status,
    discriminant_tolerance,
    place,
    reduce_design,
)
from kernels.families.rssr.derivatives import Rocker, acceleration, jerk, velocity
from kernels.jit import inline, kernel
from kernels.linkage.verdict import pose_status


class Joints(NamedTuple):
    """Coordinates of the crank pin B and the rocker ball C [length], each (n, m) out, or None: not computed."""

    x_b: Numbers | None
    y_b: Numbers | None
    z_b: Numbers | None
    x_c: Numbers | None
    y_c: Numbers | None
    z_c: Numbers | None


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
    discriminant: Numbers | None,
    pressure_angle: Numbers | None,
    joints: Joints | None,
) -> None:
    """Position, transfer functions, discriminant, pressure angle and joints of every design at its crank angles.

    Equations (2*), (3)-(5) and (13) of docs/rssr.md; joints in the fixed frame of its section 1.

    Parameters
    ----------
    designs : (n, 8) columns of :class:`Design`; complex128 for gradients by the complex step
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs; complex128 where they depend on the designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR or INVALID_INPUT
    psi ... pressure_angle : (n, m) out, or None: what is None is neither computed nor compiled; complex128 if an input
        is
    joints : record of (n, m) arrays or None, or None if no joint is wanted

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
            if discriminant is not None:
                discriminant[i, j] = (at.delta * two_ac) * two_ac if r.valid else math.nan
            t = np.sqrt(at.delta) if code == st.OK else 0.0
            has_angle = code == st.OK or code == st.DEAD_POINT
            c = (at.x * at.w + at.y * t) / at.rr if has_angle else math.nan
            s = (at.x * t - at.y * at.w) / at.rr if has_angle else math.nan
            if cos_psi is not None:
                cos_psi[i, j] = -c
            sine = 0.0 - r.branch * s  # never -0.0, which would turn the angle pi into -pi
            if sin_psi is not None:
                sin_psi[i, j] = sine
            if psi is not None:
                psi[i, j] = arctan2(sine, -c)
            if pressure_angle is not None:
                # arctangent, not acos: acos loses half the digits near zero.
                across = hypotenuse(r.rocker - at.w, r.z0 - r.sa * at.v)
                pressure_angle[i, j] = arctan2(across, t) if has_angle else math.nan
            if joints is not None:
                _put_joints(joints, designs, i, j, r, at, c, s, has_angle)
            if dpsi is not None or d2psi is not None or d3psi is not None:
                to = Rocker(c, s, t, 1.0 / t if code == st.OK else math.nan)
                _put_derivatives(dpsi, d2psi, d3psi, i, j, r, at, to)


@inline
def put(out: Numbers | None, i: int, j: int, value: Any) -> None:
    """Write a value where it is wanted; through a function, since a field that is None cannot be written to."""
    if out is not None:
        out[i, j] = value


@inline
def _put_joints(
    joints: Joints, designs: Numbers, i: int, j: int, r: Reduced, at: ClosurePose, c: Any, s: Any, has_angle: bool
) -> None:
    """Write the wanted coordinates; c and s are minus cosine and minus sine of the mirrored rocker angle."""
    if joints.x_b is not None:
        put(joints.x_b, i, j, designs[i, 0] * at.u if r.valid else math.nan)
    if joints.y_b is not None:
        along, across = designs[i, 4] * r.sa, designs[i, 0] * r.branch * at.hv
        put(joints.y_b, i, j, along + across if r.valid else math.nan)
    if joints.z_b is not None:
        lift = designs[i, 4] * (r.branch * r.ca) - designs[i, 0] * (r.sa * at.v)
        put(joints.z_b, i, j, lift if r.valid else math.nan)
    if joints.x_c is not None:
        put(joints.x_c, i, j, designs[i, 3] - designs[i, 2] * c)
    if joints.y_c is not None:
        put(joints.y_c, i, j, -r.branch * designs[i, 2] * s)
    if joints.z_c is not None:
        put(joints.z_c, i, j, designs[i, 5] if has_angle else math.nan)


@inline
def _put_derivatives(
    dpsi: Numbers | None,
    d2psi: Numbers | None,
    d3psi: Numbers | None,
    i: int,
    j: int,
    r: Reduced,
    at: ClosurePose,
    to: Rocker,
) -> None:
    """Write the wanted transfer functions up to the highest of them, mirrored back to the branch."""
    first = velocity(r.k1, r.k2, to, at)
    if dpsi is not None:
        dpsi[i, j] = -r.branch * first.p
    if d2psi is not None or d3psi is not None:
        second = acceleration(to, at, first)
        if d2psi is not None:
            d2psi[i, j] = -r.branch * second.q
        if d3psi is not None:
            d3psi[i, j] = r.branch * jerk(to, at, first, second)
