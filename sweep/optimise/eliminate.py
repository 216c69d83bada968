"""Equations for limit positions eliminated: the same problem in coordinates in which they hold by construction."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from sweep.families.chain import Chain
from sweep.optimise.coordinates import LocusCoordinates
from sweep.optimise.problem import Problem
from sweep.synthesis.prescription import OnLocus

# The place on the locus is an angle without ends: a search that begins within one turn may leave it on either side.
PLACE_BOUNDS = (-math.pi, 3.0 * math.pi)


def on_locus(problem: Problem) -> Problem:
    """The problem on the locus of its first stage, or the problem itself where that has no equations to eliminate.

    Equations for swing (rssr) or stroke (rssp) and phi0 of the first stage become fixed coordinates, the place on the
    locus a variable; the links that follow keep their bounds as limits.  Where the rocker's length is fixed and e and g
    are not, the direction of (e, g) is the variable and both follow.

    Parameters
    ----------
    problem : in the parameters themselves
    """
    from sweep.study import Limit

    family = problem.family
    first = family.stages[0].family.name if isinstance(family, Chain) else family.name
    number = "1" if isinstance(family, Chain) else ""
    if problem.coordinates is not None or first not in ("rssr", "rssp"):
        return problem
    wanted = (f"swing{number}" if first == "rssr" else f"stroke{number}", f"phi0{number}")
    equations = {x.output: x.minimum for x in problem.limits if x.minimum is not None and x.minimum == x.maximum}
    if not all(name in equations for name in wanted):
        return problem
    bounds = {n: (float(x), float(y)) for n, x, y in zip(problem.variables, problem.lower, problem.upper, strict=True)}
    e, g, c = (f"{name}{number}" for name in "egc")
    sized = first == "rssr" and c in problem.fixed and e in bounds and g in bounds and bounds[e][0] >= 0.0
    coordinates = LocusCoordinates(OnLocus(first, number, "direction" if sized else "phi1"))
    places = {f"phi_ext{number}": PLACE_BOUNDS}
    if sized:
        ends = [math.atan2(y, x) for x in bounds[e] for y in bounds[g]]
        places[f"direction{number}"] = (min(ends), max(ends))
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
