"""docs/accuracy/effects.md: error and time of every registered effect."""

from __future__ import annotations

from typing import TYPE_CHECKING

from studies.accuracy.effect_prices import GRID, REFINED, SAMPLES, TARGETS
from studies.accuracy.measured import Measured
from studies.accuracy.tables import Parts, cells, duration, pipe_table, power, prose
from studies.accuracy.tables import significant as sig
from sweep.effects import NAMES, effect

if TYPE_CHECKING:
    import pandas as pd

WAYS = (*((GRID, float(n)) for n in SAMPLES), *((REFINED, target) for target in TARGETS))
HEAD = ("effect", "on", "designs", *(f"grid {n}" for n in SAMPLES), *(f"`{power(t)}`" for t in TARGETS), "least sure",
        "reference sure to", "per pose")  # fmt: skip


def effects_parts(m: Measured) -> Parts:
    """Return the table of all effects, a statement on their error estimates, and the table of their references."""
    groups = [(f"`{name}`", part) for name, part in m.effects.groupby("effect", sort=False)]
    firsts = [(name, part.iloc[0]) for name, part in groups]
    words = [[name, f"{first['judged']} of {first['outputs']}", first["reference"]] for name, first in firsts]
    return {
        "prices": pipe_table(HEAD, [_row(name, part) for name, part in groups]),
        "honest": _honest(m.effects),
        "references": pipe_table(("effect", "judged", "reference"), words),
    }


def _row(name: str, rows: pd.DataFrame) -> list[str]:
    first, last = rows.iloc[0], rows.iloc[-1]
    entry = effect(first["effect"]) if first["effect"] in NAMES else None
    pose = duration(entry.ns_per_pose) if entry is not None and entry.ns_per_pose else "-"
    tail = [f"`{last['worst_output']}`", sig(last["reference_error"]), pose]
    return [name, f"`{first['family']}`", str(first["designs"]), *cells(rows, WAYS), *tail]


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
