"""Limit positions of the rocker, its swing and the stroke ratio (docs/rssr.md, section 5).

At a limit position the rocker ball lies in the plane of crank axis and crank: its coordinate eta across that plane is
zero.  In the extended position the crank points towards the ball, in the folded position away from it.  A crank that
turns fully and drives an oscillating rocker passes one position of each kind per turn, so eta changes sign exactly
twice.  The rocker itself turns fully if and only if the closure can be solved for phi at every psi, which is when its
discriminant, a trigonometric polynomial of degree 2 in psi, is never negative.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.arithmetic.intrinsics import largest, lowest_bit, smallest
from kernels.arithmetic.sincos import sincos
from kernels.curves.polynomials import minimum, rotate
from kernels.families.rssr.block import (
    BLOCK,
    BRANCH,
    CA,
    DELTA,
    K0,
    K1,
    K2,
    ROCKER,
    TOLERANCE,
    VALID,
    W_SIZE,
    Y0,
    E,
    least_delta,
    load_block,
    new_block,
)
from kernels.families.rssr.closure import closure_terms, follower
from kernels.jit import inline, kernel
from kernels.linkage.verdict import turning_status
from kernels.types import EPS, TWO_PI, Array, Status

LIMIT_NAMES = ("psi_ext", "psi_fold", "phi_ext", "phi_fold", "swing", "phi0", "stroke_ratio")
FEWEST, MOST = 32, 8192  # samples of the sign of eta
ROUNDS = 5  # steps of Newton's method, side by side
SETTLED = 1e-7  # a last step below this share of T leaves an error of the crank angle below 2^-46 T
Counts = NDArray[np.int64]
# Rows of a root: its bracket, its present place, the length of the last step, the sign of eta's slope; then, for steps
# side by side, cosine and sine of the place, and the closure of its design.
_LO, _HI, _PHI, _BEFORE, _RISING, _U, _V, _E, _Y0, _CA, _K0, _K1, _K2, _C = (k * 2 * BLOCK for k in range(14))
_ROOT_ROWS = 14
_TINY_SWING = 0.25  # below, the half-swing identity is more accurate than the difference of two angles


@inline
def _ball(at: Array, k: int, phi: float) -> tuple[float, float, float, float, float, float]:
    """Eta, xi, d eta/d phi along the motion, sin psi, cos psi and T at phi, in units of the crank."""
    e, y0, ca, k0, k1, k2, c = at[k + E], at[k + Y0], at[k + CA], at[k + K0], at[k + K1], at[k + K2], at[k + ROCKER]
    return _ball_at(e, y0, ca, k0, k1, k2, c, math.cos(phi), math.sin(phi))


@inline
def _ball_at(
    e: float, y0: float, ca: float, k0: float, k1: float, k2: float, c: float, u: float, v: float
) -> tuple[float, float, float, float, float, float]:
    """As :func:`_ball`, at (cos phi, sin phi) = (u, v)."""
    x, y, w = closure_terms(e, y0, ca, k0, k1, k2, u, v)
    rr = x * x + y * y
    t = math.sqrt(largest(rr - w * w, 0.0))
    cos, sin = -(x * w + y * t) / rr, (y * w - x * t) / rr
    xc, yc = e + c * cos, c * (ca * sin - k1)
    xi, eta = u * xc + v * yc, u * yc - v * xc
    return eta, xi, -xi + (u * ca * cos + v * sin) * (eta / t), sin, cos, t


@inline
def _list_root(at: Array, k: int, begin: float, width: float, roots: Array, i: int) -> None:
    """Put the zero of eta of design k between the samples ``begin`` and ``begin`` + 1 at place i of ``roots``."""
    lo, hi = begin * width, (begin + 1.0) * width
    roots[i + _LO], roots[i + _HI], roots[i + _PHI], roots[i + _BEFORE] = lo, hi, 0.5 * (lo + hi), hi - lo
    roots[i + _E], roots[i + _Y0], roots[i + _CA], roots[i + _C] = at[k + E], at[k + Y0], at[k + CA], at[k + ROCKER]
    roots[i + _K0], roots[i + _K1], roots[i + _K2] = at[k + K0], at[k + K1], at[k + K2]


@inline
def _approach(count: int, roots: Array) -> None:
    """Take steps of Newton's method from the middles of the brackets, all roots side by side.

    The number of steps is fixed and none calls a trigonometric function, so the loop over the roots is vector code.
    Where the last step was not tiny, or has left the bracket, BEFORE is nan.
    """
    for i in range(count):
        roots[i + _V], roots[i + _U] = sincos(roots[i + _PHI])
    for _ in range(ROUNDS):
        for i in range(count):
            u, v, half = roots[i + _U], roots[i + _V], 0.5 * (roots[i + _HI] - roots[i + _LO])
            eta, _, slope, _, _, t = _ball_at(
                roots[i + _E], roots[i + _Y0], roots[i + _CA], roots[i + _K0], roots[i + _K1], roots[i + _K2],
                roots[i + _C], u, v,
            )  # fmt: skip
            step = smallest(largest(-eta / slope, -half), half)
            roots[i + _PHI] += step
            roots[i + _U], roots[i + _V] = rotate(u, v, step)
            inside = (roots[i + _LO] <= roots[i + _PHI]) & (roots[i + _PHI] <= roots[i + _HI])
            roots[i + _BEFORE] = step if inside & (abs(step) <= SETTLED * t) else math.nan


@inline
def _unsettled(at: Array, who: Counts, active: Counts, count: int, roots: Array) -> int:
    """List the roots without convergence in :func:`_approach`, reset to mid-bracket; return their number."""
    left = 0
    for i in range(count):
        if math.isnan(roots[i + _BEFORE]):
            lo, hi = roots[i + _LO], roots[i + _HI]
            roots[i + _PHI], roots[i + _BEFORE] = 0.5 * (lo + hi), hi - lo
            rises = _ball(at, who[i >> 1], roots[i - (i & 1) + _LO])[0] <= 0.0
            roots[i + _RISING] = 1.0 if rises == ((i & 1) == 0) else -1.0
            active[left] = i
            left += 1
    return left


@inline
def _solve(at: Array, who: Counts, active: Counts, count: int, roots: Array) -> None:
    """Find the zeros of eta in their brackets by Newton steps, bisecting where a step leaves or does not gain.

    Every round takes one step of all roots that are left, numbers ``active[:count]``; root i is of design
    ``who[i // 2]``.  The steps of different roots do not wait for each other, so a round costs far less than its steps
    one after the other.
    """
    for _ in range(100):
        left = 0
        for j in range(count):
            i = active[j]
            lo, hi, phi, before = roots[i + _LO], roots[i + _HI], roots[i + _PHI], roots[i + _BEFORE]
            eta, _, slope, _, _, _ = _ball(at, who[i >> 1], phi)
            above = (eta > 0.0) == (roots[i + _RISING] > 0.0)
            lo, hi = (lo if above else phi), (phi if above else hi)
            # A step that leaves the bracket, or is not clearly shorter than the one before, is replaced by bisection.
            step = -eta / slope
            gains = (lo <= phi + step) & (phi + step <= hi) & (abs(step) <= 0.6 * before)
            step = step if gains else 0.5 * (lo + hi) - phi
            phi += step
            roots[i + _LO], roots[i + _HI], roots[i + _PHI], roots[i + _BEFORE] = lo, hi, phi, abs(step)
            active[left] = i
            left += 0 if abs(step) <= 4.0 * EPS * max(1.0, abs(phi)) else 1
        count = left
        if count == 0:
            break


@inline
def _rocker_turns(at: Array, k: int) -> bool:
    """Whether the closure is solvable for phi at every psi: then the rocker has no limit positions; (6*)."""
    e, y0, ca, k0, k1, k2 = at[k + E], at[k + Y0], at[k + CA], at[k + K0], at[k + K1], at[k + K2]
    m = minimum(2.0 * (k2 - e * k0), 2.0 * (y0 * k0 - k1 * ca), 0.5 * (1.0 - e * e - ca * ca + y0 * y0), e * y0)
    least: float = m.value + (k1 * k1 + k2 * k2 - k0 * k0) + 0.5 * (1.0 - e * e + ca * ca - y0 * y0)
    return least > 0.0


@inline
def _turning_points(at: Array, k: int, n: int, begin: Array) -> int:
    """Write the numbers of the samples after which psi' changes sign to ``begin``; return how many, 3 at most."""
    found, first, before = 0, False, False
    for i in range(n + 1):
        phi = (i % n) * (TWO_PI / n)
        p, _, _, _ = follower(
            at[k + E], at[k + Y0], at[k + CA], at[k + K0], at[k + K1], at[k + K2], math.cos(phi), math.sin(phi)
        )
        now = p > 0.0
        first = now if i == 0 else first
        if i > 0 and now != before and found < 3:
            begin[found] = i - 1.0
            found += 1
        before = now
    return found


@inline
def _mark_turning_points(count: int, at: Array, cos: Array, sin: Array, marks: Array) -> None:
    """Compute signs of psi' at FEWEST angles, all designs of the block side by side, as sums of powers of two."""
    for k in range(count):
        marks[k] = 0.0
    # A sum of powers of two instead of a set of bits: it stays in float64, so the loop over designs vectorises.
    mark = 1.0
    for i in range(FEWEST):
        u, v = cos[i], sin[i]
        for k in range(count):
            p, _, _, _ = follower(at[k + E], at[k + Y0], at[k + CA], at[k + K0], at[k + K1], at[k + K2], u, v)
            marks[k] += mark if p > 0.0 else 0.0
        mark *= 2.0


@inline
def _unmark(marks: float, begin: Array) -> int:
    """Find the turning points as :func:`_turning_points`, from the signs of :func:`_mark_turning_points`."""
    signs = int(marks)
    changes = signs ^ ((signs >> 1) | ((signs & 1) << (FEWEST - 1)))  # bit i: between sample i and i + 1
    begin[0] = lowest_bit(changes)
    found = 1 if changes != 0 else 0
    changes &= changes - 1
    begin[1] = lowest_bit(changes)
    found += 1 if changes != 0 else 0
    return found + (1 if changes & (changes - 1) != 0 else 0)


@inline
def _wrapped(angle: float) -> float:
    """Angle of an arctangent in [0, 2 pi)."""
    turned = angle + TWO_PI if angle < 0.0 else 0.0 + angle
    return turned if turned < TWO_PI else 0.0


@inline
def _swing(at: Array, k: int, s1: float, c1: float, s2: float, c2: float, rho: float) -> tuple[float, float, float]:
    """Signed swing of the mirrored mechanism, always negative, and two parts of its error.

    The second number is the factor by which errors of the two angles enter the swing, the third the rounding error of
    the swing's own formula.  ``rho`` is the sum of the two distances of the ball from the crank axis.  The half-swing
    identity keeps its relative accuracy for tiny swings; its sign also tells a swing near 2 pi from one near 0.  An
    error of an angle turns the lever and moves the ball by no more than the rocker's length times that error.  Lever
    and distances round like the terms they are sums of, which may be much larger than the sums.
    """
    difference = math.atan2(s2 * c1 - c2 * s1, c1 * c2 + s1 * s2)
    if abs(difference) > _TINY_SWING:
        return (difference if difference < 0.0 else difference - TWO_PI), 1.0, 0.0
    e, y0, rocker = at[k + E], at[k + Y0], at[k + ROCKER]
    sm, cm = s1 + s2, c1 + c2
    length = math.hypot(sm, cm)
    sm, cm = sm / length, cm / length
    lever = e * sm + y0 * cm
    half = math.asin(max(min(rho / (2.0 * rocker * lever), 0.5), -0.5))
    swing = 2.0 * half if half < 0.0 else 2.0 * half - TWO_PI
    turned = abs((e * cm - y0 * sm) / lever) + rocker / rho
    terms = (abs(e * sm) + abs(y0 * cm)) / abs(lever) + (abs(e) + rocker * (1.0 + abs(at[k + K1]))) / rho
    return swing, abs(2.0 * half) * turned, abs(swing) * 16.0 * EPS * (1.0 + terms)


@kernel
def limits(designs: Array, status: Status, out: Array, error: Array | None) -> None:
    """Limit positions, swing and stroke ratio of every design whose crank turns fully.

    Parameters
    ----------
    designs : (n, 8) columns as `PARAMETERS` of sweep/families/rssr.py
    status : (n,) out; OK, NOT_ROTATABLE, UNDECIDABLE, NOT_OSCILLATING, NOT_CONVERGED or INVALID_INPUT
    out : (n, 7) out, columns LIMIT_NAMES [rad]: rocker angles in (-pi, pi], crank angles in [0, 2 pi); swing
        psi_fold - psi_ext signed and unwrapped, its sign that of -branch; phi0 = phi_fold - phi_ext modulo 2 pi;
        stroke_ratio phi0/(2 pi - phi0)
    error : (n, 7) out, or None: rounding error estimates of the same

    Notes
    -----
    Where the status is not OK all are nan.  Largest error over the 122 oracle rows: 2.5 x 2^-53 x max(cond, |y|).
    """
    at, marks, begin = new_block(), np.empty(BLOCK), np.empty(3)
    who, active, roots = np.empty(BLOCK, np.int64), np.empty(2 * BLOCK, np.int64), np.empty(_ROOT_ROWS * 2 * BLOCK)
    cos, sin = np.empty(FEWEST), np.empty(FEWEST)
    for i in range(FEWEST):
        cos[i], sin[i] = math.cos(i * (TWO_PI / FEWEST)), math.sin(i * (TWO_PI / FEWEST))
    for start in range(0, designs.shape[0], BLOCK):
        count = min(BLOCK, designs.shape[0] - start)
        load_block(designs, start, count, at)
        least_delta(count, at)
        _mark_turning_points(count, at, cos, sin, marks)
        listed = 0
        for k in range(count):
            i = start + k
            for column in range(7):
                out[i, column] = math.nan
                if error is not None:
                    error[i, column] = math.nan
            status[i] = turning_status(at[k + DELTA], at[k + TOLERANCE], at[k + VALID] != 0.0)
            if status[i] != st.OK:
                continue
            n, found = FEWEST, _unmark(marks[k], begin)
            if found == 0 and _rocker_turns(at, k):
                status[i] = st.NOT_OSCILLATING
                continue
            while found != 2 and n < MOST:
                n *= 4
                found = _turning_points(at, k, n, begin)
            if found != 2:
                status[i] = st.NOT_CONVERGED
                continue
            _list_root(at, k, begin[0], TWO_PI / n, roots, 2 * listed)
            _list_root(at, k, begin[1], TWO_PI / n, roots, 2 * listed + 1)
            who[listed] = k
            listed += 1
        _approach(2 * listed, roots)
        _solve(at, who, active, _unsettled(at, who, active, 2 * listed, roots), roots)
        for j in range(listed):
            k, i = who[j], start + who[j]
            phi1, phi2 = roots[2 * j + _PHI], roots[2 * j + 1 + _PHI]
            if not _fill(at, k, phi1, phi2, out[i], error[i] if error is not None else None):
                status[i] = st.NOT_CONVERGED


@inline
def _fill(at: Array, k: int, phi1: float, phi2: float, out: Array, error: Array | None) -> bool:
    """Write the seven outputs from the two turning points; false if they are not one extended, one folded."""
    _, xi1, _, s1, c1, t1 = _ball(at, k, phi1)
    _, xi2, _, s2, c2, t2 = _ball(at, k, phi2)
    if xi1 < 0.0:  # the first one is the folded position: exchange
        phi1, xi1, s1, c1, t1, phi2, xi2, s2, c2, t2 = phi2, xi2, s2, c2, t2, phi1, xi1, s1, c1, t1
    if not (xi1 > 0.0 and xi2 < 0.0):
        return False
    branch, rocker, ca = at[k + BRANCH], at[k + ROCKER], at[k + CA]
    swing, growth, own = _swing(at, k, s1, c1, s2, c2, xi1 - xi2)
    dc, ds = c2 - c1, s2 - s1
    if abs(swing) < _TINY_SWING:
        half = math.tan(0.5 * swing)
        dc, ds = -half * (s1 + s2), half * (c1 + c2)
    # The ball from the crank axis, and its displacement between the limits: phi0 - pi without cancellation.
    x, y, dx, dy = at[k + E] + rocker * c1, rocker * (ca * s1 - at[k + K1]), rocker * dc, rocker * ca * ds
    beyond = math.atan2(x * dy - y * dx, x * (x + dx) + y * (y + dy))
    out[0], out[1] = math.atan2(0.0 + branch * s1, c1), math.atan2(0.0 + branch * s2, c2)  # pi, never -pi
    # At a limit psi is stationary in phi, so psi is known better; (8) gives phi from it.
    out[2], out[3] = _wrapped(math.atan2(y, x)), _wrapped(math.atan2(-y - dy, -x - dx))
    out[4], out[5], out[6] = branch * swing, math.pi + beyond, (math.pi + beyond) / (math.pi - beyond)
    if error is not None:
        size = 8.0 * EPS * (abs(at[k + E]) + 2.0 + abs(at[k + Y0]) + at[k + W_SIZE])
        error[0], error[1] = size / t1 + 4.0 * EPS, size / t2 + 4.0 * EPS
        error[2], error[3] = error[0] * rocker / xi1 + 16.0 * EPS, error[1] * rocker / -xi2 + 16.0 * EPS
        both = error[0] + error[1]
        error[4] = min(both, both * growth + own)
        error[5] = error[2] + error[3]
        error[6] = error[5] * TWO_PI / ((math.pi - beyond) * (math.pi - beyond))
    return True
