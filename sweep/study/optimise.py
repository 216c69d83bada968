"""[optimise]: how the optimiser searches."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from sweep.errors import InputError
from sweep.families.base import Family
from sweep.families.chain import driven_guide
from sweep.quantities.limits import Limit
from sweep.quantities.resolve import output
from sweep.study.file import StudyFile
from sweep.study.objective import ObjectiveSection
from sweep.study.section import Section, Seed
from sweep.study.study import OptimiseSettings, ProveSettings


class ProveTable(Section):
    """Table ``optimise.prove``."""

    required = ("gap",)
    gap: str | None = Field(None, description='a share as a text, as "1 %"')
    boxes: Annotated[int, Field(ge=64, le=10**9)] = Field(1_000_000, description="a whole number, 64 to 10^9")
    smallest: str = Field("0.00001 %", description='a share of every range as a text, as "0.1 %"')
    time: str | None = Field(None, description='a time as a text, as "60 s"')


class OptimiseSection(Section):
    """Table [optimise]."""

    starts: Annotated[int, Field(ge=1, le=100_000)] = Field(20, description="a whole number, 1 to 100000")
    seed: Seed = Field(0, description="a whole number, 0 or greater")
    unseen: str | None = Field(None, description='a share as a text, as "2 %"')
    looks: Annotated[int, Field(ge=100, le=10_000_000)] = Field(20_000, description="a whole number, 100 to 10000000")
    time_budget: str | None = Field(None, description='a time as a text, as "60 s"')
    variables: Literal["parameters", "locus"] | None = Field(None, description='"parameters" or "locus"')
    globally: Literal["none", "proportions"] = Field("none", alias="global", description='"none" or "proportions"')
    populations: Annotated[int, Field(ge=1, le=10_000)] = Field(40, description="a whole number, 1 to 10000")
    prove: ProveTable | None = Field(None, description='{ gap = "1 %", boxes = 1000000, time = "10 min" }')


def read_optimise(section: OptimiseSection, file: StudyFile) -> OptimiseSettings | None:
    """Read the settings of the search; None where the file asks for none."""
    settings = OptimiseSettings(
        starts=section.starts,
        seed=section.seed,
        time_budget=file.quantity(section.time_budget, "s", ("optimise", "time_budget")),
        variables=section.variables,
        unseen=None if section.unseen is None else file.share(section.unseen, ("optimise", "unseen")),
        looks=section.looks,
        globally=section.globally,
        populations=section.populations,
        prove=_prove(section.prove, file),
    )
    return settings if "optimise" in file else None


def _prove(table: ProveTable | None, file: StudyFile) -> ProveSettings | None:
    if table is None:
        return None
    gap = file.share(table.gap or "1 %", ("optimise", "prove", "gap"))
    smallest = file.share(table.smallest, ("optimise", "prove", "smallest"))
    return ProveSettings(gap, table.boxes, smallest, file.quantity(table.time, "s", ("optimise", "prove", "time")))


def check_search(section: OptimiseSection, file: StudyFile, bare: Family) -> None:
    """Report a search over a locus that is not given, or over proportions of a mechanism in which nothing is linear."""
    if section.variables == "locus" and file.free_table("locus") is None:
        file.faults.value(("optimise", "variables"), "locus", '"parameters", or a table [locus]')
    if section.globally == "proportions" and driven_guide(bare) is None:
        file.faults.value(("optimise", "global"), "proportions", '"none", or the chain ["rssr", "guide"]')


def check_steady(file: StudyFile, family: Family, objective: ObjectiveSection, limits: tuple[Limit, ...]) -> None:
    """Report an objective and limits that are constant in pieces: no slope leads a search to them.

    What is only wanted may jump; it has no sensitivities.
    """
    if "optimise" not in file:
        return
    written = file.free_table("limits") or {}
    asked = [(("objective", key), name, name) for key, name in objective.named]
    asked += [(("limits", limit.output), limit.output, written.get(limit.output, limit.output)) for limit in limits]
    for key, name, shown in asked:
        if name not in family.parameter_names and _jumps(family, name):
            allowed = (
                f"a quantity that changes steadily; {name} is constant in pieces, so no slope leads to it: ask for it "
                "in scene.want, or leave out [optimise] and let the sweep alone decide"
            )
            file.faults.value(key, shown, allowed)


def _jumps(family: Family, name: str) -> bool:
    try:
        return output(family, name).jumps
    except InputError:  # an unknown name is reported where it stands
        return False
