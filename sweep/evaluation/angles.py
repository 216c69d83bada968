"""Angles of a user's table: in rad, unless the table or the caller says degrees; what reads as degrees is refused."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from kernels.types import TWO_PI
from sweep.errors import InputError
from sweep.evaluation.tables import Parametrised, numbers
from sweep.families.base import Array
from sweep.families.domain import Domain, reads_as_degrees
from sweep.families.names import stem

if TYPE_CHECKING:
    from sweep.evaluation.tables import Table

AngleUnit: TypeAlias = Literal["rad", "deg"]

FACTORS = {"rad": 1.0, "deg": math.pi / 180.0}
REMEDY = (
    'for degrees say angles="deg" (--angles deg) or "{name} [deg]" as the column\'s name, for rad "rad" in the same way'
)

# Most parameters are angles between two directions, so one turn is all of them; the slack is for rounding.
# `reads_as_degrees` tells crank angles, the offset of a member, which is added to one, and the wrap of a thread.
MOST = TWO_PI * (1.0 + 1e-9)
TURNING = ("offset", "phi", "wrap")
_HEADER = re.compile(r"(\S+?)\s*\[\s*([^\]]*?)\s*\]\s*")


def in_radians(
    family: Parametrised,
    table: Table,
    angles: AngleUnit | None = None,
    others: Iterable[str] = (),
    domain: Domain | None = None,
) -> Table:
    """Return the table with its angles in rad, under the plain names of their columns.

    Parameters
    ----------
    family : whose parameters are looked for
    table : as the user gave it; a header such as ``alpha [deg]`` says the unit of its column
    angles : the unit of all angles without one in their header; None for rad that must be plausible
    others : names of further inputs, none of them an angle
    domain : whose variable may be a column too

    Returns
    -------
    Table
        the same object where nothing has to be converted

    Raises
    ------
    InputError
        for an unknown unit, a column that stands there twice, a parameter above 2 pi or crank angles that read as
        degrees while nothing says what they are.
    """
    _check_unit(angles)
    known = {p.name: p.unit == "angle" for p in family.parameters} | dict.fromkeys(others, False)
    variable = "" if domain is None else domain.name
    if domain is not None:
        known[variable] = domain.unit == "rad"
    if not (isinstance(table, Mapping) or hasattr(table, "columns")):
        return table  # no table: whoever reads it says so
    renamed, changed = {}, {}
    columns: Any = table
    for key in columns:
        found = _HEADER.fullmatch(str(key))
        name, unit = (found[1], found[2]) if found is not None and found[1] in known else (str(key), None)
        if unit is not None:
            renamed[key] = _plain_name(name, unit, known[name], table)
        if not known.get(name):
            continue
        if (unit or angles) == "deg":
            changed[name] = numbers(columns[key], name, f"column {key}, row") * FACTORS["deg"]
        elif unit is None and angles is None:
            _check_plausible(name, columns[key], name == variable or stem(name) in TURNING)
    if not renamed and not changed:
        return table
    if isinstance(table, Mapping):
        return {renamed.get(key, key): changed.get(str(renamed.get(key, key)), columns[key]) for key in columns}
    return table.rename(columns=renamed).assign(**changed)


def plain_names(table: Iterable[Any]) -> tuple[str, ...]:
    """Return the names of the columns without the units in their headers."""
    return tuple(found[1] if (found := _HEADER.fullmatch(str(key))) else str(key) for key in table)


def grid_in_radians(name: str, unit: str, phi: ArrayLike, angles: AngleUnit | None) -> ArrayLike:
    """Return the argument ``phi=`` in rad where the variable is an angle; as it is where it is not."""
    _check_unit(angles)
    if unit != "rad":
        return phi
    if angles == "deg":
        return np.asarray(numbers(phi, name, f"{name}, position")) * FACTORS["deg"]
    if angles is None:
        _check_plausible(name, phi, True)
    return phi


def _check_unit(angles: object) -> None:
    if angles is not None and angles not in FACTORS:
        raise InputError("angles", angles, '"rad" or "deg"', "angles")


def _plain_name(name: str, unit: str, is_angle: bool, table: Iterable[Any]) -> str:
    """Return the name without its unit; only angles have one, since lengths may be of any unit."""
    place = f"column {name} [{unit}]"
    if not is_angle:
        allowed = f"the column {name}: a table has one length unit throughout, only angles say theirs, as alpha [deg]"
        raise InputError("column", f"{name} [{unit}]", allowed, place)
    if unit not in FACTORS:
        raise InputError("unit", unit, "rad or deg", place)
    if name in map(str, table):
        raise InputError("column", name, f"either {name} or {name} [{unit}], not both", place)
    return name


def _check_plausible(name: str, values: Any, turns_on: bool) -> None:
    try:
        found = np.abs(numbers(values, name, "column"))
    except InputError:
        return  # whoever reads it says so, with the right row
    if found.size == 0 or np.maximum.reduce(found, axis=None) <= MOST:
        return  # the usual case, in one pass
    if is_plausible(float(np.max(found, initial=0.0, where=np.isfinite(found))), turns_on):
        return
    row = int(np.argmax(np.where(np.isfinite(found), found, 0.0)))
    raise InputError(
        name,
        _first(values, row),
        f"{'rad, which this does not look like' if turns_on else 'at most 2 pi, in rad'}; " + REMEDY.format(name=name),
        f"{'' if turns_on else 'column '}{name}, row {row}",
    )


def is_plausible(largest: float, turns_on: bool) -> bool:
    """Tell whether the largest magnitude of an angle can be one in rad; ``turns_on`` for one that counts full turns."""
    return not largest > MOST or (turns_on and not reads_as_degrees(largest))


def _first(values: Any, row: int) -> float:
    found: Array = np.atleast_1d(numbers(values, "angle", "column"))
    return float(found.flat[row])
