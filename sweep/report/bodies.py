"""Bodies that are bars between their joints: mass, centre and inertia of the design that the page shows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sweep.exchange.scene import first_pose
from sweep.report.dataset import Dataset
from sweep.report.quantities import quantity
from sweep.report.sketch import drawn_parts
from sweep.report.tables import value_of


class Bar(NamedTuple):
    """A bar with what it has, in words: its centre from its first joint, its inertia across and along it."""

    name: str
    kind: str
    mass: str
    centre: str
    across: str
    along: str


def bars(data: Dataset) -> list[Bar]:
    """Return the bars that have a mass, in the order of the mechanism."""
    family, row = data.study.family, data.result
    rods = [name for name in family.parameter_names if f".{name}".rpartition(".")[2].startswith("rod_")]
    rods = [name for name in rods if row is not None and value_of(row, name) == 1.0]
    if row is None or not rods:
        return []
    placed = drawn_parts(family, {name: value_of(row, name) for name in family.parameter_names})
    pose, lengths = first_pose([one.part for one in placed]) if placed else 0, {}
    for part in (one.part for one in placed):
        for link in (link for link in part.links if len(link.joints) > 1):
            first, second = (part.joints[name][pose] for name in link.joints[:2])
            lengths[(part.member, f"{link.name.replace(' ', '_')}{part.stage}")] = float(np.linalg.norm(second - first))
    found = []
    for name in rods:
        member, dot, own = name.rpartition(".")
        body = own.removeprefix("rod_")
        given = {word: value_of(row, f"{member}{dot}{word}_{body}") for word in ("m", "line_mass", "gyration")}
        length = lengths.get((member, body), np.nan)
        mass, thick = given["m"] + given["line_mass"] * length, given["gyration"] ** 2
        if mass > 0.0:
            values = (("m", "t", mass), ("com", "mm", 0.5 * length), ("j", "t*mm^2", mass * (length**2 / 12.0 + thick)),
                      ("j", "t*mm^2", 2.0 * mass * thick))  # fmt: skip
            words = [quantity(word, unit).show(value) for word, unit, value in values]
            found.append(Bar(f"{member}{dot}{body}", "exact" if thick else "slender", *words))
    return found
