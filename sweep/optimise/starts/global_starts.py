"""Starts of a study from the search over proportions: for its drawing, and for what is made of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import zip_longest
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sweep.errors import InputError
from sweep.families.base import Array
from sweep.jobs.progress import Say, unsaid
from sweep.optimise.local.kkt import Result
from sweep.optimise.multistart.parallel import SearchTask, spread_over
from sweep.optimise.multistart.survey import enough as among
from sweep.optimise.multistart.survey import wanted
from sweep.optimise.problem.statement import Problem
from sweep.optimise.starts.candidates import ALIKE, diverse
from sweep.optimise.starts.dataset import kinds
from sweep.optimise.starts.linear import NEEDED, Elimination, elimination
from sweep.optimise.starts.populations import Bred, bred
from sweep.optimise.starts.proportions import widened

if TYPE_CHECKING:
    from sweep.study import OptimiseSettings, Study, Tolerance

SWEPT = 6  # of so many starts one comes from the sweep where there is a global search
MADE, BEGUN = 3, 4  # populations with room for tolerances, and ends of them that the robust search begins with
OTHER_SEED = 1000  # further on, for samples of their own
ANOTHER = 1e-3  # share of a value by which that of another basin differs


class Begun(NamedTuple):
    """The problem with bounds that hold its starts, the starts (k, P), and the global search each comes from.

    ``origins`` (k,) are -1 for starts of the sweep, None where there was no global search.
    """

    problem: Problem
    starts: Array
    origins: tuple[int, ...] | None = None


def from_populations(
    study: Study,
    settings: OptimiseSettings,
    problem: Problem,
    known: Array,
    merit: Array,
    stop: Callable[[], bool],
    jobs: int,
    say: Say = unsaid,
) -> Begun:
    """Choose starts: the best end of every population, other good ends, and a few designs of the sweep.

    Parameters
    ----------
    study, settings, problem : what is searched; populations are made until their best basin was met three times (and as
        ``settings.unseen`` asks), at most ``settings.populations``
    known, merit : designs (k, P) of the sweep, and what they are worth (k,), empty where none is feasible
    stop : true ends the global search early
    jobs : processes; the starts do not depend on it
    say : called with what is worked on, and how much of it is done

    Raises
    ------
    InputError
        if the problem has no linear part, or nothing that turns was found.
    """
    linear = _linear(study, problem)
    count = settings.starts
    own = diverse(problem, known, merit, count // SWEPT, ALIKE) if len(merit) else known[:0]
    signs = kinds(study, problem, own)
    results: list[Result | None] = []  # from the best end of each population; none where it has no end

    def enough(found: list[Bred]) -> int | None:
        """How many populations tell enough, by where their best ends lead: poses take one valley for several."""
        new = found[len(results) :]
        designs = [one.designs[0] for one in new if len(one.designs)]
        made = iter(searched(study, problem, np.array(designs), settings, stop, jobs) if designs else [])
        results.extend(next(made, None) if len(one.designs) else None for one in new)
        return among([_value(result) for result in results], wanted(settings, True))

    populations = bred(linear, signs, settings.populations, settings.seed, stop, jobs, say, enough)
    # Where the local search has ended it is at home: it goes on from there, not from the population's end again.
    first = [
        (k, found.designs[0] if result is None else result.design)
        for k, (found, result) in enumerate(zip_longest(populations, results[: len(populations)]))
        if len(found.designs)
    ]
    met = [float(found.worth[0]) for found in populations if len(found.worth)]
    others = sorted(
        (float(worth), k, row)
        for k, found in enumerate(populations)
        for row, worth in enumerate(found.worth[1:], start=1)
    )
    for worth, k, row in others:
        if len(first) >= count - len(own):
            break
        if all(abs(worth - value) > ANOTHER * abs(value) for value in met):
            first.append((k, populations[k].designs[row]))
            met.append(worth)
    found = np.array([design for _, design in first]).reshape(-1, known.shape[1])
    starts = np.concatenate([found, own])
    if not len(starts):
        allowed = "proportions with which the mechanism turns"
        raise InputError("design space", study.space.count, allowed, str(study.path))
    origins = tuple([k for k, _ in first] + [-1] * len(own))
    return Begun(holding(study, problem, found), starts, origins)


def _value(result: Result | None) -> float:
    return result.objective if result is not None and result.feasible else math.inf


def searched(
    study: Study, problem: Problem, designs: Array, settings: OptimiseSettings, stop: Callable[[], bool], jobs: int
) -> list[Result]:
    """Return where the local search ends from designs (k, P), by which populations are told apart."""
    task = SearchTask(holding(study, problem, designs), designs, settings.looks)
    return spread_over(task, list(range(len(designs))), stop, jobs)


def insensitive(
    study: Study, settings: OptimiseSettings, problem: Problem, stop: Callable[[], bool], jobs: int, say: Say = unsaid
) -> tuple[Problem, Array]:
    """Look for designs that are good when they are made: ends of populations whose descents leave room for tolerances.

    Returns
    -------
    The problem with bounds that hold the designs, and these (k, P), the best first; none without a global search.
    """
    if settings.globally != "proportions":
        return problem, np.empty((0, len(problem.family.parameters)))
    linear = _linear(study, problem, study.tolerance)
    signs = kinds(study, problem, np.empty((0, len(problem.family.parameters))))
    populations = bred(linear, signs, MADE, settings.seed + OTHER_SEED, stop, jobs, say, what="tolerances")
    ends = sorted(
        (float(worth), k, row) for k, found in enumerate(populations) for row, worth in enumerate(found.worth)
    )
    chosen: list[tuple[float, Array]] = []
    for worth, k, row in ends:
        if len(chosen) < BEGUN and all(abs(worth - value) > ANOTHER * abs(value) for value, _ in chosen):
            chosen.append((worth, populations[k].designs[row]))
    found = np.array([design for _, design in chosen]).reshape(-1, len(problem.family.parameters))
    return holding(study, problem, found), found


def _linear(study: Study, problem: Problem, tolerance: Tolerance | None = None) -> Elimination:
    linear = elimination(problem, tolerance)
    if linear is None:
        raise InputError("optimise.global", "proportions", NEEDED, str(study.path))
    return linear


def holding(study: Study, problem: Problem, found: Array) -> Problem:
    """Return the problem with bounds that hold designs (k, P), of the variables that [fit] makes."""
    return widened(problem, found, [n for n in problem.variables if n in study.made])
