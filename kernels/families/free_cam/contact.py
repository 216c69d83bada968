"""The thread over the edge x = a y^2 of the cam: its length over one point of the edge, and its shortest path.

The thread is shortest where L'(y) = 0 rises.  The search walks along the edge in steps that no zero of L' can be
skipped by, |L'| / max|L''|, so that every minimum is found but for pairs nearer than a share FINEST of the way.

Without friction the thread at given cam angles has this length: its derivatives, contact and wrap follow from it.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import divisor, unit_near
from kernels.curves.root_search import newton_root
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write
from kernels.linkage.thread_path import wrap_angle
from kernels.types import Array, Status

# Two extrema nearer to each other than this share of the way searched may be missed: the dip between them is no deeper
# than its third power.
FINEST = 2.0**-16


# Edge and guides in the axes of the cam, lengths in units of ``unit``.
Cam = namedtuple("Cam", "a x1 y1 z1 x2 y2 z2 unit code")


class Line(NamedTuple):
    """Point where the straight line between the guides passes the plane of the cam, and the line's length."""

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
    unit, per_unit = unit_near(size if valid else 1.0)
    x1, y1, x2, y2 = designs[i, 1], designs[i, 2], designs[i, 4], designs[i, 5]
    return Cam(
        a * unit,
        (x1 * u + y1 * v) * per_unit, (y1 * u - x1 * v) * per_unit, designs[i, 3] * per_unit,
        (x2 * u + y2 * v) * per_unit, (y2 * u - x2 * v) * per_unit, designs[i, 6] * per_unit,
        unit, st.OK if valid else st.INVALID_INPUT,
    )  # fmt: skip


@inline
def straight(cam: Cam) -> Line:
    """Straight line between the guides and its point in the plane of the cam."""
    share = cam.z1 / divisor(cam.z1 - cam.z2)
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
    turning, by = (z * z * (1.0 + tx * tx) + across * across) / divisor(square), divisor(distance)
    return distance, (dx * tx + dy) / by, (turning + 2.0 * a * dx) / by


@inline
def along_edge(cam: Cam, at: float) -> tuple[float, float, float]:
    """Length of the thread over the point ``at`` and its first two derivatives along y; (19), (20)."""
    first = part(cam.a, cam.x1, cam.y1, cam.z1, at)
    second = part(cam.a, cam.x2, cam.y2, cam.z2, at)
    return first[0] + second[0], first[1] + second[1], first[2] + second[2]


@inline
def reach(cam: Cam) -> float:
    """Bound of |y| beyond which the thread only grows longer; no extremum lies outside."""
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
    return float((tangent + 2.0 * a * off1) / first + (tangent + 2.0 * a * off2) / second)


# Place of the shortest thread along the edge, its length, and the number of minima along the edge.
Contact = namedtuple("Contact", "y length minima")


@inline
def _slope(at: float, cam: Cam) -> tuple[float, float]:
    """Real parts of the slope of the length along the edge and of its derivative."""
    _, slope, bend = along_edge(cam, at)
    return slope.real, bend.real


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
            y = newton_root(_slope, at, following, -1.0, 0.5 * (at + following), 2.0**-60 * step, cam)
            length = along_edge(cam, y)[0].real
            minima += 1
            if length < best:
                best, place = length, y
        at, slope = following, new
    return Contact(place, best, minima)


@inline
def by_angle(a: float, x: float, y: float, z: float, at: float) -> tuple[float, float, float]:
    """First and second derivative by phi of the distance of a guide at a fixed y, and the mixed derivative; (21)."""
    cx, cy, tx = a * at * at, at, 2.0 * a * at
    dx, dy = cx - x, cy - y
    distance = divisor(np.sqrt(dx * dx + dy * dy + z * z))
    # In the axes of the cam the guide turns backwards: x' = y, y' = -x.
    first = (dy * x - dx * y) / distance
    along = (dx * tx + dy) / distance
    second = (cx * x + cy * y) / distance - first * first / distance
    mixed = (x - tx * y) / distance - along * first / distance
    return first, second, mixed


