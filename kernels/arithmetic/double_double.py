"""Arithmetic with twice the working precision: a number is the unrounded sum of a pair (high, low) of float64.

Error-free transformations of Knuth, Dekker and Ogita, Rump and Oishi (Accurate sum and dot product, SIAM J. Sci.
Comput. 26, 2005).  Results carry a relative error of a few 2^-104 as long as nothing leaves float64 and no low part
becomes subnormal.  No function has a branch, so that loops over them vectorise.  Numbers must be real.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, TypeAlias

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from kernels.jit import inline

Twofold: TypeAlias = tuple[float, float]

_TWO_PER_PI = 2.0 / math.pi
_P1 = float.fromhex("0x1.921fb54400000p+0")  # pi/2 in three parts: the products of two with n < 2^20 are exact
_P2 = float.fromhex("0x1.0b4611a600000p-34")
_P3 = float.fromhex("0x1.3198a2e037073p-69")
_ROUND = 1.5 * 2.0**52


def _fused_typed(typingctx: Any, a: Any, b: Any, c: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        number = ir.DoubleType()
        function = builder.module.declare_intrinsic("llvm.fma", [number], ir.FunctionType(number, [number] * 3))
        return builder.call(function, args)

    return types.float64(types.float64, types.float64, types.float64), codegen


_fma: Any = intrinsic(_fused_typed)


def fused(a: float, b: float, c: float) -> float:
    """Compute a b + c with one rounding; without that instruction a library does it, to the same bits."""
    if not (math.isfinite(a) and math.isfinite(b) and math.isfinite(c)):
        return a * b + c
    return float(Fraction(a) * Fraction(b) + Fraction(c))


@overload(fused, inline="always")
def _fused_overload(a: float, b: float, c: float) -> Any:
    def rounded_once(a: float, b: float, c: float) -> float:
        return _fma(a, b, c)  # type: ignore[no-any-return]

    return rounded_once


@inline
def two_sum(a: float, b: float) -> Twofold:
    """Compute the rounded sum of a and b and its rounding error, which is exact (Knuth)."""
    s = a + b
    # t is the part of b that s contains; the error is what s lacks of a and of b, whichever of the two is larger.
    t = s - a
    return s, (a - (s - t)) + (b - t)


@inline
def normal(high: float, low: float) -> Twofold:
    """Make a pair whose high part is its rounded sum; it needs |high| >= |low| or high = 0 (Dekker)."""
    s = high + low
    return s, low - (s - high)


@inline
def two_product(a: float, b: float) -> Twofold:
    """Compute the rounded product of a and b and its rounding error, exact while the error is a normal number."""
    p = a * b
    return p, fused(a, b, -p)


@inline
def add(a: Twofold, b: Twofold) -> Twofold:
    """Compute the sum a + b; its error is relative to |a| + |b|, not to the sum."""
    s, e = two_sum(a[0], b[0])
    return normal(s, e + (a[1] + b[1]))


@inline
def subtract(a: Twofold, b: Twofold) -> Twofold:
    """Compute the difference a - b; its error is relative to |a| + |b|, not to the difference."""
    return add(a, (-b[0], -b[1]))


@inline
def multiply(a: Twofold, b: Twofold) -> Twofold:
    """Compute the product a b."""
    p, e = two_product(a[0], b[0])
    return normal(p, fused(a[0], b[1], fused(a[1], b[0], e)))


@inline
def scale(a: Twofold, b: float) -> Twofold:
    """Compute the product a b for a plain number b."""
    p, e = two_product(a[0], b)
    return normal(p, fused(a[1], b, e))


@inline
def divide(a: Twofold, b: Twofold, per_b: float) -> Twofold:
    """Compute the quotient a/b; ``per_b`` is 1/b as a plain number, which several quotients share.

    One step of long division: the remainder of the rounded quotient corrects it.
    """
    q = a[0] * per_b
    rest = fused(-q, b[0], a[0])
    return normal(q, fused(-q, b[1], rest + a[1]) * per_b)


@inline
def root(a: Twofold) -> Twofold:
    """Compute the square root of a positive number: one step of Newton's method on the rounded root."""
    q = math.sqrt(a[0])
    return normal(q, (fused(-q, q, a[0]) + a[1]) / (q + q))


