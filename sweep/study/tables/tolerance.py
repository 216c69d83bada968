"""[tolerance]: how far the lengths and angles of a mechanism that is made may be off."""

from __future__ import annotations

from sweep.study.model import ToleranceSection
from sweep.study.reading import Reading
from sweep.study.study import Tolerance


def read(reading: Reading) -> None:
    """Read the table."""
    section, faults = reading.section(ToleranceSection, "tolerance"), reading.faults
    reading.fields["tolerance"] = None
    if "tolerance" not in reading.data:
        return
    if "optimise" not in reading.data:
        faults.missing(("optimise",), "a table [optimise], as [tolerance] is about the optimum")
    if section.lengths is None and section.angles is None:
        faults.missing(("tolerance", "lengths"), 'a length as "0.02 mm"; or angles, as "0.05 deg"', instead="angles")
    lengths = reading.quantity(section.lengths, "mm", ("tolerance", "lengths"))
    angles = reading.quantity(section.angles, "rad", ("tolerance", "angles"))
    share = None if section.robust is None else reading.share(section.robust, ("tolerance", "robust"))
    reading.fields["tolerance"] = Tolerance(lengths or 0.0, angles or 0.0, share)


def check(reading: Reading) -> None:
    """Report tolerances that change nothing, and a robust search for what no made mechanism can keep."""
    tolerance, family, faults = reading.fields["tolerance"], reading.family, reading.faults
    if tolerance is None:
        return
    for key, unit, size in (("lengths", "length", tolerance.lengths), ("angles", "angle", tolerance.angles)):
        if size > 0.0 and not any(p.unit == unit and p.choices is None for p in family.parameters):
            faults.value(("tolerance", key), size, f"nothing: {family.name} has no {key} that could deviate")
    equal = [x.output for x in reading.fields["limits"] if x.minimum is not None and x.minimum == x.maximum]
    if tolerance.robust is not None and equal:
        words = 'limits with room, as swing = "40 +- 0.2 deg": no mechanism that is made keeps an equation'
        faults.value(("tolerance", "robust"), ", ".join(equal), words)
