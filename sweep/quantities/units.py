"""Written units: a number and its unit to mm, t, s, rad and what follows from them, or bytes.

Forces in N, couples in N mm, pressures in MPa are consistent with lengths in mm, times in s and masses in tonnes: no
factor stands in any equation of motion.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import TYPE_CHECKING

from sweep.errors import nearest
from sweep.families.parameter import spelt_out

if TYPE_CHECKING:
    import pint

# The registry is built from these lines alone: pint's own file makes an angle a pure number, so 45 would pass for
# 45 rad, and it takes 50 times as long to load.
_DEFINITIONS = (
    "millimetre = [length] = mm",
    "micrometre = 1e-3 * millimetre = um",
    "centimetre = 10 * millimetre = cm",
    "metre = 1000 * millimetre = m",
    "inch = 25.4 * millimetre = in",
    "radian = [angle] = rad",
    "milliradian = 1e-3 * radian = mrad",
    f"degree = {math.pi / 180!r} * radian = deg",
    f"revolution = {2 * math.pi!r} * radian = rev",
    "second = [time] = s",
    "millisecond = 1e-3 * second = ms",
    "minute = 60 * second = min",
    "hour = 3600 * second = h",
    "tonne = [mass] = t",
    "kilogram = 1e-3 * tonne = kg",
    "gram = 1e-6 * tonne = g",
    "newton = tonne * millimetre / second ** 2 = N",
    "kilonewton = 1e3 * newton = kN",
    "gram_force = 9.80665e-3 * newton = gf",
    "megapascal = newton / millimetre ** 2 = MPa",
    "revolution_per_minute = revolution / minute = rpm",
    "byte = [information] = B",
    "megabyte = 1e6 * byte = MB",
    "gigabyte = 1e9 * byte = GB",
    "percent = 1e-2 = %",
)
SYMBOLS = tuple(line.rsplit(" = ", 1)[1] for line in _DEFINITIONS)
# Other ways to write a symbol: "90°", "2 inch", both code points of the micro sign.
_ALIASES = {"°": "deg", "inch": "in", "\u00b5m": "um", "\u03bcm": "um"}

LARGEST = 1e100  # number that may stand in a study: with a unit it must not overflow
# What may stand for an internal unit, as messages say it.
_EXAMPLES = {
    "mm": "a length, in mm, um, cm, m or inch",
    "rad": "an angle, in deg, rad, mrad or rev",
    "t": "a mass, in kg, g or t",
    "N": "a force, in N or kN",
    "N*mm": "a torque, in N*mm or N*m",
    "t*mm^2": "an inertia, in kg*mm^2, g*mm^2, kg*m^2 or t*mm^2",
    "MPa": "a pressure, in MPa, N/mm^2 or kN/m^2",
    "N/mm": "a stiffness, in N/mm, N/m or kN/mm",
    "N*s/mm": "a damping, in N*s/mm or N*s/m",
    "N*mm*s": "a torque over a speed, in N*m/rpm, N*m*s or N*mm*s",
    "mm/s^2": "an acceleration, in m/s^2 or mm/s^2",
    "rad/s^2": "an angular acceleration, in rad/s^2",
    "rad/s": "a speed of rotation, in rpm, rad/s or deg/s",
    "s": "a time, in s, ms, min or h",
    "B": "a size, in B, MB or GB",
    "1": "a pure number: no unit, or 1 or %",
}

_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)", re.DOTALL)
_TERM = re.compile(r"([A-Za-z%°\u00b5\u03bc]+|1)(?:\^(-?[1-9]))?")


class UnitFault(ValueError):
    """A unit that is unknown or of the wrong kind; the text says what is allowed."""


def example(internal: str) -> str:
    """Return what may stand where the internal unit is ``internal``, in words."""
    return _EXAMPLES.get(internal, f"in units such as {internal}")


def internal_unit(word: str) -> str:
    """Return the internal unit of a unit word: "length" -> "mm", "force/length" -> "N/mm", "sign" -> "1"."""
    word = spelt_out(word)
    names = re.findall(r"[A-Za-z]+", word)
    return word if names and set(names) <= set(SYMBOLS) else "1"


@lru_cache
def factor(unit: str, internal: str) -> float:
    """Multiplier from a written unit to the internal one.

    Angles count as a dimension, so 45 deg is no ratio; but an analogue such as d2s may be given per rad or rad^2.

    Raises
    ------
    UnitFault
        if the unit is unknown or measures something else.
    """
    ours = _parse(internal)
    try:
        theirs = _parse(unit)
    except UnitFault as fault:
        raise UnitFault(f"{example(internal)}{fault}") from None
    if _dimensions(theirs, ours) != _dimensions(ours, ours):
        raise UnitFault(example(internal))
    bridge = ours * _parse("rad") ** (_power(theirs, "[angle]") - _power(ours, "[angle]"))
    return float(_registry().Quantity(1.0, theirs).to(bridge).magnitude)


def split(text: str, internal: str) -> tuple[float, str]:
    """Return the number and unit of a text such as "7000 rpm".

    Raises
    ------
    UnitFault
        if there is no number, or no unit where one is needed, or if the number is beyond 1e100.
    """
    match = _NUMBER.fullmatch(text.strip())
    if match is not None and match[2].startswith(","):
        raise UnitFault(f"a decimal point, no comma; {example(internal)}")
    if match is None or not match[2] or not math.isfinite(float(match[1])):
        raise UnitFault(f"a number and its unit; {example(internal)}")
    if abs(float(match[1])) > LARGEST:
        raise UnitFault(f"a number of magnitude up to {LARGEST:g} and its unit; {example(internal)}")
    return float(match[1]), match[2]


def _power(unit: pint.Unit, dimension: str) -> int:
    return _powers(unit).get(dimension, 0)


def _powers(unit: pint.Unit) -> dict[str, int]:
    return {str(name): round(float(str(power))) for name, power in unit.dimensionality.items()}


def _dimensions(unit: pint.Unit, wanted: pint.Unit) -> dict[str, int]:
    """Give the exponents of the base units; angles in a denominator count only if the wanted unit has angles alone."""
    powers = _powers(unit)
    free = _power(wanted, "[angle]") <= 0 and powers.get("[angle]", 0) <= 0
    return {name: power for name, power in powers.items() if not (free and name == "[angle]")}


def _parse(text: str) -> pint.Unit:
    """Return a product of known symbols with small whole exponents; nothing else reaches pint's parser."""
    parts = re.split(r"\s*([*/])\s*", text.strip())
    for part in parts[::2]:
        match = _TERM.fullmatch(part)
        if match is None or (match[1] not in SYMBOLS and match[1] not in _ALIASES and match[1] != "1"):
            symbol = part if match is None else match[1]
            raise UnitFault(nearest(symbol, (*SYMBOLS, *_ALIASES)))
    unit = _registry().Unit("")
    for operator, part in zip(["*", *parts[1::2]], parts[::2], strict=True):
        symbol, _, exponent = part.partition("^")
        known = _ALIASES.get(symbol, symbol)
        term = _registry().Unit("" if known == "1" else known) ** int(exponent or 1)
        unit = unit * term if operator == "*" else unit / term
    return unit


@lru_cache
def _registry() -> pint.UnitRegistry[float]:
    import pint

    registry: pint.UnitRegistry[float] = pint.UnitRegistry(None)
    for line in _DEFINITIONS:
        registry.define(line)
    return registry
