"""Extremes and mean square over a turn of periodic curves known on a uniform odd grid, from their Fourier series."""

from __future__ import annotations

import math

import numpy as np

from kernels.curves.periodic import coefficients, on_grid, series, significant, tail
from kernels.jit import inline, kernel
from kernels.types import Array

FINER = 8  # looks per harmonic before a peak is refined
BISECTIONS = 54


@kernel
def turn_extremes(
    values: Array, largest: Array, phi_largest: Array, least: Array, phi_least: Array, rms: Array, missed: Array
) -> None:
    """Compute extremes and root mean square of curves over one turn.

    Parameters
    ----------
    values : (n, N) samples at phi_j = 2 pi j / N, N odd
    largest, phi_largest, least, phi_least : (n,) out; extremes and their crank angles [rad]
    rms : (n,) out, by Parseval's sum
    missed : (n,) out; size of the two highest harmonics against the largest: what the grid may have missed
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
        phi_largest[i] = _peak(short_c, short_s, 1.0, look)
        phi_least[i] = _peak(short_c, short_s, -1.0, look)
        largest[i] = series(short_c, short_s, phi_largest[i])[0]
        least[i] = series(short_c, short_s, phi_least[i])[0]


@inline
def _peak(c: Array, s: Array, sign: float, look: Array) -> float:
    """Find the crank angle in [0, 2 pi) where sign times the series is largest: the best sample, then bisection."""
    step = 2.0 * math.pi / look.size
    best, where = -math.inf, 0.0
    for j in range(look.size):
        if sign * look[j] > best:
            best, where = sign * look[j], step * j
    low, high = where - step, where + step
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if sign * series(c, s, middle)[1] > 0.0:
            low = middle
        else:
            high = middle
    angle = 0.5 * (low + high)
    return angle + 2.0 * math.pi if angle < 0.0 else angle
