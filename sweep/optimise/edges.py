"""What a curve holds between the poses of a scan: fast waves, narrow peaks, and the edges at which it bends or jumps.

A family says so by its capabilities (`sweep.families.pace`); most have none of them.
"""

from __future__ import annotations

import numpy as np

from sweep.families.base import Array, Family
from sweep.families.domain import Interval
from sweep.families.pace import Crossing, Singular, Switches, Waves, crossed
from sweep.reductions.cuts import ends
from sweep.reductions.density import FEWEST, denser
from sweep.reductions.sampling import TWO_PI

LOOKS = 512  # poses among which levels that are passed, and followers that reverse, are looked for
BESIDE = 1e-11  # distance from an edge at which its sides are looked at [rad]


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


def edges(family: Family, design: Array) -> Array:
    """Return crank angles just before and just behind every edge, (2, k) [rad]."""
    cut = np.unique(np.mod(ends(family.precise(), design[None, :], 1, LOOKS)[0], TWO_PI))
    return np.stack([cut - BESIDE, cut + BESIDE])


def _bends(family: Family, name: str) -> bool:
    output = family.pose_output[name]
    return output.kinks or output.jumps
