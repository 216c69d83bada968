"""``minimise`` and ``optimum``: searches from several starts, best first, with budgets of starts and looks."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from kernels import status as st
from sweep.errors import InputError
from sweep.families.base import Array
from sweep.jobs.signals import Stop, stop_on_signal
from sweep.optimise.local.kkt import AGREE, Result
from sweep.optimise.local.model import refuse_dependent
from sweep.optimise.local.start import search
from sweep.optimise.multistart.parallel import in_processes
from sweep.optimise.multistart.survey import CUT, Survey, survey, with_basins
from sweep.optimise.problem.on_locus import on_locus
from sweep.optimise.problem.program import Program
from sweep.optimise.problem.statement import PLACE, Problem
from sweep.optimise.starts.candidates import from_sample, from_samples

if TYPE_CHECKING:
    from sweep.study import OptimiseSettings

BATCH = 6  # starts between two looks at whether more are needed: the same for any number of jobs
LOOKED_AT = 3  # starts at which equations are looked at
SERIAL_LOOKS = 800  # of a search before processes are worth their start, about a second
Tell = Callable[[int, int], None]


def minimise(
    problem: Problem,
    starts: Array,
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
) -> list[Result]:
    """Return the smallest objective under the limits; one result per start that was begun, best first.

    Parameters, results and errors are those of :func:`explore`.
    """
    return explore(problem, starts, settings, stop, jobs)[0]


def explore(
    problem: Problem,
    starts: Array,
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
    tell: Tell | None = None,
    origins: Sequence[int] | None = None,
    samples: Sequence[int] | None = None,
) -> tuple[list[Result], Survey]:
    """Return the smallest objective under the limits from one start after the other,
    until enough is known of the basins.

    Parameters
    ----------
    problem : what to minimise
    starts : (k, P) designs; their signs are kept, their variables are the starting points
    settings : ``looks`` are allowed to each start; starts end when ``unseen`` and the best basin are as asked (see
        :class:`sweep.optimise.multistart.survey.Survey`); ``time_budget`` [s] or None is an emergency deadline
    stop : asked often; when it answers true, or at Ctrl-C, the search ends and each start in progress keeps its best
        design so far
    jobs : processes the starts are spread over, once the search turns out to be long; results do not depend on it
    tell : called with the number of starts that are done and the most there will be
    origins : see :func:`sweep.optimise.multistart.survey.survey`; with them all starts are searched
    samples : see there

    Returns
    -------
    Feasible results by objective, then infeasible ones by violation; and what they tell of the search.  The same
    starts give the same results to the bit on any machine, busy or not, unless it was stopped.

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
    # Unknown names and equations that say the same are refused here, not in a worker.
    refuse_dependent(problem, Program(problem), starts[:LOOKED_AT])
    end = math.inf if settings.time_budget is None else time.monotonic() + settings.time_budget
    with _signals() as own:

        def asked() -> bool:
            return time.monotonic() >= end or bool(own) or (stop is not None and stop())

        results, ended = _in_batches(problem, starts, settings, asked, jobs, tell, origins is None, samples)
    if own.signal_number is not None:
        results = [replace(r, ended="interrupted") if r.ended == "time" else r for r in results]
        if own.signal_number == signal.SIGTERM:
            signal.raise_signal(signal.SIGTERM)
    if ended == "time" and (own.signal_number is not None or any(r.ended == "interrupted" for r in results)):
        ended = "interrupted"
    return ranked(results), survey(problem, starts, results, settings, ended, origins, samples)


def _in_batches(
    problem: Problem,
    starts: Array,
    settings: OptimiseSettings,
    asked: Callable[[], bool],
    jobs: int,
    tell: Tell | None,
    early: bool,
    samples: Sequence[int] | None,
) -> tuple[list[Result], str]:
    """Return results of the starts in batches, and what ended it.

    ``early``: the search ends as soon as enough is known.
    """
    results: list[Result] = []
    numbers = list(range(len(starts)))
    for first in range(0, len(starts), BATCH):
        batch = numbers[first : first + BATCH]
        results += _batch(problem, starts, batch, results, settings, asked, jobs)
        if tell is not None:
            tell(len(results), len(starts))
        last = batch[-1] == numbers[-1]
        if _cut(results, first + len(batch)) or (not last and asked()):
            return results, "time"
        if early and survey(problem, starts, results, settings, "", samples=samples).enough:
            return results, "enough"
    return results, "starts"


