"""[objective]: the design output to be made small, or large."""

from __future__ import annotations

from pydantic import Field

from sweep.families.base import Family
from sweep.families.names import negative
from sweep.study.file import Faults, Section, StudyFile
from sweep.study.limits import read_output_name


class ObjectiveSection(Section):
    """Table [objective]."""

    minimise: str | None = Field(None, description="the name of a design output")
    maximise: str | None = Field(None, description="the name of a design output")

    @property
    def goal(self) -> str | None:
        """The output that is made small: of one to be made large its negative."""
        return self.minimise or (self.maximise and negative(self.maximise))

    @property
    def named(self) -> tuple[tuple[str, str], ...]:
        """The keys that are given, and the outputs that they name."""
        both = (("minimise", self.minimise), ("maximise", self.maximise))
        return tuple((key, name) for key, name in both if name is not None)


def check_goal(section: ObjectiveSection, file: StudyFile) -> None:
    """Report an objective that names no output, or two; and a search for nothing."""
    written = file.data.get("objective")
    if isinstance(written, dict) and not {"minimise", "maximise"} & set(written):
        needed = "the name of a design output; or maximise, the name of one to be made large"
        file.faults.missing(("objective", "minimise"), needed, instead="maximise")
    if section.minimise is not None and section.maximise is not None:
        allowed = "minimise or maximise, not both: bound the other output in [limits], or set it against in [pareto]"
        file.faults.value(("objective", "maximise"), section.maximise, allowed)
    if "optimise" in file and "objective" not in file:
        needed = "a table [objective] with minimise = a design output, as [optimise] is given"
        file.faults.missing(("objective",), needed)


def check_objective(section: ObjectiveSection, family: Family, faults: Faults) -> None:
    """Report an objective that is no output of the mechanism."""
    for key, name in section.named:
        read_output_name(family, name, ("objective", key), faults)
