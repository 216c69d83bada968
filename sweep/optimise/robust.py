"""Limits that hold for what is made: bounds drawn in until the wanted share of toleranced mechanisms keeps them all."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from sweep.families.base import Array
from sweep.optimise.certificate import Result
from sweep.optimise.problem import Problem
from sweep.optimise.sensitivity import sensitivities
from sweep.optimise.solve import minimise
from sweep.optimise.survey import CUT
from sweep.optimise.tolerance import SIGMAS, deviating, touched

if TYPE_CHECKING:
    from sweep.study import Limit, OptimiseSettings, Tolerance

SAMPLES = 8192  # a power of two: the share of 95 % is good to 0.25 %
ROUNDS = 10  # of drawing the bounds in, searching, sampling
TRIED = 4  # basins whose best design is made robust; the best of these is the answer
ENOUGH = 0.004  # by so much the sampled share may exceed the wanted one
SETTLED = 1e-4  # relative change of the objective


@dataclass(frozen=True)
class Robust:
    """A robust result and the sampled share of toleranced mechanisms that keep all limits."""

    result: Result
    share: float


def kept(problem: Problem, designs: Array) -> tuple[dict[str, Array], NDArray[np.bool_]]:
    """Limited outputs of designs (n, P), and which designs keep all limits on outputs."""
    from sweep.chunks.cascade import compared, meets
    from sweep.evaluation.summaries import design_outputs

    limits = bounded(problem)
    names = list(dict.fromkeys([x.output for x in limits] + [problem.objective]))
    found = design_outputs(problem.family, designs, names, problem.accuracy, problem.window)
    good = np.ones(len(designs), dtype=np.bool_)
    for limit in limits:
        good &= meets(limit, found[limit.output])
    return {name: compared(name, np.asarray(found[name], np.float64)) for name in names}, good


def bounded(problem: Problem) -> list[Limit]:
    """The limits on outputs that leave room; those on parameters are about the drawing."""
    own = [x for x in problem.limits if x.output not in problem.family.parameter_names]
    return [x for x in own if x.minimum is None or x.minimum != x.maximum]


def robust(
    problem: Problem,
    results: Sequence[Result],
    tolerance: Tolerance,
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
) -> Robust | None:
    """The best design of which the wanted share of toleranced mechanisms keeps all limits.

    Bounds are drawn in by what the tolerances do to each output: first linearised, by exact gradients, then by the
    quantiles of a sample about the new design, at a level that is corrected until the sampled share holds.

    Parameters
    ----------
    problem : with the limits as they are asked for
    results : of the search, best first; the best of up to four basins are made robust
    tolerance : with ``robust``, the share
    settings, stop, jobs : as for ``minimise``

    Returns
    -------
    The best one that reaches the share, else the one with the largest share; None where no result keeps the limits.
    ``violation`` and ``relaxation`` of the result are about the limits as they are asked for.

    Notes
    -----
    While the bounds are drawn in by fixed amounts the search does not see that another design would need less room;
    the next round does, where it is near.
    """
    heads: list[Result] = []
    for result in results:
        if result.feasible and result.ended not in (*CUT, "left") and result.basin not in [h.basin for h in heads]:
            heads.append(result)
    found = [_made(problem, head, tolerance, settings, stop, jobs) for head in heads[:TRIED]]
    wanted = tolerance.robust or 0.0
    good = [x for x in found if x.share >= wanted]
    if good:
        return min(good, key=lambda x: x.result.objective)
    return max(found, key=lambda x: x.share) if found else None


def _made(
    problem: Problem,
    head: Result,
    tolerance: Tolerance,
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None,
    jobs: int,
) -> Robust:
    wanted = tolerance.robust or 0.0
    limits = bounded(problem)
    count = max(1, sum((x.minimum is not None) + (x.maximum is not None) for x in limits))
    missing = (1.0 - wanted) / min(count, 4)  # of each active limit, at first
    best = Robust(head, _share(problem, head.design, tolerance, settings.seed))
    rooms = _linear(problem, head.design, tolerance, 1.0 - missing)
    design, last = head.design, math.nan
    for _ in range(ROUNDS):
        if stop is not None and stop():
            break
        own = replace(problem, limits=tuple(_drawn_in(x, rooms) for x in problem.limits))
        result = minimise(own, design[None, :], replace(settings, starts=1, finalists=None), stop, jobs)[0]
        design = result.design
        values, good = kept(problem, deviating(problem.family, design, tolerance, settings.seed, SAMPLES))
        share = float(good.mean())
        whole = replace(result, start=head.start, basin=head.basin, agree=head.agree)
        better = share >= wanted and (best.share < wanted or result.objective < best.result.objective)
        if result.status != st.LIMIT_EXCEEDED and (better or (best.share < wanted and share > best.share)):
            best = Robust(whole, share)
        settled = abs(result.objective - last) <= SETTLED * abs(result.objective)
        if settled and wanted <= share <= wanted + ENOUGH:
            break
        last = result.objective
        # The share that is lost should be the share that may be lost.
        missing *= float(np.clip(((1.0 - wanted) + 1e-4) / ((1.0 - share) + 1e-4), 0.4, 2.0))
        nominal, _ = kept(problem, design[None, :])
        rooms = _sampled(limits, values, nominal, 1.0 - missing)
    return best


def _share(problem: Problem, design: Array, tolerance: Tolerance, seed: int) -> float:
    return float(kept(problem, deviating(problem.family, design, tolerance, seed, SAMPLES))[1].mean())


def _linear(problem: Problem, design: Array, tolerance: Tolerance, level: float) -> dict[str, tuple[float, float]]:
    """Room that each output needs below and above, from its exact derivatives by every toleranced dimension."""
    from scipy.special import ndtri

    names = [x.output for x in bounded(problem) if not x.output.startswith("rotatable")]
    rows = sensitivities(problem.family, design, list(dict.fromkeys(names)), problem.window)
    sigma = dict(zip(problem.family.parameter_names, touched(problem.family, tolerance) / SIGMAS, strict=True))
    variance: dict[str, float] = {}
    for name, output, up, down in zip(*(rows[k] for k in ("parameter", "output", "growing", "shrinking")), strict=True):
        steep = max(abs(up), abs(down)) * sigma[name]
        variance[output] = variance.get(output, 0.0) + (steep * steep if math.isfinite(steep) else 0.0)
    return {name: (float(ndtri(level)) * math.sqrt(v),) * 2 for name, v in variance.items()}


def _sampled(
    limits: Sequence[Limit], values: dict[str, Array], nominal: dict[str, Array], level: float
) -> dict[str, tuple[float, float]]:
    """Room that each output needs below and above its nominal value, from a sample."""
    rooms = {}
    for limit in limits:
        known = values[limit.output][np.isfinite(values[limit.output])]
        centre = float(nominal[limit.output][0])
        if len(known) and math.isfinite(centre):
            low, high = np.quantile(known, [1.0 - level, level])
            rooms[limit.output] = (max(centre - float(low), 0.0), max(float(high) - centre, 0.0))
    return rooms


def _drawn_in(limit: Limit, rooms: dict[str, tuple[float, float]]) -> Limit:
    if limit.output not in rooms or limit.output.startswith("rotatable"):
        return limit
    below, above = rooms[limit.output]
    low = None if limit.minimum is None else limit.minimum + below
    high = None if limit.maximum is None else limit.maximum - above
    if low is not None and high is not None and low > high:  # the band is narrower than what the tolerances need
        low = high = 0.5 * (low + high)
    return replace(limit, minimum=low, maximum=high)


def yields(problem: Problem, designs: Array, tolerance: Tolerance, seed: int) -> list[float]:
    """Share of toleranced mechanisms about each design (k, P) that keep all limits on outputs."""
    return [_share(problem, design, tolerance, seed) for design in designs]
