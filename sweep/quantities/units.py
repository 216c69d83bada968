"""Conversion of written units: numbers, texts such as "20 g" and quantities of pint to mm, t, s, rad or bytes.

Forces in N, couples in N mm, pressures in MPa are consistent with lengths in mm, times in s and masses in tonnes: no
equation of motion contains a conversion factor.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import numpy as np

from sweep.errors import InputError, nearest
from sweep.families.parameter import QUANTITIES, spelt_out

# Base units, then derived units as a factor and base units; an angle is a dimension, so 45 is not 45 rad.
_BASE = ("mm", "rad", "s", "t", "B")
_DERIVED = {
    "um": (1e-3, "mm"),
    "cm": (10.0, "mm"),
    "m": (1000.0, "mm"),
    "in": (25.4, "mm"),
    "mrad": (1e-3, "rad"),
    "deg": (math.pi / 180, "rad"),
    "rev": (2 * math.pi, "rad"),
    "ms": (1e-3, "s"),
    "min": (60.0, "s"),
    "h": (3600.0, "s"),
    "kg": (1e-3, "t"),
    "g": (1e-6, "t"),
    "lb": (0.45359237e-3, "t"),
    "N": (1.0, "t*mm/s^2"),
    "kN": (1e3, "t*mm/s^2"),
    "gf": (9.80665e-3, "t*mm/s^2"),
    "lbf": (0.45359237 * 9.80665, "t*mm/s^2"),
    "cN": (1e-2, "t*mm/s^2"),
    "Nm": (1e3, "t*mm^2/s^2"),
    "Nmm": (1.0, "t*mm^2/s^2"),
    "kPa": (1e-3, "t/mm/s^2"),
    "MPa": (1.0, "t/mm/s^2"),
    "GPa": (1e3, "t/mm/s^2"),
    "rpm": (2 * math.pi / 60, "rad/s"),
    "MB": (1e6, "B"),
    "GB": (1e9, "B"),
    "%": (1e-2, "1"),
}
SYMBOLS = (*_BASE, *_DERIVED)
# Alternative spellings of a symbol: "90°", "2 inch", both code points of the micro sign.
_ALIASES = {"°": "deg", "degrees": "deg", "inch": "in", "\u00b5m": "um", "\u03bcm": "um", "RPM": "rpm", "sec": "s"}
# Signs for products and powers, as results print them: "N·mm", "mm/rad²".
_SIGNS = str.maketrans({"·": "*", "\u22c5": "*", "¹": "1", "²": "2", "³": "3", "⁴": "4", "⁻": "-"})
# A speed of a shaft is counted in turns per minute where it is written without them.
_PER_MINUTE = ("1/min", "min^-1", "min-1", "r/min", "U/min")

LARGEST = 1e100  # magnitude allowed in a study, so that conversion to internal units does not overflow
# Allowed inputs by internal unit, as messages write them.
_EXAMPLES = dict(QUANTITIES.values()) | {"B": "a size, in B, MB or GB", "1": 'a pure number, as 0.5 or "50 %"'}

_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)", re.DOTALL)
_TERM = re.compile(r"(?:([A-Za-z%°\u00b5\u03bc]+)(?:\^?(-?[1-9]))?|1)")


class UnitFault(ValueError):
    """Unknown unit, or a unit of the wrong kind; the text says which units are allowed."""


def example(internal: str) -> str:
    """Words for the inputs that are allowed for an internal unit."""
    return _EXAMPLES.get(internal, f"in units such as {internal}")


@lru_cache
def internal_unit(word: str) -> str:
    """Return the internal unit of a unit word: "length" -> "mm", "force/length" -> "N/mm", "sign" -> "1"."""
    word = spelt_out(word)
    names = re.findall(r"[A-Za-z]+", word)
    return word if names and set(names) <= set(SYMBOLS) else "1"


@lru_cache
def factor(unit: str, internal: str) -> float:
    """Factor from a written unit to the internal one.

    Angles count as a dimension, so 45 deg is not a pure number; an analogue such as d2s may be given per rad or rad^2.

    Raises
    ------
    UnitFault
        if the unit is unknown or measures something else.
    """
    ours, own = _parsed(internal)
    try:
        theirs, powers = _parsed("rpm" if internal == "rad/s" and _plainly(unit) in _PER_MINUTE else unit)
    except UnitFault:
        offered = re.split(", | or ", example(internal).partition(", in ")[2])  # a foot is no misspelt ton
        raise UnitFault(f"{example(internal)}{nearest(unit, offered)}") from None
    # Angles are ignored where neither unit has them in its numerator, as for d2s per rad^2.
    free = own["rad"] <= 0 and powers["rad"] <= 0
    if any(own[base] != powers[base] for base in _BASE if not (free and base == "rad")):
        raise UnitFault(example(internal))
    return theirs / ours


def split(text: str, internal: str) -> tuple[float, str]:
    """Return the number and unit of a text such as "7000 rpm".

    Raises
    ------
    UnitFault
        if there is no number, or no unit where one is needed, or if the number is beyond 1e100.
    """
    match = _NUMBER.fullmatch(text.strip().replace("\u2212", "-"))  # a minus as reports print it
    if match is not None and match[2].startswith(","):
        raise UnitFault(f"a decimal point, no comma; {example(internal)}")
    if match is None or not match[2] or not math.isfinite(float(match[1])):
        raise UnitFault(f"a number and its unit; {example(internal)}")
    if abs(float(match[1])) > LARGEST:
        raise UnitFault(f"a number of magnitude up to {LARGEST:g} and its unit; {example(internal)}")
    return float(match[1]), match[2]


def unquoted(value: object, kind: str = "float_type") -> str:
    """Say that a number or a truth value stands without quotes, where a study has it in quotes."""
    bare = isinstance(value, str) and (match := _NUMBER.fullmatch(value.strip())) is not None and not match[2]
    fits = bare if kind in ("float_type", "int_type") else kind == "bool_type" and value in ("true", "false")
    return ", without quotes" if fits else ""


def read(text: str, internal: str) -> float:
    """Read a text such as "7000 rpm" in the internal unit.

    Raises
    ------
    UnitFault
        as of :func:`split`, or for a unit of another kind.
    """
    number, unit = split(text, internal)
    return number * factor(unit, internal)


def _plainly(text: str) -> str:
    """Write a unit with ASCII signs only: "N mm", "N·mm" and "m/s²" become "N*mm", "N*mm" and "m/s2".

    A space is a product before the first slash; in "N/m s" it could be either.
    """
    text = re.sub(r"\s*([*/])\s*", r"\1", text.strip().translate(_SIGNS).replace("**", "^"))
    above, slash, below = text.partition("/")
    return re.sub(r"\s+", "*", above) + slash + below


def _parsed(text: str) -> tuple[float, Counter[str]]:
    """Parse a product of known symbols with integer exponents into a size in base units and their powers."""
    parts = re.split(r"([*/])", _plainly(text))
    size, powers = 1.0, Counter[str]()
    for operator, part in zip(["*", *parts[1::2]], parts[::2], strict=True):
        match = _TERM.fullmatch(part)
        symbol = part if match is None else _ALIASES.get(match[1] or part, match[1] or part)
        if match is None or symbol not in (*SYMBOLS, "1"):
            raise UnitFault(text)
        own, of = _DERIVED.get(symbol, (1.0, symbol))
        known = Counter() if of == "1" else Counter([of]) if of in _BASE else _parsed(of)[1]
        exponent = int(match[2] or 1)
        size = size * own**exponent if operator == "*" else size / own**exponent
        for base, power in known.items():
            powers[base] += (exponent if operator == "*" else -exponent) * power
    return size, powers


def plain(values: Any, internal: str, name: str, place: str = "units") -> Any:
    """Convert values with units to the internal unit; values without units are returned unchanged.

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
        return one_value(values, internal, name, place)
    bare = getattr(getattr(values, "dtype", None), "kind", "O") != "O" or getattr(values, "ndim", 1) == 0
    if bare or isinstance(values, str | bytes) or not isinstance(values, Iterable):
        return values
    rows = list(values)
    if not any(map(_says, rows)):
        return values
    return [one_value(v, internal, name, f"{place}, row {k}") if _says(v) else v for k, v in enumerate(rows)]


def _says(value: object) -> bool:
    """Whether a value carries a unit; a text that is a bare number, or does not begin with a number, does not."""
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


def one_value(value: Any, internal: str, name: str, place: str) -> Any:
    """Convert one value with a unit to the internal unit; arguments and errors as in `plain`."""
    if isinstance(value, str):
        try:
            number, unit = split(value, internal)
            return number * factor(unit, internal)
        except UnitFault as fault:
            raise InputError(name, value, str(fault), place) from None
    try:
        return value.to("dimensionless" if internal == "1" else internal).magnitude
    except (ValueError, TypeError, AttributeError) as error:  # pint raises a TypeError for another dimension
        raise InputError(name, str(value), example(internal), place) from error


def heading_factor(name: str, unit: str, internal: str) -> float:
    """Factor that converts a column whose heading gives its unit, such as `m_crank [g]`.

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
    """Speed of the driving shaft in rad/s, from a number or a value with a unit; None stays None."""
    found = plain(speed, "rad/s", "speed")
    return None if found is None else float(np.float64(found))
