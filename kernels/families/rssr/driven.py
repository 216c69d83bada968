"""Enclosure of a crank-rocker's velocity, and of a point driven by crank-rockers: docs/rssr.md, docs/guide.md.

Crank-rockers in series drive a guided point, which has a travel along its line and a deviation across it.

The planar four-bar of a guide is the crank-rocker with parallel axes and all links in one plane, so each stage of the
chain is one, its crank driven by the enclosure of the rocker before it.  The closure of the first stage is a known
trigonometric polynomial of the crank angle; that of the later ones is composed.  Several designs are enclosed side by
side, each about its own crank angle.

    psi' = (A + B/T)/R,   A = X' Y - X Y',   B = W R'/2 - R W',   T = sqrt(R - W^2)                              (3a)

which is (3) of docs/rssr.md with cos psi and sin psi written out, so everything is made of trigonometric polynomials of
phi, of degree 1 (X, Y, W, A), 2 (R, Delta) and 3 (B).  About phi they are polynomials in sin z and 1 - cos z.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.arithmetic.sincos import sincos
from kernels.certified.cells import CENTRE, REACH
from kernels.certified.jets import (
    GUARD,
    LANES,
    WIDTH,
    Jet,
    circle,
    combined,
    double_harmonic,
    get,
    harmonic,
    inverse,
    product,
    put,
    reciprocal,
    root,
    size_of,
    sum_of,
    triple_harmonic,
)
from kernels.families.rssr.closure import closure_terms, reduce_design
from kernels.jit import inline, kernel
from kernels.types import EPS, Array

# X, Y, W, R and Delta about one crank angle as series in s = sin z and m = 1 - cos z.
# ``x0 + x1 s + x2 m`` is X, and Y and W alike; r0 ... r4 are the coefficients of 1, s, m, s m, m^2 in R, d0 ... d4
# those in Delta. ``x``, ``y``, ``w``, ``square`` bound sizes, ``ex``, ``ey``, ``ew``, ``e_square``, ``e_delta`` the
# errors of the functions.
Spread = namedtuple(
    "Spread", "x0 x1 x2 y0 y1 y2 w0 w1 w2 x y w ex ey ew square e_square e_delta r0 r1 r2 r3 r4 d0 d1 d2 d3 d4"
)


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


@inline
def velocity_terms(z: Spread, ca: Any, k1: Any, k2: Any, reach: Any) -> tuple[Jet, Jet]:
    """Enclose A and B of the mirrored mechanism's velocity from :func:`spread` of its closure."""
    x0, x1, x2, y0, y1, y2, w0, w1, w2 = z.x0, z.x1, z.x2, z.y0, z.y1, z.y2, z.w0, z.w1, z.w2
    x, y, w, ex, ey, ew, square, e_square = z.x, z.y, z.w, z.ex, z.ey, z.ew, z.square, z.e_square
    r0, r1, r2, r3, r4 = z.r0, z.r1, z.r2, z.r3, z.r4
    # Sizes of the derivatives of X, Y, W, and their errors.
    s, aca, turn = 1.18 * reach, abs(ca), abs(k1) + abs(k2)
    dx, dy, dw = 1.55 * abs(x1) + s * abs(x2), 1.55 * abs(y1) + s * abs(y2), 1.55 * abs(w1) + s * abs(w2)
    edx, edy, edw = 6.0 * EPS, 14.0 * EPS * aca, 26.0 * EPS * turn
    half_slope = x * dx + y * dy  # of R'/2
    e_slope = x * edx + dx * ex + ex * edx + y * edy + dy * ey + ey * edy + 12.0 * EPS * half_slope
    # R'/2 = q0 + q1 s + q2 m + q3 s m + q4 m^2
    q0, q1, q2, q3, q4 = 0.5 * r1, 0.5 * r2, 0.5 * (3.0 * r3 - r1), r4, -r3
    error = square * edw + e_square * (dw + edw) + ew * (half_slope + e_slope) + w * e_slope
    b = triple_harmonic(
        w0 * q0 - r0 * w1,
        w0 * q1 + w1 * q0 - r1 * w1 - r0 * w2,
        w0 * q2 + 2.0 * w1 * q1 + w2 * q0 - (r2 - r0) * w1 - 2.0 * r1 * w2,
        w0 * q3 + w1 * q2 + w2 * q1 - (r3 - r1) * w1 - r2 * w2,
        w0 * q4 + w1 * (2.0 * q3 - q1) + w2 * q2 - (r4 - r2) * w1 - (2.0 * r3 - r1) * w2,
        w1 * q4 + w2 * q3 + r3 * w1 - r4 * w2,
        w2 * q4 - w1 * q3 + r4 * w1 + r3 * w2,
        reach,
        error + 48.0 * EPS * (square * (dw + turn) + w * half_slope),
    )  # fmt: skip
    a0 = x1 * y0 - x0 * y1
    error = dx * ey + y * edx + edx * ey + x * edy + dy * ex + ex * edy + 12.0 * EPS * (dx * y + x * dy + aca)
    return harmonic(a0, y0 * x2 - x0 * y2, ca - a0, reach, error * GUARD), b


