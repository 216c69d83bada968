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
from sweep.optimise.local.model import BudgetSpent, State, Stopped
from sweep.optimise.problem.program import SMALLEST, Program
from sweep.optimise.problem.rows import Form
from sweep.optimise.problem.statement import Problem
from sweep.quantities.limits import meets
from sweep.quantities.measures import Measure

FIRST = 2  # evaluations that give a start its scale and its first design


def search(number: int, problem: Problem, start: Array, stop: Callable[[], bool], budget: float = math.inf) -> Result:
    """Search from one start.

    Parameters
    ----------
    number : number of the start, for the result
    problem : problem to be minimised
    start : (P,) design
    stop : true ends the search with the best checked design so far, after the first design in any case
    budget : number of evaluations after which the search ends likewise, on any machine
    """
    program = Program(problem)
    descent = Descent(problem, program, start, _after_first(stop), max(budget, FIRST))
    ended = ""
    try:
        descent.run()
    except BudgetSpent:
        ended = "looks"
    except Stopped:
        ended = "time"
    except KeyboardInterrupt:
        ended = "interrupted"
    descent.return_to_feasible()
    looks = descent.model.evaluations
    descent.model.stop, descent.model.budget = (lambda: False), math.inf
    return confirmed(problem, program, replace(_result(number, problem, program, descent, ended), looks=looks))


def _after_first(stop: Callable[[], bool]) -> Callable[[], bool]:
    calls = iter(range(FIRST + 1))
    return lambda: next(calls, None) is None and stop()


def _result(number: int, problem: Problem, program: Program, descent: Descent, ended: str) -> Result:
    state = descent.best
    exists = math.isfinite(state.objective) and math.isfinite(state.violation)
    value = program.value(program.objective, state.form, descent.model.curves, state.design, state.atoms)
    residual, active = math.nan, {}
    if exists and not state.feasible and state.form.complete:
        form, elastic = _elastic_multipliers(descent, state)
        residual, active = elastic.residual, in_words(form.labels, elastic, problem.variables)
    elif exists:
        duals = descent.model.certificate(state)
        residual = duals.residual
        # Size of the objective here, in units of the start's; its inner value may change at another rate than itself.
        rate = program.objective.relative_slope(program.objective.to_inner(value)) / (abs(state.objective) or 1.0)
        active = {text: weight * rate for text, weight in in_words(state.form.labels, duals, problem.variables).items()}
    values = {
        r.measure.name: program.value(r.measure, state.form, descent.model.curves, state.design, state.atoms)
        for r in program.requirements
    }
    if not state.feasible:
        status, ending = st.LIMIT_EXCEEDED, "infeasible"
    elif residual <= KKT:
        status, ending = st.OK, "converged"
    else:
        status, ending = st.NOT_CONVERGED, "stalled"
    return Result(
        start=number, design=state.design, objective=value, gap=descent.gap, violation=state.violation,
        kkt_residual=residual, active=tuple(active), multipliers=active, relaxation=_relaxation(program, values, state),
        values=values, status=status, ended=ended or ending,
    )  # fmt: skip


def _elastic_multipliers(descent: Descent, state: State) -> tuple[Form, Multipliers]:
    """Return the elastic program at an infeasible design, and its multipliers."""
    form = state.form.relaxed({"rotatable"})
    jacobian = descent.model.jacobian(state.fractions, form, form.points)
    return form, multipliers(form, form.rows(state.atoms, state.violation), jacobian, state.fractions)


def _relaxation(program: Program, values: dict[str, float], state: State) -> dict[str, float]:
    """Return the amount by which each violated limit has to be relaxed, in the unit of its output."""
    if state.feasible:
        return {}
    amounts: dict[str, float] = {}
    for r in program.requirements:
        value = values[r.measure.name]
        low = -math.inf if r.minimum is None else r.measure.from_inner(r.minimum)
        high = math.inf if r.maximum is None else r.measure.from_inner(r.maximum)
        amount = max(low - value, value - high)
        if math.isnan(value) or amount > 0.0:
            amounts[r.measure.name] = amount
    return amounts


TARGET = 1e-9  # relative error of the verified outputs, unless the problem sets another
DIGITS = 1e-8  # relative error of the search's own extrema, in addition
NEGLIGIBLE = 1e-12  # share of the objective's size between the bounds below which it is rounding
SHARES = (0.001, 0.01, 0.1, 0.5, 1.0)  # shares of the way to either corner of the bounds where the objective is sampled
DIFFERS = "differs"  # ending of a start whose extrema differ from those of summarise


