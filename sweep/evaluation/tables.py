"""Conversion of a user's table to a checked design matrix: every error names column, row and the nearest name."""

from __future__ import annotations

import math
from collections.abc import Collection, Container, Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np

from sweep.errors import InputError, MissingInput, choices, listed, nearest
from sweep.families.base import Array, Parameter

if TYPE_CHECKING:
    import pandas as pd

Table: TypeAlias = "pd.DataFrame | Mapping[str, Any]"

FORMS = (
    "a DataFrame of pandas, or a dict of columns; most other tables become one by .to_pandas(), "
    "a Series with the values of one design by .to_dict(), a list of designs by pandas.DataFrame(list)"
)
MOST_MASS = 10.0  # t: a bare 20 is probably meant in grams
FEW = 64  # rows of a table that is converted as a whole: extracting single columns takes longer than computing poses


class Parametrised(Protocol):
    """Anything with named columns: a family, or the requirement of a synthesis."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def parameters(self) -> tuple[Parameter, ...]: ...  # noqa: D102
    @property
    def parameter_names(self) -> tuple[str, ...]: ...  # noqa: D102


@dataclass(frozen=True)
class Sheet:
    """The columns that one function reads."""

    name: str
    parameters: tuple[Parameter, ...]

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the columns in order."""
        return tuple(p.name for p in self.parameters)


def design_matrix(
    family: Parametrised, table: Table, extra: Sequence[str] = (), unused: Container[str] = ()
) -> tuple[Array, dict[str, Array]]:
    """Check a table and arrange its parameters as the (n, P) matrix of the kernels.

    Parameters
    ----------
    family : gives the expected parameters
    table : DataFrame or mapping of equally long columns (scalars are repeated); missing columns take the default
    extra : further columns that the table may have (``phi``); returned separately if present
    unused : names with a meaning elsewhere (inputs of effects that are not wanted), which are no misspellings; their
        columns must have the same length

    Raises
    ------
    InputError
        for a missing or misspelt column, a value that is not a finite number, or a wrong sign.
    """
    names = [*family.parameter_names, *extra]
    keys = _column_names(table)
    for name in keys:
        if name not in names and name not in unused:
            guess = nearest(name, [k for k in names if k not in keys])
            if guess:
                raise InputError("column", name, f"the columns {listed(names)}{guess}", "table")
    columns = {name: numbers(table[key], name, f"column {name}, row") for name, key in keys.items() if name in names}
    unread = {name: np.asarray(table[key]) for name, key in keys.items() if name in unused and name not in columns}
    rows = _row_count(columns | unread)
    matrix = np.empty((rows, len(family.parameters)))
    for k, parameter in enumerate(family.parameters):
        matrix[:, k] = _checked_column(family, parameter, columns, keys)
    extras = {}
    for name in [name for name in extra if name in columns]:
        extras[name] = values = np.empty(rows)
        values[:] = columns[name]
        refuse_rows(~np.isfinite(values), values, name, "a finite number")
    return matrix, extras


def one_design(family: Parametrised, table: Table, unused: Container[str] = ()) -> Array:
    """Check a table of one design, as pictures and cyclograms need it; (1, P)."""
    matrix, _ = design_matrix(family, table, unused=unused)
    if len(matrix) != 1:
        raise InputError("design", f"{len(matrix)} rows", "the parameters of one design", f"table of {family.name}")
    return matrix


def plain_columns(table: Table) -> Table:
    """Extract the columns of a DataFrame once, as arrays; columns that are not plain numbers stay as they are.

    Every access to a column of a DataFrame takes as long as a pose.  A table with two columns of one name is returned
    unchanged: the reader of the table raises.
    """
    import pandas as pd

    _check_kind(table)
    if not isinstance(table, pd.DataFrame) or not table.columns.is_unique:
        return table
    columns: dict[Any, Any] = {}
    if len(table) <= FEW and (block := table.to_numpy()).dtype.kind in "fiu":
        return dict(zip(table.columns, block.T, strict=True))
    for name, values in table.items():
        is_numeric = isinstance(values.dtype, np.dtype) and values.dtype.kind in "fiu"
        columns[name] = values.to_numpy() if is_numeric else values
    return columns