Stages = NDArray[np.float64]
# Rows of the numbers of a design: of each stage those of its closure; then a, b and a', b' of its outputs
# a cos psi + b sin psi and a' cos psi + b' sin psi, the b with the sign of the branch, and the error of all four.  The
# outputs are cosine and sine of the next crank angle, of the last stage the rocker's part of the point.
E, Y0, CA, K0, K1, K2, W_SIZE, A1, B1, A2, B2, OFF = (k * LANES for k in range(12))
STAGE = 12 * LANES
# Behind the stages: the crank's part of the point, the error of its factors, the constant across the line, its error.
P1, P2, P_OFF, CONSTANT, CONSTANT_OFF = (k * LANES for k in range(5))
SHARES = 5
# Places of jets: the crank; the closure; 1/R, which stands where the discriminant was; the point along and across the
# line, and the velocity of the rocker.
COS, SIN, X, Y, W, R, T, PER, ALONG, ACROSS, RATE = (k * WIDTH * LANES for k in range(11))
JETS = 11 * WIDTH * LANES


@inline
def load(lane: int, numbers: Array, stages: Stages, couplings: Array, shares: Array, i: int) -> None:
    """Write the numbers of design i into its lane."""
    count = stages.shape[0]
    for k in range(count):
        r, row = reduce_design(stages[k], i), k * STAGE + lane
        numbers[row + E], numbers[row + Y0], numbers[row + CA] = r.e, r.y0, r.ca
        numbers[row + K0], numbers[row + K1], numbers[row + K2], numbers[row + W_SIZE] = r.k0, r.k1, r.k2, r.w_size
        if k + 1 < count:
            kappa, offset = couplings[k, i, 0] * r.branch, couplings[k, i, 1]
            cos, sin, numbers[row + OFF] = math.cos(offset), math.sin(offset), 3.0 * EPS
            numbers[row + A1], numbers[row + B1] = cos, -kappa * sin
            numbers[row + A2], numbers[row + B2] = sin, kappa * cos
        else:
            q1, q2, numbers[row + OFF] = shares[i, 2], shares[i, 3], shares[i, 5]
            numbers[row + A1], numbers[row + B1] = q1, -q2 * r.branch
            numbers[row + A2], numbers[row + B2] = q2, q1 * r.branch
    row = count * STAGE + lane
    numbers[row + P1], numbers[row + P2], numbers[row + P_OFF] = shares[i, 0], shares[i, 1], shares[i, 4]
    numbers[row + CONSTANT], numbers[row + CONSTANT_OFF] = shares[i, 6], shares[i, 7]


@inline
def _spread(r: Array, walk: Array, i: int) -> Spread:
    """Write the closure of the first stage of lane i on its cell as series."""
    v, u = sincos(walk[CENTRE + i])
    return spread(r[E + i], r[Y0 + i], r[CA + i], r[K0 + i], r[K1 + i], r[K2 + i], r[W_SIZE + i], u, v, walk[REACH + i])


@kernel
def _first(lanes: int, r: Array, walk: Array, jets: Array) -> None:
    """Enclose X, Y, W, R = X^2 + Y^2 and, in PER, the discriminant R - W^2 of the first stage."""
    for i in range(lanes):
        reach = walk[REACH + i]
        z = _spread(r, walk, i)
        put(jets, X + i, LANES, harmonic(z.x0, z.x1, z.x2, reach, z.ex))
        put(jets, Y + i, LANES, harmonic(z.y0, z.y1, z.y2, reach, z.ey))
        put(jets, W + i, LANES, harmonic(z.w0, z.w1, z.w2, reach, z.ew))
        put(jets, R + i, LANES, double_harmonic(z.r0, z.r1, z.r2, z.r3, z.r4, reach, z.e_square))
        put(jets, PER + i, LANES, double_harmonic(z.d0, z.d1, z.d2, z.d3, z.d4, reach, z.e_delta))


@kernel
def _driven(lanes: int, r: Array, jets: Array) -> None:
    """Enclose X, Y, W, R and the discriminant of a later stage from cosine and sine of its crank; errors as in 4.2."""
    for i in range(lanes):
        u, v = get(jets, COS + i, LANES), get(jets, SIN + i, LANES)
        e, y0, ca, k1, k2 = r[E + i], r[Y0 + i], r[CA + i], r[K1 + i], r[K2 + i]
        put(jets, X + i, LANES, combined(e, -1.0, u, 0.0, u, 4.0 * EPS * abs(e)))
        put(jets, Y + i, LANES, combined(y0, ca, v, 0.0, v, 6.0 * EPS * (abs(y0) + abs(ca) * size_of(v))))
        turning = 6.0 * EPS * (abs(k1) * size_of(v) + abs(k2) * size_of(u))
        put(jets, W + i, LANES, combined(r[K0 + i], k1, v, -k2, u, 16.0 * EPS * r[W_SIZE + i] + turning))
    for i in range(lanes):
        a, b, c = get(jets, X + i, LANES), get(jets, Y + i, LANES), get(jets, W + i, LANES)
        rr = sum_of(product(a, a), product(b, b))
        put(jets, R + i, LANES, rr)
        put(jets, PER + i, LANES, combined(0.0, 1.0, rr, -1.0, product(c, c), 0.0))


