"""Samples of the search for true maxima, and the local maxima among them (docs/rssr.md, section 6).

Most designs need no more than 16 samples.  Those of a block of designs are computed side by side, and their local
maxima are marked side by side; a design that needs more samples is taken by itself.  Sets of samples are bits of one
integer, so that listing maxima takes no loop over the samples.

All local maxima of a block of designs are refined side by side in one list: Newton steps on the next derivative, and
conditions under which a refined maximum is trusted.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels.arithmetic.intrinsics import largest, lowest_bit, smallest
from kernels.arithmetic.vectors import Vector
from kernels.curves.polynomials import rotate
from kernels.families.rssr.block import BLOCK, CA, K0, K1, K2, W_SIZE, Y0, E
from kernels.families.rssr.careful import Loop, rounding
from kernels.families.rssr.closure import follower
from kernels.jit import inline, kernel
from kernels.types import TWO_PI, Array, CosSin

MOST_PEAKS = 8  # 16 samples cannot have more; a design with more goes to the careful search
# Rows 960 bytes apart modulo 4096, so that they do not evict each other from the cache.
CAPACITY = BLOCK * MOST_PEAKS + 120
# Constants of the design; place and spacing of the samples; three samples; results.
(
    _E, _Y0, _CA, _K0, _K1, _K2, _SIZE, _U, _V, START, _WIDTH, _LEFT, _PEAK, _RIGHT,
    _GUESS, MOVED, LAST, HEIGHT, ERROR, ROUNDING, REACH,
) = (k * CAPACITY for k in range(21))  # fmt: skip
_ROWS = 21
# Share of a rise that terms of fourth order add at most, for a step as long as the samples are apart.
_FOURTH = 8.0
_TURNED = 4e-12  # error of an angle that is the sum of a few turns by :func:`rotate`
# From a maximum to the samples beside it the function falls about as far as the parabola that touches it at the top.
# If it falls by less than this share of the parabola, there may be a second maximum between the samples.
_NEAREST, _NEXT = 0.6, 0.2  # for the sample at which it was found, and for that sample's neighbours
_LEVEL = 1e-10  # a fall by less than this share of the height counts as none


@inline
def new_list() -> Array:
    """Allocate the list of maxima of a block."""
    return np.empty(_ROWS * CAPACITY)


@inline
def append(at: Array, k: int, u: float, v: float, samples: Vector, n: int, sample: int, m: Array, i: int) -> None:
    """Put a local maximum of design k of a block at place i: sample number ``sample`` of n, in the middle of three."""
    width = TWO_PI / n
    m[i + _U], m[i + _V], m[i + START], m[i + _WIDTH] = u, v, sample * width, width
    m[i + _LEFT], m[i + _PEAK], m[i + _RIGHT] = samples
    m[i + _E], m[i + _Y0], m[i + _CA] = at[k + E], at[k + Y0], at[k + CA]
    m[i + _K0], m[i + _K1], m[i + _K2], m[i + _SIZE] = at[k + K0], at[k + K1], at[k + K2], at[k + W_SIZE]


@inline
def _jet(m: Array, i: int, first: Array | None, second: Array | None) -> tuple[float, float, float, float | None]:
    """Wanted transfer function and its next three derivatives at a maximum of the list, two where the third is dear."""
    e, y0, ca, k0, k1, k2 = m[i + _E], m[i + _Y0], m[i + _CA], m[i + _K0], m[i + _K1], m[i + _K2]
    u, v = m[i + _U], m[i + _V]
    p, q, j, k = follower(e, y0, ca, k0, k1, k2, u, v)
    if first is not None:
        return p, q, j, k
    if second is not None:
        return q, j, k, None
    # The fifth derivative only steers the iteration: a difference quotient of the fourth is enough.
    ahead = 1e-4 * m[i + _WIDTH]
    u, v = rotate(u, v, ahead)
    _, _, _, k_ahead = follower(e, y0, ca, k0, k1, k2, u, v)
    return j, k, (k_ahead - k) / ahead, None


@inline
def begin_at_vertex(count: int, m: Array) -> None:
    """Move each maximum to the vertex of the parabola through its three samples."""
    for i in range(count):
        left, right = m[i + _PEAK] - m[i + _LEFT], m[i + _PEAK] - m[i + _RIGHT]
        offset = 0.5 * (left - right) / (left + right)
        m[i + _GUESS] = m[i + _PEAK] + 0.25 * offset * (left - right)
        u, v = rotate(m[i + _U], m[i + _V], offset * m[i + _WIDTH])
        m[i + _U] = u
        m[i + _V] = v
        m[i + MOVED] = offset * m[i + _WIDTH]


@inline
def _towards_zero(dy: float, per_d2y: float, d3y: float | None) -> float:
    """Step to the zero of dy of Newton's method, or of Chebyshev's with a third derivative; ``per_d2y`` is 1/d2y."""
    newton = -dy * per_d2y
    if d3y is None:
        return newton
    return newton * min(max(1.0 - 0.5 * newton * d3y * per_d2y, 0.5), 2.0)


@inline
def refine(begin: int, end: int, m: Array, rounds: int, first: Array | None, second: Array | None) -> None:
    """Take steps to the zero of the next derivative, uphill where it is not concave; all maxima side by side."""
    for _ in range(rounds):
        for i in range(begin, end):
            y, dy, d2y, d3y = _jet(m, i, first, second)
            width = m[i + _WIDTH]
            step = _towards_zero(dy, 1.0 / d2y, d3y) if y * d2y < 0.0 else math.copysign(width, y * dy)
            step = min(max(step, -0.5 * width), 0.5 * width)
            m[i + MOVED] += step
            m[i + LAST] = step
            u, v = rotate(m[i + _U], m[i + _V], step)
            m[i + _U] = u
            m[i + _V] = v


@inline
def _last_step(dy: float, d2y: float, d3y: float | None, sign: float, width: float) -> tuple[float, float, float]:
    """Step to the top of the parabola or cubic at a point, its rise times ``sign``, and that rise's error."""
    per = 1.0 / (d2y * width)  # one division gives both reciprocals
    step = _towards_zero(dy, per * width, d3y)
    if d3y is None:
        rise = 0.5 * dy * step * sign
        return step, rise, rise
    rise = step * (dy + step * (0.5 * d2y + (1.0 / 6.0) * (step * d3y))) * sign
    near = step * (per * d2y)
    return step, rise, _FOURTH * near * near * abs(rise)


