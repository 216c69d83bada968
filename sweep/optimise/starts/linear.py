"""Linear variables of a guide behind a crank-rocker, eliminated: coupler point, line and scale, for given proportions.

With B the crank pin of the guide and d the direction of its coupler, both complex, and one length as unit,

    s + i dev = z1 B + z2 d - i h,      z1 = scale e^{-i lam},  z2 = scale (xi + i eta) e^{-i lam}

so displacement, deviation and all their derivatives are linear in five numbers.  The smallest maximum acceleration,
with a straightness and a stroke prescribed, is a small linear program, which descents solve after every step
(:mod:`kernels.descent`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from statistics import NormalDist

import numpy as np

from sweep.families.base import Array
from sweep.families.capabilities import GuidedPoint
from sweep.families.chain import driven_guide
from sweep.optimise.manufacture.tolerance import SIGMAS, tolerances_of
from sweep.optimise.problem.statement import Problem
from sweep.study import Tolerance

POSES = 64  # poses per turn in the linear program
SMALLEST = 1e-9  # smallest scale of a guide
BOTH = 4.0  # a deviation can violate its limit on either side, and in two nearly independent places
TURN: Array = np.arange(POSES, dtype=np.float64) * (2.0 * np.pi / POSES)
NEEDED = (
    "a chain of rssr and guide without a window, whose guide's crank, point and line vary ([fit]), with a lower limit "
    "of the stroke and max_abs_ds, max_abs_d2s or max_abs_dev to be made small"
)


@dataclass(frozen=True)
class Elimination:
    """Linear part of a problem.

    ``wanted`` is the output along the line to be minimised (that across the line if ``straight``), ``bound`` the
    largest deviation or None, ``stroke`` the least stroke, ``driver`` the output of the crank-rocker.  ``sigma``, (P,),
    are standard deviations of the dimensions; the limits on deviation and stroke get a margin of ``level`` of them.
    """

    problem: Problem
    guide: GuidedPoint
    last: str
    driver: str
    wanted: str
    straight: bool
    bound: float | None
    stroke: float
    sigma: Array | None = None
    level: float = 0.0

    @cached_property
    def free(self) -> tuple[str, ...]:
        """Variables that remain: all except point, line and one length of the guide, which is its unit."""
        out = {f"{name}{self.last}" for name in (*self.guide.fitted, self.guide.links[0])}
        return tuple(name for name in self.problem.variables if name not in out)

    @cached_property
    def links(self) -> tuple[str, ...]:
        """Lengths of the guide that are proportional to its scale."""
        return tuple(f"{name}{self.last}" for name in self.guide.links)

    @cached_property
    def position(self) -> str:
        """Name of the output along the line."""
        return next(iter(self.guide.across))

    def column(self, name: str) -> int:
        """Return the column of a parameter of the guide."""
        return self.problem.family.parameter_names.index(f"{name}{self.last}")

    def finished(self, designs: Array, x: Array) -> Array:
        """Return designs (n, P) with the point, line and scale given by the unknowns (n, 5)."""
        scale: Array = np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2)
        scale[scale < SMALLEST] = np.nan  # a guide of size zero is no solution, and its poses are undefined
        along, across, line, offset = (
            self.column(n) for n in (*self.guide.arms, self.guide.direction, self.guide.offset)
        )
        ratio = designs[:, self.column(self.guide.links[1])] / scale
        out = designs.copy()
        for name in self.guide.links:
            out[:, self.column(name)] *= scale
        # numpy's arctan2 depends on the processor, the C library's does not
        lam = np.array([math.atan2(-y, x) for x, y in x[:, :2].tolist()])
        out[:, along] = (x[:, 2] * x[:, 0] + x[:, 3] * x[:, 1]) * ratio
        out[:, across] = (x[:, 3] * x[:, 0] - x[:, 2] * x[:, 1]) * ratio
        out[:, offset], out[:, line] = x[:, 4], lam
        return out


def elimination(problem: Problem, tolerance: Tolerance | None = None) -> Elimination | None:
    """Return the linear part of a problem, or None if it has none.

    With a ``tolerance`` that asks for a share, the limits on deviation and stroke get margins.
    """
    stages = driven_guide(problem.family)
    if stages is None or problem.window is not None or problem.coordinates is not None:
        return None
    first, last = stages[0], str(stages[1].number)
    guide = stages[1].family.find(GuidedPoint)
    if guide is None or not {f"{name}{last}" for name in (*guide.fitted, guide.links[0])} <= set(problem.variables):
        return None
    dev = next(iter(guide.across.values()))
    goals = {f"max_abs_{name}": name for name in list(guide.across)[1:]} | {f"max_abs_{dev}": next(iter(guide.across))}
    limits = {limit.output: limit for limit in problem.limits}
    stroke, deviation = limits.get("stroke"), limits.get(f"max_abs_{dev}")
    if problem.objective not in goals or stroke is None or not stroke.minimum:
        return None
    bound = None if deviation is None else deviation.maximum
    share = None if tolerance is None else tolerance.robust
    sigma, level = None, 0.0
    if tolerance is not None and share is not None:
        design = np.array([problem.fixed.get(name, math.nan) for name in problem.family.parameter_names])
        sigma = tolerances_of(problem.family, design, tolerance) / SIGMAS
        level = NormalDist().inv_cdf(1.0 - (1.0 - share) / BOTH)
    driver = f"{first.family.position}{first.number}"
    return Elimination(
        problem, guide, last, driver, goals[problem.objective], problem.objective == f"max_abs_{dev}", bound,
        float(stroke.minimum), sigma, level,
    )  # fmt: skip


def within_turn(problem: Problem, designs: Array) -> Array:
    """Return the designs with whole turns added to angles that put them within their bounds, if possible."""
    out = designs.copy()
    for k, name in enumerate(problem.variables):
        column = problem.family.parameter_names.index(name)
        if problem.family.parameters[column].unit == "angle":
            middle = problem.lower[k] + 0.5 * problem.span[k]
            out[:, column] -= 2.0 * math.pi * np.round((out[:, column] - middle) / (2.0 * math.pi))
    return out


def widened(problem: Problem, designs: Array, names: Sequence[str]) -> Problem:
    """Return the problem with bounds that contain the designs with a distance of half their size."""
    lower, upper = problem.lower.astype(np.float64), problem.upper.astype(np.float64)
    for k, name in enumerate(problem.variables):
        if name in names and len(designs):
            values = designs[:, problem.family.parameter_names.index(name)]
            half_size = 0.5 * np.abs(values)
            lower[k] = min(lower[k], float((values - half_size).min()))
            upper[k] = max(upper[k], float((values + half_size).max()))
    return replace(problem, lower=lower, upper=upper)