@inline
def over_edge(cam: Cam, at: float) -> tuple[float, float]:
    """First and second derivative by phi of the shortest length; (22), (23)."""
    one = by_angle(cam.a, cam.x1, cam.y1, cam.z1, at)
    two = by_angle(cam.a, cam.x2, cam.y2, cam.z2, at)
    mixed = one[2] + two[2]
    # The contact moves along the edge so that dL/dy stays 0, which adds nothing to the first derivative.
    return one[0] + two[0], one[1] + two[1] - mixed * mixed / divisor(along_edge(cam, at)[2])


# Pose outputs, each (n, m), or None, which is not computed.
Outputs = namedtuple("Outputs", "P dP d2P L wrap y_contact X Y contact minima")


@kernel
def poses(designs: Array, cos_phi: Array, sin_phi: Array, status: Status, out: Outputs) -> None:
    """Shortest thread over the edge of the cam, its derivatives, place and wrap; (18) to (23) of docs/takeup.md.

    Parameters
    ----------
    designs : (n, 8) columns as `PARAMETERS` of sweep/families/free_cam.py; complex128 for gradients by the complex step
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK or INVALID_INPUT (also where both guides are on one side of the cam)
    P, dP, d2P, L : (n, m) out or None; L - P_h, its derivatives with respect to phi, thread length [length]
    wrap : (n, m) out or None; angle by which the thread turns at the edge [rad], 0 without contact
    y_contact, X, Y : (n, m) out or None; where the thread passes the plane of the cam: along the edge's axis y, and in
        fixed axes [length]
    contact : (n, m) out or None; 1 where the thread lies on the edge, 0 where it runs straight beside the cam
    minima : (n, m) out or None; number of minima of the length along the edge: with several the thread may also lie
        where it is not shortest of all

    Notes
    -----
    Measured on the oracle table: errors below 16 * 2^-53 * max(cond, |y|).
    """
    for i in range(designs.shape[0]):
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            cam = turned_cam(designs, i, u, v)
            status[i, j] = cam.code
            good = 1.0 if cam.code == st.OK else math.nan
            line = straight(cam)
            touching = line.inside and cam.code == st.OK
            at, count = line.y, 0
            # the search along the edge is costly: without contact it is made only if the number of minima is wanted
            if cam.code == st.OK and (touching or out.minima is not None):
                found = shortest(cam)
                count = found.minima
                if touching:
                    # the search decides on real parts; the zero gives the place the type of the design
                    at = follow_minimum(cam, found.y) + 0.0 * line.y
            x = cam.a * at * at if touching else line.x
            if out.L is not None or out.P is not None:
                length = along_edge(cam, at)[0] if touching else line.length
                write(out.L, i, j, good * length * cam.unit)
                write(out.P, i, j, good * (length - designs[i, 7] / cam.unit) * cam.unit)
            if out.dP is not None or out.d2P is not None:
                first, second = over_edge(cam, at)
                write(out.dP, i, j, good * (first if touching else 0.0 * first) * cam.unit)
                write(out.d2P, i, j, good * (second if touching else 0.0 * first) * cam.unit)
            if out.wrap is not None:
                zero = 0.0 * at
                turn = wrap_angle((x, at, zero), (cam.x1, cam.y1, cam.z1), (cam.x2, cam.y2, cam.z2))
                write(out.wrap, i, j, good * (turn if touching else zero))
            write(out.y_contact, i, j, good * at * cam.unit)
            write(out.X, i, j, good * (x * u - at * v) * cam.unit)
            write(out.Y, i, j, good * (x * v + at * u) * cam.unit)
            write(out.contact, i, j, good * (1.0 if touching else 0.0))
            write(out.minima, i, j, good * count)


@inline
def follow_minimum(cam: Cam, y: float) -> float:
    """Minimum as a function of complex designs: one step of Newton's method for the imaginary parts alone."""
    # The real part of the slope is the search's remaining error, which is below rounding: it is left out.
    _, slope, bend = along_edge(cam, y)
    return y + (slope.real - slope) / divisor(bend)  # type: ignore[no-any-return]
