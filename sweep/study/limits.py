"""[limits] and [cyclogram]: bounds of outputs, parameters and times, and settings from the manuals of machines."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from sweep.errors import InputError, choices
from sweep.families.base import Family, Output
from sweep.families.names import by_magnitude, is_flag
from sweep.quantities import units
from sweep.quantities.kinds import Margin, Reduced
from sweep.quantities.limits import Limit, tightest
from sweep.quantities.resolve import find
from sweep.quantities.resolve import output as design_output
from sweep.study.file import Faults, Key, Number, Section, StudyFile, TwoTexts, holds, read_section
from sweep.study.locus import prescribed_limits
from sweep.study.parameter import Entry

TABLE = Path(__file__).parents[1] / "settings.toml"


@lru_cache
def settings() -> Mapping[str, Mapping[str, Any]]:
    """Read the settings of real machines: source, and (least, most) of rise, clearance ... [mm], by machine."""
    return tomllib.loads(TABLE.read_text(encoding="utf-8"))


def limits_of_settings(file: StudyFile) -> list[Limit]:
    """Return the limits of every relation that names a machine's settings, and report unknown names."""
    limits = []
    relations = file.data.get("relations", {}) if "machine" in file else {}
    for relation, table in relations.items():
        key: Key = ("relations", relation, "settings")
        name = table.get("settings")
        if name is not None and "take" not in table:
            file.faults.value(key, name, "nothing here: settings are limits of a relation take")
        elif name is not None and name not in settings():
            file.faults.value(key, name, choices(name, settings()))
        elif name is not None:
            ends_of = {what: ends for what, ends in settings()[name].items() if what != "source"}
            limits += [Limit(f"{relation}_{what}", *ends) for what, ends in ends_of.items()]
    return limits


ENDS = {"ext": "phi_ext", "fold": "phi_fold", "duration": "phi0"}


class StrokeSection(Section):
    """Table ``cyclogram.<member>``: the stroke of a member from its folded to its extended position."""

    ext: TwoTexts | None = holds('when the stroke ends, extended, from and to, as ["170 deg", "190 deg"]')
    fold: TwoTexts | None = holds('when it ends, folded, as ["350 deg", "359 deg"]')
    duration: TwoTexts | None = holds('from the one to the other, least and most, as ["170 deg", "190 deg"]')
    size: TwoTexts | None = holds('least and most stroke or swing, as ["24 mm", "25 mm"]')


def limits_of_cyclogram(file: StudyFile, family: Family) -> list[Limit]:
    """Return the limits that the windows of events and strokes stand for, in internal units."""
    limits, members = [], {name.partition(".")[0] for name in family.parameter_names if "." in name}
    for name, entry in (file.free_table("cyclogram") or {}).items():
        key: Key = ("cyclogram", name)
        if name not in members:
            limits += _window(file.faults, family, f"phi_{name}", entry, key)
            continue
        section = read_section(StrokeSection, entry, key, file.faults)
        for what, window in section.model_dump(exclude_none=True).items():
            output = f"{name}.{ENDS[what]}" if what in ENDS else _size(family, name)
            limits += _window(file.faults, family, output, window, (*key, what))
    return limits


def _size(family: Family, member: str) -> str:
    """Name the output that measures a member's stroke: its swing if it has one, otherwise its stroke."""
    try:
        return design_output(family, f"{member}.swing").name
    except InputError:
        return f"{member}.stroke"


def _window(faults: Faults, family: Family, name: str, given: Any, key: Key) -> list[Limit]:
    """Read a window as a limit; one across angle 0 of the main shaft is refused, since a limit is a plain interval."""
    try:
        output = design_output(family, name)
    except InputError as error:
        faults.unknown_name(key, "event or member", error.allowed)
        return []
    if not isinstance(given, list) or len(given) != 2 or not all(isinstance(text, str) for text in given):
        faults.value(key, given, 'two texts, from and to, as ["200 deg", "230 deg"]')
        return []
    ends = [faults.number(text, units.internal_unit(output.unit), (*key, k)) for k, text in enumerate(given)]
    if None in ends:
        return []
    start, end = (float(x) for x in ends if x is not None)
    if start > end or (name.startswith("phi_") and not 0.0 <= start <= end < 2.0 * math.pi):
        faults.value(key, given, "from before to, within one turn: give the main shaft its zero outside of the window")
        return []
    return [Limit(name, start, end)]


