"""D1-D3 for any number of links: joint reactions, driving torque, reduced inertia of a tree of bodies with loops.

Equation numbers are of docs/links.md.  The loops are cut at the lines of :class:`kernels.linkage.bodies.Links`.  Each
body needs a wrench for its inertia and weight; the force x_k of each line adds one that is linear in x_k.  The wrenches
of all bodies beyond a joint are summed, so the joint's wrench is known but for the x_k.  A freedom that nothing drives
bears no moment about its axis, or no force along it: as many linear equations as there are lines.  They are solved by
Gaussian elimination; every reaction and the driving torque then follow by adding up.

Friction at a joint is a wrench of known direction times the joint's load: one more line, whose force is known once the
loads are.  Reactions are linear in the loads, so the reactions without friction and those due to each joint's friction
at unit load are found once, as columns of one elimination; successive approximations then sum vectors.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.arithmetic.vectors import Vector, add, cross, dot, mix, scale, sub
from kernels.effects.kinetostatics import BODY, LEAST_COSINE, put_plane
from kernels.jit import inline, kernel
from kernels.linear.elimination import eliminate
from kernels.linkage.bodies import DRIVEN, SLIDE, Links, inertia_times, latter, point, posed, put_wrench, vector
from kernels.types import Array, Status

Index = NDArray[np.int64]

TOOL = 4  # mass of the tool; its place in the axes of the body that carries it
SPEED, CHANGE, LOAD, FORCE = 0, 1, 2, 3  # of the drive: speed, its rate, torque on the output link, force on the tool
WRENCH = 6  # force, moment about the origin of the family's frame

# Of a joint: its kind; the body whose joint with its parent it is, and the freedom whose axis is its own; or the first
# of the lines that make it, and their number; the slender rod among its bodies, or FRAME.
KIND, BODY_OF, FREEDOM, LINE, LINES, ROD, PER_JOINT = 0, 1, 2, 3, 4, 5, 6
SHAFT, HINGED_BALL, GUIDE, BALL, CONTACT = 0, 1, 2, 3, 4


class TreeLoading(NamedTuple):
    """Loads on a tree of B bodies.

    Parameters
    ----------
    bodies : (n, 10 B + 3), per body m, centre of mass, inertia about it (xx xy xz yy yz zz), in its own axes; gravity
    tool : (n, TOOL), mass of the tool and its place in the axes of the body ``carrier``
    drive : (n, m or 1, 6): crank speed, its rate, torque on the freedom ``output``, force on the tool
    carrier : number of the body that carries the tool
    output : number of the freedom that the load acts on; below 0 for none
    """

    bodies: Array
    tool: Array
    drive: Array
    carrier: int
    output: int


class Room(NamedTuple):
    """Scratch for the loads of one pose: B bodies, F freedoms, K lines, Q joints, R of them with friction, A = 1 + R.

    Parameters
    ----------
    ends : (Q, 2) the body that a joint's force acts on, and the one that it acts on reversed
    order : (F,) freedoms that nothing drives, as many as lines, then those that the drive turns
    signs : (B, K + R) sign with which a line's force, or a joint's friction, enters the wrench that a body and all
        beyond it need: -1, 0 or 1
    need : (B, 6) that wrench without lines and friction
    places : (Q, 3) of the joints
    units : (K + R, 6) wrenches of the lines' unit forces and of the joints' friction
    screws : (F, 6) of the freedoms, for :func:`weighed`
    rows : (K, K + A) the equations
    x : (K, A) their last columns, in the end the lines' forces
    found : (Q, A, 6) force and moment of each joint, without friction, then due to the friction of each joint
    """

    ends: Index
    order: Index
    signs: Array
    need: Array
    places: Array
    units: Array
    screws: Array
    rows: Array
    x: Array
    found: Array


# Below, no array is last used inside a branch, and every helper has a single return: otherwise numba counts references
# to the arrays at every pose, which took half of the time.


@inline
def room_for(links: Links, joints: int, rubbing: int) -> Room:
    """Allocate the scratch for the loads of one pose."""
    count, lines, freedoms = links.parents.shape[0], links.lines.shape[2], links.axes.shape[2]
    rows = np.empty((lines, lines + 1 + rubbing))
    return Room(
        np.empty((joints, 2), np.int64), np.empty(freedoms, np.int64), np.empty((count, lines + rubbing)),
        np.empty((count, WRENCH)), np.empty((joints, 3)), np.empty((lines + rubbing, WRENCH)),
        np.empty((freedoms, WRENCH)), rows, rows[:, lines:],
        np.empty((joints, 1 + rubbing, WRENCH)),
    )  # fmt: skip


@inline
def _put_signs(parents: Index, on: int, by: int, column: Array) -> None:
    """Write the sign with which a wrench on body ``on``, reversed on ``by``, enters the wrench at each body's joint."""
    for body in range(column.shape[0]):
        column[body] = 0.0
    # along both paths to the frame; where the paths coincide the two cancel
    while on >= 0:
        column[on] -= 1.0
        on = parents[on]
    while by >= 0:
        column[by] += 1.0
        by = parents[by]


