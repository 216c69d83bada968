"""Taylor models of second order: enclosures of functions over a box, with a remainder of third order in its width.

Over the box |x_k - c_k| <= h_k, with xi_k = (x_k - c_k)/h_k between -1 and 1, a *form* holds a function as

    F = F0 + sum_k L_k xi_k + sum_(k<=l) Q_kl xi_k xi_l + rest,   abs(rest) <= R                                     (1)

(K. Makino and M. Berz, Taylor models and other validated functional inclusion methods, Int. J. Pure Appl. Math. 4,
2003).  Terms of third and higher order go into R, and so does all rounding: coefficients are ordinary numbers, and
every operation adds to R more than its coefficients can have lost.  What several terms of a formula have in common
cancels in the coefficients, where intervals would add their widths.  ``make bench-enclosures`` compares them with
intervals and balls (docs/proof.md).

Forms lie in the rows of one array: F0, L, Q (k, l = 11, 12, ..., 22, ...), R.  An operation returns false where it has
no enclosure.  A number that leaves the range of float64 makes R infinite or nan, and every test of such a form fails.
"""

from __future__ import annotations

import math

from kernels.arithmetic.sincos import sincos
from kernels.jit import inline, kernel
from kernels.types import Array

# No coefficient of an operation is a sum of more than 5 products, and no bound one of more than 30 terms: relative to
# the sum of magnitudes rounding costs less than this.
ROUNDING = 2.0**-47
TINY = 1e-290  # more than rounding can cost where numbers are too small for ROUNDING
SMALL = 1e-30
VALUE, LINEAR = 0, 1


@inline
def up(x: float) -> float:
    """Upper bound of any sum or product that was rounded to x."""
    return x + (abs(x) * 2.0**-52 + 1e-300)


@inline
def width(variables: int) -> int:
    """Return the number of columns of a form in ``variables`` variables."""
    return 2 + variables + variables * (variables + 1) // 2


@inline
def sizes(at: Array, a: int, n: int) -> tuple[float, float, float]:
    """Sum |L|, sum |Q| and R of a form."""
    linear, square = 0.0, 0.0
    rest = at.shape[1] - 1
    for j in range(LINEAR, LINEAR + n):
        linear += abs(at[a, j])
    for j in range(LINEAR + n, rest):
        square += abs(at[a, j])
    return linear, square, float(at[a, rest])


@kernel
def constant(at: Array, out: int, low: float, high: float) -> None:
    """Write the form of an unknown constant between two ends."""
    at[out, :] = 0.0
    at[out, VALUE] = 0.5 * (low + high)
    if high > low:
        at[out, at.shape[1] - 1] = up(up(high - at[out, VALUE]) + up(at[out, VALUE] - low))


@kernel
def variable(at: Array, out: int, centre: float, half: Array, k: int) -> None:
    """Write the form of the k-th variable."""
    at[out, :] = 0.0
    at[out, VALUE], at[out, LINEAR + k] = centre, half[k]


@kernel
def combine(at: Array, out: int, p: float, a: int, q: float, b: int) -> None:
    """Compute p a + q b for two numbers p, q."""
    size, rest = 0.0, at.shape[1] - 1
    for j in range(rest):
        first, second = p * at[a, j], q * at[b, j]
        at[out, j] = first + second
        size += abs(first) + abs(second)
    lost = abs(p) * at[a, rest] + abs(q) * at[b, rest]
    at[out, rest] = lost * (1.0 + ROUNDING) + (size * ROUNDING + TINY)


@kernel
def multiply(at: Array, out: int, a: int, b: int, n: int) -> None:
    """Compute the product a b; ``out`` must be neither a nor b."""
    rest = at.shape[1] - 1
    p, q = at[a, VALUE], at[b, VALUE]
    la, qa, ra = sizes(at, a, n)
    lb, qb, rb = sizes(at, b, n)
    at[out, VALUE] = p * q
    for j in range(LINEAR, rest):
        at[out, j] = p * at[b, j] + at[a, j] * q
    place = LINEAR + n
    for k in range(LINEAR, LINEAR + n):
        at[out, place] += at[a, k] * at[b, k]
        place += 1
        for m in range(k + 1, LINEAR + n):
            at[out, place] += at[a, k] * at[b, m] + at[a, m] * at[b, k]
            place += 1
    whole_a, whole_b = abs(p) + la + qa, abs(q) + lb + qb
    lost = la * qb + qa * (lb + qb) + ra * (whole_b + rb) + rb * whole_a
    at[out, rest] = lost * (1.0 + ROUNDING) + (whole_a * whole_b * ROUNDING + TINY)


