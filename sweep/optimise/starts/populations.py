"""Starts from generations of descents: stages of good mechanisms are put together anew, and descended from again.

A guide that suits one crank-rocker suits others, so the parts of two good mechanisms are a far better beginning than a
mechanism at random.  Populations know nothing of each other: where several end at the same design, it is no accident.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.families.base import Array
from sweep.jobs.progress import AT_MOST, Say, unsaid
from sweep.optimise.local.kkt import AGREE
from sweep.optimise.multistart.parallel import spread_over
from sweep.optimise.starts.batched_sqp import BatchedSqp
from sweep.optimise.starts.candidates import spread
from sweep.optimise.starts.linear import Elimination
from sweep.optimise.starts.pose_rows import LOCKED, PoseRows
from sweep.optimise.starts.proportions import Index, turned_into

BLOCK = 1 << 13  # proportions that are looked at together
PARENTS = 40  # best ends, no two of them alike, from which a generation is made: as many of all signs
TRIES, STRANGERS = 64, 256  # of every child, the best of which descends; of one half of which is at random
DRIVERS = 4  # among the tries of a child
MUTATIONS = (0.0, 0.03, 0.1)  # standard deviations, one of which a child is varied by
NICHE = 0.15  # of the average distance of two random guides: nearer ones are alike
CLASSES = 5  # of swings, each of which has parents
SMALLEST = 1e-3  # swing that is none [rad]
USELESS = 1.3  # times the best value: worse ends are no parents


class Size(NamedTuple):
    """How large a population is.

    ``sampled`` proportions for each combination of signs, two to eight in a hundred of which turn; ``first`` descents
    of the first generation, ``later`` of each of the other ``generations``; ``heat`` steps of all descents, ``steps``
    of the better half of them.
    """

    sampled: int = 1 << 14
    first: int = 120
    later: int = 60
    generations: int = 10
    heat: int = 14
    steps: int = 60


FULL = Size()


class Bred(NamedTuple):
    """Ends of a population, no two alike and the best first: designs (k, P), what they are worth (k,), and looks."""

    designs: Array
    worth: Array
    looks: int


class _End(NamedTuple):
    worth: float
    kind: int
    place: Array
    design: Array
    swing: float = 0.0


@dataclass(frozen=True)
class Population:
    """Generations from one seed: a task for processes."""

    linear: Elimination
    signs: tuple[dict[str, float], ...]
    seed: int
    size: Size = FULL

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> Bred:
        """Return the ends of the population of that number."""
        rows = PoseRows(self.linear, self.signs)
        rng = np.random.default_rng((self.seed, number))
        ends: list[_End] = []
        looks = 0
        for generation in range(1 + self.size.generations):
            if should_stop():
                break
            parents = _parents(ends, -(-PARENTS // len(self.signs)), ~rows.driving)
            if generation and not parents:
                break
            if generation == 0:
                places, kinds, classes = _sampled(rows, rng, self.size)
            else:
                places, kinds = _children(rows, parents, rng, -(-self.size.later // len(self.signs)))
                classes = _Classes.between(np.array([p.swing for p in parents]))
            found, spent = _descended(rows, places, kinds, classes, self.size, should_stop)
            ends, looks = ends + found, looks + spent
        best = _parents(ends, PARENTS, ~rows.driving)[:PARENTS]
        names = self.linear.problem.family.parameter_names
        designs = np.array([end.design for end in best]).reshape(-1, len(names))
        return Bred(turned_into(self.linear.problem, designs), np.array([end.worth for end in best]), looks)


def _sampled(rows: PoseRows, rng: np.random.Generator, size: Size) -> tuple[Array, Index, _Classes]:
    """Places of a Sobol sample of each kind that turn, the best of every class of swings that are not alike."""
    from scipy.stats import qmc

    number = len(rows.own.bases)
    place = np.concatenate([qmc.Sobol(len(rows.own.columns), seed=rng).random(size.sampled) for _ in range(number)])
    kinds = np.repeat(np.arange(number), size.sampled)
    worth = np.concatenate([_tried(rows, *some) for some in _blocks(place, kinds)])
    order = np.argsort(worth, kind="stable")
    order = order[worth[order] < LOCKED]
    place, kinds = place[order], kinds[order]
    swings = rows.own.swings(rows.own.placed(place, kinds))
    classes = _Classes.between(swings[: len(swings) // 4])
    numbers, found = kinds * CLASSES + classes.of(swings), list[int]()
    for k in range(number * CLASSES):
        own = np.flatnonzero(numbers == k)
        found += own[spread(place[own], kinds[own], -(-size.first // (number * CLASSES)))].tolist()
    chosen = sorted(found)
    return place[chosen], kinds[chosen], classes


def _blocks(place: Array, kinds: Index) -> Iterator[tuple[Array, Index]]:
    for first in range(0, len(place), BLOCK):
        yield place[first : first + BLOCK], kinds[first : first + BLOCK]


def _tried(rows: PoseRows, places: Array, kinds: Index) -> Array:
    """Return what places with the middle of the guide's input angles are worth (k,) before any descent."""
    return rows.begun(rows.without_middle(places, kinds), kinds)[1]