@inline
def prepare(links: Links, i: int, joints: Index, room: Room) -> None:
    """Write the part of the scratch that is the same at all poses of a design."""
    lines, ends, first, last = room.rows.shape[0], links.ends[i], 0, room.order.shape[0] - 1
    for which in range(room.order.shape[0]):
        driven = links.freedoms[i, which, 1] == DRIVEN
        room.order[last if driven else first] = which
        first, last = (first, last - 1) if driven else (first + 1, last)
    for which in range(lines):
        _put_signs(links.parents, ends[which, 0], ends[which, 1], room.signs[:, which])
    for which in range(joints.shape[0]):
        held, body, line = joints[which, KIND] <= GUIDE, joints[which, BODY_OF], joints[which, LINE]
        room.ends[which, 0] = body if held else ends[line, 0]
        room.ends[which, 1] = links.parents[body] if held else ends[line, 1]
    for which in range(room.signs.shape[1] - lines):
        _put_signs(links.parents, room.ends[which, 0], room.ends[which, 1], room.signs[:, lines + which])


@inline
def needed(
    links: Links, i: int, k: int, given: TreeLoading, drive: Array, room: Room
) -> tuple[float, float, Vector, Vector]:
    """Write the wrench that each body and all beyond it need, (1), (3).

    Return reduced inertia and half its derivative, (6), the force on the tool, (2), and the tool's velocity.
    """
    need, parents, records = room.need, links.parents, links.bodies[i, k]
    bodies, tool, carrier, output = given.bodies[i], given.tool[i], given.carrier, given.output
    count, first, second = parents.shape[0], 0.0, 0.0
    gravity = vector(bodies[BODY * count :])
    square, change = drive[SPEED] * drive[SPEED], drive[CHANGE]
    for b in range(count):
        data, body = bodies[BODY * b : BODY * b + BODY], posed(records[b])
        arm, v, a = point(body, data)
        force = scale(data[0], sub(mix(square, a, change, v), gravity))
        momentum, rate = inertia_times(body, data, body.omega), inertia_times(body, data, body.eps)
        about = add(mix(square, rate, change, momentum), scale(square, cross(body.omega, momentum)))
        put_wrench(need[b], force, add(body.at, arm), about)
        first += data[0] * dot(v, v) + dot(body.omega, momentum)
        second += data[0] * dot(v, a) + dot(momentum, body.eps)
    body = posed(records[carrier])
    arm, v, a = point(body, tool)
    force = sub(scale(tool[0], sub(mix(square, a, change, v), gravity)), vector(drive[FORCE:]))
    about = cross(add(body.at, arm), force)
    for at in range(3):
        need[carrier, at] += force[at]
        need[carrier, 3 + at] += about[at]
    first += tool[0] * dot(v, v)
    second += tool[0] * dot(v, a)
    freedom, load = max(output, 0), drive[LOAD] if output >= 0 else 0.0
    loaded, slides = links.freedoms[i, freedom, 0], 1.0 if links.freedoms[i, freedom, 1] == SLIDE else 0.0
    axis = vector(links.axes[i, k, freedom])
    arm = scale(slides, cross(posed(records[loaded]).joint, axis))
    for at in range(3):
        need[loaded, at] -= slides * load * axis[at]
        need[loaded, 3 + at] -= load * ((1.0 - slides) * axis[at] + arm[at])
    for b in range(count - 1, -1, -1):
        if parents[b] >= 0:
            for at in range(WRENCH):
                need[parents[b], at] += need[b, at]
    return first, second, force, v


