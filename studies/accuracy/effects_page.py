"""docs/accuracy/effects.md: error and time of every registered effect."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from studies.accuracy.effect_prices import REFINED
from studies.accuracy.measured import Measured
from studies.accuracy.tables import USUAL, USUAL_HEAD, Parts, cells, pipe_table, power, prose
from studies.accuracy.tables import significant as sig

if TYPE_CHECKING:
    import pandas as pd

HEAD = ("effect", "on", "designs", *USUAL_HEAD, "reference sure to", "judged")


def effects_parts(m: Measured) -> Parts:
    """Return the table of all effects, a statement on their error estimates, and the list of their references."""
    rows = [_row(f"`{name}`", part) for name, part in m.effects.groupby("effect", sort=False)]
    return {
        "prices": pipe_table(HEAD, rows),
        "honest": _honest(m.effects),
        "references": references(dict(zip(m.effects["effect"], m.effects["reference"], strict=True))),
    }


def references(of: Mapping[str, str]) -> list[str]:
    """Return a line for every reference with its effects; the most frequent one has all others."""
    names: dict[str, list[str]] = {}
    for name, words in of.items():
        names.setdefault(words, []).append(f"`{name}`")
    most, *others = sorted(names, key=lambda words: -len(names[words]))
    return [*(f"* {words}: {', '.join(names[words])};" for words in others), f"* {most}: all other effects."]


def _row(name: str, rows: pd.DataFrame) -> list[str]:
    first, last = rows.iloc[0], rows.iloc[-1]
    judged = f"{first['judged']} of {first['outputs']}"
    return [
        name,
        f"`{first['family']}`",
        str(first["designs"]),
        *cells(rows, USUAL),
        sig(last["reference_error"]),
        judged,
    ]


def _honest(table: pd.DataFrame) -> list[str]:
    """State whether errors stay below ``err_``, and which designs have a status other than 0."""
    refined = table[table["method"] == REFINED]
    beyond = refined[refined["exceeded"] > 0]
    unsure = refined[refined["unsure"] > 0]
    said = "No error exceeds the `err_` that is given with the number."
    if len(beyond):
        names = ", ".join(f"{r['effect']} ({r['exceeded']} at {power(r['setting'])})" for _, r in beyond.iterrows())
        said = f"Errors above the `err_` that is given with the number, by effect: {names}."
    told = "Every design has status 0."
    if len(unsure):
        last = unsure.groupby("effect", sort=False)["unsure"].max()
        told = "Designs with another status than 0 (not sure, or without an answer), by effect: "
        told += ", ".join(f"{name} {count}" for name, count in last.items()) + "."
    return prose(said, told)