def confirmed(problem: Problem, program: Program, result: Result) -> Result:
    """Return a feasible result with the values of ``summarise`` for outputs that differ from the search's values.

    If they differ by more than rounding, the result has not converged, since the optimality conditions hold for other
    extrema; it is infeasible if it violates a limit by the values of ``summarise``.

    Parameters
    ----------
    problem, program : problem and program of the search.  Limits with margins for tolerances are left out: samples of
        manufactured mechanisms verify them
    result : result of the search
    """
    if not result.feasible or not math.isfinite(result.objective):
        return result
    limits = [r.measure for r in program.requirements if r.measure is not program.turning]
    outputs = {
        m.name: m
        for m in (program.objective, *limits)
        if m.name not in problem.family.parameter_names and not _has_margin(problem, m)
    }
    searched = result.values | {program.objective.name: result.objective}
    true = _summarised(problem, result, tuple(outputs))
    gaps = {name: _difference(outputs[name], searched[name], value) for name, (value, _) in true.items()}
    off = {name: value for name, (value, err) in true.items() if not gaps[name] <= err}
    if program.objective.name in off and _vanishes(problem, result, off[program.objective.name]):
        off.pop(program.objective.name)
    wrong = [n for n in off if not gaps[n] <= true[n][1] + DIGITS * _magnitude(outputs[n], true[n][0])]
    # A limit that is kept and inactive does not enter the optimality conditions.
    relevant = {program.objective.name, *(text.split()[0] for text in result.active)}
    violated = {x.output for x in problem.limits if x.output in wrong and not meets(x, np.array([off[x.output]])).all()}
    wrong = [name for name in wrong if name in relevant | violated]
    final = replace(
        result,
        objective=off.get(program.objective.name, result.objective),
        values=result.values | {name: value for name, value in off.items() if name in result.values},
    )
    return _differing(problem, final, {name: (off[name], gaps[name]) for name in wrong}) if wrong else final


def _vanishes(problem: Problem, result: Result, true: float) -> bool:
    """Tell whether the objective is zero but for rounding: then it has no certain digits and no certain extrema."""
    x, shares = problem.scaled(result.design[None, :])[0], np.array(SHARES)[:, None]
    designs = problem.placed(result.design, np.concatenate([x + shares * (end - x) for end in (0.0, 1.0)]))
    designs = designs[np.isfinite(designs).all(axis=1)]
    columns = design_outputs(problem.family, designs, (problem.objective,), problem.accuracy, problem.window)
    values = np.asarray(columns[problem.objective], np.float64)[columns["status"] == st.OK]
    size = float(np.abs(values).max(initial=0.0))
    return abs(result.objective) <= NEGLIGIBLE * size and not abs(true) > NEGLIGIBLE * size


def _differing(problem: Problem, result: Result, wrong: dict[str, tuple[float, float]]) -> Result:
    """Return the result as not converged, or as infeasible, since its outputs differ from those of the search."""
    relaxation, violations = {}, []
    for limit in problem.limits:
        value = wrong[limit.output][0] if limit.output in wrong else math.nan
        low, high = limit.ends
        if limit.output in wrong and not low <= value <= high:
            relaxation[limit.output] = max(low - value, value - high)
            violations.append(relaxation[limit.output] / (abs(low if value < low else high) or 1.0))
    return replace(
        result,
        gap=max(gap / max(abs(value), SMALLEST) for value, gap in wrong.values()),
        violation=max([result.violation, *violations]),
        relaxation=relaxation,
        status=st.LIMIT_EXCEEDED if relaxation else st.NOT_CONVERGED,
        ended=DIFFERS if result.ended in ("converged", "stalled") else result.ended,
    )


def _has_margin(problem: Problem, m: Measure) -> bool:
    """Tell whether a margin for tolerances enters the search's value of an output, or its limit."""
    return m.name in problem.allowances or any(s.output in problem.curve_margins for s in m.series)


def _summarised(problem: Problem, result: Result, names: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    """Return value and error of each output of the design; the error is 0 for outputs of float64 accuracy."""
    accuracy = Accuracy(target=problem.accuracy.target or TARGET)
    columns = design_outputs(problem.family, result.design[None, :], names, accuracy, problem.window)
    summary = {}
    for name in names:
        value, err = float(columns[name][0]), float(np.nan_to_num(columns.get(error_of(name), np.zeros(1)))[0])
        summary[name] = (abs(value) if by_magnitude(name) else value, err)
    return summary


def _difference(m: Measure, searched: float, true: float) -> float:
    return abs(math.remainder(searched - true, math.tau) if m.is_angle else searched - true)


def _magnitude(m: Measure, true: float) -> float:
    return max(abs(true), 1.0 if m.is_angle else 0.0)
