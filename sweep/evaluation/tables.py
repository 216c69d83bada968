"""From a user's table to a checked design matrix: every fault names column, row and the nearest right name."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np

from sweep.errors import InputError, nearest
from sweep.families.base import Array, Parameter

if TYPE_CHECKING:
    import pandas as pd

    Table: TypeAlias = pd.DataFrame | Mapping[str, Any]


class Parametrised(Protocol):
    """What has named columns: a family, or the requirement of a synthesis."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def parameters(self) -> tuple[Parameter, ...]: ...  # noqa: D102
    @property
    def parameter_names(self) -> tuple[str, ...]: ...  # noqa: D102


def design_matrix(
    family: Parametrised, table: Table, extra: Sequence[str] = (), unused: Container[str] = ()
) -> tuple[Array, dict[str, Array]]:
    """Check a table and lay its parameters out as the (n, P) matrix the kernels take.

    Parameters
    ----------
    family : whose parameters are expected
    table : DataFrame or mapping of equally long columns (scalars are repeated); missing columns take the default
    extra : further columns that may stand in the table (``phi``); returned separately if present
    unused : names that mean something elsewhere (inputs of effects that are not called for) and are no misspelling

    Raises
    ------
    InputError
        for a missing or misspelt column, a value that is no number, a nan or infinity, a length that is not positive.
    """
    known = [*family.parameter_names, *extra]
    names = _column_names(table)
    for name in names:
        missing = [k for k in known if k not in names]
        if name not in known and name not in unused and nearest(name, missing):
            raise InputError("column", name, f"the columns {', '.join(known)}{nearest(name, missing)}", "table")
    rows = _row_count(table, [n for n in names if n in known])
    matrix = np.empty((rows, len(family.parameters)))
    for k, parameter in enumerate(family.parameters):
        matrix[:, k] = _parameter_column(family, parameter, table, names, rows)
    extras = {name: np.broadcast_to(_column(table, name), rows) for name in extra if name in names}
    for name, values in extras.items():
        _refuse(~np.isfinite(values), values, name, "a finite number")
    return matrix, extras


def wanted_names(want: str | Sequence[str], place: str) -> list[str]:
    """The names of wanted outputs without repetition.

    Raises
    ------
    InputError
        if it is neither a name nor a list of names.
    """
    names = [want] if isinstance(want, str) else list(want) if isinstance(want, Iterable) else [want]
    for name in names:
        if not isinstance(name, str):
            raise InputError("want", name, "a name, or a list of names", place)
    return list(dict.fromkeys(names))


def _column_names(table: Table) -> list[str]:
    """Names of the columns, each once."""
    if not isinstance(table, Mapping) and not (hasattr(table, "columns") and hasattr(table, "iloc")):
        raise InputError("table", type(table).__name__, "a DataFrame, or a dict of columns", "table")
    names = [str(name) for name in table]
    for name in names:
        if names.count(name) > 1:
            raise InputError("column", name, f"each name once; it stands {names.count(name)} times", "table")
    return names


def _parameter_column(family: Parametrised, p: Parameter, table: Table, names: list[str], rows: int) -> Array:
    if p.name not in names:
        if p.default is not None:
            return np.full(rows, p.default)
        guess = nearest(p.name, [n for n in names if n not in family.parameter_names])
        present = ", ".join(names) or "none"
        raise InputError(
            p.name, "missing", f"a column with the {p.text}; found {present}{guess}", f"table of {family.name}"
        )
    values = np.broadcast_to(_column(table, p.name), rows)
    _refuse(~np.isfinite(values), values, p.name, "a finite number")
    if p.sign:
        _refuse(values <= 0.0 if p.positive else values < 0.0, values, p.name, f"a {p.sign} {p.unit}")
    if p.choices is not None:
        _refuse(~np.isin(values, p.choices), values, p.name, p.choice)
    return values


def _row_count(table: Table, names: list[str]) -> int:
    lengths: dict[str, int] = {}
    for name in names:
        shape = np.shape(np.asarray(table[name]))
        if len(shape) > 1:
            raise InputError(name, f"shape {shape}", "a plain column or one number", f"column {name}")
        if shape:
            lengths[name] = shape[0]
    if not lengths:
        return 1
    first, rows = next(iter(lengths.items()))
    for name, length in lengths.items():
        if length != rows:
            raise InputError(name, f"{length} rows", f"as many rows as column {first}, {rows}", f"column {name}")
    return rows


def _column(table: Table, name: str) -> Array:
    return numbers(table[name], name, f"column {name}, row")


def numbers(values: object, name: str, place: str) -> Array:
    """Values as float64.

    Raises
    ------
    InputError
        for the first that is no number, with its place
    """
    kind = np.asarray(values).dtype.kind
    try:
        if kind not in "mMc":  # a date, a time span or a complex number is none, though numpy would take it for one
            return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        pass
    rows = list(np.atleast_1d(np.asarray(values, dtype=object)).ravel())
    row = next((k for k, value in enumerate(rows) if kind in "mMc" or not _is_number(value)), 0)
    raise InputError(name, rows[row] if rows else values, "a number", f"{place} {row}")


def _is_number(value: Any) -> bool:
    try:
        float(value)
    except (TypeError, ValueError, OverflowError):
        return False
    return True


def _refuse(bad: np.ndarray[Any, np.dtype[np.bool_]], values: Array, name: str, allowed: str) -> None:
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(name, float(values[row]), allowed, f"column {name}, row {row}")
