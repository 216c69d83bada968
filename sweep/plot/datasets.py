"""Pictures of a dataset folder: design space, trade-off, tolerances, sensitivities."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sweep.dataset import store
from sweep.errors import InputError
from sweep.quantities.names import is_flag
from sweep.report import pictures
from sweep.report.dataset import read_dataset
from sweep.report.figures import OPTIMUM, QUIET, REFERENCE, house_style, new_figure
from sweep.report.page import gather
from sweep.report.quantities import quantity
from sweep.report.robust import optimum_rows, slopes, tolerance_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def map(folder: str | Path, x: str | None = None, y: str | None = None) -> NDArray[Any]:
    """What the best design of each cell of two swept parameters attains, and the share of feasible designs.

    Parameters
    ----------
    folder : what `sweep run` left behind
    x, y : two swept parameters; if left out the pair over which the objective varies most

    Returns
    -------
    array of Axes
        best objective (if the study has one) and share of feasible designs

    Raises
    ------
    InputError
        for parameters the study does not sweep, a study without a map.

    Examples
    --------
    >>> import sweep
    >>> best, share = sweep.plot.map("results/press/designs", "a", "b")
    >>> best.get_xlabel(), best.get_ylabel()
    ('a [mm]', 'b [mm]')
    """
    data, found, cells = gather(Path(folder))
    pair = None
    if x is not None or y is not None:
        known = [c.name for c in cells]
        for name in (x, y):
            if name not in known:
                raise InputError("axis", name, f"two of {', '.join(known)}", str(folder))
        pair = next(((a, b) for a, b in ((x, y), (y, x)) if (a, b) in found.grids), None)
        if pair is None:
            raise InputError("axes", [x, y], "two different swept parameters", str(folder))
    with house_style():
        figure = pictures.design_map(data, found, cells, None if pair is None else (str(pair[0]), str(pair[1])))
    drawn = _drawn(figure, folder, "a study that sweeps a parameter and has feasible designs")
    return np.array(drawn.axes[: 1 if data.study.objective is None else 2], dtype=object)


def front(folder: str | Path) -> Axes:
    """The objective against a second criterion: designs of the sweep, and the front where one was searched.

    Parameters
    ----------
    folder : what ``sweep run`` left behind

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
    data, found, _ = gather(Path(folder))
    with house_style():
        figure = pictures.trade_off(data, found)
    return _drawn(figure, folder, "a study with an objective and a second criterion").axes[0]


def tolerance(folder: str | Path) -> Axes:
    """Spread of the optimum's outputs as it is made, each in parts of its nominal value; the dot is the mean.

    Parameters
    ----------
    folder : what ``sweep run`` left behind

    Returns
    -------
    Axes
        a bar for each output

    Raises
    ------
    InputError
        for a study without tolerances.

    Examples
    --------
    >>> import sweep
    >>> axes = sweep.plot.tolerance("results/press/designs")
    >>> axes.get_xlabel()
    'change from the nominal value [%]'
    """
    data = read_dataset(Path(folder))
    rows = [
        row
        for row in optimum_rows(data, store.TOLERANCE)
        if not math.isnan(row["nominal"]) and row["nominal"] != 0.0 and not is_flag(str(row["output"]))
    ]
    if not rows:
        raise InputError("folder", str(folder), "a dataset with an optimum and [tolerance]", "plot")
    with house_style():
        names = [str(row["output"]) for row in rows]
        axes = _lying([quantity(name, data.units.get(name, "")).symbol for name in names], 0.45)
        for k, row in enumerate(rows):
            low, mean, high = (100.0 * (row[key] / row["nominal"] - 1.0) for key in ("low", "mean", "high"))
            axes.plot([low, high], [k, k], color=OPTIMUM, linewidth=5.0, solid_capstyle="butt", alpha=0.5)
            axes.plot(mean, k, "o", color=OPTIMUM)
        axes.axvline(0.0, color=QUIET, linewidth=0.8)
        axes.set_xlabel("change from the nominal value [%]")
        axes.set_title(f"as it is made, {tolerance_words(data)}")
    return axes


def sensitivity(folder: str | Path) -> Axes:
    """By how much a small change of each dimension changes the objective at the optimum, the most telling first.

    Parameters
    ----------
    folder : what ``sweep run`` left behind

    Returns
    -------
    Axes
        two bars for each dimension: made larger, made smaller

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
    ranked = slopes(data)
    objective = pictures.shown_objective(data)
    if not ranked or objective is None:
        raise InputError("folder", str(folder), "a dataset with an optimum and its sensitivities", "plot")
    with house_style():
        axes = _lying([f"{s.name}, by {s.step}" for s in ranked], 0.38)
        for offset, values, colour, label in (
            (-0.2, [s.growing for s in ranked], OPTIMUM, "larger"),
            (0.2, [s.shrinking for s in ranked], REFERENCE, "smaller"),
        ):
            axes.barh(np.arange(len(ranked)) + offset, values, 0.38, color=colour, label=label)
        axes.axvline(0.0, color=QUIET, linewidth=0.8)
        axes.set_xlabel(f"change of the {objective.words} [%]")
        axes.legend()
    return axes


def _lying(labels: list[str], height: float) -> Axes:
    """Open a figure with one line for each label, ``height`` [inch] each, the first on top."""
    axes = new_figure(7.0, height * len(labels) + 1.2).subplots()
    axes.set_yticks(range(len(labels)), labels)
    axes.invert_yaxis()
    return axes


def _drawn(figure: Figure | None, folder: str | Path, allowed: str) -> Figure:
    if figure is None:
        raise InputError("folder", str(folder), allowed, "plot")
    return figure
