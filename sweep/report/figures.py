"""Figures of the report: their style and saving, maps of the design space, the trade-off with the front."""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from sweep.families.base import Array
from sweep.pages import TEMPLATES
from sweep.quantities.limits import compared
from sweep.report.dataset import Dataset, marked
from sweep.report.front import Front, is_missed
from sweep.report.quantities import ShownQuantity
from sweep.report.scan import Cells, Grid, Scan, most_telling
from sweep.study import Study

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

OPTIMUM, REFERENCE, LIMIT, QUIET = "#1f5aa6", "#c8551b", "#b3261e", "#8a8f98"
WIDTH = 9.6  # inches, the full text width of the page
NARROW = 4.6  # inches; narrow enough to read bars and their names on a telephone
MARKS: dict[str, dict[str, Any]] = {
    "optimum": {"marker": "*", "s": 210, "color": "#14181f"},
    "reference": {"marker": "o", "s": 52, "color": REFERENCE},
    "best of the sweep": {"marker": "D", "s": 40, "color": "#2f8f5b"},
}


def house_style() -> AbstractContextManager[None]:
    """Draw in the report's style without changing the caller's settings."""
    from matplotlib import style

    return style.context(TEMPLATES / "report.mplstyle")


def new_figure(width: float, height: float, layout: Literal["constrained"] | None = "constrained") -> Figure:
    """Return an empty figure without a window system; without a layout the caller sets the margins."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout=layout)
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path: Path) -> Path:
    """Write an SVG that depends on nothing but its data, without date and random identifiers; return its path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    path.write_text(smaller(path.read_text("utf-8")), "utf-8")
    return path


def smaller(text: str) -> str:
    """Shorten an SVG: hundredths of a point, no indents, no empty groups, and each style once.

    Text is unchanged: only numbers within tags are rounded.
    """
    text = re.sub(r"<[^>]*>", lambda tag: re.sub(r"(\d\.\d\d)\d+", r"\1", tag[0]), re.sub(r"\n\s+", "\n", text))
    text = re.sub(r'<g id="[^"]*"/>\n| transform="rotate\(-0 [^"]*\)"', "", text)
    styles = {style: f"s{k}" for k, style in enumerate(dict.fromkeys(re.findall(r' style="([^"]*)"', text)))}
    text = re.sub(r' style="([^"]*)"', lambda m: f' class="{styles[m[1]]}"', text)
    rules = " ".join(f".{name} {{{style}}}" for style, name in styles.items())
    return re.sub(r"(<svg[^>]*>)", rf"\1\n<style>{rules}</style>", text, count=1)


def data_uri(path: Path) -> str:
    """Return a saved figure as a data URI for the page."""
    return f"data:image/svg+xml;base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"


def crank_axis(axes: Axes, label: str) -> None:
    """Label an axis with crank angles over one turn, ticked in quarters."""
    axes.set_xlim(0, 360)
    axes.set_xticks(range(0, 361, 90))
    axes.set_xlabel(label)


