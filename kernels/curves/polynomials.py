"""Real roots of polynomials on a positive interval, and the least value of a trigonometric polynomial of degree 2.

Roots are found between 0 and a positive end, also where they lie many orders of magnitude apart.

Extrema of transfer functions are roots of polynomials of low degree in a variable that vanishes where the mechanism is
nearly singular; the root that matters may then be as small as the square of the remaining distance.  So brackets are
halved in the logarithm, and a root keeps its relative accuracy.

The minimum of a trigonometric polynomial of degree 2 is exact, with a proof that it is the global one.

``p(t) = c1 cos t + s1 sin t + c2 cos 2t + s2 sin 2t`` (a constant term is left to the caller) is the form of the
discriminants of RSSR, RSSP and the four-bar and of the squared sine of the pressure angle.  Angles are carried as
(cos, sin), so no trigonometric function is called.

Write the polynomial about a stationary point t0 as ``c cos d + s sin d + C cos 2d + S sin 2d``, d = t - t0, s = -2 S:

    p(t) - p(t0) = (1 - cos d) (-c - 2 C - 2 (C cos d + S sin d)),

so t0 is the global minimum if and only if ``-c - 2 C >= 2 hypot(C, S)``, and if it is not, the direction (C, S) of d
leads below p(t0).  A polynomial of degree 2 has at most two minima, so one restart from there finds the global one.
The proof needs t0 itself: at a distance r from it the verdict may be wrong where the two minima differ by less than
about r, so where the criterion is that close both minima are found and their values decide.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kernels.curves.root_search import middle, newton_root
from kernels.jit import inline
from kernels.types import Array


@inline
def value_and_slope(x: float, p: Array, degree: int) -> tuple[float, float]:
    """Return p[0] + p[1] x + ... and its derivative."""
    value, slope = p[degree], 0.0
    for j in range(degree - 1, -1, -1):
        slope = slope * x + value
        value = value * x + p[j]
    return value, slope


@inline
def roots_up_to(end: float, p: Array, degree: int, derivatives: Array, found: Array) -> int:
    """Find the roots of p in (0, end) in ascending order; roots of each derivative separate those of the one before.

    Parameters
    ----------
    end : positive
    p : (degree + 1,) coefficients, constant first; leading zeros are no harm
    derivatives : (degree, degree + 1) scratch
    found : (degree,) out

    Returns
    -------
    count
        number of roots in ``found``; a root of even order may be missing, as p does not change its sign there.
    """
    for j in range(degree + 1):
        derivatives[0, j] = p[j]
    for order in range(1, degree):
        for j in range(degree + 1 - order):
            derivatives[order, j] = (j + 1) * derivatives[order - 1, j + 1]
    count = 0
    for order in range(degree - 1, -1, -1):
        q, q_degree = derivatives[order], degree - order
        low, at_low, kept = 0.0, q[0], 0
        for j in range(count + 1):
            high = found[j] if j < count else end
            at_high, _ = value_and_slope(high, q, q_degree)
            if (at_low < 0.0) != (at_high < 0.0):
                # kept <= j: that knot has been read
                found[kept] = newton_root(value_and_slope, low, high, at_low, middle(low, high), 0.0, q, q_degree)
                kept += 1
            low, at_low = high, at_high
        count = kept
    return count


LAST_STEP = 1e-4  # a cubically converging step below this leaves 1e-11, which float64 does not show in the value
NEARLY = 1e-3  # share of the coefficients: the criterion changes by less over 1e-4, the error of a flat minimum
_R = 0.5**0.5
_C = 0.5 * (2.0 + 2.0**0.5) ** 0.5  # cos(pi/8)
_S = 0.5 * (2.0 - 2.0**0.5) ** 0.5  # sin(pi/8)


class Minimum(NamedTuple):
    """Minimum of a polynomial: cosine and sine of its place, value and second derivative there."""

    cos: float
    sin: float
    value: float
    curvature: float


@inline
def rotate(u: float, v: float, angle: float) -> tuple[float, float]:
    """Turn the unit vector (u, v) by ``angle``, |angle| <= 0.5, without a trigonometric call or a division.

    The error of the angle is 3e-6 angle^9.  The length is restored to 1 up to the square of its error, so that after a
    last turn by less than 0.1 it is 1 to 2^-52.
    """
    q = angle * angle
    c = 1.0 - q * (0.5 - q * (1.0 / 24.0 - q * (1.0 / 720.0 - q * (1.0 / 40320.0))))
    s = angle * (1.0 - q * (1.0 / 6.0 - q * (1.0 / 120.0 - q * (1.0 / 5040.0))))
    x, y = u * c - v * s, u * s + v * c
    scale = 1.5 - 0.5 * (x * x + y * y)
    return x * scale, y * scale


@inline
def _step(c1: float, s1: float, c2: float, s2: float, u: float, v: float) -> float:
    """Return the Halley step to p' = 0, or downhill where the polynomial is not convex."""
    cos2, sin2 = (u - v) * (u + v), 2.0 * u * v
    first, second = s1 * u - c1 * v, s2 * cos2 - c2 * sin2
    d1 = first + 2.0 * second
    d2 = -(c1 * u + s1 * v) - 4.0 * (c2 * cos2 + s2 * sin2)
    d3 = -first - 8.0 * second
    below = 2.0 * d2 * d2 - d1 * d3
    step = -2.0 * d1 * d2 / below
    convex = (d2 > 0.0) & (below > 0.0)
    step = step if convex else math.copysign(0.3, -d1)
    # On top of a maximum, where symmetric polynomials have a sample, either side is downhill.
    step = 0.0 if (d1 == 0.0) & (d2 >= 0.0) else step
    return min(max(step, -0.3), 0.3)


