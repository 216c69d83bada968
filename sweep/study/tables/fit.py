"""[fit]: the line that a guided point is fitted to."""

from __future__ import annotations

from sweep.errors import InputError
from sweep.study.limits import check_fitted_stroke
from sweep.study.model import FitSection
from sweep.study.reading import Reading
from sweep.synthesis.fit import LineFit


def check(reading: Reading) -> None:
    """Read the table, for the mechanism of the study."""
    reading.fields["fit"] = None
    if "fit" not in reading.data:
        return
    section, family, faults = reading.section(FitSection, "fit"), reading.family, reading.faults
    fit = LineFit(reading.quantity(section.stroke, "mm", ("fit", "stroke")), section.direction == "free")
    try:
        fit.parameters(family)
    except InputError as error:
        faults.value(("fit",), family.name, error.allowed)
        return
    if "optimise" in reading.data:
        check_fitted_stroke(fit, family, reading.raw.get("limits", {}), faults)
    reading.fields["fit"] = fit
