"""W1, U1: thread over a point that moves in any way: wrap angle, length and the derivatives of the length.

The thread runs from guide N1 over E to guide N2; its length L = |E - N1| + |E - N2| holds for an eyelet on any link.
"""

from __future__ import annotations

import math

from kernels import status as st
from kernels.arithmetic.vectors import Vector, cross, dot, norm, sub
from kernels.jit import inline, kernel
from kernels.linkage.thread_path import bend, length, slope, wrap_angle
from kernels.types import Array, Status


@kernel
def thread_over_point(
    guides: Array,
    position: Array,
    velocity: Array | None,
    acceleration: Array | None,
    status: Status,
    total: Array | None,
    first: Array | None,
    second: Array | None,
    wrap: Array | None,
) -> None:
    """Compute the length of the thread N1, E, N2, its derivatives by the crank angle, and the wrap angle at E.

    Parameters
    ----------
    guides : (n, 6), coordinates of N1 and N2 [length]
    position, velocity, acceleration : (n, m, 3), E and its derivatives; a derivative may be None if not needed
    status : (n, m), in and out; SINGULAR where E is at a guide; what is not OK gives nan
    total, first, second : (n, m) or None; L, dL/dphi, d2L/dphi2 [length]
    wrap : (n, m) or None; angle by which the thread turns at E [rad], 0 to pi

    Notes
    -----
    Measured on the oracle table: errors below 4 * 2^-53 * max(cond, |y|).
    """
    for i in range(position.shape[0]):
        n1, n2 = _point(guides[i, :3]), _point(guides[i, 3:])
        for j in range(position.shape[1]):
            e = _point(position[i, j])
            if status[i, j] == st.OK and not math.isfinite(e[0] + e[1] + e[2] + guides[i].sum()):
                status[i, j] = st.INVALID_INPUT
            d1, d2 = sub(e, n1), sub(e, n2)
            if status[i, j] == st.OK and not (dot(d1, d1) > 0.0 and dot(d2, d2) > 0.0):
                status[i, j] = st.SINGULAR
            good = 1.0 if status[i, j] == st.OK else math.nan
            if total is not None:
                total[i, j] = good * length(e, n1, n2)
            if first is not None and velocity is not None:
                first[i, j] = good * slope(e, n1, n2, _point(velocity[i, j]))
            if second is not None and velocity is not None and acceleration is not None:
                second[i, j] = good * bend(e, n1, n2, _point(velocity[i, j]), _point(acceleration[i, j]))
            if wrap is not None:
                wrap[i, j] = good * wrap_angle(e, n1, n2)


@kernel
def guide_line(guides: Array, position: Array, off: Array, along: Array, half: Array) -> None:
    """Compute (26): distance of E from the line of the guides, place along it from its middle, half its length.

    Parameters
    ----------
    guides : (n, 6), N1 and N2;  position : (n, 3), E;  off, along, half : (n,) out [length], nan if N1 = N2
    """
    for i in range(position.shape[0]):
        n1, n2, e = _point(guides[i, :3]), _point(guides[i, 3:]), _point(position[i])
        way = sub(n2, n1)
        distance = norm(way)
        # E from the middle as the sum of two differences: the middle itself would be rounded.
        d1, d2 = sub(e, n1), sub(e, n2)
        off[i] = norm(cross(d1, way)) / distance
        along[i] = 0.5 * (dot(d1, way) + dot(d2, way)) / distance
        half[i] = 0.5 * distance


@inline
def _point(a: Array) -> Vector:
    return a[0], a[1], a[2]
