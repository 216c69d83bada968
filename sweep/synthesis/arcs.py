"""Admissible arcs: the crank angles phi1 for which a locus has a point that keeps the side condition."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kernels.synthesis import acceptance
from sweep.errors import InputError
from sweep.synthesis.locus import LOCI, TWO_PI, locus


def admissible_arcs(family: str, requirement: Mapping[str, float]) -> list[tuple[float, float]]:
    """Return arcs of phi1 on which test (i), the side condition, holds; equations (4) and (10) of docs/synthesis.md.

    Parameters
    ----------
    family : "rssr" or "rssp"
    requirement : the columns of the locus by phi1, without phi1; one number each [one length unit, rad]

    Returns
    -------
    list of (from, to)
        open intervals in ascending order, 0 <= from < 2 pi, from < to <= from + 2 pi; empty if there are none

    Raises
    ------
    InputError
        for a missing or misspelt column or a bad number, or a requirement by direction, whose arcs are not known.
    """
    if "phi1" in requirement:
        raise InputError("phi1", requirement["phi1"], "no phi1: its arcs are what is asked for", "requirement")
    way = locus(family, (*requirement, "phi1"))
    row = way.read({**requirement, "phi1": 0.0})
    if way.arc_ends is None:
        known = [other for other in LOCI if other.family == way.family and other.arc_ends is not None]
        allowed = "; or ".join(", ".join(n for n in other.parameter_names if n != "phi1") for other in known)
        raise InputError("columns", ", ".join(requirement), allowed, "requirement")
    ends = way.arc_ends(row)
    marks = np.unique(ends[np.isfinite(ends)])
    following = np.append(marks[1:], marks[0] + TWO_PI)
    middles = np.repeat(row, marks.size, axis=0)
    middles[:, way.parameter_names.index("phi1")] = 0.5 * (marks + following)
    failed = way.solve(middles).failed
    inside = (failed != acceptance.SIDE) & (failed != acceptance.NO_POINT)
    arcs: list[tuple[float, float]] = []
    for start, end, good in zip(marks.tolist(), following.tolist(), inside.tolist(), strict=True):
        if good and arcs and arcs[-1][1] == start:
            arcs[-1] = (arcs[-1][0], end)
        elif good:
            arcs.append((start, end))
    if len(arcs) > 1 and arcs[-1][1] == arcs[0][0] + TWO_PI:
        arcs[-1] = (arcs[-1][0], arcs[0][1] + TWO_PI)
        arcs.pop(0)
    return arcs
