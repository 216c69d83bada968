"""``minimise`` and ``optimum``: searches from several starts, best first, with budgets of starts and looks.

Parameters that a study gives as a list of values are kept by each start; then the neighbouring ones are tried.
"""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sweep.errors import InputError
from sweep.families.base import Array
from sweep.jobs.signals import Stop, stop_on_signal
from sweep.optimise.local.kkt import Result
from sweep.optimise.local.model import refuse_dependent
from sweep.optimise.multistart.parallel import SearchTask, spread_over
from sweep.optimise.multistart.survey import CUT, Group, Survey, counted, in_groups, most_counted, survey, with_basins
from sweep.optimise.problem.on_locus import on_locus
from sweep.optimise.problem.program import Program
from sweep.optimise.problem.statement import PLACE, Problem
from sweep.optimise.starts.samples import samples

if TYPE_CHECKING:
    from sweep.study import OptimiseSettings, Study

LOOKED_AT = 3  # starts at which equations are looked at
SERIAL_LOOKS = 800  # of a search before processes are worth their start, about a second
ROUNDS = 12  # steps from catalogue value to catalogue value, each of at most two searches per parameter
GAIN = 1e-9  # relative, of a step that counts
Tell = Callable[[int, int, float], None]


class Search(NamedTuple):
    """What a search has found: results, best first, what they tell of it, and the problem with its final bounds."""

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
    """Return the smallest objective under the limits; one result per start that was begun, best first.

    Parameters
    ----------
    problem : what to minimise
    starts : (k, P) designs; their signs are kept, their variables are the starting points
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
    groups: Iterable[Group],
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
    tell: Tell | None = None,
) -> Search:
    """Search from one group of starts after the other until enough is known of the basins.

    Parameters
    ----------
    problem : what to minimise
    groups : of starts, each of which is asked for when those before it have been searched from
    settings : ``looks`` are allowed to each start; groups end when ``unseen`` and the best basin are as asked (see
        :class:`sweep.optimise.multistart.survey.Survey`); ``time_budget`` [s] or None is an emergency deadline
    stop : asked often; when it answers true, or at Ctrl-C, the search ends and each start in progress keeps its best
        design so far
    jobs : processes the starts are spread over, once the search turns out to be long; results do not depend on it
    tell : called at first and after each start, with the number of starts (or populations) that are done, the most
        there will be, and the best value so far

    Returns
    -------
    Feasible results by objective, then infeasible ones by violation; none without a start.  The same
    groups give the same results to the bit on any machine, busy or not, unless it was stopped.

    Raises
    ------
    InputError
        if a name of the problem is unknown, or two equations say the same
    WorkerDied
        if a worker process was killed.
    """
    end = math.inf if settings.time_budget is None else time.monotonic() + settings.time_budget
    begun, results, ended = list[Group](), list[Result](), "starts"
    seen: list[Result] = []

    def told(*found: Result) -> None:
        seen.extend(found)
        if tell is not None:
            best = min((r.objective for r in seen if r.feasible), default=math.inf)
            tell(_done(begun, seen), most_counted(settings), best)

    told()
    with _signals() as own:

        def asked() -> bool:
            return time.monotonic() >= end or bool(own) or (stop is not None and stop())

        for group in groups:
            first = len(results)
            begun.append(group)
            problem = group.problem or problem
            if not first:  # unknown names and equations that say the same are refused here, not in a worker
                refuse_dependent(problem, Program(problem), group.designs[:LOOKED_AT])
            numbers = list(range(first, first + len(group.designs)))
            task = SearchTask(problem, group.designs, settings.looks, first)
            results += _batch(task, numbers, results, asked, jobs, told)
            if len(results) <= numbers[-1] or any(r.ended in CUT for r in results):
                ended = "time"
                break
            if survey(problem, begun, results, settings, "").enough:
                ended = "enough"
                break
        else:
            if asked() and _done(begun, seen) < most_counted(settings):
                ended = "time"
    if own.signal_number is not None:
        results = [replace(r, ended="interrupted") if r.ended == "time" else r for r in results]
        if own.signal_number == signal.SIGTERM:
            signal.raise_signal(signal.SIGTERM)
    if ended == "time" and (own.signal_number is not None or any(r.ended == "interrupted" for r in results)):
        ended = "interrupted"
    return Search(ranked(results), survey(problem, begun, results, settings, ended), problem)


def _done(begun: Sequence[Group], results: Sequence[Result]) -> int:
    """Return how many of the starts that count are over."""
    counts = counted(begun)
    return sum(counts[r.start] for r in results)


@contextmanager
def _signals() -> Iterator[Stop]:
    """Let Ctrl-C set a flag, so that every process ends with its best design; a caller's own handler is left alone."""
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield Stop()
        return
    with stop_on_signal() as stop:
        yield stop


