"""Elimination of equations for limit positions: the problem in coordinates in which they hold by construction.

The return to the parameters serves near singular places of these coordinates.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array, Family
from sweep.families.capabilities import LimitLocus
from sweep.optimise.problem.statement import Problem
from sweep.quantities.limits import tightest
from sweep.study import Limit
from sweep.synthesis.locus import OnLocus

# The place on the locus is a periodic angle: a search that starts within one turn may leave it on either side.
PLACE_BOUNDS = (-math.pi, 3.0 * math.pi)
WHOLE_TURN = 2.0 * math.pi * (1.0 - 1e-9)
SHORTEST = 0.1  # lower bound of a link without a lower limit, relative to its present length


EXACT = Accuracy(target=1e-12)


@dataclass(frozen=True)
class LocusCoordinates:
    """Coordinates in place of links: swing or stroke (by magnitude), phi0 and the place on the locus are variables.

    The links of the stage follow (docs/synthesis.md), so a prescribed swing, stroke or phi0 holds exactly during the
    search.  The branch is fixed by the start and gives the sign of the swing.
    """

    stage: OnLocus

    @cached_property
    def given(self) -> tuple[str, ...]:
        """Prescribed design outputs, with the number of the stage."""
        return tuple(p.name for p in self.stage.prescribed)

    @cached_property
    def made(self) -> tuple[str, ...]:
        """Links that follow from the coordinates."""
        return tuple(name for name in self.stage.made if name != self._branch)

    @property
    def periodic(self) -> tuple[str, ...]:
        """Name of the place on the locus."""
        return (f"phi_ext{self.stage.number}",)

    @cached_property
    def _inputs(self) -> tuple[str, ...]:
        return tuple(self.stage.outside(name) for name in self.stage.way.parameter_names)

    @property
    def _branch(self) -> str:
        return f"branch{self.stage.number}"

    def make(self, columns: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the links that give the prescribed outputs; nan if the locus has no mechanism there."""
        matrix = np.column_stack([columns[name] for name in self._inputs])
        matrix[:, 0] *= -columns[self._branch].real
        links = self.stage.links_of(self.stage.way.solve(matrix))
        return {name: links[name] for name in self.made}

    def read(self, family: Family, designs: Array) -> Mapping[str, Array]:
        """Return the limit positions of designs; nan if they do not exist."""
        number, direction = self.stage.number, f"direction{self.stage.number}"
        names = [name for name in self.given if name != direction]
        outputs = design_outputs(family, designs, names, EXACT)
        coordinates = {name: np.asarray(outputs[name], np.float64) for name in names}
        coordinates[names[0]] = np.abs(coordinates[names[0]])
        if direction in self.given:
            e, g = (designs[:, family.parameter_names.index(f"{name}{number}")] for name in ("e", "g"))
            coordinates[direction] = np.arctan2(g, e)
        return coordinates


def on_locus(problem: Problem) -> Problem:
    """Return the problem on the locus of its first stage.

    A problem without equations to eliminate is returned unchanged.

    Equations for swing (rssr) or stroke (rssp) and phi0 of the first stage become fixed coordinates, the place on the
    locus a variable; the links that follow keep their bounds as limits.  If the rocker's length is fixed and e and g
    are not, the direction of (e, g) is the variable and both follow.

    Parameters
    ----------
    problem : problem in the parameters themselves
    """
    family = problem.family
    stage, number = family.stages[0].family, family.stages[0].tail
    locus = stage.find(LimitLocus)
    if problem.coordinates is not None or locus is None:
        return problem
    eliminated = (f"{locus.travel}{number}", f"phi0{number}")
    equations = {x.output: x.minimum for x in problem.limits if x.minimum is not None and x.minimum == x.maximum}
    if not all(name in equations for name in eliminated):
        return problem
    bounds = {n: (float(x), float(y)) for n, x, y in zip(problem.variables, problem.lower, problem.upper, strict=True)}
    directions = _direction_bounds(problem, bounds, tuple(f"{name}{number}" for name in locus.sized))
    coordinates = LocusCoordinates(OnLocus(stage.name, number, "phi1" if directions is None else "direction"))
    locus_bounds = {f"phi_ext{number}": PLACE_BOUNDS}
    if directions is not None:
        locus_bounds[f"direction{number}"] = directions
    fixed_bounds = {name: (float(x), float(x)) for name, x in problem.fixed.items()}
    link_limits = [Limit(name, *(bounds | fixed_bounds)[name]) for name in coordinates.made]
    varied = {name: interval for name, interval in bounds.items() if name not in coordinates.made} | locus_bounds
    fixed = {name: float(x) for name, x in problem.fixed.items() if name not in coordinates.made}
    return replace(
        problem,
        variables=tuple(varied),
        lower=np.array([low for low, _ in varied.values()]),
        upper=np.array([high for _, high in varied.values()]),
        fixed=fixed | {name: abs(float(equations[name] or 0.0)) for name in eliminated},
        limits=(*(limit for limit in problem.limits if limit.output not in eliminated), *link_limits),
        coordinates=coordinates,
    )