def wanted_names(want: str | Sequence[str], place: str) -> list[str]:
    """Return the names of wanted outputs without repetition, from a list or from one text between commas.

    Raises
    ------
    InputError
        if ``want`` is neither a name nor a list of names.
    """
    if isinstance(want, str):
        return list(dict.fromkeys(name.strip() for name in want.split(",")))
    names = list(want) if isinstance(want, Iterable) else [want]
    for name in names:
        if not isinstance(name, str):
            raise InputError("want", name, "a name, or a list of names", place)
    return list(dict.fromkeys(names))


def kept_columns(table: Table, keep: bool | str | Sequence[str], made: Collection[str], rows: int) -> dict[str, Any]:
    """Select the input columns to be repeated at the front of a result, unchanged.

    Parameters
    ----------
    table : as for `design_matrix`
    keep : True for all columns except those with the name of a result; or some names; False for none
    made : names of the results
    rows : number of designs; single numbers are repeated

    Raises
    ------
    InputError
        for a name that the table does not have or that is a result, or a column of another length.
    """
    if keep is False:
        return {}
    keys = _column_names(table)
    names = [name for name in keys if name not in made] if keep is True else wanted_names(keep, "keep")
    columns: dict[str, Any] = {}
    for name in names:
        if name not in keys:
            raise InputError("keep", name, f"columns of the table: {choices(name, keys)}", "table")
        if name in made:
            raise InputError("keep", name, "another name: the result has a column of this one itself", "table")
        values = table[keys[name]]
        if isinstance(values, str) or not hasattr(values, "__len__"):
            columns[name] = [values] * rows
        elif len(values) == rows:
            columns[name] = getattr(values, "array", values)  # the values of a Series, without its index
        else:
            raise InputError(name, f"{len(values)} rows", f"as many rows as there are designs, {rows}", "keep")
    return columns


def _check_kind(table: object) -> None:
    if not isinstance(table, Mapping) and not (hasattr(table, "columns") and hasattr(table, "iloc")):
        raise InputError("table", type(table).__name__, FORMS, "table")


def _column_names(table: Table) -> dict[str, Any]:
    """Map column names to the table's keys; raise for repeated names."""
    _check_kind(table)
    names = [str(key) for key in table]
    for name in names if len(set(names)) < len(names) else ():
        if names.count(name) > 1:
            raise InputError("column", name, f"each name once; it stands {names.count(name)} times", "table")
    return dict(zip(names, table, strict=True))


def _checked_column(
    family: Parametrised, p: Parameter, columns: Mapping[str, Array], keys: Iterable[str]
) -> Array | float:
    """Return the checked column of a parameter, a number if it is the same for all rows, or its default."""
    if p.name not in columns:
        default = p.left_out(columns)
        if default is not None:
            return default
        guess = nearest(p.name, [n for n in keys if n not in family.parameter_names])
        present = ", ".join(keys) or "none"
        raise MissingInput(p.name, f"a column with the {p.text}; found {present}{guess}", f"table of {family.name}")
    values = columns[p.name]
    # Minimum and maximum show in two passes whether a value is invalid: nan makes both nan.
    if not values.ndim:
        least = largest = float(values)
    elif values.size:
        least, largest = np.minimum.reduce(values), np.maximum.reduce(values)
    else:
        return values
    if not math.isfinite(least) or not math.isfinite(largest):
        refuse_rows(~np.isfinite(values), values, p.name, "a finite number")
    if p.sign and (p.not_zero or p.wrong_sign(least)):
        refuse_rows(p.wrong_sign(values), values, p.name, f"a {p.sign} {p.unit}")
    if p.unit == "mass" and largest > MOST_MASS:
        allowed = (
            f'a mass below {MOST_MASS:g} t, as bare masses are tonnes: "20 g", or 2e-5; '
            'with lengths in metres "20 kg" and "0.3 m"'
        )
        refuse_rows(values > MOST_MASS, values, p.name, allowed)
    if p.choices is not None and not (least == largest and least in p.choices):
        refuse_rows(np.logical_and.reduce([values != x for x in p.choices]), values, p.name, p.choice)
    return values


