"""Limits with margins so large that the wanted share of toleranced mechanisms keeps them."""

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

SAME = 1e-8  # relative, of values of two optima that are equally good
BOTH = 4.0  # ways in which a design misses a limit that know little of each other, to begin with
TRIED = 4  # basins of the search that are begun with
ENDED = 3  # designs that go on after the first rounds
HEAT = 400  # looks of each of the first rounds
ROUNDS, CORRECTIONS = 4, 10  # of search with the room of the design before; of the number of standard deviations
ONCE = 2  # looks that say how good a design is
STAYED = 1e-3  # scaled step of a design with which its room agrees: that is of first order, and errs by the square
RADIUS = 0.15  # of the first rounds, in scaled variables
NEARLY = 1e-4  # scaled violation of a design whose objective counts
ALIKE = 0.02  # greatest distance in scaled variables of designs that are taken for one
REACH = 0.6  # distance of two limits' numbers of standard deviations in the first correction
FADING = 0.7  # of that distance, from one correction to the next
LEAP, AMPLE = 1.0, 4.0  # of a correction at most; standard deviations that hardly anything exceeds
SAVED = 2e-6  # of the objective that another share-out should save, below which it is as good as it gets
ENOUGH = 0.0005  # by so much the sampled share may exceed the wanted one; 0.003 cost 0.02 % of acceleration


@dataclass(frozen=True)
class Robust:
    """A robust result, the sampled share of mechanisms that keep all limits, and whether time cut it short."""

    result: Result
    share: float
    cut: bool = False


def kept(problem: Problem, designs: Array) -> tuple[dict[str, Array], NDArray[np.bool_]]:
    """Return limited outputs of designs (n, P), and which designs keep all limits on outputs."""
    found, good = within_limits(problem, bounded(problem), designs, problem.objective)
    return {name: compared(name, np.asarray(x, np.float64)) for name, x in found.items()}, good


