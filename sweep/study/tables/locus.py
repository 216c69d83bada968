"""[locus]: limit positions of the first stage, from which its links follow."""

from __future__ import annotations

from dataclasses import dataclass

from sweep.study.design import Entry
from sweep.study.model import OptimiseSection
from sweep.study.prescribed import read_locus, read_prescribed
from sweep.study.reading import Reading


@dataclass(frozen=True)
class Prescribed:
    """The prescribed outputs as fixed values or axes, and the parameters that follow from them."""

    entries: dict[str, Entry]
    made: tuple[str, ...]


def read(reading: Reading) -> None:
    """Read the table."""
    reading.free_table("locus")


def check(reading: Reading) -> None:
    """Find the stage that is prescribed, and what is prescribed of it."""
    raw, faults = reading.raw.get("locus"), reading.faults
    locus = None if raw is None else read_locus(reading.mechanism, faults)
    if reading.get(OptimiseSection).variables == "locus" and raw is None:
        faults.value(("optimise", "variables"), "locus", '"parameters", or a table [locus]')
    sampled = "sample" in reading.raw.get("design", {})
    entries = {} if locus is None else read_prescribed(locus, raw or {}, faults, sampled)
    reading.put(Prescribed(entries, () if locus is None else locus.made))
    reading.fields["locus"] = locus
