"""Work-precision diagrams: one panel per region, one curve per method."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sweep.report.figures import WIDTH, Saved, house_style, new_figure, save

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

LEAST_ERROR = 1e-16  # half a unit in the last place: an error of zero is drawn here
TITLES = {"max_abs_d2psi": "largest acceleration over the turn", "swing": "swing"}
COLOURS = {
    "grid, float64": "#1f5aa6",
    "grid, float32": "#8a8f98",
    "grid + parabola": "#2f8f5b",
    "grid + refined top sample": "#7d4fa3",
    "accuracy=": "#c8551b",
}


def draw(table: pd.DataFrame, folder: Path) -> list[Saved]:
    """One SVG per quantity."""
    with house_style():
        return [
            save(_figure(table[table["quantity"] == quantity], title), folder / f"{quantity}.svg")
            for quantity, title in TITLES.items()
        ]


def _figure(table: pd.DataFrame, title: str) -> Figure:
    names = list(dict.fromkeys(table["region"]))
    rows = -(-(len(names) + 1) // 4)
    figure = new_figure(WIDTH * 1.25, 2.7 * rows)
    panels = figure.subplots(rows, 4, sharex=True, sharey=True, squeeze=False).ravel()
    for axes, name in zip(panels, names, strict=False):
        for curve, points in table[table["region"] == name].groupby("method", sort=False):
            known = points.dropna(subset=["largest_error"])
            error = known["largest_error"].clip(LEAST_ERROR, 1.0)
            axes.plot(error, known["ns_per_design"], "o-", color=COLOURS[str(curve)], ms=3, lw=1.1, label=str(curve))
        axes.set(xscale="log", yscale="log", title=name)
    for axes in panels[len(names) :]:
        axes.set_axis_off()
    handles, labels = panels[0].get_legend_handles_labels()
    panels[len(names)].legend(handles, labels, loc="center", frameon=False, title=title)
    figure.supxlabel("largest relative error of the region's designs", fontsize=9)
    figure.supylabel("time per design [ns]", fontsize=9)
    return figure
