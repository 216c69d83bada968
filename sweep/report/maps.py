"""Figures of the design space: best objective per cell, share of feasible designs, and the trade-off."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.families.base import Array
from sweep.quantities.limits import compared
from sweep.report.dataset import Dataset, marked
from sweep.report.figures import LIMIT, OPTIMUM, QUIET, REFERENCE, WIDTH, new_figure
from sweep.report.front import Front
from sweep.report.quantities import ShownQuantity
from sweep.report.scan import Cells, Grid, Scan, most_telling
from sweep.study import Study

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MARKS: dict[str, dict[str, Any]] = {
    "optimum": {"marker": "*", "s": 210, "color": "#14181f"},
    "reference": {"marker": "o", "s": 52, "color": REFERENCE},
    "best of the sweep": {"marker": "D", "s": 40, "color": "#2f8f5b"},
}


@dataclass(frozen=True)
class Overlay:
    """A known line in the plane of two axes, in stored units."""

    label: str
    x: Array
    y: Array


def map_figure(
    grid: Grid,
    x: tuple[Cells, ShownQuantity],
    y: tuple[Cells, ShownQuantity],
    designs: float,
    objective: ShownQuantity | None,
    marks: dict[str, tuple[float, float]],
    overlays: Sequence[Overlay],
) -> Figure:
    """Draw the best objective per cell and the share of feasible designs in the cell; ``marks`` are in stored units.

    Marks outside the searched space are left out.
    """
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import NullLocator

    figure = new_figure(WIDTH, 4.6, None)  # a constrained layout draws twice, a tenth of the report's time
    figure.subplots_adjust(left=0.08, right=0.98, bottom=0.2, top=0.98, wspace=0.08)
    panels = figure.subplots(1, 2 if objective is not None else 1, squeeze=False, sharex=True, sharey=True)[0]
    (x_cells, x_shown), (y_cells, y_shown) = x, y
    edges = x_cells.edges * x_shown.factor, y_cells.edges * y_shown.factor
    shares = grid.count / (designs * np.outer(y_cells.weights, x_cells.weights))
    fields = [(np.where(grid.count > 0, 100.0 * np.minimum(shares, 1.0), np.nan), "Blues", "feasible designs [%]")]
    if objective is not None:
        best = np.where(np.isfinite(grid.best), grid.best * objective.factor, np.nan)
        fields.insert(0, (best, "viridis_r", f"best {objective.label} in the cell"))
    for axes, (values, colours, label) in zip(panels, fields, strict=True):
        axes.set_facecolor("#eceef1")
        axes.grid(False)
        norm = _norm(values) if colours == "viridis_r" else _share_norm(values)
        mesh = axes.pcolormesh(*edges, values, cmap=colours, norm=norm, rasterized=True)
        bar = figure.colorbar(mesh, ax=axes, label=label, location="top", shrink=0.9, aspect=32, pad=0.04)
        if isinstance(norm, LogNorm):
            bar.set_ticks(_round_between(float(norm.vmin or 0.0), float(norm.vmax or 0.0)))
            bar.ax.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
            bar.ax.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel(x_shown.label)
        limits = axes.get_xlim(), axes.get_ylim()
        for overlay in overlays:
            axes.plot(overlay.x * x_shown.factor, overlay.y * y_shown.factor, color=LIMIT, label=overlay.label)
        inside = {
            role: (x, y)
            for role, (x, y) in marks.items()
            if _between(x * x_shown.factor, limits[0]) and _between(y * y_shown.factor, limits[1])
        }
        _place(axes, inside, x_shown.factor, y_shown.factor)
        axes.set_xlim(limits[0])
        axes.set_ylim(limits[1])
    panels[0].set_ylabel(y_shown.label)
    handles, labels = panels[0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="lower center", ncols=4)
    return figure


def line_figure(
    line: Grid, x: tuple[Cells, ShownQuantity], designs: float, objective: ShownQuantity | None, marks: dict[str, float]
) -> Figure:
    """Draw the same as :func:`map_figure` over the only axis that a study sweeps."""
    cells, shown = x
    figure = new_figure(WIDTH, 3.6)
    panels = figure.subplots(1, 2 if objective is not None else 1, squeeze=False)[0]
    edges = cells.edges * shown.factor
    if objective is not None:
        best = np.where(np.isfinite(line.best), line.best * objective.factor, np.nan)
        panels[0].stairs(best, edges, baseline=None, color=OPTIMUM)
        panels[0].set_ylabel(f"best {objective.label}")
        for role, at in marks.items():
            panels[0].axvline(at * shown.factor, color=MARKS[role]["color"], linestyle="--", label=role)
        if marks:
            panels[0].legend()
    panels[-1].stairs(
        100.0 * np.minimum(line.count / (designs * cells.weights), 1.0), edges, fill=True, color="#9fbfe3"
    )
    panels[-1].set_ylabel("feasible designs [%]")
    for axes in panels:
        axes.set_xlabel(shown.label)
    return figure


def trade_off(data: Dataset, scanned: Scan) -> Figure | None:
    """Draw feasible designs by objective and second criterion, with the non-dominated ones.

    The front of the optimiser is drawn if one was searched.
    """
    objective, against = data.objective, data.against
    if objective is None or against is None or not (len(scanned.scatter) or data.front is not None):
        return None
    second, front = data.shown(against), Front.of(data)
    figure = new_figure(WIDTH, 4.4, None)
    figure.subplots_adjust(left=0.08, right=0.98, bottom=0.2, top=0.97)
    axes = figure.subplots()
    scatter = scanned.scatter * (objective.factor, second.factor)
    best = scanned.front * (objective.factor, second.factor)
    if len(scatter):
        size = 3 if len(scatter) > 5000 else 9 if len(scatter) > 500 else 25
        style: dict[str, Any] = {"color": QUIET, "alpha": 0.35, "linewidths": 0, "rasterized": True}
        axes.scatter(scatter[:, 0], scatter[:, 1], s=size, label="feasible designs of the sweep", **style)
        axes.step(*best.T, where="post", color="#2f8f5b", linewidth=1.2, zorder=3)
        axes.scatter(
            best[:, 0],
            best[:, 1],
            s=14,
            color="#2f8f5b",
            zorder=3,
            label=f"of these, non-dominated ({len(best)})",
        )
    if front is not None:
        front.draw(axes)
    limit = next((limit.maximum for limit in data.study.limits if limit.output == second.name), None)
    if limit is not None:
        axes.axhline(
            limit * second.factor, color=LIMIT, linewidth=0.9, linestyle=":", label=f"limit of {second.symbol}"
        )
    both = {
        role: (compared(objective.name, float(row[objective.name])), compared(second.name, float(row[second.name])))
        for role, row in marked(data).items()
        if row is not None
    }
    _place(axes, both, objective.factor, second.factor)
    for axis, k in ((axes.set_xscale, 0), (axes.set_yscale, 1)):
        positive = scatter[:, k][scatter[:, k] > 0.0]
        if positive.size == len(scatter) and positive.size and positive.max() > 30.0 * positive.min():
            axis("log")
    axes.set_xlabel(objective.title)
    axes.set_ylabel(second.title)
    figure.legend(*axes.get_legend_handles_labels(), loc="lower center", ncols=4)
    return figure


def _between(value: float, ends: tuple[float, float]) -> bool:
    edge = 1e-9 * (ends[1] - ends[0])
    return ends[0] - edge <= value <= ends[1] + edge


def _place(axes: Axes, marks: dict[str, tuple[float, float]], x_factor: float, y_factor: float) -> None:
    for role, (x, y) in marks.items():
        if np.isfinite(x) and np.isfinite(y):
            axes.scatter(
                x * x_factor, y * y_factor, label=role, zorder=5, edgecolors="white", clip_on=False, **MARKS[role]
            )


def _norm(values: Array) -> object:
    """Return a logarithmic scale if the values span more than a decade, otherwise a linear one.

    A logarithmic scale keeps a few bad cells from hiding differences between good ones.
    """
    from matplotlib.colors import LogNorm, Normalize

    finite = values[np.isfinite(values)]
    if not finite.size:
        return Normalize(0.0, 1.0)
    low, high = float(finite.min()), float(finite.max())
    if low > 0.0 and high > 10.0 * low:
        return LogNorm(low, high)
    return Normalize(low, high if high > low else low + 1.0)


def _round_between(low: float, high: float) -> list[float]:
    """Return the values 1, 2, 5, 10, ... between two bounds, at most eight."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    ticks = [step * 10.0**k for k in decades for step in (1.0, 2.0, 5.0) if low <= step * 10.0**k <= high]
    return ticks[:: max(1, -(-len(ticks) // 8))]


def _share_norm(values: Array) -> object:
    from matplotlib.colors import Normalize

    return Normalize(0.0, float(np.nanmax(values)) if np.isfinite(values).any() else 100.0)


def design_map(data: Dataset, scanned: Scan, cells: list[Cells], pair: tuple[str, str] | None = None) -> Figure | None:
    """Draw the best objective of each cell over one or two axes, by default the pair with the largest variation."""
    by_name = {c.name: c for c in cells}
    marks = {role: row for role, row in marked(data).items() if row is not None}
    objective = data.objective
    if pair is None:
        if objective is None and scanned.feasible == data.designs:
            return None  # all of one colour
        pair = most_telling(scanned)
    if pair is not None:
        x, y = pair
        at = {role: (by_name[x].placed(float(row[x])), by_name[y].placed(float(row[y]))) for role, row in marks.items()}
        sides = (by_name[x], axis_quantity(data, x)), (by_name[y], axis_quantity(data, y))
        return map_figure(scanned.grids[pair], *sides, data.designs, objective, at, overlays(data.study, x, y))
    if len(cells) == 1 and scanned.feasible:
        name = cells[0].name
        side = cells[0], axis_quantity(data, name)
        return line_figure(
            scanned.lines[name], side, data.designs, objective, {r: float(row[name]) for r, row in marks.items()}
        )
    return None


def axis_quantity(data: Dataset, name: str) -> ShownQuantity:
    """Return the display form of a swept parameter under its own name."""
    shown = data.shown(name)
    return replace(shown, symbol=name, words=data.definitions.get(name, name))


def overlays(study: Study, x: str, y: str) -> list[Overlay]:
    """Return the known lines of ``[report] curves`` that lie in the plane of the map, in stored units."""
    factors = {axis.name: axis.factor for axis in study.space.axes}
    lines = []
    for curve in study.data.get("report", {}).get("curves", []):
        if {curve["x"], curve["y"]} == {x, y}:
            points = np.asarray(curve["points"], dtype=np.float64) * (factors[curve["x"]], factors[curve["y"]])
            along = points if curve["x"] == x else points[:, ::-1]
            lines.append(Overlay(curve["label"], along[:, 0], along[:, 1]))
    return lines
