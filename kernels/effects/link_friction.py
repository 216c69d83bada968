"""D2 for any number of links: friction of shafts, balls, guides and contacts, by successive approximations.

Friction at a joint is a wrench of known direction times the joint's load: directions follow from the motion, the load
from the reactions.  Loads from the latest reactions give new reactions, until the loads change by less than
TOLERANCE.  Reactions are linear in the loads, and loads are norms of reactions, so the iteration contracts for ordinary
lubrication (6 to 15 passes) and diverges where the linkage jams: if five passes in a row do not shrink the correction,
or the largest number of passes is reached, the status is JAMMED; the last iterate is never returned.  Near jamming the
corrections form a slow geometric series, whose remainder is added every tenth pass.
Equation numbers are of docs/links.md.
"""

from __future__ import annotations

import math

import numpy as np

from kernels import status as st
from kernels.arithmetic.vectors import Vector, add, cross, dot, mix, norm, scale, sub
from kernels.effects.friction import STILL, settled, support_forces, unit_vector
from kernels.effects.link_loads import (
    BODY_OF,
    CONTACT,
    FREEDOM,
    GUIDE,
    KIND,
    LINE,
    LINES,
    ROD,
    SHAFT,
    SPEED,
    WRENCH,
    Index,
    Room,
    TreeLoading,
    driving,
    needed,
    prepare,
    put_lines,
    put_reactions,
    room_for,
    solve,
)
from kernels.jit import inline, kernel
from kernels.linkage.bodies import DRIVEN, SLIDE, Links, Moving, latter, moving, posed, put_wrench, vector, velocity_at
from kernels.types import Array, Status

MU, RADIUS, THRUST, FIRST, SECOND, PER_FRICTION = 0, 1, 2, 3, 4, 5
PART = 7  # of a shaft or a guide the forces on both supports across the axis, then that along it; else the force


@inline
def _rates(record: Array, body: int) -> Moving:
    """Rates of a body from its record; zero for the frame."""
    moves, found = (1.0 if body >= 0 else 0.0), moving(record)
    return Moving(
        found.at, scale(moves, found.v), scale(moves, found.a), scale(moves, found.omega), scale(moves, found.eps)
    )


@inline
def _moved(a: Vector, b: Vector) -> Vector:
    """Difference of two rates, zero where it is rounding: without motion friction has no direction.

    In planar linkages coupler and rocker turn together where the crank points along the frame.
    """
    found = sub(a, b)
    return found if norm(found) > STILL * (norm(a) + norm(b)) else (0.0, 0.0, 0.0)


@inline
def _lever(kind: int, data: Array) -> float:
    """Friction radius of a joint; of a shaft that rubs at its collar alone the thrust radius."""
    bare = kind == SHAFT and data[RADIUS] == 0.0
    return float(data[THRUST] if bare else data[RADIUS])


@inline
def _allowed(links: Links, i: int, k: int, body: int, slip: Vector) -> Vector:
    """Part of a body's sliding on its parent along the ways that it has: two for the block of a fork, else one."""
    found = (0.0, 0.0, 0.0)
    for which in range(links.freedoms.shape[1]):
        way = vector(links.axes[i, k, which])
        own = links.freedoms[i, which, 0] == body and links.freedoms[i, which, 1] == SLIDE
        found = mix(1.0, found, dot(slip, way) if own else 0.0, way)
    return found


