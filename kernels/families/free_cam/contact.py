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
    """Return the global minimum of the length over the edge;
    of minima equally long to rounding it is the first along y.
    """
    # All extrema lie within reach; the margin keeps one that lies on its very end inside the walk.
    end = reach(cam) + 1e-3
    span = 0.25 * end
    best, place, minima = math.inf, math.nan, 0
    at, slope = -end, along_edge(cam, -end)[1].real
    while at < end:
        # L' cannot reach zero before |L'| / max|L''|.  At a root of L' that step is 0: FINEST gets across it.
        bound = steepest_slope(cam, at, at + span)
        step = min(span, max(abs(slope) / bound, FINEST * end))
        following = at + step
        new = along_edge(cam, following)[1].real
        # only rising zeros are minima; the equality on one side alone counts a zero on a step's end once
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
    """Find where L' rises through zero between low and high, by Newton's method kept in the bracket."""
    y = 0.5 * (low + high)
    for _ in range(HALVINGS):
        _, slope, bend = along_edge(cam, y)
        if slope.real < 0.0:
            low = y
        else:
            high = y
        # Newton's step is good only near the root: where it leaves the bracket, its middle is taken.
        following = y - slope.real / bend.real
        if not (low < following < high):
            following = 0.5 * (low + high)
        # A middle that equals an end: the bracket is two neighbouring numbers.
        if abs(following - y) <= 2.0**-52 * abs(y) or not (low < following < high):
            return following
        y = following
    return y
