"""True maximum of one transfer function by marching and bracketing, for the few designs near a change point.

The motion changes fastest near the complex zeros of Delta.  The steps of the march are proportional to the distance
from them, so a design whose discriminant comes within d of zero takes about log(1/d) steps.  A maximum is bracketed
where the next derivative changes sign.  The march is repeated with half the steps until two results agree.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from kernels.arithmetic.intrinsics import largest
from kernels.curves.polynomials import far_minimum, point
from kernels.families.rssr.block import C1, C2, CA, COS, DELTA, K0, K1, K2, S1, S2, SIN, W_SIZE, Y0, E
from kernels.families.rssr.closure import closure_terms, follower, order_pair
from kernels.jit import inline, kernel
from kernels.types import EPS, TWO_PI, Array

_WIDEST = TWO_PI / 24.0
_ATTEMPTS = 8
NONE = (math.nan, math.nan, math.nan, math.nan)  # height, place, and the errors of both, where nothing is found


class Loop(NamedTuple):
    """Numbers of a design's closure, those of :class:`kernels.linkage.crank_closure.Reduced`."""

    e: float
    y0: float
    ca: float
    k0: float
    k1: float
    k2: float
    w_size: float


@inline
def roundings(c: Any, u: Any, v: Any) -> tuple[Any, Any, Any, Any, Any]:
    """Relative error of Delta, errors of the angle and of the terms of psi', then 1/T and absolute error of Delta.

    ``c`` has the numbers of :class:`Loop`.
    """
    x, y, w = closure_terms(c.e, c.y0, c.ca, c.k0, c.k1, c.k2, u, v)
    # Magnitudes of the terms that X and Y are sums of: rounding is proportional to these, not to the sums.
    mx, my = abs(c.e) + 1.0, abs(c.y0) + abs(c.ca)
    tolerance = 4.0 * EPS * (abs(x) * mx + abs(y) * my + abs(w) * c.w_size)
    # The clamp keeps the quotient finite where rounding made a tiny discriminant negative.
    per_t = 1.0 / math.sqrt(largest(x * x + y * y - w * w, 1e-300))
    angle = 4.0 * EPS * (mx + my + c.w_size) * per_t
    terms = (2.0 * EPS * (2.0 + abs(c.k1) + abs(c.k2)) + angle) * per_t
    return tolerance * per_t * per_t, angle, terms, per_t, tolerance


@inline
def rounding(order: int, of: Loop, u: float, v: float, height: float) -> tuple[float, float]:
    """Relative rounding errors of the transfer function of that order where it is ``height``, and of its slope.

    There are three sources of error.  First, the function is proportional to Delta^(1/2 - order), so a relative error
    of Delta becomes one of the function.  Second, the function is a sum of terms of the size 1, k1, k2 over T, and the
    rounding of these terms remains even where their sum is small.  Third, the rocker angle in them has the error of the
    closure X C - Y S + W divided by T.  Where W is a small difference of large terms, its error hardly changes Delta
    but changes the slope of Delta, and with it the slope of the function [1/rad].
    """
    share, _, terms, per_t, _ = roundings(of, u, v)
    mx, my = abs(of.e) + 1.0, abs(of.y0) + abs(of.ca)
    slope = abs(v) * mx + abs(of.ca * u) * my + abs(of.k1 * u + of.k2 * v) * of.w_size
    more = 1.0 + per_t
    terms *= 1.0 if order == 1 else (more if order == 2 else more * more)
    orders = order + 0.5
    return orders * share + 8.0 * EPS + terms / abs(height), 4.0 * EPS * slope * (orders * (per_t * per_t))


@inline
def _gap(phi: float, centre: float) -> float:
    """Distance of two angles around the circle."""
    d = abs(phi - centre) % TWO_PI
    return min(d, TWO_PI - d)


