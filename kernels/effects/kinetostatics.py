"""D1, D3: joint reactions, finger couple, driving torque and reduced inertia of crank, coupler and follower.

Coupler and follower are solved together, by the numbered formulas of docs/effects.md.  The coupler's balance of moments
gives the finger couple and the part of the force at B across the coupler.  The part along the coupler follows from the
follower: of a rocker from the moments about its axis, of a slider from the forces along its way.  Friction couples
enter linearly, so the friction effect calls :func:`solve` again with its couples.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kernels import status as st
from kernels.arithmetic.vectors import Vector, add, cross, dot, mix, scale, spun, sub, turned
from kernels.effects.coupler import DRIVEN, LEAST_SINE, Coupler, orientation
from kernels.jit import inline, kernel
from kernels.linkage.joints import Joints, read
from kernels.types import Array, Status

# Inertia reactions grow as 1/cos^4 of the pressure angle and lose the share 2^-53/cos^2 of their digits: at this cosine
# 4e-4 of the value; beyond it no number is given.
LEAST_COSINE = 5e-7

BODY = 10  # m, centre of mass (3), inertia xx xy xz yy yz zz about it, all in the body frame
LOAD, SPEED, CHANGE = 0, 1, 2  # columns of the drive: torque or force on the follower, crank speed, its rate

Tensor = tuple[float, float, float, float, float, float]


class Body(NamedTuple):
    """Mass, centre of mass from the frame origin and inertia about it, in fixed axes resp. body axes."""

    mass: float
    centre: Vector
    inertia: Tensor
    first: Vector
    second: Vector
    third: Vector


class Loading(NamedTuple):
    """Loads on the links.

    Parameters
    ----------
    bodies : (n, 3 BODY + 3): per body m, centre of mass, inertia about it (body axes: crank rho_B, tau_B, u from A;
        coupler s, n x s, n from B; follower rho, tau, k from D); gravity
    drive : (n, m, 3) or (n, 1, 3): torque on the rocker about k or force on the slider along tau; crank speed; its rate
    on_coupler : (n, m, 6) or None; external force on the coupler and its moment about B, fixed axes
    on_follower : (n, m, 6) or None; external force on the follower and its moment about D, fixed axes
    """

    bodies: Array
    drive: Array
    on_coupler: Array | None = None
    on_follower: Array | None = None


class Loads(NamedTuple):
    """Inertia forces F = m (a - gravity) less external ones and torques T about the centres of mass, with arms d."""

    f1: Vector
    t1: Vector
    d1: Vector
    f2: Vector
    t2: Vector
    d2: Vector
    f3: Vector
    t3: Vector
    d3: Vector
    torque: float
    omega1: Vector
    omega2: Vector
    omega3: Vector
    j_red: float
    dj_red: float


class Reactions(NamedTuple):
    """Forces on the joints and moments of the two bearings; see :func:`kinetostatics`."""

    r_a: Vector
    m_a: Vector
    r_b: Vector
    r_c: Vector
    r_d: Vector
    m_d: Vector
    finger: float
    drive: float


@inline
def _body(data: Array, x: Vector, y: Vector, z: Vector) -> Body:
    centre = turned(x, y, z, (data[1], data[2], data[3]))
    return Body(data[0], centre, (data[4], data[5], data[6], data[7], data[8], data[9]), x, y, z)


@inline
def _inertia_times(body: Body, a: Vector) -> Vector:
    """Inertia tensor times a vector given in fixed axes."""
    p, q, r = dot(body.first, a), dot(body.second, a), dot(body.third, a)
    xx, xy, xz, yy, yz, zz = body.inertia
    local = (xx * p + xy * q + xz * r, xy * p + yy * q + yz * r, xz * p + yz * q + zz * r)
    return turned(body.first, body.second, body.third, local)


@inline
def _torque(body: Body, omega: Vector, eps: Vector) -> Vector:
    """Rate of the moment of momentum about the centre of mass."""
    return add(_inertia_times(body, eps), cross(omega, _inertia_times(body, omega)))


@inline
def _less(force: Vector, torque: Vector, arm: Vector, wrenches: Array | None, i: int, k: int) -> tuple[Vector, Vector]:
    """Inertia force and torque of a link less an external force on it and the moment about its frame origin.

    F_i - F takes the place of F_i everywhere; T_i is corrected so that the moment about the origin is right.
    """
    if wrenches is None:
        return force, torque
    wrench = wrenches[i, k]
    given, moment = (wrench[0], wrench[1], wrench[2]), (wrench[3], wrench[4], wrench[5])
    return sub(force, given), add(sub(torque, moment), cross(arm, given))


@inline
def loads_of(j: Joints, coupler: Coupler, given: Loading, i: int, k: int) -> Loads:
    """Compute the loads of the three bodies, and reduced inertia with its derivative, in pose k of design i."""
    bodies, drive = given.bodies[i], given.drive[i, k if given.drive.shape[1] > 1 else 0]
    gravity = (bodies[3 * BODY], bodies[3 * BODY + 1], bodies[3 * BODY + 2])
    torque, speed, change = drive[LOAD], drive[SPEED], drive[CHANGE]
    crank = _body(bodies[:BODY], j.rho_b, j.tau_b, j.u)
    rod = _body(bodies[BODY : 2 * BODY], j.s, coupler.across, coupler.n)
    rocker = _body(bodies[2 * BODY : 3 * BODY], j.rho, j.tau, j.k)
    square = speed * speed
    omega1, eps1 = scale(speed, j.u), scale(change, j.u)
    omega2 = scale(speed, coupler.omega)
    eps2 = mix(square, coupler.eps, change, coupler.omega)
    along = square * j.d2psi + change * j.dpsi
    omega3, eps3 = scale(j.turns * (speed * j.dpsi), j.k), scale(j.turns * along, j.k)
    # Rates of the coupler's centre of mass per unit speed serve the reduced inertia as well.
    v2 = add(coupler.v_b, cross(coupler.omega, rod.centre))
    a2 = add(coupler.a_b, spun(coupler.omega, coupler.eps, rod.centre))
    f1 = scale(crank.mass, sub(spun(omega1, eps1, crank.centre), gravity))
    f2 = scale(rod.mass, sub(mix(square, a2, change, v2), gravity))
    a_g3 = mix(1.0, spun(omega3, eps3, rocker.centre), (1.0 - j.turns) * along, j.tau)
    f3 = scale(rocker.mass, sub(a_g3, gravity))
    f2, t2 = _less(f2, _torque(rod, omega2, eps2), rod.centre, given.on_coupler, i, k)
    f3, t3 = _less(f3, _torque(rocker, omega3, eps3), rocker.centre, given.on_follower, i, k)
    about_crank = _about_axis(crank, j.u)
    about_rocker = _about_axis(rocker, j.k) if j.turns > 0.0 else rocker.mass
    rod_omega = _inertia_times(rod, coupler.omega)
    j_red = about_crank + rod.mass * dot(v2, v2) + dot(coupler.omega, rod_omega) + about_rocker * j.dpsi * j.dpsi
    dj_red = 2.0 * (rod.mass * dot(v2, a2) + dot(rod_omega, coupler.eps) + about_rocker * j.dpsi * j.d2psi)
    return Loads(
        f1, _torque(crank, omega1, eps1), crank.centre, f2, t2, rod.centre, f3, t3, rocker.centre,
        torque, omega1, omega2, omega3, j_red, dj_red,
    )  # fmt: skip


@inline
def put_plane(out: Array | None, i: int, k: int, good: float, a: Vector) -> None:
    """Write the load on the frame, (n, 3, m), from the load of the frame on the bodies; compiled only with ``out``."""
    if out is not None:
        out[i, 0, k], out[i, 1, k], out[i, 2, k] = -good * a[0], -good * a[1], -good * a[2]


@inline
def borne(j: Joints, on: Loads) -> tuple[Vector, Vector]:
    """Force and moment of the frame on all bodies, about the origin: their inertia loads less the useful load."""
    slides = 1.0 - j.turns
    pushed = scale(slides * on.torque, j.tau)
    force = sub(add(add(on.f1, on.f2), on.f3), pushed)
    moment = add(add(on.t1, cross(add(j.A, on.d1), on.f1)), add(on.t2, cross(add(j.B, on.d2), on.f2)))
    at = mix(j.turns, j.D, slides, j.C)
    moment = add(moment, add(on.t3, cross(add(at, on.d3), on.f3)))
    return force, sub(sub(moment, scale(j.turns * on.torque, j.k)), cross(at, pushed))


@inline
def _about_axis(body: Body, axis: Vector) -> float:
    """Moment of inertia about an axis through the frame origin."""
    across = cross(axis, body.centre)
    return dot(axis, _inertia_times(body, axis)) + body.mass * dot(across, across)


@inline
def solve(
    j: Joints, coupler: Coupler, on: Loads, construction: float, e_b: Vector, e_c: Vector, t_d: float, t_a: float
) -> Reactions:
    """Reactions of one pose under the friction couples e_b, e_c on the coupler and torques t_d, t_a on the shafts.

    On a slider t_d is the friction force of its guide along tau.
    """
    q_c = sub(sub(sub(add(on.t2, cross(on.d2, on.f2)), scale(j.b, cross(j.s, on.f2))), e_b), e_c)
    q = cross(coupler.n, coupler.w)
    finger = dot(q_c, j.s) / dot(q, j.s)
    normal = scale(1.0 / j.b, cross(j.s, mix(1.0, q_c, -finger, q)))  # part of R_B across the coupler
    moment3 = add(on.t3, cross(on.d3, on.f3))
    on_rocker = finger if construction == DRIVEN else 0.0
    on_crank = 0.0 if construction == DRIVEN else finger
    if j.turns > 0.0:
        needed = (dot(moment3, j.k) - on.torque - t_d + dot(e_c, j.k) + on_rocker * dot(q, j.k)) / j.c
    else:
        needed = dot(on.f3, j.tau) - on.torque - t_d
    axial = (needed - dot(sub(normal, on.f2), j.tau)) / j.t_tau
    r_b = add(normal, scale(axial, j.s))
    r_c = sub(r_b, on.f2)
    r_d = mix(1.0, sub(on.f3, r_c), -(1.0 - j.turns) * on.torque, j.tau)
    arm, load = j.turns * j.c, j.turns * on.torque
    m_d = add(sub(sub(moment3, scale(arm, cross(j.rho, r_c))), scale(load, j.k)), add(e_c, scale(on_rocker, q)))
    # A bearing takes nothing but friction in the direction of motion; as a difference of all loads it had no digits.
    m_d = add(m_d, scale(j.turns * (t_d - dot(m_d, j.k)), j.k))
    r_d = add(r_d, scale((1.0 - j.turns) * (t_d - dot(r_d, j.tau)), j.tau))
    r_a = add(on.f1, r_b)
    m_a = add(add(add(on.t1, cross(on.d1, on.f1)), scale(j.a, cross(j.rho_b, r_b))), add(e_b, scale(on_crank, q)))
    m_a = sub(m_a, scale(t_a, j.u))
    return Reactions(r_a, m_a, r_b, r_c, r_d, m_d, finger, dot(m_a, j.u))


@kernel
def kinetostatics(
    poses: Array,
    designs: Array,
    finger: Array,
    given: Loading,
    status: Status,
    forces: Array | None,
    couples: Array | None,
    inertia: Array | None,
    frame_force: Array | None = None,
    frame_moment: Array | None = None,
) -> None:
    """Compute the frictionless joint reactions, driving torque, reduced inertia, and the load on the frame.

    Parameters
    ----------
    poses : (n, m, PER_POSE), designs : (n, PER_DESIGN), records of :mod:`kernels.linkage.joints`
    finger : (n,) DRIVEN or DRIVING, which ball joint carries the finger
    given : masses, inertias and loads of the links
    status : (n, m), in and out; DEAD_POINT where cos(pressure angle) < LEAST_COSINE, SINGULAR where the finger axis
        meets the coupler: both give nan
    forces : (n, m, 18) or None, fixed axes; force frame on crank, crank on coupler, coupler and frame on follower;
        moment of the frame on crank (about A) and follower (about D)
    couples : (n, m, 2) or None; couple of the finger along n x w, torque on the crank about u
    inertia : (n, m, 2) or None; inertia reduced to the crank and its derivative
    frame_force, frame_moment : (n, 3, m) or None; force on the frame, and moment about its origin, that of the drive
        included.  They follow from the inertia loads alone: nothing is solved, and internal friction has no effect

    Notes
    -----
    Measured on the oracle table: error below 64 * 2^-53 * sensitivity in all rows.
    """
    zero = (0.0, 0.0, 0.0)
    for i in range(poses.shape[0]):
        for k in range(poses.shape[1]):
            j = read(poses[i, k], designs[i])
            coupler = orientation(j, finger[i])
            status[i, k] = pose_status(status[i, k], j, coupler)
            good = 1.0 if status[i, k] == st.OK else math.nan
            load = loads_of(j, coupler, given, i, k)
            if inertia is not None:
                inertia[i, k, 0], inertia[i, k, 1] = good * load.j_red, good * load.dj_red
            if frame_force is not None or frame_moment is not None:
                force, moment = borne(j, load)
                put_plane(frame_force, i, k, good, force)
                put_plane(frame_moment, i, k, good, moment)
            if forces is not None or couples is not None:
                r = solve(j, coupler, load, finger[i], zero, zero, 0.0, 0.0)
                if forces is not None:
                    store_forces(forces[i, k], good, r)
                if couples is not None:
                    couples[i, k, 0], couples[i, k, 1] = good * r.finger, good * r.drive


@inline
def pose_status(code: int, j: Joints, coupler: Coupler) -> int:
    """Status of a pose for forces: its own, or the reason why its reactions have no correct digits."""
    if code != st.OK:
        return code
    if not abs(j.t_tau) >= LEAST_COSINE:
        return st.DEAD_POINT
    if not coupler.sine > LEAST_SINE:
        return st.SINGULAR
    return st.OK


@inline
def store_forces(out: Array, good: float, r: Reactions) -> None:
    """Write the six vectors of one pose, (18,); ``good`` is 1 or nan."""
    for k in range(3):
        out[k], out[3 + k], out[6 + k] = good * r.r_a[k], good * r.r_b[k], good * r.r_c[k]
        out[9 + k], out[12 + k], out[15 + k] = good * r.r_d[k], good * r.m_a[k], good * r.m_d[k]
