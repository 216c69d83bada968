"""One design of the cylindrical looper brought to its constants, and all angles of the shaft at which both loops close.

The equation numbers are of docs/cylindrical_looper.md.

Everything is computed in lengths divided by a power of two near the first crank, so no scale of the drawing costs a
bit.  Designs may be complex128 (exact gradients by the complex step); decisions look at the real part.

For a given angle psi of the shaft the second coupler gives its place s in closed form, so the first coupler's closure
is a function H(psi) of one variable, on the whole circle or on the arc where the second coupler reaches.  All its roots
are found by a scan; branches name the one that is meant.  Equation numbers are of docs/cylindrical_looper.md.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.arithmetic.vectors import Vector
from kernels.jit import inline, kernel
from kernels.linkage.driven_ball import Crank, reduce_crank
from kernels.linkage.slider_closure import Reduced as Slider
from kernels.linkage.slider_closure import reduce_scaled
from kernels.types import Numbers


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``: of the drive that swings the shaft, and of the one that slides it."""

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
    """Constants of one design; ``valid`` is false for links of no length and for what is not finite."""
    d = designs[i]
    _, exponent = math.frexp(d[0].real)
    unit, per = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
    swings = reduce_crank(d, per)
    moves = reduce_scaled(d[8] * per, d[9] * per, d[10] * per, d[11] * per, d[12], d[14].real, unit)
    point = (d[16] * per, d[17] * per, d[18] * per)
    slides = d[15].real
    # a slide longer than all links of the slider-crank together is not possible
    size1 = swings.size + slides * (moves.n_size + moves.b.real)
    tip_size = abs(point[0].real) + abs(point[1].real) + abs(point[2].real)
    valid = swings.valid and moves.valid and size1 < 1e140 and abs(d[13].real) < 1e5
    valid = valid and slides * slides == slides and tip_size < 1e140 and unit < math.inf
    return Reduced(swings, moves, size1, np.cos(d[13]), np.sin(d[13]), slides, point, unit, valid)


SAMPLES = 48  # cells of the scan: H is a trigonometric polynomial of degree 1 and one root of another
MOST = 8  # roots that are kept; there are at most four, and rounding at a double root may show it as a few
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


class Loops(NamedTuple):
    """Both driving balls from the foot of the rocker at s = 0, real numbers: what H is made of at one crank angle."""

    x1: Any
    y1: Any
    z1: Any
    x2: Any
    y2: Any
    z2: Any
    b1: Any
    c1: Any
    b2: Any
    d: Any
    cos_beta: Any
    sin_beta: Any
    branch2: float
    slides: float


class ShaftClosure(NamedTuple):
    """H(psi), its derivative, the shaft's place s there, and what is left of the second coupler's square."""

    value: Any
    slope: Any
    s: Any
    q: Any


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
def _at(k: Loops, centre: float, half: float, tau: float) -> tuple[float, float]:
    """Angle of the shaft for the scan's parameter, and H there; on an arc the root of its ends becomes smooth."""
    psi = tau if half >= math.pi else centre - half * math.cos(tau)
    return psi, place(k, math.cos(psi), math.sin(psi)).value


@kernel
def _bracketed(k: Loops, centre: float, half: float, lo: float, hi: float, f_lo: float) -> float:
    """Shaft angle of the root between two places of opposite sign: bisection, which no shape misleads."""
    # 30 halvings of a cell leave 1e-10 rad, of which the caller's Newton steps leave rounding
    for _ in range(30):
        mid = 0.5 * (lo + hi)
        _, f = _at(k, centre, half, mid)
        if (f > 0.0) == (f_lo > 0.0):
            lo = mid
        else:
            hi = mid
    psi, _ = _at(k, centre, half, 0.5 * (lo + hi))
    return psi


@kernel
def _dip(k: Loops, centre: float, half: float, lo: float, hi: float, sign: float) -> tuple[float, float]:
    """Place and value of the least of sign * H between two places, by the golden section."""
    p, q = hi - _GOLDEN * (hi - lo), lo + _GOLDEN * (hi - lo)
    _, f_p = _at(k, centre, half, p)
    _, f_q = _at(k, centre, half, q)
    # 0.618^45 = 4e-10 of the cells: nearer to the least the value no longer changes by a rounding
    for _ in range(45):
        if sign * f_p <= sign * f_q:
            hi, q, f_q = q, p, f_p
            p = hi - _GOLDEN * (hi - lo)
            _, f_p = _at(k, centre, half, p)
        else:
            lo, p, f_p = p, q, f_q
            q = lo + _GOLDEN * (hi - lo)
            _, f_q = _at(k, centre, half, q)
    return (p, sign * f_p) if sign * f_p <= sign * f_q else (q, sign * f_q)


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


@kernel
def shaft_angles(k: Loops, noise: float, at: NDArray[np.float64]) -> tuple[int, float, float]:
    """Write the shaft angles of all solutions into ``at`` (MOST numbers).

    Returns their number, the least and the largest H met.

    A place where |H| comes as near to zero as ``noise`` without crossing it counts as one.
    """
    centre, half = _arc(k)
    if half == 0.0:
        return 0, math.nan, math.nan
    whole = half >= math.pi
    begin, width = (-math.pi, 2.0 * math.pi) if whole else (0.0, math.pi)
    step = width / SAMPLES
    count, before, least, most = 0, math.inf, math.inf, -math.inf
    if whole:
        _, before = _at(k, centre, half, begin - step)
    _, here = _at(k, centre, half, begin)
    for n in range(SAMPLES + 1):
        tau, last, after = begin + step * n, n == SAMPLES, math.inf
        if whole or not last:
            _, after = _at(k, centre, half, tau + step)
        sign = 1.0 if here > 0.0 else -1.0
        least, most = min(least, here), max(most, here)
        if not last and (after > 0.0) != (here > 0.0):
            if count < MOST:
                at[count] = _bracketed(k, centre, half, tau, tau + step, here)
                count += 1
        elif abs(here) <= abs(after) and (before == math.inf or sign * before >= abs(here)) and not (whole and last):
            # the samples on both sides have the same sign and are no nearer to zero; beyond an end counts as far
            lo = tau if before == math.inf else tau - step
            hi = tau if after == math.inf else tau + step
            place, dip = _dip(k, centre, half, lo, hi, sign)
            least, most = min(least, sign * dip), max(most, sign * dip)
            if dip <= 0.0 and count + 1 < MOST:
                at[count] = _bracketed(k, centre, half, lo, place, sign)
                at[count + 1] = _bracketed(k, centre, half, place, hi, -sign)
                count += 2
            # zero within the noise of H is a double root, which rounding may have lifted off
            elif dip <= noise and count < MOST:
                at[count], _ = _at(k, centre, half, place)
                count += 1
        before, here = here, after
    return count, least, most


@kernel
def chosen(
    k: Loops, branch1: float, mode: int, noise: float, at: NDArray[np.float64]
) -> tuple[int, float, float, float]:
    """Status, cosine and sine of the solution that branches and mode name; -|least H largest H| where there is none."""
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
