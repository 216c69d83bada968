"""Tables of the page: as Markdown, and what each method needs to get below an error."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

BEST = "accuracy="


def significant(value: Any) -> str:
    """Two significant digits, short."""
    x = float(value)
    if not math.isfinite(x):
        return "-"
    return f"{x:.2g}" if 0.01 <= abs(x) < 100.0 or x == 0.0 else (f"{x:.0f}" if 100.0 <= abs(x) < 1e5 else f"{x:.1e}")


def pipe_table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    """A Markdown table, line by line."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return lines + ["| " + " | ".join(str(cell).replace("|", "\\|") for cell in row) + " |" for row in rows]


def reached_table(table: pd.DataFrame, bound: float) -> list[str]:
    """Region by method: the cheapest setting with every design answered and no error above the bound."""
    methods = list(dict.fromkeys(table["method"]))
    rows = []
    for region, part in table.groupby("region", sort=False):
        good = part[(part["largest_error"] <= bound) & (part["unanswered"] == 0)]
        best = {name: found.sort_values("ns_per_design").iloc[0] for name, found in good.groupby("method")}
        cells = [str(region)]
        for method in methods:
            if method not in best:
                cells.append("-")
                continue
            at = best[method]
            setting = f"{at['setting']:g}" if method == BEST else f"N {at['setting']:.0f}"
            ratio = ""
            if method != BEST and BEST in best:
                ratio = f", x{significant(at['ns_per_design'] / best[BEST]['ns_per_design'])}"
            cells.append(f"{setting}: {at['ns_per_design']:.0f} ns{ratio}")
        rows.append(cells)
    return pipe_table(["region", *methods], rows)


def html_body(page: str, after: str, inserted: str) -> str:
    """Headings, paragraphs and tables of the page as HTML; ``inserted`` follows the heading ``after``."""
    blocks = []
    for block in page.split("\n\n"):
        lines = block.strip().split("\n")
        if lines[0].startswith("|"):
            head, *body = (re.split(r"(?<!\\)\|", line)[1:-1] for line in (lines[0], *lines[2:]))
            cells = "".join(f"<th>{_inline(cell)}</th>" for cell in head)
            rows = "".join("<tr>" + "".join(f"<td>{_inline(cell)}</td>" for cell in row) + "</tr>" for row in body)
            blocks.append(f"<table><tr>{cells}</tr>{rows}</table>")
        elif lines[0].startswith("#"):
            level = len(lines[0]) - len(lines[0].lstrip("#"))
            blocks.append(f"<h{level}>{_inline(lines[0].lstrip('# '))}</h{level}>")
            if lines[0] == after:
                blocks.append(inserted)
        else:
            blocks.append(f"<p>{_inline(' '.join(lines))}</p>")
    return "\n".join(blocks)


def _inline(text: str) -> str:
    text = escape(text.strip().replace("\\|", "|"), quote=False)
    text = re.sub(r"`([^`]*)`", r"<code>\1</code>", text)
    return re.sub(r"\*\*([^*]*)\*\*", r"<strong>\1</strong>", text)
