"""[cyclogram]: times of events and strokes, read as limits of crank angles, durations and sizes."""

from __future__ import annotations

import math
from typing import Any

from sweep.errors import InputError
from sweep.families.base import Family
from sweep.quantities.limits import Limit
from sweep.quantities.resolve import output as design_output
from sweep.quantities.units import internal_unit
from sweep.study.file import Faults, Key, Section, StudyFile, TwoTexts, holds, read_section

ENDS = {"ext": "phi_ext", "fold": "phi_fold", "duration": "phi0"}


class StrokeSection(Section):
    """Table ``cyclogram.<member>``: the stroke of a member from its folded to its extended position."""

    ext: TwoTexts | None = holds('when the stroke ends, extended, from and to, as ["170 deg", "190 deg"]')
    fold: TwoTexts | None = holds('when it ends, folded, as ["350 deg", "359 deg"]')
    duration: TwoTexts | None = holds('from the one to the other, least and most, as ["170 deg", "190 deg"]')
    size: TwoTexts | None = holds('least and most stroke or swing, as ["24 mm", "25 mm"]')


def limits_of_cyclogram(file: StudyFile, family: Family) -> list[Limit]:
    """Return the limits that the windows of events and strokes stand for, in internal units."""
    limits, members = [], {name.partition(".")[0] for name in family.parameter_names if "." in name}
    for name, entry in (file.free_table("cyclogram") or {}).items():
        key: Key = ("cyclogram", name)
        if name not in members:
            limits += _window(file.faults, family, f"phi_{name}", entry, key)
            continue
        section = read_section(StrokeSection, entry, key, file.faults)
        for what, window in section.model_dump(exclude_none=True).items():
            output = f"{name}.{ENDS[what]}" if what in ENDS else _size(family, name)
            limits += _window(file.faults, family, output, window, (*key, what))
    return limits


def _size(family: Family, member: str) -> str:
    """Name the output that measures a member's stroke: its swing if it has one, otherwise its stroke."""
    try:
        return design_output(family, f"{member}.swing").name
    except InputError:
        return f"{member}.stroke"


def _window(faults: Faults, family: Family, name: str, given: Any, key: Key) -> list[Limit]:
    """Read a window as a limit; one across angle 0 of the main shaft is refused, since a limit is a plain interval."""
    try:
        output = design_output(family, name)
    except InputError as error:
        faults.unknown_name(key, "event or member", error.allowed)
        return []
    if not isinstance(given, list) or len(given) != 2 or not all(isinstance(text, str) for text in given):
        faults.value(key, given, 'two texts, from and to, as ["200 deg", "230 deg"]')
        return []
    ends = [faults.number(text, internal_unit(output.unit), (*key, k)) for k, text in enumerate(given)]
    if None in ends:
        return []
    start, end = (float(x) for x in ends if x is not None)
    if start > end or (name.startswith("phi_") and not 0.0 <= start <= end < 2.0 * math.pi):
        faults.value(key, given, "from before to, within one turn: give the main shaft its zero outside of the window")
        return []
    return [Limit(name, start, end)]