def _cut(results: Sequence[Result], count: int) -> bool:
    """Return whether a search was stopped before so many results were there, or within one."""
    return len(results) < count or any(r.ended in CUT for r in results)


@contextmanager
def _signals() -> Iterator[Stop]:
    """Let Ctrl-C set a flag, so that every process ends with its best design; a caller's own handler is left alone."""
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield Stop()
        return
    with stop_on_signal() as stop:
        yield stop


def _batch(
    problem: Problem,
    starts: Array,
    numbers: list[int],
    before: Sequence[Result],
    settings: OptimiseSettings,
    asked: Callable[[], bool],
    jobs: int,
) -> list[Result]:
    """Return results of some starts, in this process as long as few looks were needed, then in several.

    A start that needs more looks than that is left to the processes, from its beginning; what is known of it counts if
    they are stopped before they get there.
    """
    results: list[Result] = []
    left = math.inf if jobs == 1 else SERIAL_LOOKS - sum(r.looks for r in before)
    begun: Result | None = None
    for k, number in enumerate(numbers):
        if (results or before) and (left <= 0 or asked()):
            break
        last = k == len(numbers) - 1  # a worker would do it no faster
        own = settings.looks if last else min(left, settings.looks)
        found = search(number, problem, starts[number], asked, own)
        if found.ended == "looks" and own < settings.looks:
            begun = found
            break
        results.append(found)
        left -= found.looks
        if found.ended in CUT:
            return results
    rest = numbers[len(results) :]
    if rest and not ((results or before or begun) and asked()):
        results += in_processes(problem, starts, rest, asked, jobs, settings.looks)
    if begun is not None and begun.start not in {r.start for r in results}:
        results.append(replace(begun, ended="time"))
    return results


def ranked(results: list[Result]) -> list[Result]:
    """Return feasible results by objective, then the others by violation;
    each told how many starts agree with the best.
    """
    order = sorted(with_basins(results), key=lambda r: (r.status == st.LIMIT_EXCEEDED, _rank(r), r.start))
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


def optimum(
    problem: Problem,
    signs: Sequence[dict[str, float]],
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
) -> list[Result]:
    """Return the best designs of a problem:
    equations eliminated where they can be, samples, local searches from the best of each.

    Where no start becomes feasible the equations may give way as well: a second search, in the parameters themselves,
    begins from the least infeasible design and a sample; of both searches the smallest relaxation comes first.

    Parameters
    ----------
    problem : in the parameters themselves
    signs : combinations of the parameters that are not varied, as ``[{"branch": 1.0}, {"branch": -1.0}]``
    settings : the most starts of each search, seed of the samples, what ends a search earlier
    stop, jobs : as for ``minimise``

    Returns
    -------
    Results as of ``minimise``, best first.  Same arguments, same results, unless it was stopped.

    Raises
    ------
    InputError
        if there is no start, or a name of the problem is unknown.
    """
    searched = on_locus(problem)
    starts, samples = from_samples(searched, signs, settings.starts, settings.seed)
    results: list[Result] = []
    if len(starts) or searched is problem:
        results, _ = explore(searched, starts, settings, stop, jobs, samples=samples)
    if searched is problem or any(result.status != st.LIMIT_EXCEEDED for result in results):
        return results
    near = [result.design for result in results[:1]]
    starts = from_sample(problem, signs, settings.starts, settings.seed)
    others = minimise(problem, np.array([*near, *starts]), settings, stop, jobs)
    # The equations give way, or the bounds of the links do: the smaller relaxation is the answer.
    first = 1 + max((result.start for result in results), default=-1)
    return ranked([*results, *(replace(result, start=first + result.start) for result in others)])
