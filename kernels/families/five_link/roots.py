"""All rocker angles that close the five-link at one crank angle, and the proof that at most one has the wanted sign.

The scan serves where Newton's method does not; the proof says where it does; (4) of docs/five_link.md.

G5 is defined where the coupler reaches the rocker's plane of motion along the crank axis, rho^2 >= 0: on the whole
circle, on one arc or on two.  An arc is traversed as psi = centre - half cos(tau), so that the root of rho at its ends
becomes smooth.  Roots are bracketed between samples, and where |G5| dips between samples of equal sign the dip is
searched.  Real numbers only; the caller polishes what is found.

On a solution cos(delta) = (W - shift - share rho)/r, where delta is counted from the direction of the crank pin and
r = hypot(X, Y).  Bounds of rho therefore confine delta to two intervals, one on each side, and over an interval rho
changes less than over the circle: the bounds improve themselves.  Where dG5/dpsi = r sin(delta) - share rho' has the
sign of sin(delta) throughout each of them, each holds one solution at most.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kernels.families.five_link.closure import Joint, axial_reach
from kernels.jit import inline, kernel
from kernels.types import Array

SAMPLES = 32  # cells per arc
MOST = 8  # roots that are kept; G5 has at most four, and rounding at a double root may show it as a few


class ClosureValue(NamedTuple):
    """A rocker angle and G5 there."""

    psi: float
    value: float


_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


@inline
def _angle(centre: float, half: float, tau: float) -> float:
    return tau if half >= math.pi else centre - half * math.cos(tau)


@inline
def _closure(joint: Joint, x: float, y: float, w: float, psi: float) -> float:
    """Evaluate G5; at the end of an arc a rho^2 that rounding made negative counts as 0."""
    c, s = math.cos(psi), math.sin(psi)
    _, square = axial_reach(joint, s)
    return float(x * c - y * s + (w - joint.shift) - joint.share * math.sqrt(max(square, 0.0)))


@kernel
def _bracketed(
    joint: Joint, x: float, y: float, w: float, centre: float, half: float, lo: float, hi: float, f_lo: float
) -> float:
    """Find the rocker angle of the root between two places of opposite sign, by bisection, which never fails."""
    # 52 halvings of a cell come to its last bits; what they leave the caller's Newton steps take away
    for _ in range(52):
        mid = 0.5 * (lo + hi)
        f = _closure(joint, x, y, w, _angle(centre, half, mid))
        if (f > 0.0) == (f_lo > 0.0):
            lo = mid
        else:
            hi = mid
    return _angle(centre, half, 0.5 * (lo + hi))


@kernel
def _dip(
    joint: Joint, x: float, y: float, w: float, centre: float, half: float, lo: float, hi: float, sign: float
) -> tuple[float, float]:
    """Find where sign * G5 is least between two places, and its value there, by the golden section."""
    p, q = hi - _GOLDEN * (hi - lo), lo + _GOLDEN * (hi - lo)
    f_p = sign * _closure(joint, x, y, w, _angle(centre, half, p))
    f_q = sign * _closure(joint, x, y, w, _angle(centre, half, q))
    # 0.618^45 = 4e-10 of the cells: nearer to the least the value no longer changes by a rounding
    for _ in range(45):
        if f_p <= f_q:
            hi, q, f_q = q, p, f_p
            p = hi - _GOLDEN * (hi - lo)
            f_p = sign * _closure(joint, x, y, w, _angle(centre, half, p))
        else:
            lo, p, f_p = p, q, f_q
            q = lo + _GOLDEN * (hi - lo)
            f_q = sign * _closure(joint, x, y, w, _angle(centre, half, q))
    return (p, f_p) if f_p <= f_q else (q, f_q)


@kernel
def _scan_arc(
    joint: Joint, x: float, y: float, w: float, centre: float, half: float, noise: float, count: int, at: Array
) -> int:
    """Append the roots on one arc to ``at`` and return how many there are now."""
    whole = half >= math.pi
    begin, width = (-math.pi, 2.0 * math.pi) if whole else (0.0, math.pi)
    step = width / SAMPLES
    before = _closure(joint, x, y, w, _angle(centre, half, begin - step)) if whole else math.inf
    here = _closure(joint, x, y, w, _angle(centre, half, begin))
    for k in range(SAMPLES + 1):
        tau = begin + step * k
        last = k == SAMPLES
        after = math.inf
        if whole or not last:
            after = _closure(joint, x, y, w, _angle(centre, half, tau + step))
        sign = 1.0 if here > 0.0 else -1.0
        if not last and (after > 0.0) != (here > 0.0):
            if count < MOST:
                at[count] = _bracketed(joint, x, y, w, centre, half, tau, tau + step, here)
                count += 1
        elif abs(here) <= abs(after) and (before == math.inf or sign * before >= abs(here)) and not (whole and last):
            # the samples on both sides have the same sign and are no nearer to zero; beyond an end counts as far
            lo = tau if before == math.inf else tau - step
            hi = tau if after == math.inf else tau + step
            place, least = _dip(joint, x, y, w, centre, half, lo, hi, sign)
            if least <= 0.0 and count + 1 < MOST:
                at[count] = _bracketed(joint, x, y, w, centre, half, lo, place, sign)
                at[count + 1] = _bracketed(joint, x, y, w, centre, half, place, hi, -sign)
                count += 2
            # zero within the noise of G5 is a double root, which rounding may have lifted off
            elif least <= noise and count < MOST:
                at[count] = _angle(centre, half, place)
                count += 1
        before, here = here, after
    return count


@kernel
def _extremes_of_arc(
    joint: Joint, x: float, y: float, w: float, centre: float, half: float
) -> tuple[ClosureValue, ClosureValue]:
    """Find the places of the smallest and the largest G5 on one arc."""
    whole = half >= math.pi
    begin, width = (-math.pi, 2.0 * math.pi) if whole else (0.0, math.pi)
    step = width / SAMPLES
    least, most, at_least, at_most = math.inf, -math.inf, 0, 0
    low, high = ClosureValue(0.0, math.inf), ClosureValue(0.0, -math.inf)
    for k in range(SAMPLES + 1):
        f = _closure(joint, x, y, w, _angle(centre, half, begin + step * k))
        if f < least:
            least, at_least = f, k
        if f > most:
            most, at_most = f, k
    for k, sign in ((at_least, 1.0), (at_most, -1.0)):
        lo, hi = begin + step * (k - 1), begin + step * (k + 1)
        if not whole:
            lo, hi = max(lo, 0.0), min(hi, math.pi)
        tau, f = _dip(joint, x, y, w, centre, half, lo, hi, sign)
        if sign > 0.0 and f < low.value:
            low = ClosureValue(_angle(centre, half, tau), f)
        if sign < 0.0 and -f > high.value:
            high = ClosureValue(_angle(centre, half, tau), -f)
    return low, high


@inline
def arcs(joint: Joint) -> tuple[int, float, float, float, float]:
    """Count the arcs on which rho^2 >= 0, and give centre and half width of both; half width pi is the whole circle."""
    if joint.sweep == 0.0:
        reaches = abs(joint.axial) < joint.coupler
        return (1 if reaches else 0), 0.0, math.pi, 0.0, 0.0
    one, two = (-joint.coupler - joint.axial) / joint.sweep, (joint.coupler - joint.axial) / joint.sweep
    low, high = min(one, two), max(one, two)
    if low >= 1.0 or high <= -1.0:
        return 0, 0.0, 0.0, 0.0, 0.0
    if low <= -1.0 and high >= 1.0:
        return 1, 0.0, math.pi, 0.0, 0.0
    quarter = 0.5 * math.pi
    if low <= -1.0:
        return 1, -quarter, math.atan2(math.sqrt((1.0 - high) * (1.0 + high)), -high), 0.0, 0.0
    if high >= 1.0:
        return 1, quarter, math.atan2(math.sqrt((1.0 - low) * (1.0 + low)), low), 0.0, 0.0
    first, second = math.asin(low), math.asin(high)
    centre, half = 0.5 * (first + second), 0.5 * (second - first)
    return 2, centre, half, math.pi - centre, half


@kernel
def all_roots(joint: Joint, x: float, y: float, w: float, noise: float, at: Array) -> int:
    """Write the mirrored rocker angles [rad] of all solutions into ``at``, at least MOST numbers; their number.

    A place where |G5| comes as near to zero as ``noise`` without crossing it counts as one.
    """
    number, centre, half, centre2, half2 = arcs(joint)
    count = 0
    if number > 0:
        count = _scan_arc(joint, x, y, w, centre, half, noise, count, at)
    if number > 1:
        count = _scan_arc(joint, x, y, w, centre2, half2, noise, count, at)
    return count


@kernel
def extremes(joint: Joint, x: float, y: float, w: float) -> tuple[ClosureValue, ClosureValue]:
    """Find the extremes of G5 on the arc where their product is nearest to zero; infinite without an arc."""
    number, centre, half, centre2, half2 = arcs(joint)
    low, high = ClosureValue(0.0, math.inf), ClosureValue(0.0, -math.inf)
    if number > 0:
        low, high = _extremes_of_arc(joint, x, y, w, centre, half)
    if number > 1:
        low2, high2 = _extremes_of_arc(joint, x, y, w, centre2, half2)
        if abs(low2.value * high2.value) < abs(low.value * high.value):
            low, high = low2, high2
    return low, high


ROUNDS = 5
GUARD = 1e-9  # every bound is widened by this part of what it is made of, far above its rounding
ONE, UNKNOWN, NONE = 1, 0, -1


@inline
def _reach_between(joint: Joint, s0: float, s1: float) -> tuple[float, float, float]:
    """Smallest and largest rho and the largest |z| for sines between two values."""
    z0, z1 = joint.sweep * s0 + joint.axial, joint.sweep * s1 + joint.axial
    far = max(abs(z0), abs(z1)) + GUARD * joint.coupler
    near = 0.0 if z0 * z1 <= 0.0 else max(min(abs(z0), abs(z1)) - GUARD * joint.coupler, 0.0)
    low = max((joint.coupler - far) * (joint.coupler + far), 0.0)
    high = max((joint.coupler - near) * (joint.coupler + near), 0.0)
    return math.sqrt(low), math.sqrt(high), far


@kernel
def solutions(joint: Joint, x: float, y: float, w: float) -> int:
    """Tell how many solutions there can be for each sign of dG5/dpsi.

    ONE is one at most, NONE no solution; UNKNOWN where neither was proved.
    """
    r = math.sqrt(x * x + y * y)
    if not r > 0.0:
        return UNKNOWN
    cos0, sin0 = -x / r, y / r  # direction of the crank pin
    close = w - joint.shift
    noise = GUARD * (1.0 + (abs(w) + joint.shift + abs(joint.share) * joint.coupler) / r)
    first, last, _ = _reach_between(joint, -1.0, 1.0)
    empty = 0
    for side in (1.0, -1.0):
        low, high = first, last
        proved = False
        for _ in range(ROUNDS):
            one, two = (close - joint.share * low) / r, (close - joint.share * high) / r
            cos_near, cos_far = max(one, two) + noise, min(one, two) - noise
            if cos_near < -1.0 or cos_far > 1.0 or high <= 0.0:
                empty += 1
                proved = True
                break
            cos_near, cos_far = min(cos_near, 1.0), max(cos_far, -1.0)
            sin_near = side * math.sqrt((1.0 - cos_near) * (1.0 + cos_near))
            sin_far = side * math.sqrt((1.0 - cos_far) * (1.0 + cos_far))
            s_near, c_near = sin0 * cos_near + cos0 * sin_near, cos0 * cos_near - sin0 * sin_near
            s_far, c_far = sin0 * cos_far + cos0 * sin_far, cos0 * cos_far - sin0 * sin_far
            # Over at most half a turn the sine passes 1 where the cosine changes sign downwards, -1 upwards, and the
            # cosine passes 1 or -1 where the sine changes sign.
            falls = (c_near * side >= 0.0) & (c_far * side <= 0.0)
            rises = (c_near * side <= 0.0) & (c_far * side >= 0.0)
            s_low = -1.0 if rises else min(s_near, s_far)
            s_high = 1.0 if falls else max(s_near, s_far)
            wide = 1.0 if s_near * s_far <= 0.0 else max(abs(c_near), abs(c_far))
            low, high, far = _reach_between(joint, s_low, s_high)
            if low > 0.0:
                steep = abs(joint.share) * far * abs(joint.sweep) * wide / low
                if r * min(abs(sin_near), abs(sin_far)) > steep * (1.0 + GUARD):
                    proved = True
                    break
        if not proved:
            return UNKNOWN
    return NONE if empty == 2 else ONE
