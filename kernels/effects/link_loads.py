"""D1, D3 for any number of links: joint reactions, driving torque and reduced inertia of a tree of bodies with loops.

Equation numbers are of docs/links.md.  The loops are cut at the lines of :class:`kernels.linkage.bodies.Links`.  Each
body needs a wrench for its inertia and weight; the force x_k of each line adds one that is linear in x_k.  What hangs
on a joint is summed towards the frame, so the joint's wrench is known but for the x_k.  A freedom that nothing drives
bears no moment about its axis, or no force along it: as many linear equations as there are lines.  They are solved by
Gaussian elimination; every reaction and the driving torque then follow by adding up.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.arithmetic.vectors import Vector, add, cross, dot, mix, scale, spun, sub, turned
from kernels.effects.kinetostatics import BODY, LEAST_COSINE, Tensor
from kernels.jit import inline, kernel
from kernels.linkage.bodies import DRIVEN, SLIDE, Links, moving, vector
from kernels.types import Array, Status

Index = NDArray[np.int64]

TOOL = 4  # mass of the tool; its place in the axes of the body that carries it
SPEED, CHANGE, LOAD, FORCE = 0, 1, 2, 3  # of the drive: speed, its rate, torque on the output link, force on the tool
PER_DRIVE = 6
WRENCH = 6  # force, moment about the origin of the family's frame

# Of a joint: its kind; the body whose joint with its parent it is, and the freedom whose axis is its own; or the first
# of the lines that make it, and how many; the slender rod among its bodies, or FRAME.
KIND, BODY_OF, FREEDOM, LINE, LINES, ROD, PER_JOINT = 0, 1, 2, 3, 4, 5, 6
SHAFT, HINGED_BALL, GUIDE, BALL, CONTACT = 0, 1, 2, 3, 4


@inline
def inertia_times(body: Array, tensor: Tensor, a: Vector) -> Vector:
    """Inertia tensor, given in the body's axes, times a vector in fixed axes."""
    x, y, z = vector(body[15:]), vector(body[18:]), vector(body[21:])
    p, q, r = dot(x, a), dot(y, a), dot(z, a)
    xx, xy, xz, yy, yz, zz = tensor
    return turned(x, y, z, (xx * p + xy * q + xz * r, xy * p + yy * q + yz * r, xz * p + yz * q + zz * r))


@inline
def add_wrench(out: Array, force: Vector, at: Vector, couple: Vector) -> None:
    """Add a force at a point and a couple to a wrench, (6,)."""
    moment = add(cross(at, force), couple)
    out[0] += force[0]
    out[1] += force[1]
    out[2] += force[2]
    out[3] += moment[0]
    out[4] += moment[1]
    out[5] += moment[2]


@inline
def add_inertia(out: Array, body: Array, data: Array, gravity: Vector, drive: Array) -> tuple[float, float]:
    """Add what a body needs for its inertia and weight, (1); its reduced inertia and half the derivative, (6)."""
    rate = moving(body)
    tensor = (data[4], data[5], data[6], data[7], data[8], data[9])
    arm = turned(vector(body[15:]), vector(body[18:]), vector(body[21:]), (data[1], data[2], data[3]))
    v, a = add(rate.v, cross(rate.omega, arm)), add(rate.a, spun(rate.omega, rate.eps, arm))
    square, change = drive[SPEED] * drive[SPEED], drive[CHANGE]
    force = scale(data[0], sub(mix(square, a, change, v), gravity))
    momentum = inertia_times(body, tensor, rate.omega)
    about = inertia_times(body, tensor, mix(square, rate.eps, change, rate.omega))
    add_wrench(out, force, add(rate.at, arm), add(about, scale(square, cross(rate.omega, momentum))))
    return data[0] * dot(v, v) + dot(rate.omega, momentum), data[0] * dot(v, a) + dot(momentum, rate.eps)


