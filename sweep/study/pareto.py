"""[pareto]: a second output and the bounds on it, each given once, in its unit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, cast

from sweep.errors import InputError
from sweep.families.base import Family, Output, Parameter, Unit
from sweep.quantities.names import without_minus
from sweep.study.design import read_entry
from sweep.study.faults import Faults, Key
from sweep.study.limits import read_output_name
from sweep.study.model import ParetoSection
from sweep.study.space import Axis
from sweep.study.study import ParetoSettings

MOST_BOUNDS = 64
SIDES = ("at_most", "at_least")


def read_pareto(
    section: ParetoSection,
    raw: Mapping[str, Any],
    family: Family,
    objective: str | None,
    time_budget: float | None,
    faults: Faults,
) -> ParetoSettings | None:
    """Return the settings of the front, or None if something is faulty (all faults are reported).

    Parameters
    ----------
    section, raw : the table as it was read, and as it stands in the file
    family : with the effects that the second output calls for
    objective : the output that is minimised
    time_budget : read from the section [s]
    """
    given = [side for side in SIDES if side in raw]
    if len(given) == 2:
        faults.value(("pareto", "at_least"), raw["at_least"], "either at_most or at_least, not both")
    elif not given:
        faults.missing(("pareto", "at_most"), "bounds on the output; or at_least", instead="at_least")
    if section.output is None:
        return None
    place: Key = ("pareto", "output")
    output = read_output_name(family, section.output, place, faults)
    if output is None or len(given) != 1:
        return None
    if output.name in (objective, without_minus(objective or "")):
        faults.value(place, output.name, "another output than the objective")
        return None
    key: Key = ("pareto", given[0])
    bounds = _bounds(output, raw[given[0]], key, faults)
    if bounds is None or not _searchable(family, output, bounds, given[0], faults):
        return None
    if section.points is not None and not 2 <= len(set(bounds)) < section.points:
        some = f"more than the {len(set(bounds))} bounds given, of which there must be two or more"
        faults.value(("pareto", "points"), section.points, some)
        return None
    return ParetoSettings(output.name, bounds, given[0] == "at_least", section.starts, time_budget, section.points)


def _bounds(output: Output, raw: object, key: Key, faults: Faults) -> tuple[float, ...] | None:
    # Bounds are written as the values of a parameter are, in any unit that an output can have.
    word = cast(Unit, "angle" if output.unit == "rad" else output.unit)
    entry = read_entry(Parameter(output.name, word, output.text), raw, key, faults, sampled=False)
    if entry is None:
        return None
    bounds = (entry,) if not isinstance(entry, Axis) or entry.values is None else tuple(entry.values.tolist())
    if len(bounds) > MOST_BOUNDS:
        faults.value(key, f"{len(bounds)} bounds", f"at most {MOST_BOUNDS}: each is a search of its own")
        return None
    return tuple(float(bound) for bound in bounds)


def _searchable(family: Family, output: Output, bounds: tuple[float, ...], side: str, faults: Faults) -> bool:
    """Return whether the optimiser can hold such bounds."""
    from sweep.reductions.measures import measure

    try:
        found = measure(family, output.name)
    except InputError as error:
        faults.value(("pareto", "output"), output.name, error.allowed)
        return False
    if found.inner == "rotatable" or output.jumps:
        faults.value(("pareto", "output"), output.name, "a quantity that changes steadily")
        return False
    if found.inner in ("pressure", "transmission") and not all(0.0 < bound < 0.5 * math.pi for bound in bounds):
        faults.value(("pareto", side), list(bounds), "angles between 0 and 90 deg")
        return False
    return True
