"""Enclosures of analytic functions of the crank angle: polynomials with proven remainders.

docs/extrema.md, section 5, explains the method.

A jet encloses a function f(phi + z) on the complex disc |z| <= reach.  In x = z/reach it is a polynomial of degree
ORDER plus two remainders of which only the size is known.  ``noise`` is any power series; it stands for rounding errors
and for inputs that are known to rounding.  ``tail`` is a power series that begins with x^(ORDER + 1); it stands for
truncation.  The size of a power series is the sum of the magnitudes of its coefficients.  The size of a product is at
most the product of the sizes, which keeps every rule here short.  The size also bounds the function itself and, on a
smaller disc, its derivatives.

The processor's rounding mode is left at nearest: every operation adds to ``noise`` what it can have rounded by.  Bounds
are sums and products of non-negative numbers only, and the factor GUARD covers their own rounding.  An operation whose
numbers overflow or become nan reports failure; it never returns an enclosure.

The rules themselves are in :mod:`kernels.certified.jets`.  Here the jets of one design lie in one plain array, WIDTH
numbers each, and functions take the offsets of their operands in it.
"""

from __future__ import annotations

from kernels.certified.jets import (
    GUARD,
    NOISE,
    NORM,
    ORDER,
    REST,
    SIZE,
    TABLE,
    TAIL,
    WIDTH,
    get,
    product,
    put,
    reciprocal,
    root_of,
    sum_of,
)
from kernels.jit import inline, kernel
from kernels.types import EPS, Array

__all__ = ["EPS", "GUARD", "NOISE", "NORM", "ORDER", "TAIL", "WIDTH", "Array"]


@kernel
def trigonometric(
    at: Array, out: int, reach: float, c0: float, c1: float, c2: float, c3: float, c4: float, c5: float, c6: float,
    error: float,
) -> None:  # fmt: skip
    """Enclose c0 + c1 s + c2 m + c3 s m + c4 m^2 + c5 s m^2 + c6 m^3 with s = sin z and m = 1 - cos z.

    ``reach`` is 1 at most.  ``error`` bounds the size of the function that the errors of c0 ... c6 themselves make.
    """
    at[out] = c0
    power = reach
    total = abs(c0)
    for k in range(1, ORDER + 1):
        if k % 2 == 1:
            at[out + k] = power * (c1 * TABLE[1, k] + c3 * TABLE[3, k] + c5 * TABLE[5, k])
        else:
            at[out + k] = power * (c2 * TABLE[2, k] + c4 * TABLE[4, k] + c6 * TABLE[6, k])
        total += abs(at[out + k])
        power *= reach
    at[out + NORM] = total * GUARD
    odd = reach * (abs(c1) * SIZE[1] + reach * reach * (abs(c3) * SIZE[3] + reach * reach * abs(c5) * SIZE[5]))
    even = abs(c2) * SIZE[2] + reach * reach * (abs(c4) * SIZE[4] + reach * reach * abs(c6) * SIZE[6])
    whole = odd + reach * reach * even
    # power = reach^(ORDER + 1) and the table's entries are rounded too.
    at[out + NOISE] = (error + (ORDER + 8) * EPS * whole) * GUARD
    rest = abs(c1) * REST[1] + abs(c2) * REST[2] + abs(c3) * REST[3]
    rest += abs(c4) * REST[4] + abs(c5) * REST[5] + abs(c6) * REST[6]
    at[out + TAIL] = rest * power * (1.0 + 2.0**-30)


@inline
def add(at: Array, a: int, b: int, out: int) -> None:
    """Enclose the sum a + b; ``out`` may be a or b."""
    put(at, out, 1, sum_of(get(at, a, 1), get(at, b, 1)))


@kernel
def multiply(at: Array, a: int, b: int, out: int) -> None:
    """Enclose the product a b; ``out`` may be a or b."""
    put(at, out, 1, product(get(at, a, 1), get(at, b, 1)))


@kernel
def inverse(at: Array, a: int, out: int) -> bool:
    """Enclose 1/a; the result is false if that is impossible."""
    jet, good = reciprocal(get(at, a, 1))
    put(at, out, 1, jet)
    return bool(good)


@kernel
def root(at: Array, a: int, out: int, per: int) -> bool:
    """Enclose the positive square root of a and its inverse; the result is false if that is impossible."""
    jet, inverse_of_it, good = root_of(get(at, a, 1))
    put(at, out, 1, jet)
    put(at, per, 1, inverse_of_it)
    return bool(good)


@inline
def derivative(at: Array, a: int, order: int, reach: float, y: Array) -> None:
    """Write into y the coefficients in x of the derivative of that order by z; there are ORDER + 1 - order of them."""
    scale = 1.0
    for _ in range(order):
        scale /= reach
    for k in range(ORDER + 1 - order):
        factor = scale
        for i in range(order):
            factor *= k + 1 + i
        y[k] = at[a + order + k] * factor


@inline
def remainders(at: Array, a: int, order: int, reach: float, share: float) -> tuple[float, float]:
    """Bound noise and tail of the derivative of that order <= 3 on the smaller disc |z| <= share reach, share <= 0.75.

    A coefficient of x^k contributes k (k-1) ... (k-order+1) share^(k-order)/reach^order.  That falls with k from
    k = 2 ORDER on, so the largest factor is found among the k below.
    """
    scale, factor, power = 1.0, 1.0, 1.0
    for i in range(order):
        scale /= reach
        factor *= i + 1
    first, late = 0.0, 0.0
    for k in range(order, 2 * ORDER):
        first = max(first, factor * power)
        if k > ORDER:
            late = max(late, factor * power)
        factor *= (k + 1) / (k + 1 - order)
        power *= share
    return at[a + NOISE] * first * scale * GUARD, at[a + TAIL] * late * scale * GUARD


@inline
def ceiling(y: Array, count: int, share: float, tail: float) -> float:
    """Bound |y(x) + tail| for real |x| <= share from the coefficients of y.

    The bound is that of the parabola |y0| + |y1| |x| + q x^2, whose q holds all higher coefficients at their worst.
    Where q < 0 the parabola has a summit.  About a maximum of |y| the bound is sharp to third order.
    """
    rest, power = tail / (share * share), share
    for k in range(3, count):
        rest += abs(y[k]) * power
        power *= share
    top, slope = abs(y[0]), abs(y[1])
    q = (y[2] if y[0] >= 0.0 else -y[2]) + rest
    if q < 0.0 and slope < -2.0 * q * share:
        upper = top - 0.25 * slope * slope / q
    else:
        upper = top + share * (slope + q * share)
    bend = share * (abs(y[2]) + rest)
    # The coefficients are products of a few rounded factors, and y2 + rest may cancel.
    bound: float = max(upper, share * (slope + bend) - top) + 16.0 * EPS * (top + share * (slope + bend))
    return bound
