"""Effects of manufacture on a design: exact derivatives by its dimensions, and samples of toleranced mechanisms."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array, Columns, Family, floats
from sweep.families.names import MINUS, is_flag, judged_by, without_minus
from sweep.optimise.extrema.gradients import level_gradients, scalar_gradient, step_gradients, stepped
from sweep.optimise.local.model import Model
from sweep.optimise.problem.program import Program
from sweep.optimise.problem.statement import Problem
from sweep.quantities.limits import Limit, compared, meets
from sweep.quantities.measures import measure
from sweep.quantities.resolve import output as described
from sweep.study import Study, Tolerance

TIE = 1e-6  # relative difference below which extrema count as equal to the largest one
DIMENSIONS = ("length", "angle", "ratio")  # with a tolerance; ratios are dimensions of a geared drive in planet radii
REACH = 0.1  # range of a dimension for the derivatives of step outputs, relative to the longest dimension


def sensitivities(
    family: Family, design: Array, outputs: Sequence[str], window: tuple[float, float] | None = None
) -> dict[str, list[Any]]:
    """Return derivatives of design outputs by lengths, angles and ratios of a design.

    They are dx/dp = dx/dy dy/dp, where y is the inner value.

    A maximum shared by several extrema has two derivatives: the largest of their gradients for growth of the dimension,
    the smallest for shrinkage; a shared minimum the other way round.  At a corner optimum their signs differ.

    Parameters
    ----------
    family : family of the design
    design : (P,)
    outputs : names of design outputs; swing and stroke count by magnitude, flags (``rotatable``) are left out
    window : part of the stroke in which deviations from a line count

    Returns
    -------
    Rows ``parameter``, ``output``, ``value``, ``growing`` and ``shrinking`` (per internal unit of the parameter: mm,
    rad or 1), nan if the output does not exist.  Derivatives are exact to rounding (docs/internals/optimiser.md,
    Gradients).  A piecewise constant output, such as a count, has no rows, and a design with a nan has none.
    """
    present = ~_absent(family, design)
    varied = [k for k, p in enumerate(family.parameters) if p.unit in DIMENSIONS and present[k]]
    scales = {
        unit: max((abs(design[k]) for k in varied if family.parameters[k].unit == unit), default=1.0) or 1.0
        for unit in ("length", "ratio")
    }
    span = np.array([REACH * scales.get(family.parameters[k].unit, 1.0) for k in varied])
    names = tuple(family.parameters[k].name for k in varied)
    fixed = {n: float(x) for n, x in zip(family.parameter_names, design, strict=True) if n not in names}
    rows: dict[str, list[Any]] = {name: [] for name in ("parameter", "output", "value", "growing", "shrinking")}
    differentiable = [name for name in outputs if not is_flag(name) and not described(family, name).jumps]
    centre, accuracy = design[varied], Accuracy(target=1e-9)

    def problem(output: str) -> Problem:
        return Problem(family, names, centre - 0.5 * span, centre + 0.5 * span, fixed, output, (), window, accuracy)

    differentiable = differentiable if np.isfinite(design).all() else []  # [locus] may have no links for the design
    plain = _plain_gradients(problem, design, [name for name in differentiable if _is_plain(family, name, window)])
    for output in differentiable:
        value, low, high = plain[output] if output in plain else _side_gradients(problem(output), design)
        rows["parameter"] += names
        rows["output"] += [output] * len(names)
        rows["value"] += [value] * len(names)
        rows["growing"] += (high / span).tolist()
        rows["shrinking"] += (low / span).tolist()
    return rows


def _is_plain(family: Family, output: str, window: tuple[float, float] | None) -> bool:
    """Tell whether an output is a plain number, without extrema to be tracked, and no parameter."""
    quantity = measure(family, output, window)
    return quantity.kind == "scalar" and not quantity.parts and output not in family.parameter_names


def _plain_gradients(
    problem: Callable[[str], Problem], design: Array, outputs: Sequence[str]
) -> dict[str, tuple[float, Array, Array]]:
    """Return the results of :func:`_side_gradients` for plain numbers; they share poses and steps."""
    if not outputs:
        return {}
    base = problem(outputs[0])
    fractions = base.scaled(design[None, :])[0]

    def values(designs: Array, names: Sequence[str]) -> Array:
        columns = design_outputs(base.family, designs, names, base.accuracy, base.window)
        return np.stack(floats(columns, *names), axis=1)

    steps = design + 1j * stepped(base, design, fractions).imag  # exactly at the design whose values are computed
    slopes = step_gradients(base.family, steps, outputs, base.accuracy)
    rest = [name for name in outputs if name not in slopes]
    if rest:
        gradients = scalar_gradient(lambda rows: values(base.placed(design, rows), rest), fractions)
        slopes |= dict(zip(rest, gradients.T, strict=True))
    numbers = values(design[None, :], outputs)[0]
    return {name: (float(x), slopes[name], slopes[name]) for name, x in zip(outputs, numbers, strict=True)}


def _side_gradients(problem: Problem, design: Array) -> tuple[float, Array, Array]:
    """Return the objective and its gradients by the scaled variables, for shrinking and for growing variables."""
    program = Program(problem)
    if program.objective.is_least:  # its extrema bound its negative from above
        opposite = without_minus(problem.objective) or f"{MINUS}{problem.objective}"
        value, low, high = _side_gradients(replace(problem, objective=opposite), design)
        return -value, -low, -high
    model = Model(problem, program, design, lambda: False)
    state = model.state(problem.scaled(design[None, :])[0])
    value = program.value(program.objective, state.form, model.curves, state.design, state.atoms)
    objective_rows = np.array([label.side == "objective" for label in state.form.labels], dtype=np.bool_)
    nan = np.full(len(problem.variables), math.nan)
    if not objective_rows.any() or not math.isfinite(value):
        return math.nan, nan, nan
    points = state.form.points
    inner = -(state.form.constant + state.form.matrix @ state.atoms)[objective_rows] * model.scale
    jacobian = -model.jacobian(state.fractions, state.form, points)[objective_rows] * model.scale
    tied = jacobian[inner >= inner.max() - TIE * abs(inner.max())]
    level = level_gradients(model.curves, stepped(problem, design, state.fractions), points, program.objective, tied)
    tied = np.concatenate([tied, level]) * program.objective.output_slope(float(inner.max()))
    return value, tied.min(axis=0), tied.max(axis=0)


SAMPLES = 2048  # a power of two: only then is a Sobol sample balanced
SIGMAS = 3.0  # a tolerance of +-t is three standard deviations
BAND = (2.5, 97.5)  # percent


def tolerances_of(family: Family, design: Array, tolerance: Tolerance) -> Array:
    """Return the tolerance (P,) of every parameter: its own, otherwise that of lengths or angles, zero for all others.

    A parameter that cannot be negative and is 0 in the design (P,), as the arm of a fork slot, is a missing part.
    """
    defaults, individual = {"length": tolerance.lengths, "angle": tolerance.angles}, dict(tolerance.own)
    widths = [individual.get(p.name, defaults.get(p.unit, 0.0)) for p in family.parameters]
    return np.where(_absent(family, design), 0.0, widths)


def _absent(family: Family, design: Array) -> NDArray[np.bool_]:
    """Tell which parameters (P,) of a design are choices or missing parts."""
    pairs = zip(family.parameters, design, strict=True)
    return np.array([p.choices is not None or (p.not_negative and x == 0.0) for p, x in pairs])


def sampled_designs(family: Family, design: Array, tolerance: Tolerance, seed: int, samples: int = SAMPLES) -> Array:
    """Return designs (samples, P) around a design, with independent normally distributed lengths and angles.

    Parameters
    ----------
    family : family of the design
    design : (P,)
    tolerance : +- of lengths (mm) and angles (rad), three standard deviations
    seed : seed of the scrambled Sobol sequence
    samples : a power of two
    """
    sigma = tolerances_of(family, design, tolerance) / SIGMAS
    varied = np.flatnonzero(sigma)
    designs = np.repeat(design[None, :], samples, axis=0)
    designs[:, varied] += sigma[varied] * _deviates(len(varied), seed, samples)
    return designs


@lru_cache(maxsize=2)  # designs of one search have the same sample around them, and tables a smaller one
def _deviates(dimensions: int, seed: int, samples: int) -> Array:
    """Return standard normal deviates (samples, dimensions) from a scrambled Sobol sequence."""
    from scipy.special import ndtri
    from scipy.stats import qmc

    uniform = qmc.Sobol(dimensions, seed=seed).random(samples)
    # A sample at 0 would give an infinite deviation.
    deviates: Array = ndtri(np.maximum(uniform, 0.5 / samples))
    return deviates


def tolerance_rows(
    family: Family, design: Array, outputs: Sequence[str], limits: Sequence[Limit], tolerance: Tolerance, seed: int,
    accuracy: Accuracy, window: tuple[float, float] | None = None,
) -> dict[str, list[Any]]:  # fmt: skip
    """Return the distribution of design outputs under manufacturing tolerances, from 2048 designs around the given one.

    A tolerance with fewer samples gives fewer designs.

    Parameters
    ----------
    family, design : (P,) nominal design
    outputs : names of design outputs
    limits : limits counted in ``within``, without equations, which no toleranced mechanism keeps
    tolerance, seed : see :func:`sampled_designs`
    accuracy, window : as for ``summarise``

    Returns
    -------
    Rows ``output``, ``nominal``, ``mean``, ``low``, ``high`` (2.5 and 97.5 % of the designs that have the output),
    ``missing`` (share without it), ``within`` (share that keeps its limits; nan without a limit); a last row
    "all limits" has only ``within``.  The share of 2048 designs is accurate to about 1 %.
    """
    limits = [limit for limit in limits if not limit.is_equation]
    designs = np.concatenate(
        [design[None, :], sampled_designs(family, design, tolerance, seed, min(SAMPLES, tolerance.samples))]
    )
    columns: dict[str, Any] = design_outputs(family, designs, list(outputs), accuracy, window)
    rows: list[tuple[Any, ...]] = []
    all_kept = np.ones(len(designs) - 1, dtype=np.bool_)
    for output in outputs:
        values = np.asarray(columns[output], np.float64)
        finite = values[1:][np.isfinite(values[1:])]
        low, high = np.percentile(finite, BAND) if len(finite) else (math.nan, math.nan)
        kept = [meets(limit, values[1:]) for limit in limits if limit.output == output]
        for mask in kept:
            all_kept &= mask
        within = float(np.logical_and.reduce(kept).mean()) if kept else math.nan
        mean = float(finite.mean()) if len(finite) else math.nan
        missing = 1.0 - len(finite) / len(all_kept)
        rows.append((output, float(values[0]), mean, float(low), float(high), missing, within))
    rows.append(("all limits", *[math.nan] * 5, float(all_kept.mean()) if limits else math.nan))
    names = ("output", "nominal", "mean", "low", "high", "missing", "within")
    return {name: list(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)}


COST_SAMPLE = 512  # mechanisms of the sample used for the cost of each dimension
COSTS = 8  # number of dimensions made exact, one at a time
TELLING_GAIN = 0.004  # share of mechanisms below which 512 of them show no cost of a dimension


class Cost(NamedTuple):
    """Cost of one dimension's tolerance, from the same mechanisms with this dimension exact.

    ``spread`` is its share in the variance of the output whose limit is violated most, ``gain`` the additional share of
    mechanisms that keep the limits.  A design at its limit gains nothing from any single dimension.
    """

    name: str
    text: str
    spread: float
    gain: float


class Manufactured(NamedTuple):
    """Sample of mechanisms of a design: the ``output`` violated most, its ``values`` (n,), and which keep all limits.

    ``costs`` are those of its dimensions, the dearest first.
    """

    output: str
    values: NDArray[np.generic]
    kept: NDArray[np.bool_]
    costs: tuple[Cost, ...]


def limits_of_made(study: Study) -> list[Limit]:
    """Return the inequality limits; a flag is replaced by the number that decides it, since a flag has no scatter."""
    limits = [limit for limit in study.output_limits if not limit.is_equation]
    return [Limit(judged_by(x.output), 0.0, None) if is_flag(x.output) else x for x in limits]


def manufactured(study: Study, design: Array, known: Columns | None = None) -> Manufactured | None:
    """Sample mechanisms of a design (P,); None without tolerances, a finite design, or an inequality limit.

    ``known`` are outputs of these mechanisms, as far as the search has computed them.
    """
    limits = limits_of_made(study)
    if study.tolerance is None or study.optimise is None or not limits or not np.isfinite(design).all():
        return None
    designs = sampled_designs(study.family, design, study.tolerance, study.optimise.seed, study.tolerance.samples)
    columns, kept = within_limits(study, limits, designs, known=known)
    worst = min(limits, key=lambda limit: float(meets(limit, columns[limit.output]).mean()))
    subset = {name: values[:COST_SAMPLE] for name, values in columns.items()}
    costs = _costs(study, limits, worst, design, designs[:COST_SAMPLE], subset, float(kept[:COST_SAMPLE].mean()))
    return Manufactured(worst.output, columns[worst.output], kept, tuple(costs))


def within_limits(
    source: Study | Problem, limits: Sequence[Limit], designs: Array, *more: str, known: Columns | None = None
) -> tuple[Columns, NDArray[np.bool_]]:
    """Return limited outputs and outputs ``more`` of designs (n, P), and which designs keep all limits, (n,).

    What is ``known`` of these designs is not computed again.
    """
    names, columns = list(dict.fromkeys([*(limit.output for limit in limits), *more])), known or {}
    if missing := [name for name in names if name not in columns]:
        columns = columns | design_outputs(source.family, designs, missing, source.accuracy, source.window)
    masks = [np.ones(len(designs), np.bool_), *(meets(limit, columns[limit.output]) for limit in limits)]
    return {name: columns[name] for name in names}, np.logical_and.reduce(masks)


def _costs(
    study: Study, limits: list[Limit], worst: Limit, design: Array, designs: Array,
    columns: Columns, baseline: float,
) -> list[Cost]:  # fmt: skip
    """Return the dimensions by the cost of their tolerances, the most expensive first.

    For the mechanisms ``designs`` the output ``columns`` are known, and the share ``baseline`` that keeps all limits.
    The dimensions with the largest share in the variance of an output, times the share that violates its limit, are
    made exact one at a time.  A limit that all these mechanisms keep by a standard deviation is kept then, too.
    """
    assert study.tolerance is not None
    limits = [x for x in limits if x is worst or _near(x, columns[x.output])]
    variance = _variance(columns, worst)
    costs = []
    varied = np.flatnonzero(tolerances_of(study.family, design, study.tolerance))
    importance = np.zeros(len(varied))
    for limit in limits:
        values = compared(limit.output, np.asarray(columns[limit.output], np.float64))
        finite = np.isfinite(values)
        if not finite.any():
            continue  # no mechanism has this output, and no single dimension changes that
        dp, dx = designs[finite][:, varied] - design[varied], values[finite] - values[finite].mean()
        shares = (dx @ dp) ** 2 / (dp**2).sum(axis=0)
        importance += shares / max(shares.sum(), 1e-300) * (1.0 - float(meets(limit, columns[limit.output]).mean()))
    for k in varied[np.argsort(-importance, kind="stable")[:COSTS]]:
        exact = designs.copy()
        exact[:, k] = design[k]
        parameter = study.family.parameters[k]
        columns, kept = within_limits(study, limits, exact)
        spread = 1.0 - _variance(columns, worst) / variance if variance > 0.0 else 0.0
        costs.append(Cost(parameter.name, parameter.text, max(spread, 0.0), float(kept.mean()) - baseline))
    return sorted(costs, key=lambda cost: (-cost.gain if cost.gain >= TELLING_GAIN else 0.0, -cost.spread))


def _near(limit: Limit, column: NDArray[np.generic]) -> bool:
    """Tell whether a value violates the limit, or is within one standard deviation of it."""
    return not meets(limit.drawn_in(math.sqrt(_variance({limit.output: column}, limit))), column).all()


def _variance(columns: Columns, limit: Limit) -> float:
    values = compared(limit.output, np.asarray(columns[limit.output], np.float64))
    finite = values[np.isfinite(values)]
    return float(finite.var()) if finite.size else 0.0
