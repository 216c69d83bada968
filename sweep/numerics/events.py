"""Roots of continuous functions of the crank angle, bracketed by samples; pairs of roots in a dip included."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from kernels.curves.samples import LEVEL_SLOPE
from kernels.types import TWO_PI, Array
from sweep.numerics.records import Indices, Mask

WIDER = 8.0  # ratio of successive distances: a pole beside the nearer end leaves 2.1^-k in the k-th coefficient
SHORTEST = 1e-11  # distance of a zero [rad] below which its effect falls between two crank angles
BISECTIONS = 120  # at most; a smooth function takes some eight steps, a jump one for each bit of the angle
GRID, GRIDS = 9, 26  # points of each grid about a minimum; grids that narrow a whole turn down to rounding
LAST = 2.0**-48  # width of the last brackets [rad]: four times the rounding of an angle
SAME = 1e-9  # distance [rad] of a root from a jump below which it counts as the jump
FLAT = 1e-9  # width of brackets [rad] in which a smooth function is at its minimum to rounding

Functions: TypeAlias = Callable[[Indices, Array], Array]
"""``f(rows, phi)``: values (k, m, q) of q functions of the designs ``rows`` (k,) at crank angles (k, m)."""


def beyond(values: Array, level: Array | float, wraps: bool) -> Array:
    """Return how far values lie beyond a level; of an angle that ``wraps`` in (-pi, pi], modulo full turns."""
    off: Array = values - level
    return off - TWO_PI * np.round(off / TWO_PI) if wraps else off


def passages(off: Array, wraps: bool) -> Mask:
    """Mark after which samples (n, m) rise through 0, or to 0 and stay there.

    A curve that touches 0 at one sample and falls again does not, nor does an angle that ``wraps`` where it leaps to
    -pi.  Five samples tell the skew of a touch from the slope of a curve that falls again before the next sample.
    """
    before, after, second, third = (np.roll(off, -k, axis=1) for k in (-1, 1, 2, 3))
    slope = np.abs(8.0 * (second - off) - (third - before))
    touches = (after == 0.0) & (second < 0.0) & (slope <= 12.0 * LEVEL_SLOPE * np.abs(off + second))
    passes: Mask = (off < 0.0) & (after >= 0.0) & ~touches
    return passes & (after - off < np.pi) if wraps else passes


def first_passage(passes: Mask, off: Array) -> Indices:
    """Find the sample before the first passage of each row, (n,): the last sample where sample 0 itself is at 0."""
    last: Indices = np.where(passes[:, -1] & (off[:, 0] == 0.0), off.shape[1] - 1, passes.argmax(axis=1))
    return last


def sign_changes(functions: Functions, angles: Array, jumps: Array | None = None) -> tuple[Indices, Array]:
    """Find designs (k,) and crank angles (k,) in [0, 2 pi) at which one of the functions changes its sign.

    Parameters
    ----------
    functions : continuous, periodic in 2 pi
    angles : (n, m) rising samples of one turn that resolve them: between neighbours at most one extremum
    jumps : (n, k) known angles at which the functions may jump through zero; these roots are left out

    Notes
    -----
    Roots are found by bracketing.  A jump takes a step for each bit of its angle.  Two roots between samples appear as
    a dip, whose bottom is found first.
    """
    before, after, values, left, right = _with_neighbours(functions, angles)
    row, column, which = np.nonzero((values < 0.0) != (right < 0.0))
    brackets = [(row, which, angles[row, column], after[row, column])]

    dip = (np.abs(values) <= np.abs(left)) & (np.abs(values) <= np.abs(right))
    dip &= ((values < 0.0) == (left < 0.0)) & ((values < 0.0) == (right < 0.0))
    dip &= (left != 0.0) | (right != 0.0)  # a dwell at zero does not change its sign
    row, column, which = np.nonzero(dip)
    # A parabola falls below its lowest sample by an eighth of the bend at most: other dips stay above zero.
    a, b, c = (np.abs(y[row, column, which]) for y in (left, values, right))
    near = b <= a + c - 2.0 * b
    row, column, which = row[near], column[near], which[near]
    low, high = before[row, column], after[row, column]
    sign = np.where(values[row, column, which] < 0.0, -1.0, 1.0)[:, None]
    bottom = bottoms(lambda phi: sign * _one(functions, row, which, phi), low, high, FLAT)
    through = (sign * _one(functions, row, which, bottom[:, None]))[:, 0] < 0.0
    row, which, low, high, bottom = row[through], which[through], low[through], high[through], bottom[through]
    brackets += [(row, which, low, bottom), (row, which, bottom, high)]

    rows, numbers, lows, highs = (np.concatenate(parts) for parts in zip(*brackets, strict=True))
    if jumps is not None and jumps.size:
        k, lows, highs = _beside(jumps[rows], lows, highs)
        rows, numbers = rows[k], numbers[k]
        at = _one(functions, rows, numbers, np.stack([lows, highs], axis=1)) < 0.0
        rows, numbers, lows, highs = (y[at[:, 0] != at[:, 1]] for y in (rows, numbers, lows, highs))
    found = zeros(lambda k, phi: _one(functions, rows[k], numbers[k], phi[:, None])[:, 0], lows, highs)
    return rows, np.mod(found, TWO_PI)


def _beside(jumps: Array, lows: Array, highs: Array) -> tuple[Indices, Array, Array]:
    """Cut brackets (k,) at jumps (k, c): number of the bracket, and both ends, of each piece."""
    width = (highs - lows)[:, None]
    place = np.mod(jumps - lows[:, None], TWO_PI)
    place = np.sort(np.where(place <= width, place, np.inf), axis=1)
    starts = np.append(np.zeros_like(width), place + SAME, axis=1)
    ends = np.minimum(np.append(place - SAME, width, axis=1), width)
    k, piece = np.nonzero(starts < ends)
    return k, lows[k] + starts[k, piece], lows[k] + ends[k, piece]


def zeros(function: Callable[[Indices, Array], Array], low: Array, high: Array) -> Array:
    """Find roots between two places each, to the rounding of the angle.

    Chandrupatla (1997): inverse parabolas where they are safe, else bisection, so a jump through zero is found too; it
    takes a third to a fifth of the time of ``scipy.optimize.elementwise.find_root``.

    Parameters
    ----------
    function : values (j,) of the functions with numbers (j,) at one place each (j,)
    low, high : (k,) brackets of the roots; where rounding hides the change of sign, one end is returned
    """
    every = np.arange(low.size)
    at_low, at_high = function(every, low), function(every, high)
    found: Array = np.where(np.abs(at_low) < np.abs(at_high), low, high)
    left = np.flatnonzero((at_low < 0.0) != (at_high < 0.0))
    x1, x2, at1, at2 = (y[left] for y in (low, high, at_low, at_high))
    share = np.full(left.size, 0.5)
    for _ in range(BISECTIONS):
        if not left.size:
            break
        x = x1 + share * (x2 - x1)
        at = function(left, x)
        same = (at < 0.0) == (at1 < 0.0)
        x3, at3 = np.where(same, x1, x2), np.where(same, at1, at2)
        x2, at2 = np.where(same, x2, x1), np.where(same, at2, at1)
        x1, at1 = x, at
        found[left] = np.where(np.abs(at1) < np.abs(at2), x1, x2)
        least = LAST / np.maximum(np.abs(x2 - x1), LAST)
        share = np.clip(_inverse(x1, x2, x3, at1, at2, at3), least, 1.0 - least)
        # also after an exact zero: a function that stays zero from there on may jump where that range begins
        more = least < 0.5
        left = left[more]
        share, x1, x2, at1, at2 = (y[more] for y in (share, x1, x2, at1, at2))
    return found


def bottoms(function: Callable[[Array], Array], low: Array, high: Array, width: float = LAST) -> Array:
    """Find the minima of functions with one minimum in each bracket, by default to the rounding of the angle.

    Successively finer grids work for a wedge as for a smooth function, until the brackets have the given width.

    Parameters
    ----------
    function : values (k, m) of k functions at m points each (k, m)
    low, high : (k,) brackets of the minima
    """
    every, share = np.arange(low.size), np.linspace(0.0, 1.0, GRID)
    for _ in range(GRIDS):
        if (high - low).max(initial=0.0) <= width:
            break
        places = low[:, None] + share * (high - low)[:, None]
        least = np.argmin(function(places), axis=1)
        low, high = places[every, np.maximum(least - 1, 0)], places[every, np.minimum(least + 1, GRID - 1)]
    return 0.5 * (low + high)


def _inverse(x1: Array, x2: Array, x3: Array, at1: Array, at2: Array, at3: Array) -> Array:
    """Relative step from x1 to x2 to the root of the inverse parabola through three points.

    The step is one half where the parabola is not safe.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        place, height = (x1 - x2) / (x3 - x2), (at1 - at2) / (at3 - at2)
        safe = (height * height < place) & ((1.0 - height) ** 2 < 1.0 - place)
        first = at1 / (at2 - at1) * (at3 / (at2 - at3))
        second = (x3 - x1) / (x2 - x1) * (at1 / (at3 - at1)) * (at2 / (at3 - at2))
        share = first + second
    return np.where(safe & np.isfinite(share), share, 0.5)


