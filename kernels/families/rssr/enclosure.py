"""Enclosure of the spatial crank-rocker's velocity psi'(phi + z) over a disc of complex z; docs/rssr.md, section 6.1.

    psi' = (A + B/T)/R,   A = X' Y - X Y',   B = W R'/2 - R W',   T = sqrt(R - W^2)                              (3a)

which is (3) with cos psi and sin psi written out, so everything is made of trigonometric polynomials of phi, of degree
1 (X, Y, W, A), 2 (R, Delta) and 3 (B).  About phi they are polynomials in sin z and 1 - cos z.
"""

from __future__ import annotations

from kernels._jit import kernel
from kernels.enclosure import EPS, GUARD, WIDTH, add, inverse, multiply, root, trigonometric
from kernels.families.rssr.closure import Array, Reduced, closure_terms

VELOCITY, R, DELTA, B, T, PER_T, _PRODUCT = (k * WIDTH for k in range(7))
PER_R = T  # which is needed for 1/T only
SIZE = 7 * WIDTH


@kernel
def enclose(at: Array, r: Reduced, u: float, v: float, reach: float) -> bool:
    """Enclose the velocity of the mirrored mechanism on |z| <= reach <= 1 in VELOCITY;
    return false if it cannot be enclosed.

    The exact motion of the given doubles is enclosed: X, Y, W are off by at most 5, 7, 18 eps of the magnitudes that
    make them up (docs/rssr.md, section 4.2), their derivatives by less; the errors below are those times the sizes of
    sin z and 1 - cos z.
    """
    x0, y0, w0 = closure_terms(r.e, r.y0, r.ca, r.k0, r.k1, r.k2, u, v)
    x1, x2 = v, u
    y1, y2 = r.ca * u, -r.ca * v
    w1, w2 = r.k1 * u + r.k2 * v, r.k2 * u - r.k1 * v
    s, m = 1.18 * reach, 0.55 * reach * reach  # sizes of sin z and 1 - cos z
    # Sizes of X, Y, W and their derivatives, and what they are off by.
    aca, turn = abs(r.ca), abs(r.k1) + abs(r.k2)
    x, y, w = (
        abs(x0) + s * abs(x1) + m * abs(x2),
        abs(y0) + s * abs(y1) + m * abs(y2),
        abs(w0) + s * abs(w1) + m * abs(w2),
    )
    dx, dy, dw = 1.55 * abs(x1) + s * abs(x2), 1.55 * abs(y1) + s * abs(y2), 1.55 * abs(w1) + s * abs(w2)
    ex, ey, ew = 9.0 * EPS * (abs(r.e) + 1.0), 16.0 * EPS * (abs(r.y0) + aca), 40.0 * EPS * r.w_size
    edx, edy, edw = 6.0 * EPS, 14.0 * EPS * aca, 26.0 * EPS * turn

    square, half_slope = x * x + y * y, x * dx + y * dy  # of R and R'/2
    e_square = 2.0 * (x * ex + y * ey) + ex * ex + ey * ey + 12.0 * EPS * square
    e_slope = x * edx + dx * ex + ex * edx + y * edy + dy * ey + ey * edy + 12.0 * EPS * half_slope
    r0, r1, r2 = x0 * x0 + y0 * y0, 2.0 * (x0 * x1 + y0 * y1), 2.0 * (x0 * x2 + y0 * y2 + x1 * x1 + y1 * y1)
    r3, r4 = 2.0 * (x1 * x2 + y1 * y2), (x2 - x1) * (x2 + x1) + (y2 - y1) * (y2 + y1)
    trigonometric(at, R, reach, r0, r1, r2, r3, r4, 0.0, 0.0, e_square)
    trigonometric(
        at, DELTA, reach, r0 - w0 * w0, r1 - 2.0 * w0 * w1, r2 - 2.0 * (w0 * w2 + w1 * w1), r3 - 2.0 * w1 * w2,
        r4 - (w2 - w1) * (w2 + w1), 0.0, 0.0, e_square + 2.0 * w * ew + ew * ew + 12.0 * EPS * w * w,
    )  # fmt: skip
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
