"""Mechanism of any number of links as its loads see it: bodies in a tree, lines that close loops, never the family.

Each body hangs on its parent, or on the frame, by a joint that leaves it some freedoms.  Forces along given lines close
the loops: a ball joint is three lines, a contact is one or two.  There are as many lines as freedoms that the drive
does not turn; :mod:`kernels.effects.link_loads` finds the lines' forces by virtual power.

A family fills :class:`Links` for its poses.  Rates are with respect to the crank angle, in fixed axes.  A link between
two balls is a slender rod: turning about its own axis has no inertia.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arithmetic.vectors import Vector, add, cross, dot, mix, norm, scale, spun, sub, turned
from kernels.jit import inline
from kernels.types import Array

Index = NDArray[np.int64]

# Of a body: origin of its axes, its velocity and acceleration, angular velocity and acceleration, its axes x, y, z,
# and the point of its joint with the parent.
PER_BODY = 27
PER_LINE = 6  # a point and a direction
FRAME = -1  # parent of a body that hangs on the frame, and the second end of a line between a body and the frame

TURN, SLIDE, DRIVEN = 0, 1, 2  # kinds of freedom; DRIVEN is a turn that the drive imposes


class Links(NamedTuple):
    """Tree of the bodies of a mechanism, lines that close its loops, and its poses; see PER_BODY and PER_LINE.

    A parent has a lower number than its children.  Freedoms and ends come filled with those of the family's ordinary
    design; the family changes them where a design is of another kind.
    """

    parents: Index  # (B,) FRAME or the number of a body
    freedoms: Index  # (n, D, 2) the body, and TURN, SLIDE or DRIVEN
    ends: Index  # (n, K, 2) a line's force acts on the first body and, reversed, on the second or the FRAME
    bodies: Array  # (n, m, B, PER_BODY)
    axes: Array  # (n, m, D, 3) of the freedoms, through the body's joint
    lines: Array  # (n, m, K, PER_LINE)


class Moving(NamedTuple):
    """Rates of a body: velocity and acceleration of its origin, angular velocity and acceleration."""

    at: Vector
    v: Vector
    a: Vector
    omega: Vector
    eps: Vector


class Posed(NamedTuple):
    """A body at one pose: its rates, its axes and the point of its joint with the parent."""

    at: Vector
    v: Vector
    a: Vector
    omega: Vector
    eps: Vector
    x: Vector
    y: Vector
    z: Vector
    joint: Vector


@inline
def posed(body: Array) -> Posed:
    """Read the record of a body, (PER_BODY,)."""
    # Written out: slices cost their bounds, and numba compiles a helper anew for every literal index.
    return Posed(
        (body[0], body[1], body[2]), (body[3], body[4], body[5]), (body[6], body[7], body[8]),
        (body[9], body[10], body[11]), (body[12], body[13], body[14]), (body[15], body[16], body[17]),
        (body[18], body[19], body[20]), (body[21], body[22], body[23]), (body[24], body[25], body[26]),
    )  # fmt: skip


@inline
def vector(a: Array) -> Vector:
    """First three numbers of an array as a vector."""
    return a[0], a[1], a[2]


@inline
def latter(a: Array) -> Vector:
    """Second three numbers of an array as a vector; a slice would cost its bounds."""
    return a[3], a[4], a[5]


@inline
def point(body: Posed, data: Array) -> tuple[Vector, Vector, Vector]:
    """Point of a body from its origin, in fixed axes, with velocity and acceleration; ``data``: a mass, the point."""
    arm = turned(body.x, body.y, body.z, (data[1], data[2], data[3]))
    return arm, add(body.v, cross(body.omega, arm)), add(body.a, spun(body.omega, body.eps, arm))


@inline
def put_wrench(out: Array, force: Vector, at: Vector, couple: Vector) -> None:
    """Write a force at a point and a couple as a wrench, (6,)."""
    moment = add(cross(at, force), couple)
    out[0], out[1], out[2] = force[0], force[1], force[2]
    out[3], out[4], out[5] = moment[0], moment[1], moment[2]


@inline
def put(out: Array, a: Vector) -> None:
    """Write a vector to the first three numbers of an array."""
    out[0], out[1], out[2] = a[0], a[1], a[2]


@inline
def moving(body: Array) -> Moving:
    """Rates of a body from its record, (PER_BODY,)."""
    all_of = posed(body)
    return Moving(all_of.at, all_of.v, all_of.a, all_of.omega, all_of.eps)


@inline
def velocity_at(body: Moving, point: Vector) -> Vector:
    """Velocity of the point of a body that is at ``point``."""
    return add(body.v, cross(body.omega, sub(point, body.at)))


@inline
def acceleration_at(body: Moving, point: Vector) -> Vector:
    """Acceleration of the point of a body that is at ``point``."""
    return add(body.a, spun(body.omega, body.eps, sub(point, body.at)))


@inline
def put_body(out: Array, body: Moving, x: Vector, y: Vector, z: Vector, joint: Vector) -> None:
    """Write the record of a body, (PER_BODY,)."""
    put(out, body.at)
    put(out[3:], body.v)
    put(out[6:], body.a)
    put(out[9:], body.omega)
    put(out[12:], body.eps)
    put(out[15:], x)
    put(out[18:], y)
    put(out[21:], z)
    put(out[24:], joint)


@inline
def turning(at: Vector, axis: Vector, first: float, second: float) -> Moving:
    """Rates of a body that turns about a fixed axis through its origin."""
    none = (0.0, 0.0, 0.0)
    return Moving(at, none, none, scale(first, axis), scale(second, axis))


@inline
def put_turning(out: Array, at: Vector, axis: Vector, x: Vector, first: float, second: float) -> Moving:
    """Write a body that turns about a fixed axis through its origin, at which its joint is; ``x`` is its first axis."""
    body = turning(at, axis, first, second)
    put_body(out, body, x, cross(axis, x), axis, at)
    return body


@inline
def put_rod(out: Array, axes: Array, on: Moving, at: Vector, to: Moving, end: Vector) -> Moving:
    """Write a rod between balls of two bodies and its two freedoms; its first axis points from ``at`` to ``end``.

    Its spin is zero.  The other axes are any two across it: a slender rod has the same inertia about all of them.
    """
    v, a = velocity_at(on, at), acceleration_at(on, at)
    along = sub(end, at)
    per = 1.0 / norm(along)
    s = scale(per, along)
    ds = scale(per, sub(velocity_at(to, end), v))
    d2s = scale(per, sub(acceleration_at(to, end), a))
    body = Moving(at, v, a, cross(s, ds), cross(s, d2s))
    y = across(s)
    z = cross(s, y)
    put_body(out, body, s, y, z, at)
    put(axes[0], y)
    put(axes[1], z)
    return body


@inline
def across(s: Vector) -> Vector:
    """Any unit vector across a unit vector."""
    x, y, z = abs(s[0]), abs(s[1]), abs(s[2])
    found = (0.0, -s[2], s[1])
    if y <= x and y <= z:
        found = (s[2], 0.0, -s[0])
    elif z <= x and z <= y:
        found = (-s[1], s[0], 0.0)
    return scale(1.0 / norm(found), found)


@inline
def put_line(out: Array, point: Vector, direction: Vector) -> None:
    """Write a line along which a force closes a loop, (PER_LINE,)."""
    put(out, point)
    put(out[3:], direction)


@inline
def put_ball(out: Array, point: Vector) -> None:
    """Write the three lines of a ball joint, (3, PER_LINE)."""
    put_line(out[0], point, (1.0, 0.0, 0.0))
    put_line(out[1], point, (0.0, 1.0, 0.0))
    put_line(out[2], point, (0.0, 0.0, 1.0))


class Shaft(NamedTuple):
    """A crank's centre, its axis, and the directions of its angles 0 and 90 degrees."""

    centre: Vector
    axis: Vector
    first: Vector
    second: Vector


