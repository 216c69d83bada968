"""Refinement of the list of local maxima: all maxima of a block of designs, side by side.

As in :mod:`kernels.families.rssr.sampling`: Newton steps on the next derivative, and the conditions under which a
refined maximum is trusted (docs/internals/extrema.md).  A minimum, or a negative peak of a magnitude, is a maximum of
the curve times a sign.
"""

from __future__ import annotations

import math
from typing import Any

from kernels.arithmetic.intrinsics import largest
from kernels.arithmetic.vectors import Vector
from kernels.chains.curves import Curve
from kernels.chains.form import STRIDE, Helper
from kernels.curves.polynomials import rotate
from kernels.jit import generated_part, inline
from kernels.types import EPS, Array

MOST_PEAKS = 16  # of one design; a design with more is left to the slower search
CAPACITY = STRIDE - 8  # a list is padded to whole vectors
# Bitwise "and" with this leaves a place unchanged and shows the compiler that it is not negative.  Otherwise every
# index would be tested whether it counts from the end.
PLACE = 1023
# Rows of a maximum: coefficients of the curve, place and spacing of its samples, three samples times the sign, results.
(
    A, B, C, U, V, WIDTH, START, _LEFT, _PEAK, _RIGHT, _SIGN, SCALE, _GUESS, MOVED, LAST, HEIGHT, ERROR, ROUNDING,
    REACH,
) = (k * STRIDE for k in range(19))  # fmt: skip
CONSTANTS = 19 * STRIDE  # begin of the constants of the design
_NEAREST, _NEXT = 0.6, 0.2  # least fall to the sample beside the top and to the next ones, against the parabola's
_LEVEL = 1e-10  # a fall by less than this share of the curve's size counts as none
_MOVED = 0.05  # share of the size by which refinement may lift a peak above the parabola through its samples


@inline
def append(
    m: Array, i: int, u: float, v: float, width: float, start: float, samples: Vector, sign: float, scale: float
) -> None:
    """Put a local maximum at place i of the list: its angle, and the three samples around it, times the sign."""
    m[i + U], m[i + V], m[i + WIDTH], m[i + START] = u, v, width, start
    m[i + _LEFT], m[i + _PEAK], m[i + _RIGHT] = samples
    m[i + _SIGN], m[i + SCALE] = sign, scale


@inline
def begin_at_vertex(count: int, m: Array) -> None:
    """Move each maximum to the vertex of the parabola through its three samples."""
    for i in range(count):
        left, right = m[i + _PEAK] - m[i + _LEFT], m[i + _PEAK] - m[i + _RIGHT]
        offset = 0.5 * (left - right) / (left + right)
        m[i + _GUESS] = m[i + _PEAK] + 0.25 * offset * (left - right)
        u, v = rotate(m[i + U], m[i + V], offset * m[i + WIDTH])
        m[i + U] = u
        m[i + V] = v
        m[i + MOVED] = offset * m[i + WIDTH]


def refiner(curve: Curve, get: Helper) -> Helper:
    """Make the part ``refine(count, m, rounds)``: Newton steps, or steps uphill where the curve is not concave."""
    jet = curve.jet

    def refine(count: int, m: Array, rounds: int) -> None:
        for _ in range(rounds):
            for i in range(count):
                _, dy, d2y = jet(get(m, i + CONSTANTS), m[i + A], m[i + B], m[i + C], m[i + U], m[i + V])
                sign, width = m[i + _SIGN], m[i + WIDTH]
                step = -dy / d2y if sign * d2y < 0.0 else math.copysign(width, sign * dy)
                step = min(max(step, -0.5 * width), 0.5 * width)
                m[i + MOVED] += step
                u, v = rotate(m[i + U], m[i + V], step)
                m[i + U] = u
                m[i + V] = v

    return generated_part(f"refine_{curve.alone.name}", refine)


def finisher(curve: Curve, get: Helper) -> Helper:
    """Make the part ``finish(count, m, target)``: heights, remaining steps to the tops, and rounding errors.

    A height is that of the parabola through the last point.  Its error is infinite where the maximum is not trusted:
    where it left its samples, rose too far above them, or does not fall towards them as a single top would.
    """
    jet, rounding = curve.jet, curve.rounding

    def finish(count: int, m: Array, target: float) -> None:
        for i in range(count):
            k: Any = get(m, i + CONSTANTS)
            y, dy, d2y = jet(k, m[i + A], m[i + B], m[i + C], m[i + U], m[i + V])
            sign, width, moved, scale = m[i + _SIGN], m[i + WIDTH], m[i + MOVED], m[i + SCALE]
            step = -dy / d2y
            rise = 0.5 * sign * dy * step
            peak, bend, level = sign * y + rise, 0.5 * abs(d2y), _LEVEL * scale
            before, after = width + moved, width - moved
            trusted = (sign * d2y < 0.0) & (rise <= 0.25 * target * scale) & (abs(moved) <= width)
            trusted = trusted & (abs(peak - m[i + _GUESS]) <= _MOVED * scale)
            trusted = trusted & (peak - m[i + _PEAK] >= _NEAREST * bend * moved * moved - level)
            trusted = trusted & (peak - m[i + _LEFT] >= _NEXT * bend * before * before - level)
            trusted = trusted & (peak - m[i + _RIGHT] >= _NEXT * bend * after * after - level)
            blur = rounding(k, m[i + A], m[i + B], m[i + U], m[i + V]) + 8.0 * EPS * abs(peak)
            m[i + HEIGHT], m[i + LAST], m[i + ROUNDING] = peak, step, blur
            m[i + ERROR] = rise if trusted else math.inf
            # Within this width of the top the curve falls by less than its rounding, so the place is not known better.
            m[i + REACH] = 4.0 * abs(step) + 2.0 * math.sqrt(blur / largest(bend, 1e-300))

    return generated_part(f"finish_{curve.alone.name}", finish)
