"""The thread over the edge x = a y^2 of the cam: its length over one point, the shortest of all ways.

The thread is shortest where L'(y) = 0 rises.  The search walks along the edge in steps that no zero of L' can be
skipped by, |L'| / max|L''|, so that every minimum is found but for pairs nearer than a share FINEST of the way.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.jit import inline
from kernels.types import Array

# Two extrema nearer to each other than this share of the way searched may be missed: the dip between them is no deeper
# than its third power.
FINEST = 2.0**-16
HALVINGS = 60


class Cam(NamedTuple):
    """Edge and guides in the axes of the cam, lengths in units of ``unit``."""

    a: float
    x1: float
    y1: float
    z1: float
    x2: float
    y2: float
    z2: float
    unit: float
    code: int


class Line(NamedTuple):
    """Where the straight line between the guides passes the plane of the cam."""

    x: float
    y: float
    length: float
    inside: bool  # whether it passes through the material, so that the edge pushes the thread away


@inline
def turned_cam(designs: Array, i: int, u: float, v: float) -> Cam:
    """Turn design i, (n, 8) with columns a, X1, Y1, Z1, X2, Y2, Z2, P_h, to u = cos(phi), v = sin(phi)."""
    size = 0.0
    for k in range(1, 8):
        size += abs(designs[i, k].real)
    a = designs[i, 0]
    bent = a.real * size
    valid = 1e-140 < size < 1e140 and a.real >= 0.0 and bent < 1e6 and math.isfinite(u.real + v.real)
    # On one side of the plane, or in it, the thread need not pass the edge at all.
    valid = valid and designs[i, 3].real * designs[i, 6].real < 0.0
    _, exponent = math.frexp(size if valid else 1.0)
    unit, per_unit = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
    x1, y1, x2, y2 = designs[i, 1], designs[i, 2], designs[i, 4], designs[i, 5]
    return Cam(
        a * unit,
        (x1 * u + y1 * v) * per_unit, (y1 * u - x1 * v) * per_unit, designs[i, 3] * per_unit,
        (x2 * u + y2 * v) * per_unit, (y2 * u - x2 * v) * per_unit, designs[i, 6] * per_unit,
        unit, st.OK if valid else st.INVALID_INPUT,
    )  # fmt: skip


@inline
def straight(cam: Cam) -> Line:
    """Line between the guides at the plane of the cam."""
    share = cam.z1 / (cam.z1 - cam.z2)
    x, y = cam.x1 + share * (cam.x2 - cam.x1), cam.y1 + share * (cam.y2 - cam.y1)
    dx, dy, dz = cam.x2 - cam.x1, cam.y2 - cam.y1, cam.z2 - cam.z1
    return Line(x, y, np.sqrt(dx * dx + dy * dy + dz * dz), (x - cam.a * y * y).real > 0.0)


@inline
def part(a: float, x: float, y: float, z: float, at: float) -> tuple[float, float, float]:
    """Distance of the edge's point ``at`` from a guide and its first two derivatives along y; (19), (20)."""
    dx, dy, tx = a * at * at - x, at - y, 2.0 * a * at
    square = dx * dx + dy * dy + z * z
    distance = np.sqrt(square)
    across = tx * dy - dx
    turning = (z * z * (1.0 + tx * tx) + across * across) / square
    return distance, (dx * tx + dy) / distance, (turning + 2.0 * a * dx) / distance


@inline
def along_edge(cam: Cam, at: float) -> tuple[float, float, float]:
    """Length of the thread over the point ``at`` and its first two derivatives along y; (19), (20)."""
    first = part(cam.a, cam.x1, cam.y1, cam.z1, at)
    second = part(cam.a, cam.x2, cam.y2, cam.z2, at)
    return first[0] + second[0], first[1] + second[1], first[2] + second[2]


@inline
def reach(cam: Cam) -> float:
    """Return a |y| beyond which the thread only grows longer; no extremum lies outside."""
    return max(_reach(cam.a.real, cam.x1.real, cam.y1.real), _reach(cam.a.real, cam.x2.real, cam.y2.real))


@inline
def _reach(a: float, x: float, y: float) -> float:
    # The slope is that of y (2 a^2 y^2 + 1 - 2 a x) - y_i for a guide at (x, y_i).
    return 2.0 * abs(y) if a * x <= 0.25 else math.sqrt(x / a) + abs(y)


@inline
def _nearest(low: float, high: float, centre: float) -> float:
    """Least distance of an interval from a point."""
    return max(max(low - centre, centre - high), 0.0)


@inline
def least_distances(cam: Cam, low: float, high: float) -> tuple[float, float]:
    """Lower bounds of the distances of the guides from the edge between two of its points."""
    a, far, near = cam.a.real, max(low * low, high * high), _nearest(low, high, 0.0)
    bottom, top = a * near * near, a * far
    dx, dy = _nearest(bottom, top, cam.x1.real), _nearest(low, high, cam.y1.real)
    first = math.sqrt(dx * dx + dy * dy + cam.z1.real * cam.z1.real)
    dx, dy = _nearest(bottom, top, cam.x2.real), _nearest(low, high, cam.y2.real)
    return first, math.sqrt(dx * dx + dy * dy + cam.z2.real * cam.z2.real)


@inline
def steepest_slope(cam: Cam, low: float, high: float) -> float:
    """Bound |L''| between two points of the edge, from |turning| <= |tangent|^2 and the largest offsets."""
    a, far = cam.a.real, max(low * low, high * high)
    tangent = 1.0 + 4.0 * a * a * far
    first, second = least_distances(cam, low, high)
    off1 = max(abs(cam.x1.real), abs(a * far - cam.x1.real))
    off2 = max(abs(cam.x2.real), abs(a * far - cam.x2.real))
    return (tangent + 2.0 * a * off1) / first + (tangent + 2.0 * a * off2) / second


class Contact(NamedTuple):
    """Place of the shortest thread along the edge, its length, and the number of minima along the edge."""

    y: float
    length: float
    minima: int


@inline
def shortest(cam: Cam) -> Contact:
    """Global minimum of the length over the edge; of minima equally long to rounding it is the first along y."""
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
