"""Bodies and joints of a linkage as a tree with loops: the capability from which the loads of any linkage follow.

Families whose trees of links need no kernel compute the poses of their bodies here, from points and angles with their
rates.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

import numpy as np

from kernels.linkage.bodies import FRAME, TURN
from kernels.types import Array
from sweep.families.base import Angles, Columns, Parameter, floats
from sweep.families.capabilities import DesignMap

if TYPE_CHECKING:  # families without kernels of trees do not wait for the import
    from kernels.linkage.bodies import Links


@dataclass(frozen=True)
class LinkBody:
    """A body of a :class:`LinkTree`: its name in the names of inputs, and a description of its axes x, y, z.

    It hangs on the ``parent``, an earlier body, with the freedoms ``free``.  A ``slender`` one is a rod along x between
    two balls, whose spin about x has no inertia.
    """

    name: str
    axes: str
    parent: int = FRAME
    free: tuple[int, ...] = (TURN,)
    slender: bool = False


@dataclass(frozen=True)
class LinkJoint:
    """A joint of a :class:`LinkTree` whose reaction is computed.

    Parameters
    ----------
    name, text : name in the names of outputs, and description
    kind : "shaft" turns about an axis on two supports, "sleeve" slides along it too; "hinge" is a ball by which a body
        hangs on its parent, "ball" one that closes a loop; "contact" slides
    acts : the bodies of the reaction in words, "frame on the crank"
    body : body of a shaft, a sleeve or a hinge; the axis of a shaft or sleeve is that of the body's first freedom
    lines : of a ball or a contact, its first line and the number of its lines
    touch : kind of a non-conforming contact: a ball or a pin in a straight slot, a strap on an eccentric
    """

    name: str
    text: str
    kind: Literal["shaft", "hinge", "sleeve", "ball", "contact"]
    acts: str
    body: int = -1
    lines: tuple[int, int] = (-1, 0)
    touch: Literal["", "ball", "line", "strap"] = ""


LinkFill: TypeAlias = "Callable[[Array, Angles, Columns, Links], None]"


@dataclass(frozen=True)
class LinkTree:
    """Any number of bodies with the joints between them, for the computation of loads: :mod:`kernels.linkage.bodies`.

    Parameters
    ----------
    bodies, joints : in the order of their numbers
    ends : both bodies of each line, as :class:`kernels.linkage.bodies.Links` takes them, of an ordinary design
    needs : pose outputs from which ``fill(designs, angles, motion, links)`` computes the poses of the bodies
    carrier : number of the body that carries a tool
    tip : place of the tool in the axes of that body, (n, 3); None if it is an input
    output : number of the freedom that is the family's position, on which a load acts; -1 without a load
    rubs : whether its joints have dimensions for friction and bearings
    arms : numbers of bodies without a second joint, each with the line whose point is their end
    unit : input that is the length unit of the family's dimensions and of the results of ``fill``; None for mm
    """

    bodies: tuple[LinkBody, ...]
    joints: tuple[LinkJoint, ...]
    ends: tuple[tuple[int, int], ...]
    needs: tuple[str, ...]
    fill: LinkFill
    carrier: int
    tip: DesignMap | None = None
    output: int = -1
    rubs: bool = True
    arms: tuple[tuple[int, int], ...] = ()
    unit: Parameter | None = None

    @cached_property
    def freedoms(self) -> tuple[tuple[int, int], ...]:
        """Body and kind of each freedom, for :class:`kernels.linkage.bodies.Links`."""
        return tuple((k, kind) for k, body in enumerate(self.bodies) for kind in body.free)

    def freedom(self, joint: LinkJoint) -> int:
        """Return the number of the freedom whose axis is that of a shaft or a sleeve; -1 for any other joint."""
        own = joint.kind in ("shaft", "sleeve")
        return [body for body, _ in self.freedoms].index(joint.body) if own else -1


_Z = np.array([0.0, 0.0, 1.0])


class Path(NamedTuple):
    """A point or vector with its first two derivatives by the crank angle, each (n, m, 3)."""

    at: Array
    v: Array
    a: Array

    def plus(self, other: Path) -> Path:
        """Return the sum of two paths."""
        return Path(*(x + y for x, y in zip(self, other, strict=True)))

    def minus(self, other: Path) -> Path:
        """Return the difference of two paths."""
        return Path(*(x - y for x, y in zip(self, other, strict=True)))


class Turning(NamedTuple):
    """An angle about z with its first two derivatives by the crank angle, each (n, m)."""

    angle: Array
    rate: Array
    bend: Array

    def arm(self, along: Array, across: Array | float = 0.0) -> Path:
        """Return a vector that turns with the angle: parts along its direction and to its left, (n, 1) or (n, m)."""
        cos, sin = np.cos(self.angle), np.sin(self.angle)
        x, y = along * cos - across * sin, along * sin + across * cos
        at = np.stack([x, y, np.zeros_like(x + y)], axis=-1)
        turned = np.cross(_Z, at)
        rate, bend = self.rate[..., None], self.bend[..., None]
        return Path(at, rate * turned, bend * turned - rate * rate * at)


def crank_angle(links: Links, angles: Angles, per: Array | float = 1.0, ahead: Array | float = 0.0) -> Turning:
    """Return ``per`` times the crank angle plus ``ahead``, (n, 1) each, at every pose of the bodies."""
    phi = np.broadcast_to(np.arctan2(angles.sin, angles.cos), links.bodies.shape[:2])
    return Turning(per * phi + ahead, np.ones_like(phi) * per, np.zeros_like(phi))


def turning(motion: Columns, *names: str) -> Turning:
    """Make an angle with its derivatives from pose outputs."""
    return Turning(*floats(motion, *names))


def sliding(motion: Columns, names: tuple[str, str, str], way: tuple[float, float, float]) -> Path:
    """Make a vector of fixed direction, whose length and derivatives are pose outputs."""
    return Path(*(np.asarray(motion[name], np.float64)[..., None] * np.array(way) for name in names))


def standing_at(links: Links, x: Array | float = 0.0, y: Array | float = 0.0, z: Array | float = 0.0) -> Path:
    """Make a fixed point at every pose of the bodies, from coordinates that are numbers or (n, 1)."""
    shape = links.bodies.shape[:2]
    at = np.stack([np.broadcast_to(np.asarray(part, np.float64), shape) for part in (x, y, z)], axis=-1)
    return Path(at, np.zeros_like(at), np.zeros_like(at))


def crank_arm(links: Links, angles: Angles, alpha: Array, length: Array) -> Path:
    """Return the arm of a crank about the axis (0, sin alpha, cos alpha), from X; ``alpha`` and ``length`` (n, 1)."""
    second = np.stack([0.0 * alpha, np.cos(alpha), -np.sin(alpha)], axis=-1)
    first, length = np.array([1.0, 0.0, 0.0]), length[..., None]
    cos, sin = angles.cos[..., None], angles.sin[..., None]
    at = length * (cos * first + sin * second)
    path = at, length * (cos * second - sin * first), -at
    return Path(*(np.broadcast_to(part, (*links.bodies.shape[:2], 3)) for part in path))


def _freedoms(links: Links, body: int) -> list[int]:
    """Numbers of the freedoms of a body."""
    return np.flatnonzero((links.freedoms[:, :, 0] == body).any(axis=0)).tolist()


def put_about(links: Links, body: int, at: Path, turned: Turning, way: Array = _Z) -> None:
    """Write a body that turns about z, with the first axis at the angle; its joint is its origin.

    It turns freely on its parent, or slides along ``way`` on one that turns like it.
    """
    x = turned.arm(np.ones((1, 1))).at
    links.axes[:, :, _freedoms(links, body)] = way[..., None, :]
    _put(links, body, at, x, np.cross(_Z, x), turned.rate[..., None] * _Z, turned.bend[..., None] * _Z)


def put_shifted(links: Links, body: int, at: Path, way: tuple[float, float, float]) -> None:
    """Write a body that slides along ``way`` and does not turn; its axes are those of the frame."""
    none = np.zeros(3)
    links.axes[:, :, _freedoms(links, body)] = way
    _put(links, body, at, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), none, none)


def put_crank(links: Links, body: int, at: Path, arm: Path) -> None:
    """Write a crank with its first axis along its arm, and the axis that drives it."""
    x = arm.at / np.linalg.norm(arm.at, axis=-1, keepdims=True)
    y = arm.v / np.linalg.norm(arm.v, axis=-1, keepdims=True)
    u = np.cross(x, y)
    _put(links, body, at, x, y, u, np.zeros(3))
    links.axes[:, :, _freedoms(links, body)] = u[..., None, :]


def put_between(links: Links, body: int, start: Path, end: Path) -> None:
    """Write a body between two points of constant distance, with the first axis along it and no spin about that axis.

    If the points are in the plane z = 0, so is the second axis.  A body of one freedom turns about z, one of two about
    its second and third axis.
    """
    along = end.minus(start)
    square = (along.at * along.at).sum(axis=-1, keepdims=True)
    x = along.at / np.sqrt(square)
    least = np.eye(3)[np.where(np.abs(x[..., 2]) < 0.5, 2, 0)]
    y = np.cross(least, x)
    y /= np.linalg.norm(y, axis=-1, keepdims=True)
    own = _freedoms(links, body)
    for freedom, way in zip(own, (_Z,) if len(own) == 1 else (y, np.cross(x, y)), strict=False):
        links.axes[:, :, freedom] = way
    _put(links, body, start, x, y, np.cross(along.at, along.v) / square, np.cross(along.at, along.a) / square)


def _put(links: Links, body: int, at: Path, x: Array, y: Array, omega: Array, eps: Array) -> None:
    record = links.bodies[:, :, body]
    for k, part in enumerate((*at, omega, eps, x, y, np.cross(x, y), at.at)):
        record[:, :, 3 * k : 3 * k + 3] = part


def put_pin(links: Links, first: int, at: Array) -> None:
    """Write the two lines of a pin perpendicular to the plane z = 0."""
    put_line(links, first, at, np.array([1.0, 0.0, 0.0]))
    put_line(links, first + 1, at, np.array([0.0, 1.0, 0.0]))


def put_ball(links: Links, first: int, at: Array) -> None:
    """Write the three lines of a ball."""
    put_pin(links, first, at)
    put_line(links, first + 2, at, _Z)


def put_line(links: Links, line: int, at: Array, way: Array) -> None:
    """Write a line of force through a point; ``way`` need not be a unit vector."""
    links.lines[:, :, line, :3] = at
    links.lines[:, :, line, 3:] = way / np.linalg.norm(way, axis=-1, keepdims=True)