@inline
def main_shaft(alpha: float, along: float) -> Shaft:
    """Shaft whose axis (0, sin alpha, cos alpha) goes through the origin, with its centre a length along it."""
    sa, ca = math.sin(alpha), math.cos(alpha)
    axis = (0.0, sa, ca)
    return Shaft(scale(along, axis), axis, (1.0, 0.0, 0.0), (0.0, ca, -sa))


@inline
def put_crank(out: Array, axis_out: Array, s: Shaft, radius: float, u: float, v: float) -> tuple[Moving, Vector]:
    """Write a crank of cosine ``u`` and sine ``v``; return its rates and its pin."""
    put(axis_out, s.axis)
    crank = put_turning(out, s.centre, s.axis, mix(u, s.first, v, s.second), 1.0, 0.0)
    return crank, add(s.centre, scale(radius, mix(u, s.first, v, s.second)))


@inline
def turned_about(axis: Vector, cos: float, sin: float, a: Vector) -> Vector:
    """Return a vector turned about a unit axis."""
    return add(mix(cos, a, sin, cross(axis, a)), scale((1.0 - cos) * dot(axis, a), axis))


@inline
def inertia_times(body: Posed, data: Array, a: Vector) -> Vector:
    """Inertia tensor of a body times a vector in fixed axes."""
    p, q, r = dot(body.x, a), dot(body.y, a), dot(body.z, a)
    return turned(body.x, body.y, body.z, (
        data[4] * p + data[5] * q + data[6] * r, data[5] * p + data[7] * q + data[8] * r,
        data[6] * p + data[8] * q + data[9] * r,
    ))  # fmt: skip
