"""The size of a mechanism: the largest of its lengths, offsets by magnitude; what a box has to hold at least."""

from __future__ import annotations

import numpy as np

from sweep.costs import nanoseconds
from sweep.effects import input_names
from sweep.families.base import Accuracy, Array, Columns, Family, Output, Step, Work
from sweep.families.members import Machine

SIZE = Output("size", "length", "largest length of the mechanism, offsets by magnitude")


def lengths(family: Family) -> tuple[str, ...]:
    """Return parameters that are lengths of the mechanism itself, not of bodies and bearings that effects ask for."""
    others = set(input_names(family))
    if isinstance(family, Machine):
        others |= {p.name for relation in family.relations for p in relation.parameters}
    return tuple(p.name for p in family.parameters if p.unit == "length" and p.name not in others)


def size_step(family: Family) -> Step | None:
    """Return the route to ``size``; None where a family has ratios of lengths only."""
    names = lengths(family)
    if not names:
        return None
    columns = [family.parameter_names.index(name) for name in names]

    def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
        n = len(designs)
        found: Columns = {name: np.abs(designs[:, columns]).max(axis=1) for name in wanted & {SIZE.name}}
        return found | {f"err_{SIZE.name}": np.zeros(n), "status": np.zeros(n, np.uint8)}

    return Step("size", (SIZE,), run, work=Work.PARAMETERS, cost=lambda accuracy: nanoseconds("work", "size"))