def _begun(results: Sequence[Result], more: Array | None) -> tuple[list[Array], list[int]]:
    """Name the designs to begin with, and the numbers of their starts: found with room, else of the best basins."""
    heads: list[Result] = []
    for result in results:
        if result.feasible and result.ended not in CUT and result.basin not in [h.basin for h in heads]:
            heads.append(result)
    # Designs that were looked for with room in their limits are far better starts than the best drawings.
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

    Every limit gives up a margin of its own number of standard deviations.  The margin of a curve follows the turn and,
    to first order, the design, so the search trades acceleration for insensitivity.  The margin of any other output is
    one number; near its limit it too follows the design to first order.  Each round of search takes the margins of the
    design before it; the rounds end where the design stays.  Then the numbers are corrected until the share of a sample
    holds and no cheaper risk allocation is found.

    Parameters
    ----------
    problem : with the limits as they are asked for
    results : of the search, best first; the best of up to four basins are begun with where there is no ``more``
    tolerance : with ``robust``, the share
    settings, stop, jobs : as for ``minimise``
    more : (k, P) designs that a search for insensitive ones has found, to begin with instead
    say : called with how many searches are done, how many there are at most, and the best value so far in words
    kept : what a run that was stopped has found, and where this one notes what it finds

    Returns
    -------
    The best one that reaches the share, else the one with the largest share; None where there is nothing to begin with.
    ``agree`` of the result is the number of searches that met it: whose first rounds ended at a design that was found
    to have its objective, within 1e-4.
    ``violation`` and ``relaxation`` of the result are about the limits as they are asked for.
    """
    begin, starts = _begun(results, more)
    if not begin:
        return None
    asked, kept = stop or _never, kept or Kept()
    level = NormalDist().inv_cdf(1.0 - (1.0 - (tolerance.robust or 0.0)) / BOTH)
    total = len(begin) + min(ENDED, len(begin))

    def over(name: str, task: Task[Robust], count: int, before: int) -> list[Robust]:
        """Return what a task gives for the numbers below a count that were begun; what is kept is not done again."""
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
    # The objective of designs that miss their limits still says little.
    order = sorted(found, key=lambda r: (r.violation > NEARLY, r.objective if r.violation <= NEARLY else r.violation))
    ends = _different(problem, order)[:ENDED]
    if not ends:  # stopped before any of them was begun
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
    """Whether two designs are near each other."""
    places = problem.scaled(np.array([one.design, other.design]))
    return float(np.abs(places[0] - places[1]).max()) <= ALIKE


def _different(problem: Problem, results: Sequence[Result]) -> list[Result]:
    """Return results whose designs are not near those of better ones."""
    apart: list[Result] = []
    for result in results:
        if not any(_alike(problem, result, other) for other in apart):
            apart.append(result)
    return apart


@dataclass(frozen=True)
class _Approach:
    """First rounds from some designs: a task for processes."""

    problem: Problem
    designs: Array
    numbers: tuple[int, ...]
    tolerance: Tolerance
    level: float
    looks: int

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> Robust:
        """Return where the first rounds from a design end."""
        levels = dict.fromkeys(keyed(self.problem).values(), self.level)
        start, design = self.numbers[number], self.designs[number]
        scatter = Scatter(self.problem, self.tolerance)
        result, *_ = _approached(scatter, start, design, levels, should_stop, ROUNDS, self.looks, RADIUS)
        return Robust(result, math.nan, result.ended in CUT)


@dataclass(frozen=True)
class _Calibrate:
    """The rest of the way, and how many standard deviations each limit gives up: a task for processes."""

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
            if corrected or head.ended != "converged":  # else these margins have led to this head already
                # One whose rounds do not settle must not hold up the others: all corrections share the looks of one.
                looks = max(HEAT, (self.looks - spent) // ROUNDS)
                result, radius, step = _approached(
                    scatter, head.start, design, levels, should_stop, ROUNDS, looks, radius
                )
                design, spent = result.design, spent + result.looks
                values, share = self._made(design)
            value = best.result.objective  # negative where an output is to be large
            gained = (value - result.objective) / (abs(value) or 1.0) if best.share >= wanted else math.inf
            better = share >= wanted and gained > 0.0
            if result.violation <= NEARLY and (better or (best.share < wanted and share > best.share)):
                best = Robust(result, share, result.ended in CUT)
            if spent >= self.looks or (corrected and share >= wanted and not better and result.ended == "looks"):
                break  # prices from a search that has not settled mislead the correction
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
            # A limit without a price is not active: the design has a larger margin there than it was asked for.
            now = levels[key] if known[key].price > 0.0 else max(levels[key], -float(found[key][0]))
            out[key] = min(max(now + min(shift, LEAP), 0.0), AMPLE)
        return out, saved

    def _made(self, design: Array) -> tuple[dict[str, Array], float]:
        """Return limited outputs of a design and of mechanisms about it, and the share of these that keeps limits."""
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
    """Repeat the search, each time with the margins of the design before, until the design stays.

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
        # The margin is exact at the design where it was taken.  A reversed step tells of oscillation in a flat valley.
        if (move * before).sum() < 0.0:
            radius *= 0.5
        elif step > 0.9 * radius:
            radius = min(2.0 * radius, RADIUS)
        before = move
    # Bounds of the last round may hold the design where those of the problem do not.
    whole = search(number, with_margins(scatter, room_of, levels, None), design, asked, ONCE)
    kept_ended = result.ended if whole.ended == "looks" else whole.ended
    return replace(whole, looks=total, ended=kept_ended), radius, step


def _share(problem: Problem, design: Array, tolerance: Tolerance, seed: int) -> float:
    """Return the share of mechanisms that keep all limits; those that miss the cheap ones are not asked for others."""
    limits, good = bounded(problem), deviating(problem.family, design, tolerance, seed, tolerance.samples)
    for route in routes(problem.family, [x.output for x in limits], problem.accuracy):
        found = design_outputs(problem.family, good, route.outputs, problem.accuracy, problem.window)
        good = good[np.logical_and.reduce([meets(x, found[x.output]) for x in limits if x.output in route.outputs])]
    return len(good) / tolerance.samples


def yields(problem: Problem, designs: Array, tolerance: Tolerance, seed: int) -> list[float]:
    """Return the share of toleranced mechanisms about each design (k, P) that keep all limits on outputs."""
    return [_share(problem, design, tolerance, seed) for design in designs]


def better_made(problem: Problem, results: list[Result], tolerance: Tolerance, seed: int) -> list[Result]:
    """Return results, first the one with the largest yield among those whose value is that of the best."""
    best = results[0]
    equal = [r for r in results if r.feasible and abs(r.objective - best.objective) <= SAME * abs(best.objective)]
    twins = _different(problem, equal)[:TRIED]
    if len(twins) < 2:
        return results
    shares = yields(problem, np.array([r.design for r in twins]), tolerance, seed)
    first = twins[int(np.argmax(shares))]
    return [first, *(r for r in results if r is not first)]
