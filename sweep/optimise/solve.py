"""``minimise``: the search from several starts, within a time budget, best first."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from kernels import status as st
from sweep.errors import InputError
from sweep.families.base import Array
from sweep.optimise.certificate import AGREE, Result, in_words
from sweep.optimise.descent import KKT, Descent
from sweep.optimise.form import Program
from sweep.optimise.model import State, Stopped
from sweep.optimise.problem import PLACE, Problem

if TYPE_CHECKING:
    from sweep.study import OptimiseSettings


def minimise(
    problem: Problem, starts: Array, settings: OptimiseSettings, stop: Callable[[], bool] | None = None
) -> list[Result]:
    """Smallest objective under the limits, from each start; one result per start that was begun, best first.

    Parameters
    ----------
    problem : what to minimise
    starts : (k, P) designs; their signs are kept, their variables are the starting points
    settings : ``time_budget`` [s] or None is honoured; a start in progress then ends with its best design so far
    stop : asked often; when it answers true, or at Ctrl-C, the search ends as if the time were used up

    Returns
    -------
    Feasible results by objective, then infeasible ones by violation.  Same starts, same results, unless time ran out.

    Raises
    ------
    InputError
        if there is no start, or a name of the problem is unknown.
    """
    starts = np.atleast_2d(np.asarray(starts, dtype=np.float64))
    if starts.size == 0 or starts.shape[1] != len(problem.family.parameters):
        raise InputError("starts", starts.shape, f"at least one row of {len(problem.family.parameters)} values", PLACE)
    program = Program(problem)
    asked = _deadline(settings.time_budget, stop)
    results: list[Result] = []
    for number, start in enumerate(starts):
        if results and asked():
            break
        # The first start always gets to its first design, so that there is an answer.
        ask = asked if results else _after_first(asked)
        descent = Descent(problem, program, start, ask)
        ended = ""
        try:
            descent.run()
        except Stopped:
            ended = "time"
        except KeyboardInterrupt:
            ended = "interrupted"
        descent.model.stop = lambda: False
        results.append(_result(number, problem, program, descent, ended))
        if ended == "interrupted":
            break
    return ranked(results)


def ranked(results: list[Result]) -> list[Result]:
    """Feasible results by objective, then the others by violation; each told how many starts agree with the best."""
    order = sorted(results, key=lambda r: (r.status == st.LIMIT_EXCEEDED, _rank(r), r.start))
    best = order[0]
    near = [r for r in order if _agrees(r, best)]
    return [replace(r, agree=len(near)) if _agrees(r, best) else r for r in order]


def _rank(r: Result) -> float:
    value = r.violation if r.status == st.LIMIT_EXCEEDED else r.objective
    return math.inf if math.isnan(value) else value


def _agrees(r: Result, best: Result) -> bool:
    if r.status == st.LIMIT_EXCEEDED or best.status == st.LIMIT_EXCEEDED:
        return r is best
    return abs(r.objective - best.objective) <= AGREE * max(abs(best.objective), 1e-300)


def _deadline(seconds: float | None, stop: Callable[[], bool] | None) -> Callable[[], bool]:
    """A question to ask often: is the time used up, or does the caller want to stop?"""
    end = math.inf if seconds is None else time.monotonic() + seconds
    return lambda: time.monotonic() >= end or (stop is not None and stop())


def _after_first(asked: Callable[[], bool]) -> Callable[[], bool]:
    calls = iter(range(3))
    return lambda: next(calls, None) is None and asked()


def _result(number: int, problem: Problem, program: Program, descent: Descent, ended: str) -> Result:
    state = descent.best
    exists = math.isfinite(state.objective) and math.isfinite(state.violation)
    value = program.value(program.objective, state.form, descent.model.curves, state.design, state.atoms)
    residual, words = math.nan, {}
    if exists:
        found = descent.model.certificate(state)
        residual = found.residual
        words = in_words(state.form.labels, found, problem.variables)
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


def _relaxation(program: Program, values: dict[str, float], state: State) -> dict[str, float]:
    """By how much each violated limit has to give way, in the unit of its output."""
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
