"""First page of the accuracy report: five lines, advice, and a whole study."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.accuracy.measured import Measured
from studies.accuracy.prices import GRID, REFINED
from studies.accuracy.subjects import EDGE, ORDINARY
from studies.accuracy.tables import Parts, at, duration, pipe_table, power, prose
from studies.accuracy.tables import significant as sig

if TYPE_CHECKING:
    import pandas as pd

COARSE, FINE = 1e-3, 1e-9
CLOSE = 1e-6
NOTHING = 1.1  # factor below which two times count as equal
USUAL = 360.0  # samples of a turn in common use


def front_parts(m: Measured) -> Parts:
    """Return the parts of the first page: five sentences, one whole study, the conditions of the times."""
    rough = "Smoke version: few designs, rough figures." if m.smoke else "Every figure here is measured."
    told = f"{rough} Machine: {m.machine}. Ratios hold on other machines, nanoseconds do not."
    return {"five": [f"* {line}" for line in five(m)], "study": _study(m.whole), "measured": prose(told)}


def five(m: Measured) -> list[str]:
    """Return five statements for designers, a sentence or two each."""
    return [
        _refined(m.families),
        _grid(m.families),
        _edge(m.families),
        _effects(m.effects),
        _in_a_study(m.whole),
    ]


def of_region(table: pd.DataFrame, region: str, method: str, setting: float) -> pd.DataFrame:
    """Return the rows of one region and method at one setting, one per family."""
    return at(table[table["region"] == region], method, setting).set_index("family")


def _refined(table: pd.DataFrame) -> str:
    first, last = (of_region(table, ORDINARY, REFINED, setting)["ns_per_design"] for setting in (COARSE, FINE))
    ratio = (last / first).dropna()
    error = of_region(table, ORDINARY, REFINED, FINE)
    judged = error[error["largest_error"].notna()]
    kept = judged["largest_error"] <= np.maximum(FINE, judged["reference_error"])
    return (
        f"**Ask for the accuracy you need: `accuracy=`.** From {power(COARSE)} to {power(FINE)} the time of an ordinary"
        f" design is multiplied by {ratio.median():.2f} (median of {len(ratio)} mechanisms), at most by"
        f" {ratio.max():.2f} ({ratio.idxmax()}). {int(kept.sum())} of {len(kept)} keep {power(FINE)} when asked for"
        " it, as far as the reference can tell."
    )


def _grid(table: pd.DataFrame) -> str:
    found = of_region(table, ORDINARY, GRID, USUAL)
    error = found["largest_error"].dropna()
    refined = of_region(table, ORDINARY, REFINED, FINE)["ns_per_design"]
    ratio = (found["ns_per_design"] / refined).dropna()
    return (
        f"**A fixed grid pays for every digit.** {USUAL:.0f} crank angles miss the largest acceleration by"
        f" {sig(error.median())} of it (median), by {sig(error.max())} in the worst family ({error.idxmax()}), and take"
        f" {ratio.median():.1f} times as long as `accuracy={power(FINE)}`. The error falls with the square of their"
        " number: one digit more takes three times as many."
    )


def _edge(table: pd.DataFrame) -> str:
    grid, refined = of_region(table, EDGE, GRID, USUAL), of_region(table, EDGE, REFINED, FINE)
    both = grid.merge(refined, left_index=True, right_index=True, suffixes=("_grid", ""))
    both = both.dropna(subset=["largest_error", "largest_error_grid"])
    if both.empty:
        return "**Near a change point** nothing was measured in this run."
    easy = of_region(table, ORDINARY, REFINED, FINE)["ns_per_design"].reindex(both.index)
    worst = str(both["largest_error"].idxmax())
    off, slower = sig(100.0 * both["largest_error_grid"].max()), sig((both["ns_per_design"] / easy).median())
    return (
        f"**Near a change point only `accuracy=` can be trusted.** There a grid of {USUAL:.0f} is off by up to {off} %"
        f" ({both['largest_error_grid'].idxmax()}), `accuracy={power(FINE)}` by {sig(both['largest_error'][worst])} at"
        f" most ({worst}, where the reference is sure to {sig(both['reference_error'][worst])}), for {slower} times the"
        " time of an ordinary design (median). If it cannot reach the accuracy, its status says so."
    )


def _effects(table: pd.DataFrame) -> str:
    found = at(table, REFINED, CLOSE).set_index("effect")
    kept = found["largest_error"] <= np.maximum(CLOSE, found["reference_error"])
    times = found["ns_per_design"].sort_values()
    others = ", ".join(f"{name} ({sig(found['largest_error'][name])})" for name in kept.index[~kept])
    but = f"; not so {others}" if others else ""
    return (
        f"**Effects have prices of their own.** {int(kept.sum())} of {len(kept)} effects are right to {power(CLOSE)}"
        f" over the turn when asked for it, as far as their references can tell{but}. They take"
        f" {duration(times.iloc[0])} ({times.index[0]}) to {duration(times.iloc[-1])} ({times.index[-1]}) a design:"
        " want only those that the scene calls for."
    )


def _in_a_study(whole: pd.DataFrame) -> str:
    grid, *_, last = (row for _, row in whole.iterrows())
    first = whole.iloc[1]
    more = last["processor_seconds"] / first["processor_seconds"]
    cost = "cost next to nothing" if more < NOTHING else f"multiply the time by {sig(more)}"
    return (
        f"**In a whole study the digits {cost}.** {int(last['designs'])} designs and their optimum take"
        f" {sig(grid['processor_seconds'])} s of one core with a grid of {_setting(grid)},"
        f" {sig(first['processor_seconds'])} s and {sig(last['processor_seconds'])} s with `accuracy` {_setting(first)}"
        f" and {_setting(last)}; the largest errors of the kept designs are {sig(grid['largest_error'])},"
        f" {sig(first['largest_error'])} and {sig(last['largest_error'])}."
    )


def _setting(row: pd.Series) -> str:
    return str(row["setting"]).rpartition(" ")[2]


def _study(whole: pd.DataFrame) -> list[str]:
    rows = [
        [
            f"`{row.setting}`",
            f"{sig(row.seconds)} ({sig(row.seconds_lower)} to {sig(row.seconds_upper)})",
            sig(row.processor_seconds),
            sig(row.largest_error),
            sig(row.optimum_error),
            sig(row.optimum_difference),
        ]
        for row in whole.itertuples()
    ]
    head = ["accuracy", "seconds, quartiles", "processor seconds", "largest error kept", "error of optimum",
            "difference from the finest optimum"]  # fmt: skip
    first = whole.iloc[0]
    return [
        *prose(
            f"The study has a Sobol sample of {int(first['designs'])} crank-rockers and limits on swing and pressure",
            f"angle; {int(first['kept'])} designs are kept. It minimises the largest acceleration from four starts",
            "with one worker. Errors are relative, against the reference of [every family](accuracy/families.md).",
        ),
        "",
        *pipe_table(head, rows),
    ]
