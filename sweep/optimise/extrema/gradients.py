"""Exact gradients: one call of the family's poses, with a complex step in every variable at all points together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from kernels.types import TWO_PI
from sweep.families.base import Accuracy, Angles, Array, Family, Step
from sweep.optimise.extrema.points import STEP, Curves, Points
from sweep.optimise.extrema.scanned import CROSSING, EDGE, PASSING, STATIC, moved_edges
from sweep.optimise.problem.statement import Problem
from sweep.quantities.measures import Measure
from sweep.reductions.steps import applying_step

# Mixed derivative of the slope: complex step in the variable, fourth-order difference in the crank angle (OFFSET
# [rad]).
OFFSET = 1e-3
EDGE_STEP = 1e-5  # share of a variable's bounds: step of the differences between designs at curve edges
CONSTANT = 1e-9  # share of a variable's bounds: a curve that varies less than by this step is constant
TIE = 1e-6  # share of a box: ends within this distance of the outermost count as equal
COARSE_ANGLES, REFINEMENT = 256, 16  # angles of a turn at which slopes of a constant curve are sampled; refinement
COARSE_TOPS = 4  # highest of them that are refined: between samples one a little lower may be the highest
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


def gradients(curves: Curves, designs: Any, points: Points, with_angles: bool) -> tuple[Array, Array]:
    """Return derivatives of the curves at the points, and of the points' crank angles, by the scaled variables.

    The motion of a stationary point does not contribute (envelope theorem); a crossing of the window's edge moves with
    the position curve and its two ends, and changes the curve's value by its slope.  The angle of a stationary point
    moves by -(dx'/dp)/x'', the angle at which a curve passes a level by -(dx/dp)/x'.

    Parameters
    ----------
    curves : curves of the problem
    designs : (n, P) complex: the design with the imaginary step STEP in one scaled variable each, see :func:`stepped`
    points : points tracked to this design by :meth:`Curves.follow` (values, slopes and curvatures are used)
    with_angles : whether the second result is needed; without it that array is zero

    Returns
    -------
    (K, n) and (K, n), per unit of the variables scaled to their bounds.  Measured against mpmath: 2e-15 relative for
    values and angles of passages, 5e-10 for angles of extrema (limited by the difference that gives the curvature).
    """
    value_slopes = curves.values(designs, points).imag.T / STEP
    angle_slopes = np.zeros_like(value_slopes)
    if with_angles:
        mixed = np.zeros_like(value_slopes)
        for offset, weight in STENCIL:
            mixed += weight / OFFSET * curves.values(designs, points.shifted(offset * OFFSET)).imag.T / STEP
        with np.errstate(divide="ignore", invalid="ignore"):
            angle_slopes = -mixed / points.curvature[:, None]
    passing = points.kind == PASSING
    if passing.any():
        # Implicit derivative of the root; the curve's value stays at the level.
        angle_slopes[passing] = -value_slopes[passing] / points.slope[passing, None]
        value_slopes[passing] = 0.0
    if (points.kind == EDGE).any():
        _at_edges(curves, designs, points, value_slopes, angle_slopes)
    crossing = points.kind == CROSSING
    position = curves.positions(designs, points) if crossing.any() else np.zeros((0, 0))
    for n in np.unique(points.series[crossing]):
        edges, (low, high) = crossing & (points.series == n), curves.stroke(points, n)
        if low < 0:
            continue
        target = position[:, [low]] + points.level[edges] * (position[:, [high]] - position[:, [low]])
        angle_slopes[edges] = (-(position[:, edges] - target).imag / STEP / points.position_slope[edges]).T
        value_slopes[edges] += points.slope[edges, None] * angle_slopes[edges]
    return value_slopes, angle_slopes


def _at_edges(curves: Curves, designs: Any, points: Points, value_slopes: Array, angle_slopes: Array) -> None:
    """Fill in the derivatives at curve edges, as differences between designs, each evaluated at its own edge.

    Margins for tolerances count as constant there.
    """
    base, direction = designs[0].real, designs.imag / STEP
    neighbours = np.concatenate([base + EDGE_STEP * direction, base - EDGE_STEP * direction])
    edges, n = np.flatnonzero(points.kind == EDGE), len(direction)
    phi = moved_edges(curves.problem.family, neighbours, points.phi[edges], points.level[edges], curves.plain)
    columns: dict[str, Any] = curves.family.poses(neighbours, Angles.of(phi), curves.wanted)
    angle_slopes[edges] = ((phi[:n] - phi[n:]) / (2.0 * EDGE_STEP)).T
    for number, series in enumerate(curves.series):
        mask = points.series[edges] == number
        x = columns[series.output][:, mask]  # a curve with edges is a pose output as it is
        value_slopes[edges[mask]] = ((x[:n] - x[n:]) / (2.0 * EDGE_STEP)).T


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
    operand = measure.parts[0] if measure.kind == "minus" else measure
    if operand.kind == "box":
        return (-1.0 if measure is not operand else 1.0) * _box_gradients(curves, designs, points, operand)
    if operand.kind not in ("max", "min", "max_abs", "range") or len(operand.series) != 1 or operand.series[0].window:
        return slopes[:0]
    number = curves.series.index(operand.series[0])
    values = points.value[points.series == number]
    noise = _rounding(values, slopes)
    if np.ptp(values) > noise:
        return slopes[:0]
    low, high = _slope_range(curves, designs, number)
    zero = operand.kind == "max_abs" and abs(values[0]) <= noise
    sign = np.sign(values[0]) if operand.kind == "max_abs" and not zero else operand.sign
    rows = [high - low, low - high] if operand.kind == "range" else [high, low, *([-high, -low] if zero else [])]
    return (-sign if measure is not operand else sign) * np.array(rows)


def _rounding(values: Array, slopes: Array) -> float:
    """Return the largest variation of a curve over the turn that counts as rounding, from its values and slopes."""
    return float(max(CONSTANT * np.abs(slopes).max(initial=0.0), 1e-13 * np.abs(values).max()))


def _box_gradients(curves: Curves, designs: Any, points: Points, box: Measure) -> Array:
    """Return the gradients (2, n) of a box for growing and for shrinking variables, from all of its equal ends."""
    candidates: list[tuple[float, Array, Array]] = []  # for the outermost: value, least and largest slope
    for number in (curves.series.index(s) for s in box.series):
        extrema = points.take(points.series == number)
        slopes = curves.values(designs, extrema).imag.T / STEP
        if len(extrema) and np.ptp(extrema.value) <= _rounding(extrema.value, slopes):
            candidates.append((float(extrema.value[0]), *_slope_range(curves, designs, number)))
        else:
            candidates += [(float(x), slope, slope) for x, slope in zip(extrema.value, slopes, strict=True)]
    for piece in box.pieces:
        fixed_joint = np.asarray(piece(designs), np.complex128)
        candidates.append((float(fixed_joint[0].real), fixed_joint.imag / STEP, fixed_joint.imag / STEP))
    values, low, high = (np.array(column) for column in zip(*candidates, strict=True))
    top, bottom = (np.abs(values - x) <= TIE * np.ptp(values) for x in (values.max(), values.min()))
    grows = high[top].max(axis=0) - low[bottom].min(axis=0)
    return np.array([grows, low[top].min(axis=0) - high[bottom].max(axis=0)])


def _slope_range(curves: Curves, designs: Any, number: int) -> tuple[Array, Array]:
    """Return the least and the largest derivative of a curve over the turn by each scaled variable, (n,) each."""
    indices, step = np.arange(len(designs)), TWO_PI / COARSE_ANGLES

    def slopes_at(phi: Array) -> Array:
        points = Points.of((number, angle, 1.0, STATIC, 0.0, 0.0) for angle in phi.ravel())
        return np.asarray(curves.values(designs, points).imag / STEP, np.float64)

    def extreme(sign: float) -> Array:
        measured = sign * coarse
        local = (measured >= np.roll(measured, 1, axis=1)) & (measured >= np.roll(measured, -1, axis=1))
        tops = np.argsort(-np.where(local, measured, -np.inf), axis=1, kind="stable")[:, :COARSE_TOPS]
        phi = first[tops]
        for width in (step, step / REFINEMENT, step / REFINEMENT**2):
            near = phi[:, :, None] + width * np.linspace(-1.0, 1.0, 2 * REFINEMENT + 1)
            fine = slopes_at(near).reshape(len(indices), *near.shape)[indices, indices]
            phi = np.take_along_axis(near, (sign * fine).argmax(axis=2)[:, :, None], axis=2)[:, :, 0]
        return np.asarray(sign * (sign * fine).max(axis=(1, 2)))

    first = step * np.arange(COARSE_ANGLES, dtype=np.float64)
    coarse = slopes_at(first)
    return extreme(-1.0), extreme(1.0)


def reading_gradient(curves: Curves, designs: Any, output: str, phi: float, angle_gradient: Array) -> Array:
    """Return the gradient of a pose output at a crank angle that moves with the design.

    Parameters
    ----------
    curves, designs : as of :func:`gradients`
    output : the pose output
    phi : crank angle at which the output is read [rad];  moves : (n,) derivatives of phi by the scaled variables
    """
    wanted = frozenset((output,))
    at_fixed_angle = curves.poses(designs, np.array([phi]), wanted)[output][:, 0].imag / STEP
    angle_slope = curves.poses(designs[:1].real, np.array([phi + 1j * STEP]), wanted)[output][0, 0].imag / STEP
    return np.asarray(at_fixed_angle + angle_slope * angle_gradient, np.float64)


def step_gradients(family: Family, designs: Any, outputs: Sequence[str], accuracy: Accuracy) -> dict[str, Array]:
    """Return gradients (n,) of the outputs that analytic steps of the family give, for designs of :func:`stepped`."""
    steps: dict[str, tuple[Step, list[str]]] = {}
    for name in outputs:
        applied = applying_step(family, name, accuracy)
        if applied is not None and applied[0].analytic:
            steps.setdefault(applied[0].name, (applied[0], []))[1].append(name)
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
