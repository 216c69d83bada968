"""What tolerances do to the result and which dimension changes the objective most: two tables, and pictures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.dataset import store
from sweep.families.names import is_flag, without_minus
from sweep.report.dataset import shown_objective
from sweep.report.figures import NARROW, OPTIMUM, QUIET, REFERENCE, new_figure
from sweep.report.quantities import number, quantity

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sweep.report.dataset import Dataset
    from sweep.report.quantities import Quantity


STEPS = {"length": (0.1, "0.1\u00a0mm"), "angle": (math.radians(0.1), "0.1°")}


@dataclass(frozen=True)
class ToleranceRow:
    """One output of the optimum as it is made; ``within`` is the share that keeps the limit."""

    name: str
    symbol: str
    nominal: str
    mean: str
    band: str
    within: str


@dataclass(frozen=True)
class SlopeRow:
    """One dimension: change of the objective in percent where it grows, and where it shrinks, by ``step``."""

    name: str
    text: str
    step: str
    growing: str
    shrinking: str


def tolerance_rows(data: Dataset) -> list[ToleranceRow]:
    """Distribution of the outputs of the optimum; empty where the study names no tolerances."""
    rows = []
    for row in optimum_rows(data, store.TOLERANCE):
        name = str(row["output"])
        within = "" if math.isnan(row["within"]) else f"{number(100.0 * row['within'], 3)}\u00a0%"
        if name == "all limits":
            known = float((data.optimum or {}).get("yield", math.nan))  # of more mechanisms, where it is known
            within = f"{number(100.0 * known, 3)}\u00a0%" if math.isfinite(known) else within
            rows.append(ToleranceRow("", "all limits", "", "", "", within))
        elif not is_flag(name):
            shown = quantity(name, data.units.get(name, ""))
            band = f"{number(row['low'] * shown.factor)} to {shown.show(row['high'])}"
            rows.append(
                ToleranceRow(name, shown.symbol, shown.show(row["nominal"]), shown.show(row["mean"]), band, within)
            )
    return rows


def tolerance_words(data: Dataset) -> str:
    """Tolerances as they are meant."""
    tolerance = data.study.tolerance
    if tolerance is None:
        return ""
    parts = [f"lengths ±{number(tolerance.lengths)}\u00a0mm"] if tolerance.lengths else []
    parts += [f"angles ±{number(math.degrees(tolerance.angles))}°"] if tolerance.angles else []
    parts += ["tolerances of their own of some dimensions"] if tolerance.own else []
    return " and ".join(parts)


@dataclass(frozen=True)
class Slope:
    """Change of the objective in percent where a dimension grows, and where it shrinks, by ``step`` (in words)."""

    name: str
    step: str
    growing: float
    shrinking: float

    @property
    def largest(self) -> float:
        """The larger of both changes, by magnitude."""
        return max(abs(self.growing), abs(self.shrinking))


def slope_rows(data: Dataset) -> list[SlopeRow]:
    """Dimensions by how much they change the objective, the most telling first."""
    texts = {p.name: p.text for p in data.study.family.parameters}
    return [
        SlopeRow(s.name, texts.get(s.name, ""), s.step, _percent(s.growing), _percent(s.shrinking))
        for s in slopes(data)
    ]


def slopes(data: Dataset) -> list[Slope]:
    """Return the numbers of :func:`slope_rows`."""
    if data.study.objective is None:
        return []
    units = {p.name: p.unit for p in data.study.family.parameters}
    own = [row for row in optimum_rows(data, store.SENSITIVITY) if row["output"] == data.study.objective.output]
    ranked = []
    for row in own:
        name, value = str(row["parameter"]), abs(float(row["value"]))
        step, step_words = STEPS.get(units.get(name, ""), (0.1, "0.1"))
        if not value > 0.0 or math.isnan(row["growing"]):
            continue
        share = 100.0 * step / value
        share = -share if without_minus(data.study.objective.output) else share  # shown as what is made large
        up, down = (share * x for x in (row["growing"], -row["shrinking"]))
        ranked.append(Slope(name, step_words, up, down))
    return sorted(ranked, key=lambda slope: -slope.largest)


def _percent(value: float) -> str:
    # What is below a billionth is the rounding of the gradients.
    return "0" if abs(value) < 1e-9 else f"{'+' if value > 0.0 else ''}{number(value, 3)}\u00a0%"


def optimum_rows(data: Dataset, file: str) -> list[dict[str, Any]]:
    """Rows of the optimum in a table beside the dataset; none where there is no such table."""
    path = store.beside(data.folder) / file
    if not path.exists():
        return []
    frame = store.read_table(path)
    return [{str(k): v for k, v in row.items()} for row in frame[frame["role"] == "optimum"].to_dict("records")]


def spread_figure(rows: Sequence[tuple[Quantity, float, float, float]], title: str) -> Figure:
    """Return the outputs with low end, mean and high end of what is made, in percent of the nominal value."""
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
    """Two bars for each dimension: made larger, made smaller; the most telling first."""
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


def tolerance(data: Dataset) -> Figure | None:
    """Spread of the optimum's outputs as it is made."""
    rows = [
        row
        for row in optimum_rows(data, store.TOLERANCE)
        if not math.isnan(row["nominal"]) and row["nominal"] != 0.0 and not is_flag(str(row["output"]))
    ]
    if not rows:
        return None
    spread = [
        (
            quantity(str(row["output"]), data.units.get(str(row["output"]), "")),
            *(100.0 * (row[key] / row["nominal"] - 1.0) for key in ("low", "mean", "high")),
        )
        for row in rows
    ]
    return spread_figure(spread, tolerance_words(data))


SEEN = 0.005  # of the longest bar: shorter ones are no wider than a line


def sensitivity(data: Dataset) -> Figure | None:
    """Draw by how much each dimension changes the objective; what changes it next to nothing is left out."""
    ranked, objective = slopes(data), shown_objective(data)
    ranked = [slope for slope in ranked if slope.largest > SEEN * ranked[0].largest]
    return slopes_figure(ranked, objective) if ranked and objective is not None else None
