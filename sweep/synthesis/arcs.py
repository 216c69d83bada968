"""Admissible arcs: the crank angles phi1 for which a locus has a point that keeps the side condition."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kernels import synthesis as kernels
from kernels.synthesis import acceptance
from sweep.errors import InputError
from sweep.synthesis.locus import TWO_PI, locus


def admissible_arcs(family: str, requirement: Mapping[str, float]) -> list[tuple[float, float]]:
    """Arcs of phi1 on which test (i), the side condition, holds; equations (4) and (10) of docs/synthesis.md.

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
        for a missing or misspelt column or a bad number.
    """
    if "phi1" in requirement:
        raise InputError("phi1", requirement["phi1"], "no phi1: its arcs are what is asked for", "requirement")
    way = locus(family, (*requirement, "phi1"))
    row = way.read({**requirement, "phi1": 0.0})
    ends = np.empty((1, 8 if family == "rssr" else 4))
    (kernels.rssr_arc_ends if family == "rssr" else kernels.rssp_arc_ends)(row, ends)
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
