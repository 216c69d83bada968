"""The tables [design] and [reference]: every parameter of the family given once, in its unit, within its range."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, TypeAlias

from sweep.families.base import Family, Parameter
from sweep.study import units
from sweep.study.faults import Faults, Key, read_section
from sweep.study.model import FixedEntry, ListEntry, RangeEntry, SampleTable
from sweep.study.sobol import DIMENSIONS
from sweep.study.space import Axis, DesignSpace

MOST_DESIGNS = 10**12

Entry: TypeAlias = Axis | float


@dataclass(frozen=True)
class _Written:
    """A parameter as written: its unit and the factor to the internal one."""

    unit: str
    factor: float


def read_space(
    family: Family,
    raw: Mapping[str, Any],
    faults: Faults,
    fitted: tuple[str, ...] = (),
    given: Mapping[str, float] = MappingProxyType({}),
    made: tuple[str, ...] = (),
    prescribed: Mapping[str, Entry] = MappingProxyType({}),
    tables: Mapping[str, str] = MappingProxyType({}),
) -> DesignSpace | None:
    """Return the designs of a study, or None if a parameter is faulty (all faults are reported).

    ``fitted`` parameters are set by [fit]: they must not be given, except lam, which then says where "up" is.
    ``given`` ones have their value from [scene] and must not be given again.  ``made`` ones follow from [locus], whose
    ``prescribed`` outputs take their place in the space.  ``tables`` names the tables of what does not stand in
    [design].
    """
    before = len(faults.lines)
    sample = read_section(SampleTable, raw["sample"], ("design", "sample"), faults) if "sample" in raw else None
    _check_names(family, raw, ("design",), faults, extra=("sample",), fitted=(*fitted, *given, *made), tables=tables)
    for name in given:
        if name in raw:
            faults.value(("design", name), raw[name], "nothing here: [scene] gives it")
    for name in fitted:
        if name in raw and not name.startswith("lam"):
            faults.value(("design", name), raw[name], "nothing here: [fit] finds it")
    for name in made:
        if name in raw:
            faults.value(("design", name), raw[name], "nothing here: it follows from [locus]")
    found: dict[str, Entry] = dict(prescribed)
    for name in [name for name in raw if name in family.parameter_names]:
        parameter = next(p for p in family.parameters if p.name == name)
        entry = read_entry(parameter, raw[name], (tables.get(name, "design"), name), faults, sampled=sample is not None)
        if entry is not None:
            found[name] = entry
    axes = tuple(entry for entry in found.values() if isinstance(entry, Axis))
    own = [p for p in family.parameters if p.name not in made]
    fixed = {p.name: p.default for p in own if p.default is not None and p.name not in found}
    fixed |= {name: 0.0 for name in fitted if name not in found} | dict(given)
    fixed |= {name: entry for name, entry in found.items() if not isinstance(entry, Axis)}
    if sample is None and (count := math.prod(axis.count for axis in axes)) > MOST_DESIGNS:
        faults.value(("design",), count, f"at most {MOST_DESIGNS:.0e} designs; take fewer values or design.sample")
    if sample is not None and len(faults.lines) == before and not 1 <= len(axes) <= DIMENSIONS:
        faults.value(("design", "sample"), f"{len(axes)} swept parameters", f"1 to {DIMENSIONS} with from and to")
    if len(faults.lines) > before:
        return None
    names = (*prescribed, *(p.name for p in own))
    if sample is None:
        return DesignSpace(names, axes, fixed)
    return DesignSpace(names, axes, fixed, "sobol", sample.n or 0, sample.seed)


def check_varied(family: Family, space: DesignSpace, raw: Mapping[str, Any], faults: Faults) -> None:
    """Report a space in which [optimise] finds nothing to vary: signs and listed values do not change steadily."""
    signs = [p.name for p in family.parameters if p.choices is not None]
    lists = [name for name, entry in raw.items() if isinstance(entry, dict) and "values" in entry]
    if not any(axis.low < axis.high and axis.name not in (*signs, *lists) for axis in space.axes):
        faults.value(("optimise",), "no swept parameter", "a study with a length, angle or number that is swept")


def read_reference(
    family: Family, raw: Mapping[str, Any], faults: Faults, given: Mapping[str, float] = MappingProxyType({})
) -> dict[str, float]:
    """Return the parameters of one design, in the order of the family; ``given`` ones need not be repeated."""
    key: Key = ("reference", "design")
    _check_names(family, raw, key, faults, fitted=tuple(given))
    values = {p.name: p.default for p in family.parameters if p.default is not None} | dict(given)
    for parameter in family.parameters:
        if parameter.name in raw:
            place = (*key, parameter.name)
            entry = raw[parameter.name]
            if isinstance(entry, dict) and "value" not in entry:
                faults.value(place, entry, f"one value: {_forms(parameter)}")
                continue
            value = read_entry(parameter, entry, place, faults, sampled=False)
            if isinstance(value, float):
                values[parameter.name] = value
    return {name: values[name] for name in family.parameter_names if name in values}


def _check_names(
    family: Family,
    raw: Mapping[str, Any],
    key: Key,
    faults: Faults,
    extra: tuple[str, ...] = (),
    fitted: tuple[str, ...] = (),
    tables: Mapping[str, str] = MappingProxyType({}),
) -> None:
    for name in raw:
        if name not in family.parameter_names and name not in extra:
            # The nearest of those still missing is the better guess.
            unknown_to = [p for p in family.parameter_names if p not in raw] or list(family.parameter_names)
            faults.unknown(
                (*key, name), [*unknown_to, *(e for e in extra if e not in raw)], f"parameter of {family.name}"
            )
    for p in family.parameters:
        if p.name not in raw and p.default is None and p.name not in fitted:
            needed = f"{p.text}: {_forms(p)}" if key[0] == "reference" else missing_parameter(p)
            if not faults.misspelt((*key, p.name)):
                faults.missing((tables.get(p.name, key[0]), *key[1:], p.name), needed)


def missing_parameter(p: Parameter) -> str:
    """Return what is needed where a parameter is missing: its meaning and the right ways to write it."""
    return f"{p.text}: {_forms(p)}, or an axis {_axis_form(p)}"


def read_entry(p: Parameter, raw: object, key: Key, faults: Faults, sampled: bool) -> Entry | None:
    """Return a parameter as written: a value [mm, rad], an axis, or None if it is faulty."""
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
        try:
            number, unit = units.split(raw, internal)
            return _checked(p, number, number * units.factor(unit, internal), key, faults)
        except units.UnitFault as fault:
            faults.value(key, raw, str(fault))
            return None
    if isinstance(raw, list):
        faults.value(key, raw, _list_form(p))
        return None
    bare = raw if isinstance(raw, (int, float)) and not isinstance(raw, bool) else None
    if bare is None or internal != "1":
        # A whole number may have more digits than a float has room for.
        shown = bare if bare is not None and abs(bare) <= units.LARGEST else None
        faults.value(key, raw, _forms(p, shown))
        return None
    return _read_fixed(p, {"value": raw}, key, faults)


def _read_fixed(p: Parameter, raw: Mapping[str, Any], key: Key, faults: Faults) -> float | None:
    entry = read_section(FixedEntry, raw, key, faults)
    written = _unit(p, entry.unit, raw, key, faults)
    if entry.value is None or written is None:
        return None
    return _checked(p, entry.value, entry.value * written.factor, key, faults)


def _read_list(p: Parameter, raw: Mapping[str, Any], key: Key, faults: Faults) -> Axis | None:
    entry = read_section(ListEntry, raw, key, faults)
    written = _unit(p, entry.unit, raw, key, faults)
    if entry.values is None:
        return None
    seen: set[float] = set()
    for k, value in enumerate(entry.values):
        _checked(p, value, value, (*key, "values", k), faults)
        if value in seen:
            faults.value((*key, "values", k), value, "every value once")
        seen.add(value)
    if written is None:
        return None
    return Axis.listed(p.name, entry.values, written.unit, written.factor)


def _read_range(p: Parameter, raw: Mapping[str, Any], key: Key, faults: Faults, sampled: bool) -> Axis | None:
    if p.choices is not None:
        faults.value(key, raw, _forms(p))
        return None
    before = len(faults.lines)
    entry = read_section(RangeEntry, raw, key, faults)
    written = _unit(p, entry.unit, raw, key, faults)
    low, high = entry.low, entry.high
    if sampled and "count" in raw:
        faults.value((*key, "count"), raw["count"], "no count beside design.sample, which draws from the range")
    if not sampled and "count" not in raw:
        faults.missing((*key, "count"), "a whole number of values, 1 or greater (or design.sample)")
    if low is not None:
        _checked(p, low, low, (*key, "from"), faults)
        if entry.scale == "log" and low <= 0.0:
            faults.value((*key, "from"), low, 'a positive number on a scale = "log"')
    if low is not None and high is not None and not low < high:
        faults.value((*key, "to"), high, f"a number greater than from = {low:g}")
    if len(faults.lines) > before or low is None or high is None or written is None:
        return None
    if sampled:
        return Axis.sampled(p.name, (low, high), written.unit, written.factor, entry.scale)
    return Axis.lattice(p.name, (low, high), entry.count or 1, written.unit, written.factor, entry.scale)


def _unit(p: Parameter, unit: str | None, raw: Mapping[str, Any], key: Key, faults: Faults) -> _Written | None:
    internal = units.internal_unit(p.unit)
    if unit is None:
        if internal == "1":
            return _Written("1", 1.0)
        if "unit" not in raw:
            faults.missing((*key, "unit"), f'{units.example(internal)}, as unit = "{_usual(internal)}"')
        return None
    try:
        return _Written(unit, units.factor(unit, internal))
    except units.UnitFault as fault:
        faults.value((*key, "unit"), unit, str(fault))
        return None


def _checked(p: Parameter, written: float, value: float, key: Key, faults: Faults) -> float:
    if p.sign and (math.isnan(value) or p.wrong_sign(value)):
        faults.value(key, written, f"a {p.sign} {p.unit} ({p.text})")
    if p.choices is not None and value not in p.choices:
        faults.value(key, written, p.choice)
    return float(value)


def _usual(internal: str) -> str:
    """Return the unit a designer writes where the internal one is given."""
    return {"rad": "deg", "t": "kg", "t*mm^2": "kg*mm^2", "rad/s": "rpm", "N*mm*s": "N*m/rpm"}.get(internal, internal)


def _forms(p: Parameter, number: object = None) -> str:
    """Return the right ways to write a fixed value of this parameter."""
    if p.choices is not None:
        return f"{p.choice}, or {{ values = {[int(c) for c in p.choices]} }}"
    internal = units.internal_unit(p.unit)
    if internal == "1":
        return "a number"
    shown = 40.0 if number is None else number
    usual = _usual(internal)
    article = "an" if p.unit == "angle" else "a"
    return f'{article} {p.unit} with its unit, as "{shown} {usual}" or {{ value = {shown}, unit = "{usual}" }}'


def _list_form(p: Parameter) -> str:
    """Return the right way to write several values of this parameter."""
    internal = units.internal_unit(p.unit)
    return "{ values = [...] }" if internal == "1" else f'{{ values = [...], unit = "{_usual(internal)}" }}'


def _axis_form(p: Parameter) -> str:
    internal = units.internal_unit(p.unit)
    unit = "" if internal == "1" else f', unit = "{_usual(internal)}"'
    return f"{{ from = ..., to = ..., count = ...{unit} }}"