@inline
def put_lines(links: Links, i: int, k: int, joints: Index, room: Room) -> None:
    """Write the wrenches of the lines' unit forces and couples, the screws of the freedoms, the places of the joints.

    A wrench's moment about an axis through P is axis . (M - P x F) = axis . M + (P x axis) . F.
    """
    lines, axes, records, none = links.lines[i, k], links.axes[i, k], links.bodies[i, k], (0.0, 0.0, 0.0)
    for which in range(lines.shape[0]):
        put_wrench(room.units[which], latter(lines[which]), vector(lines[which]), none)
    for which in range(axes.shape[0]):
        axis = vector(axes[which])
        arm = cross(posed(records[links.freedoms[i, which, 0]]).joint, axis)
        slides = links.freedoms[i, which, 1] == SLIDE
        put_wrench(room.screws[which], axis if slides else arm, none, none if slides else axis)
    for which in range(joints.shape[0]):
        held, body, line = joints[which, KIND] <= GUIDE, joints[which, BODY_OF], joints[which, LINE]
        for at in range(3):
            room.places[which, at] = records[body, 24 + at] if held else lines[line, at]


@inline
def weighed(screw: Array, wrench: Array) -> float:
    """Moment of a wrench about a freedom's axis; its force along the axis where the freedom is a slide."""
    return dot(vector(screw), vector(wrench)) + dot(latter(screw), latter(wrench))


@inline
def solve(links: Links, i: int, room: Room) -> bool:
    """Find the forces of the lines, (4), without friction and due to each joint's friction; false at a dead point."""
    rows, signs, units = room.rows, room.signs, room.units
    lines = rows.shape[0]
    for row in range(lines):
        body, screw = links.freedoms[i, room.order[row], 0], room.screws[room.order[row]]
        for column in range(lines):
            rows[row, column] = signs[body, column] * weighed(screw, units[column])
        rows[row, lines] = -weighed(screw, room.need[body])
        for column in range(lines, units.shape[0]):
            rows[row, 1 + column] = -signs[body, column] * weighed(screw, units[column])
    return eliminate(rows, LEAST_COSINE)


@inline
def wrench_on(room: Room, body: int, answer: int) -> tuple[Vector, Vector]:
    """Wrench of its parent on a body, about the origin: without friction, or due to the friction of one joint."""
    need, units, signs, x = room.need, room.units, room.signs, room.x
    lines = x.shape[0]
    force, moment = vector(need[body]), latter(need[body])
    if answer > 0:
        sign, at = signs[body, lines + answer - 1], lines + answer - 1
        force = sign * units[at, 0], sign * units[at, 1], sign * units[at, 2]
        moment = sign * units[at, 3], sign * units[at, 4], sign * units[at, 5]
    for which in range(lines):
        factor, unit = x[which, answer] * signs[body, which], units[which]
        force, moment = mix(1.0, force, factor, vector(unit)), mix(1.0, moment, factor, latter(unit))
    return force, moment


@inline
def put_reactions(joints: Index, room: Room) -> None:
    """Write the force of every joint and the moment about its place, for every solution."""
    for which in range(joints.shape[0]):
        place, body = vector(room.places[which]), joints[which, BODY_OF]
        for answer in range(room.x.shape[1]):
            force, moment = wrench_on(room, max(body, 0), answer)
            moment = sub(moment, cross(place, force))
            if joints[which, KIND] > GUIDE:
                force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            for line in range(joints[which, LINE], joints[which, LINE] + joints[which, LINES]):
                force = mix(1.0, force, room.x[line, answer], vector(room.units[line]))
            put_wrench(room.found[which, answer], force, (0.0, 0.0, 0.0), moment)


@inline
def driving(links: Links, i: int, room: Room, answer: int) -> float:
    """Torque of the drive on all freedoms that it turns together, (5)."""
    torque = 0.0
    for at in range(room.rows.shape[0], room.order.shape[0]):
        which = room.order[at]
        force, moment = wrench_on(room, links.freedoms[i, which, 0], answer)
        torque += dot(vector(room.screws[which]), force) + dot(latter(room.screws[which]), moment)
    return torque


