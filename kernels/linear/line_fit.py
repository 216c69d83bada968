"""Straightest coupler point: the inner linear problem of a guided four-bar (docs/guide.md, Straightest lines).

For a coupler with the pin B and the direction d = (C - B)/|C - B|, both complex, and a line of direction lam,

    dev = Im((B + l d) e^{-i lam}) - h,      l = xi + i eta

is linear in (xi, eta, h).  With w = l e^{-i lam} it is ``Im(B e^{-i lam}) + Im(w d) - h``: the columns Re d, Im d, 1 do
not depend on lam, so one factorisation serves every direction, and the least-squares residual is the same combination
of the two residuals of Re B and Im B that Im(B e^{-i lam}) is of Re B and Im B.  The best direction is an eigenvector.
The minimax solution is found by Stiefel's exchange on four points, started from least squares.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.jit import inline, kernel
from kernels.types import Array, Status

EXCHANGES = 60
REPEATS = 6
ROUNDING = 2.0**-49  # of a residual, relative to its terms


@inline
def _least_squares(bx: Array, by: Array, dx: Array, dy: Array, inside: NDArray[np.bool_]) -> tuple[float, ...]:
    """Moments of the masked points: means, and the coefficients of centred Bx and By on centred (dx, dy)."""
    count, mbx, mby, mdx, mdy = 0, 0.0, 0.0, 0.0, 0.0
    for j in range(bx.size):
        if inside[j]:
            count += 1
            mbx += bx[j]
            mby += by[j]
            mdx += dx[j]
            mdy += dy[j]
    per = 1.0 / max(count, 1)
    mbx, mby, mdx, mdy = mbx * per, mby * per, mdx * per, mdy * per
    # Centring removes the unknown h; orthogonalising dy against dx halves the digits lost to a small coupler turn.
    xx, xy, x_bx, x_by = 0.0, 0.0, 0.0, 0.0
    for j in range(bx.size):
        if inside[j]:
            p = dx[j] - mdx
            xx += p * p
            xy += p * (dy[j] - mdy)
            x_bx += p * (bx[j] - mbx)
            x_by += p * (by[j] - mby)
    ratio = xy / xx
    yy, y_bx, y_by = 0.0, 0.0, 0.0
    for j in range(bx.size):
        if inside[j]:
            q = dy[j] - mdy - ratio * (dx[j] - mdx)
            yy += q * q
            y_bx += q * (bx[j] - mbx)
            y_by += q * (by[j] - mby)
    on_y_bx, on_y_by = y_bx / yy, y_by / yy
    return mbx, mby, mdx, mdy, x_bx / xx - ratio * on_y_bx, on_y_bx, x_by / xx - ratio * on_y_by, on_y_by


@inline
def _direction(
    bx: Array, by: Array, dx: Array, dy: Array, inside: NDArray[np.bool_], moments: tuple[float, ...]
) -> float:
    """Direction in [0, pi) of the smallest least-squares deviation: an eigenvector of the residuals' Gram matrix."""
    mbx, mby, mdx, mdy, cx_bx, cy_bx, cx_by, cy_by = moments
    gxx, gxy, gyy = 0.0, 0.0, 0.0
    for j in range(bx.size):
        if inside[j]:
            p, q = dx[j] - mdx, dy[j] - mdy
            rx = bx[j] - mbx - cx_bx * p - cy_bx * q
            ry = by[j] - mby - cx_by * p - cy_by * q
            gxx += rx * rx
            gxy += rx * ry
            gyy += ry * ry
    # dev^2 = c^2 gyy - 2 s c gxy + s^2 gxx is smallest at half the angle of (gxx - gyy, 2 gxy).
    lam = 0.5 * math.atan2(2.0 * gxy, gxx - gyy)
    return lam if lam >= 0.0 else lam + math.pi


@inline
def _point(cx_bx: float, cy_bx: float, cx_by: float, cy_by: float, c: float, s: float) -> tuple[float, float]:
    """Coupler point in the line's frame: Im(w d) cancels the part of Im(B e^{-i lam}) along (dx, dy)."""
    return -(c * cy_by - s * cy_bx), -(c * cx_by - s * cx_bx)


@inline
def _solve3(a: Array, y: Array) -> bool:
    """Solve by Gauss elimination with row exchange, in place; false where the matrix is singular."""
    for k in range(3):
        pivot = k
        for i in range(k + 1, 3):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        if abs(a[pivot, k]) < 1e-300:
            return False
        for j in range(3):
            a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
        y[k], y[pivot] = y[pivot], y[k]
        for i in range(k + 1, 3):
            f = a[i, k] / a[k, k]
            for j in range(k, 3):
                a[i, j] -= f * a[k, j]
            y[i] -= f * y[k]
    for k in range(2, -1, -1):
        for j in range(k + 1, 3):
            y[k] -= a[k, j] * y[j]
        y[k] /= a[k, k]
    return True


