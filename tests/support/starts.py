"""Starts from samples as one list, and the survey of a search that ended at given values."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from kernels import status as st
from sweep.optimise import Problem, Result, Survey
from sweep.optimise.multistart.survey import StartGroup, survey
from sweep.optimise.starts.ranked import samples
from sweep.study import OptimiseSettings
from tests.support.optimise_family import FAMILY


def gathered(groups: Iterable[StartGroup]) -> tuple[np.ndarray, tuple[int, ...]]:
    """Return the starts (k, P) of some groups, and the number of each start's sample."""
    found = list(groups)
    return np.concatenate([group.designs for group in found]), tuple(g.source for g in found for _ in g.designs)


def from_sample(problem: Problem, signs: Sequence[dict[str, float]], count: int, seed: int) -> np.ndarray:
    """Return at most ``count`` starts (k, P) of samples."""
    return gathered(samples(problem, signs, count, seed))[0]


def bowl() -> Problem:
    """Return a problem of two variables."""
    return Problem(FAMILY, ("p", "q"), -4 * np.ones(2), 4 * np.ones(2), {}, "max_abs_bowl")


def result(start: int, objective: float, status: int = st.OK, ended: str = "converged") -> Result:
    """Return the result of a search from a start."""
    return Result(start, np.zeros(4), objective, 0.0, 0.0, 0.0, (), {}, {}, {}, status, ended)


def populations_ended_at(values: Sequence[float], settings: OptimiseSettings) -> Survey:
    """Return the survey of populations that ended at these values; a value that is not finite is infeasible."""
    ends = [result(k, x, st.OK if math.isfinite(x) else st.LIMIT_EXCEEDED) for k, x in enumerate(values)]
    groups = [StartGroup(np.zeros((1, 4)), k, 1) for k in range(len(values))]
    return survey(bowl(), groups, ends, replace(settings, globally="proportions"), "")
