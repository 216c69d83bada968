"""Starts from populations over the proportions of a guide behind a crank-rocker, for drawings and for robust designs.

Places are valued by the linear program and improved by descents.  A guide that suits one crank-rocker suits others, so
the stages of two good mechanisms are a far better start than a random mechanism.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from kernels.descent.descents import LOCKED
from sweep.errors import InputError
from sweep.families.base import Array
from sweep.jobs.progress import Say, best_words, unsaid
from sweep.numerics.records import Indices, joined, only
from sweep.optimise.local.kkt import AGREE
from sweep.optimise.multistart.survey import StartGroup
from sweep.optimise.problem.statement import Problem
from sweep.optimise.starts.dataset import kinds, task_designs
from sweep.optimise.starts.linear import NEEDED, Elimination, elimination, widened, within_turn
from sweep.optimise.starts.populations import (
    Members,
    ShouldStop,
    best_tries,
    diverse,
    population,
    populations,
    spread,
)
from sweep.optimise.starts.pose_rows import Descents, PoseRows
from sweep.optimise.starts.ranked import ALIKE
from sweep.study import OptimiseSettings, Study, Tolerance

SWEPT = 6  # one of this many starts comes from the sweep, beside populations
POPULATIONS, ENDS = 3, 4  # populations with margins for tolerances, and their ends that start the robust search
OTHER_SEED = 1000  # offset of the seed for the samples of these populations
DISTINCT_VALUE = 1e-3  # relative difference of values in different basins
PARENTS = 40  # best ends, all distinct, from which a generation is made; divided among the signs
TRIES, RANDOM_TRIES = 64, 256  # tries of every child, the best of which descends; tries with one random stage
DRIVERS = 4  # drivers among the tries of a child
MUTATIONS = (0.0, 0.03, 0.1)  # standard deviations of the variation of a child, chosen at random
NICHE = 0.15  # share of the average distance of two random guides below which guides are alike
CLASSES = 5  # classes of swings, each with its own parents
SMALLEST = 1e-3  # swing below which a swing counts as zero [rad]
USEFUL = 1.3  # multiple of the best value above which ends are no parents


class PopulationSize(NamedTuple):
    """Size of a population.

    ``sampled`` proportions for each combination of signs, two to eight per cent of which turn; ``first`` descents in
    the first generation, ``later`` in each of the other ``generations``; ``first_steps`` for all descents, ``steps`` in
    all for the better half of them.
    """

    sampled: int = 1 << 14
    first: int = 120
    later: int = 60
    generations: int = 10
    first_steps: int = 14
    steps: int = 60


FULL = PopulationSize()
TINY = PopulationSize(1 << 10, 4, 0, 0, 1, 2)  # enough samples of it turn to compile the descents


class Proportions:
    """Places of a problem with a linear part; its descents run in ``jobs`` threads, whose number changes nothing."""

    ends = PARENTS

    def __init__(
        self, linear: Elimination, signs: Sequence[dict[str, float]], jobs: int = 1, size: PopulationSize = FULL
    ) -> None:
        self.rows, self.jobs, self.size, self.sign_count = PoseRows(linear, signs), jobs, size, len(signs)
        self.generations, self.parents = size.generations, -(-PARENTS // len(signs))

    def drawn(self, rng: np.random.Generator) -> Iterator[tuple[Array, int]]:
        """Yield a Sobol sample for each combination of signs."""
        from scipy.stats import qmc

        for kind in range(self.sign_count):
            yield qmc.Sobol(len(self.rows.columns), seed=rng).random(self.size.sampled), kind

    def values(self, places: Array, kinds: Indices) -> Array:
        """Return the values, before any descent, of places with the middle of the guide's input angles."""
        return self.rows.initial(self.rows.without_middle(places, kinds), kinds, self.jobs)[1]

    def first(self, sample: Members, rng: np.random.Generator, stop: ShouldStop) -> Members:
        """Return the ends of descents from diverse good members of each class of swings."""
        turning = only(sample, sample.merit < LOCKED).ranked
        better = only(turning, slice(len(turning.merit) // 4))
        groups, selected = self._groups(turning, better), list[int]()
        for k in range(self.sign_count * CLASSES):
            rows = np.flatnonzero(groups == k)
            count = -(-self.size.first // (self.sign_count * CLASSES))
            selected += rows[spread(turning.places[rows], turning.kinds[rows], count)].tolist()
        return self._descended(only(turning, sorted(selected)), better, stop)

    def children(self, parents: Members, rng: np.random.Generator, stop: ShouldStop) -> Members:
        """Return the ends of descents from children, each the best of many tries."""
        best = [best_tries(self, tries, np.full(len(tries), kind)) for tries, kind in self._tries(parents, rng)]
        return self._descended(joined(*best), parents, stop)

    def _descended(self, members: Members, reference: Members, stop: ShouldStop) -> Members:
        """Return the ends of descents; the worse half stops after the first heat.

        The halves are formed in each class, among the swings of a ``reference``, of each kind.
        """
        rows = self.rows
        runs = Descents(rows, rows.without_middle(members.places, members.kinds), members.kinds, self.jobs)
        runs.advance(self.size.first_steps, stop)
        groups, order = self._groups(runs, reference), np.argsort(runs.merit, kind="stable")
        kept = [group[: -(-len(group) // 2)] for group in (order[groups[order] == k] for k in np.unique(groups))]
        runs.keep(np.sort(np.concatenate(kept)))
        runs.advance(self.size.steps - self.size.first_steps, stop)
        designs = within_turn(rows.linear.problem, rows.finished(runs.places, runs.kinds, runs.x))
        ends = Members(rows.with_middle(runs.places, runs.kinds), runs.kinds, runs.merit, designs)
        return only(ends, runs.merit < LOCKED)

    def _groups(self, members: Members | Descents, reference: Members) -> Indices:
        """Return the number of each member's kind and class among the swings of a ``reference``."""
        return members.kinds * CLASSES + _classes(self._swings(members), self._swings(reference))

    def _swings(self, members: Members | Descents) -> Array:
        return self.rows.input_range(members.places, members.kinds)[1]

    def _tries(self, parents: Members, rng: np.random.Generator) -> Iterator[tuple[Array, int]]:
        """Yield tries for equally many children of each kind.

        Most of them combine stage 1 of one parent with the guide of another, slightly varied; a sixth combine stage 1
        of a parent with a random guide, a sixth the guide of a parent with a random stage 1.
        """
        rows, count = self.rows, -(-self.size.later // self.sign_count)
        random_count = count // 6
        for kind in np.unique(parents.kinds).tolist():
            pool = np.flatnonzero(parents.kinds == kind)
            drivers = parents.places[rng.integers(0, len(parents.merit), random_count)]
            guides = parents.places[pool[rng.integers(0, len(pool), random_count)]]
            yield rows.wrapped(self._mixed(parents.places, pool, rng, count - 2 * random_count)), kind
            for inherited, redrawn in ((drivers, ~rows.driving), (guides, rows.driving)):
                tries = np.repeat(inherited[:, None], RANDOM_TRIES, axis=1)
                tries[:, :, redrawn] = rng.random((random_count, RANDOM_TRIES, int(redrawn.sum())))
                yield rows.wrapped(tries), kind

    def _mixed(self, places: Array, pool: Indices, rng: np.random.Generator, count: int) -> Array:
        """Combine stage 1 of one parent with the guide of another in a pool, slightly varied, in many tries of a child.

        Offsets with bounds symmetric to zero change their sign in every second try, since a crank-rocker and its mirror
        image have the same motion.
        """
        guide = pool[rng.integers(0, len(pool), count)]
        # With all drivers at once the best try would nearly always lie in the same basin.
        driver = np.repeat(rng.integers(0, len(places), (count, DRIVERS)), TRIES // DRIVERS, axis=1)
        tries = np.repeat(places[guide][:, None], TRIES, axis=1)
        tries[:, :, self.rows.driving] = places[driver][:, :, self.rows.driving]
        mirror = (rng.random((count, TRIES)) < 0.5)[:, :, None] & self.rows.mirrored
        tries = np.where(mirror, 1.0 - tries, tries)
        # A child equal to its parent would only end at the parent's end.
        varied = np.array(MUTATIONS)[rng.integers(0, len(MUTATIONS), count)][:, None]
        sigma = np.where(driver == guide[:, None], MUTATIONS[-1], varied)
        return tries + sigma[:, :, None] * rng.standard_normal(tries.shape)

    def diverse(self, members: Members, count: int) -> Members:
        """Return the best members, at most half of them of the same signs, and the best of each class of swings.

        No two have the same value or nearly the same guide.

        Without these rules the many descents that ran out of steps in one basin would displace those in all others, and
        guides for large swings would displace guides for small ones.
        """
        useful = members.ranked
        useful = only(useful, useful.merit < USEFUL * useful.merit[:1])
        guides = useful.places[:, ~self.rows.driving]
        distance = NICHE * math.sqrt(guides.shape[1] / 6.0)
        taken, in_class = list[int](), Counter[int]()
        for k, group in enumerate(self._groups(useful, useful).tolist()):
            same = [j for j in taken if useful.kinds[j] == useful.kinds[k]]
            equal = np.abs(useful.merit[k] - useful.merit[same]) <= 2.0 * AGREE * np.abs(useful.merit[same])
            near = np.sqrt(((guides[k] - guides[same]) ** 2).sum(axis=1)) < distance
            few = len(same) < count // 2 or in_class[group] < -(-count // (2 * CLASSES))
            if few and not (equal | near).any():
                in_class[group] += 1
                taken.append(k)
        return only(useful, taken)


def _classes(swings: Array, reference: Array) -> Indices:
    """Return the class (k,) of each swing, of equal width on a log scale between the extremes of useful swings."""
    useful = reference[reference > SMALLEST]
    if not len(useful) or not useful.min() < useful.max():
        return np.zeros(len(swings), np.intp)
    position = np.log(np.maximum(swings, SMALLEST) / useful.min()) * (CLASSES / math.log(useful.max() / useful.min()))
    return np.asarray(np.clip(position, 0.0, CLASSES - 1.0), np.intp)


def from_populations(
    study: Study, problem: Problem, designs: Array, merit: Array, stop: ShouldStop, jobs: int
) -> Iterator[StartGroup]:
    """Yield groups of starts: the best end of each population, and one with another value.

    A population counts by the local optimum of its best end, since at fixed poses one basin looks like several.  A few
    designs of the sweep follow if one is better than these ends, or if populations do not settle.

    Parameters
    ----------
    study, problem : study and problem of the search
    designs, merit : (k, P) of the sweep, and their compared objective (k,), empty if none is feasible
    stop : true ends the iteration
    jobs : threads of the descents; the starts do not depend on their number

    Raises
    ------
    InputError
        if the problem has no linear part, or no turning mechanism was found.
    """
    assert study.optimise is not None
    settings = study.optimise
    task_starts = task_designs(study, settings.starts, settings.seed)
    if len(task_starts):
        yield StartGroup(task_starts, counted=0)
    swept = diverse(problem, designs, merit, settings.starts // SWEPT, ALIKE) if len(merit) else task_starts[:0]
    ends, values = task_starts[:0], list[float]()
    landscape = Proportions(_elimination(study, problem), kinds(study, problem, swept), jobs)
    for number, members in enumerate(populations(landscape, settings.populations, settings.seed, stop)):
        if len(members.merit):
            numbers = [0, *_distinct_values(members.merit, [*values, members.merit[0]], 1)]
            ends = np.concatenate([ends, members.designs[numbers]])
            values += members.merit[numbers].tolist()
            yield StartGroup(members.designs[numbers], number, 1, enclosing(study, problem, ends))
        if len(swept) and merit.min() < min(values, default=math.inf):
            yield StartGroup(swept, counted=0)
            swept = swept[:0]
    if len(swept):
        yield StartGroup(swept, counted=0)
    elif not len(merit) and not len(task_starts) and not len(ends):
        allowed = "proportions with which the mechanism turns"
        raise InputError("design space", study.space.count, allowed, str(study.path))


def _distinct_values(merit: Array, values: Sequence[float], count: int) -> list[int]:
    """Return the numbers of at most ``count`` ends, best first, whose values differ from each other and ``values``."""
    chosen, known_values = list[int](), list(values)
    for k in np.argsort(merit, kind="stable").tolist():
        if len(chosen) < count and all(abs(merit[k] - value) > DISTINCT_VALUE * abs(value) for value in known_values):
            chosen.append(k)
            known_values.append(float(merit[k]))
    return chosen


def insensitive(
    study: Study,
    settings: OptimiseSettings,
    problem: Problem,
    stop: ShouldStop,
    jobs: int,
    say: Say = unsaid,
) -> Array:
    """Find designs that are good when manufactured: ends of populations whose descents include margins for tolerances.

    Returns
    -------
    The designs (k, P), the best first; none without a global search.
    """
    empty = np.empty((0, len(problem.family.parameters)))
    if not settings.by_populations:
        return empty
    landscape = Proportions(_elimination(study, problem, study.tolerance), kinds(study, problem, empty), jobs)
    designs, merit, phase = empty, np.empty(0), "tolerances"
    say(phase, 0, POPULATIONS, "populations")
    for number, members in enumerate(populations(landscape, POPULATIONS, settings.seed + OTHER_SEED, stop), 1):
        designs, merit = np.concatenate([designs, members.designs]), np.concatenate([merit, members.merit])
        say(phase, number, POPULATIONS, f"populations{best_words(merit.min(initial=math.inf))}")
    return designs[_distinct_values(merit, [], ENDS)]


def descend_once(study: Study, problem: Problem) -> None:
    """Run a small population of descents to compile or load their kernels."""
    signs = kinds(study, problem, np.empty((0, len(problem.family.parameters))))
    population(Proportions(_elimination(study, problem), signs, size=TINY), (0, 0))


def _elimination(study: Study, problem: Problem, tolerance: Tolerance | None = None) -> Elimination:
    linear = elimination(problem, tolerance)
    if linear is None:
        raise InputError("optimise.global", "proportions", NEEDED, str(study.path))
    return linear


def enclosing(study: Study, problem: Problem, designs: Array) -> Problem:
    """Return the problem with bounds of the variables that [fit] sets, widened to contain designs (k, P)."""
    return widened(problem, designs, [n for n in problem.variables if n in study.made])
