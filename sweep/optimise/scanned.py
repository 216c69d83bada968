"""What samples of a curve show: its local extrema, and what stands at its edges; rows of `sweep.optimise.points`."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sweep.families.base import Array

STATIONARY, CROSSING, STATIC, EDGE = 0, 1, 2, 4  # how a point is held; 3 is PASSING of sweep.optimise.passages

Row: TypeAlias = tuple[int, float, float, int, float, float]


def extrema(
    n: int, phi: Array, x: Array, wrapped: bool, sense: float, inside: NDArray[np.bool_] | None = None
) -> list[Row]:
    """Return the maxima (sense +1) or minima (-1) of a curve."""
    if not np.isfinite(x).all():
        return []
    if wrapped:
        x = np.unwrap(x)
        if abs(x[0] - x[-1] + math.remainder(x[-1] - x[0], 2.0 * math.pi)) > 1.0:
            return []  # turns fully: no limit positions
    counts = np.ones(len(x), dtype=np.bool_) if inside is None else inside
    if not counts.any():
        return []
    top, bottom = float(x[counts].max()), float(x[counts].min())
    if top - bottom <= 1e-13 * max(abs(top), abs(bottom)):
        return [(n, float(phi[0]), sense, STATIC, math.nan, float(x[0]))]
    before, after, middle = np.roll(x, 1), np.roll(x, -1), 0.5 * (top + bottom)
    peak = counts & (sense * x > sense * before) & (sense * x >= sense * after)
    if inside is None:
        peak &= sense * (x - middle) >= 0.0  # in a window all count: a refused step cannot add those it met
    return [(n, float(phi[j]), sense, STATIONARY, math.nan, float(x[j])) for j in np.flatnonzero(peak)]


def tops(n: int, phi: Array, which: Array, values: Array, curve: Array) -> list[Row]:
    """Return rows of points at the higher side of every edge for maxima, at the lower one for minima.

    Their level says what the edge is, negative for a point before it.

    Parameters
    ----------
    n : number of the series
    phi, values : (2, k) both sides of the edges, and the curve there
    which : (k,) what each edge is
    curve : (m,) the curve over the turn: as elsewhere, only what is in its upper half can be a maximum that matters
    """
    if not np.isfinite(values).all():
        return []
    every = np.concatenate([curve, values.ravel()])
    middle = 0.5 * (float(every.max()) + float(every.min()))
    rows: list[Row] = []
    for sense in (1.0, -1.0):
        side = np.argmax(sense * values, axis=0)
        for k, x in enumerate(np.take_along_axis(values, side[None, :], axis=0)[0].tolist()):
            if sense * (x - middle) >= 0.0:
                rows.append((n, float(phi[side[k], k]), sense, EDGE, (2.0 * float(side[k]) - 1.0) * float(which[k]), x))
    return rows
