"""Scan of a curve for extrema, passages of a level, and edges at which it bends or jumps."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from kernels.types import TWO_PI
from sweep.families.base import Array, Family, Interval
from sweep.families.curve_features import Crossing, Singular, Switches, Waves, about, crossed, switches
from sweep.numerics.records import Indices, Mask
from sweep.reductions.resolution import FEWEST, denser, events

if TYPE_CHECKING:
    from sweep.optimise.extrema.points import Points

# Kinds of points: an extremum that approaches a level is stationary, PASSING is a passage of the level.
STATIONARY, CROSSING, STATIC, PASSING, EDGE = range(5)

PointRow: TypeAlias = tuple[int, float, float, int, float, float]


def extrema(
    n: int, phi: Array, x: Array, wrapped: bool, sense: float, inside: Mask | None = None, level: float = math.nan
) -> list[PointRow]:
    """Return the maxima (sense +1) or minima (-1) of a curve; the ``level`` of these points is as given."""
    if not np.isfinite(x).all():
        return []
    if wrapped:
        x = np.unwrap(x)
        if abs(x[0] - x[-1] + math.remainder(x[-1] - x[0], 2.0 * math.pi)) > 1.0:
            return []  # turns fully: has no limit positions
    eligible = np.ones(len(x), dtype=np.bool_) if inside is None else inside
    if not eligible.any():
        return []
    top, bottom = float(x[eligible].max()), float(x[eligible].min())
    if top - bottom <= 1e-13 * max(abs(top), abs(bottom)):
        return [(n, float(phi[0]), sense, STATIC, level, float(x[0]))]
    before, after, middle = np.roll(x, 1), np.roll(x, -1), 0.5 * (top + bottom)
    peak = eligible & (sense * x > sense * before) & (sense * x >= sense * after)
    if inside is None:
        # All extrema inside a window count: a refused step cannot add the extrema of its design.
        peak &= sense * (x - middle) >= 0.0
    return [(n, float(phi[j]), sense, STATIONARY, level, float(x[j])) for j in np.flatnonzero(peak)]


def edge_extrema(n: int, phi: Array, edge: Array, values: Array, curve: Array) -> list[PointRow]:
    """Return points at the higher side of every edge as maxima and at the lower side as minima.

    Their level is the number of the edge, negative for a point before it.

    Parameters
    ----------
    n : number of the series
    phi, values : (2, k) both sides of the edges, and the curve there
    edge : (k,) number of each edge
    curve : (m,) the curve over the turn; only points in its upper half can be relevant maxima
    """
    if not np.isfinite(values).all():
        return []
    heights = np.concatenate([curve, values.ravel()])
    middle = 0.5 * (float(heights.max()) + float(heights.min()))
    rows: list[PointRow] = []
    for sense in (1.0, -1.0):
        side = np.argmax(sense * values, axis=0)
        for k, x in enumerate(np.take_along_axis(values, side[None, :], axis=0)[0].tolist()):
            if sense * (x - middle) >= 0.0:
                rows.append((n, float(phi[side[k], k]), sense, EDGE, (2.0 * float(side[k]) - 1.0) * float(edge[k]), x))
    return rows


def passages(n: int, phi: Array, x: Array, level: float, sense: float) -> list[PointRow]:
    """Find where samples over the turn pass the level in the given sense, and where they only approach it.

    Rows are those of :meth:`sweep.optimise.extrema.points.Points.of`.  The extrema that approach the level without
    reaching it show how far a further passage is.
    """
    if not np.isfinite(x).all():
        return []
    gap = sense * (x - level)
    before, after, step = np.roll(gap, 1), np.roll(gap, -1), 2.0 * math.pi / len(phi)
    roots = np.flatnonzero((gap < 0.0) & (after >= 0.0))
    approaching = np.flatnonzero((gap < 0.0) & (gap > before) & (gap >= after))
    passing = [(n, float(phi[j] + step * gap[j] / (gap[j] - after[j])), sense, PASSING, level, level) for j in roots]
    return passing + [(n, float(phi[j]), sense, STATIONARY, level, float(x[j])) for j in approaching]


def first_passage(phi: Array, kind: Indices, candidates: Sequence[int]) -> tuple[int | None, list[int]]:
    """Return the point at which a curve first passes its level in [0, 2 pi).

    Points before it that only approach the level are returned, too.

    Parameters
    ----------
    phi, kind : (K,) angles and kinds of the points
    candidates : numbers of the curve's points

    Notes
    -----
    If a point that only approaches the level reaches it, an earlier passage arises and the event jumps to it.  No
    gradient predicts that, so the search has to keep these points on their side of the level.
    """
    order = sorted(candidates, key=lambda k: math.remainder(phi[k] - math.pi, math.tau))
    before = list(itertools.takewhile(lambda k: kind[k] != PASSING, order))
    first = order[len(before)] if len(before) < len(order) else None
    return first, before


SAMPLES = 512  # samples of a turn in which passages of levels and reversals of followers are sought
EDGE_OFFSET = 1e-11  # distance from an edge at which its sides are evaluated [rad]
MAX_EDGE_MOTION = 0.1  # largest motion of an edge in one step of the search [rad]; an edge farther away is another one


def poses_needed(family: Family, design: Array, outputs: Collection[str]) -> int:
    """Return the number of poses per turn that resolves the curves of a design; 0 if any number will do."""
    if isinstance(family.domain, Interval) or not any(family.every(kind) for kind in (Waves, Singular, Switches)):
        return 0
    return int(FEWEST * denser(family, design[None, :], outputs)[0])


def may_bend(family: Family, outputs: tuple[str, ...]) -> bool:
    """Return whether some of the pose outputs have kinks or jumps in some design."""
    if isinstance(family.domain, Interval):
        return False
    return bool(about(family, Crossing, outputs)) or any(_bends(family, name) for name in outputs)


def bending(family: Family, design: Array, outputs: tuple[str, ...]) -> list[int]:
    """Return the numbers of the pose outputs that have kinks or jumps in this design."""
    row = design[None, :]
    return [n for n, name in enumerate(outputs) if crossed(family, row, (name,))[0] or _bends(family, name)]


def edges(family: Family, design: Array, outputs: Collection[str]) -> tuple[Array, Array]:
    """Return crank angles just before and just behind every edge of some curves, (2, k) [rad], and its number, (k,).

    The number is 1 + j for the end j of those known beforehand, 1/2 for a passed level, a reversal of a follower, or a
    zero at which the curves bend.
    """
    prescribed = switches(family, design[None, :], outputs)[0]
    detected = events(family.precise(), design[None, :], SAMPLES, outputs)[1]
    angles = np.concatenate([prescribed, detected])
    numbers = np.concatenate([np.arange(1.0, 1.0 + prescribed.size), np.full(detected.size, 0.5)])
    return np.stack([angles - EDGE_OFFSET, angles + EDGE_OFFSET]), numbers


def moved_edges(family: Family, designs: Array, phi: Array, level: Array, outputs: Collection[str]) -> Array:
    """Return the crank angles of edge points on other designs, (n, k).

    An end known beforehand is found by its number, any other edge as the nearest one; without a near one the point
    stays.

    Parameters
    ----------
    family, designs : (n, P)
    phi : (k,) crank angles of the points, beside an edge of a neighbouring design
    level : (k,) number of the edge, negative for a point before it
    outputs : as of :func:`edges`
    """
    side, number = np.sign(level), np.abs(level)
    edge, shifts = phi - EDGE_OFFSET * side, np.zeros((len(designs), len(phi)))
    given = np.flatnonzero(number >= 1.0)
    if given.size:
        shifts[:, given] = _arc(edge[given], switches(family, designs, outputs)[:, number[given].astype(np.intp) - 1])
    other = np.flatnonzero(number < 1.0)
    if other.size:
        rows, angles = events(family.precise(), designs, SAMPLES, outputs)
        for row in range(len(designs)):
            distances = _arc(edge[other], angles[rows == row][:, None])
            nearest = np.abs(distances).argmin(axis=0) if len(distances) else np.zeros(other.size, np.intp)
            shift = distances[nearest, np.arange(other.size)] if len(distances) else np.zeros(other.size)
            shifts[row, other] = np.where(np.abs(shift) <= MAX_EDGE_MOTION, shift, 0.0)
    return np.asarray(phi + shifts, np.float64)


def distances(edges: Array, phi: Array) -> Array:
    """Return the distance of every crank angle (k,) from the nearest edge [rad]."""
    return np.asarray(np.abs(_arc(phi, edges[:, None])).min(axis=0, initial=math.pi), np.float64)


def overtopped(points: Points, at_edges: Points, stride: float) -> Mask:
    """Tell which points have an edge at least as high within a stride; Newton's steps towards a kink end beside it."""
    mask = np.zeros(len(points), np.bool_)
    for k in range(len(at_edges)):
        edge = at_edges.take([k])
        near = (points.series == edge.series) & (points.sense == edge.sense)
        near &= distances(edge.phi, points.phi) <= stride
        mask |= near & (points.sense * (edge.value - points.value) >= 0.0)
    return mask


def _arc(start: Array, end: Array) -> Array:
    """Return the shorter way between two crank angles, in [-pi, pi) [rad]."""
    return np.asarray(np.remainder(end - start + math.pi, TWO_PI) - math.pi, np.float64)


def _bends(family: Family, name: str) -> bool:
    output = family.pose_output[name]
    return output.kinks or output.jumps
