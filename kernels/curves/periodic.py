"""Periodic functions known on a uniform grid: Fourier coefficients, values and derivatives between the grid points.

The grid has an odd number of points, phi_j = 2 pi j / N, so the highest harmonic (N-1)/2 is represented by both its
cosine and its sine and differentiation is exact for every trigonometric polynomial the grid can carry.
"""

from __future__ import annotations

import math

from kernels.jit import inline, kernel
from kernels.types import Array

NOTHING = 1e-14  # share of the largest coefficient that the rotations' drift leaves in the others


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
def series(cosines: Array, sines: Array, phi: float) -> tuple[float, float]:
    """Evaluate the series with these coefficients, and its derivative, at any angle phi [rad]."""
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
def significant(cosines: Array, sines: Array) -> int:
    """Count the coefficients worth keeping: all behind them are rounding, below 1e-14 of the largest one."""
    largest = 0.0
    for k in range(cosines.size):
        largest = max(largest, math.hypot(cosines[k], sines[k]))
    count = cosines.size
    while count > 1 and math.hypot(cosines[count - 1], sines[count - 1]) <= NOTHING * largest:
        count -= 1
    return count


@inline
def tail(cosines: Array, sines: Array, size: float) -> float:
    """Estimate what the grid misses: the two highest harmonics, divided by the largest one or by ``size`` if larger."""
    largest = size
    for k in range(cosines.size):
        largest = max(largest, math.hypot(cosines[k], sines[k]))
    last = cosines.size - 1
    # Two harmonics are looked at, because a function with symmetry has zeros in every other one.
    highest = math.hypot(cosines[last], sines[last]) + math.hypot(cosines[last - 1], sines[last - 1])
    return highest / largest if largest > 0.0 else 0.0