@inline
def finish(
    begin: int, end: int, m: Array, order: int, target: float, first: Array | None, second: Array | None,
    error: Array | None, phi_error: Array | None,
) -> None:  # fmt: skip
    """Compute the peak of the parabola through the last point, and its rise above the point as an error estimate.

    With a third derivative it is a cubic; the estimate is then what terms of fourth order can add to that rise.
    If error estimates are wanted, also the rounding error and the error of the place.
    """
    for i in range(begin, end):
        y, dy, d2y, d3y = _jet(m, i, first, second)
        width = m[i + _WIDTH]
        step, rise, left = _last_step(dy, d2y, d3y, math.copysign(1.0, y), width)
        peak = abs(y) + rise
        trusted = (y * d2y < 0.0) & (left <= target * peak) & (abs(m[i + MOVED]) <= width)
        trusted = trusted & (abs(peak - m[i + _GUESS]) <= 0.2 * peak)
        moved, bend = m[i + MOVED], 0.5 * abs(d2y)
        before, after = width + moved, width - moved
        trusted = trusted & (peak - m[i + _PEAK] >= _NEAREST * bend * moved * moved - _LEVEL * peak)
        trusted = trusted & (peak - m[i + _LEFT] >= _NEXT * bend * before * before)
        trusted = trusted & (peak - m[i + _RIGHT] >= _NEXT * bend * after * after)
        m[i + ERROR] = left if trusted else math.inf
        if error is not None or phi_error is not None:
            of = Loop(m[i + _E], m[i + _Y0], m[i + _CA], m[i + _K0], m[i + _K1], m[i + _K2], m[i + _SIZE])
            relative, slope = rounding(order, of, m[i + _U], m[i + _V], peak)
            m[i + ROUNDING] = relative
            if phi_error is not None:
                m[i + REACH] = _reach(m, i, order, step, math.sqrt(abs(y / d2y)), relative, slope)
        m[i + HEIGHT], m[i + LAST] = peak, step


