"""Largest values of curves with kinks and jumps: polynomials on panels, halved wherever a curve may have its maximum.

A panel whose polynomial plus its error bound stays below the highest value is discarded.  The others are halved until
the values on both halves agree with the polynomial before.  Of equally high peaks the first of the turn counts.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.polynomial import chebyshev

from kernels.curves import samples as scan
from kernels.types import EPS, TWO_PI, Array
from sweep.numerics.chebyshev import DENSE, NODES, basis, product, rising, summits
from sweep.numerics.records import Indices, joined, only

PANELS = 64  # first even panels of a turn, besides cuts where a curve may bend
TAIL = 4  # last coefficients that bound a polynomial's error; for a tent in the middle three of them nearly vanish ...
CAREFUL = 3.0  # ... times this: a tent's tip, anywhere on the panel, is up to 2.91 times their sum above the others
LATELY = 0.25  # share of the previous polynomial's error in the bound: halving a panel halves the error of a kink
# Next to a reversal the sign of friction comes from a speed that is only rounding: nearer poses are noise.
NARROWEST = 1e-11  # width of a panel [rad] that can only hold a jump
CROWD = 48  # number of small panels of one curve beyond which only rounding is being halved
ALLOWED = 1.0 / 32.0  # share of the target by which two successive polynomials may differ
NEIGHBOURS = TWO_PI / 64.0  # largest distance of maxima of neighbouring pieces [rad]
PLACED = 1e-8  # coarsest accuracy with places: tops that differ by less are equally high, and the first of them counts
EDGE = 2.0**17  # times EPS of the size: change over NARROWEST/4 of a curve with a slope of six sizes per radian
LEVEL = 16.0  # times EPS of a value: most by which the poses of a level curve miss the polynomial through them, 10.7
EVEN = 6.0  # the same of one whose poses are all equal: what the claimed error of a constant leaves for it
AGAIN = 8.0  # factor from that difference to the claimed error: poses may see only 1/8 of a kink between them
BEND = (NODES - 1) ** 2 * ((NODES - 1) ** 2 - 1) / 3.0  # the same of the second derivative on [-1, 1]
SLOPE = 2.0 * (NODES - 1) ** 2  # bound of the slope of a polynomial bounded by 1 on a panel of width 1 (Markov)


CurveValues: TypeAlias = Callable[[Indices, Array, Array], Array]
"""``curves(row, phi, middle)``: values (k, m) of the curves ``row`` (k,) at angles phi (k, m).

