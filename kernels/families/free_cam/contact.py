"""Where the thread lies on the bare edge without friction: the shortest of all ways over it.

The thread is shortest where L'(y) = 0 rises.  The search walks along the edge in steps that no zero of L' can be
skipped by, |L'| / max|L''|, so that every minimum is found but for pairs nearer than a share FINEST of the way.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kernels._jit import inline
from kernels.families.free_cam.edge import FINEST, HALVINGS, Cam, along_edge, reach, steepest_slope


class Contact(NamedTuple):
    """Place of the shortest thread along the edge, its length, and the number of minima along the edge."""

    y: float
    length: float
    minima: int


@inline
def shortest(cam: Cam) -> Contact:
    """The global minimum of the length over the edge; minima equally long to rounding: the first along y."""
    end = reach(cam) + 1e-3
    span = 0.25 * end
    best, place, minima = math.inf, math.nan, 0
    at, slope = -end, along_edge(cam, -end)[1].real
    while at < end:
        bound = steepest_slope(cam, at, at + span)
        step = min(span, max(abs(slope) / bound, FINEST * end))
        following = at + step
        new = along_edge(cam, following)[1].real
        if slope < 0.0 <= new:
            y = root_of_slope(cam, at, following)
            length = along_edge(cam, y)[0].real
            minima += 1
            if length < best:
                best, place = length, y
        at, slope = following, new
    return Contact(place, best, minima)


@inline
def root_of_slope(cam: Cam, low: float, high: float) -> float:
    """Where L' rises through zero between low and high: Newton's method kept in the bracket."""
    y = 0.5 * (low + high)
    for _ in range(HALVINGS):
        _, slope, bend = along_edge(cam, y)
        if slope.real < 0.0:
            low = y
        else:
            high = y
        following = y - slope.real / bend.real
        if not (low < following < high):
            following = 0.5 * (low + high)
        if abs(following - y) <= 2.0**-52 * abs(y) or not (low < following < high):
            return following
        y = following
    return y
