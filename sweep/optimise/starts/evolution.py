"""Evolution strategies side by side: covariance matrix adaptation from many places at once, deterministic by its seed.

Hansen and Ostermeier 2001, with the weights and rates of Hansen's tutorial (arXiv 1604.00772); all strategies advance
together, so that their candidates are looked at in one call.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sweep.families.base import Array
from sweep.jobs.progress import Say, unsaid
from sweep.optimise.multistart.parallel import spread_over
from sweep.optimise.starts.candidates import spread
from sweep.optimise.starts.linear import Elimination
from sweep.optimise.starts.proportions import STUCK, Proportions, merit, turned_into

SAMPLED = 1 << 15  # proportions per group, two to eight in a hundred of which turn
BLOCK = 1 << 13
STRATEGIES, PER_GROUP = 24, 3  # side by side in a group; starts that a group is worth
RADIUS, GENERATIONS, HEATS = 0.1, 700, (100, 250)  # the better half goes on after each heat
OUTSIDE = 10.0  # price of a unit beyond the bounds, in values of the best


class _Rates(NamedTuple):
    """Constants of a strategy in n dimensions, by the symbols of the tutorial.

    ``candidates`` per generation, ``weights`` of the better half, ``effective`` is their variance-effective
    number; then the learning rates and the damping of the step, and ``normal``, the mean length of a normal vector.
    """

    candidates: int
    weights: Array
    effective: float
    c_sigma: float
    damping: float
    c_path: float
    c_one: float
    c_mu: float
    normal: float


def _rates(n: int) -> _Rates:
    count = 4 + int(3.0 * math.log(n))
    half = count // 2
    weights = np.array([math.log(half + 0.5) - math.log(k) for k in range(1, half + 1)])
    weights /= weights.sum()
    effective = 1.0 / float((weights**2).sum())
    c_sigma = (effective + 2.0) / (n + effective + 5.0)
    damping = 1.0 + 2.0 * max(0.0, math.sqrt((effective - 1.0) / (n + 1.0)) - 1.0) + c_sigma
    c_path = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n)
    c_one = 2.0 / ((n + 1.3) ** 2 + effective)
    c_mu = min(1.0 - c_one, 2.0 * (effective - 2.0 + 1.0 / effective) / ((n + 2.0) ** 2 + effective))
    normal = math.sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n))
    return _Rates(count, weights, effective, c_sigma, damping, c_path, c_one, c_mu, normal)


def evolved(
    function: Callable[[Array], Array],
    places: Array,
    radius: float,
    generations: int,
    rng: np.random.Generator,
    stop: Callable[[], bool] = lambda: False,
    heats: tuple[int, ...] = (),
) -> tuple[Array, Array]:
    """Return the best place of each strategy that goes on to the end, and its value.

    Parameters
    ----------
    function : (k, n) places between 0 and 1 to (k,) values, the smaller the better
    places : (m, n) where the strategies begin
    radius : first standard deviation
    generations : steps of the strategies that go on to the end
    heats : generations after which only the better half of them goes on
    rng : source of its random numbers
    stop : asked before every generation; true ends all strategies
    """
    m, n = places.shape
    count, weights, effective, c_sigma, damping, c_path, c_one, c_mu, normal = _rates(n)
    half = len(weights)
    mean, sigma = places.copy(), np.full(m, radius)
    covariance = np.repeat(np.eye(n)[None], m, axis=0)
    path, step_path = np.zeros((m, n)), np.zeros((m, n))
    best, value = places.copy(), function(places)
    row = np.arange(m)[:, None]
    for generation in range(generations):
        if stop():
            break
        if generation in heats:
            kept = np.argsort(value, kind="stable")[: (len(value) + 1) // 2]
            mean, sigma, covariance, path, step_path = (x[kept] for x in (mean, sigma, covariance, path, step_path))
            best, value, m = best[kept], value[kept], len(kept)
            row = np.arange(m)[:, None]
        sizes, axes = np.linalg.eigh(covariance)
        sizes = np.sqrt(np.maximum(sizes, 1e-20))
        drawn = rng.standard_normal((m, count, n))
        steps = np.einsum("kij,kj,kcj->kci", axes, sizes, drawn)
        wanted = mean[:, None] + sigma[:, None, None] * steps
        inside = np.clip(wanted, 0.0, 1.0)
        beyond = ((wanted - inside) ** 2).sum(axis=2)
        found = function(inside.reshape(-1, n)).reshape(m, count)
        order = np.argsort(found + OUTSIDE * np.abs(value)[:, None] * beyond, axis=1, kind="stable")
        first = np.argmin(found, axis=1)
        better = found[row[:, 0], first] < value
        best[better], value[better] = inside[row[:, 0], first][better], found[row[:, 0], first][better]
        chosen = steps[row, order[:, :half]]
        move = np.einsum("h,khn->kn", weights, chosen)
        mean = mean + sigma[:, None] * move
        white = np.einsum("kij,kj,klj,kl->ki", axes, 1.0 / sizes, axes, move)
        step_path = (1.0 - c_sigma) * step_path + math.sqrt(c_sigma * (2.0 - c_sigma) * effective) * white
        length = np.sqrt((step_path**2).sum(axis=1))
        fading = math.sqrt(1.0 - (1.0 - c_sigma) ** (2 * (generation + 1)))
        moving = length / fading < (1.4 + 2.0 / (n + 1.0)) * normal
        path = (1.0 - c_path) * path
        path += (moving * math.sqrt(c_path * (2.0 - c_path) * effective))[:, None] * move
        late = (~moving * c_one * c_path * (2.0 - c_path))[:, None, None]
        covariance = (
            (1.0 - c_one - c_mu + late) * covariance
            + c_one * path[:, :, None] * path[:, None, :]
            + c_mu * np.einsum("h,khi,khj->kij", weights, chosen, chosen)
        )
        growth = np.clip(c_sigma / damping * (length / normal - 1.0), -1.0, 1.0)
        # numpy's exponential depends on the processor, that of the C library does not
        sigma = np.minimum(sigma * np.array([math.exp(x) for x in growth]), 1.0)
    return best, value


@dataclass(frozen=True)
class _Group:
    """Strategies that advance together, of one combination of signs: a task for processes."""

    linear: Elimination
    signs: tuple[dict[str, float], ...]
    seed: int

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> tuple[Array, Array]:
        """Return designs (k, P) and their merits, the best first."""
        from scipy.stats import qmc

        own = Proportions(self.linear, [self.signs[number % len(self.signs)]])

        def worth_of(places: Array) -> Array:
            return merit(self.linear, own.designs(places, np.zeros(len(places), np.intp)))[1]

        place = qmc.Sobol(len(own.columns), seed=self.seed + number).random(SAMPLED)
        worth = np.concatenate([worth_of(block) for block in np.split(place, max(1, SAMPLED // BLOCK))])
        order = np.argsort(worth, kind="stable")
        order = order[worth[order] < STUCK]
        if not len(order):
            return np.empty((0, own.bases.shape[1])), np.empty(0)
        begin = place[order][spread(place[order], np.zeros(len(order), np.intp), STRATEGIES)]
        rng = np.random.default_rng(self.seed + number)
        place, worth = evolved(worth_of, begin, RADIUS, GENERATIONS, rng, should_stop, HEATS)
        order = np.argsort(worth, kind="stable")
        designs, worth = merit(self.linear, own.designs(place[order], np.zeros(len(order), np.intp)))
        known = np.isfinite(designs).all(axis=1) & (worth < STUCK)
        return turned_into(self.linear.problem, designs[known]), worth[known]


def from_proportions(
    linear: Elimination,
    signs: Sequence[dict[str, float]],
    count: int,
    seed: int,
    stop: Callable[[], bool] = lambda: False,
    jobs: int = 1,
    say: Say = unsaid,
) -> Array:
    """Return at most ``count`` diverse designs (k, P), each the end of an evolution strategy, the best first.

    Parameters
    ----------
    linear : the linear part of the problem
    signs : combinations of the parameters that are not varied; each has strategies of its own
    count : how many; the more, the more groups of strategies
    seed : of samples and strategies
    stop : true ends the strategies where they are
    jobs : processes; the designs do not depend on it
    say : called with how many groups of strategies have ended, and how many there are
    """
    groups = max(1, -(-count // (PER_GROUP * len(signs)))) * len(signs)
    ended = iter(range(1, groups + 1))
    say("proportions", 0, groups, "groups")
    found = spread_over(
        _Group(linear, tuple(signs), seed), list(range(groups)), stop, jobs,
        lambda: say("proportions", next(ended), groups, "groups"),
    )  # fmt: skip
    designs = np.concatenate([x for x, _ in found]) if found else np.empty((0, len(linear.problem.family.parameters)))
    order = np.argsort(np.concatenate([w for _, w in found]) if found else np.empty(0), kind="stable")
    designs = designs[order]
    if not len(designs):
        return designs
    others = [k for k in range(designs.shape[1]) if k not in linear.problem.columns]
    kind = np.unique(designs[:, others], axis=0, return_inverse=True)[1].ravel()
    place = (designs[:, linear.problem.columns] - designs[:, linear.problem.columns].mean(axis=0)) / (
        designs[:, linear.problem.columns].std(axis=0) + 1e-300
    )
    return np.asarray(designs[spread(0.3 * place, kind, count)], np.float64)
