"""Certified maxima of what crank-rockers in series drive: the travel of a guided point, docs/guide.md.

The planar four-bar of a guide is the crank-rocker with parallel axes and all links in one plane, so each stage of the
chain is one, its crank driven by the enclosure of the rocker before it; derivatives are taken of the composed jet.
Several designs are enclosed side by side, each about its own crank angle; one that is proven makes room for the next.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.abreast import LANES, circle, differentiate, inverse, root
from kernels.certificate import CENTRE, DONE, MODE, REACH, STATE, begin, conclude, decide, share_of
from kernels.families.rssr.closure import Array, Status, reduce_design
from kernels.jets import EPS, ORDER, WIDTH, combined, get, product, put, size_of

Stages = NDArray[np.float64]
# Rows of the numbers of a design: of each stage those of its closure and, but for the first, of its coupling; then the
# shares of the links in the travel.
E, Y0, CA, K0, K1, K2, W_SIZE, BRANCH, KAPPA, COS, SIN = (k * LANES for k in range(11))
STAGE = 11 * LANES
SHARES = 6


@inline
def load(lane: int, numbers: Array, stages: Stages, couplings: Array, shares: Array, i: int) -> None:
    """Write the numbers of design i into its lane."""
    for k in range(stages.shape[0]):
        r, row = reduce_design(stages[k], i), k * STAGE + lane
        numbers[row + E], numbers[row + Y0], numbers[row + CA] = r.e, r.y0, r.ca
        numbers[row + K0], numbers[row + K1], numbers[row + K2] = r.k0, r.k1, r.k2
        numbers[row + W_SIZE], numbers[row + BRANCH] = r.w_size, r.branch
        if k > 0:
            offset = couplings[k - 1, i, 1]
            numbers[row + KAPPA] = couplings[k - 1, i, 0]
            numbers[row + COS], numbers[row + SIN] = math.cos(offset), math.sin(offset)
    for k in range(SHARES):
        numbers[stages.shape[0] * STAGE + k * LANES + lane] = shares[i, k]


@kernel
def _terms(lanes: int, r: Array, cos: Array, sin: Array, x: Array, y: Array, w: Array) -> None:
    """Enclose X, Y, W; the errors of the constants are those of 4.2."""
    for i in range(lanes):
        u, e = get(cos, i, LANES), r[E + i]
        put(x, i, LANES, combined(e, -1.0, u, 0.0, u, 4.0 * EPS * abs(e)))
    for i in range(lanes):
        v, y0, ca = get(sin, i, LANES), r[Y0 + i], r[CA + i]
        put(y, i, LANES, combined(y0, ca, v, 0.0, v, 6.0 * EPS * (abs(y0) + abs(ca) * size_of(v))))
    for i in range(lanes):
        u, v, k1, k2 = get(cos, i, LANES), get(sin, i, LANES), r[K1 + i], r[K2 + i]
        turning = 6.0 * EPS * (abs(k1) * size_of(v) + abs(k2) * size_of(u))
        put(w, i, LANES, combined(r[K0 + i], k1, v, -k2, u, 16.0 * EPS * r[W_SIZE + i] + turning))


@kernel
def _discriminant(lanes: int, x: Array, y: Array, w: Array, square: Array, delta: Array) -> None:
    """Enclose R = X^2 + Y^2 and the discriminant R - W^2."""
    for i in range(lanes):
        a, b, c = get(x, i, LANES), get(y, i, LANES), get(w, i, LANES)
        rr = combined(0.0, 1.0, product(a, a), 1.0, product(b, b), 0.0)
        put(square, i, LANES, rr)
        put(delta, i, LANES, combined(0.0, 1.0, rr, -1.0, product(c, c), 0.0))


@kernel
def _turned(
    lanes: int, r: Array, by_branch: float, a: Array, b: Array, c: Array, d: Array, per: Array, out: Array
) -> None:
    """Enclose -(a b + c d) per, or with ``by_branch`` = 1 instead of 0 the branch times (a b - c d) per."""
    plain = 1.0 - by_branch
    for i in range(lanes):
        p, q = by_branch * r[BRANCH + i] - plain, -by_branch * r[BRANCH + i] - plain
        ab, cd = product(get(a, i, LANES), get(b, i, LANES)), product(get(c, i, LANES), get(d, i, LANES))
        put(out, i, LANES, product(combined(0.0, p, ab, q, cd, 0.0), get(per, i, LANES)))


@kernel
def _coupled(lanes: int, r: Array, c: Array, s: Array, cos: Array, sin: Array) -> None:
    """Enclose cosine and sine of the next stage's crank from those of the rocker that drives it."""
    for i in range(lanes):
        a, b = get(c, i, LANES), get(s, i, LANES)
        error = 3.0 * EPS * (size_of(a) + size_of(b))
        put(cos, i, LANES, combined(0.0, r[COS + i], a, -r[KAPPA + i] * r[SIN + i], b, error))
    for i in range(lanes):
        a, b = get(c, i, LANES), get(s, i, LANES)
        error = 3.0 * EPS * (size_of(a) + size_of(b))
        put(sin, i, LANES, combined(0.0, r[SIN + i], a, r[KAPPA + i] * r[COS + i], b, error))


