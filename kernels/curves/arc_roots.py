"""Roots and dips of a smooth function of an angle, on the whole circle or on an arc.

An arc is traversed as psi = centre - half cos(tau), so that a square root at its ends becomes smooth; ``half`` = pi is
the whole circle, where tau is psi itself.  Roots are bracketed between samples, and where the function dips between
samples of equal sign the dip is searched.  Real numbers only; the caller polishes what is found.
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Callable
from typing import Any

from kernels.jit import generated_part, inline
from kernels.types import Array

MOST = 8  # roots that are kept; the callers' functions have at most four, and rounding may split a double root
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)

# ``scan(k, centre, half, noise, count, at)`` appends the roots on an arc to ``at`` (MOST numbers) and returns their new
# number and the least and the largest value met; a place where the function comes as near to zero as ``noise`` without
# crossing it counts as a root.  ``dip(k, centre, half, lo, hi, sign)`` returns the tau between two places where sign
# times the function is least, and that value.
ArcSearch = namedtuple("ArcSearch", "scan dip")


@inline
def angle_at(centre: float, half: float, tau: float) -> float:
    """Angle psi at the place tau of an arc."""
    return tau if half >= math.pi else centre - half * math.cos(tau)


@inline
def way_of(half: float) -> tuple[float, float]:
    """Begin and length of the interval of tau."""
    return (-math.pi, 2.0 * math.pi) if half >= math.pi else (0.0, math.pi)


def _bracketing(name: str, value: Callable[[Any, float], float], halvings: int) -> Callable[..., Any]:
    def bracketed(k: Any, centre: float, half: float, lo: float, hi: float, f_lo: float) -> float:
        """Find the angle of the root between two places of opposite sign by bisection, which is safe for any shape."""
        for _ in range(halvings):
            mid = 0.5 * (lo + hi)
            if (value(k, angle_at(centre, half, mid)) > 0.0) == (f_lo > 0.0):
                lo = mid
            else:
                hi = mid
        return angle_at(centre, half, 0.5 * (lo + hi))

    return generated_part(f"bracketed_{name}", bracketed)


def _dipping(name: str, value: Callable[[Any, float], float]) -> Callable[..., Any]:
    def dip(k: Any, centre: float, half: float, lo: float, hi: float, sign: float) -> tuple[float, float]:
        """Find the place between two places where sign times the value is least, and that value, by golden section."""
        p, q = hi - _GOLDEN * (hi - lo), lo + _GOLDEN * (hi - lo)
        f_p = sign * value(k, angle_at(centre, half, p))
        f_q = sign * value(k, angle_at(centre, half, q))
        # 0.618^45 = 4e-10 of the cells: within that of the minimum the value changes by less than its rounding
        for _ in range(45):
            if f_p <= f_q:
                hi, q, f_q = q, p, f_p
                p = hi - _GOLDEN * (hi - lo)
                f_p = sign * value(k, angle_at(centre, half, p))
            else:
                lo, p, f_p = p, q, f_q
                q = lo + _GOLDEN * (hi - lo)
                f_q = sign * value(k, angle_at(centre, half, q))
        return (p, f_p) if f_p <= f_q else (q, f_q)

    return generated_part(f"dip_{name}", dip)


def arc_search(name: str, value: Callable[[Any, float], float], samples: int, halvings: int) -> ArcSearch:
    """Make the functions that find the roots of ``value(k, psi)`` on arcs.

    Parameters
    ----------
    name : under which the machine code is kept
    value : an inline helper; ``k`` holds its parameters
    samples : cells per arc
    halvings : number of bisections of a cell that has a root
    """
    bracketed, dip = _bracketing(name, value, halvings), _dipping(name, value)

    def scan(k: Any, centre: float, half: float, noise: float, count: int, at: Array) -> tuple[int, float, float]:
        """Append the roots on an arc to ``at``, as :data:`ArcSearch` explains."""
        whole = half >= math.pi
        begin, width = way_of(half)
        step = width / samples
        before = value(k, angle_at(centre, half, begin - step)) if whole else math.inf
        here, lowest, highest = value(k, angle_at(centre, half, begin)), math.inf, -math.inf
        for n in range(samples + 1):
            tau, last, after = begin + step * n, n == samples, math.inf
            if whole or not last:
                after = value(k, angle_at(centre, half, tau + step))
            sign = 1.0 if here > 0.0 else -1.0
            lowest, highest = min(lowest, here), max(highest, here)
            if not last and (after > 0.0) != (here > 0.0):
                if count < MOST:
                    at[count] = bracketed(k, centre, half, tau, tau + step, here)
                    count += 1
            elif (
                abs(here) <= abs(after) and (before == math.inf or sign * before >= abs(here)) and not (whole and last)
            ):
                # the samples on both sides have the same sign and are no nearer to zero, or lie beyond an end
                lo = tau if before == math.inf else tau - step
                hi = tau if after == math.inf else tau + step
                place, least = dip(k, centre, half, lo, hi, sign)
                lowest, highest = min(lowest, sign * least), max(highest, sign * least)
                if least <= 0.0 and count + 1 < MOST:
                    at[count] = bracketed(k, centre, half, lo, place, sign)
                    at[count + 1] = bracketed(k, centre, half, place, hi, -sign)
                    count += 2
                # a minimum within the noise is a double root, which rounding may have lifted off zero
                elif least <= noise and count < MOST:
                    at[count] = angle_at(centre, half, place)
                    count += 1
            before, here = here, after
        return count, lowest, highest

    return ArcSearch(generated_part(f"scan_{name}", scan), dip)
