"""Two small tables: what manufacturing tolerances do to the result, and which dimension changes the objective most."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sweep.dataset import store
from sweep.quantities.names import is_flag, without_minus
from sweep.report.quantities import number, quantity

if TYPE_CHECKING:
    from sweep.report.dataset import Dataset


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
    """Return the distribution of the outputs of the optimum; empty where the study names no tolerances."""
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
    """Return the tolerances as they are meant."""
    tolerance = data.study.tolerance
    if tolerance is None:
        return ""
    parts = [f"lengths ±{number(tolerance.lengths)}\u00a0mm"] if tolerance.lengths else []
    parts += [f"angles ±{number(math.degrees(tolerance.angles))}°"] if tolerance.angles else []
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
    """Return dimensions by how much they change the objective, the most telling first."""
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
    """Return rows of the optimum in a table beside the dataset; none where there is no such table."""
    path = store.beside(data.folder) / file
    if not path.exists():
        return []
    frame = store.read_table(path)
    return [{str(k): v for k, v in row.items()} for row in frame[frame["role"] == "optimum"].to_dict("records")]
