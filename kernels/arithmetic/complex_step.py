"""Arctangent and magnitude of numbers that may be complex, for exact gradients by the complex step.

A kernel fed with complex128 designs (p + i h) returns y(p) + i h dy/dp through the same source.  Sums, products and
``np.sqrt`` do this by themselves; decisions are taken on the real part; only the four-quadrant arctangent and the
magnitude need an analytic continuation.  The choice is made at compile time: in the float64 kernels these are
``math.atan2`` and ``abs``, bit for bit.
"""

from __future__ import annotations

import math
from typing import Any

from numba import types
from numba.extending import overload

from kernels.jit import inline


@inline
def divisor(x: Any) -> Any:
    """Return x, or nan for 0: a compiled division by a complex zero raises an exception where a real one gives inf."""
    return x if x.real != 0.0 else math.nan + x


def arctan2(y: Any, x: Any) -> Any:
    """Angle of the vector (x, y); complex arguments are continued to first order in their imaginary parts."""
    if isinstance(y, complex) or isinstance(x, complex):
        return _arctan2_complex(y, x)
    return _arctan2_real(y, x)


def _arctan2_real(y: Any, x: Any) -> Any:
    return math.atan2(y, x)


def _arctan2_complex(y: Any, x: Any) -> Any:
    # d arctan2(y, x) = (x dy - y dx)/(x^2 + y^2); second order is far below rounding at a step of 1e-30.
    slope = (x.real * y.imag - y.real * x.imag) / (x.real * x.real + y.real * y.real)
    return complex(math.atan2(y.real, x.real), slope)


def magnitude(x: Any) -> Any:
    """Return |x|; for a complex argument x or -x, whichever has the positive real part."""
    if isinstance(x, complex):
        return _magnitude_complex(x)
    return _magnitude_real(x)


def _magnitude_real(x: Any) -> Any:
    return abs(x)


def _magnitude_complex(x: Any) -> Any:
    # Not abs: it would mix real and imaginary part, and the result would not be analytic in x.
    return x if x.real >= 0.0 else -x


@overload(arctan2)
def _arctan2_typed(y: Any, x: Any) -> Any:
    if isinstance(y, types.Complex) or isinstance(x, types.Complex):
        return _arctan2_complex
    return _arctan2_real


@overload(magnitude)
def _magnitude_typed(x: Any) -> Any:
    if isinstance(x, types.Complex):
        return _magnitude_complex
    return _magnitude_real


def hypotenuse(x: Any, y: Any) -> Any:
    """Length of the vector (x, y); complex arguments are continued to first order in their imaginary parts."""
    if isinstance(x, complex) or isinstance(y, complex):
        return _hypotenuse_complex(x, y)
    return _hypotenuse_real(x, y)


def _hypotenuse_real(x: Any, y: Any) -> Any:
    return math.hypot(x, y)


def _hypotenuse_complex(x: Any, y: Any) -> Any:
    # d hypot(x, y) = (x dx + y dy)/hypot(x, y)
    length = math.hypot(x.real, y.real)
    return complex(length, (x.real * x.imag + y.real * y.imag) / length)


@overload(hypotenuse)
def _hypotenuse_typed(x: Any, y: Any) -> Any:
    if isinstance(x, types.Complex) or isinstance(y, types.Complex):
        return _hypotenuse_complex
    return _hypotenuse_real


@inline
def unit_near(size: Any) -> tuple[float, float]:
    """Power of two near a number, and its reciprocal: factors that bring lengths near 1 without rounding."""
    _, exponent = math.frexp(size.real)
    return math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
