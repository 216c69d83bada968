"""Equations for limit positions eliminated: the same problem in coordinates in which they hold by construction."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from sweep.families.capabilities import LimitLocus
from sweep.families.chain import Chain, stages_of
from sweep.optimise.coordinates import LocusCoordinates
from sweep.optimise.problem import Problem
from sweep.synthesis.prescription import OnLocus

# The place on the locus is an angle without ends: a search that begins within one turn may leave it on either side.
PLACE_BOUNDS = (-math.pi, 3.0 * math.pi)


def on_locus(problem: Problem) -> Problem:
    """Return the problem on the locus of its first stage,
    or the problem itself where that has no equations to eliminate.

    Equations for swing (rssr) or stroke (rssp) and phi0 of the first stage become fixed coordinates, the place on the
    locus a variable; the links that follow keep their bounds as limits.  Where the rocker's length is fixed and e and g
    are not, the direction of (e, g) is the variable and both follow.

    Parameters
    ----------
    problem : in the parameters themselves
    """
    from sweep.study import Limit

    family = problem.family
    first = stages_of(family)[0].family
    number = "1" if isinstance(family, Chain) else ""
    locus = first.find(LimitLocus)
    if problem.coordinates is not None or locus is None:
        return problem
    wanted = (f"{locus.travel}{number}", f"phi0{number}")
    equations = {x.output: x.minimum for x in problem.limits if x.minimum is not None and x.minimum == x.maximum}
    if not all(name in equations for name in wanted):
        return problem
    bounds = {n: (float(x), float(y)) for n, x, y in zip(problem.variables, problem.lower, problem.upper, strict=True)}
    ends = _directions(problem, bounds, tuple(f"{name}{number}" for name in locus.sized))
    coordinates = LocusCoordinates(OnLocus(first.name, number, "phi1" if ends is None else "direction"))
    places = {f"phi_ext{number}": PLACE_BOUNDS}
    if ends is not None:
        places[f"direction{number}"] = ends
    held = {name: (float(x), float(x)) for name, x in problem.fixed.items()}
    links = [Limit(name, *(bounds | held)[name]) for name in coordinates.made]
    varied = {name: ends for name, ends in bounds.items() if name not in coordinates.made} | places
    fixed = {name: float(x) for name, x in problem.fixed.items() if name not in coordinates.made}
    return replace(
        problem,
        variables=tuple(varied),
        lower=np.array([low for low, _ in varied.values()]),
        upper=np.array([high for _, high in varied.values()]),
        fixed=fixed | {name: abs(float(equations[name] or 0.0)) for name in wanted},
        limits=(*(limit for limit in problem.limits if limit.output not in wanted), *links),
        coordinates=coordinates,
    )


def _directions(
    problem: Problem, bounds: Mapping[str, tuple[float, float]], sized: tuple[str, ...]
) -> tuple[float, float] | None:
    """Return the least and greatest direction of the offsets (e,
    g) where the rocker's length c alone is fixed, else None.
    """
    if not sized:
        return None
    c, e, g = sized
    if c not in problem.fixed or e not in bounds or g not in bounds or bounds[e][0] < 0.0:
        return None
    ends = [math.atan2(y, x) for x in bounds[e] for y in bounds[g]]
    return min(ends), max(ends)