@inline
def add_tool(
    out: Array, body: Array, tool: Array, gravity: Vector, drive: Array
) -> tuple[float, float, Vector, Vector]:
    """Add what the tool needs, (2); what it adds to the reduced inertia; force on the tool and its velocity."""
    rate = moving(body)
    arm = turned(vector(body[15:]), vector(body[18:]), vector(body[21:]), (tool[1], tool[2], tool[3]))
    v, a = add(rate.v, cross(rate.omega, arm)), add(rate.a, spun(rate.omega, rate.eps, arm))
    square = drive[SPEED] * drive[SPEED]
    force = scale(tool[0], sub(mix(square, a, drive[CHANGE], v), gravity))
    force = sub(force, vector(drive[FORCE:]))
    add_wrench(out, force, add(rate.at, arm), (0.0, 0.0, 0.0))
    return tool[0] * dot(v, v), tool[0] * dot(v, a), force, v


@inline
def spread(links: Links, i: int, k: int, room: Array) -> None:
    """Write the wrenches of the lines' unit forces and sum all wrenches towards the frame, (3); room (B, K + 1, 6).

    Column 0 is what each body needs; a line's force is taken off what its joint has to give.
    """
    ends, lines, parents = links.ends[i], links.lines[i, k], links.parents
    for which in range(ends.shape[0]):
        point, along = vector(lines[which]), vector(lines[which, 3:])
        add_wrench(room[ends[which, 0], 1 + which], scale(-1.0, along), point, (0.0, 0.0, 0.0))
        if ends[which, 1] >= 0:
            add_wrench(room[ends[which, 1], 1 + which], along, point, (0.0, 0.0, 0.0))
    for body in range(parents.shape[0] - 1, -1, -1):
        if parents[body] >= 0:
            for column in range(room.shape[1]):
                for x in range(WRENCH):
                    room[parents[body], column, x] += room[body, column, x]


@inline
def on_freedom(kind: int, axis: Vector, joint: Vector, wrench: Array) -> float:
    """Moment of a wrench about an axis through the joint; its force along the axis where the freedom is a slide."""
    force = vector(wrench)
    if kind == SLIDE:
        return dot(axis, force)
    return dot(axis, sub(vector(wrench[3:]), cross(joint, force)))


@inline
def coefficients(links: Links, i: int, k: int, room: Array, rows: Array) -> None:
    """Write the factors of the lines' forces, (K, K), one row for each freedom that nothing drives, (4)."""
    freedoms, axes, bodies = links.freedoms[i], links.axes[i, k], links.bodies[i, k]
    row = 0
    for which in range(freedoms.shape[0]):
        kind, body = freedoms[which, 1], freedoms[which, 0]
        if kind != DRIVEN:
            axis, joint = vector(axes[which]), vector(bodies[body, 24:])
            for column in range(room.shape[1] - 1):
                rows[row, column] = on_freedom(kind, axis, joint, room[body, 1 + column])
            row += 1


@inline
def right_sides(links: Links, i: int, k: int, wrenches: Array, side: Array) -> None:
    """Write what the lines have to give on each freedom that nothing drives, (K,); wrenches (B, 6) are those needed."""
    freedoms, axes, bodies = links.freedoms[i], links.axes[i, k], links.bodies[i, k]
    row = 0
    for which in range(freedoms.shape[0]):
        kind, body = freedoms[which, 1], freedoms[which, 0]
        if kind != DRIVEN:
            side[row] = -on_freedom(kind, vector(axes[which]), vector(bodies[body, 24:]), wrenches[body])
            row += 1


