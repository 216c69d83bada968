"""Periodic functions known on a uniform grid: Fourier coefficients, values and derivatives between the grid points.

The grid has an odd number of points, phi_j = 2 pi j / N, so the highest harmonic (N-1)/2 is represented by both its
cosine and its sine and differentiation is exact for every trigonometric polynomial the grid can carry.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels._jit import inline

Array = NDArray[np.float64]

NOTHING = 1e-14


@inline
def coefficients(values: Array, cosines: Array, sines: Array) -> None:
    """Fourier coefficients of N = 2 K + 1 samples: mean in cosines[0], harmonics 1..K in cosines[k], sines[k]."""
    n = values.size
    for k in range((n + 1) // 2):
        # Rotation by exact table angles would be cheaper; the recurrence below drifts by 1e-14 at most for N < 1000.
        c, s, total_c, total_s = 1.0, 0.0, 0.0, 0.0
        step_c, step_s = math.cos(2.0 * math.pi * k / n), math.sin(2.0 * math.pi * k / n)
        for j in range(n):
            total_c += values[j] * c
            total_s += values[j] * s
            c, s = c * step_c - s * step_s, s * step_c + c * step_s
        factor = (1.0 if k == 0 else 2.0) / n
        cosines[k], sines[k] = factor * total_c, factor * total_s


@inline
def series(cosines: Array, sines: Array, phi: float) -> tuple[float, float]:
    """Value and derivative at any angle of the function with these coefficients."""
    value, slope = cosines[0], 0.0
    step_c, step_s = math.cos(phi), math.sin(phi)
    c, s = step_c, step_s
    for k in range(1, cosines.size):
        value += cosines[k] * c + sines[k] * s
        slope += k * (sines[k] * c - cosines[k] * s)
        c, s = c * step_c - s * step_s, s * step_c + c * step_s
    return value, slope


@inline
def significant(cosines: Array, sines: Array) -> int:
    """Number of leading coefficients beyond which there is only rounding (1e-14 of the largest), which costs time."""
    largest = 0.0
    for k in range(cosines.size):
        largest = max(largest, math.hypot(cosines[k], sines[k]))
    count = cosines.size
    while count > 1 and math.hypot(cosines[count - 1], sines[count - 1]) <= NOTHING * largest:
        count -= 1
    return count


@inline
def tail(cosines: Array, sines: Array, size: float) -> float:
    """Size of the two highest harmonics in proportion to the largest or to ``size``: what the grid may miss."""
    largest = size
    for k in range(cosines.size):
        largest = max(largest, math.hypot(cosines[k], sines[k]))
    last = cosines.size - 1
    highest = math.hypot(cosines[last], sines[last]) + math.hypot(cosines[last - 1], sines[last - 1])
    return highest / largest if largest > 0.0 else 0.0
