"""What a curve holds between the poses of a scan: fast waves, narrow peaks, and the edges at which it bends or jumps.

A family says so by its capabilities (`sweep.families.pace`); most have none of them.
"""

from __future__ import annotations

import math

import numpy as np

from sweep.families.base import Array, Family
from sweep.families.domain import Interval
from sweep.families.pace import Crossing, Singular, Switches, Waves, crossed, switches
from sweep.reductions.cuts import events
from sweep.reductions.density import FEWEST, denser
from sweep.reductions.sampling import TWO_PI

LOOKS = 512  # poses among which levels that are passed, and followers that reverse, are looked for
BESIDE = 1e-11  # distance from an edge at which its sides are looked at [rad]
REACH = 0.1  # by which an edge moves with a step of the search at most [rad]: further ones are others


def poses_needed(family: Family, design: Array) -> int:
    """Return how many poses of a turn show all that a design's curves hold; 0 where any number will do."""
    if isinstance(family.domain, Interval) or not any(family.every(kind) for kind in (Waves, Singular, Switches)):
        return 0
    return int(FEWEST * denser(family, design[None, :])[0])


def may_bend(family: Family, outputs: tuple[str, ...]) -> bool:
    """Return whether some of the pose outputs have kinks or jumps in some design."""
    if isinstance(family.domain, Interval):
        return False
    return bool(family.every(Crossing)) or any(_bends(family, name) for name in outputs)


def bending(family: Family, design: Array, outputs: tuple[str, ...]) -> list[int]:
    """Return the numbers of the pose outputs that have kinks or jumps in this design."""
    jumps = bool(crossed(family, design[None, :])[0])
    return [n for n, name in enumerate(outputs) if jumps or _bends(family, name)]


def edges(family: Family, design: Array) -> tuple[Array, Array]:
    """Return crank angles just before and just behind every edge, (2, k) [rad], and what the edge is, (k,).

    The latter is 1 + j for the end j of those known beforehand, 1/2 where a level is passed or a follower reverses.
    """
    known, found = switches(family, design[None, :])[0], events(family.precise(), design[None, :], LOOKS)[1]
    cut = np.concatenate([known, found])
    which = np.concatenate([np.arange(1.0, 1.0 + known.size), np.full(found.size, 0.5)])
    return np.stack([cut - BESIDE, cut + BESIDE]), which


def followed(family: Family, designs: Array, phi: Array, level: Array) -> Array:
    """Return where points at edges belong on other designs, (n, k).

    An end known beforehand is found by its number, another one as the nearest: where that is far away the point stays.

    Parameters
    ----------
    family, designs : (n, P)
    phi : (k,) crank angles of the points, beside an edge of a design near by
    level : (k,) what the edge is, negative for a point before it
    """
    side, number = np.sign(level), np.abs(level)
    at, moved = phi - BESIDE * side, np.zeros((len(designs), len(phi)))
    known = np.flatnonzero(number >= 1.0)
    if known.size:
        moved[:, known] = _way(at[known], switches(family, designs)[:, number[known].astype(np.intp) - 1])
    other = np.flatnonzero(number < 1.0)
    if other.size:
        rows, found = events(family.precise(), designs, LOOKS)
        for row in range(len(designs)):
            ways = _way(at[other], found[rows == row][:, None])
            nearest = np.abs(ways).argmin(axis=0) if len(ways) else np.zeros(other.size, np.intp)
            way = ways[nearest, np.arange(other.size)] if len(ways) else np.zeros(other.size)
            moved[row, other] = np.where(np.abs(way) <= REACH, way, 0.0)
    return np.asarray(phi + moved, np.float64)


def distances(edges: Array, phi: Array) -> Array:
    """Return the distance of every crank angle (k,) from the nearest of some edges [rad]."""
    return np.asarray(np.abs(_way(phi, edges[:, None])).min(axis=0, initial=math.pi), np.float64)


def _way(start: Array, end: Array) -> Array:
    """Return the shorter way from one crank angle to another [rad]."""
    return np.asarray(np.remainder(end - start + math.pi, TWO_PI) - math.pi, np.float64)


def _bends(family: Family, name: str) -> bool:
    output = family.pose_output[name]
    return output.kinks or output.jumps
