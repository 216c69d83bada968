"""Numbers, paragraphs and tables of the pages, as Markdown."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

Ways = Iterable[tuple[str, float]]
"""Names of methods, each with a setting."""
Parts = Mapping[str, Sequence[str]]
"""Lines of a page by the name of their placeholder in its template."""
USUAL = (("grid", 360.0), ("accuracy=", 1e-3), ("accuracy=", 1e-9))
USUAL_HEAD = ("grid 360", "`1e-3`", "`1e-9`")
"""Methods and settings that the pages show of all that are measured, and the heads of their columns."""


def significant(value: Any) -> str:
    """Format a number in two significant digits."""
    x = float(value)
    if not math.isfinite(x):
        return "-"
    return f"{x:.2g}" if 0.01 <= abs(x) < 100.0 or x == 0.0 else (f"{x:.0f}" if 100.0 <= abs(x) < 1e5 else f"{x:.1e}")


def power(x: float) -> str:
    """Format a power of ten as 1e-3, and any other number by ``g``."""
    exponent = round(math.log10(x))
    return f"1e{exponent}" if math.isclose(x, 10.0**exponent) and x != 1.0 else f"{x:g}"


def prose(*sentences: str) -> list[str]:
    """Wrap sentences to the line length of the docs."""
    return textwrap.wrap(" ".join(sentences), 118, break_long_words=False, break_on_hyphens=False)


def pipe_table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    """Return a Markdown table, line by line."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return lines + ["| " + " | ".join(str(cell).replace("|", "\\|") for cell in row) + " |" for row in rows]


def duration(nanoseconds: Any) -> str:
    """Format a time in a suitable unit."""
    ns = float(nanoseconds)
    for unit, size in (("ns", 1.0), ("us", 1e3), ("ms", 1e6), ("s", 1e9)):
        if ns < 1e3 * size or unit == "s":
            return f"{ns / size:.3g} {unit}" if ns < 999.5 * size else f"{ns / size:.0f} {unit}"
    raise AssertionError(ns)


def at(table: pd.DataFrame, method: str, setting: float) -> pd.DataFrame:
    """Return the rows of one method at one setting."""
    return table[(table["method"] == method) & np.isclose(table["setting"], setting, rtol=1e-9, atol=0.0)]


def cells(rows: pd.DataFrame, ways: Ways) -> list[str]:
    """Return largest error and median time of one mechanism by every method; - if it was not measured."""
    found = []
    for method, setting in ways:
        here = at(rows, method, setting)
        error, took = (None, None) if here.empty else here[["largest_error", "ns_per_design"]].iloc[0]
        found.append("-" if here.empty else f"{significant(error)}; {duration(took)}")
    return found
