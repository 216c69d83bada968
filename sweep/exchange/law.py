"""The motion over one turn as a table with units, for a motion controller or another program."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sweep.evaluation.curves import motion_curves
from sweep.evaluation.poses import evaluate
from sweep.families import Mechanism
from sweep.families import family as find_family

if TYPE_CHECKING:
    from sweep.evaluation.tables import Table


def write_law(
    mechanism: Mechanism, design: Table, path: Path, phi: float, poses: int, unit: str, speed: float | None
) -> None:
    """Position with its derivatives by the shaft's angle, deviations and pressure angles, at equal steps of one turn.

    With ``speed`` [rad/s] there is a column of time, from 0.  Units stand in the headings of a CSV, ``s [mm]``, and in
    the field metadata of a Parquet file, where the names stay bare.
    """
    import pyarrow as pa

    family = find_family(mechanism)
    names = list(dict.fromkeys(motion_curves(family)))
    angles = phi + np.arange(poses) * (2.0 * math.pi / poses)
    found = evaluate(mechanism, design, names, phi=angles, angles="rad")
    units = {"phi": "rad"} | {o.name: o.unit.replace("length", unit) for o in family.pose_outputs}
    texts = {"phi": "angle of the driving shaft"} | {o.name: o.text for o in family.pose_outputs}
    columns = {"phi": angles}
    if speed is not None:
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