def _batch(
    task: SearchTask, numbers: list[int], before: Sequence[Result], asked: Callable[[], bool], jobs: int,
    told: Callable[[Result], None],
) -> list[Result]:  # fmt: skip
    """Search from some starts, in this process as long as few looks were needed, then in several."""
    results: list[Result] = []
    while len(results) < len(numbers):
        spent = sum(r.looks for r in (*before, *results))
        # The very first start always has a result, whoever wants to stop.
        if (results or before) and (asked() or (jobs > 1 and spent >= SERIAL_LOOKS)):
            break
        results.append(task(numbers[len(results)], asked))
        told(results[-1])
    rest = numbers[len(results) :]
    if not rest or asked():
        return results
    return results + spread_over(task, rest, asked, jobs, lambda _, found: told(found))


def ranked(results: list[Result]) -> list[Result]:
    """Return results in the order of their rank; those in the best basin carry its number of starts."""
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

    Equations are eliminated where they can be; local searches begin from the best of several samples.

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
    along = on_locus(problem)
    results = _sampled(along, signs, settings, stop, jobs)
    if along is not problem and not any(result.feasible for result in results):
        # The equations give way, or the bounds of the links do: the smaller relaxation is the answer.
        others = _sampled(problem, signs, settings, stop, jobs, [result.design for result in results[:1]])
        first = 1 + max((result.start for result in results), default=-1)
        results = ranked([*results, *(replace(result, start=first + result.start) for result in others)])
    if not results:
        raise InputError("starts", 0, "bounds between which there is a design", PLACE)
    return results


def _sampled(
    problem: Problem,
    signs: Sequence[dict[str, float]],
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None,
    jobs: int,
    near: Sequence[Array] = (),
) -> list[Result]:
    """Search from some designs, then from samples."""
    own = samples(problem, signs, settings.starts, settings.seed, stop or (lambda: False))
    return explore(problem, chain(in_groups(np.array(near)), own), settings, stop, jobs).results


def listed(study: Study) -> dict[str, Array]:
    """Return the parameters that keep the values listed by the study, with these values, sorted.

    Signs are listed by nature and are not among them.  What [locus] or [fit] sets or scales has no list: there the
    values are proportions, and prescribed ones are ranges.
    """
    raw = study.written
    names = study.family.parameter_names
    signs = {p.name for p in study.family.parameters if p.choices is not None}
    found = {}
    for axis in study.space.axes:
        entry = raw.get(axis.name)
        own = axis.name in names and axis.name not in (*signs, *study.made, *study.rescaled)
        if own and axis.values is not None and isinstance(entry, dict) and "values" in entry:
            values = np.unique(axis.values)
            if len(values) > 1:
                found[axis.name] = values
    return found


def with_neighbours(
    problem: Problem,
    results: list[Result],
    catalogue: Mapping[str, Array],
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None,
    jobs: int,
) -> list[Result]:
    """Return results, the best first, with those of neighbours of the best among listed values.

    A neighbour has one listed value exchanged for the next larger or smaller one.

    The exchange goes on from the new best as long as it gains, so that the answer cannot be bettered by the next larger
    or smaller value of any one parameter.  Same results for any number of jobs.

    Parameters
    ----------
    problem, settings, stop, jobs : as for ``minimise``; the listed parameters are no variables
    results : of the search so far, best first
    catalogue : the listed parameters and their values
    """
    names = problem.family.parameter_names
    tried: set[tuple[float, ...]] = set()
    found = list(results)
    for _ in range(ROUNDS):
        best = found[0]
        if best.ended in CUT:
            break
        tried.add(_chosen(best.design, names, catalogue))
        starts = []
        for name, values in catalogue.items():
            at = int(np.argmin(np.abs(values - best.design[names.index(name)])))
            for other in (at - 1, at + 1):
                if 0 <= other < len(values):
                    design = best.design.copy()
                    design[names.index(name)] = values[other]
                    if _chosen(design, names, catalogue) not in tried:
                        tried.add(_chosen(design, names, catalogue))
                        starts.append(design)
        if not starts:
            break
        more = minimise(problem, np.array(starts), replace(settings, unseen=0.0), stop, jobs)
        first = 1 + max(result.start for result in found)
        found = ranked([*found, *(replace(result, start=first + result.start) for result in more)])
        if not _better(found[0], best):
            break
    return found


def _chosen(design: Array, names: tuple[str, ...], catalogue: Mapping[str, Array]) -> tuple[float, ...]:
    return tuple(float(design[names.index(name)]) for name in catalogue)


def _better(new: Result, old: Result) -> bool:
    if new.feasible != old.feasible:
        return new.feasible
    return new.rank[1] < old.rank[1] - GAIN * abs(old.rank[1])
