"""Starts from generations of descents, which begin from recombined stages of good mechanisms.

A guide that suits one crank-rocker suits others, so the stages of two good mechanisms are a far better start than a
random mechanism.  Populations are independent: if several end at the same design, that is evidence for it.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.descent.descents import LOCKED
from sweep.families.base import Array
from sweep.optimise.local.kkt import AGREE
from sweep.optimise.starts.linear import Elimination, within_turn
from sweep.optimise.starts.pose_rows import Descents, Index, PoseRows
from sweep.optimise.starts.samples import spread

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


class Population(NamedTuple):
    """Ends of a population, all distinct and the best first: designs (k, P), their values (k,), and evaluations."""

    designs: Array
    merit: Array
    evaluations: int


class _End(NamedTuple):
    merit: float
    kind: int
    place: Array
    design: Array
    swing: float = 0.0


def breed(
    linear: Elimination,
    signs: Sequence[dict[str, float]],
    seed: tuple[int, int],
    stop: Callable[[], bool] = lambda: False,
    jobs: int = 1,
    size: PopulationSize = FULL,
) -> Population:
    """Return the ends of generations of descents from one seed, run in ``jobs`` threads."""
    rows, rng = PoseRows(linear, signs), np.random.default_rng(seed)
    ends, evaluations = list[_End](), 0
    for generation in range(1 + size.generations):
        parents = _parents(ends, -(-PARENTS // len(signs)), ~rows.driving)
        if stop() or (generation and not parents):
            break
        if generation == 0:
            places, kinds, swings = _sampled(rows, rng, size, jobs)
        else:
            places, kinds = _children(rows, parents, rng, -(-size.later // len(signs)), jobs)
            swings = np.array([p.swing for p in parents])
        new_ends, steps = _descend(rows, places, kinds, swings, size, stop, jobs)
        ends, evaluations = ends + new_ends, evaluations + steps
    best = _parents(ends, PARENTS, ~rows.driving)[:PARENTS]
    designs = np.array([end.design for end in best]).reshape(-1, len(rows.family.parameters))
    return Population(within_turn(linear.problem, designs), np.array([end.merit for end in best]), evaluations)


def populations(
    linear: Elimination,
    signs: Sequence[dict[str, float]],
    most: int,
    seed: int,
    stop: Callable[[], bool] = lambda: False,
    jobs: int = 1,
    size: PopulationSize = FULL,
) -> Iterator[Population]:
    """Yield independent populations, one after the other, as long as the caller requests them.

    Parameters
    ----------
    linear : the linear part of the problem
    signs : combinations of the parameters that are not varied
    most : largest number of populations; each takes some 14 000 evaluations
    seed : seed of samples and children
    stop : true ends the descents at their present designs
    jobs : number of threads; the ends do not depend on it
    size : size of each population
    """
    for number in range(most):
        if stop():
            return
        yield breed(linear, signs, (seed, number), stop, jobs, size)


def _sampled(rows: PoseRows, rng: np.random.Generator, size: PopulationSize, jobs: int) -> tuple[Array, Index, Array]:
    """Return places and kinds of turning designs of a Sobol sample, diverse good ones of each class of swings.

    The third result are the swings of the better quarter.
    """
    from scipy.stats import qmc

    sign_count = len(rows.bases)
    place = np.concatenate([qmc.Sobol(len(rows.columns), seed=rng).random(size.sampled) for _ in range(sign_count)])
    kinds = np.repeat(np.arange(sign_count), size.sampled)
    merit = _initial_merits(rows, place, kinds, jobs)
    order = np.argsort(merit, kind="stable")
    order = order[merit[order] < LOCKED]
    place, kinds = place[order], kinds[order]
    swings = rows.input_range(place, kinds)[1]
    best_swings = swings[: len(swings) // 4]
    groups, selected = kinds * CLASSES + _classes(swings, best_swings), list[int]()
    for k in range(sign_count * CLASSES):
        members = np.flatnonzero(groups == k)
        selected += members[spread(place[members], kinds[members], -(-size.first // (sign_count * CLASSES)))].tolist()
    chosen = sorted(selected)
    return place[chosen], kinds[chosen], best_swings


def _initial_merits(rows: PoseRows, places: Array, kinds: Index, jobs: int) -> Array:
    """Return the values (k,), before any descent, of places with the middle of the guide's input angles."""
    return rows.initial(rows.without_middle(places, kinds), kinds, jobs)[1]


def _children(
    rows: PoseRows, parents: Sequence[_End], rng: np.random.Generator, count: int, jobs: int
) -> tuple[Array, Index]:
    """Return places and kinds of children, ``count`` of each kind, each the best of many tries.

    Most of them combine stage 1 of one parent with the guide of another, slightly varied; a sixth combine stage 1 of a
    parent with a random guide, a sixth the guide of a parent with a random stage 1.
    """
    random_count, places, kinds = count // 6, list[Array](), list[int]()
    for kind in sorted({p.kind for p in parents}):
        pool = [p for p in parents if p.kind == kind]
        drivers = np.array([p.place for p in parents])[rng.integers(0, len(parents), random_count)]
        guides = np.array([p.place for p in pool])[rng.integers(0, len(pool), random_count)]
        places.append(_best_tries(rows, _mixed(rows, pool, parents, rng, count - 2 * random_count), kind, jobs))
        for inherited, redrawn in ((drivers, ~rows.driving), (guides, rows.driving)):
            tries = np.repeat(inherited[:, None], RANDOM_TRIES, axis=1)
            tries[:, :, redrawn] = rng.random((random_count, RANDOM_TRIES, int(redrawn.sum())))
            places.append(_best_tries(rows, tries, kind, jobs))
        kinds += [kind] * count
    return np.concatenate(places), np.array(kinds, np.intp)


