"""``[design] from = "needle208"``: dimensions out of the accepted optimum of another study, so that they stand once."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from sweep.families.base import Family
from sweep.quantities.units import internal_unit
from sweep.study.design import ReferenceSection
from sweep.study.file import Key, StudyFile

FROM, HASH = "from", "hash"
ACCEPTED = "expected.json"
_DIGITS = 12  # of the hash


def fingerprint(design: Mapping[str, float]) -> str:
    """Return the hash of a design: of its names and values, whatever their order.

    >>> fingerprint({"a": 1.0, "b": 2.0}) == fingerprint({"b": 2.0, "a": 1.0})
    True
    """
    text = json.dumps({name: float(x).hex() for name, x in design.items()}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]


def take(file: StudyFile, family: Family, elsewhere: Collection[str]) -> None:
    """Put what [design] and [reference.design] take from other studies in its place, and report what cannot be had.

    What stands in the file wins; what ``elsewhere`` gives, such as [fit], is left out.  The content that a dataset
    keeps has the dimensions themselves, and in ``study.taken`` where they come from.
    """
    notes: list[str] = []
    for key in (("design",), ("reference", "design")):
        table = _table(file.data, key)
        for name in [name for name in table or () if name.rpartition(".")[2] == FROM]:
            assert table is not None
            member = name.removesuffix(FROM)
            source, pinned = table.pop(name), table.pop(f"{member}{HASH}", None)
            if not isinstance(source, str) or not source or Path(source).name != source:
                file.faults.value((*key, name), source, "the name of a study whose folder stands beside this one")
                continue
            design = _accepted(file, (*key, name), source)
            if design is None:
                continue
            own = fingerprint(design)
            if pinned is not None and pinned != own:
                file.faults.value((*key, f"{member}{HASH}"), pinned, f'"{own}", the hash of what {source} accepts now')
            # a fitted lam may stand in [design]: it says where "up" is
            left_out = {x for x in elsewhere if not x.startswith("lam")} if key == ("design",) else set()
            _fill(file, table, (*key, name), member, design, family, left_out)
            notes.append(f"{'.'.join((*key, member.rstrip('.'))).rstrip('.')}: {source} {own}")
    about = _table(file.data, ("study",))
    if notes and about is not None:
        about["taken"] = notes


def taken_reference(file: StudyFile, section: ReferenceSection) -> ReferenceSection:
    """Return the section with what was taken into its table."""
    table = _table(file.data, ("reference", "design"))
    return section if section.design is None else section.model_copy(update={"design": table})


def _table(data: Mapping[str, Any], key: tuple[str, ...]) -> dict[str, Any] | None:
    """Return a table of the file as one of its own, which may be written on; None where there is none."""
    found: Any = data
    for part in key:
        if not isinstance(found, dict) or not isinstance(found.get(part), dict):
            return None
        found[part] = dict(found[part])
        found = found[part]
    return found if isinstance(found, dict) else None


def _accepted(file: StudyFile, key: Key, source: str) -> dict[str, float] | None:
    """Return the design of the accepted optimum of a study; None with its fault."""
    path = file.path.resolve().parent.parent / source / ACCEPTED
    try:
        design = json.loads(path.read_text(encoding="utf-8"))["optimum"]["design"]
        return {str(name): float(x) for name, x in design.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as fault:
        file.faults.value(key, source, f"a study with an accepted optimum.design in {source}/{ACCEPTED}: {fault!r}")
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
