"""Tolerances of a design's dimensions, and exact derivatives of its outputs by them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array, Family, floats
from sweep.families.names import MINUS, is_flag, without_minus
from sweep.optimise.extrema.gradients import level_gradients, scalar_gradient, step_gradients, stepped
from sweep.optimise.local.model import Model
from sweep.optimise.problem.program import Program
from sweep.optimise.problem.statement import Problem
from sweep.quantities.measures import measure
from sweep.quantities.resolve import output as described
from sweep.study import Limit, Tolerance

SIGMAS = 3.0  # a tolerance of +-t is three standard deviations
TIE = 1e-6  # relative difference below which extrema count as equal to the largest one
DIMENSIONS = ("length", "angle", "ratio")  # with a tolerance; ratios are dimensions of a geared drive in planet radii
FAR = 10.0  # standard deviations beyond which no mechanism is made
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


def edge_deviation(problem: Problem, design: Array, sigma: Array, limit: Limit) -> float:
    """Return the largest standard deviation of the distances of tops and dips from the edges of their window.

    They are shares of the window; tops and dips beyond reach of the tolerances, and other outputs, have 0.

    Parameters
    ----------
    problem : its window counts
    design : (P,);  sigma : (P,) standard deviations of the dimensions
    limit : limit on the angle in the window
    """
    if measure(problem.family, limit.output, problem.window).kind != "stay":
        return 0.0
    varied, names = np.flatnonzero(sigma), problem.family.parameter_names
    centre, reach = design[varied], 0.5 * sigma[varied]
    fixed = {name: float(x) for k, (name, x) in enumerate(zip(names, design, strict=True)) if k not in varied}
    # Where the limit is missed, tops and dips may use up nothing of the angle.
    short = replace(limit, minimum=limit.minimum and math.tau, maximum=limit.maximum and -math.tau)
    own = Problem(
        problem.family, tuple(names[k] for k in varied), centre - reach, centre + reach, fixed, names[varied[0]],
        (short,), problem.window,
    )  # fmt: skip
    model = Model(own, Program(own), design, lambda: False)
    state = model.state(np.full(len(varied), 0.5))
    at_edges = np.array([label.bound_ratio == 0.0 for label in state.form.labels], dtype=np.bool_)
    distance = state.form.rows(state.atoms, 0.0)[at_edges]
    spread = np.linalg.norm(model.jacobian(state.fractions, state.form, state.form.points)[at_edges], axis=1)
    return float(spread[distance < FAR * spread].max(initial=0.0))


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