@inline
def unit_vector(x: float, y: float) -> tuple[Twofold, Twofold]:
    """Bring (x, y), whose length is 1 but for rounding, to length 1 in twice the precision."""
    # The length is so near 1 that sqrt(1 + 2 excess) - 1 is the excess itself to the precision of the pairs.
    xx, yy = two_product(x, x), two_product(y, y)
    square = two_sum(xx[0], yy[0])
    excess = 0.5 * ((square[0] - 1.0) + (square[1] + (xx[1] + yy[1])))
    return normal(x, -excess * x), normal(y, -excess * y)


@inline
def sine_cosine(x: float) -> tuple[Twofold, Twofold]:
    """Compute sine and cosine for |x| <= 1e5 with a relative error below 2^-84; nan for nan and infinity.

    The angle is reduced as in :mod:`kernels.arithmetic.sincos`; of Taylor's series the first five terms have twice the
    precision.
    """
    n = (x * _TWO_PER_PI + _ROUND) - _ROUND
    w, e = two_product(n, _P3)
    r = add(two_sum(x - n * _P1, -(n * _P2)), (-w, -e))
    z = multiply(r, r)
    u = z[0]
    # 1/13!, 1/15! ...; what follows them is below 2^-84
    tail = 1.0 / 6227020800.0 - u * (
        1.0 / 1307674368000.0
        - u
        * (
            1.0 / 355687428096000.0
            - u * (1.0 / 1.21645100408832e17 - u * (1.0 / 5.109094217170944e19 - u / 2.585201673888498e22))
        )
    )
    s = add((-2.505210838544172e-08, 1.448814070935912e-24), scale(z, tail))
    s = add((2.7557319223985893e-06, -1.858393274046472e-22), multiply(z, s))
    s = add((-0.0001984126984126984, -1.7209558293420705e-22), multiply(z, s))
    s = add((0.008333333333333333, 1.1564823173178714e-19), multiply(z, s))
    s = add((-0.16666666666666666, -9.25185853854297e-18), multiply(z, s))
    s = add(r, multiply(multiply(r, z), s))
    # 1/14!, 1/16! ...
    tail = 1.0 / 479001600.0 - u * (
        1.0 / 87178291200.0
        - u
        * (
            1.0 / 20922789888000.0
            - u * (1.0 / 6402373705728000.0 - u * (1.0 / 2.43290200817664e18 - u / 1.1240007277776077e21))
        )
    )
    c = add((-2.755731922398589e-07, -2.3767714622250297e-23), scale(z, tail))
    c = add((2.48015873015873e-05, 2.1511947866775882e-23), multiply(z, c))
    c = add((-0.001388888888888889, 5.300543954373577e-20), multiply(z, c))
    c = add((0.041666666666666664, 2.3129646346357427e-18), multiply(z, c))
    c = add((-0.5, 0.0), multiply(z, c))
    c = add((1.0, 0.0), multiply(z, c))
    quadrant = n - 4.0 * ((0.25 * n - 0.375 + _ROUND) - _ROUND)
    swap = (quadrant == 1.0) | (quadrant == 3.0)
    turn_s, turn_c = -1.0 if quadrant >= 2.0 else 1.0, -1.0 if (quadrant == 1.0) | (quadrant == 2.0) else 1.0
    sine = (turn_s * (c[0] if swap else s[0]), turn_s * (c[1] if swap else s[1]))
    cosine = (turn_c * (s[0] if swap else c[0]), turn_c * (s[1] if swap else c[1]))
    return sine, cosine
