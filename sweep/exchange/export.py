"""``export``: one design as hardpoints, CAD, animation, simulation model or motion law.

The tables for other programs hold the points of one position, and the motion over one turn with units.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from sweep.dataset.files import replacing
from sweep.errors import InputError, whole
from sweep.evaluation.angles import AngleUnit, grid_in_radians, in_radians
from sweep.evaluation.curves import motion_curves
from sweep.evaluation.poses import evaluate
from sweep.evaluation.tables import Table, design_matrix
from sweep.exchange.dxf import write_dxf
from sweep.exchange.glb import write_glb
from sweep.exchange.mjcf import METRES, write_mjcf
from sweep.exchange.scene import finite, pose, shown_name, turn
from sweep.families import Mechanism
from sweep.families import family as find_family
from sweep.families.base import Family, Interval, Turn
from sweep.families.machines.machine import Machine
from sweep.families.poses import equal_steps
from sweep.quantities.units import speed_given


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


def _unit(family: Family, name: str, unit: str) -> str:
    """Return an output's unit, of a derivative by the shaft's angle with its own, as mm/rad^2 and rad/rad^2."""
    if family.domain.unit != "rad":
        return unit  # a derivative by another variable has its own unit
    member = family.split(name) if isinstance(family, Machine) else None
    order = len(family.orders(name) if member is None else member[0].family.orders(member[1]))
    unit = "rad" if order and unit == "1" else unit  # pure numbers are derivatives of angles
    return unit + ("" if order == 0 else "/rad" if order == 1 else f"/rad^{order}")


def write_law(
    mechanism: Mechanism, design: Table, path: Path, phi: float, poses: int, unit: str, speed: float | None
) -> None:
    """Write position, derivatives by the shaft's angle, deviations and pressure angles at equal steps of one turn.

    Over an interval the steps go from one end to the other; a march begins at 0.  With ``speed`` [rad/s] there is a
    column of time, from 0, except for an interval.  Units are in the headings of a CSV, ``s [mm]``, and in
    the field metadata of a Parquet file, where the names have none.
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
    motion = evaluate(mechanism, design, names, phi=angles, angles="rad")
    units = {o.name: o.unit for o in family.pose_outputs} | {domain.name: domain.unit}
    units = {name: _unit(family, name, of.replace("length", unit)) for name, of in units.items()}
    texts = {o.name: o.text for o in family.pose_outputs} | {domain.name: text}
    columns = {domain.name: angles}
    if speed is not None and not isinstance(domain, Interval):
        columns["t"] = (angles - angles[0]) / speed
        units["t"], texts["t"] = "s", "time"
    columns |= {name: motion[name].to_numpy(np.float64) for name in names}
    columns["status"] = motion["status"].to_numpy()
    if path.suffix.lower() == ".parquet":
        import pyarrow.parquet as pq

        table = pa.table(columns)
        notes = [{"unit": units.get(name, ""), "definition": texts.get(name, "")} for name in columns]
        fields = [field.with_metadata(note) for field, note in zip(table.schema, notes, strict=True)]
        pq.write_table(table.cast(pa.schema(fields)), path)
        return
    import pandas as pd

    heads = {name: f"{name} [{units[name]}]" if name in units else name for name in columns}
    pd.DataFrame(columns).rename(columns=heads).to_csv(path, index=False, lineterminator="\n")


FORMATS = {"csv": (".csv",), "glb": (".glb",), "dxf": (".dxf",), "mjcf": (".xml",), "law": (".csv", ".parquet")}
SECONDS = 2.0  # duration of an animation without a speed
MOST_POSES = 100_000  # a table of a few MB for each column


