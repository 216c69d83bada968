"""The thread from a fixed guide over one moving point to a second fixed guide: its length and its wrap angle.

The equation numbers are those of docs/takeup.md.  With d_i = E - N_i, r_i = |d_i|,

    L = r1 + r2,   L' = sum d_i . E' / r_i,   L'' = sum (d_i . E'' + |d_i x E'|^2 / r_i^2) / r_i               (2)-(4)

The squares in L'' are not differences, so no digits are lost.  Coordinates may be complex128 (gradients by the complex
step).
"""

from __future__ import annotations

import numpy as np

from kernels.arithmetic.complex_step import arctan2, divisor
from kernels.arithmetic.vectors import Vector, cross, dot, sub
from kernels.jit import inline


@inline
def length(e: Vector, n1: Vector, n2: Vector) -> float:
    """Length of the thread N1, E, N2; (2)."""
    d1, d2 = sub(e, n1), sub(e, n2)
    return np.sqrt(dot(d1, d1)) + np.sqrt(dot(d2, d2))  # type: ignore[no-any-return]


@inline
def slope(e: Vector, n1: Vector, n2: Vector, de: Vector) -> float:
    """First derivative of the length where E has the derivative ``de``; (3)."""
    d1, d2 = sub(e, n1), sub(e, n2)
    return dot(d1, de) / divisor(np.sqrt(dot(d1, d1))) + dot(d2, de) / divisor(np.sqrt(dot(d2, d2)))  # type: ignore[no-any-return]


@inline
def bend(e: Vector, n1: Vector, n2: Vector, de: Vector, d2e: Vector) -> float:
    """Second derivative of the length; (4)."""
    return _bend(sub(e, n1), de, d2e) + _bend(sub(e, n2), de, d2e)


@inline
def _bend(d: Vector, de: Vector, d2e: Vector) -> float:
    square, across = dot(d, d), cross(d, de)
    return (dot(d, d2e) + dot(across, across) / divisor(square)) / divisor(np.sqrt(square))  # type: ignore[no-any-return]


@inline
def wrap_angle(e: Vector, n1: Vector, n2: Vector) -> float:
    """Angle [rad] by which the thread turns at E: atan2(|d1 x d2|, -d1 . d2), exact near 0 and near pi; (1)."""
    d1, d2 = sub(e, n1), sub(n2, e)
    across = cross(d1, d2)
    square = dot(across, across)
    # The root of zero has no derivative: a straight thread keeps a zero imaginary part.
    sine = np.sqrt(square) if square.real > 0.0 else 0.0 * square
    return arctan2(sine, dot(d1, d2))  # type: ignore[no-any-return]
