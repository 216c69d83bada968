"""Searches for the place where a function of one number changes its sign, for any function that kernels can call.

``value`` and ``before`` are helpers that take the place first and then ``data``, which the search passes on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kernels.jit import inline
from kernels.types import EPS

MOST_STEPS = 100  # a bound, so that the loops always end: 53 halve a bracket to the last bit of its size


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
