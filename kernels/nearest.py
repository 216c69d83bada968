"""The nearest point that keeps linear rows: the dual active-set method of Goldfarb and Idnani (1983).

It begins at the centre, which keeps none of them, and takes in the row that is missed most until none is.  Every step
costs one look at all rows and some hundred products, so it is quick where few of many rows hold in the end.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import inline, kernel

Array = NDArray[np.float64]
Index = NDArray[np.int64]

STEPS = 20  # per unknown after which it is given up
DEPENDENT = 1e-20  # square of what is left of a row across those that hold, relative to its own, that is rounding


@inline
def _turned(a: Array, b: Array, first: float, second: float, left: int, right: int, begin: int) -> None:
    """Rotate two columns of ``a`` so that (first, second) would become (length, 0); the same rows of ``b`` from begin.

    ``b`` is left alone where ``begin`` is negative.
    """
    length = math.hypot(first, second)
    c, s = first / length, second / length
    for i in range(a.shape[0]):
        x, y = a[i, left], a[i, right]
        a[i, left], a[i, right] = c * x + s * y, c * y - s * x
    if begin >= 0:
        for j in range(begin, b.shape[1]):
            x, y = b[left, j], b[right, j]
            b[left, j], b[right, j] = c * x + s * y, c * y - s * x


@inline
def _most_missed(rows: Array, needs: Array, size: Array, y: Array, inside: Index, tolerance: float, room: Array) -> int:
    """Return the row that a point misses most, relative to its size; -1 where it keeps all of them."""
    for j in range(rows.shape[1]):
        room[j] = -needs[j]
    for i in range(rows.shape[0]):
        factor = y[i]
        for j in range(rows.shape[1]):
            room[j] += rows[i, j] * factor
    found, worst = -1, -tolerance
    for j in range(rows.shape[1]):
        if inside[j] == 0 and room[j] < worst * size[j]:
            found, worst = j, room[j] / size[j]
    return found


@inline
def _dropped(place: int, count: int, q: Array, r: Array, held: Index, weights: Array) -> None:
    """Take a row out of those that hold; rotations make the rest a triangle again."""
    for k in range(place, count - 1):
        held[k] = held[k + 1]
        for j in range(r.shape[0]):
            r[j, k] = r[j, k + 1]
    for k in range(place, count):
        weights[k] = weights[k + 1]
    for k in range(place, count - 1):
        if r[k + 1, k] != 0.0:
            _turned(q, r, r[k, k], r[k + 1, k], k, k + 1, k)


@inline
def _shares(rows: Array, p: int, count: int, q: Array, r: Array, d: Array, z: Array, share: Array) -> float:
    """Where a row leads while the others hold (z), and how much of each of them it takes; the square of z."""
    n = rows.shape[0]
    square = 0.0
    for k in range(n):
        d[k] = 0.0
    for i in range(n):
        for k in range(n):
            d[k] += q[i, k] * rows[i, p]
    for i in range(n):
        z[i] = 0.0
        for k in range(count, n):
            z[i] += q[i, k] * d[k]
    for k in range(count, n):
        square += d[k] * d[k]
    for k in range(count - 1, -1, -1):
        value = d[k]
        for j in range(k + 1, count):
            value -= r[k, j] * share[j]
        share[k] = value / r[k, k]
    return square


@kernel
def nearest(rows: Array, needs: Array, centre: Array, tolerance: float, y: Array, weights: Array) -> int:
    """Return the point nearest to a centre with ``rows.T y >= needs``.

    Parameters
    ----------
    rows : (n, m), one column for each row
    needs : (m,)
    centre : (n,)
    tolerance : distance by which a row may be missed
    y : (n,) out
    weights : (m,) out; ``y - centre = rows weights``, none is negative

    Returns
    -------
    OK, LIMIT_EXCEEDED where no point keeps all rows, or NOT_CONVERGED after twenty exchanges per unknown; then y and
    weights are as far as it came.

    Notes
    -----
    Goldfarb and Idnani 1983, with an orthogonal triangle of the rows that hold.  Against scipy's least-distance
    programs: 1e-12.
    """
    n, m = rows.shape
    q, r = np.eye(n), np.zeros((n, n))
    d, z, share, u = np.empty(n), np.empty(n), np.empty(n), np.zeros(n + 1)
    held, inside, room, size = np.empty(n, np.int64), np.zeros(m, np.int64), np.empty(m), np.zeros(m)
    for i in range(n):
        y[i] = centre[i]
        for j in range(m):
            size[j] += rows[i, j] * rows[i, j]
    for j in range(m):
        weights[j], size[j] = 0.0, math.sqrt(size[j])
    count, left, status = 0, STEPS * n, int(st.OK)
    while status == st.OK:
        p = _most_missed(rows, needs, size, y, inside, tolerance, room)
        if p < 0:
            break
        short = -room[p]
        u[count] = 0.0
        while True:
            square = _shares(rows, p, count, q, r, d, z, share)
            full = short / square if count < n and square > DEPENDENT * size[p] * size[p] else math.inf
            part, place = math.inf, -1
            for k in range(count):
                if share[k] > 0.0 and u[k] / share[k] < part:
                    part, place = u[k] / share[k], k
            step = min(part, full)
            left -= 1
            if step == math.inf or left < 0:
                status = int(st.LIMIT_EXCEEDED) if step == math.inf else int(st.NOT_CONVERGED)
                break
            if full < math.inf:
                for i in range(n):
                    y[i] += step * z[i]
                short -= step * square
            for k in range(count):
                u[k] -= step * share[k]
            u[count] += step
            if full <= part:
                for k in range(n - 1, count, -1):
                    if d[k] != 0.0:
                        _turned(q, r, d[k - 1], d[k], k - 1, k, -1)
                        d[k - 1], d[k] = math.hypot(d[k - 1], d[k]), 0.0
                for k in range(count + 1):
                    r[k, count] = d[k]
                held[count], inside[p] = p, 1
                count += 1
                break
            inside[held[place]] = 0
            _dropped(place, count, q, r, held, u)
            count -= 1
    for k in range(count):
        weights[held[k]] = u[k]
    return status
