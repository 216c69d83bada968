"""U3: a tool on the coupler or the rocker, such as a needle bar: its inertia, weight and working force as a load.

The equation numbers are those of docs/tool.md.  A rod of mass m moves along a fixed direction lam
with the point M of the coupler that it hangs on.  Its momentum along lam gives the force of the rod on the coupler,

    F_M = -(m (s'' omega^2 + s' eps - g . lam) - F) lam,      s' = v_M . lam, s'' = a_M . lam                 (1), (2)

with F the working force on the rod along lam, of which a part may act while the rod pierces the fabric (5).  The load
across lam on the rod's own guide is statically undetermined: the coupler guides the point already.  Its least value is
zero, and zero is taken.

A tool whose point moves freely, on the coupler or at the tip of a rocker, puts -(m (a_P - g) - F) on its link, (6).  So
does the rod, with the parts of these vectors along lam.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kernels import status as st
from kernels.arithmetic.vectors import Vector, add, cross, dot, mix, norm, scale, spun, sub
from kernels.effects.coupler import orientation
from kernels.effects.kinetostatics import CHANGE, SPEED, pose_status
from kernels.jit import inline, kernel
from kernels.linkage.bodies import vector
from kernels.linkage.joints import Joints, read
from kernels.types import Array, Status

# Columns of the data matrix of a tool that moves freely: mass; its point, of the coupler from B along it, across it
# (k x s) and along the rocker's axis, of the rocker from D along rho, tau, k; gravity.  Of one on a line also lam;
# piercing force, place of the fabric along lam, sense in which it lies.
FREE = 7


class ToolLoad(NamedTuple):
    """Outputs of a tool; None where an output is not wanted.

    Parameters
    ----------
    wrench : (n, m, 6) force and moment on its link, about B on the coupler, about D on the rocker, fixed axes
    inertia : (n, m, 2) m s'^2, of a free point m |P'|^2, and its derivative by the crank angle
    along : (n, m, 2) force of the link on the tool, along lam or its magnitude, and its power per unit crank speed
    """

    wrench: Array | None = None
    inertia: Array | None = None
    along: Array | None = None


@inline
def _put_wrench(out: Array | None, i: int, k: int, force: Vector, moment: Vector) -> None:
    if out is not None:
        for x in range(3):
            out[i, k, x], out[i, k, 3 + x] = force[x], moment[x]


@inline
def _put(out: Array | None, i: int, k: int, good: float, first: float, second: float) -> None:
    if out is not None:
        out[i, k, 0], out[i, k, 1] = good * first, good * second


@inline
def _part(a: Vector, lam: Vector) -> Vector:
    """Part of a vector along lam."""
    return scale(dot(a, lam), lam)


@inline
def arm(j: Joints, data: Array) -> Vector:
    """Vector from B to the tool's point, fixed axes; across is along k x s, whichever ball joint has the finger."""
    return add(mix(data[1], j.s, data[2], cross(j.k, j.s)), scale(data[3], j.k))


@inline
def piercing(force: float, fabric: float, sense: float, s: float, ds: float) -> float:
    """Force on the tool along lam while it goes into the fabric: from entry to the turning point, not back."""
    return -sense * force if sense * (s - fabric) > 0.0 and sense * ds > 0.0 else 0.0


@kernel
def tool_load(
    poses: Array,
    designs: Array,
    data: Array,
    drive: Array,
    working: Array,
    finger: Array,
    on_rocker: bool,
    status: Status,
    out: ToolLoad,
) -> None:
    """Compute a tool's force on its link, its moment there, and the inertia that it adds to the crank's.

    Parameters
    ----------
    poses : (n, m, PER_POSE), designs : (n, PER_DESIGN), records of :mod:`kernels.linkage.joints`
    data : (n, FREE or FREE + 6), see FREE; lam a unit vector
    drive : (n, m or 1, 3), of which the crank speed and its rate are read
    working : (n, m or 1, 3 or 1), force F on the tool in fixed axes, or along lam; a resisting one opposes s'
    finger : (n,) DRIVEN or DRIVING
    on_rocker : whether the rocker carries the tool
    status : (n, m), in and out, as of :func:`kernels.effects.kinetostatics.kinetostatics`; what is not OK gives nan
    out : the wanted outputs
    """
    on_line = data.shape[1] > FREE
    for i in range(poses.shape[0]):
        mass, gravity = data[i, 0], vector(data[i, 4:])
        for k in range(poses.shape[1]):
            j = read(poses[i, k], designs[i])
            coupler = orientation(j, finger[i])
            status[i, k] = pose_status(status[i, k], j, coupler)
            good = 1.0 if status[i, k] == st.OK else math.nan
            if on_rocker:
                at = add(mix(data[i, 1], j.rho, data[i, 2], j.tau), scale(data[i, 3], j.k))
                first = scale(j.dpsi, cross(j.k, at))
                second = spun(scale(j.dpsi, j.k), scale(j.d2psi, j.k), at)
            else:
                at = arm(j, data[i])
                first = add(coupler.v_b, cross(coupler.omega, at))
                second = add(coupler.a_b, spun(coupler.omega, coupler.eps, at))
            now = k if drive.shape[1] > 1 else 0
            speed, change = drive[i, now, SPEED], drive[i, now, CHANGE]
            needed = scale(mass, sub(mix(speed * speed, second, change, first), gravity))
            given = working[i, k if working.shape[1] > 1 else 0]
            if on_line:
                lam = vector(data[i, FREE:])
                place, way = dot(add(j.B, at), lam), speed * dot(first, lam)
                load = dot(needed, lam) - given[0] - piercing(data[i, 10], data[i, 11], data[i, 12], place, way)
                first, second, on_tool = _part(first, lam), _part(second, lam), scale(load, lam)
            else:
                on_tool = sub(needed, vector(given))
                load = norm(on_tool)
            _put_wrench(out.wrench, i, k, scale(-good, on_tool), scale(-good, cross(at, on_tool)))
            _put(out.inertia, i, k, good, mass * dot(first, first), 2.0 * mass * dot(first, second))
            _put(out.along, i, k, good, load, dot(on_tool, first))
