"""Conversion between tables and the arrays of a thread kernel."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd

from sweep.errors import MeasuredRangeWarning
from sweep.evaluation.angles import in_radians
from sweep.evaluation.tables import Parametrised, Table, design_matrix
from sweep.evaluation.tables import Sheet as Sheet
from sweep.families.base import Array, Parameter
from sweep.families.machines.thread_balance import Range


def columns_of(sheet: Parametrised, table: Table) -> dict[str, Array]:
    """Return the checked columns by name, each (n,) and contiguous; a header such as ``wrap [deg]`` gives its unit."""
    matrix, _ = design_matrix(sheet, in_radians(sheet, table))
    return {name: np.ascontiguousarray(matrix[:, k]) for k, name in enumerate(sheet.parameter_names)}


def matrix_of(columns: Mapping[str, Array], names: tuple[str, ...]) -> Array:
    """Stack columns into a matrix (n, len(names))."""
    return np.ascontiguousarray(np.column_stack([columns[name] for name in names]))


def frame(
    table: Table, columns: Mapping[str, np.ndarray[tuple[int, ...], np.dtype[np.generic]]], units: Mapping[str, str]
) -> pd.DataFrame:
    """Build a result DataFrame of columns (n,) or (n, 1), with the index of the input table.

    Keys of ``units`` are units, values the names of the columns in that unit, separated by blanks.
    """
    index = table.index if isinstance(table, pd.DataFrame) else None
    result = pd.DataFrame({name: np.asarray(x).reshape(len(x)) for name, x in columns.items()}, index=index)
    result.attrs["units"] = {name: unit for unit, names in units.items() for name in names.split()}
    return result


def warn_outside(values: Array, measured: Range, constants: tuple[Parameter, ...], table: Table) -> None:
    """Warn once if values lie outside the range in which the published constants were measured.

    There is no warning for a table with its own constants, whose range only the user knows.
    """
    if any(p.name in list(table) for p in constants):
        return
    outside = int(((values < measured.low) | (values > measured.high)).sum())
    if outside:
        text = (
            f"{measured.name} = {values.min():g} to {values.max():g} {measured.unit}: {outside} of {values.size} values"
        )
        span = f"{measured.low:g} to {measured.high:g} {measured.unit}"
        warnings.warn(f"{text} outside {span}, where the constants were measured", MeasuredRangeWarning, stacklevel=3)


def computed(table: Table, units: Mapping[str, str], kernel: Callable[..., object], *arguments: Array) -> pd.DataFrame:
    """Call ``kernel(*arguments, status, *outputs)``, each output (n, 1), and return the result as :func:`frame` does.

    ``units`` names the outputs in the kernel's order.
    """
    n = len(arguments[0])
    status, names = np.zeros((n, 1), np.uint8), " ".join(units.values()).split()
    columns = {name: np.empty((n, 1)) for name in names}
    kernel(*arguments, status, *columns.values())
    return frame(table, columns | {"status": status}, units)
