"""Periodic functions known on a uniform grid: Fourier coefficients, values and derivatives between the grid points.

The grid has an odd number of points, phi_j = 2 pi j / N, so the highest harmonic (N-1)/2 is represented by both its
cosine and its sine and differentiation is exact for every trigonometric polynomial the grid can carry.  From the
series follow the extremes and the mean square over a turn.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.curves.root_search import bisected, false_position
from kernels.jit import inline, kernel, part
from kernels.types import EPS, TWO_PI, Array, Numbers

NOTHING = 1e-14  # error of the coefficients by the drift of the rotations, as a share of the largest coefficient


@kernel
def coefficients(values: Array, turn: Array, cosines: Array, sines: Array) -> None:
    """Compute the Fourier coefficients of N = 2 K + 1 samples of one period.

    Parameters
    ----------
    values : (N,) samples at 2 pi j/N
    turn : (4, K + 1) scratch: cosine and sine of each harmonic at the current sample, and of its step to the next
    cosines, sines : (K + 1,) out; the mean in cosines[0], harmonic k in cosines[k] and sines[k]

    Notes
    -----
    The harmonics are advanced by rotations instead of library calls, all of them side by side, so that the loop
    vectorises.  The rotations drift by 1e-14 at most for N < 1000.
    """
    n, half = values.size, cosines.size
    for k in range(half):
        angle = 2.0 * math.pi * k / n
        turn[0, k], turn[1, k], turn[2, k], turn[3, k] = 1.0, 0.0, math.cos(angle), math.sin(angle)
        cosines[k], sines[k] = 0.0, 0.0
    for j in range(n):
        value = 2.0 / n * values[j]
        for k in range(half):
            c, s = turn[0, k], turn[1, k]
            cosines[k] += value * c
            sines[k] += value * s
            turn[0, k], turn[1, k] = c * turn[2, k] - s * turn[3, k], s * turn[2, k] + c * turn[3, k]
    # the mean has half the factor of the harmonics
    cosines[0] *= 0.5


@kernel
def on_grid(cosines: Array, sines: Array, turn: Array, values: Array) -> None:
    """Evaluate a Fourier series at M equidistant angles 2 pi j/M.

    Parameters
    ----------
    cosines, sines : (K + 1,) of :func:`coefficients`
    turn : (4, M) scratch for the rotations, as there
    values : (M,) out
    """
    for j in range(values.size):
        angle = 2.0 * math.pi * j / values.size
        turn[2, j], turn[3, j] = math.cos(angle), math.sin(angle)
        turn[0, j], turn[1, j], values[j] = turn[2, j], turn[3, j], cosines[0]
    for k in range(1, cosines.size):
        for j in range(values.size):
            c, s = turn[0, j], turn[1, j]
            values[j] += cosines[k] * c + sines[k] * s
            turn[0, j], turn[1, j] = c * turn[2, j] - s * turn[3, j], s * turn[2, j] + c * turn[3, j]


@inline
def series_at(cosines: Array, sines: Array, phi: Array, turn: Array, values: Array, slopes: Array) -> None:
    """Evaluate a Fourier series and its derivative at M crank angles [rad]; ``turn`` as for :func:`on_grid`.

    The sums are those of :func:`series`; with all angles side by side the loop vectorises.
    """
    for j in range(values.size):
        turn[2, j], turn[3, j] = math.cos(phi[j]), math.sin(phi[j])
        turn[0, j], turn[1, j], values[j], slopes[j] = turn[2, j], turn[3, j], cosines[0], 0.0
    for k in range(1, cosines.size):
        for j in range(values.size):
            c, s = turn[0, j], turn[1, j]
            values[j] += cosines[k] * c + sines[k] * s
            slopes[j] += k * (sines[k] * c - cosines[k] * s)
            turn[0, j], turn[1, j] = c * turn[2, j] - s * turn[3, j], s * turn[2, j] + c * turn[3, j]


@inline
def series(cosines: Array, sines: Array, phi: float) -> tuple[float, float]:
    """Evaluate a Fourier series and its derivative at any angle phi [rad]."""
    value, slope = cosines[0], 0.0
    step_c, step_s = math.cos(phi), math.sin(phi)
    # cos k phi and sin k phi come by rotation, so that one cosine and one sine serve all harmonics
    c, s = step_c, step_s
    for k in range(1, cosines.size):
        value += cosines[k] * c + sines[k] * s
        slope += k * (sines[k] * c - cosines[k] * s)
        c, s = c * step_c - s * step_s, s * step_c + c * step_s
    return value, slope


@inline
def harmonics(waves: Numbers, count: int, u: Any, v: Any) -> tuple[Any, Any, Any, Any]:
    """Sum of a_k cos(k phi) + b_k sin(k phi), and three derivatives, for u = cos(phi), v = sin(phi).

    ``waves`` begins with a_1 ... a_count, b_1 ... b_count.  All may be complex, for the complex step.
    """
    zero = 0.0 * (waves[0] + u)
    value, first, second, third = zero, zero, zero, zero
    c, s = u, v
    for k in range(count):
        a, b, order = waves[k], waves[count + k], k + 1.0
        even, odd = a * c + b * s, b * c - a * s
        value, first = value + even, first + order * odd
        second, third = second - order * order * even, third - order * order * order * odd
        c, s = c * u - s * v, s * u + c * v
    return value, first, second, third


@inline
def significant(cosines: Array, sines: Array, nothing: float = NOTHING) -> int:
    """Count the leading coefficients to keep: all behind them are rounding, below a share of the largest one."""
    largest = 0.0
    for k in range(cosines.size):
        largest = max(largest, math.hypot(cosines[k], sines[k]))
    count = cosines.size
    while count > 1 and math.hypot(cosines[count - 1], sines[count - 1]) <= nothing * largest:
        count -= 1
    return count


@inline
def tail(cosines: Array, sines: Array, size: float) -> float:
    """Estimate what the grid misses: its two highest harmonics over the largest one, or over ``size`` if larger."""
    largest = size
    for k in range(cosines.size):
        largest = max(largest, math.hypot(cosines[k], sines[k]))
    last = cosines.size - 1
    # Two harmonics are looked at, because a function with symmetry has zeros in every other one.
    highest = math.hypot(cosines[last], sines[last]) + math.hypot(cosines[last - 1], sines[last - 1])
    return highest / largest if largest > 0.0 else 0.0


FINER = 8  # samples per harmonic before a peak is refined
LEVEL = 16.0 * EPS  # of the size: differences that are rounding


@kernel
def turn_extremes(
    values: Array, known: Array, largest: Array, phi_largest: Array, least: Array, phi_least: Array, rms: Array,
    missed: Array,
) -> None:  # fmt: skip
    """Compute extremes and root mean square of curves over one turn.

    Parameters
    ----------
    values : (n, N) samples at phi_j = 2 pi j / N, N odd
    known : (n,) relative errors of the samples
    largest, least : (n,) out; extremes
    phi_largest, phi_least : (n,) out; their crank angles [rad], of tops equal within their errors the first's
    rms : (n,) out, by Parseval's sum
    missed : (n,) out; size of the two highest harmonics over the largest, an estimate of what the grid has missed
    """
    n = values.shape[1]
    half = (n + 1) // 2
    c, s, turn = np.empty(half), np.empty(half), np.empty((4, half))
    for i in range(values.shape[0]):
        coefficients(values[i], turn, c, s)
        square = c[0] * c[0]
        for k in range(1, half):
            square += 0.5 * (c[k] * c[k] + s[k] * s[k])
        rms[i] = math.sqrt(square)
        missed[i] = tail(c, s, 0.0)
        count = significant(c, s)
        short_c, short_s = c[:count], s[:count]
        look, room = np.empty(FINER * count), np.empty((4, FINER * count))
        on_grid(short_c, short_s, room, look)
        err = known[i] + missed[i]
        largest[i], phi_largest[i] = _peak(short_c, short_s, 1.0, look, err)
        least[i], phi_least[i] = _peak(short_c, short_s, -1.0, look, err)


@inline
def _series_at(phi: float, c: Array, s: Array) -> tuple[float, float]:
    return series(c, s, phi)


@inline
def height_bound(before: float, here: float, after: float) -> float:
    """Height that a top at a sample hardly exceeds: by twice the parabola's rise and a fourth of the falls beside it.

    That is an estimate: a few of ten thousand tops of random series rise a little higher.
    """
    fall = 2.0 * here - before - after
    return here + 0.25 * ((after - before) * (after - before) / fall + fall) if fall > 0.0 else here


@inline
def _slope_at(phi: float, sign: float, curve: Callable[..., tuple[float, float]], data: Any) -> float:
    return sign * curve(phi, *data)[1]


@inline
def _rises(phi: float, sign: float, curve: Callable[..., tuple[float, float]], data: Any) -> bool:
    return sign * curve(phi, *data)[1] > 0.0


@inline
def top_at(
    curve: Callable[..., tuple[float, float]], sign: float, samples: Array, j: int, least: float, data: Any
) -> tuple[float, float]:
    """Find crank angle and height of the top at sample j of a turn; -inf if there is none above ``least``.

    The samples are those of sign times the curve, of which ``curve(phi, *data)`` gives value and slope.  It is folded
    in: numba keeps no machine code of a kernel that hands a function on to another one.
    """
    n = samples.size
    before, here, after = samples[j - 1], samples[j], samples[(j + 1) % n]
    angle, height = 0.0, -math.inf
    if here >= before and here >= after and height_bound(before, here, after) > least:
        step = TWO_PI / n
        low, high = step * (j - 1), step * (j + 1)
        at_low, at_high = _slope_at(low, sign, curve, data), _slope_at(high, sign, curve, data)
        if at_low > 0.0 > at_high:
            angle = false_position(_slope_at, low, high, at_low, at_high, sign, curve, data)
        else:
            angle = bisected(_rises, low, high, sign, curve, data)[0]
        height = sign * curve(angle, *data)[0]
    return angle, height


@inline
def highest_top(
    curve: Callable[..., tuple[float, float]], sign: float, samples: Array, level: float, data: Any
) -> tuple[float, float, int]:
    """Find crank angle and height of the highest top, and the sample at it; arguments as of :func:`top_at`.

    The top at the highest sample counts unless another exceeds it by more than ``level``, the rounding.
    """
    best = int(np.argmax(samples))
    where, highest = top_at(curve, sign, samples, best, -math.inf, data)
    first = best
    for j in range(samples.size):
        if j != first:
            angle, height = top_at(curve, sign, samples, j, highest + level, data)
            if height > highest:
                highest, where, best = height, angle, j
    return where, highest, best


@part
def _peak(c: Array, s: Array, sign: float, look: Array, err: float) -> tuple[float, float]:
    """Find the value farthest in the sense of ``sign``, and its crank angle in [0, 2 pi], from equidistant samples.

    Of tops that differ by less than twice their error, a share ``err`` of the size, the first of the turn counts.
    """
    samples, size = sign * look, float(np.abs(look).max())
    # a level curve has rounding tops alone
    where, highest, best = highest_top(_series_at, sign, samples, LEVEL * size, (c, s))
    # A place closer to the end of the turn than its error counts as just after its beginning.
    early, least = -math.sqrt(err), highest - 2.0 * err * size
    for j in range(best if where >= early else look.size):
        angle, height = top_at(_series_at, sign, samples, j, least, (c, s))
        if height >= least and angle >= early:
            where = angle
            break
    return sign * highest, where + TWO_PI if where < 0.0 else where


STEPS, STILL = 6, 1e-6  # most steps to a top; a step shorter than STILL [rad] leaves an error far below rounding


@kernel
def climb(
    series: NDArray[np.complex128],
    row: NDArray[np.int64],
    mode: int,
    spacing: float,
    phi: Array,
    height: Array,
    bend: Array,
    still: NDArray[np.bool_],
) -> None:
    """Climb from places near the tops of Fourier series to the tops, by Newton's steps.

    Parameters
    ----------
    series : (n, q, K + 1) complex coefficients of 2 K samples of q curves
    row : (k,) number of the design, one of the n
    mode : +1 for the curve, -1 for its negative, 0 for the sum of squares of the q curves
    spacing : longest step [rad]
    phi : (k,) in and out, places [rad]
    height, bend : (k,) out; the climbed curve at the place, and its second derivative
    still : (k,) out; whether the last step was short enough
    """
    for i in range(row.size):
        still[i] = False
        for _ in range(STEPS):
            value, slope, second = _slopes(series[row[i]], phi[i], mode)
            step = -slope / second if second < 0.0 else math.copysign(0.5 * spacing, slope)
            step = min(max(step, -spacing), spacing)
            phi[i] += step
            height[i], bend[i] = value + step * (slope + 0.5 * second * step), second
            still[i] = second < 0.0 and abs(step) < STILL
            if still[i]:
                break


@inline
def _slopes(series: NDArray[np.complex128], phi: float, mode: int) -> tuple[float, float, float]:
    """Value and first two derivatives of the climbed curve at one angle, from the series (q, K + 1)."""
    height, rising, bend, last = 0.0, 0.0, 0.0, series.shape[1] - 1
    turn = complex(math.cos(phi), math.sin(phi))
    for curve in range(series.shape[0]):
        waves, first, second = 0j, 0j, 0j
        for order in range(last, 0, -1):  # the small ones first
            # the highest order of an even number of samples has no conjugate partner
            term = (2.0 if order < last else 1.0) * series[curve, order]
            waves = (waves + term) * turn
            first = (first + order * term) * turn
            second = (second + order * order * term) * turn
        value, slope, bent = series[curve, 0].real + waves.real, -first.imag, -second.real
        if mode != 0:
            return mode * value, mode * slope, mode * bent
        height += value * value
        rising += 2.0 * value * slope
        bend += 2.0 * (slope * slope + value * bent)
    return height, rising, bend
