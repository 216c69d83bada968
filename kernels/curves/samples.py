"""Reductions of sampled turns, (n, m): a row is a design, its samples are a curve over the crank angle.

The search for extrema, the windows and the events use them.

The samples of a row stand at equidistant crank angles of one full turn, so a row is periodic: the neighbour of the last
sample is the first.  ``mode`` chooses the quantity to be maximised: 0 the magnitude, +1 the value, -1 its negative.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.arithmetic.intrinsics import largest
from kernels.jit import inline, kernel
from kernels.types import EPS, TWO_PI, Array, Status

Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

FLAT = 1e-9
LEVEL_SLOPE = 1e-3  # change in a step, relative to the bend, from which on a sample at the level is no touch
RANK = np.ones(256, np.int64)  # of a status: the higher one counts for the whole turn
RANK[[st.OK, st.DEAD_POINT, st.SINGULAR, st.NOT_ASSEMBLED, st.INVALID_INPUT]] = 0, 2, 3, 4, 5


@inline
def _measured(value: float, mode: int) -> float:
    return abs(value) if mode == 0 else mode * value


@kernel
def worst_status(status: Status, worst: Status) -> None:
    """Choose the gravest status of each row for the whole turn.

    Parameters
    ----------
    status : (n, m) of the poses
    worst : (n,) out; INVALID_INPUT before NOT_ASSEMBLED, SINGULAR, DEAD_POINT and any other status but OK
    """
    for i in range(status.shape[0]):
        worst[i] = st.OK
        for j in range(status.shape[1]):
            if RANK[status[i, j]] > RANK[worst[i]]:
                worst[i] = status[i, j]


@kernel
def unwrap(angles: Array, winding: Index) -> None:
    """Make the angles of each row continuous from its first sample on, in place.

    Parameters
    ----------
    angles : (n, m) angles [rad], changed by multiples of 2 pi
    winding : (n,) out; full turns made over the row, the step back to the first sample included
    """
    for i in range(angles.shape[0]):
        turns = 0.0
        before = angles[i, 0]
        for j in range(1, angles.shape[1]):
            raw = angles[i, j]
            turns -= np.rint((raw - before) / TWO_PI)
            before = raw
            angles[i, j] = raw + TWO_PI * turns
        last = angles[i, -1]
        closing = angles[i, 0] - last
        winding[i] = -int(np.rint((closing) / TWO_PI)) if closing == closing else 0


@kernel
def best_sample(values: Array, mode: int, allowed: Mask | None, best: Array, column: Index) -> None:
    """Find the largest measured sample of each row and its column; nan and -1 where no sample is allowed.

    Parameters
    ----------
    values : (n, m) samples, none of them nan
    mode : 0 for the magnitude, +1 for the value, -1 for its negative
    allowed : (n, m) which samples count, or None for all
    best, column : (n,) out; the measured value (not the sample itself)
    """
    for i in range(values.shape[0]):
        m, at = -math.inf, -1
        if allowed is None:
            # The maximum first, its place afterwards: only so the first loop vectorises.
            for j in range(values.shape[1]):
                m = largest(m, _measured(values[i, j], mode))
            for j in range(values.shape[1]):
                if _measured(values[i, j], mode) == m:
                    at = j
                    break
        else:
            for j in range(values.shape[1]):
                if allowed[i, j] and _measured(values[i, j], mode) > m:
                    m, at = _measured(values[i, j], mode), j
        best[i] = m if at >= 0 else math.nan
        column[i] = at


@kernel
def peaks(
    values: Array, mode: int, share: float, allowed: Mask | None, scale: Array, rough: Array, row: Index, column: Index
) -> int:
    """Collect the local maxima of each row that can be the highest, and judge how well the samples resolve the row.

    Parameters
    ----------
    values : (n, m) samples over one turn, none of them nan; m >= 5
    mode : 0 for the magnitude, +1 for the value, -1 for its negative
    share : local maxima below this share of the best one are left out; for signed modes the share is counted from the
        least sample of the row
    allowed : (n, m) which samples count (and their neighbours, where a peak may hide), or None for all
    scale : (n,) out; size of the row: the best magnitude, or the range of the samples for signed modes
    rough : (n,) out; largest fourth difference of neighbouring samples against ``scale``; small when they resolve it
    row, column : out, at least n (m/2 + 1) long; places of the candidates

    Returns
    -------
    int
        number of candidates written.  A row that is flat within its rounding yields its best sample alone.
    """
    count, m = 0, values.shape[1]
    for i in range(values.shape[0]):
        best, least, size, at = -math.inf, math.inf, 0.0, -1
        for j in range(m):
            if allowed is None or allowed[i, j]:
                z = _measured(values[i, j], mode)
                if z > best:
                    best, at = z, j
                least = min(least, z)
                size = max(size, abs(z))
        rough[i], scale[i] = 0.0, 0.0
        if at < 0:
            continue
        scale[i] = best if mode == 0 else best - least
        row[count], column[count] = i, at
        count += 1
        if best - least <= FLAT * size:
            continue
        floor = best - (1.0 - share) * scale[i]
        fourth = 0.0
        # Two samples before, one before, here, one after, two after.
        y0, y1, y2, y3 = values[i, m - 2], values[i, m - 1], values[i, 0], values[i, 1]
        for j in range(m):
            y4 = values[i, j + 2 if j + 2 < m else j + 2 - m]
            z1, z2, z3 = _measured(y1, mode), _measured(y2, mode), _measured(y3, mode)
            near = True
            if allowed is not None:
                near = allowed[i, j] or allowed[i, j - 1] or allowed[i, j + 1 if j + 1 < m else 0]
            if near:
                fourth = max(fourth, abs((y0 + y4) - 4.0 * (y1 + y3) + 6.0 * y2))
                if z2 >= floor and z2 > z1 and z2 >= z3 and j != at:
                    row[count], column[count] = i, j
                    count += 1
            y0, y1, y2, y3 = y1, y2, y3, y4
        rough[i] = fourth / scale[i]
    return count


@kernel
def nearest_singularity(discriminant: Array, distance: Array) -> None:
    """Estimate the distance of the discriminant's nearest complex zero from the real crank angles [rad]; 0 if real.

    The parabola through each local minimum and its neighbours gives the zero phi0 +- i rho with
    rho^2 = D / (D''/2).  There the derivatives of the motion are singular, so rho sets the spacing of samples.

    Parameters
    ----------
    discriminant : (n, m) samples over one turn
    distance : (n,) out; the smallest rho of all local minima
    """
    m = discriminant.shape[1]
    h = TWO_PI / m
    for i in range(discriminant.shape[0]):
        rho2 = math.inf
        for j in range(m):
            left, here = discriminant[i, j - 1], discriminant[i, j]
            right = discriminant[i, j + 1 if j + 1 < m else 0]
            if here <= left and here <= right:
                half_bend = 0.5 * (left + right) - here  # D''/2 h^2
                if half_bend > 0.0:
                    slope = 0.5 * (right - left)
                    vertex = here - 0.25 * slope * (slope / half_bend)
                    rho2 = min(rho2, max(vertex, 0.0) / half_bend * h * h)
                elif here <= 0.0:
                    rho2 = 0.0
        distance[i] = math.sqrt(rho2)


@kernel
def crossings(values: Array, level: Array, row: Index, column: Index) -> int:
    """List the places where rows cross their level: between the sample at ``column`` and the next one.

    Parameters
    ----------
    values : (n, m) samples over one turn
    level : (n,)
    row, column : out, at least n m long

    Returns
    -------
    int
        number of crossings written
    """
    count, m = 0, values.shape[1]
    for i in range(values.shape[0]):
        for j in range(m):
            after = values[i, j + 1 if j + 1 < m else 0]
            if (values[i, j] >= level[i]) != (after >= level[i]):
                row[count], column[count] = i, j
                count += 1
    return count


@kernel
def grazes(values: Array, level: Array, doubtful: Mask) -> None:
    """Mark rows that may touch their level between samples, though no sample lies beyond it.

    Parameters
    ----------
    values : (n, m) samples over one turn; m >= 5
    level : (n,)
    doubtful : (n,) in and out; set where the parabola through a turning point passes the level and its sample does not.
        A sample at the level itself is a touch unless the curve has a slope there.
    """
    m = values.shape[1]
    for i in range(values.shape[0]):
        for j in range(m):
            left, here = values[i, j - 1], values[i, j]
            right = values[i, j + 1 if j + 1 < m else 0]
            bend = left + right - 2.0 * here
            if (left - here) * (right - here) >= 0.0 and bend != 0.0:
                slope = 0.5 * (right - left)
                # Twice the parabola's overshoot, as it is only an estimate.
                beyond = here - slope * (slope / bend)
                if here == level[i]:
                    # A touch may be skew: five samples tell its slope from that.
                    further = values[i, (j + 2) % m] - values[i, j - 2]
                    doubtful[i] |= abs(8.0 * (right - left) - further) > 12.0 * LEVEL_SLOPE * abs(bend)
                elif (here >= level[i]) != (beyond >= level[i]):
                    doubtful[i] = True


@kernel
def quartic_peak(z: Array, place: Array, height: Array, ripple: Array, blur: Array) -> None:
    """Find the highest point of the quartic through five equidistant samples, starting at the best of them.

    Parameters
    ----------
    z : (n, 5) measured values at the places -2, -1, 0, 1, 2
    place : (n,) out; of the peak in steps, within one step of the best sample; -2 or +2 if an end sample is the best
    height : (n,) out; value of the quartic there, not below the best sample
    ripple : (n,) out; fourth difference of the samples: their noise, once the steps are small
    blur : (n,) out; largest shift of the peak by that noise, in steps; at most 2
    """
    for i in range(z.shape[0]):
        a, b, c, d, e = z[i, 0], z[i, 1], z[i, 2], z[i, 3], z[i, 4]
        ripple[i] = abs((a + e) - 4.0 * (b + d) + 6.0 * c)
        top, t0 = c, 0.0
        if b > top:
            top, t0 = b, -1.0
        if d > top:
            top, t0 = d, 1.0
        if a > top:
            top, t0 = a, -2.0
        if e > top:
            top, t0 = e, 2.0
        # Differences from the middle sample: no digits are lost in a flat top.
        da, db, dd, de = a - c, b - c, d - c, e - c
        p1 = (da - 8.0 * db + 8.0 * dd - de) / 12.0
        p2 = (16.0 * (db + dd) - (da + de)) / 24.0
        p3 = (2.0 * (db - dd) - (da - de)) / 12.0
        p4 = ((da + de) - 4.0 * (db + dd)) / 24.0
        t = t0
        if abs(t0) < 2.0:
            for _ in range(8):
                slope = p1 + t * (2.0 * p2 + t * (3.0 * p3 + t * (4.0 * p4)))
                bend = 2.0 * p2 + t * (6.0 * p3 + t * (12.0 * p4))
                step = -slope / bend if bend < 0.0 else 0.0
                after = min(max(t + step, t0 - 1.0), t0 + 1.0)
                done = abs(after - t) < 1e-13
                t = after
                if done:
                    break
        bend = -(2.0 * p2 + t * (6.0 * p3 + t * (12.0 * p4)))
        noise = ripple[i] + 16.0 * EPS * abs(c)  # the fourth difference may vanish by chance
        blur[i] = noise / bend if noise < 2.0 * bend else 2.0
        peak = c + t * (p1 + t * (p2 + t * (p3 + t * p4)))
        if peak >= top:
            place[i], height[i] = t, peak
        else:
            place[i], height[i] = t0, top


@kernel
def best_candidate(row: Index, height: Array, best: Array, which: Index) -> None:
    """Find the highest candidate of each row.

    Parameters
    ----------
    row, height : (k,) the candidates; nan heights do not count
    best : (n,) in and out; -inf at first
    which : (n,) in and out; number of the candidate, -1 at first
    """
    for k in range(row.size):
        if height[k] > best[row[k]]:
            best[row[k]] = height[k]
            which[row[k]] = k