Values that wrap are those nearest to ``middle`` (k, 1).  A curve with nan among them has no maximum.
"""


class Panels(NamedTuple):
    """Panels of several curves, each (k,).

    Row of the curve; ends [rad]; coefficients (k, NODES); highest pose on the panel and its place [rad]; difference
    between the poses and the polynomial of the panel before it was halved.
    """

    row: Indices
    low: Array
    high: Array
    series: Array
    peak: Array
    at: Array
    missed: Array


class Top(NamedTuple):
    """Maxima of k panels: place [rad], value, error of the value, error of the place [rad]."""

    row: Indices
    phi: Array
    value: Array
    err: Array
    err_phi: Array


def climbed(curves: CurveValues, panels: Panels, n: int, mode: int, target: float, locate: bool) -> tuple[Top, Array]:
    """Find the maximum of every curve that has panels; also return the sizes of the curves, (n,).

    Parameters
    ----------
    curves, panels : values of the n curves, and the first panels of each in rising order
    mode : 0 for the largest magnitude, +1 for the largest value, -1 for the smallest (its height is the negative value)
    target : accuracy relative to the size; of a place [rad], if ``locate``
    """
    aim = min(target, PLACED) if locate else target
    best, least = np.full(n, -np.inf), np.full(n, np.inf)
    np.maximum.at(best, panels.row, panels.peak)
    np.minimum.at(least, panels.row, measured(product(panels.series, rising(basis()[0])), mode).min(axis=1))
    size = best if mode == 0 else best - least
    tops = [_given_up(only(panels, panels.row < 0), mode)]  # none: there may be no panel at all
    while panels.row.size:
        # Of tops as high as each other none is dropped by rounding.
        level = LEVEL * EPS * np.maximum(np.abs(best), size)
        panels = only(panels, _upper(panels, mode) >= (best - level)[panels.row])
        # The even first panels may all be within the target: a constant, or a dwell.
        crowded = panels.high - panels.low < 0.25 * TWO_PI / PANELS
        crowded &= np.bincount(panels.row[crowded], minlength=n)[panels.row] > CROWD
        tops.append(_given_up(only(panels, crowded), mode))
        panels = only(panels, ~crowded)
        halves, miss = _halved(curves, panels, mode)
        np.maximum.at(best, halves.row, halves.peak)
        tolerance = np.maximum(ALLOWED * aim * size, 4.0 * EPS * np.abs(best))[halves.row]
        narrow = halves.high - halves.low < NARROWEST
        # A level piece is as high as one beside it whose polynomial is rounded.
        top = _tops(halves, mode, AGAIN * np.where(miss > 0.0, miss, EVEN * EPS * np.abs(best)[halves.row]))
        settled, at_end = miss <= tolerance, (top.phi <= halves.low) | (top.phi >= halves.high)
        if locate:
            settled &= (top.err_phi <= aim) | at_end | (miss <= level[halves.row])
        off = _off(curves, halves, top, mode, np.flatnonzero(settled & ~narrow))
        settled &= off <= tolerance
        top.err[:] += AGAIN * off + np.where(at_end, EDGE, 4.0) * EPS * size[halves.row]
        ends = only(halves, narrow)
        held = _held(ends, np.repeat(panels.peak, 2)[narrow], size)
        held.err[:] += AGAIN * _beside(curves, ends, mode)
        tops += [only(top, settled & ~narrow), held]
        panels = only(halves, ~settled & ~narrow)
    return _highest(tops, n, locate * aim * size), size


def _halved(curves: CurveValues, panels: Panels, mode: int) -> tuple[Panels, Array]:
    """Halve each panel; also return the largest difference between the new poses and the panel's polynomial."""
    middle = 0.5 * (panels.low + panels.high)
    low, high = (np.stack(ends, axis=1).ravel() for ends in ((panels.low, middle), (middle, panels.high)))
    row = np.repeat(panels.row, 2)
    values = curves(row, places(low, high), np.repeat(panels.series[:, :1], 2, axis=0))
    nodes, _ = basis()
    inner = np.concatenate([0.5 * (nodes - 1.0), 0.5 * (nodes + 1.0)])
    before = product(panels.series, rising(inner))
    miss = np.abs(values.reshape(-1, 2 * NODES) - before).max(axis=1)
    halves = fitted(row, low, high, values, mode)
    # The highest pose may be isolated, as at the place of a jump: the half that contains it keeps it.
    peak, at = np.repeat(panels.peak, 2), np.repeat(panels.at, 2)
    kept = (peak > halves.peak) & (low <= at) & (at <= high)
    best, at, miss = np.where(kept, peak, halves.peak), np.where(kept, at, halves.at), np.repeat(miss, 2)
    return halves._replace(peak=best, at=at, missed=miss), miss


def _off(curves: CurveValues, panels: Panels, top: Top, mode: int, which: Indices) -> Array:
    """Difference between maxima and poses at their places: no other pose sees a kink next to an end."""
    off, place = np.zeros(top.row.size), _inside(top.phi, panels.low, panels.high)
    here = curves(top.row[which], place[which, None], panels.series[which, :1])[:, 0]
    off[which] = np.abs(measured(here, mode) - top.value[which])
    return off


def _tops(panels: Panels, mode: int, err: Array) -> Top:
    """Maxima of the polynomials, whose heights are off by ``err`` at most; on a level one they may be anywhere."""
    uneven = np.abs(panels.series[:, 1:]).sum(axis=1) > 4.0 * EPS * np.abs(panels.series[:, 0])
    series, half = panels.series[uneven], 0.5 * (panels.high - panels.low)
    x, value, blur = np.zeros(half.size), panels.peak.copy(), np.ones(half.size)
    x[uneven], value[uneven] = summits(series, mode)
    derived = (chebyshev.chebder(series, order, axis=1).T for order in range(3))
    here, slope, bow = (chebyshev.chebval(x[uneven], of, tensor=False) for of in derived)
    falls = -(mode or np.sign(here)) * bow - BEND * err[uneven]
    # The slope bounds the error of a place at an end, the bend that of a place inside; poses avoid a jump at the end.
    inside = np.abs(x) < 1.0
    held = np.where(inside[uneven], np.abs(bow) / SLOPE, np.abs(slope))
    blur[uneven] = np.minimum(np.divide(err[uneven], held, out=np.full(slope.size, 2.0), where=held > 0.0), 2.0)
    # The summit of a symmetric curve may be an end: it is level there, and its bend holds it.
    bent = np.sqrt(np.divide(2.0 * err[uneven], falls, out=np.full(slope.size, 4.0), where=falls > 0.0))
    blur[uneven] = np.where(inside[uneven], blur[uneven], np.minimum(blur[uneven], bent))
    err_phi = half * blur + np.where(inside, 0.0, 0.5 * NARROWEST) + 8.0 * EPS * np.pi
    return Top(panels.row, 0.5 * (panels.low + panels.high) + half * x, value, err + 4.0 * EPS * np.abs(value), err_phi)


