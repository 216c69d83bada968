"""Poses over whole turns: the same angles for many designs, in blocks that stay in the cache."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from kernels import scan
from sweep.families.base import Angles, Array, Family
from sweep.families.capabilities import Assembly

Index: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]
Status: TypeAlias = NDArray[np.uint8]

BLOCK = 2**17  # samples handled at once: a few columns of that many stay in the cache
FEW = 4  # columns from which on there are fewer samples at once
TWO_PI = 2.0 * np.pi


@lru_cache(maxsize=32)
def turn(samples: int, shift: float = 0.0) -> Angles:
    """Return the equidistant crank angles of one turn, from 0 or a share of their spacing, shape (1, samples)."""
    # Not locked: kernels would be compiled once more, for arrays that cannot be written.
    phi: Array = (np.arange(samples, dtype=np.float64)[None, :] + shift) * (TWO_PI / samples)
    return Angles.of(phi)


def blocks(rows: Index, samples: int, columns: int = 1) -> Iterator[Index]:
    """Yield pieces of ``rows`` small enough that their samples of so many columns stay in the cache."""
    size = max(1, BLOCK * FEW // (samples * max(columns, FEW)))
    for start in range(0, rows.size, size):
        yield rows[start : start + size]


def discriminants(family: Family) -> tuple[str, ...]:
    """Return pose outputs that tell how near a stage is to a dead point: one per stage of a chain."""
    return tuple(loop.discriminant for loop in family.every(Assembly))


def sample_turn(
    family: Family, designs: Array, samples: int, names: Sequence[str], shift: float = 0.0
) -> tuple[dict[str, Array], Status, Mask]:
    """Return pose outputs over one turn, (n, samples), with angles made continuous.

    The first crank angle is 0, or that share of the spacing by which all are shifted.

    Returns
    -------
    columns : the pose outputs
    worst : (n,) gravest status of the turn
    winds : (n,) whether a wanted follower's angle makes full turns, so that it has no extremum
    """
    columns, status = _evaluate(family, designs, turn(samples, shift), names)
    worst = np.empty(len(designs), np.uint8)
    scan.worst_status(status, worst)
    winds = np.zeros(len(designs), np.bool_)
    for name in (name for name in names if family.pose_output[name].wraps):
        winding = np.empty(len(designs), np.int64)
        scan.unwrap(columns[name], winding)
        winds |= winding != 0
    return columns, worst, winds


def pose_columns(family: Family, designs: Array, phi: Array, names: Sequence[str]) -> tuple[dict[str, Array], Status]:
    """Return pose outputs of each design at its own crank angles, (n, m), and their status."""
    return _evaluate(family, designs, Angles.of(phi), names)


def _evaluate(family: Family, designs: Array, angles: Angles, names: Sequence[str]) -> tuple[dict[str, Array], Status]:
    columns = family.poses(designs, angles, frozenset(names))
    # Designs and angles are float64 here, so the pose outputs are too.
    return {name: cast(Array, columns[name]) for name in names}, cast(Status, columns["status"])
