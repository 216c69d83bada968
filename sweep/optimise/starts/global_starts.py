"""Starts of a study from populations of descents, for the nominal search and for the robust one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sweep.errors import InputError
from sweep.families.base import Array
from sweep.jobs.progress import Say, best_words, unsaid
from sweep.optimise.multistart.survey import Group
from sweep.optimise.problem.statement import Problem
from sweep.optimise.starts.dataset import kinds, of_task
from sweep.optimise.starts.linear import NEEDED, Elimination, elimination, widened
from sweep.optimise.starts.populations import TINY, populations
from sweep.optimise.starts.samples import ALIKE, diverse

if TYPE_CHECKING:
    from sweep.study import OptimiseSettings, Study, Tolerance

SWEPT = 6  # one of this many starts comes from the sweep, beside populations
MADE, BEGUN = 3, 4  # populations with margins for tolerances, and number of their ends that start the robust search
OTHER_SEED = 1000  # offset of the seed for the samples of these populations
ANOTHER = 1e-3  # relative difference of values in different basins


def from_populations(
    study: Study, problem: Problem, designs: Array, merit: Array, stop: Callable[[], bool], jobs: int
) -> Iterator[Group]:
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
    settings, linear = study.optimise, _linear(study, problem)
    first = of_task(study, settings.starts, settings.seed)
    if len(first):
        yield Group(first, counted=0)
    own = diverse(problem, designs, merit, settings.starts // SWEPT, ALIKE) if len(merit) else first[:0]
    found, values = first[:0], list[float]()
    signs = kinds(study, problem, own)
    for number, one in enumerate(populations(linear, signs, settings.populations, settings.seed, stop, jobs)):
        if len(one.worth):
            ends = [0, *_apart(one.worth, [*values, one.worth[0]], 1)]
            found = np.concatenate([found, one.designs[ends]])
            values += one.worth[ends].tolist()
            yield Group(one.designs[ends], number, 1, holding(study, problem, found))
        if len(own) and merit.min() < min(values, default=math.inf):
            yield Group(own, counted=0)
            own = own[:0]
    if len(own):
        yield Group(own, counted=0)
    elif not len(merit) and not len(first) and not len(found):
        allowed = "proportions with which the mechanism turns"
        raise InputError("design space", study.space.count, allowed, str(study.path))


def _apart(worth: Array, values: Sequence[float], most: int) -> list[int]:
    """Return the numbers of at most ``most`` ends, best first, whose values differ from each other and ``values``."""
    found, known = list[int](), list(values)
    for k in np.argsort(worth, kind="stable").tolist():
        if len(found) < most and all(abs(worth[k] - value) > ANOTHER * abs(value) for value in known):
            found.append(k)
            known.append(float(worth[k]))
    return found


def insensitive(
    study: Study,
    settings: OptimiseSettings,
    problem: Problem,
    stop: Callable[[], bool],
    jobs: int,
    say: Say = unsaid,
    found: Array | None = None,
) -> tuple[Problem, Array]:
    """Find designs that are good when manufactured: ends of populations whose descents include margins for tolerances.

    Returns
    -------
    The problem with bounds that contain the designs, and the designs (k, P), the best first; none without a global
    search.  With designs ``found`` before, no search takes place.
    """
    if found is not None and len(found):
        return holding(study, problem, found), found
    none = np.empty((0, len(problem.family.parameters)))
    if not settings.by_populations:
        return problem, none
    signs = kinds(study, problem, none)
    designs, worth, what = none, np.empty(0), "tolerances"
    linear = _linear(study, problem, study.tolerance)
    say(what, 0, MADE, "populations")
    for number, one in enumerate(populations(linear, signs, MADE, settings.seed + OTHER_SEED, stop, jobs), 1):
        designs, worth = np.concatenate([designs, one.designs]), np.concatenate([worth, one.worth])
        say(what, number, MADE, f"populations{best_words(worth.min(initial=math.inf))}")
    found = designs[_apart(worth, [], BEGUN)]
    return holding(study, problem, found), found


def descend_once(study: Study, problem: Problem) -> None:
    """Run a small population of descents to compile or load their kernels."""
    signs = kinds(study, problem, np.empty((0, len(problem.family.parameters))))
    for _ in populations(_linear(study, problem), signs, 1, 0, size=TINY):
        pass


def _linear(study: Study, problem: Problem, tolerance: Tolerance | None = None) -> Elimination:
    linear = elimination(problem, tolerance)
    if linear is None:
        raise InputError("optimise.global", "proportions", NEEDED, str(study.path))
    return linear


def holding(study: Study, problem: Problem, found: Array) -> Problem:
    """Return the problem with bounds of the variables that [fit] sets, widened to contain designs (k, P)."""
    return widened(problem, found, [n for n in problem.variables if n in study.made])
