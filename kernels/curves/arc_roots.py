"""Roots and dips of a smooth function of an angle, on the whole circle or on an arc.

An arc is traversed as psi = centre - half cos(tau), so that a square root at its ends becomes smooth; ``half`` = pi is
the whole circle, where tau is psi itself.  Roots are bracketed between samples, and where the function dips between
samples of equal sign the dip is searched.  Real numbers only; the caller polishes what is found.

The function is a helper ``value(k, psi)``; ``k`` holds its parameters.  What it is handed to is folded in, as numba
keeps no machine code of a kernel that hands a function on to another one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from kernels.curves.root_search import bisected, least_value
from kernels.jit import inline
from kernels.types import Array

MOST = 8  # roots that are kept; the callers' functions have at most four, and rounding may split a double root


@inline
def angle_at(centre: float, half: float, tau: float) -> float:
    """Angle psi at the place tau of an arc."""
    return tau if half >= math.pi else centre - half * math.cos(tau)


@inline
def way_of(half: float) -> tuple[float, float]:
    """Begin and length of the interval of tau."""
    return (-math.pi, 2.0 * math.pi) if half >= math.pi else (0.0, math.pi)


@inline
def _signed(tau: float, sign: float, value: Callable[..., float], k: Any, centre: float, half: float) -> float:
    return sign * value(k, angle_at(centre, half, tau))


@inline
def _is_positive(tau: float, sign: float, value: Callable[..., float], k: Any, centre: float, half: float) -> bool:
    return _signed(tau, sign, value, k, centre, half) > 0.0


@inline
def _root(
    value: Callable[..., float], k: Any, centre: float, half: float, low: float, high: float, sign: float
) -> float:
    """Find the angle of the root between two places, of which the first has that sign and the second has not."""
    return angle_at(centre, half, bisected(_is_positive, low, high, sign, value, k, centre, half)[0])


@inline
def dip(
    value: Callable[..., float], k: Any, centre: float, half: float, low: float, high: float, sign: float
) -> tuple[float, float]:
    """Find the place tau between two places where sign times the function is least, and that value."""
    return least_value(_signed, low, high, sign, value, k, centre, half)


@inline
def scan(
    value: Callable[..., float], cells: int, k: Any, centre: float, half: float, noise: float, count: int, at: Array
) -> tuple[int, float, float]:
    """Append the roots on an arc to ``at`` (MOST numbers); return their new number, the least and the largest value.

    A place where the function comes as near to zero as ``noise`` without crossing it counts as a root.
    """
    whole = half >= math.pi
    begin, width = way_of(half)
    step = width / cells
    before = value(k, angle_at(centre, half, begin - step)) if whole else math.inf
    here, lowest, highest = value(k, angle_at(centre, half, begin)), math.inf, -math.inf
    for n in range(cells + 1):
        tau, last, after = begin + step * n, n == cells, math.inf
        if whole or not last:
            after = value(k, angle_at(centre, half, tau + step))
        sign = 1.0 if here > 0.0 else -1.0
        lowest, highest = min(lowest, here), max(highest, here)
        if not last and (after > 0.0) != (here > 0.0):
            if count < MOST:
                at[count] = _root(value, k, centre, half, tau, tau + step, sign)
                count += 1
        elif abs(here) <= abs(after) and (before == math.inf or sign * before >= abs(here)) and not (whole and last):
            # the samples on both sides have the same sign and are no nearer to zero, or lie beyond an end
            lo = tau if before == math.inf else tau - step
            hi = tau if after == math.inf else tau + step
            place, least = dip(value, k, centre, half, lo, hi, sign)
            lowest, highest = min(lowest, sign * least), max(highest, sign * least)
            if least <= 0.0 and count + 1 < MOST:
                at[count] = _root(value, k, centre, half, lo, place, sign)
                at[count + 1] = _root(value, k, centre, half, hi, place, sign)
                count += 2
            # a minimum within the noise is a double root, which rounding may have lifted off zero
            elif least <= noise and count < MOST:
                at[count] = angle_at(centre, half, place)
                count += 1
        before, here = here, after
    return count, lowest, highest
