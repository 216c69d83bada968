"""Gaps between bodies of a machine, modelled as capsules: distances and sides of segments; machine-and-stitch, 4.

A point is a list of its coordinates, arrays of one shape; all functions take complex numbers, for gradients by the
complex step: comparisons use real parts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from sweep.families.base import Output
from sweep.families.machines.relations import Relation
from sweep.families.sites import Spot

Point: TypeAlias = Sequence[Any]


class Closest(NamedTuple):
    """Distance of two segments, and the places of the shortest connection along each, 0 to 1."""

    distance: Any
    first: Any
    second: Any


def dot(a: Point, b: Point) -> Any:
    """Dot product without conjugation."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Point, b: Point) -> list[Any]:
    """Cross product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def minus(a: Point, b: Point) -> list[Any]:
    """Vector from b to a."""
    return [x - y for x, y in zip(a, b, strict=True)]


def closest(p1: Point, q1: Point, p2: Point, q2: Point) -> Closest:
    """Compute the distance of the segments p1 q1 and p2 q2, (9).

    It is the minimum of a convex function over a square: at one of four ends against the other segment, or inside both.
    Each candidate is the length of an actual difference, so none is too small; parallel segments need no threshold.
    The place inside is reckoned from the nearest end: the difference is short there, and its products keep their digits
    where the segments are nearly parallel.
    """
    d1, d2, w = minus(q1, p1), minus(q2, p2), minus(p2, p1)

    def apart(s: Any, t: Any) -> list[Any]:
        return [x + t * b - s * a for x, a, b in zip(w, d1, d2, strict=True)]

    def at(s: Any, t: Any) -> Closest:
        off = apart(s, t)
        return Closest(np.sqrt(dot(off, off)), s, t)

    zero = 0.0 * dot(w, w)
    nearest_end = reduce(
        _nearer,
        (
            at(zero, _foot(minus(p1, p2), d2)),
            at(zero + 1.0, _foot(minus(q1, p2), d2)),
            at(_foot(w, d1), zero),
            at(_foot(minus(q2, p1), d1), zero + 1.0),
        ),
    )
    _, s, t = nearest_end
    off, n = apart(s, t), cross(d1, d2)
    square = dot(n, n)
    crossed = np.real(square) > 0.0
    size = np.where(crossed, square, 1.0)
    s, t = s + dot(cross(off, d2), n) / size, t + dot(cross(off, d1), n) / size
    inside = crossed & _within(s) & _within(t)
    return _nearer(nearest_end, at(np.where(inside, s, 0.0), np.where(inside, t, 0.0)))


def _nearer(one: Closest, other: Closest) -> Closest:
    closer = np.real(other.distance) < np.real(one.distance)
    return Closest(*(np.where(closer, b, a) for a, b in zip(one, other, strict=True)))


def triple_product(p1: Point, q1: Point, p2: Point, q2: Point) -> Any:
    """Return d1 . ((p2 - p1) x (q2 - p1)), (11): the signed distance of the lines, times the size of d1 x d2.

    Its sign changes where the lines meet or are parallel.
    """
    return -dot(minus(p2, p1), cross(minus(q1, p1), minus(q2, p2)))


def _within(x: Any) -> Any:
    return (np.real(x) >= 0.0) & (np.real(x) <= 1.0)


def _foot(v: Point, d: Point) -> Any:
    """Place along d, 0 to 1, that is nearest to v; 0 for a segment of zero length."""
    square = dot(d, d)
    some = np.real(square) > 0.0
    t = dot(v, d) / np.where(some, square, 1.0)
    return np.where(np.real(t) > 0.0, np.where(np.real(t) < 1.0, t, 1.0), 0.0) * some


@dataclass(frozen=True)
class Capsule:
    """The segment between two points, with a radius."""

    name: str
    ends: tuple[Spot, Spot]
    radius: float = 0.0

    @property
    def needs(self) -> set[str]:
        """Names of the coordinates of its ends."""
        return self.ends[0].needs(False) | self.ends[1].needs(False)


@dataclass(frozen=True)
class Gap(Relation):
    """Distance of two bodies, less their radii."""

    bodies: tuple[Capsule, Capsule]

    @property
    def outputs(self) -> tuple[Output, ...]:
        """The gap, the places along both bodies, and the side."""
        a, b = self.bodies
        places = (
            Output(f"{self.name}_{k}", "1", f"where along {body.name} it is nearest, 0 to 1", "(9)", kinks=True)
            for k, body in (("first", a), ("second", b))
        )
        side = (
            f"signed distance of the lines of {a.name} and {b.name}, times the sine of their angle; 0 where they meet"
        )
        return (
            Output(self.name, "length", f"gap between {a.name} and {b.name}, less their radii", "(9)", kinks=True),
            *places,
            Output(f"{self.name}_side", "length", side, "(11)"),
        )

    def needs(self, wanted: frozenset[str]) -> frozenset[str]:
        """Names of the coordinates of both bodies' ends."""
        return frozenset(self.bodies[0].needs | self.bodies[1].needs)

    def compute(self, found: Mapping[str, Any], wanted: frozenset[str]) -> dict[str, Any]:
        """Compute the gap, its places along the bodies, and the side, (n, m)."""
        (p1, q1), (p2, q2) = ([end.position(found) for end in body.ends] for body in self.bodies)
        nearest = closest(p1, q1, p2, q2)
        columns = {self.name: nearest.distance - sum(body.radius for body in self.bodies)}
        columns |= {f"{self.name}_first": nearest.first, f"{self.name}_second": nearest.second}
        if f"{self.name}_side" in wanted:
            sizes = [np.sqrt(dot(d, d)) for d in (minus(q1, p1), minus(q2, p2))]
            columns[f"{self.name}_side"] = triple_product(p1, q1, p2, q2) / (sizes[0] * sizes[1])
        return columns