@kernel
def _travel(lanes: int, k: Array, cos: Array, sin: Array, c: Array, s: Array, out: Array) -> None:
    """Enclose the travel of the guided point, without its constant, from its crank and its rocker."""
    for i in range(lanes):
        u, v, p, q = get(cos, i, LANES), get(sin, i, LANES), get(c, i, LANES), get(s, i, LANES)
        crank = combined(0.0, k[i], u, -k[LANES + i], v, k[4 * LANES + i] * (size_of(u) + size_of(v)))
        rocker = combined(0.0, k[2 * LANES + i], p, -k[3 * LANES + i], q, k[5 * LANES + i] * (size_of(p) + size_of(q)))
        put(out, i, LANES, combined(0.0, 1.0, crank, 1.0, rocker, 0.0))


@kernel
def enclose_travel(
    lanes: int, count: int, numbers: Array, jets: Array, phi: Array, reach: Array, out: Array, good: Array
) -> None:
    """Enclose the travel at the end of ``count`` stages on |z| <= reach about phi, of all lanes.

    Parameters
    ----------
    lanes, count : lanes in use, number of stages
    numbers : of :func:`load`
    jets : (10, WIDTH * LANES) scratch
    phi, reach : (LANES,)
    out : jet of the travel
    good : (LANES,) out, 0 where it cannot be enclosed
    """
    cos, sin, c, s, x, y, w, rr, t, per = (
        jets[0], jets[1], jets[2], jets[3], jets[4], jets[5], jets[6], jets[7], jets[8], jets[9],
    )  # fmt: skip
    for i in range(lanes):
        good[i] = 1.0
    circle(lanes, phi, reach, cos, sin)
    for k in range(count):
        r = numbers[k * STAGE : (k + 1) * STAGE]
        if k > 0:
            _coupled(lanes, r, c, s, cos, sin)
        _terms(lanes, r, cos, sin, x, y, w)
        # No circle around zero may touch the discriminant or R, or root and reciprocal have no enclosure.
        _discriminant(lanes, x, y, w, rr, per)
        root(lanes, per, t, good)
        inverse(lanes, rr, per, good)
        # Cosine and sine of the rocker, (2*).
        _turned(lanes, r, 0.0, x, w, y, t, per, c)
        _turned(lanes, r, 1.0, y, w, x, t, per, s)
    _travel(lanes, numbers[count * STAGE :], cos, sin, c, s, out)


@kernel
def certify_travel(
    stages: Stages, couplings: Array, shares: Array, order: int, target: float, most: int, status: Status,
    maximum: Array, phi: Array, error: Array, cells: Array,
) -> None:  # fmt: skip
    """Prove maxima of |d^order s / dphi^order| of a guided point that crank-rockers in series drive, or correct them.

    Parameters
    ----------
    stages : (K, n, 8) columns of :class:`kernels.families.rssr.closure.Design`, the four-bar of the guide last
    couplings : (K - 1, n, 2) kappa and offset [rad] of each stage but the first
    shares : (n, 6) of :func:`kernels.families.guide.travel_shares`
    order : 1, 2 or 3
    target ... cells : as of :func:`kernels.families.rssr.certify.certify_maxima`; ``maximum`` and ``error`` [length]
    """
    n, rows, count = status.size, stages.shape[0] * STAGE + SHARES * LANES, stages.shape[0]
    numbers, states, design = np.empty(rows), np.empty((LANES, STATE)), np.empty(LANES, np.int64)
    jets, travel, y = np.empty((10, WIDTH * LANES)), np.empty(WIDTH * LANES), np.empty((ORDER + 1) * LANES)
    centre, reach, share, good = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    bounds, here = np.empty(4 * LANES), np.empty(ORDER + 1)
    lanes, coming = 0, 0
    while True:
        while coming < n and lanes < LANES:
            cells[coming] = 0.0
            if status[coming] == st.OK:
                design[lanes] = coming
                load(lanes, numbers, stages, couplings, shares, coming)
                begin(states[lanes], phi[coming], target, most)
                lanes += 1
            coming += 1
        if lanes == 0:
            break
        for lane in range(lanes):
            centre[lane], reach[lane], share[lane] = states[lane, CENTRE], states[lane, REACH], share_of(states[lane])
        enclose_travel(lanes, count, numbers, jets, centre, reach, travel, good)
        differentiate(lanes, travel, order, reach, share, y, bounds)
        for lane in range(lanes):
            for k in range(ORDER + 1 - order):
                here[k] = y[k * LANES + lane]
            decide(states[lane], good[lane] != 0.0, here, order, share[lane], bounds[lane], bounds[LANES + lane])
        # Lanes that are done make room. From last to first: what moves into a free one is not done.
        for lane in range(lanes - 1, -1, -1):
            if states[lane, MODE] == DONE:
                conclude(states[lane], design[lane], most, status, maximum, phi, error, cells)
                lanes -= 1
                design[lane] = design[lanes]
                states[lane] = states[lanes]
                for row in range(0, rows, LANES):
                    numbers[row + lane] = numbers[row + lanes]
