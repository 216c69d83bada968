"""All bracket angles that solve the equation of a mode: brackets on a grid, edges of validity, near double roots."""

from __future__ import annotations

import math
from typing import Any

from kernels._jit import inline
from kernels.families.backrest.closure import EPS, Array, residual

CELLS = 400
MOST = 8
_MOST_STEPS = 200  # a bound, so that the loops always end; halving takes some 60


@inline
def _edge(d: Array, good: float, bad: float, rho: float, mode: int) -> float:
    """Return the last angle from ``good`` towards ``bad`` at which the equation is defined."""
    for _ in range(_MOST_STEPS):
        middle = 0.5 * (good + bad)
        # no number lies between: the edge is known to the last bit
        if middle in (good, bad):
            break
        _, defined = residual(d, middle, rho, mode)
        if defined:
            good = middle
        else:
            bad = middle
    return good


@inline
def _bracketed(d: Array, a: float, fa: float, b: float, fb: float, rho: float, mode: int) -> float:
    """Return the root between a and b, where the signs differ:
    inverse quadratic steps kept in the bracket (Chandrupatla).
    """
    c, fc, t = a, fa, 0.5
    for _ in range(_MOST_STEPS):
        x = a + t * (b - a)
        fx, _ = residual(d, x, rho, mode)
        if (fx < 0.0) == (fa < 0.0):
            c, fc = a, fa
        else:
            c, b, fc, fb = b, a, fb, fa
        a, fa = x, fx
        best = a if abs(fa) < abs(fb) else b
        # the small constant: at the root phi = 0 a share of it would never be reached
        room = 2.0 * EPS * abs(best) + 1e-300
        if fa == 0.0 or abs(b - a) <= 2.0 * room:
            return best
        xi, ratio = (a - b) / (c - b), (fa - fb) / (fc - fb)
        # the inverse parabola is monotonic in the bracket only under this condition; else halve
        if ratio * ratio < xi and (1.0 - ratio) * (1.0 - ratio) < 1.0 - xi:
            t = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        else:
            t = 0.5
        # at least the tolerance away from both ends, so that the bracket closes from both sides
        least = room / abs(b - a)
        t = min(max(t, least), 1.0 - least)
    return a if abs(fa) < abs(fb) else b


@inline
def _dip(d: Array, low: float, high: float, sign: float, rho: float, mode: int) -> tuple[float, float]:
    """Find by golden sections where sign * residual is least between two angles; stop once it is below zero."""
    share = 0.3819660112501051  # (3 - sqrt(5))/2: one new value per step serves the next one too
    x, y = low + share * (high - low), high - share * (high - low)
    fx, fy = sign * residual(d, x, rho, mode)[0], sign * residual(d, y, rho, mode)[0]
    for _ in range(80):
        if fx < 0.0 or fy < 0.0:
            break
        if fx < fy:
            high, y, fy = y, x, fx
            x = low + share * (high - low)
            fx = sign * residual(d, x, rho, mode)[0]
        else:
            low, x, fx = x, y, fy
            y = high - share * (high - low)
            fy = sign * residual(d, y, rho, mode)[0]
    return (x, sign * fx) if fx < fy else (y, sign * fy)


@inline
def _kept(roots: Any, count: int, root: float) -> int:
    # a dip that just touches zero gives the same root from both of its sides
    if count < MOST and (count == 0 or root != roots[count - 1]):
        roots[count] = root
        return count + 1
    return count


@inline
def all_roots(d: Array, rho: float, mode: int, roots: Array) -> int:
    """Find the roots between phi_lo and phi_hi, write them ascending into ``roots`` (at least MOST long);
    return how many there are.

    The interval is cut into CELLS cells.  A cell with one undefined end is cut at the edge; a cell pair whose middle is
    a dip towards zero is searched for a pair of roots, so that two close roots are not stepped over.
    """
    low, high = d[29].real, d[30].real
    count = 0
    step = (high - low) / CELLS
    x0, f0, x1 = math.nan, math.nan, low
    f1, ok1 = residual(d, low, rho, mode)
    ok0 = False
    for k in range(CELLS):
        x2 = high if k == CELLS - 1 else low + (k + 1) * step
        f2, ok2 = residual(d, x2, rho, mode)
        left, f_left, right, f_right = x1, f1, x2, f2
        # towards the edge the residual may still change its sign: the part up to it is a cell of its own
        if ok1 and not ok2:
            right = _edge(d, x1, x2, rho, mode)
            f_right, _ = residual(d, right, rho, mode)
        if ok2 and not ok1:
            left = _edge(d, x2, x1, rho, mode)
            f_left, _ = residual(d, left, rho, mode)
        if ok0 and ok1 and ok2 and f0 * f1 > 0.0 and f1 * f2 > 0.0 and abs(f1) <= min(abs(f0), abs(f2)):
            dip, f_dip = _dip(d, x0, x2, math.copysign(1.0, f1), rho, mode)
            if f_dip * f1 <= 0.0:
                count = _kept(roots, count, _bracketed(d, x0, f0, dip, f_dip, rho, mode))
                count = _kept(roots, count, _bracketed(d, dip, f_dip, x2, f2, rho, mode))
        elif (ok1 or ok2) and f_left == 0.0:
            count = _kept(roots, count, left)
        elif (ok1 or ok2) and f_left * f_right < 0.0:
            count = _kept(roots, count, _bracketed(d, left, f_left, right, f_right, rho, mode))
        x0, f0, ok0 = x1, f1, ok1
        x1, f1, ok1 = x2, f2, ok2
    if ok1 and f1 == 0.0:
        count = _kept(roots, count, x1)
    return count
