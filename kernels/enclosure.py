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

All jets lie in one plain array, WIDTH numbers each, and functions take the offsets of their operands in it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels._jit import inline, kernel

Array = NDArray[np.float64]
EPS = 2.0**-53
ORDER = 6
NORM, NOISE, TAIL, WIDTH = ORDER + 1, ORDER + 2, ORDER + 3, ORDER + 4
GUARD = 1.0 + 2.0**-46  # no rule takes more than a hundred roundings to make a bound
LARGEST_LEFT = 0.5  # 1 would do, but remainders would be many times larger than with a slightly shorter reach
_DOT = (ORDER + 5) * EPS  # rounding of a sum of up to ORDER + 1 products, divided or multiplied once more


def _trigonometric_table() -> tuple[Array, Array, Array]:
    """Tabulate the Taylor coefficients of 1, s, m, s m, m^2, s m^2, m^3 with s = sin z and m = 1 - cos z.

    Returns the coefficients up to ORDER, then per function the sum of the magnitudes of all coefficients, and of those
    beyond ORDER.
    """
    harmonics = (  # of sin z, sin 2z, sin 3z or of cos z, cos 2z, cos 3z; the constants of the even ones cancel
        (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (1.0, -0.5, 0.0), (-2.0, 0.5, 0.0), (1.25, -1.0, 0.25), (-3.75, 1.5, -0.25),
    )  # fmt: skip
    table = np.zeros((7, 40))
    table[0, 0] = 1.0
    for i, (one, two, three) in enumerate(harmonics, start=1):
        for k in range(1 if i % 2 else 2, 40, 2):
            # Whole numbers, so exact: one + two 2^k + three 3^k.
            total = int(4 * one) + int(4 * two) * 2**k + int(4 * three) * 3**k
            table[i, k] = (-1) ** (k // 2) * total / (4 * math.factorial(k))
    sizes = np.abs(table)
    return table[:, : ORDER + 1].copy(), sizes.sum(axis=1) * GUARD, sizes[:, ORDER + 1 :].sum(axis=1) * GUARD


_TABLE, _SIZE, _REST = _trigonometric_table()


@inline
def settle(at: Array, j: int) -> None:
    """Write the size of a jet's polynomial, which all bounds are made of, behind its coefficients."""
    total = 0.0
    for k in range(ORDER + 1):
        total += abs(at[j + k])
    at[j + NORM] = total * GUARD


@inline
def size(at: Array, j: int) -> float:
    """Bound the magnitude of a jet's function on its disc."""
    bound: float = (at[j + NORM] + at[j + NOISE] + at[j + TAIL]) * GUARD
    return bound


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
    for k in range(1, ORDER + 1):
        if k % 2 == 1:
            at[out + k] = power * (c1 * _TABLE[1, k] + c3 * _TABLE[3, k] + c5 * _TABLE[5, k])
        else:
            at[out + k] = power * (c2 * _TABLE[2, k] + c4 * _TABLE[4, k] + c6 * _TABLE[6, k])
        power *= reach
    settle(at, out)
    odd = reach * (abs(c1) * _SIZE[1] + reach * reach * (abs(c3) * _SIZE[3] + reach * reach * abs(c5) * _SIZE[5]))
    even = abs(c2) * _SIZE[2] + reach * reach * (abs(c4) * _SIZE[4] + reach * reach * abs(c6) * _SIZE[6])
    whole = odd + reach * reach * even
    # power = reach^(ORDER + 1) and the table's entries are rounded too.
    at[out + NOISE] = (error + (ORDER + 8) * EPS * whole) * GUARD
    rest = abs(c1) * _REST[1] + abs(c2) * _REST[2] + abs(c3) * _REST[3]
    rest += abs(c4) * _REST[4] + abs(c5) * _REST[5] + abs(c6) * _REST[6]
    at[out + TAIL] = rest * power * (1.0 + 2.0**-30)


@inline
def add(at: Array, a: int, b: int, out: int) -> None:
    """Enclose the sum a + b; ``out`` may be a or b."""
    noise, tail = at[a + NOISE] + at[b + NOISE], at[a + TAIL] + at[b + TAIL]
    noise += EPS * (at[a + NORM] + at[b + NORM])
    for k in range(ORDER + 1):
        at[out + k] = at[a + k] + at[b + k]
    settle(at, out)
    at[out + NOISE], at[out + TAIL] = noise * GUARD, tail * GUARD


@kernel
def combine(at: Array, c: float, p: float, a: int, q: float, b: int, error: float, out: int) -> None:
    """Enclose c + p a + q b; ``error`` bounds what the errors of c, p, q make of it; ``out`` may be a or b."""
    noise = abs(p) * at[a + NOISE] + abs(q) * at[b + NOISE] + error
    noise += 3.0 * EPS * (abs(c) + abs(p) * at[a + NORM] + abs(q) * at[b + NORM])
    tail = abs(p) * at[a + TAIL] + abs(q) * at[b + TAIL]
    for k in range(ORDER + 1):
        at[out + k] = p * at[a + k] + q * at[b + k]
    at[out] += c
    settle(at, out)
    at[out + NOISE], at[out + TAIL] = noise * GUARD, tail * GUARD


@inline
def beyond(at: Array, a: int, b: int) -> float:
    """Bound the size of those terms of the product of two polynomials whose degree is beyond ORDER."""
    total, last = 0.0, 0.0
    for i in range(1, ORDER + 1):
        last += abs(at[b + ORDER + 1 - i])
        total += abs(at[a + i]) * last
    return total * GUARD


@kernel
def multiply(at: Array, a: int, b: int, out: int) -> None:
    """Enclose the product a b; ``out`` must be neither a nor b."""
    for n in range(ORDER + 1):
        total = at[a] * at[b + n]
        for i in range(1, n + 1):
            total += at[a + i] * at[b + n - i]
        at[out + n] = total
    settle(at, out)
    na, nb, ra, rb, ta, tb = at[a + NORM], at[b + NORM], at[a + NOISE], at[b + NOISE], at[a + TAIL], at[b + TAIL]
    at[out + NOISE] = (_DOT * na * nb + na * rb + ra * (nb + rb)) * GUARD
    at[out + TAIL] = (beyond(at, a, b) + ta * (nb + rb + tb) + tb * (na + ra)) * GUARD


@kernel
def inverse(at: Array, a: int, out: int) -> bool:
    """Enclose 1/a; the result is false if that is impossible, as where a may have a zero on the disc.

    The recurrence makes the product of both polynomials equal to 1 up to x^ORDER, but for the rounding of its sums.  So
    d, the size of 1 - a out, is small.  Where d < 1, 1/a = out (1 + r), and the size of r is at most d/(1 - d).
    """
    first = 1.0 / at[a]
    at[out] = first
    for n in range(1, ORDER + 1):
        total = at[a + 1] * at[out + n - 1]
        for i in range(2, n + 1):
            total += at[a + i] * at[out + n - i]
        at[out + n] = -total * first
    settle(at, out)
    norm = at[out + NORM]
    noise = (_DOT * at[a + NORM] + at[a + NOISE]) * norm
    tail = beyond(at, a, out) + at[a + TAIL] * norm
    left = (noise + tail) * GUARD
    scale = norm / (1.0 - left) * GUARD
    at[out + NOISE], at[out + TAIL] = noise * scale, tail * scale
    return bool(left < LARGEST_LEFT)  # false for nan


@kernel
def root(at: Array, a: int, out: int, per: int) -> bool:
    """Enclose the positive square root of a and its inverse; the result is false if that is impossible.

    Let t be the polynomial of the root, so that a = t^2 (1 + q) with q = (a - t^2)/t^2.  If the size of q is small
    enough, the power series of sqrt(1 + q) and of its inverse bound both remainders.
    """
    if not at[a] > 0.0:
        return False
    first = math.sqrt(at[a])
    at[out] = first
    half = 0.5 / first
    for n in range(1, ORDER + 1):
        total = at[a + n]
        for i in range(1, n):
            total -= at[out + i] * at[out + n - i]
        at[out + n] = total * half
    settle(at, out)
    at[out + NOISE], at[out + TAIL] = 0.0, 0.0
    norm = at[out + NORM]
    noise = _DOT * (at[a + NORM] + 2.0 * norm * norm) + at[a + NOISE]
    tail = beyond(at, out, out) + at[a + TAIL]
    if not inverse(at, out, per):
        return False
    bound = size(at, per)
    q = (noise + tail) * bound * bound * GUARD
    if not q < LARGEST_LEFT:
        return False
    s = math.sqrt(1.0 - q)
    by_root, by_inverse = bound / (1.0 + s) * GUARD, bound * bound * bound / (s * (1.0 + s)) * GUARD
    at[out + NOISE], at[out + TAIL] = noise * by_root, tail * by_root
    at[per + NOISE] = (at[per + NOISE] + noise * by_inverse) * GUARD
    at[per + TAIL] = (at[per + TAIL] + tail * by_inverse) * GUARD
    return True


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
