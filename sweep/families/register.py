"""The table of all families, ``sweep/families.toml``: entry, title, parameters and an ordinary design of each."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sweep.families.parameter import Parameter

REGISTER: Mapping[str, Mapping[str, Any]] = tomllib.loads(
    Path(__file__).parent.with_suffix(".toml").read_text(encoding="utf-8")
)
_SIGN = {"default": 1.0, "choices": (-1.0, 1.0)}


def about(name: str) -> dict[str, Any]:
    """Return the name, the title and the example of a family in the register, as arguments of `Family`."""
    table = REGISTER[name]
    example = {own: row["example"] for own, row in _rows(name).items() if "example" in row}
    return {"name": name, "title": table["title"], "example": example | table.get("example", {})}


def parameters_of(name: str) -> tuple[Parameter, ...]:
    """Return the parameters of a family in the register, in the order of its table."""
    return tuple(Parameter(own, **_fields(row)) for own, row in _rows(name).items())


def _rows(name: str) -> dict[str, dict[str, Any]]:
    """Return the rows of a family's parameters, with those of the families that they are like."""
    table = REGISTER[name]
    found = _rows(table["as"]) if "as" in table else {}
    for own, row in table.get("parameters", {}).items():
        like = _rows(row["as"])[own] if "as" in row else {}
        found[own] = like | {key: value for key, value in row.items() if key != "as"}
    return found


def _fields(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a parameter from its row, numbers of a list as a tuple."""
    known = {key: tuple(value) if isinstance(value, list) else value for key, value in row.items() if key != "example"}
    return (_SIGN if row.get("unit") == "sign" else {}) | known
