"""Constants of one design of the cylindrical looper, and all angles of the shaft at which both loops close.

The equation numbers are of docs/cylindrical_looper.md.

Everything is computed in lengths divided by a power of two near the first crank, so no scale of the drawing costs a
bit.  Designs may be complex128 (exact gradients by the complex step); decisions look at the real part.

For a given angle psi of the shaft the second coupler gives its place s in closed form, so the first coupler's closure
is a function H(psi) of one variable, on the whole circle or on the arc where the second coupler reaches.  All its roots
are found by a scan; branches select one of them.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.arithmetic.complex_step import unit_near
from kernels.arithmetic.vectors import Vector
from kernels.curves.arc_roots import scan
from kernels.jit import inline, kernel
from kernels.linkage.driven_ball import Crank, reduce_crank
from kernels.linkage.slider_closure import Reduced as Slider
from kernels.linkage.slider_closure import reduce_scaled
from kernels.types import Numbers


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``: the drive that swings the shaft, and the drive that slides it."""

    swings: Crank
    moves: Slider
    size1: float  # sum of the magnitudes whose rounding errors make up the driving ball's coordinates
    cos_offset: float
    sin_offset: float
    slides: float
    point: Vector
    unit: float
    valid: bool


@inline
def reduce_design(designs: Numbers, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for links of no length and for numbers that are not finite."""
    d = designs[i]
    unit, per = unit_near(d[0])
    swings = reduce_crank(d, per, d[7].real)
    moves = reduce_scaled(d[8] * per, d[9] * per, d[10] * per, d[11] * per, d[12], d[14].real, unit)
    point = (d[16] * per, d[17] * per, d[18] * per)
    slides = d[15].real
    # a slide longer than all links of the slider-crank together is not possible
    size1 = swings.size + slides * (moves.n_size + moves.b.real)
    tip_size = abs(point[0].real) + abs(point[1].real) + abs(point[2].real)
    valid = swings.valid and moves.valid and size1 < 1e140 and abs(d[13].real) < 1e5
    valid = valid and slides * slides == slides and tip_size < 1e140 and unit < math.inf
    return Reduced(swings, moves, size1, np.cos(d[13]), np.sin(d[13]), slides, point, unit, valid)


# Terms of H at one crank angle: both driving balls from the foot of the rocker at s = 0, lengths and directions.
Loops = namedtuple("Loops", "x1 y1 z1 x2 y2 z2 b1 c1 b2 d cos_beta sin_beta branch2 slides")


# H(psi), its derivative, the shaft's place s there, and the square of the second coupler's part along the shaft.
ShaftClosure = namedtuple("ShaftClosure", "value slope s q")


@inline
def place(k: Loops, cos: Any, sin: Any) -> ShaftClosure:
    """Return H and its derivative at one angle of the shaft; (6), (7)."""
    # second ball across the shaft, and from the pin of crank 2
    bx, by = k.d * (cos * k.cos_beta - sin * k.sin_beta), k.d * (sin * k.cos_beta + cos * k.sin_beta)
    px, py = bx - k.x2, by - k.y2
    q = (k.b2 - px) * (k.b2 + px) - py * py
    w = k.branch2 * np.sqrt(q if q.real > 0.0 else 0.0 * q)
    s = k.z2 + w
    height = k.slides * s - k.z1
    square = (k.c1 - k.b1) * (k.c1 + k.b1) + (k.x1 * k.x1 + k.y1 * k.y1) + height * height
    value = 0.5 * square / k.c1 - (k.x1 * cos + k.y1 * sin)
    # ds/dpsi = -(d2 . tau2)/w
    turn = py * bx - px * by
    slope = k.x1 * sin - k.y1 * cos
    if k.slides != 0.0 and w.real != 0.0:
        slope = slope - k.slides * height * turn / (w * k.c1)
    return ShaftClosure(value, slope, s, q)


@inline
def _h(k: Loops, psi: float) -> float:
    return float(place(k, math.cos(psi), math.sin(psi)).value)


CELLS = 48  # H is a trigonometric polynomial of degree 1 and one root of another: these separate its waves


@inline
def _arc(k: Loops) -> tuple[float, float]:
    """Centre and half width of the arc of shaft angles at which the second coupler reaches; half 0 where none."""
    reach, away = 2.0 * k.d * math.hypot(k.x2, k.y2), math.hypot(k.x2, k.y2)
    # q = b2^2 - |ball - pin|^2 lies between (b2 - away - d)(b2 + away + d) and (b2 - |away - d|)(b2 + |away - d|)
    low = (k.b2 - away - abs(k.d)) * (k.b2 + away + abs(k.d))
    high = (k.b2 - abs(away - abs(k.d))) * (k.b2 + abs(away - abs(k.d)))
    if low >= 0.0:
        return 0.0, math.pi
    if high <= 0.0 or reach == 0.0:
        return 0.0, 0.0
    centre = math.atan2(k.y2, k.x2) - math.atan2(k.sin_beta, k.cos_beta) + (0.0 if k.d > 0.0 else math.pi)
    return centre, 2.0 * math.atan2(math.sqrt(high), math.sqrt(-low))


@inline
def shaft_angles(k: Loops, noise: float, at: NDArray[np.float64]) -> tuple[int, float, float]:
    """Write the shaft angles of all solutions into ``at`` (MOST numbers); return their number, least and largest H.

    A place where |H| comes as near to zero as ``noise`` without crossing it counts as a solution.
    """
    centre, half = _arc(k)
    if half == 0.0:
        return 0, math.nan, math.nan
    return scan(_h, CELLS, k, centre, half, noise, 0, at)


@kernel
def chosen(
    k: Loops, branch1: float, mode: int, noise: float, at: NDArray[np.float64]
) -> tuple[int, float, float, float]:
    """Select a solution by branches and mode: status, cosine, sine; -|least H largest H| where there is none."""
    count, least, most = shaft_angles(k, noise, at)
    best, second, found, other = -math.inf, -math.inf, math.nan, math.nan
    for n in range(count):
        slope = branch1 * place(k, math.cos(at[n]), math.sin(at[n])).slope
        if slope > best:
            second, other = best, found
            best, found = slope, at[n]
        elif slope > second:
            second, other = slope, at[n]
    if mode == 2:
        best, found = second, other
    if not best > 0.0:
        return st.NOT_ASSEMBLED, math.nan, math.nan, -abs(least * most)
    return st.OK, math.cos(found), math.sin(found), 0.0
