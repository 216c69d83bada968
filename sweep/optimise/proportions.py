"""Starts from a global search over proportions: evolution strategies by the dozen, what is linear solved inside."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array
from sweep.families.chain import stages_of
from sweep.optimise.evolution import evolved
from sweep.optimise.linear import STUCK, Elimination
from sweep.optimise.problem import Problem
from sweep.optimise.starts import spread

SAMPLED = 1 << 17  # proportions per combination of signs, two in a hundred of which turn
BLOCK = 1 << 13
STRATEGIES = 8  # per start
RADIUS, GENERATIONS = 0.1, 100
SHORT = 0.05  # shortest length of a guide that is looked at, against the longest its crank may have
MIDDLE = Accuracy(target=1e-3)


class Proportions:
    """Places between 0 and 1 for what is not linear, and the designs that belong to them.

    Lengths of the guide stand on a logarithmic scale against its crank, which is the unit.  Instead of the offset
    between the stages the middle of the guide's input angles is varied, so that it stays while stage 1 changes.
    """

    def __init__(self, linear: Elimination, signs: dict[str, float]) -> None:
        problem = linear.problem
        self.linear, names = linear, problem.family.parameter_names
        number = linear.last
        self.base = problem.rows(problem.lower + 0.5 * problem.span, **signs)[0]
        at = [problem.variables.index(name) for name in linear.free]
        self.low, self.high = problem.lower[at].astype(np.float64), problem.upper[at].astype(np.float64)
        units = {p.name: p for p in problem.family.parameters}
        unit = problem.variables.index(f"a{number}")
        self.log = np.zeros(len(linear.free), dtype=np.bool_)
        for k, name in enumerate(linear.free):
            if units[name].unit == "angle" and self.high[k] - self.low[k] >= 2.0 * math.pi:
                self.low[k], self.high[k] = -math.pi, math.pi
            # A frame to the other side is the same guide, turned by half a turn.
            if name in (f"b{number}", f"c{number}", f"e{number}"):
                shortest = max(self.low[k], problem.upper[unit] * SHORT)
                self.low[k] = shortest / problem.upper[unit]
                self.high[k] /= max(problem.lower[unit], problem.upper[unit] * SHORT)
                self.log[k] = True
        self.columns = [names.index(name) for name in linear.free]
        self.base[names.index(f"a{number}")] = 1.0
        self.offset = names.index(f"offset{number}") if f"offset{number}" in linear.free else -1
        self.driver = stages_of(problem.family)[0].family

    def designs(self, places: Array) -> Array:
        """Designs (k, P) at places (k, n), with the point, line and scale still to be found."""
        values: Array = self.low + places * (self.high - self.low)
        low, wide = self.low[self.log], np.array([math.log(x) for x in self.high[self.log] / self.low[self.log]])
        # numpy's exponential depends on the processor, that of the C library does not
        grown = [math.exp(x) for x in (places[:, self.log] * wide).ravel()]
        values[:, self.log] = low * np.reshape(grown, (len(places), -1))
        designs = np.repeat(self.base[None, :], len(places), axis=0)
        designs[:, self.columns] = values
        if self.offset >= 0:
            upstream = np.ascontiguousarray(designs[:, : len(self.driver.parameters)])
            found = design_outputs(self.driver, upstream, ("psi_ext", "swing"), MIDDLE)
            middle = np.asarray(found["psi_ext"], np.float64) + 0.5 * np.asarray(found["swing"], np.float64)
            designs[:, self.offset] -= np.nan_to_num(middle)
        return designs

    def merit(self, places: Array) -> Array:
        """Least objective for these proportions, plus what missed limits cost (k,)."""
        return self.linear.merit(self.designs(places))[1]


def from_proportions(
    linear: Elimination,
    signs: Sequence[dict[str, float]],
    count: int,
    seed: int,
    stop: Callable[[], bool] = lambda: False,
) -> Array:
    """At most ``count`` diverse designs (k, P), each the end of an evolution strategy, in turn from every kind.

    Parameters
    ----------
    linear : the linear part of the problem
    signs : combinations of the parameters that are not varied; each has strategies of its own
    count : how many
    seed : of samples and strategies
    stop : true ends the strategies where they are
    """
    from scipy.stats import qmc

    share = -(-count // len(signs))
    kinds = []
    for number, chosen in enumerate(signs):
        own = Proportions(linear, chosen)
        place = qmc.Sobol(len(own.columns), seed=seed + number).random(SAMPLED)
        merit = np.concatenate([own.merit(block) for block in np.split(place, SAMPLED // BLOCK)])
        order = np.argsort(merit, kind="stable")
        order = order[merit[order] < STUCK]
        if not len(order):
            continue
        begin = place[order][spread(place[order], np.zeros(len(order), np.intp), STRATEGIES * share)]
        rng = np.random.default_rng(seed + number)
        place, merit = evolved(own.merit, begin, RADIUS, GENERATIONS, rng, stop)
        order = np.argsort(merit, kind="stable")[: len(merit) // 3 + 1]
        order = order[spread(place[order], np.zeros(len(order), np.intp), share)]
        designs = linear.merit(own.designs(place[order]))[0]
        kinds.append(_turned_into(linear.problem, designs[np.isfinite(designs).all(axis=1)]))
    rows = [kind[k] for k in range(share) for kind in kinds if k < len(kind)]
    return np.array(rows[:count]).reshape(-1, len(linear.problem.family.parameters))


def _turned_into(problem: Problem, designs: Array) -> Array:
    """Designs whose angles lie within their bounds, by whole turns."""
    out = designs.copy()
    for k, name in enumerate(problem.variables):
        column = problem.family.parameter_names.index(name)
        if problem.family.parameters[column].unit == "angle" and problem.span[k] >= 2.0 * math.pi:
            middle = problem.lower[k] + 0.5 * problem.span[k]
            out[:, column] -= 2.0 * math.pi * np.round((out[:, column] - middle) / (2.0 * math.pi))
    return out


def widened(problem: Problem, designs: Array, names: Sequence[str]) -> Problem:
    """The problem with the bounds of some variables widened so that the designs lie half their size within them."""
    lower, upper = problem.lower.astype(np.float64), problem.upper.astype(np.float64)
    for k, name in enumerate(problem.variables):
        if name in names and len(designs):
            values = designs[:, problem.family.parameter_names.index(name)]
            reach = 0.5 * np.abs(values)
            lower[k] = min(lower[k], float((values - reach).min()))
            upper[k] = max(upper[k], float((values + reach).max()))
    return replace(problem, lower=lower, upper=upper)
