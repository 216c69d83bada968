"""Searches for the zero or the dip of a function of one number, for any function that kernels can call.

``value``, ``value_and_slope`` and ``before`` are helpers that take the place first and then ``data``, which the search
passes on.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from kernels.jit import inline
from kernels.types import EPS

MOST_STEPS = 100  # a bound, so that the loops always end: 53 halve a bracket to the last bit of its size
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
_SECTIONS = 45  # leave 4e-10 of the interval: so near the dip the value changes by less than its rounding


@inline
def bisected(before: Callable[..., bool], low: float, high: float, *data: Any) -> tuple[float, float]:
    """Narrow a bracket to two neighbouring numbers: ``before`` holds at the first, and does not hold at the second."""
    for _ in range(MOST_STEPS):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        if before(middle, *data):
            low = middle
        else:
            high = middle
    return low, high


@inline
def false_position(
    value: Callable[..., float], low: float, high: float, at_low: float, at_high: float, *data: Any
) -> float:
    """Find the zero of a continuous value between places with opposite signs, in any order, on the side of ``high``.

    The zero of the secant replaces the end of its sign.  Where the same end stays twice its value is halved (Illinois),
    so that both ends close in.
    """
    stays = 0
    for _ in range(MOST_STEPS):
        x = low - at_low * ((high - low) / (at_high - at_low))
        # Rounding may throw the secant's zero out of a bracket that has become narrow.
        if not (low < x < high or high < x < low):
            x = 0.5 * (low + high)
        if x in (low, high):
            break
        here = value(x, *data)
        if here == 0.0:
            low = high = x
        elif (here > 0.0) == (at_high > 0.0):
            at_low *= 0.5 if stays < 0 else 1.0
            high, at_high, stays = x, here, -1
        else:
            at_high *= 0.5 if stays > 0 else 1.0
            low, at_low, stays = x, here, 1
        if abs(high - low) <= 2.0 * EPS * max(abs(low), abs(high)):
            break
    return high


@inline
def middle(low: float, high: float) -> float:
    """Middle of a bracket, in the logarithm where its ends have one sign and are more than a factor of four apart."""
    near, far = (low, high) if abs(low) < abs(high) else (high, low)
    if near == 0.0:
        return far * 2.0**-8
    if (near < 0.0) == (far < 0.0) and abs(far) > 4.0 * abs(near):
        return math.copysign(math.sqrt(abs(near)) * math.sqrt(abs(far)), far)
    return 0.5 * (low + high)


@inline
def newton_root(
    value_and_slope: Callable[..., tuple[float, float]],
    low: float,
    high: float,
    at_low: float,
    start: float,
    finest: float,
    *data: Any,
) -> float:
    """Find the zero of a value between places, in any order, where its signs differ; nan without convergence.

    Newton's steps from ``start``; the bracket's middle replaces a step that leaves it or does not halve the value.
    ``at_low`` has the sign of the value at ``low``.  The zero is found to its last bits or, next to a place 0, to
    ``finest``.
    """
    x, before = start, math.inf
    for _ in range(2 * MOST_STEPS):
        value, slope = value_and_slope(x, *data)
        if value == 0.0:
            return x
        if (value < 0.0) == (at_low < 0.0):
            low = x
        else:
            high = x
        following = x - value / slope
        if not (low < following < high or high < following < low) or abs(value) > 0.5 * before:
            following = middle(low, high)
        settled = abs(following - x) <= max(2.0**-51 * abs(x), finest)
        if settled or not (low < following < high or high < following < low):
            return following
        x, before = following, abs(value)
    return math.nan


@inline
def least_value(value: Callable[..., float], low: float, high: float, *data: Any) -> tuple[float, float]:
    """Find the place between two places where a value with one dip is least, and that value, by golden sections."""
    p, q = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_p, at_q = value(p, *data), value(q, *data)
    for _ in range(_SECTIONS):
        if at_p <= at_q:
            high, q, at_q = q, p, at_p
            p = high - _GOLDEN * (high - low)
            at_p = value(p, *data)
        else:
            low, p, at_p = p, q, at_q
            q = low + _GOLDEN * (high - low)
            at_q = value(q, *data)
    return (p, at_p) if at_p <= at_q else (q, at_q)
