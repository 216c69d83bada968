"""Thread over the bare edge without friction at given cam angles: length, its derivatives, contact and wrap."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.families.free_cam.contact import Cam, along_edge, shortest, straight, turned_cam
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write
from kernels.linkage.thread_path import wrap_angle
from kernels.types import Array, Status


@inline
def by_angle(a: float, x: float, y: float, z: float, at: float) -> tuple[float, float, float]:
    """Distance of a guide: first and second derivative by phi at a fixed y, and the mixed one; (21)."""
    cx, cy, tx = a * at * at, at, 2.0 * a * at
    dx, dy = cx - x, cy - y
    distance = np.sqrt(dx * dx + dy * dy + z * z)
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
    return one[0] + two[0], one[1] + two[1] - mixed * mixed / along_edge(cam, at)[2]


class Outputs(NamedTuple):
    """Pose outputs, each (n, m), or None: what is None is not computed."""

    P: Array | None
    dP: Array | None
    d2P: Array | None
    L: Array | None
    wrap: Array | None
    y_contact: Array | None
    X: Array | None
    Y: Array | None
    contact: Array | None
    minima: Array | None


@kernel
def poses(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    status: Status,
    out: Outputs,
) -> None:
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
            # the search along the edge is the dear part: not without contact, unless its count is wanted
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
    return y + (slope.real - slope) / bend
