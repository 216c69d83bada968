"""[study], [report], [output] and [budget]: what a study asks, what is shown and stored, what it may cost."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import Field

from sweep.errors import choices
from sweep.families.base import Family
from sweep.study.file import Bytes, Number, Seconds, Section, StudyFile


class StudySection(Section):
    """Table [study]."""

    required = ("name",)
    name: str | None = Field(
        None, pattern="^[a-z0-9][a-z0-9-]*$", max_length=64, description="a plain word of a-z, 0-9 and '-'"
    )
    title: str = Field("", description="a text")
    question: str = Field("", description="a text")
    taken: list[str] = Field([], description="filled in: which designs come from other studies, with their hash")


class CurveTable(Section):
    """Table ``report.curves``."""

    required = ("label", "x", "y", "points")
    label: str | None = Field(None, description="a text")
    x: str | None = Field(None, description="the name of a swept parameter")
    y: str | None = Field(None, description="the name of a swept parameter")
    points: Annotated[list[Annotated[list[Number], Field(min_length=2, max_length=2)]], Field(min_length=2)] | None = (
        Field(None, description="a list of two or more points [x, y] in the units of the two axes")
    )


class FigureTable(Section):
    """Table ``report.figures``."""

    required = ("file", "title", "caption")
    file: str | None = Field(None, description="the name of an SVG file without a folder")
    title: str | None = Field(None, description="a text")
    caption: str | None = Field(None, description="a text")


class ReportSection(Section):
    """Table [report]."""

    curves: list[CurveTable] = Field(
        [], description='a list of { label = "...", x = "k", y = "a", points = [[1, 1], [9, 9]] }'
    )
    figures: list[FigureTable] = Field(
        [], description='a list of { file = "atlas.svg", title = "...", caption = "..." }'
    )


def check_report(report: ReportSection, file: StudyFile, family: Family, prescribed: Iterable[str]) -> None:
    """Report figures with a folder in their names, and curves over other parameters than those of the study.

    ``prescribed`` are the outputs that [locus] prescribes.
    """
    faults, known = file.faults, family.parameter_names
    given = [name for table in ("design", "bodies", "loads") for name in file.free_table(table) or ()]
    parameters = [*prescribed, *(name for name in given if name in known)]
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

    keep: Literal["feasible", "all"] = Field("feasible", description='"feasible" or "all"')
    dtype: Literal["float32", "float64"] = Field("float64", description='"float32" or "float64"')
    curves: Literal["optimum", "none"] = Field("optimum", description='"optimum" or "none"')


class BudgetSection(Section):
    """Table [budget]."""

    disk: Bytes = Field(20e9, description='a size as a text, as "20 GB"', json_schema_extra={"default": "20 GB"})
    time: Seconds = Field(3600.0, description='a time as a text, as "60 s"', json_schema_extra={"default": "1 h"})
