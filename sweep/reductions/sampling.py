"""Poses over whole turns: the same angles for many designs, in blocks that fit into the cache."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import NamedTuple, cast

import numpy as np

from kernels import status as st
from kernels.curves import samples as scan
from kernels.types import TWO_PI, Status
from sweep.families.base import Angles, Array, Columns, Family, Interval, PoseFunction, of_family
from sweep.families.capabilities import Assembly
from sweep.numerics.records import Indices, Mask

BLOCK = 2**17  # samples handled at once: a few columns of this length stay in the cache
UNCLEAR = 0.25  # step of an angle between two poses [turns] from which on it may have gone the other way round
FEW = 4  # number of columns above which blocks have fewer samples


@lru_cache(maxsize=32)
def turn(samples: int, between: bool = False) -> Angles:
    """Equidistant crank angles of one turn from 0, (1, samples); with ``between`` only those of odd index."""
    # Writable: kernels would be compiled once more for read-only arrays.
    phi: Array = np.arange(int(between), samples, 1 + between, dtype=np.float64)[None, :] * (TWO_PI / samples)
    return Angles.of(phi)


def blocks(rows: Indices, samples: int, columns: int = 1) -> Iterator[Indices]:
    """Yield pieces of ``rows`` so small that their samples of ``columns`` columns stay in the cache."""
    size = max(1, BLOCK * FEW // (samples * max(columns, FEW)))
    for start in range(0, rows.size, size):
        yield rows[start : start + size]


def discriminants(family: Family) -> tuple[str, ...]:
    """Pose outputs that vanish at a dead point: one per stage of a chain."""
    return tuple(loop.discriminant for loop in family.every(Assembly))


def sample_turn(
    family: Family, designs: Array, samples: int, names: Sequence[str], between: bool = False
) -> tuple[dict[str, Array], Status, Mask]:
    """Compute pose outputs over one turn, (n, samples), with unwrapped angles; the first crank angle is 0.

    With ``between`` only the crank angles that a grid of half as many samples does not have, (n, samples/2).

    Returns
    -------
    columns : the pose outputs
    worst : (n,) worst status of the turn
    winds : (n,) whether a wanted follower's angle makes full turns, so that it has no extremum
    """
    columns, status = _evaluate(family, designs, turn(samples, between), names)
    worst = np.empty(len(designs), np.uint8)
    scan.worst_status(status, worst)
    winds = np.zeros(len(designs), np.bool_)
    for name in (name for name in names if family.pose_output[name].wraps):
        winding = np.empty(len(designs), np.int64)
        scan.unwrap(columns[name], winding)
        winds |= winding != 0
    return columns, worst, winds


def pose_columns(family: Family, designs: Array, phi: Array, names: Sequence[str]) -> tuple[dict[str, Array], Status]:
    """Compute pose outputs of each design at its own crank angles, (n, m), and their status."""
    return _evaluate(family, designs, Angles.of(phi), names)


def continued(family: Family, name: str, values: Array, middle: Array) -> Array:
    """Add full turns to poses of an output that wraps, so that they are near ``middle``; others stay as they are."""
    if not family.pose_output[name].wraps:
        return values
    return values + TWO_PI * np.rint((middle - values) / TWO_PI)


def unwrapped(row: Indices, values: Array, start: Array) -> tuple[Array, Mask]:
    """Make angles continuous over the turn, from poses (k, m) on pieces of it in rising order.

    Returns
    -------
    values : continuous from the angle ``start`` (k,) of each ``row`` (k,) at crank angle 0 on; as they are where a step
        may go either way
    winds : (k,) whether the row's angle makes full turns
    """
    first, last = np.searchsorted(row, row), np.searchsorted(row, row, side="right") - 1
    step = np.diff(values.ravel(), prepend=values[:1, 0]).reshape(values.shape) / TWO_PI
    step[first, 0] = 0.0
    turns = np.cumsum(np.rint(step)).reshape(values.shape)
    begun = np.rint((start - values[first, 0]) / TWO_PI)[:, None]  # the first pose may lie beyond the cut already
    whole = values - TWO_PI * (turns - turns[first, :1] - begun)
    clear = np.ones(row.size, np.bool_)
    np.logical_and.at(clear, first, (np.abs(step - np.rint(step)) < UNCLEAR).all(axis=1))
    clear = clear[first]
    return np.where(clear[:, None], whole, values), clear & (np.abs(whole[last, -1] - whole[first, 0]) > np.pi)


def _evaluate(family: Family, designs: Array, angles: Angles, names: Sequence[str]) -> tuple[dict[str, Array], Status]:
    columns = family.poses(designs, angles, frozenset(names))
    # Designs and angles are float64 here, so the pose outputs are too.
    return {name: cast(Array, columns[name]) for name in names}, cast(Status, columns["status"])


@of_family
def on_closed_turn(family: Family) -> Family:
    """Map an interval to a closed turn, out and back; a family over any other domain is returned as it is."""
    domain = family.domain
    if not isinstance(domain, Interval):
        return family
    precise = family.precise_poses
    return replace(
        family,
        poses=partial(_poses, family.poses, domain),
        precise_poses=None if precise is None else partial(_poses, precise, domain),
        derivative_of={},  # with respect to x, not to t
    )


def variable(family: Family, designs: Array, turned: Array, err: Array) -> tuple[Array, Array]:
    """Return the domain's variable at angles of the closed turn, (n,), and its error from the angle's error."""
    if not isinstance(family.domain, Interval):
        return turned, err
    low, high = family.domain.ends(designs)
    half = 0.5 * (high - low)
    # Near an end x is stationary in t: the second-order term matters there.
    return _place(low, high, np.cos(turned)), np.abs(half) * (np.abs(np.sin(turned)) * err + 0.5 * err**2)


def _place(low: Array, high: Array, cos: Array) -> Array:
    """Variable at angles of the closed turn, measured from the nearer end: exact there, and never beyond it."""
    half = 0.5 * (high - low)
    place: Array = np.where(cos.real < 0.0, high - half * (1.0 + cos), low + half * (1.0 - cos))
    return place


def _poses(poses: PoseFunction, domain: Interval, designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    low, high = (end[:, None] for end in domain.ends(designs))
    place = _place(low, high, angles.cos)
    still = np.zeros_like(place)
    return poses(designs, Angles(np.ascontiguousarray(place), still, still), wanted)


class Extremum(NamedTuple):
    """Extremum of every design, each (n,): value, crank angle in [0, 2 pi), and their errors."""

    value: Array
    phi: Array
    err: Array
    err_phi: Array

    @classmethod
    def unknown(cls, count: int) -> Extremum:
        """Make a record of nan."""
        return cls(*(np.full(count, np.nan) for _ in range(4)))


# Status of a design by that of a pose; all others are the same.
DESIGN_STATUS = np.arange(256, dtype=np.uint8)
DESIGN_STATUS[st.NOT_ASSEMBLED] = st.NOT_ROTATABLE
DESIGN_STATUS[st.DEAD_POINT] = st.UNDECIDABLE


def worst_of_pieces(row: Indices, each: Status, n: int) -> Status:
    """Worst status of the turn of each of n designs, from poses (k, m) on pieces of the turns of ``row`` (k,)."""
    first = np.searchsorted(row, np.arange(n))
    count = np.bincount(row, minlength=n)
    turn = np.zeros((n, int(count.max(initial=0)), each.shape[1]), np.uint8)
    turn[row, np.arange(row.size) - first[row]] = each
    worst: Status = np.empty(n, np.uint8)
    scan.worst_status(turn.reshape(n, -1), worst)
    return DESIGN_STATUS[worst]


JUMPS = 32  # of a turn; a curve with more is not resolved
STEP = 1.0 / 60.0  # least jump relative to the curve's size; samples resolve smaller ones
SHARPER = 6.0  # least ratio of a jump to the differences beside it


def jumps(values: Array, size: Array, rough: float) -> Mask:
    """Select the curves that jump and are resolved apart from their jumps.

    Friction changes its direction where the follower reverses, the angle of a direction jumps by pi: no number of
    samples resolves such a place.

    Parameters
    ----------
    values : (n, m) equidistant samples of whole turns;  size : (n,) of the curves
    rough : fourth difference relative to the size above which samples do not resolve a curve
    """
    step = np.abs(np.roll(values, -1, axis=1) - values)
    beside = np.maximum.reduce([np.roll(step, k, axis=1) for k in (-2, -1, 1, 2)])
    between = (step > STEP * size[:, None]) & (step > SHARPER * beside)
    near = np.logical_or.reduce([np.roll(between, k, axis=1) for k in (-1, 0, 1, 2)])
    left, right = (np.roll(values, k, axis=1) + np.roll(values, -k, axis=1) for k in (1, 2))
    fourth = np.abs(right - 4.0 * left + 6.0 * values)
    smooth = np.where(near, 0.0, fourth).max(axis=1) <= rough * size
    count = between.sum(axis=1)
    found: Mask = smooth & (count > 0) & (count <= JUMPS)
    return found
