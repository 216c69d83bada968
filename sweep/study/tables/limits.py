"""[limits]: bounds of design outputs and of parameters."""

from __future__ import annotations

from sweep.study.limits import read_limits
from sweep.study.prescribed import prescribed_limits
from sweep.study.reading import Reading
from sweep.study.tables.locus import Prescribed


def read(reading: Reading) -> None:
    """Read the table."""
    reading.free_table("limits")


def check(reading: Reading) -> None:
    """Check the limits: those of prescribed outputs, then those of the table."""
    bounds, prescribed = reading.raw.get("limits", {}), reading.get(Prescribed).entries
    for name in [name for name in bounds if name in prescribed]:
        reading.faults.value(("limits", name), bounds[name], "nothing here: [locus] prescribes it")
    own = read_limits(reading.family, bounds, reading.faults)
    reading.fields["limits"] = (*prescribed_limits(prescribed), *own)
