"""The closure constant in twice the working precision: for designs whose given doubles are meant to the last bit.

K = (c-b)(c+b) + a^2 + e^2 + (f-g)^2 + 4 f g sin^2(alpha/2) is where a long coupler loses digits: terms of the size
L^2 cancel to L c, so plain arithmetic is off by 2^-53 (L/c) to 2^-53 (L/c)^2.  That is within the error that rounding
the inputs causes, so a drawing loses nothing by it; a comparison with exact arithmetic does.  Sums and products are
error-free (Knuth; Dekker), the sine is not: where f and g are both long and the axes are not parallel, its rounding
remains.
"""

from __future__ import annotations

import math

from kernels._jit import inline, kernel
from kernels.families.rssr.closure import Array, unit_scale
from kernels.sincos import sincos


@inline
def _sum(a: float, b: float) -> tuple[float, float]:
    """Rounded sum and its error; exact."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@inline
def _product(a: float, b: float) -> tuple[float, float]:
    """Rounded product and its error; exact for factors below 1e150 and products above 1e-290."""
    p = a * b
    h, k = 134217729.0 * a, 134217729.0 * b  # 2^27 + 1
    ah, bh = h - (h - a), k - (k - b)
    al, bl = a - ah, b - bh
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl


@inline
def _add_product(high: float, low: float, a: float, a_low: float, b: float, b_low: float) -> tuple[float, float]:
    """Add to high + low the product (a + a_low)(b + b_low), to twice the working precision."""
    p, e = _product(a, b)
    s, t = _sum(high, p)
    return _sum(s, low + (t + (e + (a * b_low + a_low * b))))


@kernel
def exact_constant(designs: Array, k0: Array) -> None:
    """The constant of W in units of the crank, K/(2 a c), rounded once; for the option ``k0`` of the poses.

    Parameters
    ----------
    designs : (n, 8) columns of :class:`Design`
    k0 : (n,) out; nan for what is not finite

    Notes
    -----
    Once per design, nothing per pose.  The oracle's long couplers come out within 2^-53 times a few hundred instead of
    a few millions (tests/test_hard_exact_inputs.py); docs/accuracy.md gives the cost.
    """
    for i in range(designs.shape[0]):
        unit = unit_scale(designs[i, 2])
        a, b, c = designs[i, 0] * unit, designs[i, 1] * unit, designs[i, 2] * unit
        e, f, g = designs[i, 3] * unit, designs[i, 4] * unit, designs[i, 5] * unit
        alpha = designs[i, 6]
        near_zero = math.cos(alpha) >= 0.0
        sine, cosine = sincos(0.5 * alpha)
        half = sine if near_zero else cosine
        sign = 1.0 if near_zero else -1.0
        less, less_low = _sum(c, -b)
        more, more_low = _sum(c, b)
        gap, gap_low = _sum(f, -sign * g)
        high, low = _add_product(0.0, 0.0, less, less_low, more, more_low)
        high, low = _add_product(high, low, a, 0.0, a, 0.0)
        high, low = _add_product(high, low, e, 0.0, e, 0.0)
        high, low = _add_product(high, low, gap, gap_low, gap, gap_low)
        across, across_low = _product(f, g)
        square, square_low = _product(half, half)
        high, low = _add_product(high, low, 4.0 * sign * across, 4.0 * sign * across_low, square, square_low)
        k0[i] = 0.5 * (high + low) / (a * c)
