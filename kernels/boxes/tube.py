"""Bounds of the angle of a follower that goes from rest to rest with limited acceleration.

Between two rests, a time T and a stroke s apart, no motion with abs(psi'') <= A is above

    high: +A up to t1 = T/4 + s/(A T),  -A up to t2 = t1 + T/2,  +A up to T                                          (1)

for psi - high starts from rest and is concave up to t1 and, seen from the other rest, back to t2: there it is not
positive.  In between it is convex, so it is not positive there either.  Seen from the other end and upside down, (1) is
the least motion.  With A < 4 s/T^2 no motion covers the stroke in time.
"""

from __future__ import annotations

import math

import numpy as np

from kernels.types import Array

POSES = 16  # per stroke
# More than the formulas of this module can lose to rounding, and far too little to weaken a proof.
ROUNDING = 1e-12
THETA, LOW, HIGH, COSINES = range(4)


def least_acceleration(stroke: float, time: float) -> float:
    """Least peak acceleration of a motion from rest to rest over a stroke in the given time, rounded down."""
    return 4.0 * abs(stroke) / time**2 * (1.0 - ROUNDING)


def _high(at: float, stroke: float, time: float, most: float) -> float:
    """Upper bound (1) of the angle at a time."""
    first = 0.25 * time + stroke / (most * time)
    if at < first:
        return 0.5 * most * at * at
    if at < first + 0.5 * time:
        return most * (0.5 * first**2 + first * (at - first) - 0.5 * (at - first) ** 2)
    return stroke + 0.5 * most * (time - at) ** 2


def tube(swing: float, phi0: float, most: float) -> Array:
    """Bound the rocker angle of any motion between the limits with abs(psi'') <= ``most``.

    Parameters
    ----------
    swing : folded minus extended angle, in rad
    phi0 : crank angle from the extended to the folded position
    most : at least :func:`least_acceleration` of both strokes

    Returns
    -------
    One row per pose: crank angle, least and most rocker angle, all counted from the extended position, then the cosine
    and sine of each in plain rounding; POSES rows of the stroke to the folded position, then those of the way back.
    """
    back, size = 2.0 * math.pi - phi0, abs(swing)
    found = []
    for k in range(1, POSES + 1):
        at = phi0 * k / (POSES + 1)
        found.append((at, size - _high(phi0 - at, size, phi0, most), _high(at, size, phi0, most)))
    for k in range(1, POSES + 1):
        at = back * k / (POSES + 1)
        found.append((phi0 + at, size - _high(at, size, back, most), _high(back - at, size, back, most)))
    rows = np.array(found)
    rows[:, LOW] -= ROUNDING
    rows[:, HIGH] += ROUNDING
    if swing < 0.0:
        rows = np.column_stack([rows[:, THETA], -rows[:, HIGH], -rows[:, LOW]])
    return np.column_stack([rows, *(turn(rows[:, k]) for k in (THETA, LOW, HIGH) for turn in (np.cos, np.sin))])
