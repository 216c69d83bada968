"""[objective]: the design output to be made small."""

from __future__ import annotations

from sweep.study.limits import read_output_name
from sweep.study.model import ObjectiveSection
from sweep.study.reading import Reading
from sweep.study.study import Objective


def read(reading: Reading) -> None:
    """Read the table."""
    goal = reading.section(ObjectiveSection, "objective").minimise
    reading.fields["objective"] = Objective(goal) if goal else None


def check(reading: Reading) -> None:
    """Report an objective that is no output of the mechanism."""
    goal = reading.get(ObjectiveSection).minimise
    if goal is not None:
        read_output_name(reading.family, goal, ("objective", "minimise"), reading.faults)
