"""Figures of what is made: histogram of an output, spread of all of them, sensitivity of the objective."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sweep.report.figures import LIMIT, OPTIMUM, QUIET, REFERENCE, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sweep.report.made import Histogram
    from sweep.report.quantities import Quantity
    from sweep.report.robust import Slope

NARROW = 4.6  # inches: bars and their names can still be read on a telephone


def histogram_figure(found: Histogram, title: str = "") -> Figure:
    """Return an output over what is made; what misses its limit has another colour, lines are the limit."""
    figure = new_figure(NARROW, 1.9)
    axes = figure.subplots()
    middle = 0.5 * (found.edges[:-1] + found.edges[1:])
    bounds = [x for x in (found.low, found.high) if x is not None]
    low, high = (-np.inf if found.low is None else found.low), (np.inf if found.high is None else found.high)
    colours = np.where((middle >= low) & (middle <= high), OPTIMUM, LIMIT)
    axes.bar(middle, 100.0 * found.shares, 0.92 * np.diff(found.edges), color=colours, alpha=0.75)
    for bound in bounds:
        axes.axvline(bound, color=LIMIT, linewidth=1.2)
    axes.set_xlabel(found.shown.title)
    axes.set_ylabel("of what is made [%]")
    axes.set_title(title)
    return figure


def spread_figure(rows: Sequence[tuple[Quantity, float, float, float]], title: str) -> Figure:
    """Return outputs with low end, mean and high end of what is made, in percent of the nominal value."""
    figure = new_figure(NARROW, 0.27 * len(rows) + 1.1)
    axes = figure.subplots()
    for k, (_, low, mean, high) in enumerate(rows):
        axes.plot([low, high], [k, k], color=OPTIMUM, linewidth=5.0, solid_capstyle="butt", alpha=0.5)
        axes.plot(mean, k, "o", color=OPTIMUM, markersize=4.5)
    axes.axvline(0.0, color=QUIET, linewidth=0.8)
    axes.set_yticks(range(len(rows)), [shown.symbol for shown, *_ in rows])
    axes.invert_yaxis()
    axes.set_xlabel("change from the nominal value [%]")
    axes.set_title(title)
    return figure


def slopes_figure(ranked: Sequence[Slope], objective: Quantity) -> Figure:
    """Return two bars for each dimension: made larger, made smaller; the most telling first."""
    figure = new_figure(NARROW, 0.28 * len(ranked) + 1.1)
    axes = figure.subplots()
    for offset, values, colour, label in (
        (-0.2, [s.growing for s in ranked], OPTIMUM, "larger"),
        (0.2, [s.shrinking for s in ranked], REFERENCE, "smaller"),
    ):
        axes.barh(np.arange(len(ranked)) + offset, values, 0.38, color=colour, label=label)
    axes.axvline(0.0, color=QUIET, linewidth=0.8)
    axes.set_yticks(range(len(ranked)), [f"{s.name}, by {s.step}" for s in ranked])
    axes.invert_yaxis()
    axes.set_xlabel(f"change of the {objective.words} [%]")
    axes.legend()
    return figure
