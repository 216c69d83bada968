"""Exact gradients: one call of the family's poses, with a complex step in every variable at all points together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from kernels.types import TWO_PI
from sweep.families.base import Accuracy, Angles, Array, Family, Step
from sweep.optimise.extrema.points import STEP, Curves, Points
from sweep.optimise.extrema.scanned import CROSSING, EDGE, PASSING, STATIC, followed
from sweep.optimise.problem.statement import Problem
from sweep.quantities.measures import Measure
from sweep.reductions.steps import applying_step

# Mixed derivative of the slope: complex step in the variable, fourth-order difference in the crank angle (OFFSET
# [rad]).
OFFSET = 1e-3
ALONG = 1e-5  # share of a variable's bounds: step of the differences between designs at curve edges
LEVEL = 1e-9  # share of a variable's bounds: a curve of less variation than this step causes is constant over the turn
ALIKE = 1e-6  # share of a box: ends within this distance of the outermost count as equal
LOOKS, ZOOM = 256, 16  # angles of a turn at which slopes of a constant curve are sampled; refinement
STENCIL = ((-2.0, 1.0 / 12.0), (-1.0, -8.0 / 12.0), (1.0, 8.0 / 12.0), (2.0, -1.0 / 12.0))

# Twelve times the weights of the derivative at the first, the middle and the last of five equidistant points.
FIVE_POINTS = {
    2.0: (-25.0, 48.0, -36.0, 16.0, -3.0),
    0.0: (1.0, -8.0, 0.0, 8.0, -1.0),
    -2.0: (3.0, -16.0, 36.0, -48.0, 25.0),
}


def stepped(problem: Problem, base: Array, fractions: Array) -> Any:
    """Return n complex designs (n, P), each with the imaginary step STEP in one scaled variable and its dependants."""
    return problem.placed(base, fractions + 1j * STEP * np.eye(len(fractions)))


def gradients(curves: Curves, designs: Any, points: Points, places: bool) -> tuple[Array, Array]:
    """Return derivatives of the curves at the points, and of the points' crank angles, by the scaled variables.

    The motion of a stationary point does not contribute (envelope theorem); a crossing of the window's edge moves with
    the position curve and its two ends, and changes the curve's value by its slope.  The angle of a stationary point
    moves by -(dx'/dp)/x'', the angle at which a curve passes a level by -(dx/dp)/x'.

    Parameters
    ----------
    curves : curves of the problem
    designs : (n, P) complex: the design with the imaginary step STEP in one scaled variable each, see :func:`stepped`
    points : points tracked to this design by :meth:`Curves.follow` (values, slopes and curvatures are used)
    places : whether the second result is needed; without it that array is zero

    Returns
    -------
    (K, n) and (K, n), per unit of the variables scaled to their bounds.  Measured against mpmath: 2e-15 relative for
    values and angles of passages, 5e-10 for angles of extrema (limited by the difference that gives the curvature).
    """
    values = curves.values(designs, points).imag.T / STEP
    moves = np.zeros_like(values)
    if places:
        mixed = np.zeros_like(values)
        for offset, weight in STENCIL:
            mixed += weight / OFFSET * curves.values(designs, points.shifted(offset * OFFSET)).imag.T / STEP
        with np.errstate(divide="ignore", invalid="ignore"):
            moves = -mixed / points.curvature[:, None]
    passing = points.how == PASSING
    if passing.any():
        # Implicit derivative of the root; the curve's value stays at the level.
        moves[passing] = -values[passing] / points.slope[passing, None]
        values[passing] = 0.0
    if (points.how == EDGE).any():
        _at_edges(curves, designs, points, values, moves)
    crossing = points.how == CROSSING
    place = curves.positions(designs, points) if crossing.any() else np.zeros((0, 0))
    for n in np.unique(points.series[crossing]):
        edges, (low, high) = crossing & (points.series == n), curves.stroke(points, n)
        if low < 0:
            continue
        target = place[:, [low]] + points.level[edges] * (place[:, [high]] - place[:, [low]])
        moves[edges] = (-(place[:, edges] - target).imag / STEP / points.pace[edges]).T
        values[edges] += points.slope[edges, None] * moves[edges]
    return values, moves


def _at_edges(curves: Curves, designs: Any, points: Points, values: Array, moves: Array) -> None:
    """Fill in the derivatives at curve edges, as differences between designs, each evaluated at its own edge.

    Margins for tolerances count as constant there.
    """
    base, direction = designs[0].real, designs.imag / STEP
    both = np.concatenate([base + ALONG * direction, base - ALONG * direction])
    which, n = np.flatnonzero(points.how == EDGE), len(direction)
    phi = followed(curves.problem.family, both, points.phi[which], points.level[which], curves.plain)
    columns = curves.family.poses(both, Angles.of(phi), curves.wanted)
    moves[which] = ((phi[:n] - phi[n:]) / (2.0 * ALONG)).T
    for number, series in enumerate(curves.series):
        own = points.series[which] == number
        x = curves.curve(series, columns)[:, own] if own.any() else np.zeros((2 * n, 0))
        values[which[own]] = ((x[:n] - x[n:]) / (2.0 * ALONG)).T


def level_gradients(curves: Curves, designs: Any, points: Points, measure: Measure, slopes: Array) -> Array:
    """Return gradients (k, n) of a reduction of a curve that is constant over the turn; none for any other curve.

    Every angle is an extremum of such a curve, so the slopes at all angles count: if a variable grows, a maximum has
    the largest slope, a range the largest minus the smallest.  For a box the gradients of all its ends are returned.

    Parameters
    ----------
    curves, designs, points : as of :func:`gradients`
    measure : the reduction, or its negative
    slopes : (K, n) gradients at the points, which give the scale of rounding noise
    """
    of = measure.parts[0] if measure.kind == "minus" else measure
    if of.kind == "box":
        return (-1.0 if measure is not of else 1.0) * _of_box(curves, designs, points, of)
    if of.kind not in ("max", "min", "max_abs", "range") or len(of.series) != 1 or of.series[0].window:
        return slopes[:0]
    number = curves.series.index(of.series[0])
    values = points.value[points.series == number]
    noise = _noise(values, slopes)
    if np.ptp(values) > noise:
        return slopes[:0]
    low, high = _along_the_turn(curves, designs, number)
    zero = of.kind == "max_abs" and abs(values[0]) <= noise
    sign = np.sign(values[0]) if of.kind == "max_abs" and not zero else of.sign
    rows = [high - low, low - high] if of.kind == "range" else [high, low, *([-high, -low] if zero else [])]
    return (-sign if measure is not of else sign) * np.array(rows)


def _noise(values: Array, slopes: Array) -> float:
    """Return the largest variation of a curve over the turn that counts as rounding, from its values and slopes."""
    return float(max(LEVEL * np.abs(slopes).max(initial=0.0), 1e-13 * np.abs(values).max()))


def _of_box(curves: Curves, designs: Any, points: Points, box: Measure) -> Array:
    """Return the gradients (2, n) of a box for growing and for shrinking variables, from all of its equal ends."""
    ends: list[tuple[float, Array, Array]] = []  # candidates for the outermost ends: value, least and largest slope
    for number in (curves.series.index(s) for s in box.series):
        own = points.take(points.series == number)
        slopes = curves.values(designs, own).imag.T / STEP
        if len(own) and np.ptp(own.value) <= _noise(own.value, slopes):
            ends.append((float(own.value[0]), *_along_the_turn(curves, designs, number)))
        else:
            ends += [(float(x), slope, slope) for x, slope in zip(own.value, slopes, strict=True)]
    for piece in box.pieces:
        still = np.asarray(piece(designs), np.complex128)
        ends.append((float(still[0].real), still.imag / STEP, still.imag / STEP))
    values, low, high = (np.array(column) for column in zip(*ends, strict=True))
    top, bottom = (np.abs(values - x) <= ALIKE * np.ptp(values) for x in (values.max(), values.min()))
    grows = high[top].max(axis=0) - low[bottom].min(axis=0)
    return np.array([grows, low[top].min(axis=0) - high[bottom].max(axis=0)])


def _along_the_turn(curves: Curves, designs: Any, number: int) -> tuple[Array, Array]:
    """Return the least and the largest derivative of a curve over the turn by each scaled variable, (n,) each."""
    every, step = np.arange(len(designs)), TWO_PI / LOOKS

    def at(phi: Array) -> Array:
        there = Points.of((number, angle, 1.0, STATIC, 0.0, 0.0) for angle in phi.ravel())
        return np.asarray(curves.values(designs, there).imag / STEP, np.float64)

    def extreme(sign: float) -> Array:
        phi = first[(sign * coarse).argmax(axis=1)]
        for width in (step, step / ZOOM, step / ZOOM**2):
            near = phi[:, None] + width * np.linspace(-1.0, 1.0, 2 * ZOOM + 1)
            fine = at(near).reshape(len(every), *near.shape)[every, every]
            phi = near[every, (sign * fine).argmax(axis=1)]
        return np.asarray(sign * (sign * fine).max(axis=1))

    first = step * np.arange(LOOKS, dtype=np.float64)
    coarse = at(first)
    return extreme(-1.0), extreme(1.0)


def reading_gradient(curves: Curves, designs: Any, output: str, phi: float, moves: Array) -> Array:
    """Return the gradient of a pose output at a crank angle that moves with the design.

    Parameters
    ----------
    curves, designs : as of :func:`gradients`
    output : the pose output
    phi : crank angle at which the output is read [rad];  moves : (n,) derivatives of phi by the scaled variables
    """
    wanted = frozenset((output,))
    standing = curves.poses(designs, np.array([phi]), wanted)[output][:, 0].imag / STEP
    along = curves.poses(designs[:1].real, np.array([phi + 1j * STEP]), wanted)[output][0, 0].imag / STEP
    return np.asarray(standing + along * moves, np.float64)


def step_gradients(family: Family, designs: Any, outputs: Sequence[str], accuracy: Accuracy) -> dict[str, Array]:
    """Return gradients (n,) of the outputs that analytic steps of the family give, for designs of :func:`stepped`."""
    steps: dict[str, tuple[Step, list[str]]] = {}
    for name in outputs:
        found = applying_step(family, name, accuracy)
        if found is not None and found[0].analytic:
            steps.setdefault(found[0].name, (found[0], []))[1].append(name)
    gradients: dict[str, Array] = {}
    for step, names in steps.values():
        with np.errstate(all="ignore"):  # an output that is nan has no gradient
            columns: Any = step.run(designs, frozenset(names), accuracy)
        gradients |= {name: columns[name].imag / STEP for name in names}
    return gradients


def scalar_gradient(function: Any, fractions: Array) -> Array:
    """Return the gradient of a function without known structure, from five values per variable.

    Exact steps of a family are accurate to 1e-15, so a fourth-order difference over 1e-3 of the bounds is accurate to
    1e-11.  Near a bound the five points lie on the inner side.

    Parameters
    ----------
    function : takes (k, n) scaled variables, returns (k,), or (k, m) for m functions at once
    fractions : (n,) scaled variables at which the gradient is taken

    Returns
    -------
    (n,), or (n, m)
    """
    n, step = len(fractions), 1e-3
    samples, weights = [], []
    for j in range(n):
        shift = 0.0 if 2.0 * step <= fractions[j] <= 1.0 - 2.0 * step else 2.0 * math.copysign(1.0, 0.5 - fractions[j])
        nodes = np.arange(-2.0, 3.0) + shift
        weights.append(np.array(FIVE_POINTS[shift]) / (12.0 * step))
        moved = np.repeat(fractions[None, :], 5, axis=0)
        moved[:, j] += nodes * step
        samples.append(moved)
    values = np.asarray(function(np.concatenate(samples)), np.float64)
    by_variable = values.reshape(n, 5, *values.shape[1:])
    weight = np.array(weights).reshape(n, 5, *(1,) * (values.ndim - 1))
    return np.asarray(np.sum(by_variable * weight, axis=1), np.float64)
