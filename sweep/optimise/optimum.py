"""``optimum``: a problem answered from nothing but its statement."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from kernels import status as st
from sweep.optimise.candidates import from_sample, from_samples
from sweep.optimise.certificate import Result
from sweep.optimise.eliminate import on_locus
from sweep.optimise.problem import Problem
from sweep.optimise.solve import explore, minimise, ranked

if TYPE_CHECKING:
    from sweep.study import OptimiseSettings


def optimum(
    problem: Problem,
    signs: Sequence[dict[str, float]],
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
) -> list[Result]:
    """Return the best designs of a problem:
    equations eliminated where they can be, samples, local searches from the best of each.

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
    searched = on_locus(problem)
    starts, samples = from_samples(searched, signs, settings.starts, settings.seed)
    results: list[Result] = []
    if len(starts) or searched is problem:
        results, _ = explore(searched, starts, settings, stop, jobs, samples=samples)
    if searched is problem or any(result.status != st.LIMIT_EXCEEDED for result in results):
        return results
    near = [result.design for result in results[:1]]
    starts = from_sample(problem, signs, settings.starts, settings.seed)
    others = minimise(problem, np.array([*near, *starts]), settings, stop, jobs)
    # The equations give way, or the bounds of the links do: the smaller relaxation is the answer.
    first = 1 + max((result.start for result in results), default=-1)
    return ranked([*results, *(replace(result, start=first + result.start) for result in others)])