def near_zeros(functions: Functions, angles: Array, reach: float) -> tuple[Indices, Array]:
    """Find designs (k,) and crank angles (k,) where non-negative functions nearly vanish.

    Parameters
    ----------
    functions : squares of smooth functions, periodic in 2 pi
    angles : (n, m) rising samples of one turn
    reach : the largest distance of a complex zero from the real angles that counts [rad]

    Notes
    -----
    A dip D + D''/2 x^2 has a complex zero at the distance sqrt(2 D/D'').  The angles returned are the bottom, both
    angles at that distance from it, and angles at eight times the previous distance up to ``reach``.  Quantities that
    turn quickly there decay like the inverse of the distance: a panel that begins close by and ends far away would
    not resolve that.
    """
    before, after, values, left, right = _with_neighbours(functions, angles)
    row, column, which = np.nonzero((values <= left) & (values < right))
    sides = values[row, column, which], left[row, column, which], right[row, column, which]
    # A parabola falls below its lowest sample by an eighth of the bend at most: dips that stay above have no near zero.
    near = sides[0] <= sides[1] + sides[2] - 2.0 * sides[0]
    row, which, low, high = row[near], which[near], before[row, column][near], after[row, column][near]
    bottom = bottoms(lambda phi: _one(functions, row, which, phi), low, high, SHORTEST)
    step = 0.125 * (high - low)
    left, lowest, right = _one(functions, row, which, bottom[:, None] + step[:, None] * np.arange(-1.0, 2.0)).T
    rise = np.maximum(0.5 * (left + right) - lowest, np.finfo(float).tiny)
    away = step * np.sqrt(np.maximum(lowest, 0.0) / rise)
    close = away < reach
    row, bottom, away = row[close], bottom[close], away[close]
    widths = away[:, None] * WIDER ** np.arange(1.0 + np.ceil(np.log(reach / SHORTEST) / np.log(WIDER)))
    which, column = np.nonzero((widths < reach) & ((away >= SHORTEST)[:, None] | (np.arange(widths.shape[1]) == 0)))
    middle, aside = bottom[which], widths[which, column]
    places = np.concatenate([bottom, middle - aside, middle + aside])
    return np.concatenate([row, row[which], row[which]]), np.mod(places, TWO_PI)


