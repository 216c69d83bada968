"""Dataset folders whose contents are known in closed form; no kernel runs.

The study is a chain rssr + guide.  Its designs are a plain function of a1 and xi2, so best cells, counts and fronts are
known; the curves are those of links that turn about known pivots.
"""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from sweep.chunks.chunk import ChunkResult
from sweep.chunks.plan import make_plan
from sweep.dataset import chunk_files, files, store
from sweep.study import Study, study_from_data

CHUNK = 4096
DATA: dict[str, Any] = {
    "study": {"name": "needle", "title": "A needle & its <drive>", "question": "How gentle can the needle be?"},
    "mechanism": {"chain": ["rssr", "guide"]},
    "scene": {
        "speed": "7000 rpm",
        "want": ["max_abs_d2s", "stroke", "max_abs_dev"],
        "window": {"from": 0.0, "to": 0.6},
    },
    "design": {
        "a1": {"from": 10.0, "to": 30.0, "count": 21, "unit": "mm"},
        "alpha1": {"from": 0.0, "to": 90.0, "count": 10, "unit": "deg"},
        "xi2": {"from": 20.0, "to": 60.0, "count": 41, "unit": "mm"},
    }
    | {name: f"{value} mm" for name, value in {
        "b1": 90, "c1": 45, "e1": 100, "f1": 0, "g1": 0, "a2": 30, "b2": 75, "c2": 75, "e2": 60, "eta2": 0, "h2": 0,
    }.items()}
    | {"lam2": "0 deg"},
    "limits": {
        "max_pressure_angle1": {"max": 45.0, "unit": "deg"},
        "stroke": {"min": 24.4, "max": 24.6, "unit": "mm"},
        "max_abs_dev": {"max": 0.05, "unit": "mm"},
    },
    "objective": {"minimise": "max_abs_d2s"},
    "accuracy": {"target": 1e-8},
    "optimise": {"starts": 3},
}  # fmt: skip
OPTIMUM = {"max_abs_d2s": 8.0, "stroke": 24.5, "max_abs_dev": 0.05, "max_pressure_angle1": np.radians(40.0)}
REFERENCE = {"max_abs_d2s": 10.0, "stroke": 24.5, "max_abs_dev": 0.1, "max_pressure_angle1": np.radians(30.0)}


def study_data(**changes: Any) -> dict[str, Any]:
    """Return a copy of the study's data with some tables replaced; None removes one."""
    data = copy.deepcopy(DATA) | changes
    return {key: value for key, value in data.items() if value is not None}


