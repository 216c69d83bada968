"""D2 for any number of links: friction of shafts, balls, guides and contacts, by successive approximations.

What rubs at a joint is a wrench of known direction times the joint's load: the directions follow from the motion, the
load from the reactions.  So the needed wrenches are linear in the loads.  Loads from the latest reactions give new
reactions, until the loads change by less than TOLERANCE; where they do not settle the status is JAMMED.  Equation
numbers are of docs/links.md.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.arithmetic.vectors import Vector, cross, dot, mix, norm, scale, sub
from kernels.effects.friction import PASSES, STALLED, STILL, TOLERANCE, supports, unit_vector
from kernels.effects.link_loads import (
    CONTACT,
    FREEDOM,
    GUIDE,
    KIND,
    LINE,
    LINES,
    ROD,
    SHAFT,
    WRENCH,
    add_wrench,
    at_joint,
    coefficients,
    eliminate,
    joint_ends,
    needed,
    reactions,
    right_sides,
    spread,
)
from kernels.jit import inline, kernel
from kernels.linkage.bodies import DRIVEN, Links, Moving, moving, vector, velocity_at
from kernels.types import Array, Status

Index = NDArray[np.int64]

MU, RADIUS, THRUST, FIRST, SECOND, PER_FRICTION = 0, 1, 2, 3, 4, 5


@inline
def _rates(links: Links, i: int, k: int, body: int) -> Moving:
    """Return rates of a body; the frame stands still."""
    none = (0.0, 0.0, 0.0)
    if body < 0:
        return Moving(none, none, none, none, none)
    return moving(links.bodies[i, k, body])


@inline
def _moved(a: Vector, b: Vector) -> Vector:
    """Difference of two rates, zero where it is rounding: nothing moves then, and friction has no direction."""
    found = sub(a, b)
    return found if norm(found) > STILL * (norm(a) + norm(b)) else (0.0, 0.0, 0.0)


@inline
def direction(
    links: Links, i: int, k: int, joint: Index, place: Vector, data: Array, speed: float
) -> tuple[Vector, Vector, float]:
    """Friction force and couple of a joint per unit of its load, (7), (8), and their power per unit crank speed."""
    on, by = joint_ends(links, i, joint)
    one, two = _rates(links, i, k, on), _rates(links, i, k, by)
    sense = math.copysign(1.0, speed) if speed != 0.0 else 0.0
    turn = _moved(one.omega, two.omega)
    if joint[ROD] >= 0:
        # A rod is free about its own axis: it spins so that nothing turns it there.
        along = vector(links.bodies[i, k, joint[ROD], 15:])
        turn = mix(1.0, turn, -dot(turn, along), along)
    slip = (0.0, 0.0, 0.0)
    if joint[KIND] == GUIDE or joint[KIND] == CONTACT:
        slip = _moved(velocity_at(one, place), velocity_at(two, place))
        # What the joint does not allow is rounding: next to a reversal it would be seen as a share of the sliding.
        if joint[KIND] == GUIDE:
            along = vector(links.axes[i, k, joint[FREEDOM]])
            slip = scale(dot(slip, along), along)
        else:
            for which in range(joint[LINE], joint[LINE] + joint[LINES]):
                across = vector(links.lines[i, k, which, 3:])
                slip = mix(1.0, slip, -dot(slip, across), across)
    force, couple = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    mu = -sense * data[MU]
    if joint[KIND] == SHAFT or joint[KIND] == GUIDE:
        axis = vector(links.axes[i, k, joint[FREEDOM]])
        around = data[RADIUS] * dot(turn, axis)
        whole = math.hypot(around, norm(slip))
        if whole > 0.0:
            couple = scale(mu * data[RADIUS] * around / whole, axis)
            force = scale(mu / whole, slip)
    else:
        couple, force = scale(mu * data[RADIUS], unit_vector(turn)), scale(mu, unit_vector(slip))
    return force, couple, dot(force, slip) + dot(couple, turn)


@inline
def load_of(
    links: Links, i: int, k: int, joint: Index, data: Array, found: Array, x: Array
) -> tuple[float, float, float]:
    """Load of a joint that friction is proportional to, (9), and the loads of its two supports across the axis."""
    force, moment, _ = at_joint(links, i, k, joint, found, x)
    if joint[KIND] == SHAFT or joint[KIND] == GUIDE:
        axis = vector(links.axes[i, k, joint[FREEDOM]])
        first, second, along = supports(force, moment, axis, data[FIRST], data[SECOND])
        thrust = data[THRUST] / data[RADIUS] * abs(along) if data[RADIUS] > 0.0 and joint[KIND] == SHAFT else 0.0
        return first + second + thrust, first, second
    return norm(force), 0.0, 0.0


@kernel
def link_friction(
    links: Links,
    joints: Index,
    bodies: Array,
    tool: Array,
    drive: Array,
    friction: Array,
    carrier: int,
    output: int,
    status: Status,
    forces: Array | None,
    on_frame: Array | None,
    torque: Array | None,
    lost: Array | None,
    on_supports: Array | None,
) -> None:
    """Compute joint reactions and driving torque with friction; what is not named here as in :mod:`.link_loads`.

    Parameters
    ----------
    friction : (n, Q, PER_FRICTION), of each joint coefficient, friction radius, mean thrust radius, places of its two
        supports along its axis from its place; a ball or a contact reads the first two
    status : also JAMMED where the loads do not settle
    forces : (n, m, Q, 6) or None; with what rubs, but of a driven joint with the drive torque in its place
    on_frame : (n, m, 6) or None; as without friction, what rubs on the frame included
    lost : (n, m, Q + 1) or None; share of each joint's friction in the driving torque; passes of the iteration
    on_supports : (n, m, Q, 2) or None; loads of the supports across the axis; 0 for balls and contacts
    """
    count, lines, number = links.parents.shape[0], links.lines.shape[2], joints.shape[0]
    room, rows, inverse = np.empty((count, lines + 1, WRENCH)), np.empty((lines, lines)), np.empty((lines, lines))
    base, now, found = np.empty((count, WRENCH)), np.empty((count, WRENCH)), np.empty((count, WRENCH))
    side, x, load = np.empty(lines), np.empty(lines), np.empty((number, 3))
    rubbing, power = np.empty((number, WRENCH)), np.empty(number)
    for i in range(bodies.shape[0]):
        for k in range(status.shape[1]):
            given = drive[i, k if drive.shape[1] > 1 else 0]
            needed(links, i, k, bodies[i], tool[i], given, carrier, output, room)
            for body in range(count):
                for at in range(WRENCH):
                    base[body, at] = room[body, 0, at]
            spread(links, i, k, room)
            coefficients(links, i, k, room, rows)
            for row in range(lines):
                for column in range(lines):
                    inverse[row, column] = 1.0 if row == column else 0.0
            if status[i, k] == st.OK and not eliminate(rows, inverse):
                status[i, k] = st.DEAD_POINT
            for which in range(number):
                _, _, place = at_joint(links, i, k, joints[which], base, side)
                one = direction(links, i, k, joints[which], place, friction[i, which], given[0])
                for at in range(WRENCH):
                    rubbing[which, at] = 0.0
                add_wrench(rubbing[which], one[0], place, one[1])
                power[which], load[which, 0] = one[2], 0.0
            passes = 0
            if status[i, k] == st.OK:
                passes = _settled(
                    links, i, k, joints, friction[i], base, room, inverse, rubbing, now, side, x, found, load
                )  # fmt: skip
                if passes < 0:
                    status[i, k] = st.JAMMED
            good = 1.0 if status[i, k] == st.OK else math.nan
            if torque is not None:
                torque[i, k] = good * reactions(links, i, k, now, room, x, found)
            if forces is not None or on_frame is not None:
                _store(links, i, k, joints, rubbing, load, found, x, good, forces, on_frame)
            for which in range(number):
                if lost is not None:
                    lost[i, k, which] = -good * load[which, 0] * power[which]
                if on_supports is not None:
                    on_supports[i, k, which, 0] = good * load[which, 1]
                    on_supports[i, k, which, 1] = good * load[which, 2]
            if lost is not None:
                lost[i, k, number] = good * passes


@inline
def _settled(
    links: Links,
    i: int,
    k: int,
    joints: Index,
    friction: Array,
    base: Array,
    room: Array,
    inverse: Array,
    rubbing: Array,
    now: Array,
    side: Array,
    x: Array,
    found: Array,
    load: Array,
) -> int:
    """Iterate the loads, column 0, with those of the supports beside; passes it took, -1 where they do not settle."""
    last, least, stalled = math.inf, math.inf, 0
    for count in range(1, PASSES + 1):
        _needed_with(links, i, joints, base, rubbing, load, now)
        right_sides(links, i, k, now, side)
        for row in range(x.shape[0]):
            value = 0.0
            for column in range(x.shape[0]):
                value += inverse[row, column] * side[column]
            x[row] = value
        reactions(links, i, k, now, room, x, found)
        change, step = 0.0, 0.0
        for which in range(joints.shape[0]):
            new, first, second = load_of(links, i, k, joints[which], friction[which], found, x)
            load[which, 1], load[which, 2] = first, second
            if friction[which, MU] > 0.0:
                apart, size = abs(new - load[which, 0]), max(new, load[which, 0])
                change = max(change, apart / size if size > 0.0 else 0.0)
                step = max(step, friction[which, MU] * apart)
            load[which, 0] = new
        if not math.isfinite(step):
            return -1
        # The last digits wander: a change at rounding level is convergence, not a stall.
        if change <= TOLERANCE or (count > 3 and change < 1e-12 and change >= last):
            return count
        last = change
        stalled = 0 if step < least else stalled + 1
        least = step
        if stalled >= STALLED:
            return -1
    return -1


@inline
def _needed_with(links: Links, i: int, joints: Index, base: Array, rubbing: Array, load: Array, now: Array) -> None:
    """Write the needed wrenches with what rubs, summed towards the frame, (B, 6)."""
    for body in range(base.shape[0]):
        for at in range(WRENCH):
            now[body, at] = base[body, at]
    for which in range(joints.shape[0]):
        on, by = joint_ends(links, i, joints[which])
        for at in range(WRENCH):
            now[on, at] -= load[which, 0] * rubbing[which, at]
            if by >= 0:
                now[by, at] += load[which, 0] * rubbing[which, at]
    for body in range(base.shape[0] - 1, -1, -1):
        if links.parents[body] >= 0:
            for at in range(WRENCH):
                now[links.parents[body], at] += now[body, at]


@inline
def _store(
    links: Links,
    i: int,
    k: int,
    joints: Index,
    rubbing: Array,
    load: Array,
    found: Array,
    x: Array,
    good: float,
    forces: Array | None,
    on_frame: Array | None,
) -> None:
    """Write what each joint bears with what rubs there, and what the frame bears."""
    if on_frame is not None:
        for at in range(WRENCH):
            on_frame[i, k, at] = 0.0
    for which in range(joints.shape[0]):
        force, moment, place = at_joint(links, i, k, joints[which], found, x)
        rubs = vector(rubbing[which])
        couple = sub(vector(rubbing[which, 3:]), cross(place, rubs))
        driven = joints[which, KIND] == SHAFT and links.freedoms[i, joints[which, FREEDOM], 1] == DRIVEN
        if forces is not None:
            for at in range(3):
                forces[i, k, which, at] = good * (force[at] + load[which, 0] * rubs[at])
                forces[i, k, which, 3 + at] = good * (moment[at] + (0.0 if driven else load[which, 0] * couple[at]))
        if on_frame is not None and joint_ends(links, i, joints[which])[1] < 0:
            add_wrench(on_frame[i, k], scale(-good, force), place, scale(-good, moment))
            add_wrench(
                on_frame[i, k], scale(-good * load[which, 0], rubs), place, scale(-good * load[which, 0], couple)
            )
