"""Limits tightened by margins for tolerances, the price of a margin, and the allocation of risk among limits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sweep.families.base import Array
from sweep.optimise.local.model import Model
from sweep.optimise.manufacture.curve_margins import (
    POSES,
    Allowance,
    CurveMargin,
    allowances,
    curve_margins,
    curves_with_margin,
)
from sweep.optimise.manufacture.tolerance import FAR, SIGMAS, edge_deviation, sensitivities, tolerances_of
from sweep.optimise.problem.program import Program
from sweep.optimise.problem.statement import Problem
from sweep.quantities.limits import meets
from sweep.quantities.measures import measure
from sweep.study import Limit, Tolerance

SHIFTS = (0.2, 0.1, 0.05)  # steps of the compass search [standard deviations]; finer ones follow the sample's noise
MAX_ROUNDS = 100  # largest number of rounds of each step
CLOSE = 3.0  # distance from a limit, in margins, within which the slopes of its margin are computed
BOUND_STEP = 1e-3  # shift of bounds by which the change of their rows is found [standard deviations]
TURN: Array = np.arange(POSES, dtype=np.float64) * (2.0 * math.pi / POSES)

Levels = Mapping[str, float]
"""Numbers of standard deviations in the margins of limits, by the keys of :func:`margin_keys`."""


def inequalities(problem: Problem) -> list[Limit]:
    """Return the inequality limits on outputs, which get a margin; limits on parameters apply to the nominal design."""
    on_outputs = [x for x in problem.limits if x.output not in problem.family.parameter_names]
    return [x for x in on_outputs if not x.is_equation]


def margin_keys(problem: Problem) -> dict[str, str]:
    """Return the limited outputs that get a margin, each with the key of its number of standard deviations.

    Limits on one curve share its margin, so their key is the pose output.  The key of any other limit is its own name.
    """
    along = curves_with_margin(problem)
    names = dict.fromkeys(x.output for x in inequalities(problem))
    return {name: along.get(name, name) for name in names if not name.startswith("rotatable")}


class Scatter:
    """Standard deviations of the limited outputs of a design, and their changes with the design.

    The values of the last design are cached, since a search needs margins with other numbers of standard deviations.

    Parameters
    ----------
    problem : problem with the limits as given
    tolerance : manufacturing tolerances
    """

    def __init__(self, problem: Problem, tolerance: Tolerance) -> None:
        self.problem, self.tolerance, self.keys = problem, tolerance, margin_keys(problem)
        self._design: Array = np.empty(0)
        self.curves: dict[str, CurveMargin] = {}
        self.single: dict[str, tuple[float, float]] = {}
        self.at_edges: dict[str, float] = {}
        self._changes: dict[str, Allowance] = {}

    def update(self, design: Array) -> None:
        """Compute the deviations ``curves`` of curves, and those of ``single`` outputs with their values."""
        if np.array_equal(design, self._design):
            return
        sigma = tolerances_of(self.problem.family, design, self.tolerance) / SIGMAS
        along = {key: 1.0 for name, key in self.keys.items() if key != name}
        self.curves = curve_margins(self.problem, design, sigma, along)
        single = [name for name, key in self.keys.items() if key not in self.curves]
        self.single = _deviations(self.problem, design, sigma, single)
        limits = [x for x in inequalities(self.problem) if x.output in self.single]
        self.at_edges = {x.output: edge_deviation(self.problem, design, sigma, x) for x in limits}
        self._design, self._sigma, self._changes = design.copy(), sigma, {}

    def changes(self, names: Sequence[str]) -> dict[str, Allowance]:
        """Return the changes of single outputs' deviations with the variables, at the design of the last `look`."""
        new = [name for name in names if name not in self._changes]
        if new:

            def spread(row: Array) -> dict[str, float]:
                return {name: sigma for name, (sigma, _) in _deviations(self.problem, row, self._sigma, new).items()}

            self._changes |= allowances(self.problem, self._design, spread)
        return {name: self._changes[name] for name in names if name in self._changes}


