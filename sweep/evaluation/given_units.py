"""Numbers that say their unit: texts such as "20 g", and quantities of pint, brought to mm, t, s, rad and N."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from sweep.errors import InputError
from sweep.quantities.units import UnitFault, example, factor, split


def plain(values: Any, internal: str, name: str, place: str = "units") -> Any:
    """Return values without their units, in the internal one; what says no unit stays as it is.

    Parameters
    ----------
    values : a number, a text, a quantity of pint, or a column of any of them
    internal : the unit that a bare number has, as "mm" or "rad/s"
    name, place : for messages

    Raises
    ------
    InputError
        for a unit that is unknown or measures something else.
    """
    if isinstance(values, int | float):
        return values
    if _says(values):
        return _of_one(values, internal, name, place)
    bare = getattr(getattr(values, "dtype", None), "kind", "O") != "O" or getattr(values, "ndim", 1) == 0
    if bare or isinstance(values, str | bytes) or not isinstance(values, Iterable):
        return values
    rows = list(values)
    if not any(map(_says, rows)):
        return values
    return [_of_one(value, internal, name, place) if _says(value) else value for value in rows]


def _says(value: object) -> bool:
    """Tell whether one value says its unit; a text that is a bare number does not, nor one that begins with none."""
    if isinstance(value, str):
        text = value.strip()
        if not text[:1].isdigit() and text[:1] not in ("+", "-", "."):
            return False
        try:
            float(text)
        except ValueError:
            return True
        return False
    return hasattr(value, "magnitude") and hasattr(value, "to")


def _of_one(value: Any, internal: str, name: str, place: str) -> Any:
    if isinstance(value, str):
        try:
            number, unit = split(value, internal)
            return number * factor(unit, internal)
        except UnitFault as fault:
            raise InputError(name, value, str(fault), place) from None
    try:
        return value.to("dimensionless" if internal == "1" else internal).magnitude
    except (ValueError, TypeError, AttributeError) as error:  # what pint raises for another dimension is a TypeError
        raise InputError(name, str(value), example(internal), place) from error


def heading_factor(name: str, unit: str, internal: str) -> float:
    """Return what a column whose heading says its unit is multiplied by, as `m_crank [g]`.

    Raises
    ------
    InputError
        for a unit that is unknown or measures something else.
    """
    try:
        return factor(unit, internal)
    except UnitFault as fault:
        raise InputError("unit", unit, str(fault), f"column {name} [{unit}]") from None


def speed_given(speed: Any) -> float | None:
    """Return a speed of the driving shaft in rad/s, from a number or from what says its unit."""
    found = plain(speed, "rad/s", "speed")
    return None if found is None else float(np.float64(found))
