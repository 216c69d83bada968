"""One start: the search from it, and the verification of its final design by ``summarise``."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from kernels import status as st
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array
from sweep.families.names import by_magnitude, error_of
from sweep.optimise.local.descent import KKT, Descent
from sweep.optimise.local.kkt import Multipliers, Result, in_words, multipliers
from sweep.optimise.local.model import LooksUsedUp, State, Stopped
from sweep.optimise.problem.program import SMALLEST, Program
from sweep.optimise.problem.rows import Form
from sweep.optimise.problem.statement import Problem
from sweep.quantities.limits import meets
from sweep.quantities.measures import Measure

FIRST = 2  # evaluations that give a start its scale and its first design


def search(number: int, problem: Problem, start: Array, asked: Callable[[], bool], allowed: float = math.inf) -> Result:
    """Search from one start.

    Parameters
    ----------
    number : number of the start, for the result
    problem : problem to be minimised
    start : (P,) design
    asked : true ends the search with the best checked design so far, after the first design in any case
    allowed : number of evaluations after which the search ends likewise, on any machine
    """
    program = Program(problem)
    descent = Descent(problem, program, start, _after_first(asked), max(allowed, FIRST))
    ended = ""
    try:
        descent.run()
    except LooksUsedUp:
        ended = "looks"
    except Stopped:
        ended = "time"
    except KeyboardInterrupt:
        ended = "interrupted"
    descent.return_within()
    looks = descent.model.looks
    descent.model.stop, descent.model.allowed = (lambda: False), math.inf
    return confirmed(problem, program, replace(_result(number, problem, program, descent, ended), looks=looks))


def _after_first(asked: Callable[[], bool]) -> Callable[[], bool]:
    calls = iter(range(FIRST + 1))
    return lambda: next(calls, None) is None and asked()


def _result(number: int, problem: Problem, program: Program, descent: Descent, ended: str) -> Result:
    state = descent.best
    exists = math.isfinite(state.objective) and math.isfinite(state.violation)
    value = program.value(program.objective, state.form, descent.model.curves, state.design, state.atoms)
    residual, words = math.nan, {}
    if exists and not state.feasible and state.form.complete:
        form, least = _of_relaxation(descent, state)
        residual, words = least.residual, in_words(form.labels, least, problem.variables)
    elif exists:
        found = descent.model.certificate(state)
        residual = found.residual
        size = abs(state.objective) or 1.0  # size of the objective here, in units of the start's
        words = {text: weight / size for text, weight in in_words(state.form.labels, found, problem.variables).items()}
    values = {
        r.measure.name: program.value(r.measure, state.form, descent.model.curves, state.design, state.atoms)
        for r in program.requirements
    }
    if not state.feasible:
        status, how = st.LIMIT_EXCEEDED, "infeasible"
    elif residual <= KKT:
        status, how = st.OK, "converged"
    else:
        status, how = st.NOT_CONVERGED, "stalled"
    return Result(
        start=number, design=state.design, objective=value, gap=descent.gap, violation=state.violation,
        kkt_residual=residual, active=tuple(words), multipliers=words, relaxation=_relaxation(program, values, state),
        values=values, status=status, ended=ended or how,
    )  # fmt: skip


def _of_relaxation(descent: Descent, state: State) -> tuple[Form, Multipliers]:
    """Return the elastic program at an infeasible design, and its multipliers."""
    form = state.form.relaxed({"rotatable"})
    jacobian = descent.model.jacobian(state.fractions, form, form.points)
    return form, multipliers(form, form.rows(state.atoms, state.violation), jacobian, state.fractions)


def _relaxation(program: Program, values: dict[str, float], state: State) -> dict[str, float]:
    """Return the amount by which each violated limit has to be relaxed, in the unit of its output."""
    if state.feasible:
        return {}
    out: dict[str, float] = {}
    for r in program.requirements:
        value = values[r.measure.name]
        low = -math.inf if r.minimum is None else r.measure.from_inner(r.minimum)
        high = math.inf if r.maximum is None else r.measure.from_inner(r.maximum)
        short = max(low - value, value - high)
        if math.isnan(value) or short > 0.0:
            out[r.measure.name] = short
    return out


TARGET = 1e-9  # relative error of the verified outputs, unless the problem sets another
DIGITS = 1e-8  # relative error of the search's own extrema, in addition
NOTHING = 1e-12  # share of the objective's size between the bounds below which it is rounding
ACROSS = (0.001, 0.01, 0.1, 0.5, 1.0)  # shares of the way to either corner of the bounds where the objective is sampled
DIFFERS = "differs"  # ending of a start whose extrema differ from those of summarise


def confirmed(problem: Problem, program: Program, found: Result) -> Result:
    """Return a feasible result with the values of ``summarise`` for outputs that differ from the search's values.

    If they differ by more than rounding, the result has not converged, since the optimality conditions hold for other
    extrema; it is infeasible if it violates a limit by the values of ``summarise``.

    Parameters
    ----------
    problem, program : problem and program of the search.  Limits with margins for tolerances are left out: samples of
        manufactured mechanisms verify them
    found : result of the search
    """
    if not found.feasible or not math.isfinite(found.objective):
        return found
    limits = [r.measure for r in program.requirements if r.measure is not program.turning]
    asked = {
        m.name: m
        for m in (program.objective, *limits)
        if m.name not in problem.family.parameter_names and not _has_margin(problem, m)
    }
    own = found.values | {program.objective.name: found.objective}
    true = _summarised(problem, found, tuple(asked))
    apart = {name: _apart(asked[name], own[name], value) for name, (value, _) in true.items()}
    other = {name: value for name, (value, err) in true.items() if not apart[name] <= err}
    if program.objective.name in other and _vanishes(problem, found, other[program.objective.name]):
        other.pop(program.objective.name)
    far = [name for name in other if not apart[name] <= true[name][1] + DIGITS * _size(asked[name], true[name][0])]
    # A limit that is kept and inactive does not enter the optimality conditions.
    acting = {program.objective.name, *(text.split()[0] for text in found.active)}
    missed = {x.output for x in problem.limits if x.output in far and not meets(x, np.array([other[x.output]])).all()}
    far = [name for name in far if name in acting | missed]
    kept = replace(
        found,
        objective=other.get(program.objective.name, found.objective),
        values=found.values | {name: value for name, value in other.items() if name in found.values},
    )
    return _differing(problem, kept, {name: (other[name], apart[name]) for name in far}) if far else kept


def _vanishes(problem: Problem, found: Result, true: float) -> bool:
    """Tell whether the objective is zero but for rounding: then it has no certain digits and no certain extrema."""
    place, shares = problem.scaled(found.design[None, :])[0], np.array(ACROSS)[:, None]
    designs = problem.placed(found.design, np.concatenate([place + shares * (end - place) for end in (0.0, 1.0)]))
    designs = designs[np.isfinite(designs).all(axis=1)]
    columns = design_outputs(problem.family, designs, (problem.objective,), problem.accuracy, problem.window)
    known = np.asarray(columns[problem.objective], np.float64)[columns["status"] == st.OK]
    amount = float(np.abs(known).max(initial=0.0))
    return abs(found.objective) <= NOTHING * amount and not abs(true) > NOTHING * amount


def _differing(problem: Problem, kept: Result, far: dict[str, tuple[float, float]]) -> Result:
    """Return the result as not converged, or as infeasible, since its outputs differ from those of the search."""
    short, missed = {}, []
    for limit in problem.limits:
        value = far[limit.output][0] if limit.output in far else math.nan
        low, high = limit.ends
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


def _has_margin(problem: Problem, m: Measure) -> bool:
    """Tell whether a margin for tolerances enters the search's value of an output, or its limit."""
    return m.name in problem.allowances or any(s.output in problem.curve_margins for s in m.series)


def _summarised(problem: Problem, found: Result, names: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    """Return value and error of each output of the design; the error is 0 for outputs of float64 accuracy."""
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
