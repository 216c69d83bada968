"""Starts of a study from populations of descents, for the nominal search and for the robust one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sweep.errors import InputError
from sweep.families.base import Array
from sweep.jobs.progress import Say, best_words, unsaid
from sweep.optimise.multistart.survey import StartGroup
from sweep.optimise.problem.statement import Problem
from sweep.optimise.starts.dataset import kinds, task_designs
from sweep.optimise.starts.linear import NEEDED, Elimination, elimination, widened
from sweep.optimise.starts.populations import TINY, populations
from sweep.optimise.starts.samples import ALIKE, diverse

if TYPE_CHECKING:
    from sweep.study import OptimiseSettings, Study, Tolerance

SWEPT = 6  # one of this many starts comes from the sweep, beside populations
POPULATIONS, ENDS = 3, 4  # populations with margins for tolerances, and their ends that start the robust search
OTHER_SEED = 1000  # offset of the seed for the samples of these populations
DISTINCT_VALUE = 1e-3  # relative difference of values in different basins


def from_populations(
    study: Study, problem: Problem, designs: Array, merit: Array, stop: Callable[[], bool], jobs: int
) -> Iterator[StartGroup]:
    """Yield groups of starts: the best end of each population, and one with another value.

    A population counts by the local optimum of its best end, since at fixed poses one basin looks like several.  A few
    designs of the sweep follow if one is better than these ends, or if populations do not settle.

    Parameters
    ----------
    study, problem : study and problem of the search
    designs, merit : (k, P) of the sweep, and their compared objective (k,), empty if none is feasible
    stop : true ends the iteration
    jobs : threads of the descents; the starts do not depend on their number

    Raises
    ------
    InputError
        if the problem has no linear part, or no turning mechanism was found.
    """
    assert study.optimise is not None
    settings, linear = study.optimise, _elimination(study, problem)
    task_starts = task_designs(study, settings.starts, settings.seed)
    if len(task_starts):
        yield StartGroup(task_starts, counted=0)
    swept = diverse(problem, designs, merit, settings.starts // SWEPT, ALIKE) if len(merit) else task_starts[:0]
    ends, values = task_starts[:0], list[float]()
    signs = kinds(study, problem, swept)
    for number, population in enumerate(populations(linear, signs, settings.populations, settings.seed, stop, jobs)):
        if len(population.merit):
            numbers = [0, *_distinct_values(population.merit, [*values, population.merit[0]], 1)]
            ends = np.concatenate([ends, population.designs[numbers]])
            values += population.merit[numbers].tolist()
            yield StartGroup(population.designs[numbers], number, 1, enclosing(study, problem, ends))
        if len(swept) and merit.min() < min(values, default=math.inf):
            yield StartGroup(swept, counted=0)
            swept = swept[:0]
    if len(swept):
        yield StartGroup(swept, counted=0)
    elif not len(merit) and not len(task_starts) and not len(ends):
        allowed = "proportions with which the mechanism turns"
        raise InputError("design space", study.space.count, allowed, str(study.path))


def _distinct_values(merit: Array, values: Sequence[float], count: int) -> list[int]:
    """Return the numbers of at most ``count`` ends, best first, whose values differ from each other and ``values``."""
    chosen, known_values = list[int](), list(values)
    for k in np.argsort(merit, kind="stable").tolist():
        if len(chosen) < count and all(abs(merit[k] - value) > DISTINCT_VALUE * abs(value) for value in known_values):
            chosen.append(k)
            known_values.append(float(merit[k]))
    return chosen


def insensitive(
    study: Study,
    settings: OptimiseSettings,
    problem: Problem,
    stop: Callable[[], bool],
    jobs: int,
    say: Say = unsaid,
    designs_found: Array | None = None,
) -> tuple[Problem, Array]:
    """Find designs that are good when manufactured: ends of populations whose descents include margins for tolerances.

    Returns
    -------
    The problem with bounds that contain the designs, and the designs (k, P), the best first; none without a global
    search.  With ``designs_found`` before, no search takes place.
    """
    if designs_found is not None and len(designs_found):
        return enclosing(study, problem, designs_found), designs_found
    empty = np.empty((0, len(problem.family.parameters)))
    if not settings.by_populations:
        return problem, empty
    signs, seed = kinds(study, problem, empty), settings.seed + OTHER_SEED
    designs, merit, phase = empty, np.empty(0), "tolerances"
    linear = _elimination(study, problem, study.tolerance)
    say(phase, 0, POPULATIONS, "populations")
    for number, population in enumerate(populations(linear, signs, POPULATIONS, seed, stop, jobs), 1):
        designs, merit = np.concatenate([designs, population.designs]), np.concatenate([merit, population.merit])
        say(phase, number, POPULATIONS, f"populations{best_words(merit.min(initial=math.inf))}")
    designs_found = designs[_distinct_values(merit, [], ENDS)]
    return enclosing(study, problem, designs_found), designs_found


def descend_once(study: Study, problem: Problem) -> None:
    """Run a small population of descents to compile or load their kernels."""
    signs = kinds(study, problem, np.empty((0, len(problem.family.parameters))))
    for _ in populations(_elimination(study, problem), signs, 1, 0, size=TINY):
        pass


def _elimination(study: Study, problem: Problem, tolerance: Tolerance | None = None) -> Elimination:
    linear = elimination(problem, tolerance)
    if linear is None:
        raise InputError("optimise.global", "proportions", NEEDED, str(study.path))
    return linear


def enclosing(study: Study, problem: Problem, designs: Array) -> Problem:
    """Return the problem with bounds of the variables that [fit] sets, widened to contain designs (k, P)."""
    return widened(problem, designs, [n for n in problem.variables if n in study.made])
