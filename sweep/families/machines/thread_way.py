"""Path of a thread over points, blades and take-ups of a machine: length, its derivative, and bends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from kernels.types import TWO_PI
from sweep.families.machines.segments import Point, dot, minus
from sweep.families.sites import Spot

PHI = "phi"


@dataclass(frozen=True)
class TakeUp:
    """A take-up in the path: the dotted names of the pose outputs for the thread it takes up and its wrap angle.

    ``kinks`` tells whether these outputs have kinks and jumps, as where the thread comes to lie on a bare edge.
    """

    taken: str
    wrap: str
    kinks: bool = False


@dataclass(frozen=True)
class Edge:
    """A blade over which the thread slides without friction, at the place of the shortest way."""

    tip: Spot
    back: Spot


@dataclass(frozen=True)
class Waypoint:
    """A place over which a thread runs.

    Parameters
    ----------
    on : a point, a blade, a take-up
    held : two events, from and to, between which the thread runs over the place; () for the whole turn
    wrap : angle of wrap there beside the bend of the path, as in a needle's eye [rad]
    fixed : two events between which the thread does not slide there, so that the bend adds no tension; () for never
    """

    on: Spot | Edge | TakeUp
    held: tuple[str, ...] = ()
    wrap: float = 0.0
    fixed: tuple[str, ...] = ()


class PlacedPoint(NamedTuple):
    """A place at every pose: coordinates, velocity, and the mask of the poses at which thread lies on it, or None."""

    at: Point
    rate: Point
    on: Any


Run: TypeAlias = tuple[Waypoint, ...]


def spots(place: Waypoint) -> tuple[Spot, ...]:
    """Return the points of a place of a path."""
    if isinstance(place.on, TakeUp):
        return ()
    return (place.on,) if isinstance(place.on, Spot) else (place.on.tip, place.on.back)


def turned(angle: Any) -> Any:
    """Reduce an angle to one turn from 0; complex angles by their real part."""
    return angle - TWO_PI * np.floor(np.real(angle) / TWO_PI)


def outside(ends: tuple[str, ...], found: Mapping[str, Any], inside: bool = False) -> Any:
    """Return the mask of the poses outside two events, or between them for ``inside``; None for the whole turn."""
    if not ends:
        return None
    # Compared as they are: at an event where several places begin or end, all masks change at the same pose.
    phi, start, end = (turned(np.real(found[name])) for name in (PHI, *(f"phi_{name}" for name in ends)))
    return np.where(start <= end, (phi >= start) & (phi < end), (phi >= start) | (phi < end)) == inside


def masked(where: Any, values: Any) -> Any:
    """Return the values where the mask holds, 0 elsewhere; all values for None."""
    return values if where is None else np.where(where, values, 0.0)


def _chosen(where: Any, a: Point, b: Point) -> Point:
    return [np.where(where, x, y) for x, y in zip(a, b, strict=True)]


def placed_points(run: Sequence[Waypoint], found: Mapping[str, Any], moving: bool) -> list[PlacedPoint]:
    """Place the points of a run; first those not on blades, which lie between points that do not depend on them."""
    pieces: list[PlacedPoint] = []
    for place in run:
        spot = place.on.tip if isinstance(place.on, Edge) else place.on
        assert isinstance(spot, Spot)
        rate = spot.velocity(found) if moving else ()
        pieces.append(PlacedPoint(spot.position(found), rate, outside(place.held, found, inside=True)))
    for k, place in enumerate(run):
        if isinstance(place.on, Edge):
            tip, back = pieces[k], place.on.back.position(found)
            t = nearest_way(beside(pieces, k, -1).at, beside(pieces, k, 1).at, tip.at, back)
            # the length is convex along the line: beyond an end the end is nearest
            t = np.where(np.real(t) < 0.0, 0.0, np.where(np.real(t) > 1.0, 1.0, t))
            on = [a + t * (b - a) for a, b in zip(tip.at, back, strict=True)]
            # the length is stationary in the place on the blade: its derivative has the motion of the blade alone
            ends = zip(tip.rate, place.on.back.velocity(found), strict=True) if moving else ()
            pieces[k] = tip._replace(at=on, rate=[a + t * (b - a) for a, b in ends])
    return pieces


def beside(pieces: Sequence[PlacedPoint], k: int, step: int) -> PlacedPoint:
    """Return the next place before or after a place over which the thread runs; at the ends it always runs."""
    piece = pieces[k + step]
    if piece.on is None:
        return piece
    other = beside(pieces, k + step, step)
    return PlacedPoint(_chosen(piece.on, piece.at, other.at), _chosen(piece.on, piece.rate, other.rate), None)


def length_and_bends(pieces: Sequence[PlacedPoint], moving: bool, bent: bool) -> tuple[Any, Any, list[Any]]:
    """Return the length of a run, its derivative, and the bends at all places but its ends."""
    length: Any = 0.0
    change: Any = 0.0
    bends = []
    for k, piece in enumerate(pieces):
        if k == 0:
            continue
        before = beside(pieces, k, -1)
        size, along = _piece(before.at, piece.at)
        length = length + masked(piece.on, size)
        if moving:
            change = change + masked(piece.on, dot(along, minus(piece.rate, before.rate)))
        if bent and k + 1 < len(pieces):
            bends.append(bend(along, _piece(piece.at, beside(pieces, k, 1).at)[1]))
    return length, change, bends


def nearest_way(p: Point, q: Point, start: Point, end: Point) -> Any:
    """Return the place on the line of a segment over which the way from p to q is shortest, 0 and 1 at its ends, (14).

    Turned about the line into one plane, on either side of it, p and q have a straight line between them.
    """
    d = minus(end, start)
    square = dot(d, d)
    feet = [dot(minus(x, start), d) / square for x in (p, q)]
    away = []
    for x, foot in zip((p, q), feet, strict=True):
        off = [u - foot * v for u, v in zip(minus(x, start), d, strict=True)]
        away.append(np.sqrt(dot(off, off)))
    both = away[0] + away[1]
    t = np.where(both == 0.0, 0.5 * (feet[0] + feet[1]), 0.0)
    return t + (feet[0] * away[1] + feet[1] * away[0]) / np.where(both == 0.0, 1.0, both)


def bend(before: Point, after: Point) -> Any:
    """Measure the angle between unit vectors of a thread, (13): 2 arctan(|e1 - e2|/|e1 + e2|), exact near 0, pi."""
    off, both = (_size([a + sign * b for a, b in zip(before, after, strict=True)]) for sign in (-1.0, 1.0))
    with np.errstate(divide="ignore", invalid="ignore"):  # folded back upon itself: arctan of infinity, half a turn
        folded = np.real(both) == 0.0
        return np.where(folded, np.pi, 2.0 * np.arctan(off / np.where(folded, 1.0, both)))


def _size(parts: Point) -> Any:
    return np.sqrt(dot(parts, parts))


def _piece(start: Point, end: Point) -> tuple[Any, Point]:
    """Return length and direction of a straight piece; a piece of zero length has no direction (nan)."""
    parts = minus(end, start)
    length = _size(parts)
    with np.errstate(divide="ignore", invalid="ignore"):
        return length, [part / length for part in parts]
