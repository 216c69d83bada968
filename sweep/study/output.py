"""[output] and [budget]: what is stored, and what a run may cost."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from sweep.study.file import StudyFile
from sweep.study.section import Section
from sweep.study.study import Budget


class OutputSection(Section):
    """Table [output]."""

    keep: Literal["feasible", "all"] = Field("feasible", description='"feasible" or "all"')
    dtype: Literal["float32", "float64"] = Field("float64", description='"float32" or "float64"')
    curves: Literal["optimum", "none"] = Field("optimum", description='"optimum" or "none"')


class BudgetSection(Section):
    """Table [budget]."""

    disk: str = Field("20 GB", description='a size as a text, as "20 GB"')
    time: str = Field("1 h", description='a time as a text, as "60 s"')


def read_budget(section: BudgetSection, file: StudyFile) -> Budget:
    """Read the disk and time that a run may take."""
    disk = file.quantity(section.disk, "B", ("budget", "disk"))
    seconds = file.quantity(section.time, "s", ("budget", "time"))
    # What cannot be read is a fault, and no study is made of it.
    return Budget(disk or 0.0, seconds or 0.0)
