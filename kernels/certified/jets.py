"""Enclosures of analytic functions of the crank angle: polynomials with proven remainders.

docs/internals/extrema.md explains the method.

A jet encloses a function f(phi + z) on the complex disc |z| <= reach.  In x = z/reach it is a polynomial of degree
ORDER plus two remainders of which only the size is known.  ``noise`` is any power series; it stands for rounding errors
and for inputs that are known to rounding.  ``tail`` is a power series that begins with x^(ORDER + 1); it stands for
truncation.  The size of a power series is the sum of the magnitudes of its coefficients.  The size of a product is at
most the product of the sizes, which keeps every rule here short.  The size also bounds the function itself and, on a
smaller disc, its derivatives.

The processor's rounding mode is left at nearest: every operation adds a bound of its rounding to ``noise``.  Bounds
are sums and products of non-negative numbers only, and the factor GUARD covers their own rounding.  An operation whose
numbers overflow or become nan reports failure; it never returns an enclosure.

The rules are written out for the ORDER of the polynomials and have no branch.  So a loop over designs whose jets lie
side by side is vector code, and the same rules serve one design alone.

Each of several designs has a lane.  A jet of all lanes is WIDTH rows of LANES numbers, and other numbers stand in rows
alike.  The lanes in use are the first ones; the others are never read.  All jets are one array, and
functions take their places in it: an array of its own for each would have its references counted, which took a third
of the time.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels.arithmetic.sincos import sincos
from kernels.jit import inline
from kernels.types import EPS, Array

ORDER = 6
NORM, NOISE, TAIL, WIDTH = ORDER + 1, ORDER + 2, ORDER + 3, ORDER + 4
GUARD = 1.0 + 2.0**-46  # no rule takes more than a hundred roundings to make a bound
_LARGEST_LEFT = 0.5  # 1 would do, but remainders would be many times larger than with a slightly shorter reach
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


TABLE, SIZE, REST = _trigonometric_table()


class Jet(NamedTuple):
    """A jet in registers: the ORDER + 1 coefficients of its polynomial, their size, noise and tail."""

    p: Any
    norm: Any
    noise: Any
    tail: Any


@inline
def get(at: Array, i: int, step: int) -> Jet:
    """Read a jet whose numbers stand from place i on, ``step`` apart."""
    p = (at[i], at[i + step], at[i + 2 * step], at[i + 3 * step], at[i + 4 * step], at[i + 5 * step], at[i + 6 * step])
    return Jet(p, at[i + NORM * step], at[i + NOISE * step], at[i + TAIL * step])


@inline
def put(at: Array, i: int, step: int, jet: Jet) -> None:
    """Write a jet from place i on, its numbers ``step`` apart."""
    p0, p1, p2, p3, p4, p5, p6 = jet.p
    at[i], at[i + step], at[i + 2 * step], at[i + 3 * step] = p0, p1, p2, p3
    at[i + 4 * step], at[i + 5 * step], at[i + 6 * step] = p4, p5, p6
    at[i + NORM * step], at[i + NOISE * step], at[i + TAIL * step] = jet.norm, jet.noise, jet.tail


@inline
def norm_of(p: Any) -> Any:
    """Bound the size of a polynomial, the sum of the magnitudes of its coefficients."""
    p0, p1, p2, p3, p4, p5, p6 = p
    return (abs(p0) + abs(p1) + abs(p2) + abs(p3) + abs(p4) + abs(p5) + abs(p6)) * GUARD


@inline
def size_of(jet: Jet) -> Any:
    """Bound the magnitude of a jet's function on its disc."""
    return (jet.norm + jet.noise + jet.tail) * GUARD


@inline
def harmonic(c0: Any, c1: Any, c2: Any, reach: Any, error: Any) -> Jet:
    """Enclose c0 + c1 s + c2 m, as :func:`triple_harmonic` does."""
    return triple_harmonic(c0, c1, c2, 0.0, 0.0, 0.0, 0.0, reach, error)


@inline
def double_harmonic(c0: Any, c1: Any, c2: Any, c3: Any, c4: Any, reach: Any, error: Any) -> Jet:
    """Enclose c0 + c1 s + c2 m + c3 s m + c4 m^2, as :func:`triple_harmonic` does."""
    return triple_harmonic(c0, c1, c2, c3, c4, 0.0, 0.0, reach, error)