UPPER, LOWER = ("<=", "\u2264"), (">=", "\u2265")
_SIDES = ("<", ">", "=", "\u2264", "\u2265")
_SIDE = re.compile("([<>=\u2264\u2265]+)\\s*(.*)", re.DOTALL)


class LimitEntry(Section):
    """Entry ``limits.x = { min, max, unit }``."""

    min: Number | None = holds("a finite number, its unit in the key unit")
    max: Number | None = holds("a finite number, its unit in the key unit")
    unit: str | None = holds('a unit as a text, as "deg"')


def read_output_name(family: Family, name: str, key: Key, faults: Faults) -> Output | None:
    """Find the design output named by the value at ``key`` or by the key itself, or report the name as unknown."""
    try:
        return design_output(family, name)
    except InputError as error:
        if key[-1] == name:
            faults.unknown_name(key, "design output", error.allowed)
        else:
            faults.value(key, name, error.allowed)
        return None


def read_limits(file: StudyFile, family: Family, prescribed: Mapping[str, Entry]) -> tuple[Limit, ...]:
    """Read the limits in internal units: of prescribed outputs, of settings, of the cyclogram, then those of [limits].

    A bound in [limits] replaces the setting of the same output.
    """
    raw, faults = file.free_table("limits") or {}, file.faults
    limits = list(prescribed_limits(prescribed))
    limits += [limit for limit in limits_of_settings(file) if limit.output not in raw]
    limits += limits_of_cyclogram(file, family)
    held = {limit.output: limit for limit in limits}
    for name, entry in raw.items():
        key: Key = ("limits", name)
        output = _parameter(family, name) or read_output_name(family, name, key, faults)
        if output is None:
            continue
        before = len(limits)
        if is_flag(name):
            if entry is not True:
                faults.value(key, entry, "true, without quotes; to drop this limit, delete the line")
            limits.append(Limit(name, minimum=1.0))
        elif isinstance(entry, str) and ("+-" in entry or "±" in entry or entry.lstrip()[:1] in _SIDES):
            limits += _read_text(output, entry, key, faults)
        elif isinstance(entry, dict):
            limits += _read_bounds(output, entry, key, faults)
        else:
            faults.value(key, entry, _form(output))
        counts = "tolerance" in file and all(_around(held.get(name), band) for band in limits[before:])
        if name not in prescribed and tightest(limits[before:], name)[1] < 0.0 and _never_negative(family, name):
            at, written = ((*key, "max"), entry["max"]) if isinstance(entry, dict) else (key, entry)
            faults.value(at, written, f"a bound of 0 or more: {name} is never negative where limits compare it")
            del limits[before:]  # the optimiser's objection to the same bound would be a second fault
        if name in prescribed and not counts:
            allowed = "nothing here: [locus] prescribes it; with [tolerance] a band around that, as"
            faults.value(key, entry, f"{allowed} {_band(units.internal_unit(output.unit))}")
    return tuple(limits)


def _never_negative(family: Family, name: str) -> bool:
    """Tell whether no design keeps an upper bound below 0: of an extreme angle of a force, a magnitude, a range."""
    match find(family, name):
        case Margin(kind=kind):
            return kind.endswith("_angle")
        case Reduced(reduction=reduction):
            return reduction.name in ("max_abs", "range", "rms") and not reduction.place
        case _:
            return by_magnitude(name)