@inline
def _lower(value: float, odd: float, c: float, s: float, best: float, u: float, v: float) -> tuple[float, float, float]:
    # Angles t and t + pi share the even part; the lower of the two has the odd part negative.
    low = value - abs(odd)
    better = low < best
    sign = math.copysign(1.0, -odd)
    return (low if better else best), (sign * c if better else u), (sign * s if better else v)


@inline
def lowest_of_16(c1: float, s1: float, c2: float, s2: float) -> tuple[float, float]:
    """Cosine and sine of the lowest of 16 equally spaced points; without a branch, so that it vectorises."""
    best, u, v = _lower(c2, c1, 1.0, 0.0, math.inf, 1.0, 0.0)
    best, u, v = _lower(-c2, s1, 0.0, 1.0, best, u, v)
    best, u, v = _lower(s2, _R * (c1 + s1), _R, _R, best, u, v)
    best, u, v = _lower(-s2, _R * (s1 - c1), -_R, _R, best, u, v)
    p, m = _R * (c2 + s2), _R * (s2 - c2)
    best, u, v = _lower(p, _C * c1 + _S * s1, _C, _S, best, u, v)
    best, u, v = _lower(m, _S * c1 + _C * s1, _S, _C, best, u, v)
    best, u, v = _lower(-p, _C * s1 - _S * c1, -_S, _C, best, u, v)
    best, u, v = _lower(-m, _S * s1 - _C * c1, -_C, _S, best, u, v)
    return u, v


@inline
def approach(c1: float, s1: float, c2: float, s2: float, u: float, v: float) -> tuple[float, float, float]:
    """Take two cubically converging steps downhill, without a branch; return the place and the length of the last step.

    From the lowest of 16 points the second step is 2e-4 rad long on average, and the error after it 1e-12.
    """
    step = _step(c1, s1, c2, s2, u, v)
    u, v = rotate(u, v, step)
    step = _step(c1, s1, c2, s2, u, v)
    u, v = rotate(u, v, step)
    return u, v, abs(step)


@inline
def shortfall(c1: float, s1: float, c2: float, s2: float, u: float, v: float) -> float:
    """Criterion that is positive if and only if the stationary point (u, v) is not the global minimum."""
    even = c2 * ((u - v) * (u + v)) + s2 * (2.0 * u * v)
    return 2.0 * math.sqrt(c2 * c2 + s2 * s2) + (c1 * u + s1 * v) + 2.0 * even


@inline
def far_minimum(c2: float, s2: float, u: float, v: float) -> tuple[float, float]:
    """Start (cosine and sine) for the other minimum than (u, v), if there are two; c2, s2 not both zero."""
    cos2, sin2 = (u - v) * (u + v), 2.0 * u * v
    even, cross = c2 * cos2 + s2 * sin2, s2 * cos2 - c2 * sin2
    per = 1.0 / math.sqrt(c2 * c2 + s2 * s2)
    return (u * even - v * cross) * per, (v * even + u * cross) * per


@inline
def point(c1: float, s1: float, c2: float, s2: float, u: float, v: float) -> Minimum:
    """Value and second derivative of the polynomial at (u, v)."""
    first, even = c1 * u + s1 * v, c2 * ((u - v) * (u + v)) + s2 * (2.0 * u * v)
    return Minimum(u, v, first + even, -first - 4.0 * even)


@inline
def _descend(c1: float, s1: float, c2: float, s2: float, u: float, v: float) -> tuple[float, float]:
    step, count = 1.0, 0
    while step > LAST_STEP and count < 100:
        u, v, step = approach(c1, s1, c2, s2, u, v)
        count += 1
    return u, v


@inline
def minimum(c1: float, s1: float, c2: float, s2: float) -> Minimum:
    """Global minimum of c1 cos t + s1 sin t + c2 cos 2t + s2 sin 2t.

    Parameters
    ----------
    c1, s1, c2, s2 : Fourier coefficients, any finite numbers whose squares are finite

    Returns
    -------
    Minimum
        with a value right to a few 2^-53 (|c1| + |s1| + |c2| + |s2|); nan coefficients give nan
    """
    u, v = lowest_of_16(c1, s1, c2, s2)
    u, v = _descend(c1, s1, c2, s2, u, v)
    here = point(c1, s1, c2, s2, u, v)
    if shortfall(c1, s1, c2, s2, u, v) > -NEARLY * (abs(c1) + abs(s1) + abs(c2) + abs(s2)):
        u, v = far_minimum(c2, s2, u, v)
        u, v = _descend(c1, s1, c2, s2, u, v)
        there = point(c1, s1, c2, s2, u, v)
        if there.value < here.value:
            return there
    return here
