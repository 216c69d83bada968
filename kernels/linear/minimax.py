"""Smallest largest deviation of linear functions in five unknowns, with others kept within a bound: a small simplex.

For given proportions the motion of a guided coupler point is linear in two complex numbers and an offset
(docs/guide.md), so the least largest acceleration with a straightness and a stroke prescribed is a linear program:

    minimise t + price v   subject to   |g_j x| <= t,   -below_j - v <= d_j x <= above_j + v,   e_j x >= need_j,

and v >= 0.
It is solved by the revised simplex method on the dual, which has as many rows as the primal has unknowns.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.jit import inline, kernel
from kernels.types import Array, Status

UNKNOWNS = 5
SIZE = UNKNOWNS + 2  # and t, and v
FAR = 1e6  # unknowns are sought within, in units of the largest need
STEPS = 400
REFRESHED = 25  # steps after which the inverse of the basis is computed anew
ROUNDING = 1e-11  # by which a row may be missed, relative to the size of the values
PIVOT = 1e-12  # smallest element to exchange on


@inline
def _row(number: int, g: Array, d: Array, e: Array, bound: Array, need: Array, far: float, row: Array) -> float:
    """Coefficients of a row of ``A (x, t, v) >= b``, and b."""
    mg, md, me = g.shape[0], d.shape[0], e.shape[0]
    for k in range(SIZE):
        row[k] = 0.0
    if number < 2 * mg:
        sign = 1.0 if number < mg else -1.0
        j = number if number < mg else number - mg
        for k in range(UNKNOWNS):
            row[k] = sign * g[j, k]
        row[UNKNOWNS] = 1.0
        return 0.0
    number -= 2 * mg
    if number < 2 * md:
        sign = 1.0 if number < md else -1.0
        j = number if number < md else number - md
        for k in range(UNKNOWNS):
            row[k] = sign * d[j, k]
        row[UNKNOWNS + 1] = 1.0
        return -float(bound[0 if sign > 0.0 else 1, j])
    number -= 2 * md
    if number < me:
        for k in range(UNKNOWNS):
            row[k] = e[number, k]
        return float(need[number])
    number -= me
    row[number] = 1.0
    return -far if number < UNKNOWNS else 0.0


@inline
def _inverse(basis: NDArray[np.int64], g: Array, d: Array, e: Array, bound: Array, need: Array, far: float,
             a: Array, b: Array, out: Array, row: Array) -> bool:  # fmt: skip
    """Inverse of the basis' rows (Gauss-Jordan with row exchange); false where they depend on each other."""
    for i in range(SIZE):
        b[i] = _row(basis[i], g, d, e, bound, need, far, row)
        for k in range(SIZE):
            a[i, k] = row[k]
            out[i, k] = 1.0 if i == k else 0.0
    for k in range(SIZE):
        pivot = k
        for i in range(k + 1, SIZE):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        if abs(a[pivot, k]) < 1e-200:
            return False
        for j in range(SIZE):
            a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
            out[k, j], out[pivot, j] = out[pivot, j], out[k, j]
        scale = 1.0 / a[k, k]
        for j in range(SIZE):
            a[k, j] *= scale
            out[k, j] *= scale
        for i in range(SIZE):
            if i != k and a[i, k] != 0.0:
                f = a[i, k]
                for j in range(SIZE):
                    a[i, j] -= f * a[k, j]
                    out[i, j] -= f * out[k, j]
    return True


@inline
def _finite(rows: Array) -> bool:
    known = True
    for j in range(rows.shape[0]):
        for k in range(UNKNOWNS):
            known = known and math.isfinite(rows[j, k])
    return known


@inline
def _most_violated(
    g: Array, d: Array, e: Array, bound: Array, need: Array, price: float, size: float, z: Array
) -> int:  # fmt: skip
    """Return number of the row that a point z misses most, -1 where it keeps all of them to rounding."""
    mg, md = g.shape[0], d.shape[0]
    t, v = z[UNKNOWNS], z[UNKNOWNS + 1]
    entering, worst = -1, ROUNDING * (abs(t) + price * abs(v) + size)
    for j in range(mg):
        value = 0.0
        for k in range(UNKNOWNS):
            value += g[j, k] * z[k]
        if abs(value) - t > worst:
            worst = abs(value) - t
            entering = j if value < 0.0 else mg + j
    for j in range(md):
        value = 0.0
        for k in range(UNKNOWNS):
            value += d[j, k] * z[k]
        low, high = -value - bound[0, j] - v, value - bound[1, j] - v
        if max(low, high) > worst:
            worst = max(low, high)
            entering = 2 * mg + (j if low > high else md + j)
    for j in range(e.shape[0]):
        value = need[j]
        for k in range(UNKNOWNS):
            value -= e[j, k] * z[k]
        if value > worst:
            worst, entering = value, 2 * (mg + md) + j
    if -v > worst:
        entering = 2 * (mg + md) + e.shape[0] + SIZE - 1
    return entering


