"""Proportions as places between 0 and 1."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array
from sweep.families.chain import stages_of
from sweep.optimise.problem.statement import Problem
from sweep.optimise.starts.linear import Elimination

Index = NDArray[np.intp]

SHORT = 0.15  # shortest length of a guide that the search begins with, against the longest its crank may have
MIDDLE = Accuracy(target=1e-3)


class Proportions:
    """Places between 0 and 1 for what is not linear, and the designs that belong to them.

    Lengths of the guide stand on a logarithmic scale against its crank, which is the unit, and lengths of stage 1 that
    cannot vanish on a logarithmic scale too.

    Parameters
    ----------
    linear : the linear part of the problem
    signs : combinations of the parameters that are not varied; each design has the number of one of them, its kind
    """

    def __init__(self, linear: Elimination, signs: Sequence[dict[str, float]]) -> None:
        problem = linear.problem
        self.linear, names = linear, problem.family.parameter_names
        number = linear.last
        centre = problem.lower + 0.5 * problem.span
        self.bases = np.array([problem.rows(centre, **choice)[0] for choice in signs])
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
            elif units[name].unit == "length" and self.low[k] > 0.0:
                self.log[k] = True
        self.wide = np.zeros(len(linear.free))
        self.wide[self.log] = [math.log(x) for x in self.high[self.log] / self.low[self.log]]
        self.columns = [names.index(name) for name in linear.free]
        self.bases[:, names.index(linear.links[0])] = 1.0
        self.offset = names.index(f"offset{number}") if f"offset{number}" in linear.free else -1
        self.driver = stages_of(problem.family)[0].family

    def placed(self, places: Array, kinds: Index) -> Array:
        """Return designs (k, P) at places (k, n), of kinds (k,), with the point, line and scale still to be found."""
        values: Array = self.low + places * (self.high - self.low)
        # numpy's exponential depends on the processor, that of the C library does not
        grown = [math.exp(x) for x in (places[:, self.log] * self.wide[self.log]).ravel().tolist()]
        values[:, self.log] = self.low[self.log] * np.reshape(grown, (len(places), int(self.log.sum())))
        designs = self.bases[kinds]
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