@inline
def _mixed(lanes: int, r: Array, a: int, b: int, jets: Array, out: int) -> None:
    """Enclose a cos psi + b sin psi of the rocker, (2*): (-a X + b Y) W/R + (-a Y - b X) T/R."""
    for i in range(lanes):
        x, y, p, q = get(jets, X + i, LANES), get(jets, Y + i, LANES), r[a + i], r[b + i]
        error = r[OFF + i] * (size_of(x) + size_of(y))
        of_w, of_t = combined(0.0, -p, x, q, y, error), combined(0.0, -p, y, -q, x, error)
        total = sum_of(product(of_w, get(jets, W + i, LANES)), product(of_t, get(jets, T + i, LANES)))
        put(jets, out + i, LANES, product(total, get(jets, PER + i, LANES)))


@kernel
def _hand_on(lanes: int, r: Array, jets: Array) -> None:
    """Enclose cosine and sine of the next stage's crank."""
    _mixed(lanes, r, A1, B1, jets, COS)
    _mixed(lanes, r, A2, B2, jets, SIN)


@kernel
def _point_along(lanes: int, r: Array, ends: Array, jets: Array) -> None:
    """Enclose the travel, without its constant: the rocker's part and the crank's p1 cos - p2 sin."""
    _mixed(lanes, r, A1, B1, jets, ALONG)
    for i in range(lanes):
        u, v = get(jets, COS + i, LANES), get(jets, SIN + i, LANES)
        crank = combined(0.0, ends[P1 + i], u, -ends[P2 + i], v, ends[P_OFF + i] * (size_of(u) + size_of(v)))
        put(jets, ALONG + i, LANES, sum_of(crank, get(jets, ALONG + i, LANES)))


@kernel
def _point_across(lanes: int, r: Array, ends: Array, jets: Array) -> None:
    """Enclose the deviation: the rocker's part, the crank's p2 cos + p1 sin, and the constant."""
    _mixed(lanes, r, A2, B2, jets, ACROSS)
    for i in range(lanes):
        u, v = get(jets, COS + i, LANES), get(jets, SIN + i, LANES)
        error = ends[P_OFF + i] * (size_of(u) + size_of(v)) + ends[CONSTANT_OFF + i]
        crank = combined(ends[CONSTANT + i], ends[P2 + i], u, ends[P1 + i], v, error)
        put(jets, ACROSS + i, LANES, sum_of(crank, get(jets, ACROSS + i, LANES)))


@kernel
def _velocity(lanes: int, r: Array, walk: Array, jets: Array, good: Array) -> None:
    """Enclose the velocity of the mirrored first stage, (A + B/T)/R."""
    for i in range(lanes):
        a, b = velocity_terms(_spread(r, walk, i), r[CA + i], r[K1 + i], r[K2 + i], walk[REACH + i])
        per_t, possible = reciprocal(get(jets, T + i, LANES))
        put(jets, RATE + i, LANES, product(sum_of(a, product(b, per_t)), get(jets, PER + i, LANES)))
        good[i] = good[i] if possible else 0.0


@kernel
def enclose_motion(
    lanes: int, count: int, numbers: Array, jets: Array, walk: Array, rate: bool, along: bool, across: bool, good: Array
) -> None:
    """Enclose the first rocker and the guided point at the end of ``count`` stages in the cells that a walk asks for.

    Parameters
    ----------
    lanes, count : lanes in use, number of stages, the last one planar
    numbers : of :func:`load`
    jets : (JETS,) out; RATE is the velocity of the first rocker with branch +1, ALONG the travel along the line,
        without its constant, ACROSS the deviation from it
    walk : (WALK,) of :mod:`kernels.certified.cells`, with the CENTRE [rad] and REACH of each cell
    rate, along, across : whether that jet is wanted
    good : (LANES,) out, 0 where the motion cannot be enclosed
    """
    for i in range(lanes):
        good[i] = 1.0
    if count == 1 and (along or across):
        circle(lanes, walk[CENTRE:], walk[REACH:], jets, COS, SIN)
    for k in range(count):
        r = numbers[k * STAGE : (k + 1) * STAGE]
        if k == 0:
            _first(lanes, r, walk, jets)
        else:
            _driven(lanes, r, jets)
        # No circle around zero may touch the discriminant or R, or root and reciprocal have no enclosure.
        root(lanes, jets, PER, T, good)
        inverse(lanes, jets, R, PER, good)
        if k == 0 and rate:
            _velocity(lanes, r, walk, jets, good)
        if k + 1 < count:
            _hand_on(lanes, r, jets)
            continue
        ends = numbers[count * STAGE :]
        if along:
            _point_along(lanes, r, ends, jets)
        if across:
            _point_across(lanes, r, ends, jets)
