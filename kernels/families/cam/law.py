"""Laws of motion of a follower: rise, dwell, return, dwell by a curve, or a Fourier table; docs/cam.md (1)-(5).

Designs and angles may be complex128 (exact gradients by the complex step); decisions look at the real part.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels.jit import inline
from kernels.types import TWO_PI, Numbers

POLYNOMIAL_345, MODIFIED_SINE, CYCLOIDAL, FOURIER = 1, 2, 3, 4
HARMONICS = 6
COEFFICIENTS = 2 * HARMONICS
# Columns of the design matrix that every cam begins with; the Fourier coefficients end it.
LIFT, RISE, DWELL, FALL, START, LAW = range(6)
_SUM = 4.0 + math.pi


class Motion(NamedTuple):
    """The law's value, 0 at rest and 1 at full lift, and its derivatives with respect to the cam angle."""

    y: Any
    d1: Any
    d2: Any
    d3: Any


@inline
def _polynomial(x: Any) -> Motion:
    rest = 1.0 - x
    return Motion(
        x * x * x * (10.0 - x * (15.0 - 6.0 * x)),
        30.0 * (x * rest) * (x * rest),
        60.0 * x * rest * (1.0 - 2.0 * x),
        60.0 * (1.0 - 6.0 * x * rest),
    )


@inline
def _cycloidal(x: Any) -> Motion:
    turn = TWO_PI * x
    s, half = np.sin(turn), np.sin(0.5 * turn)
    return Motion(x - s / TWO_PI, 2.0 * half * half, TWO_PI * s, TWO_PI * TWO_PI * np.cos(turn))


@inline
def _modified_sine(x: Any) -> Motion:
    """Evaluate Neklutin's rise: a sine of short period over an eighth at each end, one of long period between."""
    ends = x.real < 0.125 or x.real > 0.875
    turn = 4.0 * math.pi * x if ends else (4.0 * math.pi * x + math.pi) / 3.0
    s, c = np.sin(turn), np.cos(turn)
    shift = 0.0 if x.real < 0.125 else (4.0 if x.real > 0.875 else 2.0)
    wave, rate = (0.25, 1.0) if ends else (2.25, 1.0 / 3.0)
    bend = 4.0 * math.pi * math.pi / _SUM
    return Motion(
        (shift + math.pi * x - wave * s) / _SUM,
        math.pi * (1.0 - 4.0 * wave * rate * c) / _SUM,
        bend * s,
        4.0 * math.pi * rate * bend * c,
    )


@inline
def normalised(law: int, x: Any) -> Motion:
    """Curve of a rise at x in [0, 1], and its derivatives with respect to x; (2)-(4)."""
    if law == POLYNOMIAL_345:
        return _polynomial(x)
    if law == MODIFIED_SINE:
        return _modified_sine(x)
    return _cycloidal(x)


@inline
def fourier(designs: Numbers, i: int, first: int, phi: Any) -> Motion:
    """Sum of c_k cos(k phi) + s_k sin(k phi), and its derivatives; (5)."""
    u, v = np.cos(phi), np.sin(phi)
    c, s = u, v
    y, d1, d2, d3 = 0.0 * phi, 0.0 * phi, 0.0 * phi, 0.0 * phi
    for k in range(HARMONICS):
        a, b = designs[i, first + k], designs[i, first + HARMONICS + k]
        n = k + 1.0
        even, odd = a * c + b * s, b * c - a * s
        y, d1, d2, d3 = y + even, d1 + n * odd, d2 - n * n * even, d3 - n * n * n * odd
        c, s = c * u - s * v, c * v + s * u
    return Motion(y, d1, d2, d3)


@inline
def law_is_valid(designs: Numbers, i: int, first: int) -> bool:
    """Whether the columns of the law mean something: a whole law, phases within a turn, numbers."""
    law, rise, dwell, fall = (
        designs[i, LAW].real, designs[i, RISE].real, designs[i, DWELL].real, designs[i, FALL].real,
    )  # fmt: skip
    total = 0.0
    for k in range(COEFFICIENTS):
        total += abs(designs[i, first + k].real)
    known = law == 1.0 or law == 2.0 or law == 3.0 or law == 4.0
    phases = rise > 1e-6 and fall > 1e-6 and dwell >= 0.0 and rise + dwell + fall <= TWO_PI * (1.0 + 1e-14)
    return known and phases and total < 1e140 and abs(designs[i, START].real) < 1e5


@inline
def motion(designs: Numbers, i: int, first: int, phi: Any) -> Motion:
    """Law of one valid design at one cam angle, and its derivatives with respect to the angle; (1)."""
    law = int(designs[i, LAW].real)
    if law == FOURIER:
        return fourier(designs, i, first, phi)
    rise, dwell, fall = designs[i, RISE], designs[i, DWELL], designs[i, FALL]
    t = phi - designs[i, START]
    t = t - TWO_PI * math.floor(t.real / TWO_PI)
    back = t - rise - dwell
    if t.real < rise.real:
        m = normalised(law, t / rise)
        return Motion(m.y, m.d1 / rise, m.d2 / (rise * rise), m.d3 / (rise * rise * rise))
    if back.real < 0.0:
        return Motion(1.0 + 0.0 * t, 0.0 * t, 0.0 * t, 0.0 * t)
    if back.real < fall.real:
        # backwards from the end, where the way left to go is small
        m = normalised(law, (fall - back) / fall)
        return Motion(m.y, -m.d1 / fall, m.d2 / (fall * fall), -m.d3 / (fall * fall * fall))
    return Motion(0.0 * t, 0.0 * t, 0.0 * t, 0.0 * t)
