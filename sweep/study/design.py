"""[design] and [reference]: the designs of the study, and one design to compare them with.

``from = "needle208"`` takes dimensions from the accepted optimum of another study, so that they are written only once.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from sweep.errors import choices
from sweep.families.base import Family
from sweep.quantities.units import internal_unit
from sweep.study.file import Faults, Key, Section, Seed, StudyFile, copied_table, holds, read_section
from sweep.study.parameter import Entry, definition, forms, missing_parameter, read_entry
from sweep.study.sobol import DIMENSIONS
from sweep.study.space import Axis, DesignSpace

MOST_DESIGNS = 10**12
FROM, HASH = "from", "hash"
ACCEPTED = "expected.json"
_DIGITS = 12  # hexadecimal digits of the hash


class SampleTable(Section):
    """Table ``design.sample``."""

    required = ("kind", "n")
    kind: Literal["sobol"] | None = holds('"sobol"')
    n: int | None = holds("a whole number, 1 to 2^40", ge=1, le=2**40)
    seed: Seed = holds("a whole number, 0 or greater", 0)


class ReferenceSection(Section):
    """Table [reference]."""

    required = ("design",)
    design: dict[str, Any] | None = holds("a table of the parameters of one design")


@dataclass(frozen=True)
class OtherTables:
    """Parameters and entries that other tables than [design] give.

    ``fitted`` parameters are set by [fit] and must not be given, except lam, which then defines "up".  ``given``
    parameters have their value from [scene].  ``made`` parameters follow from [locus], whose ``prescribed`` outputs
    take their place in the space.  ``entries`` are those of [bodies] and [loads], ``tables`` names the table of each
    parameter.
    """

    fitted: tuple[str, ...] = ()
    given: Mapping[str, float] = field(default_factory=dict)
    made: tuple[str, ...] = ()
    prescribed: Mapping[str, Entry] = field(default_factory=dict)
    entries: Mapping[str, Any] = field(default_factory=dict)
    tables: Mapping[str, str] = field(default_factory=dict)


def read_space(file: StudyFile, family: Family, other: OtherTables) -> DesignSpace | None:
    """Read the designs of a study, or None if a parameter is faulty (all faults are reported)."""
    raw, faults = file.free_table("design"), file.faults
    if raw is None:
        return None
    # Inputs that no wanted effect takes still describe the machine; they are no parameters of the space.
    raw = raw | {name: entry for name, entry in other.entries.items() if name in family.parameter_names}
    before = len(faults.lines)
    sample = read_section(SampleTable, raw["sample"], ("design", "sample"), faults) if "sample" in raw else None
    _check_names(family, raw, ("design",), faults, (*other.fitted, *other.given, *other.made), other.tables)
    _check_needless(raw, other, faults)
    entries: dict[str, Entry] = dict(other.prescribed)
    for name in [name for name in raw if name in family.parameter_names]:
        parameter = next(p for p in family.parameters if p.name == name)
        key = (other.tables.get(name, "design"), name)
        entry = read_entry(parameter, raw[name], key, faults, sampled=sample is not None)
        if entry is not None:
            entries[name] = entry
    axes = tuple(entry for entry in entries.values() if isinstance(entry, Axis))
    parameters = [p for p in family.parameters if p.name not in other.made]
    left_out = {p.name: p.left_out(entries) for p in parameters if p.name not in entries}
    fixed = {name: value for name, value in left_out.items() if value is not None}
    fixed |= {name: 0.0 for name in other.fitted if name not in entries} | dict(other.given)
    fixed |= {name: entry for name, entry in entries.items() if not isinstance(entry, Axis)}
    if sample is None and (count := math.prod(axis.count for axis in axes)) > MOST_DESIGNS:
        faults.value(("design",), count, f"at most {MOST_DESIGNS:.0e} designs; take fewer values or design.sample")
    if sample is not None and len(faults.lines) == before and not 1 <= len(axes) <= DIMENSIONS:
        faults.value(("design", "sample"), f"{len(axes)} swept parameters", f"1 to {DIMENSIONS} with from and to")
    if len(faults.lines) > before:
        return None
    names = (*other.prescribed, *(p.name for p in parameters))
    if sample is None:
        return DesignSpace(names, axes, fixed)
    return DesignSpace(names, axes, fixed, "sobol", sample.n or 0, sample.seed)


def check_varied(file: StudyFile, family: Family, space: DesignSpace, entries: Mapping[str, Any]) -> None:
    """Report a space without a continuous parameter, in which [optimise] has nothing to vary.

    Signs and listed values are discrete.  ``entries`` are those of [bodies] and [loads].
    """
    if "optimise" not in file:
        return
    raw = {**(file.free_table("design") or {}), **entries}
    signs = [p.name for p in family.parameters if p.choices is not None]
    lists = [name for name, entry in raw.items() if isinstance(entry, dict) and "values" in entry]
    if not any(axis.low < axis.high and axis.name not in (*signs, *lists) for axis in space.axes):
        allowed = "a study with a length, angle or number that is swept"
        file.faults.value(("optimise",), "no swept parameter", allowed)


def read_reference(
    section: ReferenceSection,
    bare: Family,
    family: Family,
    faults: Faults,
    other: OtherTables,
    space: DesignSpace | None,
) -> dict[str, float] | None:
    """Read the parameters of the reference design, in the order of the family.

    Inputs of effects that it leaves out have the values fixed in ``space``.
    """
    raw = section.design
    if raw is None:
        return None
    key: Key = ("reference", "design")
    names = (*bare.parameter_names, *other.prescribed)
    fixed = {} if space is None else space.fixed
    given = {**other.given, **{name: value for name, value in fixed.items() if name not in names}}
    # If the space has faults, the inputs that it fixes are unknown.
    scene = tuple(name for name in family.parameter_names if name not in names) if space is None else tuple(given)
    _check_names(family, raw, key, faults, scene)
    defaults = {p.name: p.left_out(raw) for p in family.parameters}
    values = {name: value for name, value in defaults.items() if value is not None} | given
    for parameter in family.parameters:
        if parameter.name in raw:
            entry_key = (*key, parameter.name)
            entry = raw[parameter.name]
            if isinstance(entry, dict) and "value" not in entry:
                faults.value(entry_key, entry, f"one value: {forms(parameter)}")
                continue
            value = read_entry(parameter, entry, entry_key, faults, sampled=False)
            if isinstance(value, float):
                values[parameter.name] = value
    return {name: values[name] for name in family.parameter_names if name in values}


def _check_needless(raw: Mapping[str, Any], other: OtherTables, faults: Faults) -> None:
    """Report parameters in [design] that another table sets."""
    words = dict.fromkeys(other.given, "[scene] gives it")
    words |= {name: "[fit] finds it" for name in other.fitted if not name.startswith("lam")}
    words |= dict.fromkeys(other.made, "it follows from [locus]")
    for name in [name for name in words if name in raw]:
        faults.value(("design", name), raw[name], f"nothing here: {words[name]}")


def _check_names(
    family: Family,
    raw: Mapping[str, Any],
    key: Key,
    faults: Faults,
    elsewhere: tuple[str, ...],
    tables: Mapping[str, str] | None = None,
) -> None:
    """Report names that are no parameters, and parameters missing both here and in ``elsewhere``."""
    extra = ("sample",) if key == ("design",) else ()
    for name in raw:
        if name not in family.parameter_names and name not in extra:
            # The closest match is sought among the missing parameters first.
            unknown_to = [p for p in family.parameter_names if p not in raw] or list(family.parameter_names)
            known = [*unknown_to, *(e for e in extra if e not in raw)]
            faults.unknown((*key, name), known, f"parameter of {family.name}")
    for p in family.parameters:
        if p.name not in raw and p.default is None and p.name not in elsewhere:
            needed = f"{definition(p)}: {forms(p)}" if key[0] == "reference" else missing_parameter(p)
            if not faults.misspelt((*key, p.name)):
                faults.missing(((tables or {}).get(p.name, key[0]), *key[1:], p.name), needed)


def fingerprint(design: Mapping[str, float]) -> str:
    """Return the hash of a design's names and values, independent of their order.

    >>> fingerprint({"a": 1.0, "b": 2.0}) == fingerprint({"b": 2.0, "a": 1.0})
    True
    """
    text = json.dumps({name: float(x).hex() for name, x in design.items()}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]


def take(file: StudyFile, family: Family, elsewhere: Collection[str]) -> None:
    """Replace ``from`` in [design] and [reference.design] by the dimensions of the named study, and report its faults.

    Dimensions in the file have precedence; those that ``elsewhere``, such as [fit], sets are left out.  The content
    kept with a dataset holds the dimensions themselves, and their origin in ``study.taken``.
    """
    notes: list[str] = []
    for key in (("design",), ("reference", "design")):
        table = copied_table(file.data, key)
        for name in [name for name in table or () if name.rpartition(".")[2] == FROM]:
            assert table is not None
            member = name.removesuffix(FROM)
            source, pinned = table.pop(name), table.pop(f"{member}{HASH}", None)
            design = _accepted(file, (*key, name), source)
            if design is None:
                for missing in (p.name for p in family.parameters if p.name.startswith(member)):
                    file.faults.excuse((*key, missing))
                continue
            now = fingerprint(design)
            if pinned is not None and pinned != now:
                file.faults.value((*key, f"{member}{HASH}"), pinned, f'"{now}", the hash of what {source} accepts now')
            # A fitted lam may be given in [design], where it defines "up".
            left_out = {x for x in elsewhere if not x.startswith("lam")} if key == ("design",) else set()
            _fill(file, table, (*key, name), member, design, family, left_out)
            notes.append(f"{'.'.join((*key, member.rstrip('.'))).rstrip('.')}: {source} {now}")
    study_table = copied_table(file.data, ("study",))
    if notes and study_table is not None:
        study_table["taken"] = notes


def taken_reference(file: StudyFile, section: ReferenceSection) -> ReferenceSection:
    """Return the section with the design that `take` has filled in."""
    table = copied_table(file.data, ("reference", "design"))
    return section if section.design is None else section.model_copy(update={"design": table})


def _accepted(file: StudyFile, key: Key, source: object) -> dict[str, float] | None:
    """Return the accepted optimum of another study, or None with its fault reported."""
    if not isinstance(source, str) or not source or Path(source).name != source:
        file.faults.value(key, source, "the name of a study whose folder stands beside this one")
        return None
    path = file.path.resolve().parent.parent / source / ACCEPTED
    try:
        design = json.loads(path.read_text(encoding="utf-8"))["optimum"]["design"]
        return {str(name): float(x) for name, x in design.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        others = [beside.parent.name for beside in sorted(path.parent.parent.glob(f"*/{ACCEPTED}"))]
        allowed = f"a study with an accepted optimum.design in {source}/{ACCEPTED}; beside this one have such a file: "
        file.faults.value(key, source, allowed + (choices(source, others) or "none"))
        return None


def _fill(
    file: StudyFile,
    table: dict[str, Any],
    key: Key,
    member: str,
    design: Mapping[str, float],
    family: Family,
    elsewhere: Collection[str],
) -> None:
    parameters = {p.name: p for p in family.parameters}
    for name, value in design.items():
        p = parameters.get(f"{member}{name}")
        if p is None:
            file.faults.value(key, name, f"a study of the same mechanism: {family.name} has no {member}{name}")
        elif p.name not in table and p.name not in elsewhere:
            unit = internal_unit(p.unit)
            table[p.name] = value if unit == "1" else {"value": value, "unit": unit}
