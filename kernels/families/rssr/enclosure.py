"""Enclosure of the spatial crank-rocker's velocity psi'(phi + z) over a disc of complex z; docs/rssr.md, section 6.1.

    psi' = (A + B/T)/R,   A = X' Y - X Y',   B = W R'/2 - R W',   T = sqrt(R - W^2)                              (3a)

which is (3) with cos psi and sin psi written out, so everything is made of trigonometric polynomials of phi, of degree
1 (X, Y, W, A), 2 (R, Delta) and 3 (B).  About phi they are polynomials in sin z and 1 - cos z.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from kernels.certified.enclosure import EPS, GUARD, WIDTH, add, inverse, multiply, root, trigonometric
from kernels.families.rssr.closure import Array, Reduced, closure_terms
from kernels.jit import inline, kernel

VELOCITY, R, DELTA, B, T, PER_T, _PRODUCT = (k * WIDTH for k in range(7))
PER_R = T  # which is needed for 1/T only
SIZE = 7 * WIDTH


class Spread(NamedTuple):
    """X, Y, W, R and Delta about one crank angle as series in s = sin z and m = 1 - cos z.

    ``x0 + x1 s + x2 m`` is X, and Y and W alike; r0 ... r4 are the coefficients of 1, s, m, s m, m^2 in R, d0 ... d4
    those in Delta.  ``x``, ``y``, ``w``, ``square`` bound sizes, ``ex``, ``ey``, ``ew``, ``e_square``, ``e_delta`` what
    the functions are off by.
    """

    x0: Any
    x1: Any
    x2: Any
    y0: Any
    y1: Any
    y2: Any
    w0: Any
    w1: Any
    w2: Any
    x: Any
    y: Any
    w: Any
    ex: Any
    ey: Any
    ew: Any
    square: Any
    e_square: Any
    e_delta: Any
    r0: Any
    r1: Any
    r2: Any
    r3: Any
    r4: Any
    d0: Any
    d1: Any
    d2: Any
    d3: Any
    d4: Any


@inline
def spread(
    e: Any, y0: Any, ca: Any, k0: Any, k1: Any, k2: Any, w_size: Any, u: Any, v: Any, reach: Any
) -> Spread:  # fmt: skip
    """Write the closure on |z| <= reach <= 1 about (cos phi, sin phi) = (u, v) as series.

    The exact motion of the given doubles is meant: X, Y, W are off by at most 5, 7, 18 eps of the magnitudes that
    make them up (docs/rssr.md, section 4.2), their derivatives by less; the errors below are those times the sizes of
    sin z and 1 - cos z.
    """
    x0, yy0, w0 = closure_terms(e, y0, ca, k0, k1, k2, u, v)
    x1, x2 = v, u
    y1, y2 = ca * u, -ca * v
    w1, w2 = k1 * u + k2 * v, k2 * u - k1 * v
    s, m = 1.18 * reach, 0.55 * reach * reach  # sizes of sin z and 1 - cos z
    x, y, w = (
        abs(x0) + s * abs(x1) + m * abs(x2),
        abs(yy0) + s * abs(y1) + m * abs(y2),
        abs(w0) + s * abs(w1) + m * abs(w2),
    )
    ex, ey, ew = 9.0 * EPS * (abs(e) + 1.0), 16.0 * EPS * (abs(y0) + abs(ca)), 40.0 * EPS * w_size
    square = x * x + y * y
    e_square = 2.0 * (x * ex + y * ey) + ex * ex + ey * ey + 12.0 * EPS * square
    r0, r1, r2 = x0 * x0 + yy0 * yy0, 2.0 * (x0 * x1 + yy0 * y1), 2.0 * (x0 * x2 + yy0 * y2 + x1 * x1 + y1 * y1)
    r3, r4 = 2.0 * (x1 * x2 + y1 * y2), (x2 - x1) * (x2 + x1) + (y2 - y1) * (y2 + y1)
    return Spread(
        x0, x1, x2, yy0, y1, y2, w0, w1, w2, x, y, w, ex, ey, ew, square, e_square,
        e_square + 2.0 * w * ew + ew * ew + 12.0 * EPS * w * w, r0, r1, r2, r3, r4,
        r0 - w0 * w0, r1 - 2.0 * w0 * w1, r2 - 2.0 * (w0 * w2 + w1 * w1), r3 - 2.0 * w1 * w2,
        r4 - (w2 - w1) * (w2 + w1),
    )  # fmt: skip


@kernel
def enclose(at: Array, r: Reduced, u: float, v: float, reach: float) -> bool:
    """Enclose the velocity of the mirrored mechanism on |z| <= reach <= 1 in VELOCITY;
    return false if it cannot be enclosed.
    """
    z = spread(r.e, r.y0, r.ca, r.k0, r.k1, r.k2, r.w_size, u, v, reach)
    x0, x1, x2, y0, y1, y2, w0, w1, w2 = z.x0, z.x1, z.x2, z.y0, z.y1, z.y2, z.w0, z.w1, z.w2
    x, y, w, ex, ey, ew, square, e_square = z.x, z.y, z.w, z.ex, z.ey, z.ew, z.square, z.e_square
    r0, r1, r2, r3, r4 = z.r0, z.r1, z.r2, z.r3, z.r4
    # Sizes of the derivatives of X, Y, W, and what they are off by.
    s, aca, turn = 1.18 * reach, abs(r.ca), abs(r.k1) + abs(r.k2)
    dx, dy, dw = 1.55 * abs(x1) + s * abs(x2), 1.55 * abs(y1) + s * abs(y2), 1.55 * abs(w1) + s * abs(w2)
    edx, edy, edw = 6.0 * EPS, 14.0 * EPS * aca, 26.0 * EPS * turn
    half_slope = x * dx + y * dy  # of R'/2
    e_slope = x * edx + dx * ex + ex * edx + y * edy + dy * ey + ey * edy + 12.0 * EPS * half_slope
    trigonometric(at, R, reach, r0, r1, r2, r3, r4, 0.0, 0.0, e_square)
    trigonometric(at, DELTA, reach, z.d0, z.d1, z.d2, z.d3, z.d4, 0.0, 0.0, z.e_delta)
    if not root(at, DELTA, T, PER_T):
        return False
    # R'/2 = q0 + q1 s + q2 m + q3 s m + q4 m^2
    q0, q1, q2, q3, q4 = 0.5 * r1, 0.5 * r2, 0.5 * (3.0 * r3 - r1), r4, -r3
    error = square * edw + e_square * (dw + edw) + ew * (half_slope + e_slope) + w * e_slope
    trigonometric(
        at, B, reach,
        w0 * q0 - r0 * w1,
        w0 * q1 + w1 * q0 - r1 * w1 - r0 * w2,
        w0 * q2 + 2.0 * w1 * q1 + w2 * q0 - (r2 - r0) * w1 - 2.0 * r1 * w2,
        w0 * q3 + w1 * q2 + w2 * q1 - (r3 - r1) * w1 - r2 * w2,
        w0 * q4 + w1 * (2.0 * q3 - q1) + w2 * q2 - (r4 - r2) * w1 - (2.0 * r3 - r1) * w2,
        w1 * q4 + w2 * q3 + r3 * w1 - r4 * w2,
        w2 * q4 - w1 * q3 + r4 * w1 + r3 * w2,
        error + 48.0 * EPS * (square * (dw + turn) + w * half_slope),
    )  # fmt: skip
    multiply(at, B, PER_T, _PRODUCT)
    a0 = x1 * y0 - x0 * y1
    error = dx * ey + y * edx + edx * ey + x * edy + dy * ex + ex * edy + 12.0 * EPS * (dx * y + x * dy + aca)
    trigonometric(at, B, reach, a0, y0 * x2 - x0 * y2, r.ca - a0, 0.0, 0.0, 0.0, 0.0, error * GUARD)
    add(at, B, _PRODUCT, B)
    if not inverse(at, R, PER_R):
        return False
    multiply(at, B, PER_R, VELOCITY)
    return True
