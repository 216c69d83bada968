"""[optimise]: settings of the optimiser."""

from __future__ import annotations

from typing import Literal

from sweep.families.base import Family
from sweep.families.chain import driven_guide
from sweep.study.file import Seconds, Section, Seed, Share, StudyFile, holds
from sweep.study.study import OptimiseSettings, ProveSettings


class ProveTable(Section):
    """Table ``optimise.prove``."""

    gap: Share = holds('a share as a text, as "1 %"', 0.01, json_schema_extra={"default": "1 %"})
    boxes: int = holds("a whole number, 64 to 10^9", 1_000_000, ge=64, le=10**9)
    smallest: Share = holds(
        'a share of every range as a text, as "0.1 %"', 1e-7, json_schema_extra={"default": "0.00001 %"}
    )
    time: Seconds | None = holds('a time as a text, as "60 s"')


class OptimiseSection(Section):
    """Table [optimise]."""

    starts: int = holds("a whole number, 1 to 100000", 20, ge=1, le=100_000)
    seed: Seed = holds("a whole number, 0 or greater", 0)
    unseen: Share | None = holds('a share as a text, as "2 %"')
    looks: int = holds("a whole number, 100 to 10000000", 20_000, ge=100, le=10_000_000)
    time_budget: Seconds | None = holds('a time as a text, as "60 s"')
    variables: Literal["parameters", "locus"] | None = holds('"parameters" or "locus"')
    globally: Literal["none", "proportions"] = holds('"none" or "proportions"', "none", alias="global")
    populations: int = holds("a whole number, 1 to 10000", 40, ge=1, le=10_000)
    prove: ProveTable | None = holds('{ gap = "1 %", boxes = 1000000, time = "10 min" }')


def read_optimise(section: OptimiseSection) -> OptimiseSettings:
    """Return the settings of the search."""
    table = section.prove
    prove = None if table is None else ProveSettings(table.gap, table.boxes, table.smallest, table.time)
    return OptimiseSettings(**section.model_dump(exclude={"prove"}), prove=prove)


def check_search(section: OptimiseSection, file: StudyFile, bare: Family) -> None:
    """Report a search over a missing locus, or over proportions of a mechanism without linear variables."""
    if section.variables == "locus" and file.free_table("locus") is None:
        file.faults.value(("optimise", "variables"), "locus", '"parameters", or a table [locus]')
    if section.globally == "proportions" and driven_guide(bare) is None:
        file.faults.value(("optimise", "global"), "proportions", '"none", or the chain ["rssr", "guide"]')