@kernel
def careful_maximum(
    order: int, of: Loop, phi1: float, rho1: float, phi2: float, rho2: float, target: float
) -> tuple[float, float, float, float, bool]:
    """Find the largest |d^order psi / dphi^order|, its crank angle, errors of both, and whether two marches agreed.

    Parameters
    ----------
    order : 1, 2 or 3
    of : the design
    phi1, rho1, phi2, rho2 : crank angle of each minimum of Delta and distance of the complex zero there [rad]
    target : relative error wanted
    """
    before = -1.0
    best, place, error, reach = 0.0, 0.0, 0.0, 0.0
    fineness = 0.5
    for _ in range(_ATTEMPTS):
        best, place, error, reach, missed = 0.0, 0.0, 0.0, 0.0, False
        phi, end = phi1, phi1 + TWO_PI
        y, dy = _evaluate(order, of, phi)
        while phi < end:
            # Distance of the nearer complex zero of Delta; its imaginary part keeps the step from vanishing.
            near = min(math.hypot(rho1, _gap(phi, phi1)), math.hypot(rho2, _gap(phi, phi2)))
            following = phi + min(2.0 * fineness * _WIDEST, fineness * near)
            y2, dy2 = _evaluate(order, of, following)
            if y * dy > 0.0 and y2 * dy2 <= 0.0 and max(abs(y), abs(y2)) > 0.5 * best:
                if y * y2 < 0.0:
                    # The function changed its sign too, so the step was too long to hold one simple maximum.
                    missed = True
                else:
                    peak, where, bound, width = _bracketed(order, of, phi, dy, following, dy2, target)
                    if peak > best:
                        best, place, error, reach = peak, where, bound, width
            phi, y, dy = following, y2, dy2
        relative, _ = rounding(order, of, math.cos(place), math.sin(place), best)
        error += best * relative
        change = abs(best - before)
        if not missed and best > 0.0 and change <= 0.1 * target * best + error:
            return best, place, change + error, reach + 8.0 * EPS + 4.0 * relative, True
        before = best
        fineness *= 0.5
    return best, place, math.inf, math.inf, False


@inline
def careful(at: Array, k: int, order: int, target: float) -> tuple[tuple[float, float, float, float], bool]:
    """Find the maximum by marching: height, place, errors of both (nan if not found), and whether it was found."""
    u, v = at[k + COS], at[k + SIN]
    c1, s1, c2, s2 = at[k + C1], at[k + S1], at[k + C2], at[k + S2] + 1e-300
    here = point(c1, s1, c2, s2, u, v)
    fu, fv = far_minimum(c2, s2, u, v)
    there = point(c1, s1, c2, s2, fu, fv)
    rho1 = math.sqrt(2.0 * at[k + DELTA] / here.curvature) if here.curvature > 0.0 else math.inf
    rise = at[k + DELTA] + max(there.value - here.value, 0.0)
    rho2 = math.sqrt(2.0 * rise / there.curvature) if there.curvature > 0.0 else math.inf
    of = Loop(at[k + E], at[k + Y0], at[k + CA], at[k + K0], at[k + K1], at[k + K2], at[k + W_SIZE])
    best, place, error, reach, agreed = careful_maximum(
        order, of, math.atan2(v, u), rho1, math.atan2(fv, fu), rho2, target
    )
    return ((best, place, error, reach) if agreed else NONE), agreed


@inline
def _evaluate(order: int, of: Loop, phi: float) -> tuple[float, float]:
    p, q, j, k = follower(of.e, of.y0, of.ca, of.k0, of.k1, of.k2, math.cos(phi), math.sin(phi))
    return order_pair(order, p, q, j, k)


@kernel
def _bracketed(
    order: int, of: Loop, lo: float, f_lo: float, hi: float, f_hi: float, target: float
) -> tuple[float, float, float, float]:
    """Refine by Illinois' regula falsi, bisecting every third step; |y|, phi and bounds of their errors."""
    y, mid, bound = 0.0, lo, math.inf
    for step in range(120):
        # One bisection in three: regula falsi alone may creep towards one end of the bracket.
        mid = 0.5 * (lo + hi) if step % 3 == 2 else (lo * f_hi - hi * f_lo) / (f_hi - f_lo)
        if not lo <= mid <= hi:
            mid = 0.5 * (lo + hi)
        y, dy = _evaluate(order, of, mid)
        bound = abs(dy) * (hi - lo)
        if bound <= 0.01 * target * abs(y) or hi - lo <= 4.0 * EPS * abs(mid):
            break
        # Illinois' rule: the value at the end that stays is halved, so that the next point falls beyond the root.
        if (dy > 0.0) == (f_lo > 0.0):
            lo, f_lo, f_hi = mid, dy, 0.5 * f_hi
        else:
            hi, f_hi, f_lo = mid, dy, 0.5 * f_lo
    return abs(y), mid, bound, hi - lo
