"""Robust design: margins of limits such that the wanted share of toleranced mechanisms keeps all limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from statistics import NormalDist

import numpy as np

from sweep.chunks.cascade import Dropped
from sweep.dataset.files import Kept
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Array, Columns
from sweep.families.names import judged_by
from sweep.jobs.executors import Task
from sweep.jobs.progress import best_words
from sweep.optimise.local.kkt import AGREE, Result, noted, result_of
from sweep.optimise.local.model import Model
from sweep.optimise.local.start import search
from sweep.optimise.manufacture.margins import (
    Levels,
    Scatter,
    excesses,
    inequalities,
    margin_keys,
    prices,
    risk_allocation,
    with_margins,
)
from sweep.optimise.manufacture.sample import Sampler, keeping
from sweep.optimise.multistart.parallel import spread_over
from sweep.optimise.multistart.survey import CUT
from sweep.optimise.problem.program import Program
from sweep.optimise.problem.statement import Problem
from sweep.quantities.limits import compared
from sweep.study import OptimiseSettings, Tolerance

SAME = 1e-8  # relative difference of two optima that count as equally good
VIOLATION_WAYS = 4.0  # assumed number of nearly independent ways to violate the limits, for the first margins
MOST_BASINS = 4  # number of basins from which the search starts
CONTINUED = 3  # number of designs that continue after the first rounds
FIRST_BUDGET = 400  # evaluations of each of the first rounds
ROUNDS, CORRECTIONS = 4, 10  # of search with the previous design's margins; of the numbers of standard deviations
OBJECTIVE_BUDGET = 2  # evaluations that give the objective of a design
STEP_SETTLED = 1e-3  # scaled step below which margins, of first order, agree with the design: the error is its square
RADIUS = 0.15  # radius of the first rounds, in scaled variables
NEARLY = 1e-4  # scaled violation below which the objective of a design counts
ALIKE = 0.02  # largest distance, in scaled variables, of designs that count as the same
REACH = 0.6  # largest difference of two limits' numbers of standard deviations in the first correction
REACH_FACTOR = 0.7  # factor on that difference from one correction to the next
MAX_CHANGE, MAX_LEVEL = 1.0, 4.0  # largest change of one correction; number of sigmas that hardly anything exceeds
SAVING_SETTLED = 2e-6  # relative saving of another allocation below which the allocation is optimal
SHARE_EXCESS = 0.0005  # allowed excess of the sampled share over the wanted one; 0.003 cost 0.02 % of acceleration


@dataclass(frozen=True)
class Robust:
    """A robust result, the sampled share of mechanisms that keep all limits, and whether time ran out.

    The share is nan if time ran out before.  ``outputs`` are those of the sampled mechanisms, none if an earlier run
    has computed them.
    """

    result: Result
    share: float
    cut: bool = False
    outputs: Columns = field(default_factory=dict)


def _starting_designs(results: Sequence[Result], more: Array | None) -> tuple[list[Array], list[int]]:
    """Return the starting designs and their start numbers: those found with margins, otherwise the best basins."""
    best: list[Result] = []
    for result in results:
        if result.feasible and result.ended not in CUT and result.basin not in [h.basin for h in best]:
            best.append(result)
    # Designs found with margins in their limits are far better starts than the best nominal designs.
    best = best[: MOST_BASINS if more is None or not len(more) else 0]
    following = 1 + max((r.start for r in results), default=-1)
    designs = [h.design for h in best] + list(np.empty((0, 0)) if more is None else more)
    numbers = [h.start for h in best] + list(range(following, following + len(designs) - len(best)))
    return designs, numbers


def robust(
    problem: Problem,
    results: Sequence[Result],
    tolerance: Tolerance,
    settings: OptimiseSettings,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
    more: Array | None = None,
    say: Callable[[int, int, str], None] = lambda _, __, ___: None,
    stored: Kept | None = None,
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
    stored : parts of a stopped run, to which this run adds its own

    Returns
    -------
    The best design that reaches the share, otherwise the one with the largest share; None without a start.
    ``agree`` of the result is the number of searches whose first rounds ended at a design with its objective, within
    1e-4.  ``violation`` and ``relaxation`` of the result refer to the limits as given.
    """
    designs, numbers = _starting_designs(results, more)
    if not designs:
        return None
    should_stop, stored = stop or (lambda: False), stored or Kept()
    level = NormalDist().inv_cdf(1.0 - (1.0 - (tolerance.robust or 0.0)) / VIOLATION_WAYS)
    total = len(designs) + min(CONTINUED, len(designs))

    def run_tasks(name: str, task: Task[Robust], count: int, offset: int) -> list[Robust]:
        """Return the results of a task for the begun numbers below ``count``; kept results are not repeated."""
        parts = {number: stored.parts.get(f"{name} {number}") for number in range(count)}
        done = {k: Robust(result_of(part["result"]), part["share"]) for k, part in parts.items() if part is not None}

        def record(number: int, item: Robust) -> None:
            done[number] = item
            if not item.cut:
                stored.note(f"{name} {number}", {"result": noted(item.result), "share": item.share})
            sufficient = [x.result.objective for x in done.values() if x.share >= (tolerance.robust or 0.0)]
            say(offset + len(done), total, best_words(min(sufficient, default=math.inf)))

        say(offset + len(done), total, "")
        if rest := [number for number in range(count) if number not in done]:
            spread_over(task, rest, should_stop, jobs, record)
        return [done[number] for number in sorted(done)]

    first = _Approach(problem, np.array(designs), tuple(numbers), tolerance, level, min(FIRST_BUDGET, settings.looks))
    reached = [x.result for x in run_tasks("approach", first, len(designs), 0)]
    # The objective of designs that violate their limits says little.
    order = sorted(reached, key=lambda r: (r.violation > NEARLY, r.objective if r.violation <= NEARLY else r.violation))
    ends = _distinct(problem, order)[:CONTINUED]
    if not ends:  # stopped before the first search
        return None
    total = len(designs) + len(ends)
    calibrate = _Calibrate(problem, tuple(ends), tolerance, level, settings.seed, settings.looks)
    runs = run_tasks("calibrated", calibrate, len(ends), len(designs)) or [Robust(ends[0], math.nan, True)]
    sufficient = [x for x in runs if x.share >= (tolerance.robust or 0.0)]
    best = min(sufficient, key=lambda x: x.result.objective, default=max(runs, key=lambda x: np.nan_to_num(x.share)))
    value = best.result.objective
    equal = [end for end, x in zip(ends, runs, strict=False) if abs(x.result.objective - value) <= AGREE * abs(value)]
    agree = sum(any(_same_design(problem, r, end) for end in equal) for r in reached)
    best = replace(best, result=replace(best.result, agree=max(1, agree)))
    unfinished = any(x.cut for x in runs) or len(runs) < len(ends) or len(reached) < len(designs)
    return replace(best, cut=best.cut or unfinished)