@inline
def triple_harmonic(c0: Any, c1: Any, c2: Any, c3: Any, c4: Any, c5: Any, c6: Any, reach: Any, error: Any) -> Jet:
    """Enclose c0 + c1 s + c2 m + c3 s m + c4 m^2 + c5 s m^2 + c6 m^3 on |z| <= reach <= 1.

    s is sin z, and m is 1 - cos z; ``error`` bounds the error of the function due to the errors of c0 ... c6.
    """
    r2 = reach * reach
    r3, r4 = r2 * reach, r2 * r2
    p = (
        c0, reach * c1 * TABLE[1, 1], r2 * c2 * TABLE[2, 2], r3 * (c1 * TABLE[1, 3] + c3 * TABLE[3, 3]),
        r4 * (c2 * TABLE[2, 4] + c4 * TABLE[4, 4]),
        r4 * reach * (c1 * TABLE[1, 5] + c3 * TABLE[3, 5] + c5 * TABLE[5, 5]),
        r4 * r2 * (c2 * TABLE[2, 6] + c4 * TABLE[4, 6] + c6 * TABLE[6, 6]),
    )  # fmt: skip
    odd = reach * (abs(c1) * SIZE[1] + r2 * (abs(c3) * SIZE[3] + r2 * abs(c5) * SIZE[5]))
    whole = odd + r2 * (abs(c2) * SIZE[2] + r2 * (abs(c4) * SIZE[4] + r2 * abs(c6) * SIZE[6]))
    rest = abs(c1) * REST[1] + abs(c2) * REST[2] + abs(c3) * REST[3]
    rest += abs(c4) * REST[4] + abs(c5) * REST[5] + abs(c6) * REST[6]
    noise = (error + (ORDER + 8) * EPS * whole) * GUARD
    return Jet(p, norm_of(p), noise, rest * (r4 * r3) * (1.0 + 2.0**-30))


@inline
def sum_of(a: Jet, b: Jet) -> Jet:
    """Enclose the sum a + b."""
    a0, a1, a2, a3, a4, a5, a6 = a.p
    b0, b1, b2, b3, b4, b5, b6 = b.p
    p = (a0 + b0, a1 + b1, a2 + b2, a3 + b3, a4 + b4, a5 + b5, a6 + b6)
    noise = (a.noise + b.noise + EPS * (a.norm + b.norm)) * GUARD
    return Jet(p, norm_of(p), noise, (a.tail + b.tail) * GUARD)


@inline
def combined(c: Any, p: Any, a: Jet, q: Any, b: Jet, error: Any) -> Jet:
    """Enclose c + p a + q b; ``error`` bounds its error due to the errors of c, p, q."""
    noise = abs(p) * a.noise + abs(q) * b.noise + error
    noise += 3.0 * EPS * (abs(c) + abs(p) * a.norm + abs(q) * b.norm)
    a0, a1, a2, a3, a4, a5, a6 = a.p
    b0, b1, b2, b3, b4, b5, b6 = b.p
    made = (
        p * a0 + q * b0 + c, p * a1 + q * b1, p * a2 + q * b2, p * a3 + q * b3, p * a4 + q * b4, p * a5 + q * b5,
        p * a6 + q * b6,
    )  # fmt: skip
    return Jet(made, norm_of(made), noise * GUARD, (abs(p) * a.tail + abs(q) * b.tail) * GUARD)


@inline
def beyond(a: Any, b: Any) -> Any:
    """Bound the size of the terms beyond ORDER in the product of two polynomials."""
    _, a1, a2, a3, a4, a5, a6 = a
    _, b1, b2, b3, b4, b5, b6 = b
    s6 = abs(b6)
    s5 = s6 + abs(b5)
    s4 = s5 + abs(b4)
    s3 = s4 + abs(b3)
    s2 = s3 + abs(b2)
    s1 = s2 + abs(b1)
    total = abs(a1) * s6 + abs(a2) * s5 + abs(a3) * s4 + abs(a4) * s3 + abs(a5) * s2 + abs(a6) * s1
    return total * GUARD


@inline
def product(a: Jet, b: Jet) -> Jet:
    """Enclose the product a b."""
    a0, a1, a2, a3, a4, a5, a6 = a.p
    b0, b1, b2, b3, b4, b5, b6 = b.p
    p = (
        a0 * b0,
        a0 * b1 + a1 * b0,
        a0 * b2 + a1 * b1 + a2 * b0,
        a0 * b3 + a1 * b2 + a2 * b1 + a3 * b0,
        a0 * b4 + a1 * b3 + a2 * b2 + a3 * b1 + a4 * b0,
        a0 * b5 + a1 * b4 + a2 * b3 + a3 * b2 + a4 * b1 + a5 * b0,
        a0 * b6 + a1 * b5 + a2 * b4 + a3 * b3 + a4 * b2 + a5 * b1 + a6 * b0,
    )
    noise = (_DOT * a.norm * b.norm + a.norm * b.noise + a.noise * (b.norm + b.noise)) * GUARD
    tail = (beyond(a.p, b.p) + a.tail * (b.norm + b.noise + b.tail) + b.tail * (a.norm + a.noise)) * GUARD
    return Jet(p, norm_of(p), noise, tail)