@inline
def eliminate(rows: Array, sides: Array) -> bool:
    """Solve rows (K, K) for the columns of ``sides`` (K, R) in place; false where a pivot has no digits left.

    Gaussian elimination.  Rows are brought to one size first: some are moments, some are forces.
    """
    n = rows.shape[0]
    for i in range(n):
        size = 0.0
        for j in range(n):
            size = max(size, abs(rows[i, j]))
        per = 1.0 / size if size > 0.0 else math.nan
        for j in range(n):
            rows[i, j] *= per
        for j in range(sides.shape[1]):
            sides[i, j] *= per
    for j in range(n):
        best = j
        for i in range(j + 1, n):
            if abs(rows[i, j]) > abs(rows[best, j]):
                best = i
        if not abs(rows[best, j]) >= LEAST_COSINE:
            return False
        for column in range(j, n):
            rows[j, column], rows[best, column] = rows[best, column], rows[j, column]
        for column in range(sides.shape[1]):
            sides[j, column], sides[best, column] = sides[best, column], sides[j, column]
        for i in range(j + 1, n):
            factor = rows[i, j] / rows[j, j]
            for column in range(j, n):
                rows[i, column] -= factor * rows[j, column]
            for column in range(sides.shape[1]):
                sides[i, column] -= factor * sides[j, column]
    for column in range(sides.shape[1]):
        for j in range(n - 1, -1, -1):
            value = sides[j, column]
            for i in range(j + 1, n):
                value -= rows[j, i] * sides[i, column]
            sides[j, column] = value / rows[j, j]
    return True


@inline
def reactions(links: Links, i: int, k: int, wrenches: Array, room: Array, x: Array, found: Array) -> float:
    """Write force and moment about the joint of each body's parent on it, (B, 6); the driving torque, (5)."""
    bodies, freedoms, axes = links.bodies[i, k], links.freedoms[i], links.axes[i, k]
    for body in range(bodies.shape[0]):
        for at in range(WRENCH):
            value = wrenches[body, at]
            for which in range(x.shape[0]):
                value += x[which] * room[body, 1 + which, at]
            found[body, at] = value
        moment = cross(vector(bodies[body, 24:]), vector(found[body]))
        for at in range(3):
            found[body, 3 + at] -= moment[at]
    torque = 0.0
    for which in range(freedoms.shape[0]):
        if freedoms[which, 1] == DRIVEN:
            torque += dot(vector(axes[which]), vector(found[freedoms[which, 0], 3:]))
    return torque


@inline
def at_joint(links: Links, i: int, k: int, joint: Index, found: Array, x: Array) -> tuple[Vector, Vector, Vector]:
    """Force, moment and place of a body's joint with its parent, or of a joint made of lines that close a loop."""
    if joint[KIND] <= GUIDE:
        body = joint[BODY_OF]
        return vector(found[body]), vector(found[body, 3:]), vector(links.bodies[i, k, body, 24:])
    force = (0.0, 0.0, 0.0)
    for which in range(joint[LINE], joint[LINE] + joint[LINES]):
        force = add(force, scale(x[which], vector(links.lines[i, k, which, 3:])))
    return force, (0.0, 0.0, 0.0), vector(links.lines[i, k, joint[LINE]])


@inline
def joint_ends(links: Links, i: int, joint: Index) -> tuple[int, int]:
    """Return numbers of the body that a joint's force acts on and of the one that it acts on reversed."""
    if joint[KIND] <= GUIDE:
        return joint[BODY_OF], links.parents[joint[BODY_OF]]
    return links.ends[i, joint[LINE], 0], links.ends[i, joint[LINE], 1]


