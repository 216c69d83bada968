"""[thread]: the threads of a machine, each from its tensioner over points and take-ups to the stitch."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Tag

from sweep.study.file import (
    KIND,
    LIST,
    ONE,
    TABLE,
    TEXT,
    Angle,
    Faults,
    Key,
    Length,
    Lengths,
    Number,
    Place,
    Section,
    StudyFile,
    ThreeLengths,
    TwoTexts,
    holds,
    quantity,
    read_section,
)


class AllowedTable(Section):
    """Table ``thread.<name>.allowed``."""

    required = ("phi", "values", "unit")
    phi: list[Number] | None = holds(
        "a list of rising angles of the main shaft within one turn, in the unit of angle", min_length=2
    )
    angle: str = holds('the unit of the angles, as "deg"', "deg")
    values: list[Number] | None = holds("a list of numbers: the most surplus at each angle", min_length=2)
    unit: str | None = holds('a unit as a text, as "mm"')


class ThreadPlaceTable(Section):
    """Place of ``thread.<name>.path`` that counts only between two events, or has an additional bend."""

    required = ("on",)
    on: Place | None = holds('a name or three lengths, as "low" or ["10 mm", "0 mm", "40 mm"]')
    held: TwoTexts | None = holds('two events, as ["a", "cast"]: the thread runs over it between them')
    wrap: Angle | None = holds('an angle by which it is bent there besides, as "152.2 deg"')
    fixed: TwoTexts | None = holds("two events between which the thread does not slide there")


PathPlace = Annotated[
    Annotated[str, Tag(ONE)] | Annotated[ThreeLengths, Tag(LIST)] | Annotated[ThreadPlaceTable, Tag(TABLE)], KIND
]


class ThreadSection(Section):
    """Table ``thread.<name>``."""

    required = ("path",)
    path: list[PathPlace] | None = holds(
        'a list of places, as ["lever", ["10 mm", "0 mm", "40 mm"], "needle.point", { on = "low", held = ["a", "b"] }]',
    )
    stock: Length | None = holds('a length as a text, as "120 mm"')
    tension: Annotated[float, quantity("N"), TEXT] | None = holds('a force as a text, as "20 gf" or "0.2 N"')
    stiffness: Annotated[float, quantity("N/mm"), TEXT] | None = holds(
        'a force over a length as a text, as "50 gf/mm" or "0.5 N/mm"'
    )
    radius: Lengths | None = holds('a length as a text, as "0.5 mm", or a list of one for each bend')
    allowed: AllowedTable | None = holds('{ phi = [...], values = [...], unit = "mm" }')
    sewn: Length | None = holds('what a stitch takes, a length as a text, as "6 mm"')
    feeding: TwoTexts | None = holds('two events, as ["feeds", "rests"]: it is sewn in between them')
    drawing: TwoTexts | None = holds("two events between which it comes from the bobbin")


def read_threads(file: StudyFile) -> dict[str, dict[str, Any]] | None:
    """Read the threads as relations of the machine, in internal units, or None if one is faulty."""
    faults, raw = file.faults, file.data.get("thread", {})
    before = len(faults.lines)
    found: dict[str, dict[str, Any]] = {}
    if raw and "machine" not in file:
        faults.value(("thread",), raw, "nothing here: it needs a [machine], over whose members the thread runs")
    elif not isinstance(raw, dict):
        faults.value(("thread",), raw, "tables [thread.NAME]")
    else:
        for name, table in raw.items():
            section = read_section(ThreadSection, table, ("thread", name), faults)
            found[name] = _relation(section, ("thread", name), faults)
    return found if len(faults.lines) == before else None


def _relation(section: ThreadSection, key: Key, faults: Faults) -> dict[str, Any]:
    fields = section.model_dump(exclude_none=True, exclude={"allowed"})
    fields["thread"] = fields.pop("path", [])
    if section.allowed is not None:
        fields["allowed"] = _allowed(section.allowed, (*key, "allowed"), faults)
    return fields


def _allowed(table: AllowedTable, key: Key, faults: Faults) -> dict[str, list[float]]:
    columns = {}
    for name, unit, internal in (
        ("phi", table.angle, "rad"),
        ("values", "mm" if table.unit is None else table.unit, "mm"),
    ):
        factor = faults.factor(unit, internal, (*key, "angle" if name == "phi" else "unit"))
        columns[name] = ((factor or 1.0) * np.array(getattr(table, name) or (), np.float64)).tolist()
    return columns
