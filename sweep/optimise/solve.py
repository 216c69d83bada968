"""``minimise``: the search from several starts, within a time budget, best first."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from kernels import status as st
from sweep.errors import InputError
from sweep.families.base import Array
from sweep.jobs.signals import Stop, stop_on_signal
from sweep.optimise.certificate import AGREE, Result
from sweep.optimise.form import Program
from sweep.optimise.parallel import in_processes
from sweep.optimise.problem import PLACE, Problem
from sweep.optimise.search import search

if TYPE_CHECKING:
    from sweep.study import OptimiseSettings

SERIAL_SECONDS = 1.0  # of search before processes are worth their start


def minimise(
    problem: Problem,
    starts: Array,
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
) -> list[Result]:
    """Smallest objective under the limits, from each start; one result per start that was begun, best first.

    Parameters
    ----------
    problem : what to minimise
    starts : (k, P) designs; their signs are kept, their variables are the starting points
    settings : ``time_budget`` [s] or None is honoured; a start in progress then ends with its best design so far
    stop : asked often; when it answers true, or at Ctrl-C, the search ends as if the time were used up
    jobs : processes the starts are spread over, once the search turns out to take more than a second; the results are
        those of one process, to the bit

    Returns
    -------
    Feasible results by objective, then infeasible ones by violation.  Same starts, same results, unless time ran out.

    Raises
    ------
    InputError
        if there is no start, or a name of the problem is unknown
    WorkerDied
        if a worker process was killed.
    """
    starts = np.atleast_2d(np.asarray(starts, dtype=np.float64))
    if starts.size == 0 or starts.shape[1] != len(problem.family.parameters):
        raise InputError("starts", starts.shape, f"at least one row of {len(problem.family.parameters)} values", PLACE)
    Program(problem)  # an unknown name is refused here, not in a worker
    end = math.inf if settings.time_budget is None else time.monotonic() + settings.time_budget
    with _signals() as own:

        def asked() -> bool:
            return time.monotonic() >= end or bool(own) or (stop is not None and stop())

        results, begun = _serial(problem, starts, asked, math.inf if jobs == 1 else SERIAL_SECONDS)
        done = {r.start for r in results}
        rest = [k for k in range(len(starts)) if k not in done]
        stopped = any(r.ended == "interrupted" for r in results) or (bool(results) and asked())
        if rest and not stopped:
            results += in_processes(problem, starts, rest, asked, jobs)
        if begun is not None and begun.start not in {r.start for r in results}:
            results.append(begun)
    if own.signal_number is not None:
        results = [replace(r, ended="interrupted") if r.ended == "time" else r for r in results]
        if own.signal_number == signal.SIGTERM:
            signal.raise_signal(signal.SIGTERM)
    return ranked(results)


@contextmanager
def _signals() -> Iterator[Stop]:
    """Ctrl-C sets a flag, so that every process ends with its best design; a caller's own handler is left alone."""
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield Stop()
        return
    with stop_on_signal() as stop:
        yield stop


def _serial(
    problem: Problem, starts: Array, asked: Callable[[], bool], seconds: float
) -> tuple[list[Result], Result | None]:
    """The starts one after the other, and how far the one came that has not ended after so many seconds.

    That one is left to the workers, from its beginning; what is known counts if they are stopped before they get there.
    """
    results: list[Result] = []
    late = time.monotonic() + seconds
    for number, start in enumerate(starts):
        if results and asked():
            break
        last = number == len(starts) - 1  # a worker would do it no faster

        def ask(last: bool = last) -> bool:
            return asked() or (not last and time.monotonic() >= late)

        found = search(number, problem, start, ask)
        if found.ended == "time" and not asked():
            return results, found
        results.append(found)
        if found.ended == "interrupted":
            break
    return results, None


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