@inline
def borne_force(links: Links, i: int, k: int, given: TreeLoading, drive: Array) -> Vector:
    """Force of the frame on all bodies and the tool: their inertia forces and weights less the useful load."""
    bodies, tool, carrier, output = given.bodies[i], given.tool[i], given.carrier, given.output
    records, count, total = links.bodies[i, k], links.parents.shape[0], scale(-1.0, vector(drive[FORCE:]))
    gravity, square, change = vector(bodies[BODY * count :]), drive[SPEED] * drive[SPEED], drive[CHANGE]
    for b in range(count + 1):
        data = bodies[BODY * b : BODY * b + BODY] if b < count else tool
        _, v, a = point(posed(records[b if b < count else carrier]), data)
        total = mix(1.0, total, data[0], sub(mix(square, a, change, v), gravity))
    freedom = max(output, 0)
    pushed = drive[LOAD] if output >= 0 and links.freedoms[i, freedom, 1] == SLIDE else 0.0
    return mix(1.0, total, -pushed, vector(links.axes[i, k, freedom]))


@inline
def borne_moment(parents: Index, need: Array) -> Vector:
    """Moment of the frame on all bodies about the origin; internal forces have no effect on it."""
    x, y, z = 0.0, 0.0, 0.0
    for b in range(parents.shape[0]):
        held = 1.0 if parents[b] < 0 else 0.0
        x, y, z = x + held * need[b, 3], y + held * need[b, 4], z + held * need[b, 5]
    return x, y, z


@kernel
def link_loads(
    links: Links,
    joints: Index,
    given: TreeLoading,
    status: Status,
    forces: Array | None,
    frame_force: Array | None,
    frame_moment: Array | None,
    torque: Array | None,
    inertia: Array | None,
    on_tool: Array | None,
) -> None:
    """Compute the frictionless joint reactions, driving torque and reduced inertia of a tree of bodies with loops.

    Parameters
    ----------
    links : tree and poses
    joints : (Q, PER_JOINT) joints whose forces are wanted
    given : loads on the bodies
    status : (n, m), in and out; DEAD_POINT where the forces of the lines have no digits left; gives nan
    forces : (n, m, Q, 6) or None; force and moment of each joint, about its place, fixed axes
    frame_force, frame_moment : (n, 3, m) or None; on the frame, that of the drive included; needs no forces of lines
    torque : (n, m) or None; of the drive, on all freedoms that it turns together
    inertia : (n, m, 2) or None; inertia reduced to the crank and its derivative
    on_tool : (n, m, 4) or None; force of its carrier on the tool, fixed axes, and its power per unit crank speed
    """
    room = room_for(links, joints.shape[0], 0)
    solved = forces is not None or torque is not None or inertia is not None or on_tool is not None
    for i in range(status.shape[0]):
        prepare(links, i, joints, room)
        for k in range(status.shape[1]):
            drive = given.drive[i, k if given.drive.shape[1] > 1 else 0]
            if frame_moment is not None or solved:
                both = needed(links, i, k, given, drive, room)
            if solved:
                put_lines(links, i, k, joints, room)
                if not solve(links, i, room) and status[i, k] == st.OK:
                    status[i, k] = st.DEAD_POINT
            good = 1.0 if status[i, k] == st.OK else math.nan
            if frame_force is not None:
                put_plane(frame_force, i, k, good, borne_force(links, i, k, given, drive))
            if frame_moment is not None:
                put_plane(frame_moment, i, k, good, borne_moment(links.parents, room.need))
            if forces is not None:
                put_reactions(joints, room)
                for which in range(joints.shape[0]):
                    for at in range(WRENCH):
                        forces[i, k, which, at] = good * room.found[which, 0, at]
            if torque is not None:
                torque[i, k] = good * driving(links, i, room, 0)
            if inertia is not None:
                inertia[i, k, 0], inertia[i, k, 1] = good * both[0], good * 2.0 * both[1]
            if on_tool is not None:
                for at in range(3):
                    on_tool[i, k, at] = good * both[2][at]
                on_tool[i, k, 3] = good * dot(both[2], both[3])