def _mixed(
    rows: PoseRows, pool: Sequence[_End], parents: Sequence[_End], rng: np.random.Generator, count: int
) -> Array:
    """Combine stage 1 of one parent with the guide of another, slightly varied, in many tries of each child.

    Offsets with bounds symmetric to zero change their sign in every second try, since a crank-rocker and its mirror
    image have the same motion.
    """
    guide = rng.integers(0, len(pool), count)
    # With all drivers at once the best try would nearly always lie in the same basin.
    driver = np.repeat(rng.integers(0, len(parents), (count, DRIVERS)), TRIES // DRIVERS, axis=1)
    places = np.repeat(np.array([p.place for p in pool])[guide][:, None], TRIES, axis=1)
    places[:, :, rows.driving] = np.array([p.place for p in parents])[driver][:, :, rows.driving]
    mirror = (rng.random((count, TRIES)) < 0.5)[:, :, None] & rows.mirrored
    places = np.where(mirror, 1.0 - places, places)
    # A child equal to its parent would only end at the parent's end.
    parent_numbers = np.array([next(k for k, p in enumerate(parents) if p is end) for end in pool])
    same_parent = driver == parent_numbers[guide][:, None]
    sigma = np.where(same_parent, MUTATIONS[-1], np.array(MUTATIONS)[rng.integers(0, len(MUTATIONS), count)][:, None])
    return places + sigma[:, :, None] * rng.standard_normal(places.shape)


def _best_tries(rows: PoseRows, tries: Array, kind: int, jobs: int) -> Array:
    """Return the best try of each child: places (count, n) of (count, tries, n)."""
    places = rows.wrapped(tries.reshape(-1, tries.shape[2]))
    merit = _initial_merits(rows, places, np.full(len(places), kind), jobs).reshape(tries.shape[:2])
    return np.asarray(places.reshape(tries.shape)[np.arange(len(tries)), np.argmin(merit, axis=1)], np.float64)


def _descend(
    rows: PoseRows,
    places: Array,
    kinds: Index,
    swings: Array,
    size: PopulationSize,
    stop: Callable[[], bool],
    jobs: int,
) -> tuple[list[_End], int]:
    """Return the ends of descents from some places, and their evaluations; the worse half stops after the first heat.

    The halves are formed in each class, among ``swings``, of each kind.
    """
    runs = Descents(rows, rows.without_middle(places, kinds), kinds, jobs)
    runs.advance(size.first_steps, stop)
    groups = kinds * CLASSES + _classes(rows.input_range(runs.places, kinds)[1], swings)
    order = np.argsort(runs.merit, kind="stable")
    kept = [group[: -(-len(group) // 2)] for group in (order[groups[order] == number] for number in np.unique(groups))]
    runs.keep(np.sort(np.concatenate(kept)))
    runs.advance(size.steps - size.first_steps, stop)
    final = rows.with_middle(runs.places, runs.kinds)
    designs = rows.finished(runs.places, runs.kinds, runs.x)
    swing = rows.input_range(runs.places, runs.kinds)[1]
    turning = np.flatnonzero(runs.merit < LOCKED).tolist()
    ends = [_End(float(runs.merit[k]), int(runs.kinds[k]), final[k], designs[k], float(swing[k])) for k in turning]
    return ends, runs.evaluations


def _classes(swings: Array, reference: Array) -> Index:
    """Return the class (k,) of each swing, of equal width on a log scale between the extremes of useful swings."""
    useful = reference[reference > SMALLEST]
    if not len(useful) or not useful.min() < useful.max():
        return np.zeros(len(swings), np.intp)
    position = np.log(np.maximum(swings, SMALLEST) / useful.min()) * (CLASSES / math.log(useful.max() / useful.min()))
    return np.asarray(np.clip(position, 0.0, CLASSES - 1.0), np.intp)


def _parents(ends: Sequence[_End], most: int, guide: NDArray[np.bool_]) -> list[_End]:
    """Return the designs from which a generation is made.

    They are the best ends, at most half of them of the same signs, and the best of each class of swings.  No two have
    the same value or nearly the same guide.

    Without these rules the many descents that ran out of steps in one basin would displace those in all others, and
    guides for large swings would displace guides for small ones.
    """
    parents: list[_End] = []
    in_class: Counter[tuple[int, int]] = Counter()
    of_signs: Counter[int] = Counter()
    distance = NICHE * math.sqrt(int(guide.sum()) / 6.0)
    useful = sorted(ends, key=lambda end: end.merit)
    useful = [end for end in useful if end.merit < USEFUL * useful[0].merit]
    swings = np.array([end.swing for end in useful])
    for end, number in zip(useful, _classes(swings, swings).tolist(), strict=True):
        same_signs = [p for p in parents if p.kind == end.kind]
        duplicate = any(
            abs(end.merit - p.merit) <= 2.0 * AGREE * abs(p.merit)
            or math.sqrt(float(((end.place - p.place)[guide] ** 2).sum())) < distance
            for p in same_signs
        )
        key = (end.kind, number)
        if not duplicate and (of_signs[end.kind] < most // 2 or in_class[key] < -(-most // (2 * CLASSES))):
            of_signs[end.kind] += 1
            in_class[key] += 1
            parents.append(end)
    return parents
