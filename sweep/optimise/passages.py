"""Where a curve passes a level: an event as the optimiser follows it, and what could make it jump."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sweep.families.base import Array

NEARING, PASSING = 0, 3  # how a point is held: an extremum that only points to the level; the passage itself


def passages(
    n: int, phi: Array, x: Array, level: float, sense: float
) -> list[tuple[int, float, float, int, float, float]]:
    """List where samples over the turn pass the level in that sense, and where they only come near it.

    Rows are those of :meth:`sweep.optimise.points.Points.of`.  The extrema that point to the level without reaching it
    say how far another passage is.
    """
    if not np.isfinite(x).all():
        return []
    off = sense * (x - level)
    before, after, step = np.roll(off, 1), np.roll(off, -1), 2.0 * math.pi / len(phi)
    found = np.flatnonzero((off < 0.0) & (after >= 0.0))
    near = np.flatnonzero((off < 0.0) & (off > before) & (off >= after))
    passing = [(n, float(phi[j] + step * off[j] / (off[j] - after[j])), sense, PASSING, level, level) for j in found]
    return passing + [(n, float(phi[j]), sense, NEARING, level, float(x[j])) for j in near]


def first_passage(phi: Array, how: NDArray[np.intp], own: Sequence[int]) -> tuple[int | None, list[int]]:
    """Return the point of a curve where it first passes its level in [0, 2 pi),
    and those before it that only near the level.

    Parameters
    ----------
    phi, how : (K,) angles of the points, and how each is held
    own : numbers of the curve's points

    Notes
    -----
    Where one of the latter reaches the level, an earlier passage arises and the event jumps to it.  No slope says so:
    the search has to keep these points on their side.
    """
    order = sorted(own, key=lambda k: math.remainder(phi[k] - math.pi, math.tau))
    before = list(itertools.takewhile(lambda k: how[k] != PASSING, order))
    first = order[len(before)] if len(before) < len(order) else None
    return first, before
