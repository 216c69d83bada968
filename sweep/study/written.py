"""Study files as text: designs, and whole studies, written so that they read back as the same numbers."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

from sweep.families.base import Family, Parameter
from sweep.quantities.units import factor, internal_unit

BARE = re.compile(r"[A-Za-z0-9_-]+")
SHORT = 4  # entries of a table that stand in one line
EXACT = 17  # digits that tell every float64


def toml(data: Mapping[str, Any]) -> str:
    """Return the TOML of a study's tables."""
    return "\n".join(_table((name,), entries) for name, entries in data.items())


def _table(path: tuple[str, ...], entries: Mapping[str, Any]) -> str:
    own = {name: entry for name, entry in entries.items() if not (isinstance(entry, dict) and len(entry) > SHORT)}
    head = [f"[{'.'.join(map(_key, path))}]"] if own or not entries else []
    lines = [*head, *(f"{_key(name)} = {_value(entry)}" for name, entry in own.items())]
    inner = [_table((*path, name), entry) for name, entry in entries.items() if name not in own]
    return "\n".join([*(["\n".join(lines) + "\n"] if lines else []), *inner])


def _key(name: str) -> str:
    return name if BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def _value(entry: object) -> str:
    if isinstance(entry, Mapping):
        return f"{{ {', '.join(f'{_key(name)} = {_value(inner)}' for name, inner in entry.items())} }}"
    if isinstance(entry, list | tuple):
        return f"[{', '.join(map(_value, entry))}]"
    if isinstance(entry, str | bool):
        return json.dumps(entry, ensure_ascii=False)
    return repr(entry)


def design_entries(family: Family, design: Mapping[str, float]) -> dict[str, str | float]:
    """Return a design as a study file writes it: texts with units, signs and ratios as numbers."""
    return {p.name: written(p, design[p.name]) for p in family.parameters if p.name in design}


def written(p: Parameter, value: float) -> str | float:
    """Return a value in mm, degrees ... with the fewest digits that read back as the same number, six at least."""
    internal = internal_unit(p.unit)
    if internal == "1":
        return int(value) if p.choices is not None else value
    unit = "deg" if internal == "rad" else internal
    scale = factor(unit, internal)
    texts = (f"{value / scale:.{digits}g}" for digits in range(6, EXACT + 1))
    found = next((text for text in texts if float(text) * scale == value), None)
    return f"{value!r} {internal}" if found is None else f"{found} {unit}"
