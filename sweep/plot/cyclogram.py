"""The cyclogram as a chart: a row of bars for each member, events as lines across all rows."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from sweep.report.figures import LIMIT, OPTIMUM, QUIET, WIDTH, crank_axis, new_figure

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TURN = 360.0
BAR, THIN = 0.5, 0.16  # heights of strokes and dwells, a row being 1


def cyclogram_figure(rows: pd.DataFrame) -> Figure:
    """Draw a cyclogram over one turn of the main shaft: rising strokes dark, falling ones light, dwells beneath."""
    members = list(dict.fromkeys(rows["member"][rows["kind"] != "event"]))
    events = rows[rows["kind"] == "event"]
    figure = new_figure(WIDTH, 0.62 * len(members) + 1.0 + 0.14 * len(events))
    axes = figure.subplots()
    spans: Any = zip(*(rows[column] for column in ("member", "kind", "name", "start", "end")), strict=True)
    for member, kind, name, begin, end in spans:
        if kind == "event":
            continue
        height = len(members) - 1 - members.index(member)
        start, length = math.degrees(begin), math.degrees(end - begin) % TURN
        stroke = kind == "stroke"
        colour = (OPTIMUM if name == "rises" else "#a9c1df") if stroke else QUIET
        bottom = height - 0.5 * BAR if stroke else height - 0.5 * BAR - THIN - 0.04
        pieces = [(start, min(length, TURN - start)), (0.0, max(start + length - TURN, 0.0))]
        axes.broken_barh(pieces, (bottom, BAR if stroke else THIN), color=colour, linewidth=0, zorder=2)
    _events(axes, events, len(members))
    axes.set_yticks(range(len(members)), members[::-1])
    axes.set_ylim(-0.6, len(members) - 0.3 + 0.34 * len(events))
    crank_axis(axes, "angle of the main shaft [°]")
    return figure


def _events(axes: Axes, events: pd.DataFrame, rows: int) -> None:
    """Draw each event as a line, its name above the rows, one below the other so that none covers another."""
    named: Any = zip(events["name"], events["start"], strict=True)
    for k, (name, start) in enumerate(named):
        phi, height = math.degrees(start), rows - 0.35 + 0.34 * k
        axes.plot([phi, phi], [-0.6, height], color=LIMIT, linewidth=1.0, zorder=3)
        right = phi > 0.75 * TURN
        words = f"{name} {phi:.1f}°"
        axes.text(phi - 3 if right else phi + 3, height, words, ha="right" if right else "left", va="top", fontsize=8)
