"""docs/accuracy/effects.md: error and time of every registered effect."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.accuracy.effect_prices import GRID, REFINED, SAMPLES, TARGETS
from studies.accuracy.measured import Measured
from studies.accuracy.tables import duration, pipe_table, power, prose
from studies.accuracy.tables import significant as sig

if TYPE_CHECKING:
    import pandas as pd

HEAD = ("effect", "on", "designs", *(f"grid {n}" for n in SAMPLES), *(f"`{power(t)}`" for t in TARGETS), "least sure",
        "reference sure to", "per pose")  # fmt: skip


def effects_page(m: Measured) -> list[str]:
    """Return the page, line by line."""
    table = m.effects
    poses = _per_pose(m.outputs)
    rows = [_row(str(name), part, poses) for name, part in table.groupby("effect", sort=False)]
    words = [
        [f"`{name}`", f"{first['judged']} of {first['outputs']}", first["reference"]]
        for name, part in table.groupby("effect", sort=False)
        for first in (part.iloc[0],)
    ]
    return [
        "# What accuracy costs: every effect",
        "",
        *prose(
            "What the name of each effect stands for in `want`: its largest magnitudes over the turn and its numbers",
            "of the turn, on ordinary designs of the first family that it serves. A cell is the largest relative error",
            "among all these outputs and the median time per design of all of them together, motion included; *least",
            "sure* names the output with that error at the finest accuracy, *per pose* is the time of the effect's",
            "pose outputs alone. Effects that couple a whole turn choose their own poses. Back to [what the next digit",
            "costs](../accuracy.md).",
        ),
        "",
        "![Error and time of every effect](../figures/accuracy-effects.svg)",
        "",
        *pipe_table(HEAD, rows),
        "",
        *_honest(table),
        "",
        "## How the errors are known",
        "",
        *prose(
            "Extrema over the turn: poses on ever narrower grids round the highest samples, which corners and jumps (a",
            "follower that turns back under friction) do not mislead; no derivative and no search enters. What couples",
            "a whole turn is solved again by another method. *Judged*: outputs with such a reference, of all. Errors",
            "of single poses against 25-digit tables stand in [marks](marks.md).",
        ),
        "",
        *pipe_table(("effect", "judged", "reference"), words),
    ]


def _per_pose(outputs: pd.DataFrame) -> dict[str, str]:
    part = outputs[(outputs["kind"] == "effect") & (outputs["per"] == "pose")]
    return {str(r.what).partition(":")[0]: duration(r.nanoseconds) for r in part.itertuples()}


def _row(name: str, rows: pd.DataFrame, poses: dict[str, str]) -> list[str]:
    cells = []
    for method, setting in [(GRID, float(n)) for n in SAMPLES] + [(REFINED, t) for t in TARGETS]:
        found = rows[(rows["method"] == method) & np.isclose(rows["setting"], setting, rtol=1e-9, atol=0.0)]
        cells.append(
            f"{sig(found['largest_error'].iloc[0])}; {duration(found['ns_per_design'].iloc[0])}" if len(found) else "-"
        )
    first, last = rows.iloc[0], rows.iloc[-1]
    tail = [f"`{last['worst_output']}`", sig(last["reference_error"]), poses.get(name, "-")]
    return [f"`{name}`", f"`{first['family']}`", str(first["designs"]), *cells, *tail]


def _honest(table: pd.DataFrame) -> list[str]:
    """Return whether errors stay below what ``err_`` says, and where a status says that a number is not sure."""
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
