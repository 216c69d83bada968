"""Starts of any problem from populations: places are ranked by limits and objective, and improved by random tries.

Every six starts come from a population of their own, since one may hit a region that another one misses.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array
from sweep.families.names import is_flag, stem
from sweep.numerics.records import Indices, only
from sweep.optimise.multistart.survey import GROUP_SIZE, StartGroup
from sweep.optimise.problem.program import violation_scale
from sweep.optimise.problem.statement import Problem
from sweep.optimise.starts.populations import Members, ShouldStop, best_tries, populations, spread
from sweep.quantities.limits import compared
from sweep.quantities.measures import ROTATABLE_MARGIN, margins

SAMPLED = 1 << 15  # designs per start; on a locus they cost a third of a microsecond each
BLOCK, LEAST_BLOCK = 1 << 15, 1 << 12  # designs ranked together; smallest such number, with many signs
WIDENING = 0.35  # share of the bounds' width added on either side: two coordinates in five are clipped to a bound
KEPT = 512  # best designs of the sample per start, and as many of the infeasible ones
PARENTS, TRIES, ROUNDS = 16, 24, 12  # designs improved per start; tries around each design per round; rounds
RANKED = SAMPLED + PARENTS * TRIES * ROUNDS  # designs per start in all
FARTHEST = 1e100
RADIUS = 0.06  # radius of the first of these tries, in variables scaled to their bounds
ACCURACY = Accuracy(samples=64)  # misses a peak by less than the local search gains ...
TURNING = Accuracy(samples=16)  # the same for margins, which rank designs that do not turn; other margins are exact
VERIFIED, HIDDEN = Accuracy(target=1e-3), 2.0  # ... except near a pole, where a true extremum is larger by this factor
NEARLY = 0.03  # violation that a search corrects in passing, so that the objective ranks the design
PRICE = 3.0  # price of such a violation, in objectives
ABSENT = 100.0  # violation of a limit on an output that a design does not have, as the swing of a rocker that turns
ALIKE = 0.02  # share of the average distance of two random designs: nearer designs of a sweep give one start
OUTSIDE, NOT_TURNING = 1e100, 1e200  # above every objective: violates its limits, does not turn


def samples(
    problem: Problem, signs: Sequence[dict[str, float]], count: int, seed: int, stop: ShouldStop = lambda: False
) -> Iterator[StartGroup]:
    """Yield at most ``count`` good designs, population by population; the same arguments give the same designs.

    Parameters
    ----------
    problem : problem to be minimised
    signs : combinations of the parameters that are not varied (branches), among which each sample is divided
    count : largest number of designs, equally many of each population, up to six
    seed : seed of the populations
    stop : true ends the present population with the best designs so far, and the iteration
    """
    most = -(-count // GROUP_SIZE)
    landscape = Ranked(problem, signs, -(-count // most))
    for k, ends in enumerate(populations(landscape, most, seed, stop)):
        if len(ends.designs):
            yield StartGroup(ends.designs[: count - k * landscape.ends], k)


class Ranked:
    """Places of any problem; a population gives ``ends`` starts."""

    generations = 0  # neither they nor recombination find more: docs/internals/optimiser.md

    def __init__(self, problem: Problem, signs: Sequence[dict[str, float]], ends: int) -> None:
        self.problem, self.ends, self.parents = problem, ends, PARENTS * ends
        centre = problem.lower + 0.5 * problem.span
        self.bases = np.array([problem.rows(centre, **choice)[0] for choice in signs])

    def drawn(self, rng: np.random.Generator) -> Iterator[tuple[Array, int]]:
        """Yield blocks of a Sobol sample, of one combination of signs after the other."""
        from scipy.stats import qmc

        sobol = qmc.Sobol(len(self.problem.variables), seed=rng)
        block = BLOCK
        while block > LEAST_BLOCK and block * len(self.bases) > SAMPLED * self.ends:
            block //= 2
        for k in range(max(-(-SAMPLED * self.ends // block), len(self.bases))):
            yield _drawn_within(self.problem, sobol.random(block)), k % len(self.bases)

    def values(self, places: Array, kinds: Indices, accuracy: Accuracy = ACCURACY) -> Array:
        """Return the ranks of places."""
        return ranking(self.problem, self._placed(places, kinds), accuracy)

    def _placed(self, places: Array, kinds: Indices) -> Array:
        return self.problem.placed(self.bases[kinds], places)

    def first(self, sample: Members, rng: np.random.Generator, stop: ShouldStop) -> Members:
        """Return diverse good members of a sample, improved: up to half keep the limits, the others are distant.

        A limit may leave several separate regions.  A sample can miss the smallest, which is then reached from
        infeasible designs beside it.
        """
        ranked, best = sample.ranked, KEPT * self.ends
        feasible = int(np.searchsorted(ranked.merit, OUTSIDE))
        rows = np.r_[: min(feasible, best), feasible : min(feasible + best, len(ranked.merit))]
        ranked = self._verified(only(ranked, rows)).ranked
        feasible, turning = np.searchsorted(ranked.merit, (OUTSIDE, NOT_TURNING)).tolist()
        taken = np.array(spread(ranked.places[:feasible], ranked.kinds[:feasible], self.parents // 2), np.intp)
        feasible_count = len(taken)
        for candidates in (np.arange(feasible, turning), np.arange(len(ranked.merit))):
            rows = np.concatenate([taken, candidates[~np.isin(candidates, taken)]])
            taken = rows[spread(ranked.places[rows], ranked.kinds[rows], self.parents, first=len(taken))]
        members = self.children(only(ranked, taken), rng, stop)
        if feasible_count >= self.ends:  # designs moved within the limits have to be as good as those that were there
            members = only(members, members.merit <= members.merit[:feasible_count].max())
        return members

    def children(self, parents: Members, rng: np.random.Generator, stop: ShouldStop) -> Members:
        """Replace each design repeatedly by the best of the tries around it; without a better one halve the radius."""
        places, kinds, merit = parents.places.copy(), parents.kinds, parents.merit.copy()
        radius = np.full(len(places), RADIUS)
        for _ in range(ROUNDS):
            if stop():
                break
            steps = radius[:, None, None] * rng.standard_normal((len(places), TRIES, places.shape[1]))
            best = self._verified(best_tries(self, np.clip(places[:, None, :] + steps, 0.0, 1.0), kinds))
            better = best.merit < merit
            places[better], merit[better] = best.places[better], best.merit[better]
            radius[~better] *= 0.5
        return Members(places, kinds, merit, self._placed(places, kinds))

    def _verified(self, members: Members) -> Members:
        """Return members with ranks from true extrema if the poses hid most of a peak."""
        merit = members.merit.copy()
        rows = np.flatnonzero(merit < OUTSIDE)
        ranks = self.values(members.places[rows], members.kinds[rows], VERIFIED)
        hidden = ranks > HIDDEN * merit[rows]
        merit[rows[hidden]] = ranks[hidden]
        return members._replace(merit=merit)

    def diverse(self, members: Members, count: int) -> Members:
        """Return the best members that keep a distance from each other."""
        ranked = members.ranked
        return only(ranked, spread(ranked.places, ranked.kinds, count))


def _drawn_within(problem: Problem, fractions: Array) -> Array:
    """Return points of a block of a sample within the bounds, half of them drawn from a wider range and clipped.

    Optima lie on bounds, often on several at once, and the feasible designs near them may fill less than a millionth of
    the space between the bounds.
    """
    low, high = _drawing_range(problem)
    bounded = high - low == 1.0  # an angle of a whole turn has no ends
    half = len(fractions) // 2
    out = fractions.copy()
    widened = np.clip((1.0 + 2.0 * WIDENING) * fractions[:half] - WIDENING, 0.0, 1.0)
    out[:half] = np.where(bounded, widened, fractions[:half])
    return np.asarray(low + out * (high - low), np.float64)


def _drawing_range(problem: Problem) -> tuple[Array, Array]:
    """Return the bounds in which samples are drawn, as fractions.

    A variable with the period of a turn is drawn from the middle turn of its bounds only.
    """
    periodic = () if problem.coordinates is None else problem.coordinates.periodic
    share = np.array(
        [
            min(1.0, 2.0 * np.pi / width) if name in periodic else 1.0
            for name, width in zip(problem.variables, problem.span, strict=True)
        ]
    )
    return 0.5 - 0.5 * share, 0.5 + 0.5 * share


def ranking(problem: Problem, designs: Array, accuracy: Accuracy = ACCURACY) -> Array:
    """Return the rank of each design; smaller is better.

    It is the objective if all limits are nearly kept, otherwise a larger number that grows with the violation, and
    above all for designs that do not turn.

    Cheap limits come first: parameters, then margins and pressure angles, then the others; only designs that nearly
    keep them are evaluated further.  Infinite if there is no design or no objective.

    Parameters
    ----------
    problem : problem of the objective and the limits
    designs : (n, P)
    accuracy : accuracy of the extrema over the turn
    """
    limits = [limit for limit in problem.limits if not is_flag(limit.output)]
    names = problem.family.parameter_names
    turning = ["margin"] if margins(problem.family) else []
    groups: list[list[Any]] = [[], [], []]
    for limit in limits:
        groups[
            0 if limit.output in names else 1 if stem(limit.output) in ("margin", "max_pressure_angle") else 2
        ].append(limit)
    merit = np.full(len(designs), np.inf)
    alive = np.flatnonzero(np.isfinite(designs).all(axis=1))
    violation = np.zeros(len(designs))
    for level, group in zip((3.0, 2.0, 1.0), groups, strict=True):
        wanted = list(dict.fromkeys(limit.output for limit in group)) + (turning if level == 2.0 else [])
        used = TURNING if level == 2.0 and accuracy.samples else accuracy
        columns = _values(problem, designs[alive], wanted, used)
        for limit in group:
            violation[alive] = np.maximum(violation[alive], _relative_violation(limit, columns[limit.output]))
        rejected = violation[alive] > NEARLY
        merit[alive[rejected]] = OUTSIDE * (level + violation[alive[rejected]])
        if level == 2.0 and turning:
            stuck = ~(columns["margin"] >= ROTATABLE_MARGIN)
            # The distance of a crank from turning is a rank only; larger numbers count as equal, and would overflow.
            margin = np.maximum(np.nan_to_num(columns["margin"][stuck]), -FARTHEST)
            merit[alive[stuck]] = NOT_TURNING * (1.0 - margin)
            rejected |= stuck
        alive = alive[~rejected]
    values = _values(problem, designs[alive], [problem.objective], accuracy)[problem.objective]
    objective = compared(problem.objective, values)
    merit[alive] = np.nan_to_num(objective + PRICE * np.abs(objective) * violation[alive], nan=np.inf, posinf=np.inf)
    return merit


def _values(problem: Problem, designs: Array, wanted: list[str], accuracy: Accuracy) -> dict[str, Array]:
    """Return outputs and parameters of designs, (n,) each."""
    names = problem.family.parameter_names
    columns: dict[str, Any] = {name: designs[:, names.index(name)] for name in wanted if name in names}
    outputs = [name for name in wanted if name not in names]
    if outputs and len(designs):
        columns |= design_outputs(problem.family, designs, outputs, accuracy, problem.window)
    return {name: np.asarray(columns.get(name, np.empty(0)), np.float64) for name in wanted}


def _relative_violation(limit: Any, value: Array) -> Array:
    """Return the violation of a limit relative to its bound, (n,).

    A missing output has a large violation.
    """
    value = compared(limit.output, value)
    out = np.zeros(len(value))
    for bound, sense in ((limit.minimum, 1.0), (limit.maximum, -1.0)):
        if bound is not None:
            size = violation_scale(max(abs(limit.minimum or 0.0), abs(limit.maximum or 0.0)))
            out = np.maximum(out, sense * (bound - value) / size)
    return np.nan_to_num(out, nan=ABSENT)
