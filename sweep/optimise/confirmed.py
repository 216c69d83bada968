"""The last word on the design that a search ends at is that of ``summarise``: the evaluation of data sets and tables.

The search looks at a few hundred poses and follows extrema from there.  Short phases of cams, narrow peaks, and loads
that jump between two of these poses may escape it; ``summarise`` knows where they are.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from kernels import status as st
from sweep.families.base import Accuracy
from sweep.optimise.certificate import Result
from sweep.optimise.form import SMALLEST, Program
from sweep.optimise.problem import Problem
from sweep.quantities.names import by_magnitude, error_of
from sweep.reductions.measures import Measure

TARGET = 1e-9  # relative error of the outputs that are compared, unless the problem asks for another
DIGITS = 1e-8  # of a value: what the search's own extrema may be off by beside that
DIFFERS = "differs"  # how a start ended whose extrema are not those of summarise


def confirmed(problem: Problem, program: Program, found: Result) -> Result:
    """Return a feasible result with the values of ``summarise``, where those of the search are not within their errors.

    Where they differ by more than rounding the result has not converged, since the conditions of optimality hold for
    other extrema; it is infeasible where it misses a limit by the values of ``summarise``.

    Parameters
    ----------
    problem, program : what was searched.  Limits that give up room to tolerances are not about the drawing: these are
        left to samples of what is made
    found : what the search says of its design
    """
    if not found.feasible or not math.isfinite(found.objective):
        return found
    limits = [r.measure for r in program.requirements if r.measure is not program.turning]
    asked = {
        m.name: m
        for m in (program.objective, *limits)
        if m.name not in problem.family.parameter_names and not _has_room(problem, m)
    }
    own = found.values | {program.objective.name: found.objective}
    true = _summarised(problem, found, tuple(asked))
    apart = {name: _apart(asked[name], own[name], value) for name, (value, _) in true.items()}
    other = {name: value for name, (value, err) in true.items() if not apart[name] <= err}
    far = [name for name in other if not apart[name] <= true[name][1] + DIGITS * _size(asked[name], true[name][0])]
    kept = replace(
        found,
        objective=other.get(program.objective.name, found.objective),
        values=found.values | {name: value for name, value in other.items() if name in found.values},
    )
    return _differing(problem, kept, {name: (other[name], apart[name]) for name in far}) if far else kept


def _differing(problem: Problem, kept: Result, far: dict[str, tuple[float, float]]) -> Result:
    """Return a result as not converged, or infeasible, of whose outputs some are by so much beside the search's."""
    short, missed = {}, []
    for limit in problem.limits:
        value = far[limit.output][0] if limit.output in far else math.nan
        low = -math.inf if limit.minimum is None else limit.minimum
        high = math.inf if limit.maximum is None else limit.maximum
        if limit.output in far and not low <= value <= high:
            short[limit.output] = max(low - value, value - high)
            missed.append(short[limit.output] / (abs(low if value < low else high) or 1.0))
    return replace(
        kept,
        gap=max(part / max(abs(value), SMALLEST) for value, part in far.values()),
        violation=max([kept.violation, *missed]),
        relaxation=short,
        status=st.LIMIT_EXCEEDED if short else st.NOT_CONVERGED,
        ended=DIFFERS if kept.ended in ("converged", "stalled") else kept.ended,
    )


def _has_room(problem: Problem, m: Measure) -> bool:
    """Return whether tolerances are in the value that the search has of an output, or in its limit."""
    return m.name in problem.allowances or any(s.output in problem.rooms for s in m.series)


def _summarised(problem: Problem, found: Result, names: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    """Return the value of each output of the design and its error; what has no error is as good as float64."""
    from sweep.evaluation.summaries import design_outputs

    accuracy = Accuracy(target=problem.accuracy.target or TARGET)
    columns = design_outputs(problem.family, found.design[None, :], names, accuracy, problem.window)
    out = {}
    for name in names:
        value, err = float(columns[name][0]), float(np.nan_to_num(columns.get(error_of(name), np.zeros(1)))[0])
        out[name] = (abs(value) if by_magnitude(name) else value, err)
    return out


def _apart(m: Measure, own: float, true: float) -> float:
    return abs(math.remainder(own - true, math.tau) if m.is_angle else own - true)


def _size(m: Measure, true: float) -> float:
    return max(abs(true), 1.0 if m.is_angle else 0.0)