def in_parameters(problem: Problem, design: Array) -> Problem | None:
    """Return a problem on the locus in the parameters themselves.

    The coordinates become limits, equations if they are fixed, and the links that follow become variables.  None if the
    problem is already in the parameters, if the place on the locus is not free, or if limits leave a link no interval.

    Parameters
    ----------
    problem : problem of :func:`on_locus`, or of a study with [locus]
    design : (P,) present design; links without limits may grow and shrink by the length of its longest link
    """
    coordinates = problem.coordinates
    if not isinstance(coordinates, LocusCoordinates):
        return None
    # Swing or stroke and phi0; place on the locus.
    eliminated, places = coordinates.given[:2], coordinates.given[2:]
    bounds = {n: (float(x), float(y)) for n, x, y in zip(problem.variables, problem.lower, problem.upper, strict=True)}
    if any(n not in bounds or (n in coordinates.periodic and np.ptp(bounds[n]) < WHOLE_TURN) for n in places):
        return None
    intervals = {name: bounds[name] for name in problem.variables if name not in coordinates.given}
    intervals |= {name: _link_interval(problem, design, coordinates.made, name) for name in coordinates.made}
    if any(low > high for low, high in intervals.values()):
        return None
    varied = {name: (low, high) for name, (low, high) in intervals.items() if low < high}
    given_bounds = {name: (float(x), float(x)) for name, x in problem.fixed.items()} | bounds
    fixed = {name: x for name, x in problem.fixed.items() if name not in eliminated}
    return replace(
        problem,
        variables=tuple(varied),
        lower=np.array([low for low, _ in varied.values()]),
        upper=np.array([high for _, high in varied.values()]),
        fixed=fixed | {name: low for name, (low, high) in intervals.items() if low == high},
        limits=(
            *(limit for limit in problem.limits if limit.output not in coordinates.made),
            *(Limit(name, *given_bounds[name]) for name in eliminated),
        ),
        coordinates=None,
    )


def _link_interval(problem: Problem, design: Array, links: tuple[str, ...], name: str) -> tuple[float, float]:
    """Return the bounds of a link that follows: its limits, otherwise an interval around its present length."""
    names = problem.family.parameter_names
    longest = float(np.abs([design[names.index(link)] for link in links]).max())
    length, parameter = float(design[names.index(name)]), problem.family.parameters[names.index(name)]
    low, high = tightest(problem.limits, name)
    shortest = SHORTEST * length if parameter.positive else length - longest
    return shortest if math.isinf(low) else low, length + longest if math.isinf(high) else high


def _direction_bounds(
    problem: Problem, bounds: Mapping[str, tuple[float, float]], sized: tuple[str, ...]
) -> tuple[float, float] | None:
    """Return the least and greatest direction of the offsets (e, g).

    The direction is a variable if only the rocker's length c is fixed; otherwise None.
    """
    if not sized:
        return None
    c, e, g = sized
    if c not in problem.fixed or e not in bounds or g not in bounds or bounds[e][0] < 0.0:
        return None
    angles = [math.atan2(y, x) for x in bounds[e] for y in bounds[g]]
    return min(angles), max(angles)
