"""The table of all families, ``sweep/families.toml``: where the entry of each stands, its title and its example."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

REGISTER: Mapping[str, Mapping[str, Any]] = tomllib.loads(
    Path(__file__).parent.with_suffix(".toml").read_text(encoding="utf-8")
)


def about(name: str) -> dict[str, Any]:
    """Return the name, the title and the example of a family in the register, as arguments of `Family`."""
    table = REGISTER[name]
    same = about(table["as"])["example"] if "as" in table else {}
    return {"name": name, "title": table["title"], "example": same | table.get("example", {})}
