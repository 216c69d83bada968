"""Where continuous functions of the crank angle change their signs: found between samples, dips below zero included."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from sweep.numerics.quadrature import Array, Index, Mask

TWO_PI = 2.0 * np.pi
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
SECTIONS = 40
BISECTIONS = 56

Functions: TypeAlias = Callable[[Index, Array], Array]
"""``f(rows, phi)``: values (k, m, q) of q functions of the designs ``rows`` (k,) at crank angles (k, m)."""


def sign_changes(functions: Functions, angles: Array) -> tuple[Index, Array]:
    """Return designs (k,) and crank angles (k,) in [0, 2 pi) at which one of the functions changes its sign.

    Parameters
    ----------
    functions : continuous, periodic in 2 pi
    angles : (n, m) rising samples of one turn that resolve them: between neighbours at most one extremum

    Notes
    -----
    Zeros by bisection.  Two zeros between samples show as a dip: golden sections look for its bottom.
    """
    n = len(angles)
    before = np.concatenate([angles[:, -1:] - TWO_PI, angles[:, :-1]], axis=1)
    after = np.concatenate([angles[:, 1:], angles[:, :1] + TWO_PI], axis=1)
    values = functions(np.arange(n), angles)
    left, right = np.roll(values, 1, axis=1), np.roll(values, -1, axis=1)

    row, column, which = np.nonzero((values < 0.0) != (right < 0.0))
    brackets = [(row, which, angles[row, column], after[row, column])]

    dip = (np.abs(values) <= np.abs(left)) & (np.abs(values) <= np.abs(right))
    dip &= ((values < 0.0) == (left < 0.0)) & ((values < 0.0) == (right < 0.0))
    dip &= (left != 0.0) | (right != 0.0)  # a dwell goes nowhere
    row, column, which = np.nonzero(dip)
    near = _reaches(values, left, right, row, column, which)
    row, column, which = row[near], column[near], which[near]
    low, high = before[row, column], after[row, column]
    sign = np.where(values[row, column, which] < 0.0, -1.0, 1.0)
    bottom, lowest = _bottom(functions, row, which, sign, low, high)
    through = lowest < 0.0
    row, which, low, high, bottom = row[through], which[through], low[through], high[through], bottom[through]
    brackets += [(row, which, low, bottom), (row, which, bottom, high)]

    rows, numbers, lows, highs = (np.concatenate(parts) for parts in zip(*brackets, strict=True))
    negative = _one(functions, rows, numbers, lows) < 0.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (lows + highs)
        same = (_one(functions, rows, numbers, middle) < 0.0) == negative
        lows, highs = np.where(same, middle, lows), np.where(same, highs, middle)
    return rows, np.mod(0.5 * (lows + highs), TWO_PI)


def _one(functions: Functions, row: Index, which: Index, phi: Array) -> Array:
    if not row.size:
        return np.zeros(0)
    found: Array = functions(row, phi[:, None])[np.arange(row.size), 0, which]
    return found


def _reaches(values: Array, left: Array, right: Array, row: Index, column: Index, which: Index) -> Mask:
    """Return whether a dip may go through zero:
    a parabola goes below its lowest sample by an eighth of the bend at most.
    """
    a, b, c = (np.abs(y[row, column, which]) for y in (left, values, right))
    return np.asarray(b <= a + c - 2.0 * b)


def _bottom(
    functions: Functions, row: Index, which: Index, sign: Array, low: Array, high: Array
) -> tuple[Array, Array]:
    inner, outer = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_inner, at_outer = (sign * _one(functions, row, which, x) for x in (inner, outer))
    for _ in range(SECTIONS):
        left = at_inner < at_outer
        low, high = np.where(left, low, inner), np.where(left, outer, high)
        middle = np.where(left, high - GOLDEN * (high - low), low + GOLDEN * (high - low))
        value = sign * _one(functions, row, which, middle)
        inner, outer = np.where(left, middle, outer), np.where(left, inner, middle)
        at_inner, at_outer = np.where(left, value, at_outer), np.where(left, at_inner, value)
    return np.where(at_inner < at_outer, inner, outer), np.minimum(at_inner, at_outer)


def with_events(edges: Array, rows: Index, phi: Array) -> Array:
    """Return ends of panels (n, p + 1) with further ends (k,) put in; rows with fewer of them repeat their last end."""
    n = len(edges)
    count = np.bincount(rows, minlength=n)
    added = np.repeat(edges[:, -1:], int(count.max(initial=0)), axis=1)
    order = np.argsort(rows, kind="stable")
    place = np.arange(rows.size) - np.repeat(np.cumsum(count) - count, count)
    added[rows[order], place] = phi[order]
    return np.sort(np.concatenate([edges, added], axis=1), axis=1)