def map_figure(
    grid: Grid,
    x: tuple[Cells, ShownQuantity],
    y: tuple[Cells, ShownQuantity],
    designs: float,
    objective: ShownQuantity | None,
    marks: Mapping[str, Array],
    overlays: Sequence[tuple[str, Array]],
) -> Figure:
    """Draw the best objective per cell and the share of feasible designs in the cell.

    Marks (2,) and overlays (n, 2) are in stored units; marks outside the searched space are left out.
    """
    from matplotlib.colors import LogNorm, Normalize
    from matplotlib.ticker import LogLocator

    figure = new_figure(WIDTH, 4.6, None)  # a constrained layout draws twice, a tenth of the report's time
    figure.subplots_adjust(left=0.08, right=0.98, bottom=0.2, top=0.98, wspace=0.08)
    panels = figure.subplots(1, 2 if objective is not None else 1, squeeze=False, sharex=True, sharey=True)[0]
    (x_cells, x_shown), (y_cells, y_shown) = x, y
    factors = np.array([x_shown.factor, y_shown.factor])
    edges = x_cells.edges * x_shown.factor, y_cells.edges * y_shown.factor
    shares = grid.count / (designs * np.outer(y_cells.weights, x_cells.weights))
    share = np.where(grid.count > 0, 100.0 * np.minimum(shares, 1.0), np.nan)
    fields = [(share, "Blues", Normalize(0.0), "feasible designs [%]")]
    if objective is not None:
        best = np.where(np.isfinite(grid.best), grid.best * objective.factor, np.nan)
        # A few bad cells do not hide the differences between good ones: more than a decade has a logarithmic scale.
        low, high = np.nanmin(best), np.nanmax(best)
        norm = LogNorm() if 0.0 < 10.0 * low < high else Normalize()
        fields.insert(0, (best, "viridis_r", norm, f"best {objective.label} in the cell"))
    for axes, (values, colours, norm, label) in zip(panels, fields, strict=True):
        axes.set_facecolor("#eceef1")
        axes.grid(False)
        mesh = axes.pcolormesh(*edges, values, cmap=colours, norm=norm, rasterized=True)
        bar = figure.colorbar(mesh, ax=axes, label=label, location="top", shrink=0.9, aspect=32, pad=0.04)
        if isinstance(norm, LogNorm):
            bar.set_ticks(LogLocator(subs=(1.0, 3.0)))
            bar.ax.xaxis.set_major_formatter("{x:g}")
            bar.minorticks_off()
        axes.set_xlabel(x_shown.label)
        limits = axes.get_xlim(), axes.get_ylim()
        for name, points in overlays:
            axes.plot(*(points * factors).T, color=LIMIT, label=name)
        shown = {role: at * factors for role, at in marks.items()}
        _place(axes, {role: at for role, at in shown.items() if all(map(_between, at, limits))})
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
        draw_front(axes, front)
    limit = next((limit.maximum for limit in data.study.limits if limit.output == second.name), None)
    if limit is not None:
        axes.axhline(
            limit * second.factor, color=LIMIT, linewidth=0.9, linestyle=":", label=f"limit of {second.symbol}"
        )
    both = (objective, second)
    marks = {role: row for role, row in marked(data).items() if row is not None}
    _place(
        axes,
        {
            role: np.array([compared(q.name, float(row[q.name])) * q.factor for q in both])
            for role, row in marks.items()
        },
    )
    for axis, k in ((axes.set_xscale, 0), (axes.set_yscale, 1)):
        positive = scatter[:, k][scatter[:, k] > 0.0]
        if positive.size == len(scatter) and positive.size and positive.max() > 30.0 * positive.min():
            axis("log")
    axes.set_xlabel(objective.title)
    axes.set_ylabel(second.title)
    figure.legend(*axes.get_legend_handles_labels(), loc="lower center", ncols=4)
    return figure


def draw_front(axes: Axes, front: Front) -> None:
    """Draw the front as a curve through its designs, and the bounds without a design."""
    both, good = (front.objective, front.second), [p for p in front.points if not is_missed(p)]
    if good:
        x, y = (np.array([compared(q.name, float(p[q.name])) * q.factor for p in good]) for q in both)
        label = f"front ({len(good)})"
        axes.plot(x, y, color=OPTIMUM, linewidth=1.6, marker="o", markersize=5, zorder=4, label=label)
    missed = [float(p["bound"]) * front.second.factor for p in front.points if is_missed(p)]
    for k, bound in enumerate(missed):
        words = "bounds without a design" if k == 0 else None
        axes.axhline(bound, color=LIMIT, linewidth=0.8, linestyle=(0, (6, 4)), label=words)


def _between(value: float, ends: tuple[float, float]) -> bool:
    edge = 1e-9 * (ends[1] - ends[0])
    return ends[0] - edge <= value <= ends[1] + edge


def _place(axes: Axes, marks: Mapping[str, Array]) -> None:
    for role, at in marks.items():
        if np.isfinite(at).all():
            axes.scatter(*at, label=role, zorder=5, edgecolors="white", clip_on=False, **MARKS[role])


def design_map(data: Dataset, scanned: Scan, cells: list[Cells], pair: tuple[str, str] | None = None) -> Figure | None:
    """Draw the best objective of each cell over one or two axes, by default the pair with the largest variation.

    A study without feasible designs has no map, and by default neither has one of which all designs are equally good.
    """
    by_name = {c.name: c for c in cells}
    marks = {role: row for role, row in marked(data).items() if row is not None}
    objective = data.objective
    alike = pair is None and objective is None and scanned.feasible == data.designs
    if not scanned.feasible or alike:
        return None
    pair = pair or most_telling(scanned)
    if pair is not None:
        x, y = pair
        at = {role: np.array([by_name[name].placed(float(row[name])) for name in pair]) for role, row in marks.items()}
        sides = (by_name[x], axis_quantity(data, x)), (by_name[y], axis_quantity(data, y))
        return map_figure(scanned.grids[pair], *sides, data.designs, objective, at, overlays(data.study, x, y))
    if len(cells) == 1:
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


def overlays(study: Study, x: str, y: str) -> list[tuple[str, Array]]:
    """Return the known lines of ``[report] curves`` that lie in the plane of the map: label, points in stored units."""
    factors = {axis.name: axis.factor for axis in study.space.axes}
    lines = []
    for curve in study.data.get("report", {}).get("curves", []):
        if {curve["x"], curve["y"]} == {x, y}:
            points = np.asarray(curve["points"], dtype=np.float64) * (factors[curve["x"]], factors[curve["y"]])
            lines.append((curve["label"], points if curve["x"] == x else points[:, ::-1]))
    return lines
