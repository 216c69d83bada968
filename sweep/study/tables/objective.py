"""[objective]: the design output to be made small, or large."""

from __future__ import annotations

from sweep.study.limits import read_output_name
from sweep.study.model import ObjectiveSection
from sweep.study.reading import Reading
from sweep.study.study import Objective


def read(reading: Reading) -> None:
    """Read the table."""
    section = reading.section(ObjectiveSection, "objective")
    written = reading.data.get("objective")
    if isinstance(written, dict) and not {"minimise", "maximise"} & set(written):
        needed = "the name of a design output; or maximise, the name of one to be made large"
        reading.faults.missing(("objective", "minimise"), needed, instead="maximise")
    if section.minimise is not None and section.maximise is not None:
        allowed = "minimise or maximise, not both: bound the other output in [limits], or set it against in [pareto]"
        reading.faults.value(("objective", "maximise"), section.maximise, allowed)
    reading.fields["objective"] = Objective(section.goal) if section.goal else None


def check(reading: Reading) -> None:
    """Report an objective that is no output of the mechanism."""
    section = reading.get(ObjectiveSection)
    for key, name in (("minimise", section.minimise), ("maximise", section.maximise)):
        if name is not None:
            read_output_name(reading.family, name, ("objective", key), reading.faults)
