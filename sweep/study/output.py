"""[output] and [budget]: what is stored, and what a run may cost."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from sweep.study.file import Bytes, Seconds, Section


class OutputSection(Section):
    """Table [output]."""

    keep: Literal["feasible", "all"] = Field("feasible", description='"feasible" or "all"')
    dtype: Literal["float32", "float64"] = Field("float64", description='"float32" or "float64"')
    curves: Literal["optimum", "none"] = Field("optimum", description='"optimum" or "none"')


class BudgetSection(Section):
    """Table [budget]."""

    disk: Bytes = Field(20e9, description='a size as a text, as "20 GB"', json_schema_extra={"default": "20 GB"})
    time: Seconds = Field(3600.0, description='a time as a text, as "60 s"', json_schema_extra={"default": "1 h"})