@inline
def _reach(m: Array, i: int, order: int, step: float, across: float, relative: float, slope: float) -> Any:
    """Error of the place of a peak; ``across`` is the peak's width, the others are rounding errors."""
    # The error after a step of Newton's method is quadratic in the step, of Chebyshev's (order 1) cubic, with a factor
    # estimated from the step before; for the jerk the slope is good to a thousandth.
    # A step before that was 0 by chance tells nothing.
    near, gain = abs(step) / m[i + _WIDTH], smallest(abs(step) / (abs(m[i + LAST]) + 1e-300), 1.0)
    left = largest(near, gain * gain) if order > 1 else largest(near * near, gain * gain * gain)
    left = 4.0 * left + (1e-3 if order == 3 else 0.0)
    return left * abs(step) + 4.0 * across * (relative + across * slope) + _TURNED


_AGAIN: Any = np.int64(3)  # more steps; for a literal number in the call `refine` would be compiled once more


@kernel
def settle(
    begin: int, end: int, m: Array, order: int, target: float, first: Array | None, second: Array | None,
    error: Array | None, phi_error: Array | None,
) -> float:  # fmt: skip
    """Take more steps for the maxima not trusted yet; return the largest error estimate of all.

    It is infinite if a maximum is still not trusted.
    """
    worst = 0.0
    for i in range(begin, end):
        if not m[i + ERROR] < math.inf:
            refine(i, i + 1, m, _AGAIN, first, second)
            finish(i, i + 1, m, order, target, first, second, error, phi_error)
        worst = max(worst, m[i + ERROR])
    return worst


FEWEST, MOST = 16, 1024
_FLOOR, MARKS = FEWEST + 2, (FEWEST + 3) * BLOCK  # two more rows under the samples of a block
GRID_SIZE = (FEWEST + 4) * BLOCK
# Bitwise "and" with this leaves numbers below 2048 unchanged and shows the compiler that they are not negative.
# Otherwise it would handle indices that count from the end, and gather samples one by one: twice the time.
_NEVER_NEGATIVE = 2047


class Samples(NamedTuple):
    """Layout of the samples of one design: ``stride`` apart, behind one at ``first``, numbers ``begin``, ... of n."""

    first: int
    stride: int
    n: int
    begin: int


def sampling_tables() -> CosSin:
    """Cosines and sines of N equally spaced angles for N = 16, 32, ..., 1024; those of N start at position N - 16."""
    phi = np.concatenate([np.arange(n) * (2.0 * np.pi / n) for n in (16 << k for k in range(7))])
    return np.cos(phi), np.sin(phi)


@inline
def sample(at: Array, k: int, table: CosSin, n: int, size: Array, first: Array | None, second: Array | None) -> None:
    """Compute magnitudes at n equally spaced angles into size[1 ... n], closed periodically."""
    e, y0, ca, k0, k1, k2 = at[k + E], at[k + Y0], at[k + CA], at[k + K0], at[k + K1], at[k + K2]
    (cos, sin), begin = table, (n - FEWEST) & _NEVER_NEGATIVE
    for i in range(n):
        p, q, j, _ = follower(e, y0, ca, k0, k1, k2, cos[begin + i], sin[begin + i])
        size[1 + i] = abs(p) if first is not None else (abs(q) if second is not None else abs(j))
    size[0], size[n + 1] = size[n], size[1]


@inline
def sample_both(at: Array, k: int, table: CosSin, n: int, of_p: Array, of_q: Array) -> None:
    """As :func:`sample`, of the first and the second order at once."""
    e, y0, ca, k0, k1, k2 = at[k + E], at[k + Y0], at[k + CA], at[k + K0], at[k + K1], at[k + K2]
    (cos, sin), begin = table, (n - FEWEST) & _NEVER_NEGATIVE
    for i in range(n):
        p, q, _, _ = follower(e, y0, ca, k0, k1, k2, cos[begin + i], sin[begin + i])
        of_p[1 + i], of_q[1 + i] = abs(p), abs(q)
    of_p[0], of_p[n + 1], of_q[0], of_q[n + 1] = of_p[n], of_p[1], of_q[n], of_q[1]


@inline
def _row(size: Array, i: int) -> Array:
    """Row i of the samples of a block.

    The compiler sees that an index into a row is not negative; with a sum as index it would write numbers one by one.
    """
    return size[i * BLOCK : (i + 1) * BLOCK]