def with_margins(scatter: Scatter, design: Array, levels: Levels, radius: float | None) -> Problem:
    """Return the problem with its limits tightened by the margins at a design, bounded to a box around that design.

    Parameters
    ----------
    scatter : deviations of the problem's outputs
    design : (P,)
    levels : number of standard deviations in the margin of each limit
    radius : half width of the box in scaled variables; None for the bounds of the problem
    """
    problem, keys = scatter.problem, scatter.keys
    scatter.update(design)
    curves = {key: curve.times(levels[key]) for key, curve in scatter.curves.items()}
    fixed = {name: (levels[keys[name]] * spread, value) for name, (spread, value) in scatter.single.items()}
    # A band narrower than both margins becomes infeasible until a design needs smaller ones.
    limits = tuple(_drawn_in(problem, x, fixed[x.output][0]) if x.output in fixed else x for x in problem.limits)
    close = [x.output for x in problem.limits if x.output in fixed and _is_close(x, *fixed[x.output])]
    changes = scatter.changes(close)
    allowances = {
        name: replace(changes.get(name, Allowance()), at_edges=scatter.at_edges[name]).times(levels[keys[name]])
        for name in close
    }
    lower, upper = problem.lower, problem.upper
    if radius is not None:
        centre = np.clip(problem.scaled(design[None, :])[0], 0.0, 1.0)
        lower = problem.lower + np.maximum(centre - radius, 0.0) * problem.span
        upper = problem.lower + np.minimum(centre + radius, 1.0) * problem.span
    return replace(problem, limits=limits, curve_margins=curves, allowances=allowances, lower=lower, upper=upper)


@dataclass(frozen=True)
class Price:
    """Price of a limit's margin, and its unit.

    ``price`` is the relative change of the objective per standard deviation of margin; ``spread`` is that standard
    deviation, for a curve at the angles where it is at its limit.
    """

    price: float
    spread: float


def prices(scatter: Scatter, design: Array, levels: Levels) -> dict[str, Price]:
    """Return the price of the margin of every limit at an optimum of :func:`with_margins`, by its key.

    It follows from the multipliers of the active rows: a bound shifted by a standard deviation shifts its rows, and the
    objective changes by their multipliers times that.
    """
    tight = with_margins(scatter, design, levels, None)
    keys, units, spreads = scatter.keys, scatter.curves, scatter.single
    model = Model(tight, Program(tight), design, lambda: False)
    state = model.state(tight.scaled(design[None, :])[0])
    duals, form, points = model.certificate(state), state.form, state.form.points
    step = {name: BOUND_STEP * spread for name, (spread, _) in spreads.items()}
    limits = tuple(_drawn_in(tight, x, step[x.output]) if x.output in step else x for x in tight.limits)
    allowances = {
        name: replace(allowance, at_edges=allowance.at_edges + BOUND_STEP * scatter.at_edges[name])
        for name, allowance in tight.allowances.items()
    }
    tighter = Program(replace(tight, limits=limits, allowances=allowances))
    shifted = tighter.lay_out(model.curves, design, points, form.complete, model.scale)
    change = (form.rows(state.atoms, 0.0) - shifted.rows(state.atoms, 0.0)) / BOUND_STEP
    price, weight = dict.fromkeys(keys.values(), 0.0), dict.fromkeys(units, 0.0)
    for row, label in enumerate(form.labels):
        key = keys.get(label.name)
        if key is None:
            continue
        if key in units:
            active = duals.weights[row] * np.abs(form.matrix[row, : len(points)])
            price[key] += float((active * units[key].at(design[None, :], points.phi)[0]).sum())
            weight[key] += float(active.sum())
        else:
            price[key] += float(duals.weights[row] * change[row])
    out = {key: Price(max(price[key], 0.0), spreads[key][0]) for key in keys.values() if key not in units}
    for key, unit in units.items():
        spread = price[key] / weight[key] if weight[key] > 0.0 else float(unit.at(design[None, :], TURN)[0].max())
        out[key] = Price(max(price[key], 0.0), spread)
    return out


def excesses(problem: Problem, outputs: Mapping[str, Array], units: Mapping[str, Price]) -> dict[str, Array]:
    """Return the excess of outputs over their limits in standard deviations, by the keys of the limits.

    It is infinite for a mechanism without the output, and for one that does not turn: no margin helps there.

    Parameters
    ----------
    problem : problem with the limits as given
    outputs : limited outputs of n mechanisms, as compared with limits
    units : standard deviation of every limit
    """
    keys, out = margin_keys(problem), dict[str, Array]()
    failing: NDArray[np.bool_] = np.zeros(1, np.bool_)
    for limit in inequalities(problem):
        key, values = keys.get(limit.output), outputs[limit.output]
        if key is None:
            failing = failing | ~meets(limit, values)
            continue
        low, high = limit.ends
        violation, unit = np.maximum(low - values, values - high), units[key].spread
        excess = violation / unit if unit > 0.0 else np.where(violation > 0.0, math.inf, -math.inf)
        excess = _by_rank(np.where(np.isnan(excess), math.inf, excess))
        out[key] = np.maximum(out[key], excess) if key in out else excess
    return {key: np.where(failing, math.inf, excess) for key, excess in out.items()}


