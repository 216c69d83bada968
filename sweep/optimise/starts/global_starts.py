"""Starts of a study from the search over proportions: for its drawing, and for what is made of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sweep.errors import InputError
from sweep.families.base import Array
from sweep.jobs.progress import AT_MOST, Say, best_words, unsaid
from sweep.optimise.local.kkt import Result
from sweep.optimise.multistart.parallel import SearchTask, spread_over
from sweep.optimise.multistart.survey import enough, wanted
from sweep.optimise.problem.statement import Problem
from sweep.optimise.starts.candidates import ALIKE, diverse
from sweep.optimise.starts.dataset import kinds
from sweep.optimise.starts.linear import NEEDED, Elimination, elimination, widened
from sweep.optimise.starts.populations import TINY, Bred, bred

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
    count, what = settings.starts, "global search"
    own = diverse(problem, known, merit, count // SWEPT, ALIKE) if len(merit) else known[:0]
    populations, first, values = list[Bred](), list[tuple[int, Array]](), list[float]()
    say(what, 0, settings.populations, f"populations {AT_MOST}")
    for one in bred(
        _linear(study, problem), kinds(study, problem, own), settings.populations, settings.seed, stop, jobs
    ):
        # A population counts by the local optimum of its best end: at fixed poses one basin looks like several.
        led = searched(study, problem, one.designs[:1], settings, stop, jobs)
        # The main search starts from this local optimum, so that the way to it is not searched twice.
        first += [(len(populations), led[0].design if led else design) for design in one.designs[:1]]
        populations.append(one)
        values.append(led[0].objective if led and led[0].feasible else math.inf)
        say(what, len(populations), settings.populations, f"populations {AT_MOST}{best_words(min(values))}")
        if enough(values, wanted(settings, True)) is not None:
            break
    met = [float(one.worth[0]) for one in populations if len(one.worth)]
    chosen = [*first, *_ends_apart(populations, met, count - len(own) - len(first))]
    found = np.array([design for _, design in chosen]).reshape(-1, known.shape[1])
    starts = np.concatenate([found, own])
    if not len(starts):
        allowed = "proportions with which the mechanism turns"
        raise InputError("design space", study.space.count, allowed, str(study.path))
    return Begun(holding(study, problem, found), starts, tuple([k for k, _ in chosen] + [-1] * len(own)))


def _ends_apart(populations: Sequence[Bred], met: list[float], most: int) -> list[tuple[int, Array]]:
    """Return ends, the best first, whose values are not near those ``met`` or each other; each with its population."""
    ends = sorted((float(x), k, row) for k, one in enumerate(populations) for row, x in enumerate(one.worth))
    found, values = list[tuple[int, Array]](), list(met)
    for worth, k, row in ends:
        if len(found) < most and all(abs(worth - value) > ANOTHER * abs(value) for value in values):
            found.append((k, populations[k].designs[row]))
            values.append(worth)
    return found


def searched(
    study: Study, problem: Problem, designs: Array, settings: OptimiseSettings, stop: Callable[[], bool], jobs: int
) -> list[Result]:
    """Return where the local search ends from designs (k, P), by which populations are told apart."""
    task = SearchTask(holding(study, problem, designs), designs, settings.looks)
    return spread_over(task, list(range(len(designs))), stop, jobs) if len(designs) else []


def insensitive(
    study: Study,
    settings: OptimiseSettings,
    problem: Problem,
    stop: Callable[[], bool],
    jobs: int,
    say: Say = unsaid,
    found: Array | None = None,
) -> tuple[Problem, Array]:
    """Look for designs that are good when they are made: ends of populations whose descents leave room for tolerances.

    Returns
    -------
    The problem with bounds that hold the designs, and these (k, P), the best first; none without a global search.
    Designs that were ``found`` before are not looked for again.
    """
    if found is not None and len(found):
        return holding(study, problem, found), found
    if settings.globally != "proportions":
        return problem, np.empty((0, len(problem.family.parameters)))
    signs = kinds(study, problem, np.empty((0, len(problem.family.parameters))))
    what, populations = "tolerances", list[Bred]()
    say(what, 0, MADE, "populations")
    for one in bred(_linear(study, problem, study.tolerance), signs, MADE, settings.seed + OTHER_SEED, stop, jobs):
        populations.append(one)
        best = min((float(one.worth[0]) for one in populations if len(one.worth)), default=math.inf)
        say(what, len(populations), MADE, f"populations{best_words(best)}")
    ends = [design for _, design in _ends_apart(populations, [], BEGUN)]
    found = np.array(ends).reshape(-1, len(problem.family.parameters))
    return holding(study, problem, found), found


def descend_once(study: Study, problem: Problem) -> None:
    """Run a tiny population of descents, so that their kernels are compiled or loaded."""
    signs = kinds(study, problem, np.empty((0, len(problem.family.parameters))))
    for _ in bred(_linear(study, problem), signs, 1, 0, size=TINY):
        pass


def _linear(study: Study, problem: Problem, tolerance: Tolerance | None = None) -> Elimination:
    linear = elimination(problem, tolerance)
    if linear is None:
        raise InputError("optimise.global", "proportions", NEEDED, str(study.path))
    return linear


def holding(study: Study, problem: Problem, found: Array) -> Problem:
    """Return the problem with bounds that hold designs (k, P), of the variables that [fit] makes."""
    return widened(problem, found, [n for n in problem.variables if n in study.made])