def designs(study: Study, start: int, stop: int) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Return outputs and status of some designs: acceleration grows with |a1 - 18|, deviation with |xi2 - 40|."""
    columns = study.space.columns(start, stop)
    outputs = {
        "max_abs_d2s": 8.5 + 0.1 * np.abs(columns["a1"] - 18.0) + 0.001 * np.abs(columns["xi2"] - 50.0),
        "stroke": np.full(stop - start, 24.5),
        "max_abs_dev": 0.002 * (np.abs(columns["xi2"] - 40.0) + columns["a1"] / 1000.0),
        "max_pressure_angle1": np.radians(30.0) + 0.2 * columns["alpha1"],
    }
    outputs |= {f"err_{name}": 1e-9 * values for name, values in outputs.items()}
    status = np.zeros(stop - start, np.uint8)
    status[columns["a1"] > 25.0] = 3
    status[(status == 0) & (outputs["max_abs_dev"] > 0.05)] = 5
    status[(status == 0) & (outputs["max_pressure_angle1"] > np.radians(45.0))] = 5
    return columns | outputs, status


def write_dataset(folder: Path, data: dict[str, Any] | None = None, *, optimum: dict[str, Any] | None = None) -> Path:
    """Write a complete dataset; with ``optimum`` (changes to the optimum's row) also the optimiser's tables."""
    data = study_data() if data is None else data
    study = study_from_data(data, "study.toml")
    plan = make_plan(study, CHUNK)
    folder.mkdir(parents=True)
    for index in range(plan.chunks):
        start, stop = plan.bounds(index)
        columns, status = designs(study, start, stop)
        kept = status == 0
        bent = (status == 5) & (columns["max_abs_dev"] > 0.05)
        table = {"design": np.arange(start, stop), **columns, "status": status}
        result = ChunkResult(
            {c.name: table[c.name][kept].astype(c.dtype) for c in plan.columns},
            {int(code): int((status == code).sum()) for code in np.unique(status)},
            {"max_abs_dev": int(bent.sum()), "max_pressure_angle1": int(((status == 5) & ~bent).sum())},
        )
        chunk_files.write_chunk(folder, plan, index, result)
    note = plan.as_dict() | {"about": data["study"], "data": study.data, "optimise": "optimise" in data}
    if optimum is not None:
        write_optimum(folder, study, optimum)
        note["optimised"] = "yes"
    files.write_plan(
        folder, note | dict(zip(("counts", "missed"), store.totals(folder), strict=True)) | {"complete": True}
    )
    files.append_run(folder, {"event": "start", "time": "2026-01-02T03:04:05Z", "versions": {"numpy": "2"}, "jobs": 2})
    return folder


def write_optimum(folder: Path, study: Study, changes: dict[str, Any]) -> None:
    """Write one optimum, two other starts, the reference, and curves of optimum and reference."""
    fixed = dict(study.space.fixed) | {"a1": 18.0, "alpha1": 0.1, "xi2": 40.0}
    about = {"violation": 0.0, "kkt_residual": 1e-9, "active": "max_abs_dev at most 0.05", "agree": 2, "status": 0}
    errors = {f"err_{name}": 1e-10 for name in OPTIMUM}
    rows = [{"role": "optimum"} | fixed | OPTIMUM | errors | about | changes]
    rows += [{"role": "start"} | fixed | OPTIMUM | errors | about] * 2
    rows += [{"role": "reference"} | fixed | REFERENCE | errors | about | {"kkt_residual": np.nan, "active": ""}]
    write_table(
        files.beside(folder) / files.OPTIMUM,
        pd.DataFrame(rows),
        {"max_abs_d2s": "mm", "max_abs_dev": "mm", "stroke": "mm"},
    )
    curves = pd.concat([curve("optimum", 12.25), curve("reference", 15.0)])
    write_table(
        files.beside(folder) / files.CURVES, curves, {"s": "mm", "ds": "mm", "d2s": "mm", "d3s": "mm", "dev": "mm"}
    )


def curve(role: str, half_stroke: float, poses: int = 72) -> pd.DataFrame:
    """Return curves: a harmonic needle, a crank of radius 18 about (0, 0, 5), a rocker of 45 about (100, 0, 0)."""
    phi = np.arange(poses) * (2.0 * np.pi / poses)
    swing = 1.5 + 0.4 * np.sin(phi)
    return pd.DataFrame(
        {
            "role": role,
            "phi": phi,
            "s": 3.0 - half_stroke * np.cos(phi - 1.0),
            "ds": half_stroke * np.sin(phi - 1.0),
            "d2s": half_stroke * np.cos(phi - 1.0),
            "d3s": -half_stroke * np.sin(phi - 1.0),
            "dev": 0.05 * np.sin(3.0 * phi),
            "pressure_angle1": 0.5 + 0.2 * np.sin(phi),
            "x_b1": 18.0 * np.cos(phi),
            "y_b1": 18.0 * np.sin(phi),
            "z_b1": 5.0,
            "x_c1": 100.0 + 45.0 * np.cos(swing),
            "y_c1": 45.0 * np.sin(swing),
            "z_c1": 0.0,
            "x_b2": 30.0 * np.cos(swing),
            "y_b2": 30.0 * np.sin(swing),
            "x_m2": 10.0 + 3.0 * np.cos(phi),
            "y_m2": half_stroke * np.sin(phi),
        }
    )


def write_table(path: Path, frame: pd.DataFrame, units: dict[str, str]) -> None:
    table = pa.Table.from_pandas(frame, preserve_index=False)
    fields = [field.with_metadata({"unit": units.get(field.name, "rad")}) for field in table.schema]
    pq.write_table(table.cast(pa.schema(fields)), path)
