"""The list of local maxima under refinement: all those of a block of designs, side by side.

Newton steps on the next derivative, and what a refined maximum must keep to be trusted (docs/rssr.md, section 6).
"""

from __future__ import annotations

import math

import numpy as np

from kernels.arithmetic.max_min import largest
from kernels.curves.trigonometric_polynomials import rotate
from kernels.families.rssr.block import BLOCK, CA, K0, K1, K2, W_SIZE, Y0, E
from kernels.families.rssr.careful import rounding
from kernels.families.rssr.closure import Array
from kernels.families.rssr.derivatives import follower
from kernels.jit import inline, kernel
from kernels.types import TWO_PI

MOST_PEAKS = 8  # 16 samples cannot have more; a design with more goes to the careful search
# Rows 960 bytes apart modulo 4096, so that they do not evict each other from the cache.
CAPACITY = BLOCK * MOST_PEAKS + 120
# Constants of the design; place and spacing of the samples; three samples; results.
(
    _E, _Y0, _CA, _K0, _K1, _K2, _SIZE, _U, _V, START, _WIDTH, _LEFT, _PEAK, _RIGHT,
    _GUESS, MOVED, LAST, HEIGHT, ERROR, ROUNDING, REACH,
) = (k * CAPACITY for k in range(21))  # fmt: skip
_ROWS = 21
_TURNED = 4e-12  # error of an angle that is the sum of a few turns by :func:`rotate`
# From a maximum to the samples beside it the function falls about as far as the parabola that touches it at the top.
# If it falls by less than this share of the parabola, there may be a second maximum between the samples.
_NEAREST, _NEXT = 0.6, 0.2  # for the sample it was found by and the two beside that
_LEVEL = 1e-10  # a fall by less than this share of the height counts as none


@inline
def new_list() -> Array:
    """Return room for the maxima of a block."""
    return np.empty(_ROWS * CAPACITY)


@inline
def append(
    at: Array, k: int, u: float, v: float, left: float, peak: float, right: float, n: int, sample: int, m: Array, i: int
) -> None:
    """Put a local maximum of design k of a block at place i: sample number ``sample`` of n and the two beside it."""
    width = TWO_PI / n
    m[i + _U], m[i + _V], m[i + START], m[i + _WIDTH] = u, v, sample * width, width
    m[i + _LEFT], m[i + _PEAK], m[i + _RIGHT] = left, peak, right
    m[i + _E], m[i + _Y0], m[i + _CA] = at[k + E], at[k + Y0], at[k + CA]
    m[i + _K0], m[i + _K1], m[i + _K2], m[i + _SIZE] = at[k + K0], at[k + K1], at[k + K2], at[k + W_SIZE]


@inline
def _jet(m: Array, i: int, first: Array | None, second: Array | None) -> tuple[float, float, float]:
    """Return the wanted transfer function and its next two derivatives at a maximum of the list."""
    e, y0, ca, k0, k1, k2 = m[i + _E], m[i + _Y0], m[i + _CA], m[i + _K0], m[i + _K1], m[i + _K2]
    u, v = m[i + _U], m[i + _V]
    p, q, j, k = follower(e, y0, ca, k0, k1, k2, u, v)
    if first is not None:
        return p, q, j
    if second is not None:
        return q, j, k
    # The fifth derivative only steers the iteration: a difference quotient of the fourth is enough.
    ahead = 1e-4 * m[i + _WIDTH]
    u, v = rotate(u, v, ahead)
    _, _, _, k_ahead = follower(e, y0, ca, k0, k1, k2, u, v)
    return j, k, (k_ahead - k) / ahead


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
def refine(begin: int, end: int, m: Array, rounds: int, first: Array | None, second: Array | None) -> None:
    """Take Newton steps to the zero of the next derivative, uphill where it is not concave; all maxima side by side."""
    for _ in range(rounds):
        for i in range(begin, end):
            y, dy, d2y = _jet(m, i, first, second)
            width = m[i + _WIDTH]
            step = -dy / d2y if y * d2y < 0.0 else math.copysign(width, y * dy)
            step = min(max(step, -0.5 * width), 0.5 * width)
            m[i + MOVED] += step
            m[i + LAST] = step
            u, v = rotate(m[i + _U], m[i + _V], step)
            m[i + _U] = u
            m[i + _V] = v


@inline
def finish(
    begin: int, end: int, m: Array, order: int, target: float, first: Array | None, second: Array | None,
    error: Array | None, phi_error: Array | None,
) -> None:  # fmt: skip
    """Compute the peak of the parabola through the last point, what it adds as an error estimate,
    and, where an estimate is wanted, the rounding error and that of the place.
    """
    for i in range(begin, end):
        y, dy, d2y = _jet(m, i, first, second)
        step = -dy / d2y
        rise = 0.5 * dy * step * math.copysign(1.0, y)
        peak, width = abs(y) + rise, m[i + _WIDTH]
        trusted = (y * d2y < 0.0) & (rise <= target * peak) & (abs(m[i + MOVED]) <= width)
        trusted = trusted & (abs(peak - m[i + _GUESS]) <= 0.2 * peak)
        moved, bend = m[i + MOVED], 0.5 * abs(d2y)
        before, after = width + moved, width - moved
        trusted = trusted & (peak - m[i + _PEAK] >= _NEAREST * bend * moved * moved - _LEVEL * peak)
        trusted = trusted & (peak - m[i + _LEFT] >= _NEXT * bend * before * before)
        trusted = trusted & (peak - m[i + _RIGHT] >= _NEXT * bend * after * after)
        m[i + ERROR] = rise if trusted else math.inf
        if error is not None or phi_error is not None:
            _estimate(m, i, order, peak, step, math.sqrt(abs(y / d2y)))
        m[i + HEIGHT], m[i + LAST] = peak, step


@inline
def _estimate(m: Array, i: int, order: int, peak: float, step: float, across: float) -> None:
    """Write the relative rounding error of a peak and the error of its place; ``across`` is its width."""
    e, y0, ca, k0, k1, k2 = m[i + _E], m[i + _Y0], m[i + _CA], m[i + _K0], m[i + _K1], m[i + _K2]
    relative, slope = rounding(order, e, y0, ca, k0, k1, k2, m[i + _SIZE], m[i + _U], m[i + _V], peak)
    # What a step of Newton's method leaves is quadratic, the step before shows how much; that of the jerk has a slope
    # good to a thousandth.
    last = m[i + LAST]
    left = 4.0 * largest(abs(step) / m[i + _WIDTH], step * step / (last * last + 1e-300))
    left += 1e-3 if order == 3 else 0.0
    m[i + ROUNDING] = relative
    m[i + REACH] = left * abs(step) + 4.0 * across * (relative + across * slope) + _TURNED


@kernel
def settle(
    begin: int, end: int, m: Array, order: int, target: float, first: Array | None, second: Array | None,
    error: Array | None, phi_error: Array | None,
) -> float:  # fmt: skip
    """Take more steps for the maxima not trusted yet;
    return the largest error estimate of all, infinite if one still is not.
    """
    worst = 0.0
    for i in range(begin, end):
        if not m[i + ERROR] < math.inf:
            refine(i, i + 1, m, 3, first, second)
            finish(i, i + 1, m, order, target, first, second, error, phi_error)
        worst = max(worst, m[i + ERROR])
    return worst
