"""What differs between two versions of a study, said as its author wrote it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

MOST = 6


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """Return keys whose values differ, such as ``limits.swing.min 170 -> 50 deg``; at most six of them."""
    found = list(_lines(old, new, ""))
    more = [f"and {len(found) - MOST} more"] if len(found) > MOST else []
    return found[:MOST] + more


def _lines(old: Mapping[str, Any], new: Mapping[str, Any], place: str) -> list[str]:
    found: list[str] = []
    units = old.get("unit"), new.get("unit")
    for key in [*new, *(key for key in old if key not in new)]:
        before, now = old.get(key), new.get(key)
        name = f"{place}{key}"
        if before == now or (key == "unit" and len(old) > 1):
            continue
        if isinstance(before, Mapping) and isinstance(now, Mapping):
            found += _lines(before, now, f"{name}.")
        else:
            own = units[0] if units[0] != units[1] else None
            found.append(f"{name} {_said(before, own)} -> {_said(now, units[1])}")
    if not found and units[0] != units[1]:
        found.append(f"{place}unit {_said(units[0])} -> {_said(units[1])}")
    return found


def _said(value: Any, unit: Any = None) -> str:
    if value is None:
        return "none"
    if isinstance(value, Mapping):
        value, unit = ", ".join(f"{key} = {_said(v)}" for key, v in value.items() if key != "unit"), value.get("unit")
    if isinstance(value, list):
        value = f"{len(value)} values" if len(value) > MOST else ", ".join(map(str, value))
    text = str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else str(value)
    return f"{text} {unit}" if unit and unit != "1" else text
