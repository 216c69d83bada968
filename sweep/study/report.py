"""[study], [report], [output] and [budget]: question, figures, stored results, and limits on cost."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import Field

from sweep.errors import choices
from sweep.families.base import Family
from sweep.study.file import Bytes, Number, Seconds, Section, StudyFile, holds

Pair = Annotated[list[Number], Field(min_length=2, max_length=2)]


class StudySection(Section):
    """Table [study]."""

    required = ("name",)
    name: str | None = holds(
        "a plain word of a-z, 0-9 and '-', 64 letters at most", pattern="^[a-z0-9][a-z0-9-]*$", max_length=64
    )
    title: str = holds("a text", "")
    question: str = holds("a text", "")
    taken: list[str] = holds("filled in: which designs come from other studies, with their hash", [])


class CurveTable(Section):
    """Table ``report.curves``."""

    required = ("label", "x", "y", "points")
    label: str | None = holds("a text")
    x: str | None = holds("the name of a swept parameter")
    y: str | None = holds("the name of a swept parameter")
    points: list[Pair] | None = holds("a list of two or more points [x, y] in the units of the two axes", min_length=2)


class FigureTable(Section):
    """Table ``report.figures``."""

    required = ("file", "title", "caption")
    file: str | None = holds("the name of an SVG file without a folder")
    title: str | None = holds("a text")
    caption: str | None = holds("a text")


class ReportSection(Section):
    """Table [report]."""

    curves: list[CurveTable] = holds('a list of { label = "...", x = "k", y = "a", points = [[1, 1], [9, 9]] }', [])
    figures: list[FigureTable] = holds('a list of { file = "atlas.svg", title = "...", caption = "..." }', [])


def check_report(report: ReportSection, file: StudyFile, family: Family, prescribed: Iterable[str]) -> None:
    """Report figures with a folder in their names, and curves over parameters that the study does not have.

    ``prescribed`` are the outputs that [locus] prescribes.
    """
    faults, names = file.faults, family.parameter_names
    given = [name for table in ("design", "bodies", "loads") for name in file.free_table(table) or ()]
    parameters = [*prescribed, *(name for name in given if name in names)]
    for k, figure in enumerate(report.figures):
        if figure.file is not None and not re.fullmatch(r"[\w-]+\.svg", figure.file):
            faults.value(("report", "figures", k, "file"), figure.file, "letters, digits, - and _, ending in .svg")
    for k, curve in enumerate(report.curves):
        for key, axis in (("x", curve.x), ("y", curve.y)):
            if axis is not None and axis not in parameters:
                allowed = f"one of {choices(axis, parameters)}"
                faults.value(("report", "curves", k, key), axis, allowed)


class OutputSection(Section):
    """Table [output]."""

    keep: Literal["feasible", "all"] = holds('"feasible" or "all"', "feasible")
    dtype: Literal["float32", "float64"] = holds('"float32" or "float64"', "float64")
    curves: Literal["optimum", "none"] = holds('"optimum" or "none"', "optimum")


class BudgetSection(Section):
    """Table [budget]."""

    disk: Bytes = holds('a size as a text, as "20 GB"', 20e9, json_schema_extra={"default": "20 GB"})
    time: Seconds = holds('a time as a text, as "60 s"', 3600.0, json_schema_extra={"default": "1 h"})
