"""[fit]: the line that a guided point is fitted to."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from sweep.errors import InputError
from sweep.families.base import Family
from sweep.families.chain import Chain
from sweep.study.file import Faults, Section, Size, StudyFile
from sweep.synthesis.fit import LineFit


class FitSection(Section):
    """Table [fit]."""

    stroke: Size | None = Field(None, description='a length as a text, as "24.5 mm"')
    direction: Literal["free", "given"] = Field("free", description='"free" or "given"')


def read_fit(section: FitSection, file: StudyFile, family: Family) -> LineFit | None:
    """Read the fit of the mechanism's guided point; None where the file asks for none."""
    if "fit" not in file:
        return None
    fit = LineFit(section.stroke, section.direction == "free")
    try:
        fit.parameters(family)
    except InputError as error:
        file.faults.value(("fit",), family.name, error.allowed)
        return None
    if "optimise" in file and fit.stroke is not None:
        _check_stroke(fit.stroke, family, file.free_table("limits") or {}, file.faults)
    return fit


def _check_stroke(stroke: float, family: Family, limits: dict[str, object], faults: Faults) -> None:
    """Report an optimum without a bound on its stroke: [fit] scales the designs of the sweep, not of the search."""
    names = ("stroke", f"stroke{len(family.stages)}") if isinstance(family, Chain) else ("stroke",)
    if not any(name in limits for name in names):
        words = f'{{ min = {stroke * 0.999:g}, max = {stroke * 1.001:g}, unit = "mm" }}'
        faults.missing(("limits", "stroke"), f"bounds near fit.stroke that [optimise] must keep, as {words}")