def _held(panels: Panels, before: Array, size: Array) -> Top:
    """Highest poses of panels at the limit of resolvable crank angles; ``before`` are those before halving."""
    err = np.abs(panels.peak - before) + EDGE * EPS * size[panels.row] + 4.0 * EPS * np.abs(panels.peak)
    return Top(panels.row, panels.at, panels.peak, err, panels.high - panels.low + 8.0 * EPS * np.pi)


def _beside(curves: CurveValues, panels: Panels, mode: int) -> Array:
    """Smaller of the differences between the highest poses of narrow panels and the poses on either side.

    Beside a jump the curve is level on its higher side.  Next to a cusp it rises further where no pose can be, by as
    much again, and by a few times that where it rises like a small power of the distance.
    """
    both = panels.at[:, None] + NARROWEST * np.array([-1.0, 1.0])
    heights = measured(curves(panels.row, both, panels.series[:, :1]), mode)
    found: Array = np.abs(heights - panels.peak[:, None]).min(axis=1)
    return found


def _given_up(panels: Panels, mode: int) -> Top:
    """Highest poses of panels that are no longer halved, with the upper bounds of their polynomials as error."""
    return Top(panels.row, panels.at, panels.peak, _upper(panels, mode) - panels.peak, panels.high - panels.low)


def _highest(tops: list[Top], n: int, tie: Array) -> Top:
    """Select the highest maximum of each row; rivals that may be higher increase its error and that of its place.

    Of maxima that differ by less than ``tie`` (n,) the first of the turn gives the place.
    """
    every = joined(*tops)
    order = np.lexsort((every.phi, -every.value, every.row))
    row, first = np.unique(every.row[order], return_index=True)
    highest, ceiling = only(every, order[first]), np.full(n, -np.inf)
    np.maximum.at(ceiling, every.row, every.value + every.err)
    phi, err_phi = hill(every.row, every.phi, every.err_phi, every.value, every.err, order[first], tie[every.row])
    return highest._replace(err=np.maximum(highest.err, ceiling[row] - highest.value), phi=phi, err_phi=err_phi)


def _upper(panels: Panels, mode: int) -> Array:
    """Estimate an upper bound of a curve on each panel from its coefficients."""
    dense = measured(product(panels.series, rising(np.linspace(-1.0, 1.0, DENSE))), mode)
    doubt = CAREFUL * np.abs(panels.series[:, -TAIL:]).sum(axis=1) + LATELY * panels.missed
    between = np.maximum(-np.diff(dense, 2, axis=1).min(axis=1), 0.0) / 8.0  # a parabola rises so far between points
    upper: Array = np.maximum(dense.max(axis=1) + between, panels.peak) + doubt
    return upper


def measured(values: Array, mode: int) -> Array:
    """Heights of values in the sense of ``mode``."""
    return np.abs(values) if mode == 0 else mode * values


def places(low: Array, high: Array) -> Array:
    """Nodes of panels, kept off the ends, where the curve may already have jumped."""
    places = 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * basis()[0]
    return _inside(places, low[:, None], high[:, None])


def _inside(phi: Array, low: Array, high: Array) -> Array:
    return np.clip(phi, low + 0.25 * NARROWEST, high - 0.25 * NARROWEST)


def fitted(row: Indices, low: Array, high: Array, values: Array, mode: int) -> Panels:
    """Make panels with the polynomials through their poses."""
    heights, every = measured(values, mode), np.arange(row.size)
    top = heights.argmax(axis=1)
    series: Array = product(values, basis()[1].T)
    level = np.flatnonzero(np.ptp(values, axis=1) == 0.0)  # a dwell, a count: not halved until its rounding agrees
    series[level, 0], series[level, 1:] = values[level, 0], 0.0
    return Panels(row, low, high, series, heights[every, top], places(low, high)[every, top], np.zeros(row.size))


def first_of_equals(row: Indices, phi: Array, err_phi: Array, height: Array, err: Array, chosen: Indices) -> Indices:
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
    return first[row[chosen]]


def _of_row(row: Indices, chosen: Indices) -> Indices:
    """Chosen peak of each peak's row."""
    found = np.full(row.max(initial=0) + 1, chosen[0] if chosen.size else 0)
    found[row[chosen]] = chosen
    return found[row]


def hill(
    row: Indices, phi: Array, err_phi: Array, height: Array, err: Array, chosen: Indices, tie: Array
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