@inline
def direction(
    links: Links, i: int, k: int, joint: Index, ends: Index, place: Vector, data: Array, speed: float
) -> tuple[Vector, Vector, float]:
    """Friction force and couple of a joint per unit of its load, (7), (8), and their power per unit crank speed."""
    records, lines, axis = links.bodies[i, k], links.lines[i, k], vector(links.axes[i, k, max(joint[FREEDOM], 0)])
    one, two = _rates(records[max(ends[0], 0)], ends[0]), _rates(records[max(ends[1], 0)], ends[1])
    rod, slender, kind = posed(records[max(joint[ROD], 0)]).x, joint[ROD], joint[KIND]
    rubs, radius = data[MU], _lever(kind, data)
    sense = math.copysign(1.0, speed) if speed != 0.0 else 0.0
    turn, slip = _moved(one.omega, two.omega), (0.0, 0.0, 0.0)
    if slender >= 0:
        # A rod is free to turn about its own axis: it spins so that no couple acts about it.
        turn = mix(1.0, turn, -dot(turn, rod), rod)
    if kind in (GUIDE, CONTACT):
        slip = _moved(velocity_at(one, place), velocity_at(two, place))
    # Sliding that the joint does not allow is rounding; next to a reversal it would be a share of the true sliding.
    if kind == GUIDE:
        slip = _allowed(links, i, k, joint[BODY_OF], slip)
    for which in range(joint[LINE], joint[LINE] + joint[LINES]):
        across = latter(lines[which])
        slip = mix(1.0, slip, -dot(slip, across), across)
    mu = -sense * rubs
    couple, force = scale(mu * radius, unit_vector(turn)), scale(mu, unit_vector(slip))
    if kind in (SHAFT, GUIDE):
        around = radius * dot(turn, axis)
        whole = math.hypot(around, norm(slip))
        per = mu / whole if whole > 0.0 else 0.0
        couple, force = scale(per * radius * around, axis), scale(per, slip)
    return force, couple, dot(force, slip) + dot(couple, turn)


@inline
def _put_parts(links: Links, i: int, k: int, joints: Index, friction: Array, room: Room, parts: Array) -> None:
    """Write the vectors whose norms are the loads of each joint, for every solution, (Q, A, PART)."""
    for which in range(joints.shape[0]):
        data, axis = friction[which], vector(links.axes[i, k, max(joints[which, FREEDOM], 0)])
        held = joints[which, KIND] == SHAFT or joints[which, KIND] == GUIDE
        for answer in range(room.x.shape[1]):
            found, out = room.found[which, answer], parts[which, answer]
            borne = support_forces(vector(found), latter(found), axis, data[FIRST], data[SECOND])
            force, other, along = borne if held else (vector(found), (0.0, 0.0, 0.0), 0.0)
            out[0], out[1], out[2] = force[0], force[1], force[2]
            out[3], out[4], out[5], out[6] = other[0], other[1], other[2], along


@inline
def _sizes(joint: Index, data: Array, part: Array) -> tuple[float, float, float]:
    """Load of a joint that friction is proportional to, (9), and the loads of its two supports across the axis."""
    kind, lever, thrust = joint[KIND], _lever(joint[KIND], data), data[THRUST] * abs(part[6])
    first, other = norm(vector(part)), norm(latter(part))
    share = thrust / lever if kind == SHAFT and lever > 0.0 else 0.0
    held = 1.0 if kind in (SHAFT, GUIDE) else 0.0
    across = first + other if kind != SHAFT or data[RADIUS] > 0.0 else 0.0
    return across + share, held * first, held * other


@inline
def _sum(answers: Array, loads: Array, total: Array) -> None:
    """Sum the solutions (A, N), without friction and per unit load of each joint, at the loads (Q,), into (N,)."""
    for at in range(total.shape[0]):
        total[at] = answers[0, at]
    for which in range(loads.shape[0]):
        for at in range(total.shape[0]):
            total[at] += loads[which] * answers[1 + which, at]


@inline
def _new_loads(loads: Array, new: Array, joints: Index, friction: Array, parts: Array, part: Array) -> None:
    """Write the loads of all joints under the reactions that friction at these loads causes."""
    for which in range(joints.shape[0]):
        _sum(parts[which], loads, part)
        new[which] = _sizes(joints[which], friction[which], part)[0]


