"""Constants of one design of the five-link, its closure, and designs with the limits of a crank-rocker.

Polukhin 1971, section 5.5, in the forms of docs/five_link.md; the equation numbers are of that page.  Lengths are in
units of the crank and mirrored to the assembly mode +1, as in :mod:`kernels.linkage.crank_closure`, whose numbers it
shares.

In its limit positions the five-link lies in the plane of crank axis and crank, as the crank-rocker does, so that the
same rocker and the same axes serve: only crank and coupler change with h.

A scan finds all rocker angles that close the five-link at one crank angle, bounds prove that at most one has the wanted
sign.  The scan serves where Newton's method does not; the proof says where it does; (4) of docs/five_link.md.

G5 is defined where the coupler reaches the rocker's plane of motion along the crank axis, rho^2 >= 0: on the whole
circle, on one arc or on two (:mod:`kernels.curves.arc_roots`).

On a solution cos(delta) = (W - shift - share rho)/r, where delta is counted from the direction of the crank pin and
r = hypot(X, Y).  Bounds of rho therefore confine delta to two intervals, one on each side, and over an interval rho
changes less than over the circle: the bounds improve themselves.  Where dG5/dpsi = r sin(delta) - share rho' has the
sign of sin(delta) throughout each of them, each holds one solution at most.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import divisor
from kernels.arithmetic.sincos import sincos
from kernels.curves.arc_roots import angle_at, dip, scan, way_of
from kernels.curves.polynomials import rotate
from kernels.jit import inline, kernel
from kernels.linkage.crank_closure import Reduced, axial_terms, reduce_scaled, unit_scale
from kernels.types import EPS, Array, Numbers, Status


class Joint(NamedTuple):
    """Terms in the closure of the two revolutes in place of the driving ball, in units of the crank.

    G5 = X C - Y S + W - shift - share rho(psi) with rho^2 = b^2 - z^2 and z = sweep S + axial, (1).
    """

    coupler: Any  # b
    sweep: Any  # c sin(alpha), mirrored
    axial: Any  # g cos(alpha) - f
    shift: Any  # (h^2 + s2^2)/(2 c)
    share: Any  # h/c
    h: Any
    s2: Any
    plain: bool  # rho does not depend on psi, or does not matter: the closure is that of a crank-rocker
    size: float  # magnitude of the terms this joint adds, for their rounding errors
    mode: int
    valid: bool


# G5 and rho with their derivatives with respect to psi.
Slope = namedtuple("Slope", "value first second rho rho1 rho2 z")


@inline
def reduce_design(designs: Numbers, i: int) -> tuple[Reduced, Joint]:
    """Constants of one design; ``valid`` is false for zero or negative lengths and for numbers that are not finite."""
    unit = unit_scale(designs[i, 2].real)
    a, b, c = designs[i, 0] * unit, designs[i, 1] * unit, designs[i, 2] * unit
    e, f, g = designs[i, 3] * unit, designs[i, 4] * unit, designs[i, 5] * unit
    alpha, branch, mode = designs[i, 6], designs[i, 9].real, designs[i, 10].real
    r = reduce_scaled(a, b, c, e, f, g, alpha, branch)
    h, s2, per_a, per_c = designs[i, 7] * unit, designs[i, 8] * unit, 1.0 / a, 1.0 / c
    _, ca = sincos(alpha)
    _, _, rise = axial_terms(g, f, alpha, ca)
    sweep, axial, coupler = branch * (r.sa * r.rocker), rise * per_a, r.coupler
    shift, share = 0.5 * (h * h + s2 * s2) * per_c * per_a, h * per_c
    plain = (share == 0.0) | (sweep == 0.0)
    size = abs(shift.real) + abs((share * coupler).real)
    whole = mode == 1.0 or mode == 2.0 or mode == 3.0
    valid = r.valid and whole and size < 1e140 and (s2 * per_a).real == (s2 * per_a).real
    number = 1
    if valid:
        number = int(mode)
    return r, Joint(
        coupler, sweep, axial, shift, share, h * per_a, s2 * per_a, plain, size, number, valid
    )  # fmt: skip


@inline
def axial_reach(joint: Joint, s: Any) -> tuple[Any, Any]:
    """Axial distance z and rho^2 = b^2 - z^2, from the sine of the rocker angle."""
    z = joint.sweep * s + joint.axial
    return z, (joint.coupler - z) * (joint.coupler + z)


@inline
def reaches(joint: Joint, s: float) -> bool:
    """Whether rho is positive beyond rounding at the rocker angle of sine s."""
    _, square = axial_reach(joint, s)
    return bool(square > 32.0 * EPS * joint.coupler * joint.coupler)


@inline
def slope(joint: Joint, x: Any, y: Any, w: Any, c: Any, s: Any) -> Slope:
    """G5, its first two derivatives and rho at the rocker angle of cosine c and sine s, where rho^2 > 0; (1), (2)."""
    z, square = axial_reach(joint, s)
    rho = np.sqrt(square)
    per_rho = 1.0 / divisor(rho)  # 0 at the very end of an arc
    z1, z2 = joint.sweep * c, -joint.sweep * s
    rho1 = -z * z1 * per_rho
    rho2 = -(z1 * z1 + z * z2 + rho1 * rho1) * per_rho
    along = x * c - y * s
    value = along + (w - joint.shift) - joint.share * rho
    first = -(x * s + y * c) - joint.share * rho1
    return Slope(value, first, -along - joint.share * rho2, rho, rho1, rho2, z)


@inline
def polished(r: Reduced, joint: Joint, x: Any, y: Any, w: Any, v: Any, c: Any, s: Any) -> tuple[Any, Any, Any]:
    """Refine the rocker angle of a rocker longer than its coupler: minus cosine, minus sine, dG5/dpsi; (1 a).

    The terms of G5 are then as long as the rocker and leave the coupler to a few of their digits; the vector from crank
    pin to ball is as long as the coupler.
    """
    for _ in range(2):
        here = slope(joint, x, y, w, c, s)
        d1, d2, reach = x + r.rocker * c, r.rocker * (r.ca * s - r.k1) - v, joint.h + here.rho
        value = 0.5 * (d1 * d1 + d2 * d2 - reach * reach - joint.s2 * joint.s2) / r.rocker
        c, s = rotate(c, s, -value / divisor(here.first))
    return -c, -s, slope(joint, x, y, w, c, s).first


@inline
def residual_size(r: Reduced, joint: Joint, x: Any, y: Any) -> float:
    """Estimate the rounding error of G5: 8 x 2^-53 times the magnitudes that its terms are made of."""
    terms = abs(x.real) + abs(y.real) + abs(r.e.real) + 2.0 + abs(r.y0.real) + r.w_size + joint.size
    return float(8.0 * EPS * terms)


@kernel
def with_limits_of(
    designs: Array, psi_ext: Array, psi_fold: Array, h: Array, status: Status, a: Array, b: Array
) -> None:
    """Compute crank and coupler of five-links with s2 = 0 that have the limit positions of given crank-rockers.

    Parameters
    ----------
    designs : (n, 8) crank-rockers: a, b, c, e, f, g, alpha, branch
    psi_ext, psi_fold : (n,) their rocker angles in the extended and the folded limit position [rad]
    h : (n,) common perpendicular of the two revolutes
    status : (n,) out; OK, INVALID_INPUT, or NOT_ADMISSIBLE where no crank of positive length, or no coupler that
        reaches beyond the second revolute, has these limit positions
    a, b : (n,) out [length]; nan where the status is not OK
    """
    for i in range(designs.shape[0]):
        crank, c, e, f, g, alpha = (
            designs[i, 0],
            designs[i, 2],
            designs[i, 3],
            designs[i, 4],
            designs[i, 5],
            designs[i, 6],
        )
        sa, ca = math.sin(alpha), math.cos(alpha)
        # distance of the ball from the crank axis in both positions, and its height over the crank plane in the first
        y1, y2 = c * math.sin(psi_ext[i]), c * math.sin(psi_fold[i])
        rho1 = math.hypot(c * math.cos(psi_ext[i]) + e, y1 * ca - g * sa)
        rho2 = math.hypot(c * math.cos(psi_fold[i]) + e, y2 * ca - g * sa)
        between = rho1 + rho2 - 2.0 * h[i]
        found = (crank * (rho1 + rho2) - h[i] * (rho1 - rho2)) / between
        across = rho1 - found - h[i]
        admissible = found > 0.0 and across > 0.0 and rho2 + found > h[i]
        status[i] = st.OK if admissible else st.NOT_ADMISSIBLE
        if found - found != 0.0:  # infinite or nan
            status[i] = st.INVALID_INPUT
        a[i] = found if status[i] == st.OK else math.nan
        b[i] = np.hypot(across, y1 * sa + g * ca - f) if status[i] == st.OK else math.nan


SAMPLES = 32  # cells per arc
# A rocker angle and G5 there.
ClosureValue = namedtuple("ClosureValue", "psi value")
# Terms of G5 at one crank angle: the joint, and X, Y, W of a crank-rocker.
Terms = namedtuple("Terms", "joint x y w")


@inline
def _closure(k: Terms, psi: float) -> float:
    """Evaluate G5; at the end of an arc a rho^2 that rounding made negative counts as 0."""
    c, s = math.cos(psi), math.sin(psi)
    _, square = axial_reach(k.joint, s)
    return float(k.x * c - k.y * s + (k.w - k.joint.shift) - k.joint.share * math.sqrt(max(square, 0.0)))


@kernel
def _extremes_of_arc(k: Terms, centre: float, half: float) -> tuple[ClosureValue, ClosureValue]:
    """Find the smallest and the largest G5 on one arc, and their places."""
    begin, width = way_of(half)
    step = width / SAMPLES
    least, most, at_least, at_most = math.inf, -math.inf, 0, 0
    low, high = ClosureValue(0.0, math.inf), ClosureValue(0.0, -math.inf)
    for n in range(SAMPLES + 1):
        f = _closure(k, angle_at(centre, half, begin + step * n))
        if f < least:
            least, at_least = f, n
        if f > most:
            most, at_most = f, n
    for n, sign in ((at_least, 1.0), (at_most, -1.0)):
        lo, hi = begin + step * (n - 1), begin + step * (n + 1)
        if half < math.pi:
            lo, hi = max(lo, 0.0), min(hi, math.pi)
        tau, f = dip(_closure, k, centre, half, lo, hi, sign)
        if sign > 0.0 and f < low.value:
            low = ClosureValue(angle_at(centre, half, tau), f)
        if sign < 0.0 and -f > high.value:
            high = ClosureValue(angle_at(centre, half, tau), -f)
    return low, high


@inline
def arcs(joint: Joint) -> tuple[int, float, float, float, float]:
    """Find the arcs where rho^2 >= 0: number, centre and half width of both; half width pi is the whole circle."""
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
    """Write the mirrored rocker angles [rad] of all solutions into ``at`` (at least MOST); return their number.

    A place where |G5| comes as near to zero as ``noise`` without crossing it counts as a solution.
    """
    number, centre, half, centre2, half2 = arcs(joint)
    k, count = Terms(joint, x, y, w), 0
    if number > 0:
        count, _, _ = scan(_closure, SAMPLES, k, centre, half, noise, count, at)
    if number > 1:
        count, _, _ = scan(_closure, SAMPLES, k, centre2, half2, noise, count, at)
    return count


@kernel
def extremes(joint: Joint, x: float, y: float, w: float) -> tuple[ClosureValue, ClosureValue]:
    """Find the extremes of G5 on the arc where their product is nearest to zero; infinite without an arc."""
    number, centre, half, centre2, half2 = arcs(joint)
    k = Terms(joint, x, y, w)
    low, high = ClosureValue(0.0, math.inf), ClosureValue(0.0, -math.inf)
    if number > 0:
        low, high = _extremes_of_arc(k, centre, half)
    if number > 1:
        low2, high2 = _extremes_of_arc(k, centre2, half2)
        if abs(low2.value * high2.value) < abs(low.value * high.value):
            low, high = low2, high2
    return low, high


ROUNDS = 5
GUARD = 1e-9  # relative widening of every bound, far above its rounding
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
    """Bound the number of solutions for each sign of dG5/dpsi.

    ONE: at most one; NONE: no solution; UNKNOWN: neither was proved.
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
