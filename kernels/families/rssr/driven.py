"""Certified maxima of what crank-rockers in series drive: the travel of a guided point, docs/guide.md.

The planar four-bar of a guide is the crank-rocker with parallel axes and all links in one plane, so each stage of the
chain is one, its crank driven by the enclosure of the rocker before it; derivatives are taken of the composed jet.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.certificate import BEST, CENTRE, DONE, LEFT, MODE, NOISE, PLACE, REACH, STATE, TURN, UPPER, begin, judge
from kernels.enclosure import EPS, GUARD, ORDER, WIDTH, combine, inverse, multiply, root, size, trigonometric
from kernels.families.rssr.closure import Array, Reduced, Status, reduce_design
from kernels.sincos import sincos

Stages = NDArray[np.float64]
COS, SIN, C, S, X, Y, W, R, T, PER, _A, _B = (k * WIDTH for k in range(12))
SIZE = 12 * WIDTH


@inline
def _crank(at: Array, phi: float, reach: float) -> None:
    """Compute the cosine and sine of the first crank's angle."""
    v, u = sincos(phi)
    trigonometric(at, COS, reach, u, -v, -u, 0.0, 0.0, 0.0, 0.0, 6.0 * EPS)
    trigonometric(at, SIN, reach, v, u, -v, 0.0, 0.0, 0.0, 0.0, 6.0 * EPS)


@kernel
def _rocker(at: Array, r: Reduced) -> bool:
    """Return the cosine and sine of the rocker from those of its crank, (2*);
    the errors of the constants are those of 4.2.
    """
    u, v = size(at, COS), size(at, SIN)
    combine(at, r.e, -1.0, COS, 0.0, COS, 4.0 * EPS * abs(r.e), X)
    combine(at, r.y0, r.ca, SIN, 0.0, SIN, 6.0 * EPS * (abs(r.y0) + abs(r.ca) * v), Y)
    turning = 6.0 * EPS * (abs(r.k1) * v + abs(r.k2) * u)
    combine(at, r.k0, r.k1, SIN, -r.k2, COS, 16.0 * EPS * r.w_size + turning, W)
    multiply(at, X, X, _A)
    multiply(at, Y, Y, _B)
    combine(at, 0.0, 1.0, _A, 1.0, _B, 0.0, R)
    multiply(at, W, W, _A)
    combine(at, 0.0, 1.0, R, -1.0, _A, 0.0, _B)
    # _B is the discriminant R - W^2; no circle around zero may touch it, or root and reciprocal have no enclosure.
    if not root(at, _B, T, PER) or not inverse(at, R, PER):
        return False
    multiply(at, X, W, _A)
    multiply(at, Y, T, _B)
    combine(at, 0.0, -1.0, _A, -1.0, _B, 0.0, _A)
    multiply(at, _A, PER, C)
    multiply(at, Y, W, _A)
    multiply(at, X, T, _B)
    combine(at, 0.0, r.branch, _A, -r.branch, _B, 0.0, _A)
    multiply(at, _A, PER, S)
    return True


@kernel
def enclose_travel(
    at: Array, stages: Stages, couplings: Array, shares: Array, i: int, phi: float, reach: float
) -> bool:
    """Enclose the travel of design i, without its constant, on |z| <= reach in X;
    return false if it cannot be enclosed.
    """
    _crank(at, phi, reach)
    for k in range(stages.shape[0]):
        if k > 0:
            kappa = couplings[k - 1, i, 0]
            sine, cosine = math.sin(couplings[k - 1, i, 1]), math.cos(couplings[k - 1, i, 1])
            error = 3.0 * EPS * (size(at, C) + size(at, S))
            combine(at, 0.0, cosine, C, -kappa * sine, S, error, COS)
            combine(at, 0.0, sine, C, kappa * cosine, S, error, SIN)
        if not _rocker(at, reduce_design(stages[k], i)):
            return False
    p, q = shares[i, 4] * (size(at, COS) + size(at, SIN)), shares[i, 5] * (size(at, C) + size(at, S))
    combine(at, 0.0, shares[i, 0], COS, -shares[i, 1], SIN, p, _A)
    combine(at, 0.0, shares[i, 2], C, -shares[i, 3], S, q, _B)
    combine(at, 0.0, 1.0, _A, 1.0, _B, 0.0, X)
    return True


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
    at, state, y = np.empty(SIZE), np.empty(STATE), np.empty(ORDER + 1)
    for i in range(status.size):
        cells[i] = 0.0
        if status[i] != st.OK:
            continue
        begin(state, phi[i], target, most)
        while state[MODE] != DONE:
            encloses = enclose_travel(at, stages, couplings, shares, i, state[CENTRE], state[REACH])
            judge(state, encloses, at, X, order, y)
        cells[i] = most - state[LEFT]
        least, bound = (state[BEST] - state[NOISE]) / GUARD, state[UPPER]
        if not bound < math.inf:
            status[i], error[i] = st.NOT_CONVERGED, math.nan
            continue
        if not least <= maximum[i] <= bound:
            maximum[i], phi[i] = state[BEST], state[PLACE] - TURN * math.floor(state[PLACE] / TURN)
        error[i] = max(bound - maximum[i], maximum[i] - least) * GUARD
