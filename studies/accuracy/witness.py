"""A reference for any family, computed from positions only, without the register's derivatives and without a search.

The largest second derivative over a turn: second differences of the position on a fine grid locate the peaks, narrower
grids between their neighbours refine the locations, and around each the position at Chebyshev nodes is replaced by the
interpolating polynomial, whose own second derivative is maximised.  The width of the interval is that at which two
neighbouring widths agree best; their difference is the error of the reference.  The range of a position: narrowing
grids around its ends.  Families that have poses in twice the working precision are evaluated by those.

A march exists on its own grid only: there the reference is the same march in far finer steps, not another method.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.polynomial import chebyshev

from kernels.types import TWO_PI
from studies.accuracy.subjects import measure
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array, Family, March
from sweep.numerics.records import Indices
from sweep.reductions.sampling import on_closed_turn, pose_columns

GRID, FINER = 2048, 33  # angles of the first grid over a turn, and of each narrower one around a location
ROUNDS = 3  # narrower grids that refine the location of a peak
RANGE_ROUNDS = 7  # narrower grids that refine a height; at a corner each gains a factor of 16
ROUGH = 8  # number of the highest last samples, which show the roughness of the curve
PEAKS = 8  # highest second differences of one design
NODES = 33  # Chebyshev nodes of an interval
WIDEST, NARROWER, WIDTHS = 1.2, 0.75, 40  # half-widths of the intervals [rad], with the factor between neighbours
INNER = 0.3  # share of an interval in which the polynomial's second derivative is accurate
STEPS = 4  # steps of Newton's method from the best of close samples
ALIKE = 5  # neighbouring widths whose heights are compared
KINK = 1e-3  # a peak whose height varies more between widths is a corner of the position, not of its slope
MARCHED = (14_400, 28_800)  # steps of a march; their difference is its error
NOISE = 1e-3  # largest share of rounding in a second difference that still refines a location

Curve: TypeAlias = Callable[[Indices, Array, Array | None], Array]
"""``curve(rows, phi, near)``: values of some designs at angles (k, m), on the turn next to ``near`` if given."""


class Known(NamedTuple):
    """Values of a design output by the reference, (n,), and its own absolute error, (n,)."""

    value: Array
    error: Array


def reference(mechanism: Family, designs: Array) -> Known:
    """Return the reference values of the family's measure."""
    if isinstance(mechanism.domain, March):
        return _marched(mechanism, designs)
    name, precise = measure(mechanism), on_closed_turn(mechanism.precise())
    if name.startswith("range_"):
        ends = [extreme(precise, designs, precise.position, sign) for sign in (1, -1)]
        value = ends[0].value - ends[1].value
        return Known(value, ends[0].error + ends[1].error)
    return _sharpest(precise, designs)


def _marched(mechanism: Family, designs: Array) -> Known:
    coarse, fine = (
        np.asarray(
            design_outputs(mechanism, designs, [measure(mechanism)], Accuracy(samples=n))[measure(mechanism)],
            np.float64,
        )
        for n in MARCHED
    )
    return Known(fine, np.abs(coarse - fine))


def position(mechanism: Family, designs: Array, phi: Array) -> Array:
    """Return the position at angles (n, m) of each design, unwrapped along the row if it is an angle."""
    y = pose_columns(mechanism, designs, np.ascontiguousarray(phi), (mechanism.position,))[0][mechanism.position]
    return np.unwrap(y, axis=1) if mechanism.pose_output[mechanism.position].wraps else y


def extreme(mechanism: Family, designs: Array, name: str, sign: int) -> Known:
    """Return the largest value (sign 1), least value (-1) or largest magnitude (0) of a pose output over the turn.

    It is found by successively narrower grids around the highest samples, which corners and jumps do not disturb.
    """
    wraps = mechanism.pose_output[name].wraps

    def curve(rows: Indices, phi: Array, near: Array | None) -> Array:
        y = pose_columns(mechanism, designs[rows], np.ascontiguousarray(phi), (name,))[0][name]
        if wraps:
            y = np.unwrap(y, axis=1) if near is None else y + TWO_PI * np.rint((near[:, None] - y) / TWO_PI)
        return np.abs(y) if sign == 0 else sign * y

    found = _narrowed(curve, len(designs), sign if wraps else 1)
    return Known(-found.value, found.error) if sign < 0 else found


def _narrowed(curve: Curve, count: int, turned: int) -> Known:
    """Return the highest value of every curve, and its error."""
    reach = TWO_PI / GRID
    phi = np.arange(GRID) * reach
    y = curve(np.arange(count), np.tile(phi, (count, 1)), None)
    peak = (y >= np.roll(y, 1, axis=1)) & (y >= np.roll(y, -1, axis=1))
    order = np.argsort(-np.where(peak, y, -np.inf), axis=1)[:, :PEAKS]
    rows, ranks = np.nonzero(np.take_along_axis(peak, order, axis=1))
    centres, height = phi[order[rows, ranks]], y[rows, order[rows, ranks]]
    rise = np.zeros(rows.size)
    for _ in range(RANGE_ROUNDS):
        places = centres[:, None] + reach * np.linspace(-1.0, 1.0, FINER)
        y = curve(rows, places, turned * height)
        centres, top = places[np.arange(rows.size), y.argmax(axis=1)], y.max(axis=1)
        # The gain of the last grids, and the differences of neighbours when only rounding of the curve is left.
        rise = np.abs(top - height) + top - np.sort(y, axis=1)[:, -ROUGH]
        height = np.fmax(height, top)
        reach /= (FINER - 1) / 2
    value, error = np.full(count, np.nan), np.full(count, np.nan)
    for k in range(count):
        mine = np.flatnonzero(rows == k)
        if mine.size:
            best = mine[np.argmax(height[mine])]
            value[k], error[k] = height[best], rise[best]
    return Known(value, error)


