"""Angles of a user's table: rad unless the table or the caller says degrees; values that look like degrees raise."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from kernels.types import TWO_PI
from sweep.errors import InputError
from sweep.evaluation.tables import Parametrised, Table, numbers
from sweep.families.base import Domain, Parameter
from sweep.families.names import stem
from sweep.families.parameter import reads_as_degrees
from sweep.quantities.units import heading_factor, internal_unit, plain

AngleUnit: TypeAlias = Literal["rad", "deg"]

RADIANS = math.pi / 180.0  # of a degree
REMEDY = (
    'for degrees write "90 deg", or "{name} [deg]" as the column\'s name, or angles="deg" (--angles deg) where that is '
    'an argument; if they are in rad, "{name} [rad]", or angles="rad" (--angles rad)'
)

# Most angles lie between two directions and are at most one turn, with slack for rounding.  Crank angles, the offset of
# a member, which is added to one, and the wrap of a thread may exceed it: `reads_as_degrees` checks these.
MOST = TWO_PI * (1.0 + 1e-9)
TURNING = ("offset", "phi", "wrap")
_HEADER = re.compile(r"(\S+?)\s*\[\s*([^\]]*?)\s*\]\s*")


def in_radians(
    family: Parametrised,
    table: Table,
    angles: AngleUnit | None = None,
    others: Mapping[str, Parameter] = MappingProxyType({}),
    domain: Domain | None = None,
) -> Table:
    """Convert a table to angles in rad and other values in mm, t, s ..., under plain column names without units.

    Parameters
    ----------
    family : gives the known parameters
    table : the user's table; a header such as ``alpha [deg]`` or ``m_crank [g]`` gives the unit of its column, a text
        such as "20 g" or a quantity of pint that of one value
    angles : unit of all angles without one in their header; None for rad that must be plausible
    others : further inputs by name, none of them an angle
    domain : the variable of this domain may be a column too

    Returns
    -------
    Table
        the same object where nothing has to be converted

    Raises
    ------
    InputError
        for an unknown unit, a column given twice, and, without a unit, a parameter above 2 pi or crank angles that look
        like degrees.
    """
    _check_unit(angles)
    units: dict[str, str] = {name: p.unit for name, p in others.items()}
    units |= {p.name: p.unit for p in family.parameters}
    variable = "" if domain is None else domain.name
    if domain is not None:
        units[variable] = domain.unit
    if not (isinstance(table, Mapping) or hasattr(table, "columns")):
        return table  # not a table: the reader of the table raises
    renamed: dict[Any, str] = {}
    changed: dict[str, Any] = {}
    columns: Any = table
    for key in columns:
        match = _HEADER.fullmatch(str(key))
        name, unit = (match[1], match[2]) if match is not None and match[1] in units else (str(key), None)
        values = columns[key]
        if unit is not None:
            if name in map(str, table):
                place = f"column {name} [{unit}]"
                raise InputError("column", name, f"either {name} or {name} [{unit}], not both", place)
            if name in renamed.values():
                raise InputError("column", name, "one heading with its unit, not two", f"column {key}")
            renamed[key] = name
            scale = heading_factor(name, unit, internal_unit(units[name]))
            if scale != 1.0:
                changed[name] = numbers(values, name, f"column {key}, row") * scale
            continue
        if name not in units:
            continue
        if not isinstance(values, np.ndarray | float | int) or getattr(values, "dtype", "") == np.object_:
            converted = plain(values, internal_unit(units[name]), name, f"column {name}")
            if converted is not values:
                changed[name] = converted
                continue
        if units[name] not in ("angle", "rad"):
            continue
        if angles == "deg":
            changed[name] = numbers(values, name, f"column {key}, row") * RADIANS
        elif angles is None:
            _check_plausible(name, values, name == variable or stem(name) in TURNING)
    if not renamed and not changed:
        return table
    if isinstance(table, Mapping):
        return {renamed.get(key, key): changed.get(str(renamed.get(key, key)), columns[key]) for key in columns}
    return table.rename(columns=renamed).assign(**changed)


def plain_names(table: Iterable[Any]) -> tuple[str, ...]:
    """Return the column names without the units in their headers."""
    return tuple(match[1] if (match := _HEADER.fullmatch(str(key))) else str(key) for key in table)


def grid_in_radians(domain: Domain, phi: ArrayLike, angles: AngleUnit | None) -> ArrayLike:
    """Convert the argument ``phi=`` to rad if the variable is an angle; otherwise it is returned as it is."""
    _check_unit(angles)
    name = domain.name
    converted: ArrayLike = plain(phi, internal_unit(domain.unit), name)
    if converted is not phi:
        return np.asarray(converted, np.float64)
    if domain.unit != "rad":
        return phi
    if angles == "deg":
        return np.asarray(numbers(phi, name, f"{name}, position")) * RADIANS
    if angles is None:
        _check_plausible(name, phi, True)
    return phi


def _check_unit(angles: object) -> None:
    if angles is not None and angles not in ("rad", "deg"):
        raise InputError("angles", angles, '"rad" or "deg"', "angles")


def _check_plausible(name: str, values: Any, turns_on: bool) -> None:
    try:
        sizes = np.abs(numbers(values, name, "column"))
    except InputError:
        return  # the reader of the column raises, with the right row
    if sizes.size == 0 or np.maximum.reduce(sizes, axis=None) <= MOST:
        return  # the usual case, in one pass
    if is_plausible(float(np.max(sizes, initial=0.0, where=np.isfinite(sizes))), turns_on):
        return
    row = int(np.argmax(np.where(np.isfinite(sizes), sizes, 0.0)))
    value = float(np.atleast_1d(numbers(values, "angle", "column")).flat[row])
    allowed, column = ("rad, which this does not look like", "") if turns_on else ("at most 2 pi, in rad", "column ")
    raise InputError(name, value, f"{allowed}; {REMEDY.format(name=name)}", f"{column}{name}, row {row}")


def is_plausible(largest: float, turns_on: bool) -> bool:
    """Whether the largest magnitude of an angle may be in rad; ``turns_on`` marks angles that count full turns."""
    return not largest > MOST or (turns_on and not reads_as_degrees(largest))
