"""Starts for a study whose sweep leaves too few good designs, or too similar ones: filled up from samples."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from sweep.families.base import Array
from sweep.optimise.candidates import GROUP, ranking, sample
from sweep.optimise.problem import Problem
from sweep.optimise.starts import ALIKE, diverse, drawn

if TYPE_CHECKING:
    from sweep.study import Study

LOOKED_AT = 4  # times 256 designs of a space, that tell which signs it has
SAMPLES = 2  # times as many as would do if no start were near another
MOST_KINDS = 64  # combinations of signs among which a sample is shared out


def kinds(study: Study, problem: Problem, known: Array) -> list[dict[str, float]]:
    """Return the combinations of signs and other values that are chosen, not varied,
    as the designs of a study have them.

    Parameters
    ----------
    study, problem : the columns that the problem does not vary are looked at
    known : (k, P) designs whose combinations come first
    """
    names = problem.family.parameter_names
    others = [c for c in range(len(names)) if c not in problem.columns]
    designs = np.concatenate([known, drawn(study, LOOKED_AT, study.optimise.seed if study.optimise else 0)])
    _, first = np.unique(designs[:, others], axis=0, return_index=True)
    chosen = designs[np.sort(first)][:MOST_KINDS]
    return [{names[c]: float(design[c]) for c in others} for design in chosen]


def filled(study: Study, problem: Problem, starts: Array, count: int, seed: int) -> Array:
    """Return at most ``count`` starts: those given (k, P), then the best of samples that are not near one of them.

    A sample of the problem's own variables finds more than the space of the study, unless [fit] has to finish every
    design; then designs of the space are drawn.
    """
    if len(starts) >= count:
        return starts
    taken = starts
    for more in _offered(study, problem, starts, count, seed):
        taken = apart(problem, taken, more, count)
        if len(taken) == count:
            break
    return taken


def _offered(study: Study, problem: Problem, starts: Array, count: int, seed: int) -> Iterator[Array]:
    """Yield designs to begin with, one sample after the other."""
    if study.fit is None:
        signs = kinds(study, problem, starts)
        for number in range(SAMPLES * -(-count // GROUP)):
            yield sample(problem, signs, min(count, GROUP), seed, number)
        return
    designs = drawn(study, count, seed)
    if len(designs):
        yield diverse(problem, designs, ranking(problem, designs), count)


def apart(problem: Problem, starts: Array, more: Array, count: int) -> Array:
    """Return the starts and, up to a number, those of others that are not near one of them."""
    both = np.concatenate([starts, more])
    place = problem.scaled(both)
    others = [c for c in range(both.shape[1]) if c not in problem.columns]
    least = ALIKE * math.sqrt(place.shape[1] / 6.0)
    taken = list(range(len(starts)))
    for k in range(len(starts), len(both)):
        away = np.linalg.norm(place[taken] - place[k], axis=1) >= least
        other = (both[taken][:, others] != both[k, others]).any(axis=1)
        if len(taken) < count and bool((away | other).all()):
            taken.append(k)
    return np.asarray(both[taken], np.float64)
