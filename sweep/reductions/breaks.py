"""Jumps of a curve between its samples: found, bracketed, and searched on either side (docs/extrema.md).

Friction changes its direction where the follower reverses, an angle of a direction leaps by pi: no number of samples
resolves such a place, so it is bracketed by bisection and the smooth arcs beside it are searched up to its edge.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from kernels.types import EPS, TWO_PI
from sweep.families.base import Array
from sweep.reductions.sampling import Index, Mask

Curve: TypeAlias = Callable[[Array, Index], Array]
"""Values (j,) of some curves at angles (j,), one each; the curves by their numbers (j,)."""

MOST = 32  # jumps of a turn; a curve with more is not resolved
STEP = 1.0 / 60.0  # of the curve's size; smaller steps are left to the samples
SHARPER = 6.0  # times the differences beside it
BESIDE = 4  # samples on either side of a jump whose peaks are looked for up to its edge
BISECTIONS = 48
SECTIONS = 44
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)


class Arcs(NamedTuple):
    """Highest points of the arcs beside k jumps, each (2 k,): place [rad], value, error of the value."""

    phi: Array
    value: Array
    err: Array


def jumps(values: Array, size: Array, rough: float) -> tuple[Mask, Mask]:
    """Find where rows of samples jump, and which rows the samples resolve apart from that.

    Parameters
    ----------
    values : (n, m) equidistant samples of whole turns;  size : (n,) of the curves
    rough : fourth difference against the size above which samples do not resolve a curve

    Returns
    -------
    between : (n, m) whether the curve jumps between this sample and the next
    resolved : (n,) rows that jump at all and are resolved between their jumps
    """
    step = np.abs(np.roll(values, -1, axis=1) - values)
    beside = np.maximum.reduce([np.roll(step, k, axis=1) for k in (-2, -1, 1, 2)])
    between = (step > STEP * size[:, None]) & (step > SHARPER * beside)
    near = np.logical_or.reduce([np.roll(between, k, axis=1) for k in (-1, 0, 1, 2)])
    left, right = (np.roll(values, k, axis=1) + np.roll(values, -k, axis=1) for k in (1, 2))
    fourth = np.abs(right - 4.0 * left + 6.0 * values)
    smooth = np.where(near, 0.0, fourth).max(axis=1) <= rough * size
    count = between.sum(axis=1)
    return between, smooth & (count > 0) & (count <= MOST)


def near_jumps(between: Mask, row: Index, column: Index) -> Mask:
    """Which samples (row, column) lie within `BESIDE` samples of a jump."""
    near = np.logical_or.reduce([np.roll(between, k, axis=1) for k in range(-BESIDE + 1, BESIDE + 1)])
    found: Mask = near[row, column]
    return found


def level(values: Array, mode: int, share: float) -> Array:
    """Return what a peak of each row of samples must reach to be looked at.

    Of a magnitude it is this share of the largest, of values this share of their range.
    """
    height = np.abs(values) if mode == 0 else mode * values
    most: Array = height.max(axis=1)
    return most * share if mode == 0 else most - (1.0 - share) * (most - height.min(axis=1))


def search(curve: Curve, measured: Curve, column: Index, samples: int, least: Array) -> Arcs:
    """Highest measured values on the arcs that end and begin at jumps.

    Parameters
    ----------
    curve : the curves that jump;  measured : what is to be large there (magnitude, value or its negative); both by the
        places (j,) and the numbers (j,) of the jumps
    column : (k,) sample before each jump
    samples : per turn
    least : (k,) of :func:`level`: arcs of which neither ends nor two places between them reach it have no top searched

    Notes
    -----
    One-sided limits at the jumps are known to the rounding of the crank angle; 44 golden sections of at most five
    samples find the top of an arc that has one.  Errors are what the last section leaves.
    """
    spacing = TWO_PI / samples
    start = np.multiply(column, spacing, dtype=np.float64)
    low, high = start.copy(), start + spacing
    every = np.arange(column.size)
    at_low, at_high = curve(low, every), curve(high, every)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        value = curve(middle, every)
        left = np.abs(value - at_low) < np.abs(at_high - value)
        low, at_low = np.where(left, middle, low), np.where(left, value, at_low)
        high, at_high = np.where(left, high, middle), np.where(left, at_high, value)
    before = _section(measured, start - (BESIDE - 1) * spacing, low, least)
    after = _section(measured, high, start + BESIDE * spacing, least)
    return Arcs(*(np.concatenate(pair) for pair in zip(before, after, strict=True)))


def _section(measured: Curve, low: Array, high: Array, least: Array) -> Arcs:
    every = np.arange(low.size)
    inner, outer = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    known = [(phi, measured(phi, every)) for phi in (low, high, inner, outer)]
    phi, best = known[0]
    for place, value in known[1:]:
        better = value > best
        phi, best = np.where(better, place, phi), np.where(better, value, best)
    which = np.flatnonzero(best >= least)
    err = 8.0 * EPS * np.abs(best)
    if which.size:
        part = (x[which] for x in (low, high, inner, outer, known[2][1], known[3][1]))
        place, value, gap = _golden(lambda at: measured(at, which), *part)
        better = value > best[which]
        phi[which], best[which] = np.where(better, place, phi[which]), np.where(better, value, best[which])
        err[which] = gap + 8.0 * EPS * np.abs(best[which])
    return Arcs(phi, best, err)


def _golden(
    measured: Callable[[Array], Array], low: Array, high: Array, inner: Array, outer: Array, at_inner: Array,
    at_outer: Array,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Return places and values of the tops between two places, and what the last section leaves of them."""
    for _ in range(SECTIONS):
        left = at_inner > at_outer
        low, high = np.where(left, low, inner), np.where(left, outer, high)
        middle = np.where(left, high - GOLDEN * (high - low), low + GOLDEN * (high - low))
        value = measured(middle)
        inner, outer = np.where(left, middle, outer), np.where(left, inner, middle)
        at_inner, at_outer = np.where(left, value, at_outer), np.where(left, at_inner, value)
    first = at_inner >= at_outer
    return np.where(first, inner, outer), np.where(first, at_inner, at_outer), np.abs(at_inner - at_outer)
