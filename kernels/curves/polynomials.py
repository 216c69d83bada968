"""Real roots of a polynomial between 0 and a positive end, also where they lie many orders of magnitude apart.

Extrema of transfer functions are roots of polynomials of low degree in a variable that vanishes where the mechanism is
nearly singular; the root that matters may then be as small as the square of the remaining distance.  So brackets are
halved in the logarithm, and a root keeps its relative accuracy.
"""

from __future__ import annotations

import math

from kernels.jit import inline
from kernels.types import Array


@inline
def value_and_slope(p: Array, degree: int, x: float) -> tuple[float, float]:
    """Return p[0] + p[1] x + ... and its derivative."""
    value, slope = p[degree], 0.0
    for j in range(degree - 1, -1, -1):
        slope = slope * x + value
        value = value * x + p[j]
    return value, slope


@inline
def middle(low: float, high: float) -> float:
    """Return a point that halves the bracket, in the logarithm where it spans more than a factor of four."""
    if low == 0.0:
        return high * 2.0**-8
    if high > 4.0 * low:
        return math.sqrt(low) * math.sqrt(high)
    return 0.5 * (low + high)


@inline
def bracketed_root(p: Array, degree: int, low: float, high: float, at_low: float) -> float:
    """Find by bracketed Newton steps where p changes its sign between low and high; nan if they do not settle."""
    x, before = middle(low, high), math.inf
    for _ in range(200):
        value, slope = value_and_slope(p, degree, x)
        if value == 0.0:
            return x
        if (value < 0.0) == (at_low < 0.0):
            low = x
        else:
            high = x
        following = x - value / slope
        if not (low < following < high) or abs(value) > 0.5 * before:
            following = middle(low, high)
        if abs(following - x) <= 2.0**-51 * x or not (low < following < high):
            return following
        x, before = following, abs(value)
    return math.nan


@inline
def roots_up_to(end: float, p: Array, degree: int, derivatives: Array, found: Array) -> int:
    """Roots of p in (0, end) in ascending order; the roots of each derivative part those of the one before it.

    Parameters
    ----------
    end : positive
    p : (degree + 1,) coefficients, constant first; leading zeros are no harm
    derivatives : (degree, degree + 1) scratch
    found : (degree,) out

    Returns
    -------
    count
        of the roots in ``found``; a root of even order may be missing, as p does not change its sign there.
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
            at_high, _ = value_and_slope(q, q_degree, high)
            if (at_low < 0.0) != (at_high < 0.0):
                found[kept] = bracketed_root(q, q_degree, low, high, at_low)  # kept <= j: that knot has been read
                kept += 1
            low, at_low = high, at_high
        count = kept
    return count