def _with_neighbours(functions: Functions, angles: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Return the angles before and after each sample of a turn, the values there, and those at both neighbours."""
    before = np.concatenate([angles[:, -1:] - TWO_PI, angles[:, :-1]], axis=1)
    after = np.concatenate([angles[:, 1:], angles[:, :1] + TWO_PI], axis=1)
    values = functions(np.arange(len(angles)), angles)
    return before, after, values, np.roll(values, 1, axis=1), np.roll(values, -1, axis=1)


def _one(functions: Functions, row: Indices, which: Indices, phi: Array) -> Array:
    """Values (k, m) of the functions ``which`` (k,) of the designs ``row`` at crank angles (k, m)."""
    return functions(row, phi)[np.arange(row.size), :, which] if row.size else np.zeros(phi.shape)


def with_events(edges: Array, rows: Indices, phi: Array) -> Array:
    """Insert further edges (k,) into the panels' edges (n, p + 1); shorter rows repeat their last edge."""
    n = len(edges)
    count = np.bincount(rows, minlength=n)
    added = np.repeat(edges[:, -1:], int(count.max(initial=0)), axis=1)
    order = np.argsort(rows, kind="stable")
    place = np.arange(rows.size) - np.repeat(np.cumsum(count) - count, count)
    added[rows[order], place] = phi[order]
    return np.sort(np.concatenate([edges, added], axis=1), axis=1)
