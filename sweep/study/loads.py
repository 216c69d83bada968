"""One load over the turn as [loads] gives it: a file of two columns, the same two columns in the study, or a series."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from sweep.errors import nearest
from sweep.numerics.curves import Curve, SeriesCurve, table_curve
from sweep.study import units
from sweep.study.faults import Faults, Key, read_section
from sweep.study.model import Number, Section

MOST_POINTS = 100_000
FORMS = (
    '{ phi = [0, 90, 180], values = [0, -3, 0], unit = "N" }',
    '{ file = "load.csv", unit = "N" }',
    '{ mean = 1.0, cos = [0.5], sin = [0.2], unit = "N" }',
)
Numbers = Annotated[list[Number], Field(max_length=MOST_POINTS)]
Names = Annotated[list[str], Field(min_length=2, max_length=2)]


class CurveSection(Section):
    """loads.<name>, where it changes over the turn"""

    file: str | None = Field(None, description='the name of a CSV or Parquet file beside the study, as "load.csv"')
    columns: Names | None = Field(
        None, description='two names of columns, as ["angle", "force"]; the first two if left out'
    )
    phi: Numbers | None = Field(None, description="a list of rising crank angles within one turn, in the unit of angle")
    angle: str = Field("deg", description='the unit of the angles, as "deg"')
    values: Numbers | None = Field(None, description="a list of numbers in the unit of unit, one for each angle")
    mean: Number | None = Field(None, description="a finite number")
    cos: Numbers | None = Field(None, description="a list of numbers: the factors of cos(phi), cos(2 phi) ...")
    sin: Numbers | None = Field(None, description="a list of numbers: the factors of sin(phi), sin(2 phi) ...")
    unit: str | None = Field(None, description='a unit as a text, as "N"')


TABLE, SERIES = ("phi", "values"), ("mean", "cos", "sin")


def is_curve(entry: object) -> bool:
    """Return whether an entry of [loads] changes over the turn: it has a key that no constant and no axis has."""
    return isinstance(entry, dict) and not {"file", "phi", *SERIES}.isdisjoint(entry)


def read_curve(
    raw: dict[str, Any], internal: str, folder: Path, key: Key, faults: Faults
) -> tuple[Curve, dict[str, Any]] | None:
    """Return the curve in internal units, and the same entry with the content of its file; None with its faults.

    Parameters
    ----------
    raw : the entry
    internal : internal unit of the load
    folder : where a file is looked for
    """
    before = len(faults.lines)
    section = read_section(CurveSection, raw, key, faults)
    given = [name for name in ("file", *TABLE, *SERIES) if getattr(section, name) is not None]
    kinds = {("file",) if name == "file" else TABLE if name in TABLE else SERIES for name in given}
    factor, angle = (_factor(section, name, unit, key, faults) for name, unit in (("unit", internal), ("angle", "rad")))
    if len(faults.lines) == before and len(kinds) != 1:
        faults.value(key, raw, f"one of {', '.join(FORMS)}")
    if len(faults.lines) > before:
        return None
    if kinds == {SERIES}:
        cos, sin = (tuple(factor * x for x in some or ()) for some in (section.cos, section.sin))
        return SeriesCurve(factor * (section.mean or 0.0), cos, sin), raw
    columns = (section.phi, section.values) if section.file is None else _file(section, folder, key, faults)
    if columns is None:
        return None
    for name, column in zip(TABLE, columns, strict=True):
        if column is None:
            faults.missing((*key, name), str(CurveSection.model_fields[name].description))
    phi, values = columns
    if phi is None or values is None:
        return None
    try:
        made = table_curve(angle * np.array(phi, np.float64), factor * np.array(values, np.float64))
    except ValueError as error:
        faults.value((*key, "phi" if section.file is None else "file"), section.file or phi, str(error))
        return None
    inline = {"phi": list(phi), "values": list(values), "angle": section.angle, "unit": section.unit}
    return made, raw if section.file is None else inline


def _factor(section: CurveSection, name: str, internal: str, key: Key, faults: Faults) -> float:
    unit = getattr(section, name)
    if unit is None:
        faults.missing((*key, name), units.example(internal))
        return 1.0
    try:
        return units.factor(unit, internal)
    except units.UnitFault as fault:
        faults.value((*key, name), unit, str(fault))
        return 1.0


def _file(
    section: CurveSection, folder: Path, key: Key, faults: Faults
) -> tuple[Sequence[float], Sequence[float]] | None:
    """Return the two columns of a file beside the study."""
    import pandas as pd

    name = section.file or ""
    path, place = folder / name, (*key, "file")
    if Path(name).name != name or path.suffix not in (".csv", ".parquet"):
        faults.value(place, name, "the name of a file beside the study, without a folder, ending in .csv or .parquet")
        return None
    try:
        table = pd.read_csv(path) if path.suffix == ".csv" else pd.read_parquet(path)
    except (OSError, ValueError) as error:
        faults.value(place, name, f"a table that can be read: {str(error).splitlines()[0]}")
        return None
    known = [str(column) for column in table.columns]
    for k, column in enumerate(section.columns or ()):
        if column not in known:
            faults.value(
                (*key, "columns", k), column, f"columns of the file: {', '.join(known)}{nearest(column, known)}"
            )
            return None
    if len(known) < 2 or len(table) > MOST_POINTS:
        faults.value(place, name, f"two columns, angle and load, of at most {MOST_POINTS} rows")
        return None
    pair = [table.iloc[:, known.index(column)] for column in section.columns or known[:2]]
    try:
        phi, values = ([float(x) for x in column] for column in pair)
    except (TypeError, ValueError):
        faults.value(place, name, "numbers in both columns")
        return None
    return phi, values
