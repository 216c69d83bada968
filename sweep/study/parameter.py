"""Entry of one parameter in a study file: a value, a list of values or a range, checked for unit and range."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, TypeAlias

from sweep.effects.loads import GRAM
from sweep.families.base import Parameter
from sweep.quantities import units
from sweep.study.file import Count, Faults, Key, Number, Section, holds, read_section
from sweep.study.space import Axis

Entry: TypeAlias = Axis | float


class RangeEntry(Section):
    """Entry ``design.x = { from, to, count, unit, scale }``."""

    required = ("from", "to")
    low: Number | None = holds("a finite number, its unit in the key unit", alias="from")
    high: Number | None = holds("a finite number, its unit in the key unit", alias="to")
    count: Count | None = holds("a whole number, 1 to 1000000")
    unit: str | None = holds('a unit as a text, as "mm"')
    scale: Literal["linear", "log"] = holds('"linear" or "log"', "linear")


class ListEntry(Section):
    """Entry ``design.x = { values, unit }``."""

    values: list[Number] | None = holds(
        "a list of 1 to 1000000 finite numbers, their unit in the key unit", min_length=1, max_length=1_000_000
    )
    unit: str | None = holds('a unit as a text, as "mm"')


class FixedEntry(Section):
    """Entry ``design.x = { value, unit }``."""

    value: Number | None = holds("a finite number, its unit in the key unit")
    unit: str | None = holds('a unit as a text, as "mm"')


def definition(p: Parameter) -> str:
    """Return what a parameter is, without what only tables without units need to say."""
    return p.text.replace(GRAM, "")


def missing_parameter(p: Parameter) -> str:
    """Describe a missing parameter: its meaning and the valid ways to write it."""
    return f"{definition(p)}: {forms(p)}, or an axis {{ from = ..., to = ..., count = ...{_unit_form(p)} }}"


def read_entry(p: Parameter, raw: object, key: Key, faults: Faults, sampled: bool) -> Entry | None:
    """Read the entry of a parameter as a value [mm, rad] or an axis, or None if it is faulty."""
    before = len(faults.lines)
    entry: Entry | None
    if not isinstance(raw, dict):
        entry = _read_plain(p, raw, key, faults)
    elif "values" in raw:
        entry = _read_list(p, raw, key, faults)
    elif "value" in raw:
        entry = _read_fixed(p, raw, key, faults)
    else:
        entry = _read_range(p, raw, key, faults, sampled)
    return entry if len(faults.lines) == before else None


def _read_plain(p: Parameter, raw: object, key: Key, faults: Faults) -> float | None:
    internal = units.internal_unit(p.unit)
    if isinstance(raw, str) and internal != "1":
        value = faults.number(raw, internal, key)
        return None if value is None else _checked(p, *units.split(raw, internal), value, key, faults)
    if isinstance(raw, list):
        faults.value(key, raw, f"{{ values = [...]{_unit_form(p)} }}")
        return None
    bare = raw if isinstance(raw, (int, float)) and not isinstance(raw, bool) else None
    if bare is None or internal != "1":
        # An integer in the file may exceed the range of a float.
        shown = bare if bare is not None and abs(bare) <= units.LARGEST else None
        faults.value(key, raw, forms(p, shown) + (units.unquoted(raw) if internal == "1" else ""))
        return None
    return _read_fixed(p, {"value": raw}, key, faults)


def _read_fixed(p: Parameter, raw: Mapping[str, Any], key: Key, faults: Faults) -> float | None:
    entry = read_section(FixedEntry, raw, key, faults)
    unit = _unit(p, entry.unit, raw, key, faults)
    if entry.value is None or unit is None:
        return None
    return _checked(p, entry.value, unit[0], entry.value * unit[1], key, faults)


def _read_list(p: Parameter, raw: Mapping[str, Any], key: Key, faults: Faults) -> Axis | None:
    entry = read_section(ListEntry, raw, key, faults)
    unit = _unit(p, entry.unit, raw, key, faults)
    if entry.values is None:
        return None
    seen: set[float] = set()
    for k, value in enumerate(entry.values):
        _checked(p, value, entry.unit, value, (*key, "values", k), faults)
        if value in seen:
            faults.value((*key, "values", k), value, "every value once")
        seen.add(value)
    if unit is None:
        return None
    return Axis.listed(p.name, entry.values, *unit)


def _read_range(p: Parameter, raw: Mapping[str, Any], key: Key, faults: Faults, sampled: bool) -> Axis | None:
    if p.choices is not None:
        faults.value(key, raw, forms(p))
        return None
    before = len(faults.lines)
    entry = read_section(RangeEntry, raw, key, faults)
    unit = _unit(p, entry.unit, raw, key, faults)
    low, high = entry.low, entry.high
    if sampled and "count" in raw:
        faults.value((*key, "count"), raw["count"], "no count beside design.sample, which draws from the range")
    if not sampled and "count" not in raw:
        faults.missing((*key, "count"), "a whole number of values, 1 or greater (or design.sample)")
    if low is not None:
        _checked(p, low, entry.unit, low, (*key, "from"), faults)
        if entry.scale == "log" and low <= 0.0:
            faults.value((*key, "from"), low, 'a positive number on a scale = "log"')
    if low is not None and high is not None and not low < high:
        faults.value((*key, "to"), high, f"a number greater than from = {low:g}")
    elif high is not None:
        _checked(p, high, entry.unit, high, (*key, "to"), faults)
    if len(faults.lines) > before or low is None or high is None or unit is None:
        return None
    if sampled:
        return Axis.sampled(p.name, (low, high), *unit, entry.scale)
    return Axis.lattice(p.name, (low, high), entry.count or 1, *unit, entry.scale)


def _unit(p: Parameter, unit: str | None, raw: Mapping[str, Any], key: Key, faults: Faults) -> tuple[str, float] | None:
    internal = units.internal_unit(p.unit)
    if unit is None:
        if internal == "1":
            return "1", 1.0
        if "unit" not in raw:
            faults.missing((*key, "unit"), f'{units.example(internal)}, as unit = "{_usual(internal)}"')
        return None
    factor = faults.factor(unit, internal, (*key, "unit"))
    return None if factor is None else (unit, factor)


def _checked(p: Parameter, written: float, unit: str | None, value: float, key: Key, faults: Faults) -> float:
    faults.within_turn(key, written, unit)
    if p.sign and (math.isnan(value) or p.wrong_sign(value)):
        faults.value(key, written, f"a {p.sign} {p.unit} ({definition(p)})")
    if p.choices is not None and value not in p.choices:
        faults.value(key, written, p.choice)
    return float(value)


def _usual(internal: str) -> str:
    """Return the unit that designers write for an internal unit."""
    return {"rad": "deg", "t": "g", "t*mm^2": "kg*mm^2", "rad/s": "rpm", "N*mm*s": "N*m/rpm"}.get(internal, internal)


def forms(p: Parameter, number: object = None) -> str:
    """Show the valid ways to write a fixed value of this parameter."""
    if p.choices is not None:
        return f"{p.choice}, or {{ values = {[int(c) for c in p.choices]} }}"
    internal = units.internal_unit(p.unit)
    if internal == "1":
        return "a number"
    example, usual = 40.0 if number is None else number, _usual(internal)
    article = "an" if p.unit[0] in "aeiou" else "a"
    return f'{article} {p.unit} with its unit, as "{example} {usual}" or {{ value = {example}{_unit_form(p)} }}'


def _unit_form(p: Parameter) -> str:
    internal = units.internal_unit(p.unit)
    return "" if internal == "1" else f', unit = "{_usual(internal)}"'
