"""Tables of the page: as Markdown, and what each method needs to get below an error."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

HOUSE = {"psi": "direct, float64", "max_abs_d2psi": "accuracy=", "swing": "accuracy="}  # of each quantity


def significant(value: Any) -> str:
    """Return two significant digits, short."""
    x = float(value)
    if not math.isfinite(x):
        return "-"
    return f"{x:.2g}" if 0.01 <= abs(x) < 100.0 or x == 0.0 else (f"{x:.0f}" if 100.0 <= abs(x) < 1e5 else f"{x:.1e}")


def power(x: float) -> str:
    """Return a power of ten as 1e-3; anything else as it comes."""
    exponent = round(math.log10(x))
    return f"1e{exponent}" if math.isclose(x, 10.0**exponent) and x != 1.0 else f"{x:g}"


def prose(*sentences: str) -> list[str]:
    """Return a paragraph, wrapped as the pages of the house are."""
    return textwrap.wrap(" ".join(sentences), 118, break_long_words=False, break_on_hyphens=False)


def pipe_table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    """Return a Markdown table, line by line."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return lines + ["| " + " | ".join(str(cell).replace("|", "\\|") for cell in row) + " |" for row in rows]


def duration(nanoseconds: Any) -> str:
    """Return a time per design in the unit in which it is read."""
    ns = float(nanoseconds)
    for unit, size in (("ns", 1.0), ("us", 1e3), ("ms", 1e6), ("s", 1e9)):
        if ns < 1e3 * size or unit == "s":
            return f"{ns / size:.3g} {unit}" if ns < 999.5 * size else f"{ns / size:.0f} {unit}"
    raise AssertionError(ns)


def setting_of(at: pd.Series) -> str:
    """Return the setting of a point of a curve in words; empty where the method has none."""
    if str(at["method"]).startswith("direct"):
        return ""
    return power(at["setting"]) if str(at["method"]).endswith("=") else f"N {at['setting']:.0f}"


def coarsest(curve: pd.DataFrame, bound: float) -> pd.Series | None:
    """Return the coarsest setting of one method in one region with every design answered
    and no error above the bound.
    """
    good = curve[(curve["largest_error"] <= bound) & (curve["unanswered"] == 0) & allowed(curve, bound)]
    if good.empty:
        return None
    return good.sort_values("setting").iloc[-1 if str(good["method"].iloc[0]).endswith("=") else 0]


def allowed(curve: pd.DataFrame, bound: float) -> pd.Series:
    """Return settings that may be recommended: an ``accuracy=`` is a promise, so one coarser than the bound is not."""
    return ~curve["method"].str.endswith("=") | (curve["setting"] <= bound * (1.0 + 1e-9))


def reached_table(table: pd.DataFrame, bound: float) -> list[str]:
    """Return the region by method: the coarsest setting within the bound, its time, and how many times that of ours."""
    methods = list(dict.fromkeys(table["method"]))
    own = HOUSE[str(table["quantity"].iloc[0])]
    rows = []
    for region, part in table.groupby("region", sort=False):
        best = {method: coarsest(part[part["method"] == method], bound) for method in methods}
        cells = [str(region)]
        for method, at in best.items():
            if at is None:
                cells.append("-")
                continue
            ours = best[own]
            ratio = (
                ""
                if ours is None or method == own
                else f", x {significant(at['ns_per_design'] / ours['ns_per_design'])}"
            )
            cells.append(f"{setting_of(at)}: {duration(at['ns_per_design'])}{ratio}".removeprefix(": "))
        rows.append(cells)
    return pipe_table(["region", *methods], rows)


def html_body(page: str, images: Mapping[str, str]) -> str:
    """Return headings, paragraphs, lists, tables and images of the page as HTML; ``images``: data URIs by file name."""
    blocks = []
    for block in page.split("\n\n"):
        lines = block.strip().split("\n")
        picture = re.fullmatch(r"!\[(.*)\]\((.*)\)", lines[0])
        if picture:
            blocks.append(f'<img alt="{escape(picture[1])}" src="{images[picture[2].rpartition("/")[2]]}">')
        elif lines[0].startswith("|"):
            head, *body = (re.split(r"(?<!\\)\|", line)[1:-1] for line in (lines[0], *lines[2:]))
            cells = "".join(f"<th>{_inline(cell)}</th>" for cell in head)
            rows = "".join("<tr>" + "".join(f"<td>{_inline(cell)}</td>" for cell in row) + "</tr>" for row in body)
            blocks.append(f"<table><tr>{cells}</tr>{rows}</table>")
        elif lines[0].startswith("#"):
            level = len(lines[0]) - len(lines[0].lstrip("#"))
            blocks.append(f"<h{level}>{_inline(lines[0].lstrip('# '))}</h{level}>")
        elif lines[0].startswith("* "):
            items = "".join(f"<li>{_inline(line.removeprefix('* '))}</li>" for line in lines)
            blocks.append(f"<ul>{items}</ul>")
        else:
            blocks.append(f"<p>{_inline(' '.join(lines))}</p>")
    return "\n".join(blocks)


def _inline(text: str) -> str:
    text = escape(text.strip().replace("\\|", "|"), quote=False)
    text = re.sub(r"`([^`]*)`", r"<code>\1</code>", text)
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", text)  # all pages are one here
    return re.sub(r"\*\*([^*]*)\*\*", r"<strong>\1</strong>", text)
