"""docs/accuracy/marks.md: what was set before the code was written, and the largest errors known."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.accuracy.measured import Measured
from studies.accuracy.reference import ORDERS
from studies.accuracy.tables import pipe_table, prose
from studies.accuracy.tables import significant as sig

if TYPE_CHECKING:
    import pandas as pd


def marks_page(m: Measured) -> list[str]:
    """Return the page, line by line."""
    return [
        "# Marks and largest known errors",
        "",
        "Back to [what the next digit costs](../accuracy.md).",
        *_marks(m),
        *_known(m),
    ]


def marks_table(marks: pd.DataFrame) -> list[str]:
    """Return the marks: what was asked, what was measured, whether it was met."""
    rows = [[mark, asked, measured, "yes" if met else "**no**"] for mark, asked, measured, met in marks.to_numpy()]
    return pipe_table(["mark", "asked", "measured", "met"], rows)


def _marks(m: Measured) -> list[str]:
    return [
        "",
        "## Marks",
        "",
        "Set before the code was written; missed ones are named as such.",
        "",
        *marks_table(m.marks),
    ]


def _known(m: Measured) -> list[str]:
    """Return the largest factors: one line per table, then by quantity and kind of row, then what the search found."""
    lines = [
        "",
        "## Largest known factors",
        "",
        *prose(
            "Every row of the 25-digit tables, in units of 2^-53 max(cond, abs y); for the geared dwell drive,",
            "whose table has no cond, of abs y, its lower derivatives and what one rounding of phi does; for the",
            "largest pressure angle of a rounding of one radian; for joint loads of the tabulated sensitivity, with",
            "friction of the largest force. Rows declared undecidable:",
            f"{int(m.oracle['undecidable'].sum())}.",
        ),
        "",
    ]
    tables = m.oracle.groupby("table", sort=False)
    summary = []
    for table, part in tables:
        top = part.sort_values("factor").iloc[-1]
        count = f"{part.groupby('quantity')['rows'].sum().max()}"
        kind = str(top["kind"]).replace("_", " ")
        summary.append([table, count, f"{top['allowed']:g}", sig(top["factor"]), top["quantity"], kind])
    lines += pipe_table(["table", "rows", "allowed", "largest known", "of", "among"], summary)
    for table, part in tables:
        quantities = list(dict.fromkeys(part["quantity"]))
        rows = []
        for name, cells in part.groupby("kind", sort=False):
            known = dict(zip(cells["quantity"], cells["factor"], strict=True))
            count = str(int(cells["rows"].max()))
            rows.append([str(name).replace("_", " "), count, *(sig(known.get(q, np.nan)) for q in quantities)])
        lines += ["", f"### {table}, allowed {part['allowed'].iloc[0]:g}", ""]
        lines += pipe_table(["kind of rows", "rows", *quantities], rows)
    worst = [
        [str(poses), str(region), *(sig(part.loc[part["output"] == name, "factor"].max()) for name in ORDERS)]
        for (poses, region), part in m.worst.groupby(["poses", "region"])
    ]
    return [
        *lines,
        "",
        "### Largest found by search",
        "",
        *prose(
            "Crank-rockers outside the tables: `make search-worse` looks for poses with larger factors than any",
            "known; the tests replay them.",
        ),
        "",
        *pipe_table(["poses of", "region", *ORDERS], worst),
    ]
