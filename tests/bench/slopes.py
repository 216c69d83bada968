"""Intervals with slopes over boxes of designs: the enclosure of first order that Taylor models are compared with.

Of a function F over the box |x_k - c_k| <= h_k a *form* holds three kinds of intervals: its value at the centre c, its
range over the box, and for every variable a slope s_k with

    F(x) = F(c) + sum_k s_k (x_k - c_k)   for every x in the box and some s_k in their intervals                    (1)

(R. Krawczyk and A. Neumaier, Interval slopes for rational functions and associated centered forms, SIAM J. Numer. Anal.
22, 1985).  Slopes are narrower than derivatives over the box, so this is the mean value form at its best; the range is
intersected with (1) after every operation.  Rounding goes outward.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.arithmetic.sincos import sincos
from kernels.boxes.tape import COMBINE, CONSTANT, INVERSE, MULTIPLY, ROOT
from kernels.jit import inline, kernel
from tests.bench.boxes import Boxes, Formula, arguments

Array = NDArray[np.float64]

ULP = 2.0**-52  # a number minus ULP of it is at most its lower neighbour, half of which rounding can have cost
TINY = 1e-300  # more than rounding can cost where numbers are too small for ULP
SMALL = 1e-30
CENTRE, RANGE, SLOPES = 0, 2, 4  # columns of a form


@inline
def down(x: float) -> float:
    """Return a number that a sum or product rounded to x cannot lie below."""
    return x - (abs(x) * ULP + TINY)


@inline
def up(x: float) -> float:
    """Return a number that a sum or product rounded to x cannot lie above."""
    return x + (abs(x) * ULP + TINY)


@inline
def times(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """Return the interval [a, b] [c, d]."""
    p, q, r, s = a * c, a * d, b * c, b * d
    return down(min(min(p, q), min(r, s))), up(max(max(p, q), max(r, s)))


@inline
def width(variables: int) -> int:
    """Return columns of a form."""
    return SLOPES + 2 * variables


@kernel
def settle(at: Array, out: int, half: Array) -> None:
    """Intersect the range with what centre and slopes say of it; (1)."""
    low, high = at[out, CENTRE], at[out, CENTRE + 1]
    for k in range(half.shape[0]):
        reach = up(max(abs(at[out, SLOPES + 2 * k]), abs(at[out, SLOPES + 2 * k + 1])) * half[k])
        low, high = down(low - reach), up(high + reach)
    if low > at[out, RANGE]:
        at[out, RANGE] = low
    if high < at[out, RANGE + 1]:
        at[out, RANGE + 1] = high


@kernel
def constant(at: Array, out: int, low: float, high: float) -> None:
    """Make a number that does not depend on the design and lies between the two ends."""
    at[out, :] = 0.0
    at[out, CENTRE], at[out, CENTRE + 1], at[out, RANGE], at[out, RANGE + 1] = low, high, low, high


@kernel
def variable(at: Array, out: int, centre: float, half: Array, k: int) -> None:
    """Make the k-th variable itself."""
    constant(at, out, centre, centre)
    at[out, RANGE], at[out, RANGE + 1] = down(centre - half[k]), up(centre + half[k])
    at[out, SLOPES + 2 * k], at[out, SLOPES + 2 * k + 1] = 1.0, 1.0


@kernel
def combine(at: Array, out: int, p: float, a: int, q: float, b: int, half: Array) -> None:
    """Compute P a + q b for two numbers p, q."""
    for j in range(0, at.shape[1], 2):
        first, second = times(p, p, at[a, j], at[a, j + 1])
        third, fourth = times(q, q, at[b, j], at[b, j + 1])
        at[out, j], at[out, j + 1] = down(first + third), up(second + fourth)
    settle(at, out, half)


@kernel
def multiply(at: Array, out: int, a: int, b: int, half: Array) -> None:
    """Compute the product a b, with slopes s_a b(box) + a(c) s_b; ``out`` must be neither."""
    at[out, 0], at[out, 1] = times(at[a, 0], at[a, 1], at[b, 0], at[b, 1])
    at[out, 2], at[out, 3] = times(at[a, 2], at[a, 3], at[b, 2], at[b, 3])
    for j in range(SLOPES, at.shape[1], 2):
        first, second = times(at[a, j], at[a, j + 1], at[b, 2], at[b, 3])
        third, fourth = times(at[a, 0], at[a, 1], at[b, j], at[b, j + 1])
        at[out, j], at[out, j + 1] = down(first + third), up(second + fourth)
    settle(at, out, half)


@kernel
def square(at: Array, out: int, a: int, half: Array) -> None:
    """Compute a^2, with slopes s_a (a(box) + a(c)); never negative. ``out`` must not be a."""
    for j in (CENTRE, RANGE):
        low, high = abs(at[a, j]), abs(at[a, j + 1])
        least = 0.0 if at[a, j] <= 0.0 <= at[a, j + 1] else min(low, high)
        most = max(low, high)
        at[out, j], at[out, j + 1] = max(down(least * least), 0.0), up(most * most)
    low, high = down(at[a, 2] + at[a, 0]), up(at[a, 3] + at[a, 1])
    for j in range(SLOPES, at.shape[1], 2):
        at[out, j], at[out, j + 1] = times(at[a, j], at[a, j + 1], low, high)
    settle(at, out, half)


@kernel
def inverse(at: Array, out: int, a: int, half: Array) -> bool:
    """Return 1/a, with slopes -s_a/(a(box) a(c)); false where a may be zero. ``out`` must not be a."""
    if not (at[a, RANGE] > SMALL or at[a, RANGE + 1] < -SMALL):
        return False
    for j in (CENTRE, RANGE):
        at[out, j], at[out, j + 1] = down(1.0 / at[a, j + 1]), up(1.0 / at[a, j])
    low, high = times(-at[out, 1], -at[out, 0], at[out, 2], at[out, 3])
    for j in range(SLOPES, at.shape[1], 2):
        at[out, j], at[out, j + 1] = times(at[a, j], at[a, j + 1], low, high)
    settle(at, out, half)
    return True


@kernel
def root(at: Array, out: int, a: int, half: Array) -> bool:
    """Return the positive square root, with slopes s_a/(root(box) + root(c)); false where a may be negative or zero."""
    if not at[a, RANGE] > SMALL:
        return False
    for j in (CENTRE, RANGE):
        at[out, j], at[out, j + 1] = down(math.sqrt(at[a, j])), up(math.sqrt(at[a, j + 1]))
    low, high = down(1.0 / up(at[out, 1] + at[out, 3])), up(1.0 / down(at[out, 0] + at[out, 2]))
    for j in range(SLOPES, at.shape[1], 2):
        at[out, j], at[out, j + 1] = times(at[a, j], at[a, j + 1], low, high)
    settle(at, out, half)
    return True


@inline
def _clipped(at: Array, out: int) -> None:
    """Cut an enclosure off at -1 and 1, beyond which no sine or cosine lies."""
    for j in (CENTRE, RANGE):
        at[out, j], at[out, j + 1] = max(at[out, j], -1.0), min(at[out, j + 1], 1.0)


@inline
def _turned(at: Array, out: int, value: float, quarter: float, reach: float) -> None:
    """Compute the centre and range of value cos(d) + quarter sin(d), |d| <= reach, from 1 - d^2/2 <= cos(d) <= 1."""
    # sincos errs by less than 0.8 units in the last place
    at[out, 0], at[out, 1] = value - 2.0 * ULP, value + 2.0 * ULP
    sag = up(0.5 * up(reach * reach)) * max(abs(at[out, 0]), abs(at[out, 1]))
    swing = up((abs(quarter) + 2.0 * ULP) * reach)
    low, high = at[out, 0], at[out, 1]
    if high > 0.0:
        low = down(low - up(sag))
    if low < 0.0:
        high = up(high + up(sag))
    at[out, 2], at[out, 3] = down(low - swing), up(high + swing)


@kernel
def sine_cosine(at: Array, sine: int, cosine: int, a: int, factor: float, half: Array) -> None:
    """Compute the sine and cosine of factor a, for a factor of 1 or 0.5 and a form whose centre is one number.

    The slopes are those of the curves over the range.
    """
    centre = factor * at[a, CENTRE]
    reach = factor * max(up(at[a, RANGE + 1] - at[a, CENTRE]), up(at[a, CENTRE] - at[a, RANGE]))
    s, c = sincos(centre)
    _turned(at, sine, s, c, reach)
    _turned(at, cosine, c, -s, reach)
    _clipped(at, sine)
    _clipped(at, cosine)
    for j in range(SLOPES, at.shape[1], 2):
        low, high = factor * at[a, j], factor * at[a, j + 1]
        at[sine, j], at[sine, j + 1] = times(low, high, at[cosine, 2], at[cosine, 3])
        at[cosine, j], at[cosine, j + 1] = times(low, high, -at[sine, 3], -at[sine, 2])
    settle(at, sine, half)
    settle(at, cosine, half)


@kernel
def _done(what: int, at: Array, out: int, a: int, b: int, p: float, q: float, half: Array) -> bool:
    """Carry out one operation of a tape; false where it has no enclosure."""
    if what == COMBINE:
        combine(at, out, p, a, q, b, half)
    elif what == MULTIPLY and a == b:
        square(at, out, a, half)
    elif what == MULTIPLY:
        multiply(at, out, a, b, half)
    elif what == INVERSE:
        return bool(inverse(at, out, a, half))
    elif what == ROOT:
        return bool(root(at, out, a, half))
    else:
        sine_cosine(at, out, out + 1, a, p, half)
    return True


@kernel
def _slopes(
    operations: Any, factors: Array, given: Any, values: Array, errors: Array, varied: Any, centre: Array, half: Array,
    wanted: Any, forms: int, low: Array, high: Array,
) -> None:  # fmt: skip
    at = np.zeros((forms, width(varied.shape[0])))
    for i in range(centre.shape[0]):
        for j in range(given.shape[0]):
            constant(at, given[j], down(values[i, j] - errors[j]), up(values[i, j] + errors[j]))
        for k in range(varied.shape[0]):
            variable(at, varied[k], centre[i, k], half[i], k)
        known = True
        for j in range(operations.shape[0]):
            what, out, a, b = operations[j]
            if what == CONSTANT:
                constant(at, out, factors[j, 0], factors[j, 0])
            else:
                known = _done(what, at, out, a, b, factors[j, 0], factors[j, 1], half[i])
            if not known:
                break
        if known:
            for j in range(wanted.shape[0]):
                low[i, j], high[i, j] = at[wanted[j], RANGE], at[wanted[j], RANGE + 1]


def slopes(formula: Formula, boxes: Boxes) -> tuple[Array, Array]:
    """Ends of the wanted numbers over every box; nan where there is no enclosure."""
    low, high = (np.full((len(boxes), len(formula.wanted)), np.nan) for _ in range(2))
    _slopes(*arguments(formula, boxes), formula.wanted, formula.forms, low, high)
    return low, high