def _by_rank(excess: Array) -> Array:
    """Return excesses (n,), of which those behind a jump, as of an angle that a dip cuts off, are normal by rank."""
    from scipy.special import ndtri

    jumped = np.flatnonzero((excess > FAR) & np.isfinite(excess))
    out = excess.copy()
    quantiles = ndtri((np.arange(1.0, len(jumped) + 1.0) - 0.5) / len(excess))
    out[jumped[np.argsort(-excess[jumped], kind="stable")]] = quantiles[-1:] - quantiles
    return out


def _drawn_in(problem: Problem, limit: Limit, margin: float) -> Limit:
    """Return the limit tightened by a margin, at most to the end of the values that its output can have."""
    drawn, quantity = limit.drawn_in(margin), measure(problem.family, limit.output, problem.window)
    if not quantity.refused(drawn.minimum, drawn.maximum):
        return drawn
    # No design keeps it: like a band narrower than its margins, it is missed until a design needs a smaller margin.
    low, high = (x if x is None else quantity.nearest(x) for x in (drawn.minimum, drawn.maximum))
    return replace(drawn, minimum=low, maximum=high)


def _is_close(limit: Limit, margin: float, value: float) -> bool:
    """Tell whether a limit is so close that the change of its margin may matter."""
    low, high = limit.ends
    return value - CLOSE * margin < low or value + CLOSE * margin > high


def _deviations(problem: Problem, design: Array, sigma: Array, names: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Return standard deviations of outputs, from exact derivatives by all toleranced dimensions, with their values."""
    if not names:
        return {}
    rows = sensitivities(problem.family, design, names, problem.window)
    sigmas = dict(zip(problem.family.parameter_names, sigma, strict=True))
    variance, values = dict.fromkeys(names, 0.0), dict.fromkeys(names, math.nan)
    kinds = ("parameter", "output", "value", "growing", "shrinking")
    for name, output, value, up, down in zip(*(rows[k] for k in kinds), strict=True):
        change = max(abs(up), abs(down)) * sigmas[name]
        variance[output] += change * change if math.isfinite(change) else 0.0
        values[output] = value
    return {name: (math.sqrt(v), values[name]) for name, v in variance.items()}


def risk_allocation(excess: Array, prices: Array, share: float, reach: float = math.inf) -> tuple[Array, float]:
    """Return the shifts of all limits' margins with which a share of a sample keeps the limits, at the least price.

    A larger margin moves the whole sample away from a limit.  The share holds if the largest excess minus its limit's
    shift is negative; the sum of prices times shifts is minimised under this condition.

    Parameters
    ----------
    excess : (n, L) excess of each mechanism over each limit, in units of the limit's margin; negative if it keeps the
        limit, infinite if no margin helps
    prices : (L,) price of a unit of margin, not negative
    share : share of the sample that has to keep all limits, between 0 and 1
    reach : largest difference of a limit's shift from that of the most expensive limit

    Returns
    -------
    shifts (L,), and the saving against an equal shift of all limits.  Both are infinite if too many mechanisms are
    lost.

    Notes
    -----
    For normally distributed excesses the share is log-concave in the shifts (Prekopa 1971), so the minimum of the
    price is unique, and a compass search finds it.  Its last step leaves some 0.1 % of the saving.
    """
    rank = min(max(math.ceil(share * len(excess)), 1), len(excess))
    ranks = [rank - 1, min(rank, len(excess) - 1)]  # the last mechanism that keeps all limits, and the next
    weights = prices if prices.any() else np.ones(len(prices))
    total, dearest = float(weights.sum()), int(np.argmax(weights))

    def common(offsets: Array) -> float:
        ends = np.partition((excess - offsets).max(axis=1), ranks)[ranks]
        return float(ends.mean() if np.isfinite(ends[1]) else ends[0])

    offsets = np.zeros(len(weights))
    equal_cost = best = total * common(offsets)
    if not math.isfinite(best):
        return np.full(len(weights), math.inf), 0.0
    for step in SHIFTS:
        for _ in range(MAX_ROUNDS):
            previous = best
            for k in range(len(weights)):
                for move in (step, -step):
                    trial = offsets.copy()
                    trial[k] += move
                    if k == dearest or abs(trial[k]) > reach:
                        continue
                    value = float((weights * trial).sum()) + total * common(trial)
                    if value < best:
                        offsets, best = trial, value
            if best >= previous:
                break
    return offsets + common(offsets), equal_cost - best
