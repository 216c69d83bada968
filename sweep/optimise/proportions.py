"""Starts from a global search over proportions: evolution strategies by the dozen, what is linear solved inside."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array
from sweep.families.chain import stages_of
from sweep.jobs.progress import Say, unsaid
from sweep.optimise.evolution import evolved
from sweep.optimise.linear import Elimination
from sweep.optimise.merit import STUCK, merit
from sweep.optimise.parallel import spread_over
from sweep.optimise.problem import Problem
from sweep.optimise.samples import sobol
from sweep.optimise.starts import spread

SAMPLED = 1 << 15  # proportions per group, two to eight in a hundred of which turn
BLOCK = 1 << 13
STRATEGIES, PER_GROUP = 24, 3  # side by side in a group; starts that a group is worth
RADIUS, GENERATIONS, HEATS = 0.1, 700, (100, 250)  # the better half goes on after each heat
SHORT = 0.15  # shortest length of a guide that the strategies begin with, against the longest its crank may have
MIDDLE = Accuracy(target=1e-3)


class Proportions:
    """Places between 0 and 1 for what is not linear, and the designs that belong to them.

    Lengths of the guide stand on a logarithmic scale against its crank, which is the unit.  Instead of the offset
    between the stages the middle of the guide's input angles is varied, so that it stays while stage 1 changes.  With
    ``grown`` the lengths of stage 1 that cannot vanish stand on such a scale too.
    """

    def __init__(self, linear: Elimination, signs: dict[str, float], grown: bool = False) -> None:
        problem = linear.problem
        self.linear, names = linear, problem.family.parameter_names
        number = linear.last
        self.base = problem.rows(problem.lower + 0.5 * problem.span, **signs)[0]
        at = [problem.variables.index(name) for name in linear.free]
        self.low, self.high = problem.lower[at].astype(np.float64), problem.upper[at].astype(np.float64)
        units = {p.name: p for p in problem.family.parameters}
        unit = problem.variables.index(linear.links[0])
        self.log = np.zeros(len(linear.free), dtype=np.bool_)
        for k, name in enumerate(linear.free):
            if units[name].unit == "angle" and self.high[k] - self.low[k] >= 2.0 * math.pi:
                self.low[k], self.high[k] = -math.pi, math.pi
            # A frame to the other side is the same guide, turned by half a turn.
            if name in linear.links:
                shortest = max(self.low[k], problem.upper[unit] * SHORT)
                self.low[k] = shortest / problem.upper[unit]
                self.high[k] /= max(problem.lower[unit], problem.upper[unit] * SHORT)
                self.log[k] = True
            elif grown and units[name].unit == "length" and self.low[k] > 0.0:
                self.log[k] = True
        self.columns = [names.index(name) for name in linear.free]
        self.base[names.index(linear.links[0])] = 1.0
        self.offset = names.index(f"offset{number}") if f"offset{number}" in linear.free else -1
        self.driver = stages_of(problem.family)[0].family

    def designs(self, places: Array) -> Array:
        """Designs (k, P) at places (k, n), with the point, line and scale still to be found."""
        designs = self.placed(places)
        if self.offset >= 0:
            designs[:, self.offset] -= self.middles(designs)
        return designs

    def placed(self, places: Array) -> Array:
        """Return the same with the offset between the stages itself at its place."""
        values: Array = self.low + places * (self.high - self.low)
        low, wide = self.low[self.log], np.array([math.log(x) for x in self.high[self.log] / self.low[self.log]])
        # numpy's exponential depends on the processor, that of the C library does not
        grown = [math.exp(x) for x in (places[:, self.log] * wide).ravel()]
        values[:, self.log] = low * np.reshape(grown, (len(places), len(wide)))
        designs = np.repeat(self.base[None, :], len(places), axis=0)
        designs[:, self.columns] = values
        return designs

    def middles(self, designs: Array) -> Array:
        """Middle of the guide's input angles (k,) for an offset of zero, which only stage 1 decides; 0 without one."""
        return self._driven(designs)[0]

    def swings(self, designs: Array) -> Array:
        """Return the range (k,) of the guide's input angles; 0 where stage 1 does not turn."""
        return self._driven(designs)[1]

    def _driven(self, designs: Array) -> tuple[Array, Array]:
        upstream = np.ascontiguousarray(designs[:, : len(self.driver.parameters)])
        found = design_outputs(self.driver, upstream, ("psi_ext", "swing"), MIDDLE)
        swing = np.asarray(found["swing"], np.float64)
        middle = np.asarray(found["psi_ext"], np.float64) + 0.5 * swing
        return np.nan_to_num(middle), np.nan_to_num(np.abs(swing))

    def merit(self, places: Array) -> Array:
        """Return the least objective for these proportions, plus what missed limits cost (k,)."""
        return merit(self.linear, self.designs(places))[1]


@dataclass(frozen=True)
class _Group:
    """Strategies that advance together, of one combination of signs: a task for processes."""

    linear: Elimination
    signs: tuple[dict[str, float], ...]
    seed: int

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> tuple[Array, Array]:
        """Return designs (k, P) and their merits, the best first."""
        own = Proportions(self.linear, self.signs[number % len(self.signs)])
        place = sobol(len(own.columns), self.seed + number).random(SAMPLED)
        worth = np.concatenate([own.merit(block) for block in np.split(place, max(1, SAMPLED // BLOCK))])
        order = np.argsort(worth, kind="stable")
        order = order[worth[order] < STUCK]
        if not len(order):
            return np.empty((0, len(own.base))), np.empty(0)
        begin = place[order][spread(place[order], np.zeros(len(order), np.intp), STRATEGIES)]
        rng = np.random.default_rng(self.seed + number)
        place, worth = evolved(own.merit, begin, RADIUS, GENERATIONS, rng, should_stop, HEATS)
        order = np.argsort(worth, kind="stable")
        designs, worth = merit(self.linear, own.designs(place[order]))
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


def turned_into(problem: Problem, designs: Array) -> Array:
    """Return the designs whose angles lie within their bounds, by whole turns."""
    out = designs.copy()
    for k, name in enumerate(problem.variables):
        column = problem.family.parameter_names.index(name)
        if problem.family.parameters[column].unit == "angle" and problem.span[k] >= 2.0 * math.pi:
            middle = problem.lower[k] + 0.5 * problem.span[k]
            out[:, column] -= 2.0 * math.pi * np.round((out[:, column] - middle) / (2.0 * math.pi))
    return out


def widened(problem: Problem, designs: Array, names: Sequence[str]) -> Problem:
    """Return the problem with the bounds of some variables widened so
    that the designs lie half their size within them.
    """
    lower, upper = problem.lower.astype(np.float64), problem.upper.astype(np.float64)
    for k, name in enumerate(problem.variables):
        if name in names and len(designs):
            values = designs[:, problem.family.parameter_names.index(name)]
            reach = 0.5 * np.abs(values)
            lower[k] = min(lower[k], float((values - reach).min()))
            upper[k] = max(upper[k], float((values + reach).max()))
    return replace(problem, lower=lower, upper=upper)
