"""Tables that other programs read: the points of one position, and the motion over one turn with units."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sweep.evaluation.curves import motion_curves
from sweep.evaluation.poses import evaluate
from sweep.evaluation.tables import design_matrix
from sweep.exchange.scene import pose, shown_name
from sweep.families import Mechanism
from sweep.families import family as find_family
from sweep.families.base import Family
from sweep.families.domain import Interval, Turn, equal_steps
from sweep.families.machines import Machine

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


def _per_angle(family: Family, name: str) -> str:
    """Return what a derivative by the shaft's angle has behind the unit of its output: /rad^2 of the second one."""
    if family.domain.unit != "rad":
        return ""  # a derivative by anything else has its unit
    found = family.split(name) if isinstance(family, Machine) else None
    order = len(family.orders(name) if found is None else found[0].family.orders(found[1]))
    return "" if order == 0 else "/rad" if order == 1 else f"/rad^{order}"


def write_law(
    mechanism: Mechanism, design: Table, path: Path, phi: float, poses: int, unit: str, speed: float | None
) -> None:
    """Write position, derivatives by the shaft's angle, deviations and pressure angles at equal steps of one turn.

    Over an interval the steps go from one end to the other; a march begins at 0.  With ``speed`` [rad/s] there is a
    column of time, from 0, but for an interval.  Units stand in the headings of a CSV, ``s [mm]``, and in
    the field metadata of a Parquet file, where the names stay bare.
    """
    import pyarrow as pa

    family = find_family(mechanism)
    names = list(dict.fromkeys(motion_curves(family)))
    domain = family.domain
    if isinstance(domain, Turn):
        angles, text = phi + np.arange(poses) * (2.0 * math.pi / poses), "angle of the driving shaft"
    else:
        matrix, _ = design_matrix(family, design)
        angles, text = equal_steps(domain, matrix, poses), domain.text
    found = evaluate(mechanism, design, names, phi=angles, angles="rad")
    units = {o.name: o.unit for o in family.pose_outputs} | {domain.name: domain.unit}
    units = {name: of.replace("length", unit) + _per_angle(family, name) for name, of in units.items()}
    texts = {o.name: o.text for o in family.pose_outputs} | {domain.name: text}
    columns = {domain.name: angles}
    if speed is not None and not isinstance(domain, Interval):
        columns["t"] = (angles - phi) / speed
        units["t"], texts["t"] = "s", "time"
    columns |= {name: found[name].to_numpy(np.float64) for name in names}
    columns["status"] = found["status"].to_numpy()
    if path.suffix.lower() == ".parquet":
        import pyarrow.parquet as pq

        fields = [
            pa.field(
                name, pa.array(values).type, metadata={"unit": units.get(name, ""), "definition": texts.get(name, "")}
            )
            for name, values in columns.items()
        ]
        pq.write_table(pa.table([pa.array(v) for v in columns.values()], schema=pa.schema(fields)), path)
        return
    import pandas as pd

    heads = {name: f"{name} [{units[name]}]" if name in units else name for name in columns}
    pd.DataFrame(columns).rename(columns=heads).to_csv(path, index=False, lineterminator="\n")