@inline
def _exchanged(inverse: Array, row: Array, y: Array, w: Array) -> int:
    """Let a row enter the basis where the multipliers y stay positive; the place it took, -1 where there is none."""
    leaving, ratio = -1, math.inf
    for k in range(SIZE):
        value = 0.0
        for j in range(SIZE):
            value += row[j] * inverse[j, k]
        w[k] = value
    for k in range(SIZE):
        if w[k] > PIVOT and (y[k] / w[k] < ratio or (y[k] / w[k] == ratio and w[k] > w[leaving])):
            leaving, ratio = k, y[k] / w[k]
    if leaving < 0:
        return leaving
    for j in range(SIZE):
        share = inverse[j, leaving] / w[leaving]
        for k in range(SIZE):
            if k != leaving:
                inverse[j, k] -= share * w[k]
        inverse[j, leaving] = share
    return leaving


@kernel
def minimax(
    g: Array, d: Array, e: Array, bound: Array, need: Array, price: float, x: Array, largest: Array, missed: Array,
    status: Status,
) -> None:  # fmt: skip
    """Solve one linear program per design.

    Parameters
    ----------
    g : (n, mg, 5) rows whose largest magnitude is to be small
    d : (n, md, 5) rows that stay between the bounds, or miss them at a price
    e : (n, me, 5) rows that reach at least ``need``
    bound : (n, 2, md) in the units of their rows, how far these may go below zero and above it; infinite where they
        may go anywhere, and a negative bound is missed by so much, at the price
    need : (n, me) in the units of their rows; the largest is positive, the others are not negative
    price : of a unit of v in units of t
    x : (n, 5) out, the unknowns; nan where the status is not OK
    largest, missed : (n,) out, t and v
    status : (n,) out; OK, NOT_ASSEMBLED where an input is no finite number, NOT_CONVERGED where the simplex stalls

    Notes
    -----
    Measured against HiGHS on random programs: 1e-14 relative.
    """
    last = 2 * (g.shape[1] + d.shape[1]) + e.shape[1]
    a, inverse = np.empty((SIZE, SIZE)), np.empty((SIZE, SIZE))
    b, row, w, z, y = np.empty(SIZE), np.empty(SIZE), np.empty(SIZE), np.empty(SIZE), np.empty(SIZE)
    basis = np.empty(SIZE, np.int64)
    for i in range(g.shape[0]):
        x[i, :], largest[i], missed[i] = math.nan, math.nan, math.nan
        status[i] = st.NOT_ASSEMBLED
        if not (_finite(g[i]) and _finite(d[i]) and _finite(e[i])):
            continue
        status[i] = st.NOT_CONVERGED
        size = 0.0
        for k in range(need.shape[1]):
            size = max(size, need[i, k])
        # The unknowns at their far bounds, t = v = 0: the basis is the unit matrix, its multipliers those of t and v.
        for k in range(SIZE):
            basis[k] = last + k
        for step in range(STEPS):
            if step % REFRESHED == 0 and not _inverse(
                basis, g[i], d[i], e[i], bound[i], need[i], FAR * size, a, b, inverse, row
            ):
                break
            for k in range(SIZE):
                value = 0.0
                for j in range(SIZE):
                    value += inverse[k, j] * b[j]
                z[k], y[k] = value, max(inverse[UNKNOWNS, k] + price * inverse[UNKNOWNS + 1, k], 0.0)
            entering = _most_violated(g[i], d[i], e[i], bound[i], need[i], price, size, z)
            if entering < 0:
                for k in range(UNKNOWNS):
                    x[i, k] = z[k]
                largest[i], missed[i], status[i] = z[UNKNOWNS], z[UNKNOWNS + 1], st.OK
                break
            right = _row(entering, g[i], d[i], e[i], bound[i], need[i], FAR * size, row)
            leaving = _exchanged(inverse, row, y, w)
            if leaving < 0:
                break
            basis[leaving], b[leaving] = entering, right
