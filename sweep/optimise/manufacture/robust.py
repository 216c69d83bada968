"""Robust design: margins of limits such that the wanted share of toleranced mechanisms keeps all limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sweep.evaluation.summaries import design_outputs, routes
from sweep.families.base import Array
from sweep.jobs.executors import Task
from sweep.jobs.progress import best_words
from sweep.optimise.local.kkt import AGREE, Result
from sweep.optimise.local.model import Model
from sweep.optimise.local.start import search
from sweep.optimise.manufacture.margins import (
    Levels,
    Scatter,
    bounded,
    excesses,
    keyed,
    prices,
    risk_allocation,
    with_margins,
)
from sweep.optimise.manufacture.tolerance import deviating, within_limits
from sweep.optimise.multistart.kept import Kept, noted, result_of
from sweep.optimise.multistart.parallel import spread_over
from sweep.optimise.multistart.survey import CUT
from sweep.optimise.problem.program import Program
from sweep.optimise.problem.statement import Problem
from sweep.quantities.limits import compared, meets

if TYPE_CHECKING:
    from sweep.study import OptimiseSettings, Tolerance

SAME = 1e-8  # relative difference of two optima that count as equally good
BOTH = 4.0  # assumed number of nearly independent ways to violate the limits, for the first margins
TRIED = 4  # number of basins from which the search starts
ENDED = 3  # number of designs that continue after the first rounds
HEAT = 400  # evaluations of each of the first rounds
ROUNDS, CORRECTIONS = 4, 10  # of search with the previous design's margins; of the numbers of standard deviations
ONCE = 2  # evaluations that give the objective of a design
STAYED = 1e-3  # scaled step below which margins, of first order, agree with the design: the error is its square
RADIUS = 0.15  # radius of the first rounds, in scaled variables
NEARLY = 1e-4  # scaled violation below which the objective of a design counts
ALIKE = 0.02  # largest distance, in scaled variables, of designs that count as the same
REACH = 0.6  # largest difference of two limits' numbers of standard deviations in the first correction
FADING = 0.7  # factor on that difference from one correction to the next
LEAP, AMPLE = 1.0, 4.0  # largest change of one correction; number of standard deviations that hardly anything exceeds
SAVED = 2e-6  # relative saving of another allocation below which the allocation is optimal
ENOUGH = 0.0005  # allowed excess of the sampled share over the wanted one; 0.003 cost 0.02 % of acceleration


@dataclass(frozen=True)
class Robust:
    """A robust result, the sampled share of mechanisms that keep all limits, and whether time ran out."""

    result: Result
    share: float
    cut: bool = False


def kept(problem: Problem, designs: Array) -> tuple[dict[str, Array], NDArray[np.bool_]]:
    """Return limited outputs of designs (n, P), and which designs keep all limits on outputs, (n,)."""
    found, good = within_limits(problem, bounded(problem), designs, problem.objective)
    return {name: compared(name, np.asarray(x, np.float64)) for name, x in found.items()}, good


def _begun(results: Sequence[Result], more: Array | None) -> tuple[list[Array], list[int]]:
    """Return the starting designs and their start numbers: those found with margins, otherwise the best basins."""
    heads: list[Result] = []
    for result in results:
        if result.feasible and result.ended not in CUT and result.basin not in [h.basin for h in heads]:
            heads.append(result)
    # Designs found with margins in their limits are far better starts than the best nominal designs.
    heads = heads[: TRIED if more is None or not len(more) else 0]
    number = 1 + max((r.start for r in results), default=-1)
    begin = [h.design for h in heads] + list(np.empty((0, 0)) if more is None else more)
    starts = [h.start for h in heads] + list(range(number, number + len(begin) - len(heads)))
    return begin, starts


def robust(
    problem: Problem,
    results: Sequence[Result],
    tolerance: Tolerance,
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
    more: Array | None = None,
    say: Callable[[int, int, str], None] = lambda _, __, ___: None,
    kept: Kept | None = None,
) -> Robust | None:
    """Return the best design of which the wanted share of toleranced mechanisms keeps all limits.

    Every limit has a margin of its own number of standard deviations.  The margin of a curve varies over the turn and,
    to first order, with the design, so the search trades acceleration for insensitivity.  The margin of any other
    output is one number; near its limit it too varies with the design to first order.  Each round of search uses the
    margins of the previous design; the rounds end when the design stays.  Then the numbers of standard deviations are
    corrected until the share holds in a sample and no cheaper risk allocation is found.

    Parameters
    ----------
    problem : problem with the limits as given
    results : results of the search, best first; without ``more`` the best of up to four basins are the starts
    tolerance : tolerances with ``robust``, the wanted share
    settings, stop, jobs : as for ``minimise``
    more : (k, P) designs of a search for insensitive ones, which replace the starts
    say : called with the number of finished searches, its maximum, and the best value so far in words
    kept : parts of a stopped run, to which this run adds its own

    Returns
    -------
    The best design that reaches the share, otherwise the one with the largest share; None without a start.
    ``agree`` of the result is the number of searches whose first rounds ended at a design with its objective, within
    1e-4.  ``violation`` and ``relaxation`` of the result refer to the limits as given.
    """
    begin, starts = _begun(results, more)
    if not begin:
        return None
    asked, kept = stop or _never, kept or Kept()
    level = NormalDist().inv_cdf(1.0 - (1.0 - (tolerance.robust or 0.0)) / BOTH)
    total = len(begin) + min(ENDED, len(begin))

    def over(name: str, task: Task[Robust], count: int, before: int) -> list[Robust]:
        """Return the results of a task for the begun numbers below ``count``; kept results are not repeated."""
        parts = {number: kept.parts.get(f"{name} {number}") for number in range(count)}
        done = {k: Robust(result_of(part["result"]), part["share"]) for k, part in parts.items() if part is not None}

        def told(number: int, one: Robust) -> None:
            done[number] = one
            if not one.cut:
                kept.note(f"{name} {number}", {"result": noted(one.result), "share": one.share})
            good = [x.result.objective for x in done.values() if x.share >= (tolerance.robust or 0.0)]
            say(before + len(done), total, best_words(min(good, default=math.inf)))

        say(before + len(done), total, "")
        if rest := [number for number in range(count) if number not in done]:
            spread_over(task, rest, asked, jobs, told)
        return [done[number] for number in sorted(done)]

    near = _Approach(problem, np.array(begin), tuple(starts), tolerance, level, min(HEAT, settings.looks))
    found = [x.result for x in over("approach", near, len(begin), 0)]
    # The objective of designs that violate their limits says little.
    order = sorted(found, key=lambda r: (r.violation > NEARLY, r.objective if r.violation <= NEARLY else r.violation))
    ends = _different(problem, order)[:ENDED]
    if not ends:  # stopped before the first search
        return None
    total = len(begin) + len(ends)
    last = _Calibrate(problem, tuple(ends), tolerance, level, settings.seed, settings.looks)
    made = over("calibrated", last, len(ends), len(begin)) or [
        Robust(r, _share(problem, r.design, tolerance, settings.seed), True) for r in ends[:1]
    ]
    good = [x for x in made if x.share >= (tolerance.robust or 0.0)]
    best = min(good, key=lambda x: x.result.objective) if good else max(made, key=lambda x: x.share)
    value = best.result.objective
    met = [end for end, x in zip(ends, made, strict=False) if abs(x.result.objective - value) <= AGREE * abs(value)]
    agree = sum(any(_alike(problem, r, end) for end in met) for r in found)
    best = replace(best, result=replace(best.result, agree=max(1, agree)))
    return replace(best, cut=best.cut or any(x.cut for x in made) or len(made) < len(ends) or len(found) < len(begin))


def _never() -> bool:
    return False


def _alike(problem: Problem, one: Result, other: Result) -> bool:
    """Tell whether two designs differ by at most ALIKE in every scaled variable."""
    places = problem.scaled(np.array([one.design, other.design]))
    return float(np.abs(places[0] - places[1]).max()) <= ALIKE


def _different(problem: Problem, results: Sequence[Result]) -> list[Result]:
    """Return the results whose designs are not near those of better ones."""
    apart: list[Result] = []
    for result in results:
        if not any(_alike(problem, result, other) for other in apart):
            apart.append(result)
    return apart


@dataclass(frozen=True)
class _Approach:
    """Task for processes: the first rounds from one starting design."""

    problem: Problem
    designs: Array
    numbers: tuple[int, ...]
    tolerance: Tolerance
    level: float
    looks: int

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> Robust:
        """Return the result of the first rounds from a design."""
        levels = dict.fromkeys(keyed(self.problem).values(), self.level)
        start, design = self.numbers[number], self.designs[number]
        scatter = Scatter(self.problem, self.tolerance)
        result, *_ = _approached(scatter, start, design, levels, should_stop, ROUNDS, self.looks, RADIUS)
        return Robust(result, math.nan, result.ended in CUT)


@dataclass(frozen=True)
class _Calibrate:
    """Task for processes: further rounds with corrected numbers of standard deviations per limit."""

    problem: Problem
    results: tuple[Result, ...]
    tolerance: Tolerance
    level: float
    seed: int
    looks: int

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> Robust:
        head, wanted = self.results[number], self.tolerance.robust or 0.0
        scatter, enough = Scatter(self.problem, self.tolerance), max(ENOUGH, 1.0 / self.tolerance.samples)
        levels: Levels = dict.fromkeys(keyed(self.problem).values(), self.level)
        values, share = self._made(head.design)
        best = Robust(head, share, head.ended in CUT)
        design, result, radius, step, reach, spent = head.design, head, RADIUS, math.inf, REACH, 0
        for corrected in range(CORRECTIONS):
            if should_stop():
                return replace(best, cut=True)
            if corrected or head.ended != "converged":  # otherwise these margins have led to this head already
                # Rounds that do not settle must not delay the other searches: all corrections share the evaluations of
                # one search.
                looks = max(HEAT, (self.looks - spent) // ROUNDS)
                result, radius, step = _approached(
                    scatter, head.start, design, levels, should_stop, ROUNDS, looks, radius
                )
                design, spent = result.design, spent + result.looks
                values, share = self._made(design)
            value = best.result.objective  # negative if an output is maximised
            gained = (value - result.objective) / (abs(value) or 1.0) if best.share >= wanted else math.inf
            better = share >= wanted and gained > 0.0
            if result.violation <= NEARLY and (better or (best.share < wanted and share > best.share)):
                best = Robust(result, share, result.ended in CUT)
            if spent >= self.looks or (corrected and share >= wanted and not better and result.ended == "looks"):
                break  # prices of an unsettled search would mislead the correction
            levels, saved = self._corrected(scatter, design, levels, values, reach)
            if wanted <= share <= wanted + enough and step < STAYED and min(saved, gained) < SAVED:
                break
            reach *= FADING
        nominal = Model(self.problem, Program(self.problem), best.result.design, _never)
        state = nominal.state(self.problem.scaled(best.result.design[None, :])[0])
        return replace(best, result=replace(best.result, violation=state.violation, relaxation={}))

    def _corrected(
        self, scatter: Scatter, design: Array, levels: Levels, values: Mapping[str, Array], reach: float
    ) -> tuple[Levels, float]:
        """Return corrected numbers of standard deviations, and the relative gain that they promise."""
        known = prices(scatter, design, levels)
        found = excesses(self.problem, values, known)
        if not levels:
            return levels, 0.0
        keys, wanted = list(levels), (self.tolerance.robust or 0.0) + 0.5 * ENOUGH
        excess = np.stack([found[key][1:] for key in keys], axis=1)
        shifts, saved = risk_allocation(excess, np.array([known[key].price for key in keys]), wanted, reach)
        out = {}
        for key, shift in zip(keys, shifts.tolist(), strict=True):
            # A limit without a price is not active: the design has a larger margin there than required.
            now = levels[key] if known[key].price > 0.0 else max(levels[key], -float(found[key][0]))
            out[key] = min(max(now + min(shift, LEAP), 0.0), AMPLE)
        return out, saved

    def _made(self, design: Array) -> tuple[dict[str, Array], float]:
        """Return limited outputs of a design and of mechanisms around it, and the share that keeps all limits."""
        about = deviating(self.problem.family, design, self.tolerance, self.seed, self.tolerance.samples)
        values, good = kept(self.problem, np.concatenate([design[None, :], about]))
        return values, float(good[1:].mean())


def _approached(
    scatter: Scatter,
    number: int,
    design: Array,
    levels: Levels,
    asked: Callable[[], bool],
    rounds: int,
    looks: int,
    radius: float,
) -> tuple[Result, float, float]:
    """Repeat the search, each time with the margins of the previous design, until the design stays.

    Returns
    -------
    The last result, the radius for further rounds, and the last step, in scaled variables.
    """
    problem = scatter.problem
    total, step, room_of, before = 0, math.inf, design, np.zeros(len(problem.variables))
    for _ in range(rounds):
        result = search(number, with_margins(scatter, design, levels, radius), design, asked, looks)
        total += result.looks
        move = (problem.scaled(result.design[None, :]) - problem.scaled(design[None, :]))[0]
        step, room_of, design = float(np.abs(move).max()), design, result.design
        if result.ended in CUT or step < STAYED:
            break
        # The margin is exact at the design where it was computed.  A reversed step indicates oscillation in a flat
        # valley.
        if (move * before).sum() < 0.0:
            radius *= 0.5
        elif step > 0.9 * radius:
            radius = min(2.0 * radius, RADIUS)
        before = move
    # Bounds of the last round may be active where those of the problem are not.
    whole = search(number, with_margins(scatter, room_of, levels, None), design, asked, ONCE)
    kept_ended = result.ended if whole.ended == "looks" else whole.ended
    return replace(whole, looks=total, ended=kept_ended), radius, step


def _share(problem: Problem, design: Array, tolerance: Tolerance, seed: int) -> float:
    """Return the share of mechanisms that keep all limits; cheap limits are tested first, and failures not further."""
    limits, good = bounded(problem), deviating(problem.family, design, tolerance, seed, tolerance.samples)
    for route in routes(problem.family, [x.output for x in limits], problem.accuracy):
        found = design_outputs(problem.family, good, route.outputs, problem.accuracy, problem.window)
        good = good[np.logical_and.reduce([meets(x, found[x.output]) for x in limits if x.output in route.outputs])]
    return len(good) / tolerance.samples


def yields(problem: Problem, designs: Array, tolerance: Tolerance, seed: int) -> list[float]:
    """Return the share of toleranced mechanisms about each design (k, P) that keep all limits on outputs."""
    return [_share(problem, design, tolerance, seed) for design in designs]


def better_made(problem: Problem, results: list[Result], tolerance: Tolerance, seed: int) -> list[Result]:
    """Return the results, first the one with the largest yield among those with the best value."""
    best = results[0]
    equal = [r for r in results if r.feasible and abs(r.objective - best.objective) <= SAME * abs(best.objective)]
    twins = _different(problem, equal)[:TRIED]
    if len(twins) < 2:
        return results
    shares = yields(problem, np.array([r.design for r in twins]), tolerance, seed)
    first = twins[int(np.argmax(shares))]
    return [first, *(r for r in results if r is not first)]
