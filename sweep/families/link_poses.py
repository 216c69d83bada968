"""Poses of bodies out of points and angles with their rates, for families whose trees of links need no kernel."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from kernels.types import Array
from sweep.families.base import Angles, Columns

if TYPE_CHECKING:
    from kernels.linkage.bodies import Links

_Z = np.array([0.0, 0.0, 1.0])


class Path(NamedTuple):
    """A point or vector with its first two derivatives by the crank angle, each (n, m, 3)."""

    at: Array
    v: Array
    a: Array

    def plus(self, other: Path) -> Path:
        """Return the sum."""
        return Path(*(x + y for x, y in zip(self, other, strict=True)))

    def minus(self, other: Path) -> Path:
        """Return the difference."""
        return Path(*(x - y for x, y in zip(self, other, strict=True)))


class Turning(NamedTuple):
    """An angle about z with its first two derivatives by the crank angle, each (n, m)."""

    angle: Array
    rate: Array
    bend: Array

    def arm(self, along: Array, across: Array | float = 0.0) -> Path:
        """Return a vector that turns with the angle: along its direction and to the left of it, (n, 1) or (n, m)."""
        cos, sin = np.cos(self.angle), np.sin(self.angle)
        at = _stacked(along * cos - across * sin, along * sin + across * cos)
        turned = np.cross(_Z, at)
        rate, bend = self.rate[..., None], self.bend[..., None]
        return Path(at, rate * turned, bend * turned - rate * rate * at)


def _stacked(x: Array, y: Array) -> Array:
    return np.stack([x, y, np.zeros_like(x + y)], axis=-1)


def crank_angle(angles: Angles, n: int, per: Array | float = 1.0, ahead: Array | float = 0.0) -> Turning:
    """Return ``per`` times the crank angle plus ``ahead``, (n, 1) each, for n designs."""
    phi = np.broadcast_to(np.arctan2(angles.sin, angles.cos), (n, angles.cos.shape[1]))
    return Turning(per * phi + ahead, np.ones_like(phi) * per, np.zeros_like(phi))


def turning(motion: Columns, *names: str) -> Turning:
    """Return an angle and its derivatives out of pose outputs."""
    return Turning(*(np.asarray(motion[name], np.float64) for name in names))


def sliding(motion: Columns, names: tuple[str, str, str], way: tuple[float, float, float]) -> Path:
    """Return a vector along a fixed way, of pose outputs that are its length and derivatives."""
    return Path(*(np.asarray(motion[name], np.float64)[..., None] * np.array(way) for name in names))


def standing_at(shape: tuple[int, int], *coordinates: Array | float) -> Path:
    """Return a fixed point, from coordinates that are numbers or (n, 1)."""
    at = np.stack([np.broadcast_to(np.asarray(x, np.float64), shape) for x in coordinates], axis=-1)
    return Path(at, np.zeros_like(at), np.zeros_like(at))


def crank_arm(angles: Angles, alpha: Array, length: Array) -> Path:
    """Return the arm of a crank about the axis (0, sin alpha, cos alpha), from X; ``alpha`` and ``length`` (n, 1)."""
    second = np.stack([0.0 * alpha, np.cos(alpha), -np.sin(alpha)], axis=-1)
    first, length = np.array([1.0, 0.0, 0.0]), length[..., None]
    cos, sin = angles.cos[..., None], angles.sin[..., None]
    at = length * (cos * first + sin * second)
    return Path(at, length * (cos * second - sin * first), -at)


def put_about(links: Links, body: int, at: Path, turned: Turning) -> None:
    """Write a body that turns about z, first axis at the angle; its joint is its origin."""
    x = turned.arm(np.ones((1, 1))).at
    _put(links, body, at, x, np.cross(_Z, x), turned.rate[..., None] * _Z, turned.bend[..., None] * _Z)


def put_shifted(links: Links, body: int, at: Path) -> None:
    """Write a body that does not turn; its axes are those of the frame."""
    none = np.zeros(3)
    _put(links, body, at, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), none, none)


def put_crank(links: Links, body: int, freedom: int, at: Path, arm: Path) -> None:
    """Write a crank that turns with the crank angle, first axis along its arm, and the axis that drives it."""
    x = arm.at / np.linalg.norm(arm.at, axis=-1, keepdims=True)
    y = arm.v / np.linalg.norm(arm.v, axis=-1, keepdims=True)
    u = np.cross(x, y)
    _put(links, body, at, x, y, u, np.zeros(3))
    links.axes[:, :, freedom] = u


def put_between(links: Links, body: int, start: Path, end: Path) -> None:
    """Write a body between two points of one distance, first axis along it; it does not spin about that.

    The second axis lies in the plane z = 0 where the points do.
    """
    along = end.minus(start)
    square = (along.at * along.at).sum(axis=-1, keepdims=True)
    x = along.at / np.sqrt(square)
    least = np.eye(3)[np.where(np.abs(x[..., 2]) < 0.5, 2, 0)]
    y = np.cross(least, x)
    y /= np.linalg.norm(y, axis=-1, keepdims=True)
    _put(links, body, start, x, y, np.cross(along.at, along.v) / square, np.cross(along.at, along.a) / square)


def _put(links: Links, body: int, at: Path, x: Array, y: Array, omega: Array, eps: Array) -> None:
    record = links.bodies[:, :, body]
    for k, part in enumerate((*at, omega, eps, x, y, np.cross(x, y), at.at)):
        record[:, :, 3 * k : 3 * k + 3] = part


def put_pin(links: Links, first: int, at: Array) -> None:
    """Write the two lines of a pin square to the plane z = 0."""
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


def turn_about_z(links: Links, *freedoms: int) -> None:
    """Make z the axis of these freedoms."""
    for freedom in freedoms:
        links.axes[:, :, freedom] = _Z
