"""Starts from populations: good members of a Sobol sample, and generations of their children.

Populations are independent: if several end at the same design, that is evidence for it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple, Protocol

import numpy as np

from sweep.families.base import Array
from sweep.numerics.records import Indices, joined, only
from sweep.optimise.problem.statement import Problem

ShouldStop = Callable[[], bool]


class Members(NamedTuple):
    """Members of a population.

    ``places`` (k, n) are between 0 and 1, ``kinds`` (k,) the numbers of their combinations of signs.  The smaller a
    value ``merit`` (k,) is, the better.  ``designs`` are (k, P), those of a sample (k, 0).
    """

    places: Array
    kinds: Indices
    merit: Array
    designs: Array

    @property
    def ranked(self) -> Members:
        """The members that have a value, the best first."""
        order = np.argsort(self.merit, kind="stable")
        return only(self, order[np.isfinite(self.merit[order])])


class Landscape(Protocol):
    """What populations need of a problem: values of places between 0 and 1, and what makes them better.

    ``generations`` follow the first one, each from ``parents`` members; a population ends with ``ends`` of them.
    """

    generations: int
    parents: int
    ends: int

    def drawn(self, rng: np.random.Generator) -> Iterator[tuple[Array, int]]:
        """Yield blocks of a sample: places and the number of their combination of signs."""
        ...

    def values(self, places: Array, kinds: Indices) -> Array:
        """Return the values of places."""
        ...

    def first(self, sample: Members, rng: np.random.Generator, stop: ShouldStop) -> Members:
        """Return the first generation: diverse good members of a sample, improved."""
        ...

    def children(self, parents: Members, rng: np.random.Generator, stop: ShouldStop) -> Members:
        """Return improved children of parents."""
        ...

    def diverse(self, members: Members, count: int) -> Members:
        """Return some ``count`` good members that differ from each other, the best first."""
        ...


def populations(landscape: Landscape, most: int, seed: int, stop: ShouldStop = lambda: False) -> Iterator[Members]:
    """Yield the ends of independent populations, one after the other, as long as the caller requests them.

    Parameters
    ----------
    landscape : places of the problem
    most : largest number of populations
    seed : seed of samples and children
    stop : true ends the present population with its best members so far, and the iteration
    """
    for number in range(most):
        if number and stop():
            return
        yield population(landscape, (seed, number), stop)


def population(landscape: Landscape, seed: tuple[int, int], stop: ShouldStop = lambda: False) -> Members:
    """Return the ends of one population, the best first."""
    rng = np.random.default_rng(seed)
    sample = list[Members]()
    for places, kind in landscape.drawn(rng):
        sample.append(_valued(landscape, places, np.full(len(places), kind)))
        if stop():
            break
    members = landscape.first(joined(*sample), rng, stop)
    for _ in range(landscape.generations):
        parents = landscape.diverse(members, landscape.parents)
        if stop() or not len(parents.merit):
            break
        members = joined(members, landscape.children(parents, rng, stop))
    return landscape.diverse(members, landscape.ends)


def best_tries(landscape: Landscape, tries: Array, kinds: Indices) -> Members:
    """Return the best of the tries (k, t, n) of each child, of kinds (k,)."""
    count = tries.shape[1]
    valued = _valued(landscape, tries.reshape(-1, tries.shape[2]), np.repeat(kinds, count))
    return only(valued, np.arange(len(tries)) * count + np.argmin(valued.merit.reshape(-1, count), axis=1))


def _valued(landscape: Landscape, places: Array, kinds: Indices) -> Members:
    return Members(places, kinds, landscape.values(places, kinds), places[:, :0])


def diverse(problem: Problem, designs: Array, merit: Array, count: int, least: float = 0.0) -> Array:
    """Return the best designs that keep a distance from each other, best first.

    The best one is taken, its neighbourhood excluded, and so on; the distance (in variables scaled to their bounds) is
    halved until there are enough.  Designs of different signs are never neighbours.  Ties go to the earlier row.

    Parameters
    ----------
    problem : its variables define the distance
    designs : (k, P)
    merit : (k,) the smaller the better; rows that are not finite are never taken
    count : largest number of designs
    least : distance kept in any case, as a share of the average distance of two random designs
    """
    order = np.argsort(merit, kind="stable")
    ranked = designs[order[np.isfinite(merit[order])]]
    _, kind = np.unique(ranked[:, problem.others], axis=0, return_inverse=True)
    return ranked[spread(problem.scaled(ranked), kind.reshape(-1), count, least)]


def spread(points: Array, kind: Indices, count: int, least_share: float = 0.0, first: int = 0) -> list[int]:
    """Return the numbers of the best rows that keep a distance from each other.

    At most ``count`` rows of ``points`` (k, n), which is ranked with the best first, are taken.

    ``kind`` (k,): rows of different kinds are never neighbours.  The distance is at least ``least_share`` of the
    average distance of two random designs.  The ``first`` rows are taken in any case.
    """
    distance = 0.5 * np.sqrt(points.shape[1] / 6.0)  # half of the average distance of two random designs
    taken, columns = list[int](), np.ascontiguousarray(points.T)  # sums along columns are several times as fast
    for _ in range(12):
        taken, left = [], np.arange(len(points))
        while len(taken) < first or (len(taken) < count and len(left)):
            row = len(taken) if len(taken) < first else int(left[0])
            taken.append(row)
            squares = ((columns[:, left] - columns[:, row, None]) ** 2).sum(axis=0)
            near = (squares < distance**2) & (kind[left] == kind[row])
            left = left[~near & (left != row)]
        if len(taken) == count or 0.5 * distance < least_share * np.sqrt(points.shape[1] / 6.0):
            break
        distance *= 0.5
    return taken
