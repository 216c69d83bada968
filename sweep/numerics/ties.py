"""Peaks of curves over a turn that are as high as each other: the first of them counts."""

from __future__ import annotations

import numpy as np

from kernels.curves import samples as scan
from kernels.types import TWO_PI, Array
from sweep.numerics.quadrature import Index

NEIGHBOURS = TWO_PI / 64.0  # largest distance of maxima of neighbouring pieces [rad]


def first_of_equals(row: Index, phi: Array, err_phi: Array, height: Array, err: Array, chosen: Index) -> Index:
    """Return the first of equally high peaks in the turn, for the highest peaks ``chosen`` of some rows.

    A symmetric motion has equally high maxima: rounding would choose another one at every accuracy.

    Parameters
    ----------
    row : (k,) of the peaks;  chosen : numbers of the highest peaks, one of a row
    """
    best = _of_row(row, chosen)
    known = 2.0 * np.minimum(err, err[best])
    # A place closer to the end of the turn than its error counts as just after its beginning.
    place = np.mod(phi, TWO_PI)
    place = np.where(place + err_phi < TWO_PI, place, err_phi)
    late = np.where(height >= height[best] - known, -place, -np.inf)
    first = np.full(row.max(initial=0) + 1, -1)
    scan.best_candidate(row, late, np.full(first.size, -np.inf), first)
    found: Index = first[row[chosen]]
    return found


def _of_row(row: Index, chosen: Index) -> Index:
    """Chosen peak of each peak's row."""
    found = np.full(row.max(initial=0) + 1, chosen[0] if chosen.size else 0)
    found[row[chosen]] = chosen
    return found[row]


def hill(
    row: Index, phi: Array, err_phi: Array, height: Array, err: Array, chosen: Index, tie: Array
) -> tuple[Array, Array]:
    """Find the places of the highest maxima ``chosen`` of some rows, and their errors.

    A maximum at the end of a piece of the curve may lie a little beyond it, and that of a dwell anywhere on it: the
    error of the place spans all maxima that may be as high, without a gap of more than `NEIGHBOURS`.  Of several such
    hills the first of the turn counts, as in `first_of_equals`; heights closer than ``tie`` (k,) are equal.
    """
    high_enough = height + 2.0 * err >= height[_of_row(row, chosen)]
    attained = np.where(high_enough, height, -np.inf)
    first = first_of_equals(row, phi, err_phi, attained, np.maximum(err, 0.5 * tie), chosen)
    rival = np.flatnonzero(high_enough)
    rival = rival[np.lexsort((phi[rival], row[rival]))]
    gap = np.diff(phi[rival]) - err_phi[rival[:-1]] - err_phi[rival[1:]]  # a level piece is as high at its other end
    apart = (np.diff(row[rival]) != 0) | (gap > NEIGHBOURS)
    number = np.zeros(row.size, np.int64)
    number[rival[1:]] = np.cumsum(apart)
    # Peaks on both sides of the angle 0 belong to one hill: the last one of a row precedes its first one.
    head = rival[np.flatnonzero(np.diff(row[rival], prepend=-1))]
    tail = rival[np.flatnonzero(np.diff(row[rival], append=-1))]
    seam = phi[head] - err_phi[head] + TWO_PI - phi[tail] - err_phi[tail]
    around = (seam <= NEIGHBOURS) & (number[head] != number[tail])
    same = np.arange(row.size)
    same[number[tail[around]]] = number[head[around]]
    phi, number = phi - TWO_PI * (same[number] != number), same[number]
    low, high, top = np.full(row.size, np.inf), np.full(row.size, -np.inf), np.full(row.size, -1)
    np.minimum.at(low, number[rival], (phi - err_phi)[rival])
    np.maximum.at(high, number[rival], (phi + err_phi)[rival])
    scan.best_candidate(number[rival], height[rival], np.full(row.size, -np.inf), top)
    mine = number[first]
    place = phi[rival[top[mine]]]
    return place, np.maximum(place - low[mine], high[mine] - place)