def _around(held: Limit | None, band: Limit) -> bool:
    """Tell whether a band leaves room on both sides of the interval that the locus holds."""
    ends = (band.minimum, *((held.minimum, held.maximum) if held else ()), band.maximum)
    numbers = [x for x in ends if x is not None]
    return len(numbers) == 4 and numbers == sorted(numbers) and numbers[0] < numbers[1] and numbers[2] < numbers[3]


def _parameter(family: Family, name: str) -> Output | None:
    """Return a parameter as an output that can be bounded ([fit] may set or scale it), or None."""
    parameter = next((p for p in family.parameters if p.name == name and p.choices is None), None)
    return None if parameter is None else Output(name, parameter.unit, parameter.text)


def _read_bounds(output: Output, raw: Mapping[str, Any], key: Key, faults: Faults) -> list[Limit]:
    entry = read_section(LimitEntry, raw, key, faults)
    if "min" not in raw and "max" not in raw:
        faults.missing((*key, "max"), f"min, max or both, as {_form(output)}", instead="min")
    if entry.min is not None and entry.max is not None and entry.min > entry.max:
        faults.value((*key, "max"), entry.max, f"a number not below min = {entry.min:g}")
    internal = units.internal_unit(output.unit)
    if entry.unit is None and internal != "1":
        if "unit" not in raw:
            faults.missing((*key, "unit"), units.example(internal))
        return []
    factor = faults.factor(entry.unit or "1", internal, (*key, "unit"))
    if factor is None:
        return []
    for end in ("min", "max"):
        faults.within_turn((*key, end), getattr(entry, end) or 0.0, entry.unit)
    bounds = [None if bound is None else bound * factor for bound in (entry.min, entry.max)]
    return [Limit(output.name, *bounds)]


def _read_text(output: Output, text: str, key: Key, faults: Faults) -> list[Limit]:
    """Read a value with its band, as "40 +- 0.2 deg", or a bound on one side, as "<= 45 deg"."""
    internal = units.internal_unit(output.unit)
    middle, band, rest = text.replace("±", "+-").partition("+-")
    form, sign = f"a value and its band, as {_band(internal)}", ""
    if not band:
        sign, rest = _SIDE.fullmatch(text.strip()).groups()  # type: ignore[union-attr]
        form = f"a sign and a number, as {_side(internal)}"
        if sign not in (*UPPER, *LOWER):
            faults.value(key, text, f'"<=" or ">=", or "+-" for a band, as {_side(internal)} or {_band(internal)}')
            return []
    try:
        bare = internal == "1" and "%" not in rest
        number, unit = (float(rest), "1") if bare else units.split(rest.strip(), internal)
        factor, centre = units.factor(unit, internal), float(middle) if band else 0.0
    except units.UnitFault as fault:
        faults.value(key, text, str(fault) if band else f"{fault}: {_side(internal)}")
        return []
    except ValueError:
        faults.value(key, text, form)
        return []
    faults.within_turn(key, max(abs(centre), abs(number)), unit)
    if not (math.isfinite(centre) and math.isfinite(number * factor) and (number > 0.0 or not band)):
        form = f"value and a positive band, as {_band(internal)}" if band else f"number, as {_side(internal)}"
        faults.value(key, text, f"a finite {form}")
        return []
    if band:
        return [Limit(output.name, (centre - number) * factor, (centre + number) * factor)]
    upper = sign in UPPER
    return [Limit(output.name, None if upper else number * factor, number * factor if upper else None)]


def _side(internal: str) -> str:
    return {"1": '"<= 2.5"', "rad": '"<= 45 deg"'}.get(internal, f'"<= 24.5 {internal}"')


def _band(internal: str) -> str:
    return {"1": '"2 +- 0.1"', "rad": '"40 +- 0.2 deg"'}.get(internal, f'"24.5 +- 0.1 {internal}"')


def _form(output: Output) -> str:
    internal = units.internal_unit(output.unit)
    unit = {"1": "", "rad": ', unit = "deg"'}.get(internal, f', unit = "{internal}"')
    return f"{{ min = ..., max = ...{unit} }}, or {_side(internal)}, or {_band(internal)}"
