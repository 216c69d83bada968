"""Starts of a study from the search over proportions: for its drawing, and for what is made of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from sweep.errors import InputError
from sweep.families.base import Array
from sweep.jobs.progress import Say, unsaid
from sweep.optimise.filling import kinds
from sweep.optimise.linear import NEEDED, Elimination, elimination
from sweep.optimise.problem import Problem
from sweep.optimise.proportions import from_proportions, widened
from sweep.optimise.starts import ALIKE, diverse

if TYPE_CHECKING:
    from sweep.study import OptimiseSettings, Study, Tolerance

SWEPT = 6  # of so many starts one comes from the sweep where there is a global search
OTHER_SEED = 1000  # further on, for samples of their own


def proportion_starts(
    study: Study,
    settings: OptimiseSettings,
    problem: Problem,
    known: Array,
    merit: Array,
    stop: Callable[[], bool],
    jobs: int,
    say: Say = unsaid,
) -> tuple[Problem, Array]:
    """Return the problem with bounds that hold the starts, and the starts:
    a few of the sweep, then of the global search.

    Parameters
    ----------
    study, settings, problem : what is searched
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
    found = from_proportions(linear, kinds(study, problem, own), count - len(own), settings.seed, stop, jobs, say)
    starts = np.concatenate([own, found])
    if not len(starts):
        allowed = "proportions with which the mechanism turns"
        raise InputError("design space", study.space.count, allowed, str(study.path))
    return _holding(study, problem, found), starts


def insensitive(
    study: Study, settings: OptimiseSettings, problem: Problem, stop: Callable[[], bool], jobs: int, say: Say = unsaid
) -> tuple[Problem, Array]:
    """Return the problem with bounds that hold them,
    and designs that keep stroke and straightness when they are made.
    """
    if settings.globally != "proportions":
        return problem, np.empty((0, len(problem.family.parameters)))
    linear = _linear(study, problem, study.tolerance)
    signs = kinds(study, problem, np.empty((0, len(problem.family.parameters))))
    found = from_proportions(linear, signs, settings.starts, settings.seed + OTHER_SEED, stop, jobs, say)
    return _holding(study, problem, found), found


def _linear(study: Study, problem: Problem, tolerance: Tolerance | None = None) -> Elimination:
    linear = elimination(problem, tolerance)
    if linear is None:
        raise InputError("optimise.global", "proportions", NEEDED, str(study.path))
    return linear


def _holding(study: Study, problem: Problem, found: Array) -> Problem:
    return widened(problem, found, [n for n in problem.variables if n in study.made])
