"""Pictures of a dataset folder: design space, trade-off, tolerances, sensitivities."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sweep.errors import InputError
from sweep.report import maps, robust
from sweep.report.dataset import gather, read_dataset
from sweep.report.figures import house_style
from sweep.report.made import histogram, histogram_figure
from sweep.report.robust import tolerance_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def map(folder: str | Path, x: str | None = None, y: str | None = None) -> NDArray[Any]:
    """Show what the best design of each cell of two swept parameters attains, and the share of feasible designs.

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
        figure = maps.design_map(data, found, cells, None if pair is None else (str(pair[0]), str(pair[1])))
    drawn = _drawn(figure, folder, "a study that sweeps a parameter and has feasible designs")
    return np.array(drawn.axes[: 1 if data.study.objective is None else 2], dtype=object)


def front(folder: str | Path) -> Axes:
    """Show the objective against a second criterion: designs of the sweep, and the front where one was searched.

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
        figure = maps.trade_off(data, found)
    return _drawn(figure, folder, "a study with an objective and a second criterion").axes[0]


def tolerance(folder: str | Path, output: str | None = None) -> Axes:
    """Return what manufacture makes of the optimum: the spread of its outputs, or one of them as a histogram.

    Parameters
    ----------
    folder : what ``sweep run`` left behind
    output : a design output: its histogram over 8192 mechanisms made within the tolerances, what misses its limit in
        another colour.  If left out all outputs of the study, each in parts of its nominal value; the dot is the mean,
        the bar holds 95 % of what is made

    Returns
    -------
    Axes
        a bar for each output, or a histogram

    Raises
    ------
    InputError
        for a study without tolerances, an output that the mechanism does not have.

    Examples
    --------
    >>> import sweep
    >>> axes = sweep.plot.tolerance("results/press/designs")
    >>> axes.get_xlabel()
    'change from the nominal value [%]'
    """
    data = read_dataset(Path(folder))
    allowed = "a dataset with an optimum and [tolerance]"
    if output is None:
        with house_style():
            return _drawn(robust.tolerance(data), folder, allowed).axes[0]
    found = histogram(data, output)
    with house_style():
        figure = None if found is None else histogram_figure(found, tolerance_words(data))
    return _drawn(figure, folder, allowed).axes[0]


def sensitivity(folder: str | Path) -> Axes:
    """Show by how much a small change of each dimension changes the objective at the optimum, the most telling first.

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
    with house_style():
        figure = robust.sensitivity(data)
    return _drawn(figure, folder, "a dataset with an optimum and its sensitivities").axes[0]


def _drawn(figure: Figure | None, folder: str | Path, allowed: str) -> Figure:
    if figure is None:
        raise InputError("folder", str(folder), allowed, "plot")
    return figure
