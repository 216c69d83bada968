"""[optimise]: how the optimiser searches."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from sweep.families.base import Family
from sweep.families.chain import driven_guide
from sweep.study.file import Seconds, Section, Seed, Share, StudyFile
from sweep.study.study import OptimiseSettings, ProveSettings


class ProveTable(Section):
    """Table ``optimise.prove``."""

    gap: Share = Field(0.01, description='a share as a text, as "1 %"', json_schema_extra={"default": "1 %"})
    boxes: Annotated[int, Field(ge=64, le=10**9)] = Field(1_000_000, description="a whole number, 64 to 10^9")
    smallest: Share = Field(
        1e-7, description='a share of every range as a text, as "0.1 %"', json_schema_extra={"default": "0.00001 %"}
    )
    time: Seconds | None = Field(None, description='a time as a text, as "60 s"')


class OptimiseSection(Section):
    """Table [optimise]."""

    starts: Annotated[int, Field(ge=1, le=100_000)] = Field(20, description="a whole number, 1 to 100000")
    seed: Seed = Field(0, description="a whole number, 0 or greater")
    unseen: Share | None = Field(None, description='a share as a text, as "2 %"')
    looks: Annotated[int, Field(ge=100, le=10_000_000)] = Field(20_000, description="a whole number, 100 to 10000000")
    time_budget: Seconds | None = Field(None, description='a time as a text, as "60 s"')
    variables: Literal["parameters", "locus"] | None = Field(None, description='"parameters" or "locus"')
    globally: Literal["none", "proportions"] = Field("none", alias="global", description='"none" or "proportions"')
    populations: Annotated[int, Field(ge=1, le=10_000)] = Field(40, description="a whole number, 1 to 10000")
    prove: ProveTable | None = Field(None, description='{ gap = "1 %", boxes = 1000000, time = "10 min" }')


def read_optimise(section: OptimiseSection) -> OptimiseSettings:
    """Return the settings of the search."""
    table = section.prove
    prove = None if table is None else ProveSettings(table.gap, table.boxes, table.smallest, table.time)
    return OptimiseSettings(**section.model_dump(exclude={"prove"}), prove=prove)


def check_search(section: OptimiseSection, file: StudyFile, bare: Family) -> None:
    """Report a search over a locus that is not given, or over proportions of a mechanism in which nothing is linear."""
    if section.variables == "locus" and file.free_table("locus") is None:
        file.faults.value(("optimise", "variables"), "locus", '"parameters", or a table [locus]')
    if section.globally == "proportions" and driven_guide(bare) is None:
        file.faults.value(("optimise", "global"), "proportions", '"none", or the chain ["rssr", "guide"]')
