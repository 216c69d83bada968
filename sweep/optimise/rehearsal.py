"""The optimiser's work on one design with few looks: it compiles the kernels that a search will need."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sweep.evaluation.tables import design_matrix
from sweep.families.base import Array
from sweep.optimise.form import Program
from sweep.optimise.model import SAMPLES
from sweep.optimise.points import Curves
from sweep.optimise.posing import problem_of
from sweep.optimise.robust import robust
from sweep.optimise.solve import explore
from sweep.optimise.starts import drawn
from sweep.optimise.study import curves, sensitivity

if TYPE_CHECKING:
    from sweep.study import Study

LOOKS = 12  # of a search: its steps, its repairs and its last ones
ASKED = 60  # times that rounds for what is made are let go on


def rehearsal(study: Study) -> Iterator[Callable[[], object]]:
    """Yield steps of the search for a study's optimum, each fit to be called on its own, for one design of the study.

    The steps are those of :func:`sweep.optimise.study.optimise_study`; their results are of no use.  Before them come
    its extrema: poses, and the complex ones that slopes are made of.
    """
    if study.optimise is None or study.objective is None:
        return
    design = _design(study)
    if not len(design):
        return
    problem = problem_of(study, design)
    settings = replace(study.optimise, starts=1, looks=LOOKS, time_budget=None)
    yield lambda: Curves(problem, Program(problem).series).scan(design[0], SAMPLES)
    yield lambda: explore(problem, design, settings)
    tolerance = study.tolerance
    if tolerance is not None and tolerance.robust is not None:
        asked = iter(range(ASKED))
        yield lambda: robust(problem, [], tolerance, settings, lambda: next(asked, None) is None, more=design)
    yield lambda: curves(study, design)
    yield lambda: sensitivity(study, design[0])


def _design(study: Study) -> Array:
    """Return the reference design, (1, P), or one at random where the study has none."""
    if study.reference is not None:
        return design_matrix(study.family, study.reference)[0]
    found = drawn(study, 1, 0)
    return np.ascontiguousarray(found[:1])
