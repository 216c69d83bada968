"""[output] and [budget]: what is stored, and what a run may cost."""

from __future__ import annotations

from sweep.study.model import BudgetSection, OutputSection
from sweep.study.reading import Reading
from sweep.study.study import Budget, OutputSettings


def read(reading: Reading) -> None:
    """Read [output]."""
    output = reading.section(OutputSection, "output")
    reading.fields["output"] = OutputSettings(output.keep, output.dtype, output.curves)


def read_budget(reading: Reading) -> None:
    """Read [budget]."""
    reading.section(BudgetSection, "budget")


def read_amounts(reading: Reading) -> None:
    """Read disk and time of [budget]."""
    budget = reading.get(BudgetSection)
    disk = reading.quantity(budget.disk, "B", ("budget", "disk"))
    seconds = reading.quantity(budget.time, "s", ("budget", "time"))
    # What cannot be read is a fault, and no study is made of it.
    reading.fields["budget"] = Budget(disk or 0.0, seconds or 0.0)