def _row_count(columns: Mapping[str, Array]) -> int:
    lengths: dict[str, int] = {}
    for name, values in columns.items():
        if values.ndim > 1:
            raise InputError(name, f"shape {values.shape}", "a plain column or one number", f"column {name}")
        if values.ndim:
            lengths[name] = len(values)
    if not lengths:
        return 1
    first, rows = next(iter(lengths.items()))
    for name, length in lengths.items():
        if length != rows:
            raise InputError(name, f"{length} rows", f"as many rows as column {first}, {rows}", f"column {name}")
    return rows


def numbers(values: object, name: str, place: str) -> Array:
    """Convert values to float64.

    Raises
    ------
    InputError
        for the first value that is not a number, with its place; for a set, which has no order, and for an iterator
    """
    if isinstance(values, AbstractSet | Iterator):
        raise InputError(name, values, "a number, or a list or array of numbers", place.partition(",")[0])
    array = _converted(values)
    if array is not None:
        return array
    rows = _entries(values)
    kind = getattr(getattr(values, "dtype", None), "kind", "")
    row = next((k for k, value in enumerate(rows) if kind in ("m", "M", "c") or not _is_number(value)), 0)
    raise InputError(name, rows[row] if rows else values, "a number", f"{place} {row}")


def _converted(values: object) -> Array | None:
    """Convert values to float64; None if one of them is not a number."""
    try:
        array = np.asarray(values)
        # Dates, time spans and complex numbers are rejected, although numpy would convert them.
        if array.dtype.kind in "mMc" or (array.dtype.kind == "O" and not all(map(_is_number, array.flat))):
            return None
        if isinstance(values, np.ma.MaskedArray):  # otherwise numpy takes what is under the mask
            return np.asarray(np.ma.filled(values.astype(np.float64), np.nan))
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):  # ragged lists among them
        return None


def _entries(values: object) -> list[Any]:
    """List the entries of the rows, of any type; a scalar gives one row."""
    if isinstance(values, np.ndarray):
        return list(values.flat)
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        return [values]
    return list(values)


def _is_number(value: Any) -> bool:
    if isinstance(value, (np.complexfloating, np.datetime64, np.timedelta64, np.ndarray)):
        return False
    try:
        float(value)
    except (TypeError, ValueError, OverflowError):
        return value is None or type(value).__name__ == "NAType"  # an empty cell: nan, which has its own message
    return True


def index_of(table: Table, rows: int) -> pd.Index:
    """Row labels of a table; a range from 0 where it has none."""
    import pandas as pd

    return table.index if isinstance(table, pd.DataFrame) else pd.RangeIndex(rows)


def frame_of(columns: Mapping[str, Any], index: pd.Index | None, copy: bool) -> pd.DataFrame:
    """Make a DataFrame; the names become labels once, as that would take a third of the time of a small table."""
    import pandas as pd

    frame = pd.DataFrame(dict(enumerate(columns.values())), index=index, copy=copy)
    frame.columns = _labels(tuple(columns)).view()  # a view, because a user may name the labels
    return frame


@lru_cache
def _labels(names: tuple[str, ...]) -> pd.Index:
    import pandas as pd

    return pd.Index(names)


def refuse_rows(bad: Any, values: Array, name: str, allowed: str) -> None:
    """Raise for the first value of a column that is ``bad``, with its row and the allowed values."""
    if bad.any():
        row = int(np.argmax(bad))
        value = float(values.flat[row])
        gap = "; an empty cell is read as nan" if math.isnan(value) else ""
        raise InputError(name, value, allowed + gap, f"column {name}, row {row}")


def parameter_units(parameters: Iterable[Parameter]) -> dict[str, str]:
    """Units of parameters in result tables: "length" is the user's length unit, angles are in rad."""
    return {p.name: {"angle": "rad", "ratio": "1", "sign": "1"}.get(p.unit, p.unit) for p in parameters}
