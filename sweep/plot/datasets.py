"""Figures of a dataset folder: design space, trade-off, tolerances, sensitivities."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sweep.errors import InputError
from sweep.report import figures
from sweep.report.dataset import gather, read_dataset
from sweep.report.figures import LIMIT, NARROW, OPTIMUM, QUIET, REFERENCE, house_style, new_figure
from sweep.report.made import Histogram, histogram, slopes, spreads, tolerance_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SEEN = 0.005  # share of the longest bar: shorter ones are no wider than a line


def map(folder: str | Path, x: str | None = None, y: str | None = None) -> NDArray[Any]:
    """Draw the best objective and the share of feasible designs in each cell of two swept parameters.

    Parameters
    ----------
    folder : folder that `sweep run` has written
    x, y : two swept parameters; by default the pair over which the objective varies most

    Returns
    -------
    array of Axes
        best objective (if the study has one) and share of feasible designs

    Raises
    ------
    InputError
        for parameters that the study does not sweep, or a study without a map.

    Examples
    --------
    >>> import sweep
    >>> best, share = sweep.plot.map("results/press/designs", "a", "b")
    >>> best.get_xlabel(), best.get_ylabel()
    ('a [mm]', 'b [mm]')
    """
    data, scanned, cells = gather(Path(folder))
    pair = None
    if x is not None or y is not None:
        names = [c.name for c in cells]
        for name in (x, y):
            if name not in names:
                raise InputError("axis", name, f"two of {', '.join(names)}", str(folder))
        pair = next(((a, b) for a, b in ((x, y), (y, x)) if (a, b) in scanned.grids), None)
        if pair is None:
            raise InputError("axes", [x, y], "two different swept parameters", str(folder))
    with house_style():
        figure = figures.design_map(data, scanned, cells, None if pair is None else (str(pair[0]), str(pair[1])))
    drawn = _drawn(figure, folder, "a study that sweeps a parameter and has feasible designs")
    return np.array(drawn.axes[: 1 if data.objective is None else 2], dtype=object)


def front(folder: str | Path) -> Axes:
    """Draw the objective against a second criterion: designs of the sweep, and the front if one was searched.

    Parameters
    ----------
    folder : folder that ``sweep run`` has written

    Returns
    -------
    Axes
        the second criterion over the objective

    Raises
    ------
    InputError
        for a study without objective or second criterion.

    Examples
    --------
    >>> import sweep
    >>> sweep.plot.front("results/press/designs").get_xlabel()
    'largest acceleration max |s″| [mm/rad²]'
    """
    data, scanned, _ = gather(Path(folder))
    with house_style():
        figure = figures.trade_off(data, scanned)
    return _drawn(figure, folder, "a study with an objective and a second criterion").axes[0]


def tolerance(folder: str | Path, output: str | None = None) -> Axes:
    """Draw the spread of the optimum's outputs under manufacturing tolerances, or one of them as a histogram.

    Parameters
    ----------
    folder : folder that ``sweep run`` has written
    output : a design output: its histogram over 8192 mechanisms made within the tolerances, bins that miss its limit in
        another colour.  By default all outputs of the study, each relative to its nominal value; the dot is the mean,
        the bar holds 95 % of the mechanisms

    Returns
    -------
    Axes
        a bar for each output, or a histogram

    Raises
    ------
    InputError
        for a study without tolerances, or an output that the mechanism does not have.

    Examples
    --------
    >>> import sweep
    >>> axes = sweep.plot.tolerance("results/press/designs")
    >>> axes.get_xlabel()
    'change from the nominal value [%]'
    """
    data = read_dataset(Path(folder))
    bins = histogram(data, output) if output is not None else None
    changes = [(spread.shown.symbol, spread.changes) for spread in spreads(data) if spread.changes is not None]
    if bins is None and (output is not None or not changes):
        raise InputError("folder", str(folder), "a dataset with an optimum and [tolerance]", "plot")
    with house_style():
        axes = new_figure(NARROW, 0.27 * len(changes) + 1.1 if bins is None else 1.9).subplots()
        axes.set_title(tolerance_words(data))
        if bins is not None:
            return draw_histogram(axes, bins)
        for k, (_, (low, mean, high)) in enumerate(changes):
            axes.plot([low, high], [k, k], color=OPTIMUM, linewidth=5.0, solid_capstyle="butt", alpha=0.5)
            axes.plot(mean, k, "o", color=OPTIMUM, markersize=4.5)
        axes.axvline(0.0, color=QUIET, linewidth=0.8)
        axes.set_yticks(range(len(changes)), [symbol for symbol, _ in changes])
        axes.invert_yaxis()
        axes.set_xlabel("change from the nominal value [%]")
    return axes


def draw_histogram(axes: Axes, bins: Histogram) -> Axes:
    """Draw the histogram of an output, with bins that miss its limit in another colour, and lines at the limit."""
    colours = np.where(bins.missing, LIMIT, OPTIMUM)
    axes.bar(bins.edges[:-1], 100.0 * bins.shares, 0.92 * np.diff(bins.edges), align="edge", color=colours, alpha=0.75)
    for bound in (bins.low, bins.high):
        if bound is not None:
            axes.axvline(bound, color=LIMIT, linewidth=1.2)
    axes.set_xlabel(bins.shown.title)
    axes.set_ylabel("of what is made [%]")
    return axes


def sensitivity(folder: str | Path) -> Axes:
    """Draw the changes of the objective at the optimum for a small change of each dimension, the largest first.

    Parameters
    ----------
    folder : folder that ``sweep run`` has written

    Returns
    -------
    Axes
        two bars for each dimension: for growth and for shrinkage

    Raises
    ------
    InputError
        for a dataset without sensitivities.

    Examples
    --------
    >>> import sweep
    >>> axes = sweep.plot.sensitivity("results/press/designs")
    >>> len(axes.get_yticklabels())  # a, b, e
    3
    """
    data = read_dataset(Path(folder))
    ranked, objective = slopes(data), data.objective
    ranked = [slope for slope in ranked if slope.largest > SEEN * ranked[0].largest]
    if not ranked or objective is None:
        raise InputError("folder", str(folder), "a dataset with an optimum and its sensitivities", "plot")
    with house_style():
        axes = new_figure(NARROW, 0.28 * len(ranked) + 1.1).subplots()
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
    return axes


def _drawn(figure: Figure | None, folder: str | Path, allowed: str) -> Figure:
    if figure is None:
        raise InputError("folder", str(folder), allowed, "plot")
    return figure
