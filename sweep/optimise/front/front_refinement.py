"""Where a front is least known: between which two of its bounds it may still bend most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sweep.families.base import Array

NARROWEST = 1.0 / 256.0  # of the whole range of bounds: what is narrower is a jump, which no point fills
LEAST = 1e-4  # of the square around the front: triangles that are smaller are no gap
SHOWN = 0.02  # a gap is said where it is larger


@dataclass(frozen=True)
class Gap:
    """Two neighbouring points of a front: the number of the looser one, and how large the gap is.

    Within bounds that tighten the objective only grows, so between two points the front lies in the rectangle they
    span, and a convex one in its lower triangle.  ``area`` is that of the triangle, with both axes scaled to 1.
    ``middle`` halves it.
    """

    number: int
    area: float
    middle: float


def gaps(bounds: Array, reached: Array, values: Array) -> list[Gap]:
    """Return the gaps of a front, the largest first, of equal ones the looser first;
    only those that a point could fill.

    Between the bound of a point and what it reaches the front is flat, so a gap goes from what the looser point reaches
    to the bound of the tighter one.

    Parameters
    ----------
    bounds : on the second output, the loosest first
    reached : what the points reach of the second output; their bounds where nothing was found
    values : the objective to be small, nan where no design keeps the bound: the front ends before it, at any height
    """
    known = np.isfinite(values)
    if bounds.size < 2 or not known.any():
        return []
    sense = np.sign(bounds[-1] - bounds[0])
    wide = float(sense * (bounds[-1] - reached[0]))
    high = float(np.ptp(values[known]))
    found = []
    for k in range(bounds.size - 1):
        step = float(sense * (bounds[k + 1] - reached[k])) / wide if wide > 0.0 else 0.0
        rise = 0.0
        if known[k] and known[k + 1]:
            rise = abs(values[k + 1] - values[k]) / high if high > 0.0 else 0.0
        elif known[k] or known[k + 1]:
            rise = 1.0
        if step >= NARROWEST and 0.5 * step * rise >= LEAST:
            found.append(Gap(k, 0.5 * step * rise, 0.5 * float(reached[k] + bounds[k + 1])))
    return sorted(found, key=lambda gap: (-gap.area, gap.number))
