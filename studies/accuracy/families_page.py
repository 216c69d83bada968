"""docs/accuracy/families.md: error and time of every registered family by every way, and other programs beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.accuracy.measured import Measured
from studies.accuracy.prices import CERTIFIED, GRID, PROVEN, REFINED, SAMPLES, TARGETS
from studies.accuracy.subjects import TEXTS
from studies.accuracy.tables import duration, pipe_table, power, prose
from studies.accuracy.tables import significant as sig

if TYPE_CHECKING:
    import pandas as pd

HEAD = ("family", "number", "designs", *(f"grid {n}" for n in SAMPLES), *(f"`{power(t)}`" for t in TARGETS),
        f"proven, `{power(PROVEN)}`", "reference sure to", "no answer")  # fmt: skip


def families_page(m: Measured) -> list[str]:
    """Return the page, line by line."""
    lines = [
        "# What accuracy costs: every family",
        "",
        *prose(
            "For every family of the register and two chains the largest second derivative of its output over the",
            "turn; where there is none (an interval, a march, a position without derivatives) how far the output",
            "ranges. A cell is the largest relative error of the region's designs and the median time per design.",
            "Back to [what the next digit costs](../accuracy.md).",
        ),
        "",
        "![Error and time of every family by a grid and by accuracy=](../figures/accuracy-families.svg)",
        "",
        *_by_region(m.families),
        "## How the errors are known",
        "",
        *prose(
            "The reference uses the position of the mechanism alone, in twice the working precision where the family",
            "has such poses: no derivative of the family and no search enters it. Second differences on a fine grid",
            "name the peaks, narrower grids sharpen their places, a polynomial through Chebyshev nodes about each is",
            "differentiated instead of the mechanism; how far an output ranges is found by narrowing grids alone. The",
            "column *reference sure to* is by how much neighbouring widths of its intervals differ: an error below it",
            "says nothing. A march exists on its own grid only; its reference is the same march in far finer steps.",
            "The positions themselves are compared with 25-digit tables in [marks](marks.md) and by the tests.",
        ),
        "",
        *prose(
            "*No answer* counts designs that some way refuses with a status, or that the reference cannot judge.",
            "`-`: nothing to judge, or not offered (a march has no `accuracy=`; few families prove their maxima). A",
            "family has no row near a change point if no design within 90 % of its ordinary one fails to move.",
            "Times: processor time of one thread.",
        ),
        "",
        *_spread(m.families),
        *_planar(m),
        *_loads(m.loads, m.peer_loads),
    ]
    return lines[:-1]


def _by_region(table: pd.DataFrame) -> list[str]:
    lines = []
    for region in dict.fromkeys(table["region"]):
        part = table[table["region"] == region]
        lines += [f"## {region[0].upper()}{region[1:]}", "", f"{TEXTS[region][0].upper()}{TEXTS[region][1:]}.", ""]
        lines += [*pipe_table(HEAD, [_row(name, rows) for name, rows in part.groupby("family", sort=False)]), ""]
    return lines


def _row(name: object, rows: pd.DataFrame) -> list[str]:
    ways = [(GRID, float(n)) for n in SAMPLES] + [(REFINED, t) for t in TARGETS] + [(CERTIFIED, PROVEN)]
    cells = []
    for method, setting in ways:
        found = rows[(rows["method"] == method) & np.isclose(rows["setting"], setting, rtol=1e-9, atol=0.0)]
        cells.append(_cell(found.iloc[0]) if len(found) else "-")
    first, missing = rows.iloc[0], int((rows["unanswered"] + rows["unjudged"]).max())
    sure = sig(rows["reference_error"].max())
    return [f"`{name}`", f"`{first['measure']}`", str(first["designs"]), *cells, sure, str(missing)]


def _cell(row: pd.Series) -> str:
    return f"{sig(row['largest_error'])}; {duration(row['ns_per_design'])}"


def _spread(table: pd.DataFrame) -> list[str]:
    """Return how far the timings of one call differ, over all rows of the table."""
    width = (table["ns_per_design_upper"] - table["ns_per_design_lower"]) / table["ns_per_design"]
    return [
        *prose(
            f"Every time is the median of five; between its quartiles lie {sig(100.0 * width.median())} % of it in the",
            f"middle of the table, {sig(100.0 * width.quantile(0.95))} % in the worst twentieth. The quartiles",
            "stand in `results/accuracy/families.parquet`.",
        ),
        "",
    ]


def _planar(m: Measured) -> list[str]:
    lines = ["## The planar case next to another program", ""]
    if m.peers is None:
        return [*lines, "Not measured in this results folder: `make bench-peers` first.", ""]
    family = str(m.peers["family"].iloc[0])
    rows = [
        [str(what), *(_cell(row) for _, row in part.sort_values("setting").iterrows())]
        for what, part in m.peers.groupby("what", sort=False)
    ]
    return [
        *lines,
        *prose(
            f"Largest acceleration of ordinary designs of `{family}` on a grid, each program by its fastest way",
            "(`make bench-peers`, on this machine). All have the same designs: equal errors mean equal accelerations.",
        ),
        "",
        *pipe_table(["program", *(f"grid {n}" for n in SAMPLES)], rows),
        "",
    ]


def _loads(loads: pd.DataFrame | None, one: pd.DataFrame | None = None) -> list[str]:
    """Joint loads: ``loads`` by family, ``one`` of one crank-rocker by the ways of a program."""
    lines = ["## Joint loads next to general programs", ""]
    if loads is None and one is None:
        return [*lines, "Not measured in this results folder: `make bench-peers` first.", ""]
    if loads is not None:
        lines += [
            *prose(
                "Inverse dynamics of the same bodies at the same poses (`make bench-peers`): largest difference of a",
                "joint force or drive torque, relative to the largest of the turn, and the time per pose; theirs from",
                "Python, with the loop closed by Newton's method in the exported model, ours in a sweep.",
            ),
            "",
            *pipe_table(
                ["program", "family", "poses", "difference", "its time", "ours", "times as fast"],
                [_load_row(row) for _, row in loads.iterrows()],
            ),
            "",
        ]
    if one is not None:
        lines += [
            *prose(
                "One crank-rocker with heavy links, time per pose and how many times as fast as the first; the loads",
                f"differ by at most {sig(one['largest_difference'].max())} of the largest.",
            ),
            "",
            *pipe_table(
                ["what", "per pose", "times as fast"],
                [[str(row["what"]), duration(row["ns_per_pose"]), sig(row["ratio"])] for _, row in one.iterrows()],
            ),
            "",
        ]
    return lines


def _load_row(row: pd.Series) -> list[str]:
    ratio = row["ns_per_pose"] / row["ns_per_pose_own"]
    times = [duration(row["ns_per_pose"]), duration(row["ns_per_pose_own"]), sig(ratio)]
    return [row["program"], f"`{row['family']}`", str(row["poses"]), sig(row["largest_difference"]), *times]
