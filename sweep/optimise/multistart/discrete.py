"""Parameters that a study gives as a list of values: each start keeps its own, then the neighbouring ones are tried."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from kernels import status as st
from sweep.families.base import Array
from sweep.optimise.local.kkt import Result
from sweep.optimise.multistart.multistart import minimise, ranked
from sweep.optimise.multistart.survey import CUT
from sweep.optimise.problem.statement import Problem

if TYPE_CHECKING:
    from sweep.study import OptimiseSettings, Study

ROUNDS = 12  # steps from catalogue value to catalogue value, each of at most two searches per parameter
GAIN = 1e-9  # relative, of a step that counts


def listed(study: Study) -> dict[str, Array]:
    """Return the parameters that the study gives as ``{ values = [...] }`` and that keep these values,
    with them, sorted.

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
    """Return results with those of searches from the best design with one listed value exchanged for the next,
    best first.

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
    if (new.status == st.LIMIT_EXCEEDED) != (old.status == st.LIMIT_EXCEEDED):
        return old.status == st.LIMIT_EXCEEDED
    one, other = (r.violation if r.status == st.LIMIT_EXCEEDED else r.objective for r in (new, old))
    return one < other - GAIN * abs(other)
