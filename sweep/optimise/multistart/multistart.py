"""``minimise`` and ``optimum``: searches from several starts, best first, with limited starts and evaluations.

Each start keeps parameters that a study gives as a list of values; then the neighbouring values are tried.
"""

from __future__ import annotations

import math
import signal
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from itertools import chain
from typing import NamedTuple

import numpy as np

from sweep.errors import InputError
from sweep.families.base import Array
from sweep.jobs.signals import Deadline, Stop, stop_on_signal
from sweep.optimise.local.kkt import Result
from sweep.optimise.local.model import refuse_dependent
from sweep.optimise.multistart.parallel import SearchTask, spread_over
from sweep.optimise.multistart.survey import (
    CUT,
    StartGroup,
    Survey,
    counted,
    in_groups,
    most_counted,
    survey,
    with_basins,
)
from sweep.optimise.problem.on_locus import on_locus
from sweep.optimise.problem.program import Program
from sweep.optimise.problem.statement import PLACE, Problem
from sweep.optimise.starts.ranked import samples
from sweep.study import OptimiseSettings, Study

CHECKED_STARTS = 3  # number of starts at which equations are checked for dependency
SERIAL_EVALUATIONS = 800  # evaluations, about a second, after which a search is worth several processes
ROUNDS = 12  # steps between catalogue values, each of at most two searches per parameter
LEAST_GAIN = 1e-9  # smallest relative gain of such a step
TellStarts = Callable[[int, int, float], None]


class SearchOutcome(NamedTuple):
    """Results of a search, best first, their survey, and the problem with its final bounds."""

    results: list[Result]
    survey: Survey
    problem: Problem


def minimise(
    problem: Problem,
    starts: Array,
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
) -> list[Result]:
    """Minimise the objective under the limits; return one result per begun start, best first.

    Parameters
    ----------
    problem : problem to be minimised
    starts : (k, P) designs, which set the signs and the initial values of the variables
    settings, stop, jobs : as for :func:`explore`

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
    return explore(problem, in_groups(starts), settings, stop, jobs).results


def explore(
    problem: Problem,
    groups: Iterable[StartGroup],
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
    tell: TellStarts | None = None,
) -> SearchOutcome:
    """Search from one group of starts after the other until the survey of the basins suffices.

    Parameters
    ----------
    problem : problem to be minimised
    groups : groups of starts, each requested after the search from the previous one
    settings : ``looks`` evaluations are allowed per start; the search ends when ``unseen`` and the best basin meet the
        rule (:class:`sweep.optimise.multistart.survey.Survey`); ``time_budget`` [s] or None is an emergency deadline
    stop : called often; if it returns true, or at Ctrl-C, the search ends and each start in progress keeps its best
        design so far
    jobs : number of processes over which the starts of a long search are spread; results do not depend on it
    tell : called at first and after each start, with the number of finished starts (or populations), its maximum, and
        the best value so far

    Returns
    -------
    Feasible results by objective, then infeasible ones by violation; none without a start.  The same groups give the
    same results to the bit on any machine, busy or not, unless the search was stopped.

    Raises
    ------
    InputError
        if a name of the problem is unknown, or two equations are dependent
    WorkerDied
        if a worker process was killed.
    """
    deadline = Deadline(settings.time_budget, stop)
    searched, results, ending = list[StartGroup](), list[Result](), "starts"
    finished: list[Result] = []

    def report(*found: Result) -> None:
        finished.extend(found)
        if tell is not None:
            best = min((r.objective for r in finished if r.feasible), default=math.inf)
            tell(_count_finished(searched, finished), most_counted(settings), best)

    report()
    with _interruptible() as interrupt:

        def should_stop() -> bool:
            return bool(interrupt) or deadline()

        for group in groups:
            first = len(results)
            searched.append(group)
            problem = group.problem or problem
            if not first:  # unknown names and dependent equations are refused here, not in a worker
                refuse_dependent(problem, Program(problem), group.designs[:CHECKED_STARTS])
            indices = list(range(first, first + len(group.designs)))
            task = SearchTask(problem, group.designs, settings.looks, first)
            results += _search_group(task, indices, results, should_stop, jobs, report)
            if len(results) <= indices[-1] or any(r.ended in CUT for r in results):
                ending = "time"
                break
            if survey(problem, searched, results, settings, "").enough:
                ending = "enough"
                break
        else:
            if should_stop() and _count_finished(searched, finished) < most_counted(settings):
                ending = "time"
    if interrupt.signal_number is not None:
        results = [replace(r, ended="interrupted") if r.ended == "time" else r for r in results]
        if interrupt.signal_number == signal.SIGTERM:
            signal.raise_signal(signal.SIGTERM)
    if ending == "time" and (interrupt.signal_number is not None or any(r.ended == "interrupted" for r in results)):
        ending = "interrupted"
    return SearchOutcome(ranked(results), survey(problem, searched, results, settings, ending), problem)


def _count_finished(searched: Sequence[StartGroup], results: Sequence[Result]) -> int:
    """Return the number of finished starts that count."""
    counts = counted(searched)
    return sum(counts[r.start] for r in results)


def _interruptible() -> AbstractContextManager[Stop]:
    """Let Ctrl-C set a flag, so that every process ends with its best design; leave a caller's own handler alone."""
    own = signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    return nullcontext(Stop()) if own else stop_on_signal()


