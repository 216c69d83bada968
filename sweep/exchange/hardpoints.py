"""One position as a table of points, which CAD imports and `sweep points` reads."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

from sweep.exchange.scene import pose, shown_name
from sweep.families import Mechanism

if TYPE_CHECKING:
    from sweep.evaluation.tables import Table


def write_hardpoints(mechanism: Mechanism, design: Table, path: Path, phi: float, unit: str) -> None:
    """Write a row for each joint and each axis (a unit vector, named axis_A) under the first stage that has it."""
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["member", "stage", "frame", "name", "x", "y", "z", "unit"])
        for part in pose(mechanism, design, phi):
            head = [part.member, part.stage, part.frame]
            for joint, at in part.joints.items():
                rows.writerow([*head, shown_name(joint), *map(repr, at[0].tolist()), unit])
            for joint, axis in part.axes.items():
                rows.writerow([*head, f"axis_{shown_name(joint)}", *map(repr, axis.tolist()), "1"])