def _same_design(problem: Problem, first: Result, second: Result) -> bool:
    """Tell whether two designs differ by at most ALIKE in every scaled variable."""
    x = problem.scaled(np.array([first.design, second.design]))
    return float(np.abs(x[0] - x[1]).max()) <= ALIKE


def _distinct(problem: Problem, results: Sequence[Result]) -> list[Result]:
    """Return the results whose designs are not near those of better ones."""
    distinct: list[Result] = []
    for result in results:
        if not any(_same_design(problem, result, other) for other in distinct):
            distinct.append(result)
    return distinct


@dataclass(frozen=True)
class _Approach:
    """Task for processes: the first rounds from one starting design."""

    problem: Problem
    designs: Array
    numbers: tuple[int, ...]
    tolerance: Tolerance
    level: float
    budget: int

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> Robust:
        """Return the result of the first rounds from a design."""
        levels = dict.fromkeys(margin_keys(self.problem).values(), self.level)
        start, design = self.numbers[number], self.designs[number]
        scatter = Scatter(self.problem, self.tolerance)
        result, *_ = _margin_rounds(scatter, start, design, levels, should_stop, self.budget, RADIUS)
        return Robust(result, math.nan, result.ended in CUT)


@dataclass(frozen=True)
class _Calibrate:
    """Task for processes: further rounds with corrected numbers of standard deviations per limit."""

    problem: Problem
    results: tuple[Result, ...]
    tolerance: Tolerance
    level: float
    seed: int
    budget: int

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> Robust:
        initial, wanted = self.results[number], self.tolerance.robust or 0.0
        scatter, excess = Scatter(self.problem, self.tolerance), max(SHARE_EXCESS, 1.0 / self.tolerance.samples)
        sampler = Sampler(self.problem, self.tolerance, self.seed, should_stop)
        levels: Levels = dict.fromkeys(margin_keys(self.problem).values(), self.level)
        best = Robust(initial, math.nan)
        design, result, radius, step, reach, spent = initial.design, initial, RADIUS, math.inf, REACH, 0
        try:
            outputs, share = self._sampled_outputs(sampler, design)
            best = self._robust(initial, share, outputs)
            for correction in range(CORRECTIONS):
                if should_stop():
                    raise Dropped
                if correction or initial.ended != "converged":  # otherwise these margins have led to this design
                    # Rounds that do not settle must not delay the other searches: all corrections share the evaluations
                    # of one search.
                    budget = max(min(FIRST_BUDGET, self.budget), (self.budget - spent) // ROUNDS)
                    result, radius, step = _margin_rounds(
                        scatter, initial.start, design, levels, should_stop, budget, radius
                    )
                    spent += result.looks
                    if not np.array_equal(result.design, design):
                        design = result.design
                        outputs, share = self._sampled_outputs(sampler, design)
                value = best.result.objective  # negative if an output is maximised
                gain = (value - result.objective) / (abs(value) or 1.0) if best.share >= wanted else math.inf
                better = share >= wanted and gain > 0.0
                if result.violation <= NEARLY and (better or (best.share < wanted and share > best.share)):
                    best = self._robust(result, share, outputs)
                if spent >= self.budget or (correction and share >= wanted and not better and result.ended == "looks"):
                    break  # prices of an unsettled search would mislead the correction
                levels, saving = self._corrected(scatter, design, levels, outputs, reach)
                if wanted <= share <= wanted + excess and step < STEP_SETTLED and min(saving, gain) < SAVING_SETTLED:
                    break
                reach *= REACH_FACTOR
        except Dropped:
            return replace(best, cut=True)
        nominal = Model(self.problem, Program(self.problem), best.result.design, lambda: False)
        state = nominal.state(self.problem.scaled(best.result.design[None, :])[0])
        return replace(best, result=replace(best.result, violation=state.violation, relaxation={}))

    def _corrected(
        self, scatter: Scatter, design: Array, levels: Levels, outputs: Columns, reach: float
    ) -> tuple[Levels, float]:
        """Return corrected numbers of standard deviations, and the relative gain that they promise."""
        price_of = prices(scatter, design, levels)
        values = {name: compared(name, np.asarray(x, np.float64)) for name, x in outputs.items()}
        excess_of = excesses(self.problem, values, price_of)
        if not levels:
            return levels, 0.0
        keys, wanted = list(levels), (self.tolerance.robust or 0.0) + 0.5 * SHARE_EXCESS
        excess = np.stack([excess_of[key][1:] for key in keys], axis=1)
        shifts, saving = risk_allocation(excess, np.array([price_of[key].price for key in keys]), wanted, reach)
        corrected = {}
        for key, shift in zip(keys, shifts.tolist(), strict=True):
            # A limit without a price is not active: the design has a larger margin there than required.
            level = levels[key] if price_of[key].price > 0.0 else max(levels[key], -float(excess_of[key][0]))
            corrected[key] = min(max(level + min(shift, MAX_CHANGE), 0.0), MAX_LEVEL)
        return corrected, saving

    def _sampled_outputs(self, sampler: Sampler, design: Array) -> tuple[Columns, float]:
        """Return limited outputs of a design and of mechanisms around it, and the share that keeps all limits."""
        problem, limits = self.problem, inequalities(self.problem)
        names = [name for limit in limits for name in (limit.output, judged_by(limit.output))]
        names = list(dict.fromkeys(names))
        own = design_outputs(problem.family, design[None, :], names, problem.accuracy, problem.window)
        made = sampler.outputs(design, names)
        outputs = {name: np.concatenate([own[name], made[name]]) for name in names}
        return outputs, float(keeping(limits, made).mean())

    @staticmethod
    def _robust(result: Result, share: float, outputs: Columns) -> Robust:
        """Return a result with its share; ``outputs`` of the design itself come first, and are left out."""
        return Robust(result, share, result.ended in CUT, {name: column[1:] for name, column in outputs.items()})


def _margin_rounds(
    scatter: Scatter,
    number: int,
    design: Array,
    levels: Levels,
    should_stop: Callable[[], bool],
    budget: int,
    radius: float,
) -> tuple[Result, float, float]:
    """Repeat the search, each time with the margins of the previous design, until the design stays.

    Returns
    -------
    The last result, the radius for further rounds, and the last step, in scaled variables.
    """
    problem = scatter.problem
    evaluations, step, margin_design, previous = 0, math.inf, design, np.zeros(len(problem.variables))
    for _ in range(ROUNDS):
        result = search(number, with_margins(scatter, design, levels, radius), design, should_stop, budget)
        evaluations += result.looks
        move = (problem.scaled(result.design[None, :]) - problem.scaled(design[None, :]))[0]
        step, margin_design, design = float(np.abs(move).max()), design, result.design
        if result.ended in CUT or step < STEP_SETTLED:
            break
        # The margin is exact at the design where it was computed.  A reversed step indicates oscillation in a flat
        # valley.
        if (move * previous).sum() < 0.0:
            radius *= 0.5
        elif step > 0.9 * radius:
            radius = min(2.0 * radius, RADIUS)
        previous = move
    # Bounds of the last round may be active where those of the problem are not.
    final = search(number, with_margins(scatter, margin_design, levels, None), design, should_stop, OBJECTIVE_BUDGET)
    ending = result.ended if final.ended == "looks" else final.ended
    return replace(final, looks=evaluations, ended=ending), radius, step


def best_yield_first(sampler: Sampler, problem: Problem, results: list[Result]) -> list[Result]:
    """Return the results, first the one with the largest yield among those with the best value."""
    best = results[0]
    candidates = [r for r in results if r.feasible and abs(r.objective - best.objective) <= SAME * abs(best.objective)]
    equal = _distinct(problem, candidates)[:MOST_BASINS]
    if len(equal) < 2:
        return results
    shares = [sampler.share(r.design, inequalities(problem)) for r in equal]
    first = equal[int(np.argmax(shares))]
    return [first, *(r for r in results if r is not first)]
