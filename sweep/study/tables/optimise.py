"""[optimise]: how the optimiser searches."""

from __future__ import annotations

from sweep.errors import InputError
from sweep.families.base import Family
from sweep.families.chain import driven_guide
from sweep.reductions.catalogue import output
from sweep.study.model import ObjectiveSection, OptimiseSection, ProveTable
from sweep.study.reading import Reading
from sweep.study.study import OptimiseSettings, ProveSettings


def read(reading: Reading) -> None:
    """Read the table."""
    reading.section(OptimiseSection, "optimise")


def read_values(reading: Reading) -> None:
    """Read the time budget and the share of unseen basins; with them make the settings."""
    search = reading.get(OptimiseSection)
    settings = OptimiseSettings(
        starts=search.starts,
        seed=search.seed,
        time_budget=reading.quantity(search.time_budget, "s", ("optimise", "time_budget")),
        variables=search.variables,
        unseen=reading.share(search.unseen, ("optimise", "unseen")),
        looks=search.looks,
        globally=search.globally,
        populations=search.populations,
        prove=_prove(reading, search.prove),
    )
    reading.fields["optimise"] = settings if "optimise" in reading.data else None


def _prove(reading: Reading, table: ProveTable | None) -> ProveSettings | None:
    if table is None:
        return None
    gap = reading.share(table.gap or "1 %", ("optimise", "prove", "gap"))
    smallest = reading.share(table.smallest, ("optimise", "prove", "smallest"))
    return ProveSettings(gap, table.boxes, smallest, reading.quantity(table.time, "s", ("optimise", "prove", "time")))


def check_objective(reading: Reading) -> None:
    """Report a search for nothing."""
    if "optimise" in reading.data and "objective" not in reading.data:
        needed = "a table [objective] with minimise = a design output, as [optimise] is given"
        reading.faults.missing(("objective",), needed)


def check_steady(reading: Reading) -> None:
    """Report an objective and limits that are constant in pieces: no slope leads a search to them.

    What is only wanted may jump; it has no sensitivities.
    """
    if "optimise" not in reading.data:
        return
    family, section = reading.family, reading.get(ObjectiveSection)
    names = [(("objective", key), name) for key in ("minimise", "maximise") if (name := getattr(section, key))]
    names += [(("limits", limit.output), limit.output) for limit in reading.fields["limits"]]
    for key, name in names:
        if name not in family.parameter_names and _jumps(family, name):
            allowed = (
                f"a quantity that changes steadily; {name} is constant in pieces, so no slope leads to it: ask for it "
                "in scene.want, or leave out [optimise] and let the sweep alone decide"
            )
            reading.faults.value(key, reading.raw["limits"].get(name, name) if key[0] == "limits" else name, allowed)


def _jumps(family: Family, name: str) -> bool:
    try:
        return output(family, name).jumps
    except InputError:  # an unknown name is reported where it stands
        return False


def check(reading: Reading) -> None:
    """Report a search over proportions of a mechanism in which nothing is linear."""
    if reading.get(OptimiseSection).globally == "proportions" and driven_guide(reading.mechanism) is None:
        allowed = '"none", or the chain ["rssr", "guide"]'
        reading.faults.value(("optimise", "global"), "proportions", allowed)
