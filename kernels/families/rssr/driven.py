"""Enclosure of what crank-rockers in series drive: a guided point along its line and across it, docs/guide.md.

The planar four-bar of a guide is the crank-rocker with parallel axes and all links in one plane, so each stage of the
chain is one, its crank driven by the enclosure of the rocker before it.  The closure of the first stage is a known
trigonometric polynomial of the crank angle; that of the later ones is composed.  Several designs are enclosed side by
side, each about its own crank angle.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels.arithmetic.sincos import sincos
from kernels.certified.cells import CENTRE, REACH
from kernels.certified.jets import WIDTH, combined, double_harmonic, get, harmonic, product, put, size_of, sum_of
from kernels.certified.lanes import LANES, circle, inverse, root
from kernels.families.rssr.closure import Array, reduce_design
from kernels.families.rssr.enclosure import spread
from kernels.jit import inline, kernel
from kernels.types import EPS

Stages = NDArray[np.float64]
# Rows of the numbers of a design: of each stage those of its closure; then a, b and a', b' of what it hands on,
# a cos psi + b sin psi and a' cos psi + b' sin psi of its rocker angle, the b with the sign of the branch, and what
# all four are off by.  That is cosine and sine of the next crank angle, at last the rocker's part of the point.
E, Y0, CA, K0, K1, K2, W_SIZE, A1, B1, A2, B2, OFF = (k * LANES for k in range(12))
STAGE = 12 * LANES
# Behind the stages: the crank's part of the point, what its factors are off by, the constant across the line.
P1, P2, P_OFF, CONSTANT, CONSTANT_OFF = (k * LANES for k in range(5))
SHARES = 5
# Places of jets: the crank; the closure; 1/R, which stands where the discriminant was; the point along and across the
# line, the last two.
COS, SIN, X, Y, W, R, T, PER, ALONG, ACROSS = (k * WIDTH * LANES for k in range(10))
JETS = 10 * WIDTH * LANES


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


@kernel
def _first(lanes: int, r: Array, walk: Array, jets: Array) -> None:
    """Enclose X, Y, W, R = X^2 + Y^2 and, in PER, the discriminant R - W^2 of the first stage."""
    for i in range(lanes):
        reach = walk[REACH + i]
        v, u = sincos(walk[CENTRE + i])
        z = spread(r[E + i], r[Y0 + i], r[CA + i], r[K0 + i], r[K1 + i], r[K2 + i], r[W_SIZE + i], u, v, reach)
        put(jets, X + i, LANES, harmonic(z.x0, z.x1, z.x2, reach, z.ex))
        put(jets, Y + i, LANES, harmonic(z.y0, z.y1, z.y2, reach, z.ey))
        put(jets, W + i, LANES, harmonic(z.w0, z.w1, z.w2, reach, z.ew))
        put(jets, R + i, LANES, double_harmonic(z.r0, z.r1, z.r2, z.r3, z.r4, reach, z.e_square))
        put(jets, PER + i, LANES, double_harmonic(z.d0, z.d1, z.d2, z.d3, z.d4, reach, z.e_delta))


@kernel
def _driven(lanes: int, r: Array, jets: Array) -> None:
    """Enclose the same of a later stage from cosine and sine of its crank; the errors of the constants are of 4.2."""
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
def enclose_point(
    lanes: int, count: int, numbers: Array, jets: Array, walk: Array, along: bool, across: bool, good: Array
) -> None:
    """Enclose the guided point at the end of ``count`` stages in the cells that a walk asks for, of all lanes.

    Parameters
    ----------
    lanes, count : lanes in use, number of stages, the last one planar
    numbers : of :func:`load`
    jets : (JETS,) out; ALONG is the travel along the line, without its constant, ACROSS the deviation from it
    walk : (WALK,) of :mod:`kernels.certified.cells`, with the CENTRE [rad] and REACH of each cell
    along, across : whether that jet is wanted
    good : (LANES,) out, 0 where the motion cannot be enclosed
    """
    for i in range(lanes):
        good[i] = 1.0
    if count == 1:
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
        if k + 1 < count:
            _hand_on(lanes, r, jets)
            continue
        ends = numbers[count * STAGE :]
        if along:
            _point_along(lanes, r, ends, jets)
        if across:
            _point_across(lanes, r, ends, jets)
