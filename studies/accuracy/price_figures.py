"""Headline figure, the cost of a digit, and figures of the price lists of families and effects."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from studies.accuracy.effect_prices import TARGETS as EFFECT_TARGETS
from studies.accuracy.measured import Measured
from studies.accuracy.prices import GRID, REFINED, SAMPLES, TARGETS
from studies.accuracy.subjects import ORDINARY
from studies.accuracy.tables import duration, power
from sweep.report.figures import QUIET, house_style, new_figure, save

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Families in the headline figure; every family is in the list.
SHOWN = {"rssr": "spatial crank-rocker", "rssr+guide": "needle drive, two stages", "four_bar": "planar four-bar"}
COLOURS = {"rssr": "#D55E00", "rssr+guide": "#0072B2", "four_bar": "#009E73"}
PEER = "#8a8f98"
LEAST = 1e-16
USUAL = 360.0


def draw_prices(m: Measured, folder: Path) -> list[Path]:
    """Draw the headline figure and the two lists."""
    with house_style():
        figures = {"accuracy": headline(m.families, m.peers)}
        ordinary = m.families[m.families["region"] == ORDINARY]
        figures["accuracy-families"] = _list(ordinary, "family", TARGETS)
        figures["accuracy-effects"] = _list(m.effects, "effect", EFFECT_TARGETS)
        return [save(figure, folder / f"{name}.svg") for name, figure in figures.items()]


def headline(table: pd.DataFrame, peers: pd.DataFrame | None) -> Figure:
    """Draw time per design against digits, promised by accuracy= or reached by grids; legible on a phone."""
    figure = new_figure(7.2, 5.0)
    axes = figure.subplots()
    ordinary = table[table["region"] == ORDINARY]
    for name in (name for name in SHOWN if name in set(ordinary["family"])):
        part, colour = ordinary[ordinary["family"] == name], COLOURS[name]
        refined, grid = (part[part["method"] == method].sort_values("setting") for method in (REFINED, GRID))
        _line(axes, -np.log10(refined["setting"]), refined, colour, "D-", SHOWN[name])
        _line(axes, _digits(grid), grid, colour, "o--", None)
    if peers is not None:
        for what, part in peers[peers["what"].str.startswith("pylinkage")].groupby("what", sort=False):
            _line(axes, _digits(part), part, PEER, "s--", f"planar four-bar, {what}")
    axes.plot([], [], "D-", color="#333333", ms=6, label="accuracy=: digits asked for")
    axes.plot([], [], "o--", color="#333333", ms=5, label=f"grid of {', '.join(map(str, SAMPLES))}: digits reached")
    axes.set(yscale="log", xlim=(1.5, 12.5))
    axes.set_xlabel("digits of the largest acceleration that are right", fontsize=12)
    axes.set_ylabel("time per design", fontsize=12)
    axes.set_xticks(range(2, 13, 2))
    _decades(axes)
    axes.tick_params(labelsize=12)
    axes.legend(loc="upper center", bbox_to_anchor=(0.46, -0.16), ncols=2, frameon=False, fontsize=10.5,
                columnspacing=1.2)  # fmt: skip
    return figure


def _line(axes: Axes, digits: pd.Series, part: pd.DataFrame, colour: str, style: str, label: str | None) -> None:
    middle = part["ns_per_design"]
    spread = np.abs(np.stack([middle - part["ns_per_design_lower"], part["ns_per_design_upper"] - middle]))
    axes.errorbar(
        digits, middle, yerr=spread, fmt=style, color=colour, ms=6.5 if style[0] == "D" else 5, lw=1.8, elinewidth=1,
        label=label,
    )  # fmt: skip


def _digits(part: pd.DataFrame) -> pd.Series:
    error: pd.Series = part["largest_error"].clip(lower=LEAST)
    return error.map(lambda value: -math.log10(value))


def _decades(axes: Axes) -> None:
    low, high = axes.get_ylim()
    ticks = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
    axes.set_ylim(ticks[0], ticks[-1])
    axes.set_yticks(ticks, [duration(tick) for tick in ticks])
    axes.minorticks_off()


def _list(table: pd.DataFrame, key: str, targets: tuple[float, ...]) -> Figure:
    """Draw one row per name, the error on the left and the time on the right, for a usual grid and every accuracy."""
    names = list(dict.fromkeys(table[key]))
    figure = new_figure(8.4, 1.3 + 0.235 * len(names))
    left, right = figure.subplots(1, 2, sharey=True)
    settings = [(GRID, USUAL, "#0072B2", "o", f"grid of {USUAL:.0f}")]
    shades = ("#f4b183", "#D55E00", "#8c3d00", "#3d1b00")
    settings += [
        (REFINED, target, shade, "D", f"accuracy={power(target)}")
        for target, shade in zip(targets, shades, strict=False)
    ]
    for method, setting, colour, marker, label in settings:
        part = table[(table["method"] == method) & np.isclose(table["setting"], setting, rtol=1e-9, atol=0.0)]
        places = [names.index(name) for name in part[key]]
        left.plot(part["largest_error"].clip(LEAST), places, marker, color=colour, ms=4.5, label=label)
        right.plot(part["ns_per_design"], places, marker, color=colour, ms=4.5)
    left.plot(table.groupby(key)["reference_error"].max().reindex(names).clip(LEAST), range(len(names)), "|",
              color=QUIET, ms=9, label="reference sure to")  # fmt: skip
    left.set(xscale="log", xlabel="largest relative error")
    right.set(xscale="log", xlabel="median time per design")
    left.set_yticks(range(len(names)), names, fontsize=8.5)
    left.set_ylim(len(names) - 0.4, -0.6)
    low, high = (round_(np.log10(x)) for round_, x in (
        (np.floor, table["ns_per_design"].min()), (np.ceil, table["ns_per_design"].max())))  # fmt: skip
    ticks = 10.0 ** np.arange(low, high + 1.0)
    right.set_xticks(ticks, [duration(tick) for tick in ticks], rotation=45, ha="right")
    for axes in (left, right):
        axes.minorticks_off()
        axes.tick_params(axis="y", length=0)
    figure.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=4, frameon=False, fontsize=8.5)
    return figure