def _sharpest(mechanism: Family, designs: Array) -> Known:
    """Return the largest magnitude of the second derivative of the position."""
    rows, centres = _peaks(mechanism, designs)
    heights, errors = _heights(mechanism, designs[rows], centres)
    value, error = np.full(len(designs), np.nan), np.full(len(designs), np.nan)
    for k in range(len(designs)):
        mine = np.flatnonzero(rows == k)
        if mine.size:
            smooth = mine[errors[mine] <= KINK * heights[mine]]
            if smooth.size == 0:
                continue
            best = smooth[np.argmax(heights[smooth])]
            value[k], error[k] = heights[best], errors[best]
    return Known(value, error)


def _peaks(mechanism: Family, designs: Array) -> tuple[Indices, Array]:
    """Return design and location of every peak of the second differences that may be the highest, (k,) each."""
    step = TWO_PI / GRID
    phi = np.tile(np.arange(-1, GRID + 1) * step, (len(designs), 1))
    bend = np.abs(np.diff(position(mechanism, designs, phi), 2, axis=1))
    peak = (bend >= np.roll(bend, 1, axis=1)) & (bend >= np.roll(bend, -1, axis=1))
    height = np.where(peak, bend, -1.0)
    order = np.argsort(-height, axis=1)[:, :PEAKS]
    rows, ranks = np.nonzero(np.take_along_axis(height, order, axis=1) > 0.0)
    centres = np.asarray(order[rows, ranks] * step, np.float64)
    reach = np.full(rows.size, step)
    for _ in range(ROUNDS):
        phi = centres[:, None] + reach[:, None] * np.linspace(-1.0, 1.0, FINER)
        y = position(mechanism, designs[rows], phi)
        bend = np.abs(np.diff(y, 2, axis=1))
        clear = bend.max(axis=1) * NOISE > 2.0**-51 * np.abs(y).max(axis=1)
        top = phi[np.arange(rows.size), 1 + bend.argmax(axis=1)]
        centres = np.where(clear, top, centres)
        reach = np.where(clear, 2.0 * reach / (FINER - 1), reach)
    return rows, centres


def _heights(mechanism: Family, designs: Array, centres: Array) -> tuple[Array, Array]:
    """Return the largest second derivative next to each centre, and its difference between neighbouring widths."""
    nodes, bend = chebyshev.chebpts1(NODES), _bending()
    growth = np.abs(chebyshev.chebvander(np.array([0.0, INNER]), NODES - 3) @ bend).sum(axis=1).max()
    found, noise = np.empty((len(designs), WIDTHS)), np.empty((len(designs), WIDTHS))
    for k, width in enumerate(WIDEST * NARROWER ** np.arange(WIDTHS)):
        y = position(mechanism, designs, centres[:, None] + width * nodes)
        # Not by BLAS, whose last bits, and with them the chosen width, depend on other work of the process.
        series = np.einsum("ij,kj->ik", bend, y - y[:, NODES // 2, None]) / width**2
        found[:, k] = _largest(series)
        # Positions are accurate to 0.7 units of 2^-53 of their terms; the fit adds its own rounding.
        noise[:, k] = 2.0**-52 * np.abs(y).max(axis=1) * growth / width**2
    spread = np.ptp(np.lib.stride_tricks.sliding_window_view(found, ALIKE, axis=1), axis=2)
    # Narrow intervals agree by accident; their rounding is counted against them.
    middle = ALIKE // 2
    error = np.fmax(spread, noise[:, middle:-middle])
    best, rows = np.argmin(error, axis=1), np.arange(len(designs))
    return found[rows, best + middle], error[rows, best]


def _bending() -> Array:
    """Return the Chebyshev coefficients of the second derivative from the values at the nodes in [-1, 1]."""
    orders = np.arange(NODES)
    places = np.pi * (np.arange(NODES)[::-1] + 0.5) / NODES
    fit = np.cos(orders[:, None] * places) * np.where(orders > 0, 2.0, 1.0)[:, None] / NODES
    second: Array = chebyshev.chebder(np.eye(NODES), 2) @ fit
    return second


def _largest(series: Array) -> Array:
    """Return the largest magnitude of Chebyshev series (orders, k) near the middle, by samples and Newton's method."""
    places = np.linspace(-INNER, INNER, 41)
    samples = np.abs(chebyshev.chebvander(places, len(series) - 1) @ series)
    x, height = places[samples.argmax(axis=0)], samples.max(axis=0)
    slope, bow = chebyshev.chebder(series), chebyshev.chebder(series, 2)
    for _ in range(STEPS):
        down = chebyshev.chebval(x, bow, tensor=False)
        step = np.divide(chebyshev.chebval(x, slope, tensor=False), down, out=np.zeros(x.size), where=down != 0.0)
        x = np.clip(x - step, -INNER, INNER)
    found: Array = np.maximum(height, np.abs(chebyshev.chebval(x, series, tensor=False)))
    return found
