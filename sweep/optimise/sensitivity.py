"""How fast every output of a design changes with every one of its dimensions: exact, from the optimiser's gradients."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from sweep.families.base import Accuracy, Array, Family
from sweep.optimise.dense import times
from sweep.optimise.form import Program
from sweep.optimise.model import Model
from sweep.optimise.problem import Problem
from sweep.quantities.names import is_flag
from sweep.reductions.catalogue import output as described
from sweep.reductions.measures import Measure

TIE = 1e-6  # extrema this near to the largest one (relative) share it
DIMENSIONS = ("length", "angle", "ratio")  # a geared drive's dimensions are in planet radii
REACH = 0.1  # step outputs are differentiated over a thousandth of this part of the dimension


def sensitivities(
    family: Family, design: Array, outputs: Sequence[str], window: tuple[float, float] | None = None
) -> dict[str, list[Any]]:
    """Return derivatives of design outputs by lengths, angles and ratios of a design:
    dx/dp = dx/dy dy/dp, y the inner value.

    A maximum that several extrema share has two: the largest of their gradients where the dimension grows, the smallest
    where it shrinks.  A corner optimum has them of opposite signs.

    Parameters
    ----------
    family : of the design
    design : (P,)
    outputs : names of design outputs; swing and stroke count by magnitude, whether it turns (``rotatable``) is left out
    window : part of the stroke in which ``max_abs_dev`` counts

    Returns
    -------
    Rows ``parameter``, ``output``, ``value``, ``growing`` and ``shrinking`` (per internal unit of the parameter: mm,
    rad or 1), nan where the output does not exist.  Derivatives are exact to rounding (docs/optimiser.md, Gradients).
    An output that is constant in pieces, such as a count, has none: it has no rows.
    """
    varied = [k for k, p in enumerate(family.parameters) if p.unit in DIMENSIONS and p.choices is None]
    sizes = {
        unit: max((abs(design[k]) for k in varied if family.parameters[k].unit == unit), default=1.0) or 1.0
        for unit in ("length", "ratio")
    }
    span = np.array([REACH * sizes.get(family.parameters[k].unit, 1.0) for k in varied])
    names = tuple(family.parameters[k].name for k in varied)
    fixed = {n: float(x) for n, x in zip(family.parameter_names, design, strict=True) if n not in names}
    rows: dict[str, list[Any]] = {name: [] for name in ("parameter", "output", "value", "growing", "shrinking")}
    for output in outputs:
        if is_flag(output) or described(family, output).jumps:
            continue
        place = design[varied]
        problem = Problem(
            family, names, place - 0.5 * span, place + 0.5 * span, fixed, output, (), window, Accuracy(target=1e-9)
        )
        value, low, high = _ends(problem, design)
        rows["parameter"] += names
        rows["output"] += [output] * len(names)
        rows["value"] += [value] * len(names)
        rows["growing"] += (high / span).tolist()
        rows["shrinking"] += (low / span).tolist()
    return rows


def _ends(problem: Problem, design: Array) -> tuple[float, Array, Array]:
    """Return the value of the objective,
    smallest and largest of the gradients of the extrema that share it (scaled variables).
    """
    program = Program(problem)
    model = Model(problem, program, design, lambda: False)
    state = model.state(problem.scaled(design[None, :])[0])
    value = program.value(program.objective, state.form, model.curves, state.design, state.atoms)
    own = np.array([label.side == "objective" for label in state.form.labels], dtype=np.bool_)
    nothing = np.full(len(problem.variables), math.nan)
    if not own.any() or not math.isfinite(value):
        return math.nan, nothing, nothing
    inner = -(state.form.constant + times(state.form.matrix, state.atoms))[own] * model.scale
    jacobian = -model.jacobian(state.fractions, state.form, state.form.points)[own] * model.scale
    shared = jacobian[inner >= inner.max() - TIE * abs(inner.max())] * _outward(program.objective, float(inner.max()))
    return value, shared.min(axis=0), shared.max(axis=0)


def _outward(measure: Measure, inner: float) -> float:
    """Return the derivative of the output by its inner value."""
    if measure.kind == "minus":
        return _outward(measure.parts[0], -inner)
    if measure.inner == "pressure":  # inner = -cos^2 of the angle
        return 1.0 / (2.0 * math.sqrt(max(-inner * (1.0 + inner), 1e-300)))
    if measure.inner == "transmission":  # inner = sin^2 of the angle
        return 1.0 / (2.0 * math.sqrt(max(inner * (1.0 - inner), 1e-300)))
    if measure.inner == "ratio":
        return 2.0 * math.pi / (2.0 * math.pi - inner) ** 2
    if measure.inner == "square":
        return 0.5 / math.sqrt(abs(inner)) if inner else math.nan
    return 1.0