def export(
    mechanism: Mechanism,
    design: Table,
    path: str | Path,
    format: str | None = None,
    *,
    phi: float = 0.0,
    poses: int = 120,
    unit: str = "mm",
    speed: float | str | None = None,
    angles: AngleUnit | None = None,
) -> Path:
    """Write one design to a file that other programs read.

    Parameters
    ----------
    mechanism : a family's name, a list of them for a chain, a table of members for a machine
    design : the parameters of one design [one length unit, rad]; for ``mjcf`` also masses, centres and inertias of its
        links by the names of docs/effects.md
    path : the file
    format : ``csv`` hardpoints and axes in the position ``phi``; ``glb`` an animated model (glTF 2.0) over one turn;
        ``dxf`` a drawing with front view, and side and top view of spatial stages; ``mjcf`` a model for MuJoCo;
        ``law`` the motion over one turn with units (.csv or .parquet).  If left out, the ending of the file says it:
        .csv is hardpoints, .xml is mjcf
    phi : angle of the driving shaft in the drawn position, where a turn begins [rad]; over an interval the value of its
        variable
    poses : steps of a turn, 3 to 100000
    unit : length unit of the design, "mm" or "m"
    speed : speed of the driving shaft [rad/s], or a text such as "7000 rpm": gives the law a column of time and the
        animation its duration
    angles : the unit of the angles of ``design`` and ``phi``, "rad" or "deg", as of :func:`sweep.evaluate`

    Returns
    -------
    Path
        the file

    Raises
    ------
    InputError
        for an unknown format or unit, a design that does not turn, a mechanism the format does not serve, a package
        that is not installed (``pip install 'linksweep[cad]'``).
    StoreError
        if the file cannot be written.

    Examples
    --------
    >>> import sweep
    >>> design = {"a": 20.0, "b": 70.0, "e": 5.0}
    >>> file = sweep.export("slider_crank", design, "drive.csv", phi=0.0)
    >>> print(file.read_text().splitlines()[2])
    ,,slider_crank,D,0.0,5.0,0.0,mm
    """
    target = Path(path)
    kind = _format(target, format)
    if unit not in METRES:
        raise InputError("unit", unit, "mm or m", "export")
    whole("poses", poses, "export", 3, MOST_POSES)
    speed = speed_given(speed)
    if speed is not None and not (math.isfinite(speed) and speed > 0.0):
        raise InputError("speed", speed, "a positive number of rad/s", "export")
    family = find_family(mechanism)
    design = in_radians(family, design, angles)
    phi = finite(float(np.asarray(grid_in_radians(family.domain, phi, angles))))
    write = _writer(kind, mechanism, design, phi, poses, unit, speed)
    with replacing(target) as partial:
        write(partial)
    return target


def _writer(
    kind: str, mechanism: Mechanism, design: Table, phi: float, poses: int, unit: str, speed: float | None
) -> Callable[[Path], None]:
    """Return a function that writes the file to a path; faults of the design are raised before."""
    if kind == "csv":
        return lambda path: write_hardpoints(mechanism, design, path, phi, unit)
    if kind == "law":
        return lambda path: write_law(mechanism, design, path, phi, poses, unit, speed)
    placed = turn(mechanism, design, phi, poses)
    family = find_family(mechanism)
    if kind == "glb":
        seconds = SECONDS if speed is None else 2.0 * math.pi / speed
        return lambda path: write_glb(family.name, placed, path, METRES[unit], seconds)
    if kind == "dxf":
        return lambda path: write_dxf(placed, path, unit)
    return lambda path: write_mjcf(family, placed, _numbers(design), path, unit)


def _numbers(design: Table) -> dict[str, float]:
    """Return the columns of one design as numbers."""
    values = {}
    for key, value in design.items():
        try:
            values[str(key)] = float(np.ravel(value)[0])
        except (TypeError, ValueError):
            continue  # a column of words does not belong to the model
    return values


def _format(path: Path, given: str | None) -> str:
    suffix = path.suffix.lower()
    if given is None:
        for kind, endings in FORMATS.items():
            if suffix in endings and kind != "law":
                return kind
        raise InputError("path", path.name, "a file ending in .csv, .glb, .dxf or .xml, or format=", "export")
    if given not in FORMATS:
        raise InputError("format", given, ", ".join(FORMATS), "export")
    if suffix not in FORMATS[given]:
        raise InputError("path", path.name, f"a file ending in {' or '.join(FORMATS[given])}", f"export, {given}")
    return given