def _children(rows: PoseRows, parents: Sequence[_End], rng: np.random.Generator, count: int) -> tuple[Array, Index]:
    """Places and kinds of children, so many of each kind: the best of many tries for each.

    Most of them are stage 1 of one parent and the guide of another, slightly varied, a sixth is stage 1 of a parent
    with a guide at random, a sixth the guide of a parent with a stage 1 at random.
    """
    few, places, kinds = count // 6, list[Array](), list[int]()
    for kind in sorted({p.kind for p in parents}):
        own = [p for p in parents if p.kind == kind]
        drivers = np.array([p.place for p in parents])[rng.integers(0, len(parents), few)]
        guides = np.array([p.place for p in own])[rng.integers(0, len(own), few)]
        places.append(_best(rows, _mixed(rows, own, parents, rng, count - 2 * few), kind))
        for kept, part in ((drivers, ~rows.driving), (guides, rows.driving)):
            tries = np.repeat(kept[:, None], STRANGERS, axis=1)
            tries[:, :, part] = rng.random((few, STRANGERS, int(part.sum())))
            places.append(_best(rows, tries, kind))
        kinds += [kind] * count
    return np.concatenate(places), np.array(kinds, np.intp)


def _mixed(rows: PoseRows, own: Sequence[_End], parents: Sequence[_End], rng: np.random.Generator, count: int) -> Array:
    """Put stage 1 of one parent and the guide of another together, slightly varied, many tries of each child.

    Offsets whose bounds lie on both sides of zero alike change their side in every second try: a crank-rocker and
    its mirror image move alike.
    """
    guide = rng.integers(0, len(own), count)
    # Among all drivers the best try would be that of the same valley nearly every time.
    driver = np.repeat(rng.integers(0, len(parents), (count, DRIVERS)), TRIES // DRIVERS, axis=1)
    places = np.repeat(np.array([p.place for p in own])[guide][:, None], TRIES, axis=1)
    places[:, :, rows.driving] = np.array([p.place for p in parents])[driver][:, :, rows.driving]
    other = (rng.random((count, TRIES)) < 0.5)[:, :, None] & rows.mirrored
    places = np.where(other, 1.0 - places, places)
    # A parent put together as it was only ends where it stands.
    numbers = np.array([next(k for k, p in enumerate(parents) if p is end) for end in own])
    same = driver == numbers[guide][:, None]
    spread_by = np.where(same, MUTATIONS[-1], np.array(MUTATIONS)[rng.integers(0, len(MUTATIONS), count)][:, None])
    return places + spread_by[:, :, None] * rng.standard_normal(places.shape)


def _best(rows: PoseRows, tries: Array, kind: int) -> Array:
    """Return the best try of each child: places (count, n) of (count, tries, n)."""
    places = rows.wrapped(tries.reshape(-1, tries.shape[2]))
    worth = _tried(rows, places, np.full(len(places), kind)).reshape(tries.shape[:2])
    return np.asarray(places.reshape(tries.shape)[np.arange(len(tries)), np.argmin(worth, axis=1)], np.float64)


def _descended(
    rows: PoseRows, places: Array, kinds: Index, classes: _Classes, size: Size, stop: Callable[[], bool]
) -> tuple[list[_End], int]:
    """Where descents from some places end, the worse half given up after a heat; and how many looks that took.

    Each class of swings of each kind has its own worse half.
    """
    many = BatchedSqp(rows, rows.without_middle(places, kinds), kinds)
    many.advance(size.heat, stop)
    own = kinds * CLASSES + classes.of(rows.own.swings(rows.own.placed(many.places, kinds)))
    order = np.argsort(many.worth, kind="stable")
    better = [some[: -(-len(some) // 2)] for some in (order[own[order] == number] for number in np.unique(own))]
    many.keep(np.sort(np.concatenate(better)))
    many.advance(size.steps - size.heat, stop)
    there = rows.with_middle(many.places, many.kinds)
    ratios = rows.own.placed(many.places, many.kinds)
    designs, swings = rows.linear.finished(ratios, many.x), rows.own.swings(ratios)
    known = np.flatnonzero(many.worth < LOCKED).tolist()
    ends = [_End(float(many.worth[k]), int(many.kinds[k]), there[k], designs[k], float(swings[k])) for k in known]
    return ends, many.looks


class _Classes(NamedTuple):
    """Classes of swings, equal on a log scale between those of useful mechanisms; beyond these are the outer ones."""

    low: float
    high: float

    @classmethod
    def between(cls, swings: Array) -> _Classes:
        """Return the classes from the smallest to the largest of some swings."""
        known = swings[swings > SMALLEST]
        return cls(float(known.min(initial=math.inf)), float(known.max(initial=0.0)))

    def of(self, swings: Array) -> NDArray[np.intp]:
        """Return the class (k,) of each swing."""
        if not self.low < self.high:
            return np.zeros(len(swings), np.intp)
        place = np.log(np.maximum(swings, SMALLEST) / self.low) * (CLASSES / math.log(self.high / self.low))
        return np.asarray(np.clip(place, 0.0, CLASSES - 1.0), np.intp)


def _parents(ends: Sequence[_End], most: int, guide: NDArray[np.bool_]) -> list[_End]:
    """Return the best ends, half as many as said of the same signs, and the best of each class of swings,
    no two of which have the same value or nearly the same guide.

    Else the many that stopped on their way down one valley would take the places of all others, and guides that
    suit large swings those of all that suit small ones.
    """
    found: list[_End] = []
    beside: Counter[tuple[int, int]] = Counter()
    first: Counter[int] = Counter()
    least = NICHE * math.sqrt(int(guide.sum()) / 6.0)
    useful = sorted(ends, key=lambda end: end.worth)
    useful = [end for end in useful if end.worth < USELESS * useful[0].worth]
    swings = np.array([end.swing for end in useful])
    classes = dict(zip(map(id, useful), _Classes.between(swings).of(swings).tolist(), strict=True))
    for end in useful:
        own = [p for p in found if p.kind == end.kind]
        alike = any(
            abs(end.worth - p.worth) <= 2.0 * AGREE * abs(p.worth)
            or math.sqrt(float(((end.place - p.place)[guide] ** 2).sum())) < least
            for p in own
        )
        place = (end.kind, classes[id(end)])
        if not alike and (first[end.kind] < most // 2 or beside[place] < -(-most // (2 * CLASSES))):
            first[end.kind] += 1
            beside[place] += 1
            found.append(end)
    return found


def bred(
    linear: Elimination,
    signs: Sequence[dict[str, float]],
    most: int,
    seed: int,
    stop: Callable[[], bool] = lambda: False,
    jobs: int = 1,
    say: Say = unsaid,
    enough: Callable[[list[Bred]], int | None] = lambda found: None,
    size: Size = FULL,
) -> list[Bred]:
    """Breed populations that know nothing of each other, as many at a time as there are workers.

    Parameters
    ----------
    linear : the linear part of the problem
    signs : combinations of the parameters that are not varied
    most : populations at most; each takes some 14 000 looks
    seed : of samples and children
    stop : true ends the populations where they are
    jobs : processes; the ends do not depend on it
    say : called with how many populations have ended, and how many there are at most
    enough : says how many of those that are there tell enough, None where more are to be made; the others are left out
    size : of each
    """
    task, ended, found = Population(linear, tuple(signs), seed, size), itertools.count(1), list[Bred]()

    def tell(done: int) -> None:
        say("global search", done, most, f"populations {AT_MOST}{_best_so_far(found)}")

    tell(0)
    while len(found) < most:
        numbers = list(range(len(found), min(len(found) + max(1, jobs), most)))
        found += spread_over(task, numbers, stop, jobs, lambda: tell(next(ended)))
        tell(len(found))
        if stop():
            break
        count = enough(found)
        if count is not None:
            return found[:count]
    return found


def _best_so_far(found: Sequence[Bred]) -> str:
    """Return the best value of populations, as their poses see it."""
    best = min((float(one.worth[0]) for one in found if len(one.worth)), default=math.inf)
    return f", the best {best:.5g}" if best < LOCKED else ""
