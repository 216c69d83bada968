"""[pareto]: the second output and its bounds."""

from __future__ import annotations

from dataclasses import dataclass, replace

from sweep.study.model import ObjectiveSection, OptimiseSection, ParetoSection
from sweep.study.pareto import read_pareto
from sweep.study.reading import Reading


@dataclass(frozen=True)
class FrontBudget:
    """The time for the whole front [s]."""

    seconds: float | None


def read(reading: Reading) -> None:
    """Read the table."""
    section = reading.section(ParetoSection, "pareto")
    reading.put(FrontBudget(reading.quantity(section.time_budget, "s", ("pareto", "time_budget"))))


def check_optimised(reading: Reading) -> None:
    """Report a front that has no optimum to begin at."""
    if "pareto" in reading.data and "optimise" not in reading.data:
        reading.faults.missing(("optimise",), "a table [optimise], as [pareto] begins at the optimum")


def check(reading: Reading) -> None:
    """Find the bounds of the front."""
    raw, goal = reading.data.get("pareto"), reading.get(ObjectiveSection).goal
    reading.fields["pareto"] = None
    if isinstance(raw, dict):
        section, seconds = reading.get(ParetoSection), reading.get(FrontBudget).seconds
        found = read_pareto(section, raw, reading.family, goal, seconds, reading.faults)
        reading.fields["pareto"] = found and replace(found, looks=reading.get(OptimiseSection).looks)
