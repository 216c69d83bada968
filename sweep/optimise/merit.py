"""What a set of proportions is worth: the least objective of its linear part, plus what missed limits cost."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sweep.families.base import Accuracy, Array
from sweep.families.chain import Chain
from sweep.optimise.linear import POSES, Elimination
from sweep.quantities.names import stem

if TYPE_CHECKING:
    from sweep.study import Limit

ACCURACY = Accuracy(samples=POSES)  # of what is not linear: pressure angles, the box of the coupler point
BEFORE = ("max_pressure_angle", "swing", "margin")  # of a stage: they do not change with point, line and scale
WEIGHT = 3.0  # price of a limit missed by its own size, in strokes
STUCK = 1e6  # above every objective: does not turn


def merit(linear: Elimination, designs: Array) -> tuple[Array, Array]:
    """Return finished designs (n, P), and the objective plus what missed limits cost (n,), the smaller the better.

    Designs that do not turn are not finished (nan) and rank by their margin behind all that do.
    """
    from sweep.chunks.cascade import compared
    from sweep.evaluation.summaries import design_outputs

    problem = linear.problem
    family, names = problem.family, problem.family.parameter_names
    limits = [x for x in problem.limits if not x.output.startswith(("rotatable", "stroke", "max_abs_dev"))]
    margins = [f"margin{stage.number}" for stage in family.stages] if isinstance(family, Chain) else []
    first = [x for x in limits if stem(x.output) in BEFORE]
    wanted = list(dict.fromkeys([*margins, *(x.output for x in first)]))
    columns = design_outputs(family, designs, wanted, ACCURACY, problem.window)
    margin = np.min([np.nan_to_num(columns[name], nan=-1e3) for name in margins], axis=0)
    worth = STUCK * (2.0 - margin)
    turns = np.flatnonzero(margin > 0.0)
    missed = np.zeros(len(designs))
    for limit in first:
        missed += _missed(limit, compared(limit.output, np.asarray(columns[limit.output], np.float64)))
    finished, least, solved = linear.solve(designs[turns])
    own = missed[turns]
    rest = [x for x in limits if x not in first]
    columns = {n: finished[:, k] for k, n in enumerate(names)}
    outputs = [x.output for x in rest if x.output not in names]
    if outputs:
        columns |= design_outputs(family, finished, outputs, ACCURACY, problem.window)
    for limit in rest:
        own = own + _missed(limit, compared(limit.output, np.asarray(columns[limit.output], np.float64)))
    out = np.full(designs.shape, np.nan)
    out[turns] = finished
    own = own + _outside(linear, finished)
    worth[turns] = np.where(solved, np.nan_to_num(least) + WEIGHT * linear.stroke * own, STUCK)
    return out, worth


def _outside(linear: Elimination, designs: Array) -> Array:
    """Return how far lengths of the guide lie outside their bounds, relative to them (n,)."""
    missed = np.zeros(len(designs))
    problem = linear.problem
    for name in linear.links:
        if name in problem.variables:
            k = problem.variables.index(name)
            values, high = designs[:, problem.family.parameter_names.index(name)], problem.upper[k]
            missed += np.maximum(values - high, 0.0) / abs(high)
            missed += np.maximum(problem.lower[k] - values, 0.0) / max(abs(problem.lower[k]), 1e-9)
    return missed


def _missed(limit: Limit, value: Array) -> Array:
    size = max(abs(limit.minimum or 0.0), abs(limit.maximum or 0.0)) or 1.0
    low = -math.inf if limit.minimum is None else limit.minimum
    high = math.inf if limit.maximum is None else limit.maximum
    return np.nan_to_num(np.maximum(np.maximum(low - value, value - high), 0.0) / size, nan=1e3)
