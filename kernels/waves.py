"""Trigonometric sums along the turn, and their slopes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels._jit import kernel

Array = NDArray[np.float64]


@kernel
def trigonometric_sum(coefficients: Array, phi: Array, derivative: bool, out: Array) -> None:
    """Compute sums ``c_0 + sum over k of (c_(2k-1) cos k phi + c_2k sin k phi)``, or their derivatives by phi.

    Parameters
    ----------
    coefficients : (n, 2 K + 1)
    phi : (m,) angles in rad
    derivative : whether the derivative is wanted
    out : (n, m) out

    Notes
    -----
    Multiples of the angle by the addition theorem: K roundings for the last one, 1e-15 for sixteen of them.
    """
    n, harmonics = coefficients.shape[0], coefficients.shape[1] // 2
    for j in range(phi.shape[0]):
        c1, s1 = math.cos(phi[j]), math.sin(phi[j])
        for i in range(n):
            out[i, j] = 0.0 if derivative else coefficients[i, 0]
        c, s = 1.0, 0.0
        for k in range(1, harmonics + 1):
            c, s = c * c1 - s * s1, s * c1 + c * s1
            for i in range(n):
                if derivative:
                    out[i, j] += k * (coefficients[i, 2 * k] * c - coefficients[i, 2 * k - 1] * s)
                else:
                    out[i, j] += coefficients[i, 2 * k - 1] * c + coefficients[i, 2 * k] * s