@inline
def _composed(
    at: Array, out: int, a: int, n: int, value: float, first: float, second: float, third: float, unit: float
) -> None:
    """Compute value + first d + second d^2 + [-third, third] with d = unit (a - F0 of a).

    The four numbers are known to 2 ROUNDING of value, and of what they multiply.
    """
    rest = at.shape[1] - 1
    linear, square, left = sizes(at, a, n)
    linear, square, left = abs(unit) * linear, abs(unit) * square, abs(unit) * left
    one, two = first * unit, second * unit * unit
    place = LINEAR + n
    for k in range(LINEAR, LINEAR + n):
        at[out, place] = one * at[a, place] + two * (at[a, k] * at[a, k])
        place += 1
        for m in range(k + 1, LINEAR + n):
            at[out, place] = one * at[a, place] + 2.0 * two * (at[a, k] * at[a, m])
            place += 1
    for k in range(LINEAR, LINEAR + n):
        at[out, k] = one * at[a, k]
    at[out, VALUE] = value
    reach = linear + square
    higher = square * (2.0 * linear + square) + left * (2.0 * reach + left)
    lost = abs(first) * left + abs(second) * higher + third
    all_terms = abs(value) + (abs(first) + abs(second) * (reach + left)) * (reach + left)
    at[out, rest] = lost * (1.0 + ROUNDING) + (all_terms * 4.0 * ROUNDING + TINY)


@kernel
def inverse(at: Array, out: int, a: int, n: int) -> bool:
    """Compute 1/a and return whether that is possible: not where a may be zero.  ``out`` must not be a.

    1/(1 + d) = 1 - d + d^2 - d^3/(1 + d).
    """
    linear, square, left = sizes(at, a, n)
    value = at[a, VALUE]
    spread = (linear + square + left) * (1.0 + ROUNDING)
    if not abs(value) - spread > SMALL:
        return False
    unit = 1.0 / value
    d = spread * abs(unit) * (1.0 + ROUNDING)
    if not d < 1.0 - 1e-9:
        return False
    _composed(at, out, a, n, unit, -unit, unit, abs(unit) * (d * d * d / (1.0 - d)) * (1.0 + 1e-6), unit)
    return True


@kernel
def root(at: Array, out: int, a: int, n: int) -> bool:
    """Compute the positive square root of a and return whether that is possible: not where a may be zero or less.

    sqrt(1 + d) = 1 + d/2 - d^2/8 + d^3/16 (1 + d')^(-5/2) for some d' between 0 and d.  ``out`` must not be a.
    """
    linear, square, left = sizes(at, a, n)
    value = at[a, VALUE]
    spread = (linear + square + left) * (1.0 + ROUNDING)
    if not value - spread > SMALL:
        return False
    unit, size = 1.0 / value, math.sqrt(value)
    d = spread * unit * (1.0 + ROUNDING)
    if not d < 1.0 - 1e-9:
        return False
    third = size * (d * d * d / (16.0 * (1.0 - d) * (1.0 - d) * math.sqrt(1.0 - d))) * (1.0 + 1e-5)
    _composed(at, out, a, n, size, 0.5 * size, -0.125 * size, third, unit)
    return True


@kernel
def sine_cosine(at: Array, sine: int, cosine: int, a: int, factor: float, n: int) -> None:
    """Compute the sine and cosine of factor a, for a factor of 1 or 0.5; terms of third order are below d^3/6."""
    linear, square, left = sizes(at, a, n)
    d = factor * (linear + square + left) * (1.0 + ROUNDING)
    third = d * d * d / 6.0
    # sincos errs by less than 0.8 units in the last place: the value is known far better than _composed asks for,
    # except near a zero, where a magnitude of at most 1 counts.
    s, c = sincos(factor * at[a, VALUE])
    lost = third + ROUNDING * (1.0 + d) * (1.0 + d)
    _composed(at, sine, a, n, s, c, -0.5 * s, lost, factor)
    _composed(at, cosine, a, n, c, -s, -0.5 * c, lost, factor)


@kernel
def least(form: Array, n: int) -> float:
    """Lower bound of a form over its box.

    Linear and square term of a variable are bounded together: by -L^2/(4 Q) if their parabola has its minimum inside.
    """
    bound, size, place = form[VALUE], abs(form[VALUE]), LINEAR + n
    for k in range(n):
        line, bend = abs(form[LINEAR + k]), form[place]
        bound -= line * line / (4.0 * bend) if 2.0 * bend > line else line - bend
        size += line + abs(bend)
        for m in range(place + 1, place + n - k):
            bound -= abs(form[m])
            size += abs(form[m])
        place += n - k
    rest = form[form.shape[0] - 1]
    return float(bound - rest * (1.0 + ROUNDING) - (size * ROUNDING + TINY))