@inline
def reciprocal(a: Jet) -> tuple[Jet, Any]:
    """Enclose 1/a; the second result is false if that is impossible, as where a may have a zero on the disc.

    The recurrence makes the product of both polynomials equal to 1 up to x^ORDER, but for the rounding of its sums.  So
    d, the size of 1 - a out, is small.  Where d < 1, 1/a = out (1 + r), and the size of r is at most d/(1 - d).
    """
    a0, a1, a2, a3, a4, a5, a6 = a.p
    f = 1.0 / a0
    q1 = -(a1 * f) * f
    q2 = -(a1 * q1 + a2 * f) * f
    q3 = -(a1 * q2 + a2 * q1 + a3 * f) * f
    q4 = -(a1 * q3 + a2 * q2 + a3 * q1 + a4 * f) * f
    q5 = -(a1 * q4 + a2 * q3 + a3 * q2 + a4 * q1 + a5 * f) * f
    q6 = -(a1 * q5 + a2 * q4 + a3 * q3 + a4 * q2 + a5 * q1 + a6 * f) * f
    p = (f, q1, q2, q3, q4, q5, q6)
    norm = norm_of(p)
    noise = (_DOT * a.norm + a.noise) * norm
    tail = beyond(a.p, p) + a.tail * norm
    left = (noise + tail) * GUARD
    scale = norm / (1.0 - left) * GUARD
    return Jet(p, norm, noise * scale, tail * scale), left < _LARGEST_LEFT  # false for nan


@inline
def root_of(a: Jet) -> tuple[Jet, Any]:
    """Enclose the positive square root of a; the second result is false if that is impossible.

    Let t be the polynomial of the root, so that a = t^2 (1 + q) with q = (a - t^2)/t^2.  If the size of q is small
    enough, the power series of sqrt(1 + q) bounds both remainders.  Where a is not positive the numbers become nan, and
    no comparison with them is true.  The size of 1/t, by which the remainders grow, is bounded without its polynomial:
    of t = f - r it is at most 1/(f - size of r), which was measured to cost no cell.
    """
    a0, a1, a2, a3, a4, a5, a6 = a.p
    f = math.sqrt(a0)
    half = 0.5 / f
    t1 = a1 * half
    t2 = (a2 - t1 * t1) * half
    t3 = (a3 - t1 * t2 - t2 * t1) * half
    t4 = (a4 - t1 * t3 - t2 * t2 - t3 * t1) * half
    t5 = (a5 - t1 * t4 - t2 * t3 - t3 * t2 - t4 * t1) * half
    t6 = (a6 - t1 * t5 - t2 * t4 - t3 * t3 - t4 * t2 - t5 * t1) * half
    p = (f, t1, t2, t3, t4, t5, t6)
    norm = norm_of(p)
    noise, tail = _DOT * (a.norm + 2.0 * norm * norm) + a.noise, beyond(p, p) + a.tail
    least = 2.0 * f - norm
    bound = GUARD / least
    q = (noise + tail) * bound * bound * GUARD
    by_root = bound / (1.0 + math.sqrt(1.0 - q)) * GUARD
    return Jet(p, norm, noise * by_root, tail * by_root), (least > 0.0) & (q < _LARGEST_LEFT)


LANES = 32


@inline
def circle(lanes: int, phi: Array, reach: Array, jets: Array, cos: int, sin: int) -> None:
    """Enclose cosine and sine of phi + z on |z| <= reach <= 1; ``cos`` and ``sin`` are places of jets."""
    for i in range(lanes):
        v, u = sincos(phi[i])
        put(jets, cos + i, LANES, harmonic(u, -v, -u, reach[i], 6.0 * EPS))
        put(jets, sin + i, LANES, harmonic(v, u, -v, reach[i], 6.0 * EPS))


@inline
def inverse(lanes: int, jets: Array, a: int, out: int, good: Array) -> None:
    """Enclose 1/a; ``good`` becomes 0 where that is impossible."""
    for i in range(lanes):
        jet, possible = reciprocal(get(jets, a + i, LANES))
        put(jets, out + i, LANES, jet)
        good[i] = good[i] if possible else 0.0


@inline
def root(lanes: int, jets: Array, a: int, out: int, good: Array) -> None:
    """Enclose the positive square root of a; ``good`` becomes 0 where that is impossible."""
    for i in range(lanes):
        jet, possible = root_of(get(jets, a + i, LANES))
        put(jets, out + i, LANES, jet)
        good[i] = good[i] if possible else 0.0