def _search_group(
    task: SearchTask, numbers: list[int], earlier: Sequence[Result], should_stop: Callable[[], bool], jobs: int,
    report: Callable[[Result], None],
) -> list[Result]:  # fmt: skip
    """Search from some starts, in this process until many evaluations were needed, then in several processes."""
    results: list[Result] = []
    while len(results) < len(numbers):
        evaluations = sum(r.looks for r in (*earlier, *results))
        # The very first start always has a result, even if the search is to stop.
        if (results or earlier) and (should_stop() or (jobs > 1 and evaluations >= SERIAL_EVALUATIONS)):
            break
        results.append(task(numbers[len(results)], should_stop))
        report(results[-1])
    remaining = numbers[len(results) :]
    if not remaining or should_stop():
        return results
    return results + spread_over(task, remaining, should_stop, jobs, lambda _, found: report(found))


def ranked(results: list[Result]) -> list[Result]:
    """Return results ordered by rank; those in the best basin carry its number of starts."""
    order = sorted(with_basins(results), key=lambda r: (*r.rank, r.start))
    agree = sum(r.basin == 1 for r in order)
    return [replace(r, agree=agree) if r.basin == 1 else r for r in order]


def optimum(
    problem: Problem,
    signs: Sequence[dict[str, float]],
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
) -> list[Result]:
    """Return the best designs of a problem.

    Equations are eliminated if possible; local searches start from the best of several samples.

    If no start becomes feasible, the equations may be relaxed as well: a second search, in the parameters themselves,
    starts from the least infeasible design and a sample; of both searches the smallest relaxation comes first.

    Parameters
    ----------
    problem : problem in the parameters themselves
    signs : combinations of the parameters that are not varied, as ``[{"branch": 1.0}, {"branch": -1.0}]``
    settings : largest number of starts of each search, seed of the samples, stopping rules
    stop, jobs : as for ``minimise``

    Returns
    -------
    Results as of ``minimise``, best first.  The same arguments give the same results, unless the search was stopped.

    Raises
    ------
    InputError
        if there is no start, or a name of the problem is unknown.
    """
    on_locus_problem = on_locus(problem)
    results = _sampled(on_locus_problem, signs, settings, stop, jobs)
    if on_locus_problem is not problem and not any(result.feasible for result in results):
        # Relaxing the equations competes with relaxing the bounds of the links: the smaller relaxation is the answer.
        relaxed = _sampled(problem, signs, settings, stop, jobs, [result.design for result in results[:1]])
        first = 1 + max((result.start for result in results), default=-1)
        results = ranked([*results, *(replace(result, start=first + result.start) for result in relaxed)])
    if not results:
        raise InputError("starts", 0, "bounds between which there is a design", PLACE)
    return results


def _sampled(
    problem: Problem,
    signs: Sequence[dict[str, float]],
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None,
    jobs: int,
    designs: Sequence[Array] = (),
) -> list[Result]:
    """Search from ``designs``, then from samples."""
    sampled = samples(problem, signs, settings.starts, settings.seed, stop or (lambda: False))
    return explore(problem, chain(in_groups(np.array(designs)), sampled), settings, stop, jobs).results


def listed(study: Study) -> dict[str, Array]:
    """Return the listed values, sorted, of the parameters that a search keeps at values listed by the study.

    Signs are listed by nature and are not included, nor are parameters that [locus] or [fit] sets or scales: listed
    values of those are proportions, and prescribed ones are ranges.
    """
    raw = study.written
    names = study.family.parameter_names
    signs = {p.name for p in study.family.parameters if p.choices is not None}
    catalogue = {}
    for axis in study.space.axes:
        entry = raw.get(axis.name)
        is_listed = axis.name in names and axis.name not in (*signs, *study.made, *study.rescaled)
        if is_listed and axis.values is not None and isinstance(entry, dict) and "values" in entry:
            values = np.unique(axis.values)
            if len(values) > 1:
                catalogue[axis.name] = values
    return catalogue


def with_neighbours(
    problem: Problem,
    results: list[Result],
    catalogue: Mapping[str, Array],
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None,
    jobs: int,
) -> list[Result]:
    """Return results, the best first, with those of neighbours of the best one among listed values.

    A neighbour has one listed value exchanged for the next larger or smaller one.

    The exchange continues from the new best while it gains, so that no change of a single parameter to the next larger
    or smaller value improves the answer.  The results do not depend on the number of jobs.

    Parameters
    ----------
    problem, settings, stop, jobs : as for ``minimise``; the listed parameters are no variables
    results : results of the search so far, best first
    catalogue : the listed parameters and their values
    """
    names = problem.family.parameter_names
    tried: set[tuple[float, ...]] = set()
    ordered = list(results)
    for _ in range(ROUNDS):
        best = ordered[0]
        if best.ended in CUT:
            break
        tried.add(_listed_values(best.design, names, catalogue))
        starts = []
        for name, values in catalogue.items():
            index = int(np.argmin(np.abs(values - best.design[names.index(name)])))
            for neighbour in (index - 1, index + 1):
                if 0 <= neighbour < len(values):
                    design = best.design.copy()
                    design[names.index(name)] = values[neighbour]
                    if _listed_values(design, names, catalogue) not in tried:
                        tried.add(_listed_values(design, names, catalogue))
                        starts.append(design)
        if not starts:
            break
        new_results = minimise(problem, np.array(starts), replace(settings, unseen=0.0), stop, jobs)
        first = 1 + max(result.start for result in ordered)
        ordered = ranked([*ordered, *(replace(result, start=first + result.start) for result in new_results)])
        if not _better(ordered[0], best):
            break
    return ordered


def _listed_values(design: Array, names: tuple[str, ...], catalogue: Mapping[str, Array]) -> tuple[float, ...]:
    return tuple(float(design[names.index(name)]) for name in catalogue)


def _better(new: Result, old: Result) -> bool:
    if new.feasible != old.feasible:
        return new.feasible
    return new.rank[1] < old.rank[1] - LEAST_GAIN * abs(old.rank[1])