@kernel
def link_friction(
    links: Links,
    joints: Index,
    given: TreeLoading,
    friction: Array,
    status: Status,
    forces: Array | None,
    torque: Array | None,
    lost: Array | None,
    on_supports: Array | None,
) -> None:
    """Compute joint reactions and driving torque with friction.

    Further arguments are those of :mod:`kernels.effects.link_loads`.

    Parameters
    ----------
    friction : (n, Q, PER_FRICTION), of each joint coefficient, friction radius, mean thrust radius, places of its two
        supports along its axis from its place; a ball or a contact reads the first two
    status : also JAMMED where the loads do not converge
    forces : (n, m, Q, 6) or None; friction included, but at a driven joint the drive torque in its place
    lost : (n, m, Q + 1) or None; share of each joint's friction in the driving torque; passes of the iteration
    on_supports : (n, m, Q, 2) or None; loads of the supports across the axis; 0 for balls and contacts
    """
    number = joints.shape[0]
    room, parts = room_for(links, number, number), np.empty((number, 1 + number, PART))
    loads, new, steps, part = np.empty(number), np.empty(number), np.empty(number), np.empty(PART)
    power, total = np.empty(number), np.empty(WRENCH)
    lines = room.rows.shape[0]
    for i in range(status.shape[0]):
        prepare(links, i, joints, room)
        for k in range(status.shape[1]):
            drive = given.drive[i, k if given.drive.shape[1] > 1 else 0]
            needed(links, i, k, given, drive, room)
            put_lines(links, i, k, joints, room)
            for which in range(number):
                joint, place = joints[which], vector(room.places[which])
                found = direction(links, i, k, joint, room.ends[which], place, friction[i, which], drive[SPEED])
                put_wrench(room.units[lines + which], found[0], place, found[1])
                power[which] = found[2]
            solvable = solve(links, i, room)
            if status[i, k] == st.OK and not solvable:
                status[i, k] = st.DEAD_POINT
            put_reactions(joints, room)
            _put_parts(links, i, k, joints, friction[i], room, parts)
            passes = settled(_new_loads, loads, new, steps, friction[i, :, MU], joints, friction[i], parts, part)
            if status[i, k] == st.OK and passes < 0:
                status[i, k] = st.JAMMED
            good = 1.0 if status[i, k] == st.OK else math.nan
            if torque is not None:
                torque[i, k] = driving(links, i, room, 0)
                for which in range(number):
                    torque[i, k] += loads[which] * driving(links, i, room, 1 + which)
                torque[i, k] *= good
            if forces is not None:
                _store(links, i, k, joints, room, loads, good, total, forces)
            for which in range(number):
                _sum(parts[which], loads, part)
                _, first, other = _sizes(joints[which], friction[i, which], part)
                if lost is not None:
                    lost[i, k, which] = -good * loads[which] * power[which]
                if on_supports is not None:
                    on_supports[i, k, which, 0], on_supports[i, k, which, 1] = good * first, good * other
            if lost is not None:
                lost[i, k, number] = good * passes


@inline
def _store(
    links: Links,
    i: int,
    k: int,
    joints: Index,
    room: Room,
    loads: Array,
    good: float,
    total: Array,
    forces: Array,
) -> None:
    """Write the force and moment of each joint, friction included."""
    lines = room.rows.shape[0]
    for which in range(joints.shape[0]):
        _sum(room.found[which], loads, total)
        force, moment = vector(total), latter(total)
        rubbing, place = room.units[lines + which], vector(room.places[which])
        rubbed = scale(loads[which], vector(rubbing))
        couple = sub(scale(loads[which], latter(rubbing)), cross(place, rubbed))
        force, whole = add(force, rubbed), add(moment, couple)
        freedom = links.freedoms[i, max(joints[which, FREEDOM], 0), 1]
        driven = min(joints[which, KIND] == SHAFT, freedom == DRIVEN)
        shown = moment if driven else whole
        for at in range(3):
            forces[i, k, which, at], forces[i, k, which, 3 + at] = good * force[at], good * shown[at]
