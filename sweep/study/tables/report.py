"""[report]: figures and curves of the report."""

from __future__ import annotations

import re

from sweep.errors import nearest
from sweep.study.faults import Faults
from sweep.study.model import ReportSection
from sweep.study.reading import Reading
from sweep.study.tables.locus import Prescribed


def read(reading: Reading) -> None:
    """Read the table."""
    reading.section(ReportSection, "report")


def check(reading: Reading) -> None:
    """Report incomplete figures, and curves over what the study does not have."""
    report, known = reading.get(ReportSection), reading.family.parameter_names
    _check_figures(report, reading.faults)
    own = [name for t in ("design", "bodies", "loads") for name in reading.raw.get(t, {}) if name in known]
    _check_curves(report, [*reading.get(Prescribed).entries, *own], reading.faults)


def _check_figures(report: ReportSection, faults: Faults) -> None:
    for k, figure in enumerate(report.figures):
        for name in figure.required:
            if getattr(figure, name) is None:
                faults.missing(("report", "figures", k, name), str(type(figure).model_fields[name].description))
        if figure.file is not None and not re.fullmatch(r"[\w-]+\.svg", figure.file):
            faults.value(("report", "figures", k, "file"), figure.file, "letters, digits, - and _, ending in .svg")


def _check_curves(report: ReportSection, parameters: list[str], faults: Faults) -> None:
    for k, curve in enumerate(report.curves):
        for name in curve.required:
            if getattr(curve, name) is None:
                faults.missing(("report", "curves", k, name), str(type(curve).model_fields[name].description))
        for key, axis in (("x", curve.x), ("y", curve.y)):
            if axis is not None and axis not in parameters:
                allowed = f"one of {', '.join(parameters)}{nearest(axis, parameters)}"
                faults.value(("report", "curves", k, key), axis, allowed)