@inline
def sample_block(count: int, at: Array, table: CosSin, size: Array, first: Array | None, second: Array | None) -> None:
    """Sample all designs of a block at the FEWEST angles: angle i of design k stands at (i + 1) BLOCK + k."""
    for i in range(FEWEST):
        u, v, here = table[0][i], table[1][i], _row(size, 1 + i)
        for k in range(count):
            e, y0, ca, k0, k1, k2 = at[k + E], at[k + Y0], at[k + CA], at[k + K0], at[k + K1], at[k + K2]
            p, q, j, _ = follower(e, y0, ca, k0, k1, k2, u, v)
            here[k] = abs(p) if first is not None else (abs(q) if second is not None else abs(j))


@inline
def sample_block_both(count: int, at: Array, table: CosSin, of_p: Array, of_q: Array) -> None:
    """As :func:`sample_block`, of the first and the second order at once: little more costly than the second alone."""
    for i in range(FEWEST):
        u, v, here, there = table[0][i], table[1][i], _row(of_p, 1 + i), _row(of_q, 1 + i)
        for k in range(count):
            e, y0, ca, k0, k1, k2 = at[k + E], at[k + Y0], at[k + CA], at[k + K0], at[k + K1], at[k + K2]
            p, q, _, _ = follower(e, y0, ca, k0, k1, k2, u, v)
            here[k], there[k] = abs(p), abs(q)


@inline
def mark_peaks(count: int, size: Array, share: float) -> None:
    """Mark the local maxima among samples that reach ``share`` of the highest, as a sum of powers of two."""
    before, begin, end, after = _row(size, 0), _row(size, 1), _row(size, FEWEST), _row(size, FEWEST + 1)
    for k in range(count):
        before[k], after[k] = end[k], begin[k]
    floor, marks = _row(size, _FLOOR), _row(size, MARKS // BLOCK)
    for k in range(count):
        floor[k], marks[k] = 0.0, 0.0
    for i in range(1, FEWEST + 1):
        here = _row(size, i)
        for k in range(count):
            floor[k] = largest(floor[k], share * here[k])
    mark = 1.0
    for i in range(1, FEWEST + 1):
        before, here, after = _row(size, i - 1), _row(size, i), _row(size, i + 1)
        for k in range(count):
            y = here[k]
            peak = (y >= floor[k]) & (y > before[k]) & (y >= after[k])
            marks[k] += mark if peak else 0.0
        mark *= 2.0


@inline
def list_marked(marks: int, at: Array, k: int, table: CosSin, size: Array, of: Samples, m: Array, count: int) -> int:
    """Append the local maxima of design k that are bits of ``marks`` to the list; returns its new length.

    Bit i stands for sample ``begin`` + i.
    """
    while marks != 0:
        i = lowest_bit(marks) & 63
        angle = (of.n - FEWEST + of.begin + i) & _NEVER_NEGATIVE
        before = (of.first + i * of.stride) & _NEVER_NEGATIVE
        three = size[before], size[before + of.stride], size[before + 2 * of.stride]
        append(at, k, table[0][angle], table[1][angle], three, of.n, of.begin + i, m, count & _NEVER_NEGATIVE)
        count += 1
        marks &= marks - 1
    return count


@inline
def _marks(begin: int, width: int, floor: float, size: Array) -> int:
    """Local maxima of at least ``floor`` among ``width`` samples from ``begin`` on, as bits."""
    begin, marks = begin & _NEVER_NEGATIVE, 0
    for i in range(width):
        y = size[begin + i + 1]
        peak = (y >= floor) & (y > size[begin + i]) & (y >= size[begin + i + 2])
        marks |= (1 << i) if peak else 0
    return marks


@inline
def list_peaks(at: Array, k: int, table: CosSin, n: int, share: float, size: Array, m: Array, count: int) -> int:
    """Append the local maxima among samples by :func:`sample` that reach ``share`` of the highest; none if too many."""
    most = 0.0
    for i in range(n):
        most = largest(most, size[i])
    length, width = count, min(n, 64)
    for begin in range(0, n, width):
        marks = _marks(begin, width, share * most, size)
        length = list_marked(marks, at, k, table, size, Samples(begin, 1, n, begin), m, length)
        if length - count > MOST_PEAKS:
            return count
    return length
