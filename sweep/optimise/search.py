"""One start, wherever it runs: the search, and what is known about the design it ends at."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from kernels import status as st
from sweep.families.base import Array
from sweep.optimise.certificate import Multipliers, Result, in_words, multipliers
from sweep.optimise.confirmed import confirmed
from sweep.optimise.descent import KKT, Descent
from sweep.optimise.form import Program
from sweep.optimise.model import LooksUsedUp, State, Stopped
from sweep.optimise.problem import Problem
from sweep.optimise.rows import Form

FIRST = 2  # looks that give a start its scale and its first design


def search(number: int, problem: Problem, start: Array, asked: Callable[[], bool], allowed: float = math.inf) -> Result:
    """Search from one start.

    Parameters
    ----------
    number : of the start, for the result
    problem : what to minimise
    start : (P,) design
    asked : true ends the search with the best checked design so far; the first one is reached in any case
    allowed : looks at designs after which it ends in the same way, wherever and however fast it runs
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
        size = abs(state.objective) or 1.0  # of the objective here, in units of the start's
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
    """Return the elastic program at a design that misses its limits, and its multipliers."""
    form = state.form.relaxed({"rotatable"})
    jacobian = descent.model.jacobian(state.fractions, form, form.points)
    return form, multipliers(form, form.rows(state.atoms, state.violation), jacobian, state.fractions)


def _relaxation(program: Program, values: dict[str, float], state: State) -> dict[str, float]:
    """Return by how much each violated limit has to give way, in the unit of its output."""
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
