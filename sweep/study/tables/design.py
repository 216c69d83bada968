"""[design] and [reference]: the designs of the study, and one design to compare them with."""

from __future__ import annotations

from sweep.study.design import check_varied, read_reference, read_space
from sweep.study.model import OptimiseSection, ReferenceSection
from sweep.study.reading import Reading
from sweep.study.tables.bodies import Besides, home
from sweep.study.tables.locus import Prescribed
from sweep.study.tables.scene import Given


def read(reading: Reading) -> None:
    """Read [design]."""
    reading.free_table("design")


def read_compared(reading: Reading) -> None:
    """Read [reference]."""
    reading.section(ReferenceSection, "reference")


def check(reading: Reading) -> None:
    """Find the space of the designs."""
    family, faults, besides = reading.family, reading.faults, reading.get(Besides)
    raw = reading.raw.get("design")
    prescribed, given = reading.get(Prescribed), reading.get(Given).values
    fit, locus = reading.fields["fit"], reading.fields["locus"]
    fitted = () if fit is None else fit.parameters(family)
    space = None
    if raw is not None:
        # What no wanted effect takes describes the machine all the same, and is left alone.
        raw = raw | {name: entry for name, entry in besides.raw.items() if name in family.parameter_names}
        space = read_space(family, raw, faults, fitted, given, prescribed.made, prescribed.entries, _tables(reading))
    varied = locus is None or reading.get(OptimiseSection).variables != "parameters"
    if "optimise" in reading.data and space is not None and fit is None and varied:
        check_varied(family, space, raw or {}, faults)
    if space is not None:
        # The inputs of effects describe the scene: the reference design has the same unless it says otherwise.
        own = (*reading.mechanism.parameter_names, *prescribed.entries)
        reading.put(Given(given | {name: x for name, x in space.fixed.items() if name not in own}))
    reading.fields["space"] = space


def _tables(reading: Reading) -> dict[str, str]:
    """Return the tables in which inputs of effects stand, or should stand;
    a name that is left out belongs to [design].
    """
    bare, full, found = reading.mechanism, reading.family, reading.get(Besides).tables
    added = [name for name in full.parameter_names if name not in bare.parameter_names]
    homes = {name: home(bare, name) for name in added}
    return {name: found.get(name, table) for name, table in homes.items() if name not in reading.raw.get("design", {})}


def check_compared(reading: Reading) -> None:
    """Find the reference design."""
    design, given = reading.get(ReferenceSection).design, reading.get(Given).values
    found = None if design is None else read_reference(reading.family, design, reading.faults, given)
    reading.fields["reference"] = found
