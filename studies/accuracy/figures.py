"""Work-precision diagrams and the price list as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from studies.accuracy.tables import duration
from sweep.report.figures import WIDTH, Saved, house_style, new_figure, save

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEAST_ERROR = 1e-16  # half a unit in the last place: an error of zero is drawn here
TITLES = {
    "psi": "Rocker angle at 360 crank angles",
    "max_abs_d2psi": "Largest acceleration of the turn",
    "swing": "Swing",
}
ERRORS = {"psi": "largest error [rad]", "max_abs_d2psi": "largest relative error", "swing": "largest relative error"}
# Colours that the colour-blind tell apart, and a marker of its own for each.
LOOKS = {
    "grid, float64": ("#0072B2", "o"),
    "table, straight lines": ("#0072B2", "o"),
    "grid, float32": ("#8a8f98", "s"),
    "direct, float32": ("#8a8f98", "s"),
    "grid + parabola": ("#009E73", "^"),
    "table, cubics": ("#009E73", "^"),
    "grid + refined top sample": ("#AA4499", "v"),
    "direct, twice float64": ("#332288", "P"),
    "accuracy=": ("#D55E00", "D"),
    "direct, float64": ("#D55E00", "D"),
    "certified, accuracy=": ("#332288", "P"),
}
KINDS = {
    "largest over a grid": "#0072B2",
    "poses": "#009E73",
    "whole turn, exact": "#D55E00",
    "effect": "#8a8f98",
}


def draw(work: pd.DataFrame, costs: pd.DataFrame, regions: tuple[tuple[str, str], ...], folder: Path) -> list[Saved]:
    """Return all methods on ordinary designs, a figure per quantity with a panel per region,
    and the prices of outputs.
    """
    with house_style():
        figures = {"accuracy-methods": _methods(work, regions[0][0])}
        figures |= {f"accuracy-{name}": _by_region(work, name, regions) for name in TITLES}
        figures["accuracy-prices"] = _prices(costs)
        return [save(figure, folder / f"{name}.svg") for name, figure in figures.items()]


def _curves(axes: Axes, points: pd.DataFrame) -> None:
    for curve, part in points.groupby("method", sort=False):
        colour, marker = LOOKS[str(curve)]
        error = part["largest_error"].clip(LEAST_ERROR, 1.0)
        size = 6 if len(part) == 1 else 3.5
        axes.plot(error, part["ns_per_design"], marker=marker, color=colour, ms=size, lw=1.2, label=str(curve))
    axes.set(xscale="log", yscale="log", xlim=(LEAST_ERROR / 3.0, 3.0))
    axes.set_xticks([1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0], ["1e-15", "1e-12", "1e-9", "1e-6", "1e-3", "1"])
    axes.minorticks_off()


def _decades(axes: Axes, times: pd.Series) -> None:
    """Set whole decades on the axis of time, so that every figure can be read and compared."""
    low, high = (round_(np.log10(value)) for round_, value in ((np.floor, times.min()), (np.ceil, times.max())))
    axes.set_ylim(10.0**low, 10.0**high)
    ticks = 10.0 ** np.arange(low, high + 1.0)
    axes.set_yticks(ticks, [duration(tick) for tick in ticks])
    axes.minorticks_off()


def _plain_figure(width: float, height: float, **margins: float) -> Figure:
    """Return a figure with given margins: to let the layout be solved for eight panels takes seconds."""
    figure = new_figure(width, height)
    figure.set_layout_engine(None)
    figure.subplots_adjust(**margins)
    return figure


def _methods(work: pd.DataFrame, region: str) -> Figure:
    figure = _plain_figure(WIDTH * 1.15, 4.4, left=0.075, right=0.99, bottom=0.36, top=0.93, wspace=0.16)
    panels = figure.subplots(1, len(TITLES), sharey=True)
    for axes, (quantity, title) in zip(panels, TITLES.items(), strict=True):
        _curves(axes, work[(work["quantity"] == quantity) & (work["region"] == region)])
        axes.set(title=title, xlabel=ERRORS[quantity])
        axes.tick_params(labelleft=True)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), frameon=False, fontsize=8)
    _decades(panels[0], work.loc[work["region"] == region, "ns_per_design"])
    panels[0].set_ylabel("time per design")
    panels[0].text(0.03, 0.03, "better: left and down", transform=panels[0].transAxes, fontsize=7.5, color="#5b6067")
    return figure


def _by_region(work: pd.DataFrame, quantity: str, regions: tuple[tuple[str, str], ...]) -> Figure:
    table = work[work["quantity"] == quantity]
    rows = -(-(len(regions) + 1) // 4)
    figure = _plain_figure(
        WIDTH * 1.25, 3.0 * rows, left=0.07, right=0.99, bottom=0.085, top=0.93, wspace=0.25, hspace=0.4
    )
    panels = figure.subplots(rows, 4, sharex=True, sharey=True, squeeze=False).ravel()
    for axes, (name, text) in zip(panels, regions, strict=False):
        _curves(axes, table[table["region"] == name])
        axes.set_title(f"{name[0].upper()}{name[1:]}", loc="left", pad=13)
        axes.text(0.0, 1.015, text, transform=axes.transAxes, fontsize=6.8, color="#5b6067", va="bottom")
        axes.tick_params(labelbottom=True, labelleft=True)
    _decades(panels[0], table["ns_per_design"])
    for axes in panels[len(regions) :]:
        axes.set_axis_off()
    handles, labels = panels[0].get_legend_handles_labels()
    panels[len(regions)].legend(handles, labels, loc="center", frameon=False, title=TITLES[quantity])
    figure.supxlabel(f"{ERRORS[quantity]} of the region's designs", fontsize=9, y=0.01)
    figure.supylabel("time per design", fontsize=9, x=0.005)
    return figure


def _prices(costs: pd.DataFrame) -> Figure:
    """Return bars on a logarithmic axis: per pose on the left, per design on the right."""
    parts = [costs[costs["per"] == per] for per in ("pose", "design")]
    longest = max(len(part) for part in parts)
    figure = new_figure(WIDTH * 1.25, 0.6 + 0.21 * longest)
    for axes, part, per in zip(figure.subplots(1, 2), parts, ("pose", "design"), strict=True):
        names = [
            str(what) + (" (rssp)" if family.startswith("rssp") else "")
            for what, family in zip(part["what"], part["family"], strict=True)
        ]
        places = range(len(part))
        bars = axes.barh(places, part["nanoseconds"], color=[KINDS[kind] for kind in part["kind"]], height=0.7)
        axes.bar_label(bars, [f" {duration(ns)}" for ns in part["nanoseconds"]], fontsize=7)
        axes.set(xscale="log", ylim=(longest - 0.4, -0.6), xlabel=f"time per {per}")
        axes.set_yticks(places, names, fontsize=7)
        ticks = 10.0 ** np.arange(
            np.floor(np.log10(part["nanoseconds"].min())), np.ceil(np.log10(part["nanoseconds"].max())) + 1.0
        )
        axes.set_xticks(ticks, [duration(tick) for tick in ticks])
        axes.minorticks_off()
        axes.set_xlim(ticks[0], 3.0 * ticks[-1])
        axes.grid(visible=False, axis="y")
        for kind in dict.fromkeys(part["kind"]):
            axes.barh([0], [0], color=KINDS[kind], label=kind)
        axes.legend(loc="lower right" if len(part) < longest else "upper right", fontsize=7)
    return figure