@kernel
def link_loads(
    links: Links,
    joints: Index,
    bodies: Array,
    tool: Array,
    drive: Array,
    carrier: int,
    output: int,
    status: Status,
    forces: Array | None,
    on_frame: Array | None,
    torque: Array | None,
    inertia: Array | None,
    on_tool: Array | None,
) -> None:
    """Compute the frictionless joint reactions, driving torque and reduced inertia of a tree of bodies with loops.

    Parameters
    ----------
    links : tree and poses
    joints : (Q, PER_JOINT) what forces are given of
    bodies : (n, 10 B + 3), per body m, centre of mass, inertia about it (xx xy xz yy yz zz), in its own axes; gravity
    tool : (n, TOOL), mass of the tool and its place in the axes of the body ``carrier``
    drive : (n, m or 1, PER_DRIVE): crank speed, its rate, torque on the freedom ``output``, force on the tool
    carrier : number of the body that carries the tool
    output : number of the freedom that the load acts on; below 0 for none
    status : (n, m), in and out; DEAD_POINT where the forces of the lines have no digits left; gives nan
    forces : (n, m, Q, 6) or None; force and moment of each joint, about its place, fixed axes
    on_frame : (n, m, 6) or None; force on the frame and moment about its origin, that of the drive included
    torque : (n, m) or None; of the drive, on all freedoms that it turns together
    inertia : (n, m, 2) or None; inertia reduced to the crank and its derivative
    on_tool : (n, m, 4) or None; force of its carrier on the tool, fixed axes, and its power per unit crank speed
    """
    count, lines = links.parents.shape[0], links.lines.shape[2]
    room, rows, side = np.empty((count, lines + 1, WRENCH)), np.empty((lines, lines)), np.empty((lines, 1))
    found = np.empty((count, WRENCH))
    x = side[:, 0]
    for i in range(bodies.shape[0]):
        for k in range(status.shape[1]):
            given = drive[i, k if drive.shape[1] > 1 else 0]
            both = needed(links, i, k, bodies[i], tool[i], given, carrier, output, room)
            spread(links, i, k, room)
            coefficients(links, i, k, room, rows)
            right_sides(links, i, k, room[:, 0], x)
            if status[i, k] == st.OK and not eliminate(rows, side):
                status[i, k] = st.DEAD_POINT
            good = 1.0 if status[i, k] == st.OK else math.nan
            driving = reactions(links, i, k, room[:, 0], room, x, found)
            if forces is not None:
                for which in range(joints.shape[0]):
                    force, moment, _ = at_joint(links, i, k, joints[which], found, x)
                    for at in range(3):
                        forces[i, k, which, at] = good * force[at]
                        forces[i, k, which, 3 + at] = good * moment[at]
            if on_frame is not None:
                for at in range(WRENCH):
                    on_frame[i, k, at] = 0.0
                for which in range(joints.shape[0]):
                    force, moment, place = at_joint(links, i, k, joints[which], found, x)
                    if joint_ends(links, i, joints[which])[1] < 0:
                        add_wrench(on_frame[i, k], scale(-good, force), place, scale(-good, moment))
            if torque is not None:
                torque[i, k] = good * driving
            if inertia is not None:
                inertia[i, k, 0], inertia[i, k, 1] = good * both[0], good * 2.0 * both[1]
            if on_tool is not None:
                for at in range(3):
                    on_tool[i, k, at] = good * both[2][at]
                on_tool[i, k, 3] = good * dot(both[2], both[3])


@inline
def needed(
    links: Links, i: int, k: int, bodies: Array, tool: Array, drive: Array, carrier: int, output: int, room: Array
) -> tuple[float, float, Vector, Vector]:
    """Empty the room and write what each body needs into its column 0; inertias and tool as :func:`add_tool`."""
    count = links.parents.shape[0]
    for body in range(count):
        for column in range(room.shape[1]):
            for at in range(WRENCH):
                room[body, column, at] = 0.0
    gravity = vector(bodies[BODY * count :])
    first, second, force, v = add_tool(room[carrier, 0], links.bodies[i, k, carrier], tool, gravity, drive)
    for body in range(count):
        own = bodies[BODY * body : BODY * (body + 1)]
        more, bend = add_inertia(room[body, 0], links.bodies[i, k, body], own, gravity, drive)
        first += more
        second += bend
    if output >= 0:
        none, load = (0.0, 0.0, 0.0), scale(-drive[LOAD], vector(links.axes[i, k, output]))
        add_wrench(room[links.freedoms[i, output, 0], 0], none, none, load)
    return first, second, force, v
