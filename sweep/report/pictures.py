"""The pictures of a dataset: what of it goes into each of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from sweep.chunks.cascade import compared
from sweep.dataset import store
from sweep.quantities.names import is_flag
from sweep.report import front
from sweep.report.curves import motion_figure
from sweep.report.dataset import Dataset
from sweep.report.made_figures import slopes_figure, spread_figure
from sweep.report.maps import Overlay, line_figure, map_figure, trade_off_figure
from sweep.report.mechanisms import POSITIONS, mechanism_figure
from sweep.report.quantities import Quantity, quantity
from sweep.report.robust import optimum_rows, slopes, tolerance_words
from sweep.report.scan import Cells, Scan, most_telling
from sweep.report.turns import parts_over_turn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sweep.evaluation.joints import Part
    from sweep.study import Study


def objective_of(study: Study) -> str | None:
    """Return the output that is to be small, if the study names one."""
    return None if study.objective is None else study.objective.output


def shown_objective(data: Dataset) -> Quantity | None:
    """Return the objective as it is shown."""
    name = objective_of(data.study)
    return None if name is None else quantity(name, data.units.get(name, ""))


def design_map(data: Dataset, found: Scan, cells: list[Cells], pair: tuple[str, str] | None = None) -> Figure | None:
    """Show what the best design of each cell attains over two axes, the most telling pair if none is given,
    or over one.
    """
    by_name = {c.name: c for c in cells}
    marks = {role: row for role, row in marked(data).items() if row is not None}
    shown = shown_objective(data)
    pair = most_telling(found) if pair is None else pair
    if pair is not None:
        x, y = pair
        at = {role: (by_name[x].placed(float(row[x])), by_name[y].placed(float(row[y]))) for role, row in marks.items()}
        sides = (by_name[x], axis_quantity(data, x)), (by_name[y], axis_quantity(data, y))
        return map_figure(found.grids[pair], *sides, data.designs, shown, at, overlays(data.study, x, y))
    if len(cells) == 1 and found.feasible:
        name = cells[0].name
        side = cells[0], axis_quantity(data, name)
        return line_figure(
            found.lines[name], side, data.designs, shown, {r: float(row[name]) for r, row in marks.items()}
        )
    return None


def trade_off(data: Dataset, found: Scan) -> Figure | None:
    """Draw the objective against a second criterion, with the front where one was searched."""
    study, shown = data.study, shown_objective(data)
    against = data.against
    if shown is None or against is None or not (len(found.scatter) or data.front is not None):
        return None
    second = quantity(against, data.units.get(against, ""))
    first, other = shown.name, second.name
    marks = {role: row for role, row in marked(data).items() if row is not None}
    at = {role: (compared(first, float(r[first])), compared(other, float(r[other]))) for role, r in marks.items()}
    bound = next((limit.maximum for limit in study.limits if limit.output == second.name), None)
    drawn = None if data.front is None else partial(front.draw_front, data=data)
    return trade_off_figure(found, shown, second, at, bound, drawn)


def motion(data: Dataset) -> Figure | None:
    """Return the curves over one turn."""
    if data.curves is None or not len(data.curves):
        return None
    study = data.study
    return motion_figure(data.curves, data.units, study.family.position, study.speed, study.limits, study.window)


def mechanism(parts: Mapping[str, Sequence[Part]]) -> Figure | None:
    """Return the designs of :func:`drawn_parts` in several positions, the result above or beside the reference."""
    return mechanism_figure(parts, "mm", positions=POSITIONS) if parts else None


def drawn_parts(data: Dataset) -> dict[str, list[Part]]:
    """Return the result and reference with their joints over a turn;
    empty where the study wants none, or they have none.
    """
    if data.study.output.curves == "none":
        return {}
    rows = {role: row for role, row in marked(data).items() if row is not None}
    return parts_over_turn(data.study, rows)


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


def marked(data: Dataset) -> dict[str, Any]:
    """Return the designs that are marked in the pictures of the design space."""
    return {data.result_name: data.result, "reference": data.reference}


def axis_quantity(data: Dataset, name: str) -> Quantity:
    """Return a swept parameter under its own name, in the unit a designer reads."""
    shown = quantity(name, data.units.get(name, ""))
    return replace(shown, symbol=name, words=data.definitions.get(name, name))


def overlays(study: Study, x: str, y: str) -> list[Overlay]:
    """Return known lines, ``[report] curves`` of the study, that lie in the plane of the map;
    points in the axes' units.
    """
    import numpy as np

    factors = {axis.name: axis.factor for axis in study.space.axes}
    found = []
    for curve in study.data.get("report", {}).get("curves", []):
        if {curve["x"], curve["y"]} == {x, y}:
            points = np.asarray(curve["points"], dtype=np.float64) * (factors[curve["x"]], factors[curve["y"]])
            along = points if curve["x"] == x else points[:, ::-1]
            found.append(Overlay(curve["label"], along[:, 0], along[:, 1]))
    return found
