"""A dataset as an Excel workbook: its best designs, its optimum, one turn of it, and the definitions of columns."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from sweep.dataset.files import replacing
from sweep.dataset.reading import best
from sweep.dataset.store import load
from sweep.errors import InputError, MissingInput, extra
from sweep.report.dataset import Dataset, read_dataset
from sweep.report.quantities import quantity

MOST_ROWS = 10_000  # designs: a sheet holds 1 048 576, but 100 000 take minutes to write


def write_workbook(folder: str | Path, path: str | Path) -> Path:
    """Write a finished dataset as a workbook for Excel.

    Parameters
    ----------
    folder : folder that ``sweep run`` has written
    path : path of a file ending in .xlsx

    Returns
    -------
    Path
        the file, with the sheets ``designs`` (within all limits, the best first if the study has an objective, at
        most 10 000), ``optimum`` and ``curves`` (one turn, if the study optimises) and ``definitions``.  Headings
        contain units; angles are in degrees, lengths in mm.

    Raises
    ------
    InputError
        for another ending, a folder that is no complete dataset, or if openpyxl is not installed
        (``pip install 'linksweep[excel]'``).
    StoreError
        if the file cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() != ".xlsx":
        raise InputError("path", target.name, "a file ending in .xlsx", "export")
    data = read_dataset(Path(folder))
    sheets = {"designs": _designs(data), "optimum": data.optima, "curves": data.curves}
    present = {name: frame for name, frame in sheets.items() if frame is not None}
    tables = {name: _headed(data, frame) for name, frame in present.items()}
    tables["definitions"] = _definitions(data, present)
    try:
        with replacing(target) as partial, pd.ExcelWriter(partial, engine="openpyxl") as book:
            for name, frame in tables.items():
                frame.to_excel(book, sheet_name=name, index=False, freeze_panes=(1, 1))
    except ModuleNotFoundError as error:
        raise MissingInput("openpyxl", f"this package, for format xlsx: {extra('excel')}", "export") from error
    return target


def _designs(data: Dataset) -> pd.DataFrame:
    """Read the designs within all limits, the best first."""
    if data.objective is not None:
        return best(data.folder, data.objective.name, MOST_ROWS)
    rows = load(data.folder)
    return rows[rows["status"] == 0].head(MOST_ROWS)


def _headed(data: Dataset, frame: pd.DataFrame) -> pd.DataFrame:
    """Convert a table to displayed units, and add the units to its headings."""
    shown = {
        name: quantity(name, data.units[name])
        for name in map(str, frame.select_dtypes("number"))
        if data.units.get(name)
    }
    # The heading is the dataset's name: a maximised output stays the negative that it is there.
    scaled = {name: frame[name] * abs(of.factor) for name, of in shown.items() if abs(of.factor) != 1.0}
    return frame.assign(**scaled).rename(columns={n: f"{n} [{of.unit}]" for n, of in shown.items() if of.unit})


def _definitions(data: Dataset, sheets: dict[str, pd.DataFrame]) -> pd.DataFrame:
    """Return definition and unit of every column of the sheets."""
    names = list(dict.fromkeys(str(name) for frame in sheets.values() for name in frame))
    numbers = {str(name) for frame in sheets.values() for name in frame.select_dtypes("number")}
    units = {name: quantity(name, data.units[name]).unit for name in numbers if data.units.get(name)}
    rows = [(name, units.get(name, ""), data.definitions.get(name, "")) for name in names]
    return pd.DataFrame(rows, columns=["column", "unit", "definition"])