@inline
def _row(dx: Array, dy: Array, j: int, k: int) -> float:
    return dy[j] if k == 0 else (dx[j] if k == 1 else -1.0)


@inline
def _first_reference(
    target: Array, dx: Array, dy: Array, inside: NDArray[np.bool_], x: Array, points: NDArray[np.int64]
) -> bool:
    """Write the four points of alternating largest residuals along the path; false where there are too few."""
    count = 0
    for j in range(dx.size):
        count += inside[j]
    if count < 5:
        return False
    seen = 0
    for i in range(4):
        points[i] = -1
    for j in range(dx.size):
        if inside[j]:
            r = target[j] + x[0] * dy[j] + x[1] * dx[j] - x[2]
            quarter = min(seen * 4 // count, 3)
            old = points[quarter]
            if old < 0 or abs(r) > abs(target[old] + x[0] * dy[old] + x[1] * dx[old] - x[2]):
                points[quarter] = j
            seen += 1
    return True


@inline
def _rounding(target: Array, x: Array) -> float:
    """Estimate the rounding error of residuals, below which every reference is as good as another."""
    size: float = abs(x[0]) + abs(x[1]) + abs(x[2])
    for j in range(target.size):
        size = max(size, abs(target[j]))
    return ROUNDING * size


@inline
def _among(points: NDArray[np.int64], j: int) -> bool:
    """Tell whether j is one of the four points."""
    return bool((points[0] == j) | (points[1] == j) | (points[2] == j) | (points[3] == j))


@inline
def _farthest(
    target: Array, dx: Array, dy: Array, inside: NDArray[np.bool_], x: Array, level: float
) -> tuple[int, float]:
    """Find the masked position with the largest residual and that residual; -1 and ``level`` if none exceeds it."""
    worst, worst_size = -1, level
    for j in range(dx.size):
        if inside[j]:
            r = abs(target[j] + x[0] * dy[j] + x[1] * dx[j] - x[2])
            if r > worst_size:
                worst, worst_size = j, r
    return worst, worst_size


@inline
def _exchange(
    target: Array,
    dx: Array,
    dy: Array,
    inside: NDArray[np.bool_],
    x: Array,
    a: Array,
    y: Array,
    points: NDArray[np.int64],
) -> bool:
    """Find the minimax x = (w_x, w_y, h) of |target + w_x dy + w_y dx - h| over masked points, from least squares."""
    if not _first_reference(target, dx, dy, inside, x, points):
        return False
    weights, rounding = np.empty(4), _rounding(target, x)
    for _ in range(EXCHANGES):
        # Weights of the reference: sum_i weight_i row_i = 0 with weight_3 = 1.
        for k in range(3):
            for i in range(3):
                a[k, i] = _row(dx, dy, points[i], k)
            y[k] = -_row(dx, dy, points[3], k)
        if not _solve3(a, y):
            return False
        level, total = 0.0, 0.0
        for i in range(4):
            weights[i] = y[i] if i < 3 else 1.0
            level += weights[i] * target[points[i]]
            total += abs(weights[i])
        level /= total
        # The solution whose residuals on the reference are level * sign(weight).
        for i in range(3):
            for k in range(3):
                a[i, k] = _row(dx, dy, points[i], k)
            y[i] = math.copysign(1.0, weights[i]) * level - target[points[i]]
        if not _solve3(a, y):
            return False
        x[0], x[1], x[2] = y[0], y[1], y[2]
        worst, worst_size = _farthest(target, dx, dy, inside, x, abs(level))
        # A point of the reference exceeds the level by the rounding of the elimination alone: neighbours among the four
        # make it ill-conditioned, and the point would replace itself for ever.
        if worst < 0 or worst_size <= abs(level) * (1.0 + 1e-9) + rounding or _among(points, worst):
            return True
        # Stiefel's rule: the new row in terms of the reference decides which point leaves; the level can only rise.
        sign = math.copysign(1.0, target[worst] + x[0] * dy[worst] + x[1] * dx[worst] - x[2])
        for k in range(3):
            for i in range(3):
                a[k, i] = _row(dx, dy, points[i], k)
            y[k] = sign * _row(dx, dy, worst, k)
        if not _solve3(a, y):
            return False
        orientation = math.copysign(1.0, level)
        leaving, largest_ratio = 3, 0.0
        for i in range(3):
            ratio = y[i] / (weights[i] * orientation)
            if ratio > largest_ratio:
                leaving, largest_ratio = i, ratio
        points[leaving] = worst
    return False


@inline
def _couplers(b_x: Array, b_y: Array, c_x: Array, c_y: Array, bx: Array, by: Array, dx: Array, dy: Array) -> bool:
    """Compute pin B and direction d of the coupler at every position; false if a position is not assembled."""
    good = True
    for j in range(b_x.size):
        bx[j], by[j] = b_x[j], b_y[j]
        length = math.hypot(c_x[j] - bx[j], c_y[j] - by[j])
        dx[j], dy[j] = (c_x[j] - bx[j]) / length, (c_y[j] - by[j]) / length
        good = good and math.isfinite(dx[j]) and math.isfinite(dy[j])
    return good


class Straightest(NamedTuple):
    """Straightest coupler point and its line: the result of :func:`line_fit`.

    Parameters
    ----------
    xi, eta, h : (n,) coupler point in the coupler's frame and offset of the line [length]
    deviation : (n,) largest deviation over the working part [length]
    travel : (n,) travel along the line over all m positions [length]
    status : (n,) OK, NOT_ASSEMBLED where a position is nan, NOT_CONVERGED where the exchange stalls or the points do
        not determine a line (then the least-squares point is returned)
    """

    xi: Array
    eta: Array
    h: Array
    deviation: Array
    travel: Array
    status: Status


@kernel
def line_fit(
    b_x: Array, b_y: Array, c_x: Array, c_y: Array, window: Array, lam: Array, free_direction: bool, found: Straightest
) -> None:
    """Compute the coupler point and line with the least maximum deviation over the working part of the travel.

    Parameters
    ----------
    b_x, b_y, c_x, c_y : (n, m) positions of the coupler's two pins [length]; nan where not assembled
    window : (2,) working part as fractions of the travel along lam, counted from its smallest value
    lam : (n,) direction of the line [rad]; with ``free_direction`` replaced by the best one within 90 degrees of it
    found : out

    Notes
    -----
    Which positions belong to the working part depends on the point, so fit, best direction and window are repeated
    until the window is the same as before, REPEATS times at most; the least deviation for its travel counts.
    """
    m, (xi, eta, h, deviation, travel, status) = b_x.shape[1], found
    bx, by, dx, dy = np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    along, target = np.empty(m), np.empty(m)
    inside = np.empty(m, np.bool_)
    x, a, y = np.empty(3), np.empty((3, 3)), np.empty(3)
    points = np.empty(4, np.int64)
    for i in range(b_x.shape[0]):
        inside[:] = True
        if not _couplers(b_x[i], b_y[i], c_x[i], c_y[i], bx, by, dx, dy):
            xi[i], eta[i], h[i], deviation[i], travel[i] = math.nan, math.nan, math.nan, math.nan, math.nan
            status[i] = st.NOT_ASSEMBLED
            continue
        given, line, best = lam[i], lam[i], math.inf
        for repeat in range(REPEATS):
            moments = _least_squares(bx, by, dx, dy, inside)
            if free_direction:
                free = _direction(bx, by, dx, dy, inside, moments)
                line = free if math.cos(free - given) >= 0.0 else free - math.pi
            mbx, mby, mdx, mdy, cx_bx, cy_bx, cx_by, cy_by = moments
            c, s = math.cos(line), math.sin(line)
            x[0], x[1] = _point(cx_bx, cy_bx, cx_by, cy_by, c, s)
            x[2] = c * mby - s * mbx + x[0] * mdy + x[1] * mdx
            for j in range(m):
                target[j] = c * by[j] - s * bx[j]
            wx, wy, offset = x[0], x[1], x[2]
            code = st.OK
            if not _exchange(target, dx, dy, inside, x, a, y, points):
                x[0], x[1], x[2] = wx, wy, offset
                code = st.NOT_CONVERGED
            low, high = math.inf, -math.inf
            for j in range(m):
                along[j] = c * bx[j] + s * by[j] + x[0] * dx[j] - x[1] * dy[j]
                low, high = min(low, along[j]), max(high, along[j])
            worst, settled = 0.0, True
            for j in range(m):
                fraction = (along[j] - low) / (high - low)
                counts = window[0] <= fraction <= window[1]
                settled = settled and counts == inside[j]
                inside[j] = counts
                if counts:
                    worst = max(worst, abs(target[j] + x[0] * dy[j] + x[1] * dx[j] - x[2]))
            if repeat == 0 or (code == st.OK and (status[i] != st.OK or worst < best * (high - low))):
                lam[i], best = line, worst / (high - low)
                xi[i], eta[i] = c * x[0] - s * x[1], s * x[0] + c * x[1]
                h[i], deviation[i], travel[i], status[i] = x[2], worst, high - low, code
            if settled:
                break
