"""Fronts: the least objective for each of several bounds on a second output (epsilon constraint)."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from kernels import status as st
from sweep.families.base import Array
from sweep.optimise.certificate import Result
from sweep.optimise.problem import Problem
from sweep.optimise.solve import minimise

if TYPE_CHECKING:
    from sweep.study import OptimiseSettings


def pareto(
    problem: Problem,
    second: str,
    bounds: Sequence[float],
    starts: Array,
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
) -> list[Result]:
    """Least objective with the second output at most each of the bounds, widest bound first.

    Every further bound is searched from ``starts`` and from the result before, which is near where it only tightens a
    little.  A bound that makes no difference repeats the design.

    Parameters
    ----------
    problem : objective and limits; an upper limit on ``second`` gives way to the bound, a lower one stays
    second : design output to be bounded
    bounds : in any order
    starts : (k, P) designs
    settings : ``time_budget`` is shared out evenly among the bounds still to come
    stop : as for ``minimise``; the bounds reached by then are returned
    jobs : processes

    Returns
    -------
    One result per bound that was begun; an infeasible one says so in its ``status``.

    Raises
    ------
    InputError
        if ``second`` is no design output of the family, or there is no start.
    """
    from sweep.study import Limit

    end = math.inf if settings.time_budget is None else time.monotonic() + settings.time_budget
    others = tuple(limit for limit in problem.limits if limit.output != second)
    lowest = max((x.minimum for x in problem.limits if x.output == second and x.minimum is not None), default=None)
    begin, found = np.atleast_2d(starts), list[Result]()
    ordered = sorted(bounds, reverse=True)
    for number, bound in enumerate(ordered):
        left = (end - time.monotonic()) / (len(ordered) - number)
        if found and (left <= 0.0 or found[-1].ended == "interrupted" or (stop is not None and stop())):
            break
        bounded = replace(problem, limits=(*others, Limit(second, lowest, float(bound))))
        shared = replace(settings, time_budget=None if math.isinf(left) else max(left, 1e-3))
        best = minimise(bounded, begin, shared, stop, jobs)[0]
        found.append(best)
        if best.status != st.LIMIT_EXCEEDED:
            begin = np.concatenate([best.design[None, :], np.atleast_2d(starts)])
    return found
