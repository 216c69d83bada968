"""[tolerance]: how far the lengths and angles of a mechanism that is made may be off."""

from __future__ import annotations

from pydantic import Field

from sweep.families.base import Family
from sweep.quantities.limits import Limit
from sweep.study.file import Faults, StudyFile
from sweep.study.section import Section
from sweep.study.study import Tolerance


class ToleranceSection(Section):
    """Table [tolerance]."""

    lengths: str | None = Field(None, description='a length as a text, as "0.02 mm"')
    angles: str | None = Field(None, description='an angle as a text, as "0.05 deg"')
    robust: str | None = Field(None, description='a share as a text, as "95 %"')


def read_tolerance(section: ToleranceSection, file: StudyFile) -> Tolerance | None:
    """Read the tolerances of the mechanisms that are made; None where the file gives none."""
    if "tolerance" not in file:
        return None
    if "optimise" not in file:
        file.faults.missing(("optimise",), "a table [optimise], as [tolerance] is about the optimum")
    if section.lengths is None and section.angles is None:
        needed = 'a length as "0.02 mm"; or angles, as "0.05 deg"'
        file.faults.missing(("tolerance", "lengths"), needed, instead="angles")
    lengths = file.quantity(section.lengths, "mm", ("tolerance", "lengths"))
    angles = file.quantity(section.angles, "rad", ("tolerance", "angles"))
    share = None if section.robust is None else file.share(section.robust, ("tolerance", "robust"))
    return Tolerance(lengths or 0.0, angles or 0.0, share)


def check_tolerance(tolerance: Tolerance | None, family: Family, limits: tuple[Limit, ...], faults: Faults) -> None:
    """Report tolerances that change nothing, and a robust search for what no made mechanism can keep."""
    if tolerance is None:
        return
    for key, unit, size in (("lengths", "length", tolerance.lengths), ("angles", "angle", tolerance.angles)):
        if size > 0.0 and not any(p.unit == unit and p.choices is None for p in family.parameters):
            faults.value(("tolerance", key), size, f"nothing: {family.name} has no {key} that could deviate")
    roomy = [x.output for x in limits if x.minimum != x.maximum]
    equal = [x.output for x in limits if x.minimum is not None and x.minimum == x.maximum and x.output not in roomy]
    if tolerance.robust is not None and equal:
        words = 'limits with room, as swing = "40 +- 0.2 deg": no mechanism that is made keeps an equation'
        faults.value(("tolerance", "robust"), ", ".join(equal), words)
