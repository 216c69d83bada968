"""The front: what each bound on the second output costs, as a table, in a sentence and as a curve."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from kernels import status as codes
from sweep.optimise.front.pareto import SHOWN, gaps
from sweep.optimise.local.descent import KKT
from sweep.quantities.limits import compared
from sweep.report.dataset import Dataset, records
from sweep.report.figures import LIMIT, OPTIMUM
from sweep.report.quantities import Quantity, change, number

if TYPE_CHECKING:
    from matplotlib.axes import Axes

EDGES = (" at its lower bound", " at its upper bound")


@dataclass(frozen=True)
class FrontRow:
    """One bound: the least objective within it, against the optimum, and what else holds it back."""

    bound: str
    value: str
    fast: str
    change: str
    second: str
    state: str
    held: str


def front_rows(data: Dataset) -> list[FrontRow]:
    """Front, the loosest bound first; empty where the study asks for none."""
    objective, second = _quantities(data)
    if objective is None or second is None or data.study.pareto is None:
        return []
    side = "at least" if data.study.pareto.at_least else "at most"
    best = math.nan if data.optimum is None else float(data.optimum[objective.name])
    rows = []
    for point in _points(data):
        value, missed = float(point[objective.name]), int(point["status"]) == codes.LIMIT_EXCEEDED
        rows.append(
            FrontRow(
                bound=f"{side} {second.show(float(point['bound']))}",
                value="–" if missed else objective.show(value),
                fast="" if missed else objective.at_speed(value, data.study.speed),
                change="" if missed else change(objective, value, best),
                second="–" if missed else second.show(compared(second.name, float(point[second.name]))),
                state="no design found" if missed else _state(point),
                held=_given_way(data, str(point["relaxation"])) if missed else _held(str(point["active"]), second.name),
            )
        )
    return rows


def front_names(data: Dataset) -> tuple[str, str]:
    """Symbols of the objective and the second output."""
    objective, second = _quantities(data)
    return (objective.symbol, second.symbol) if objective is not None and second is not None else ("", "")


def front_sentence(data: Dataset) -> str:
    """Return what the ends of the front say; nothing where there are none."""
    objective, second = _quantities(data)
    points = [point for point in _points(data) if int(point["status"]) != codes.LIMIT_EXCEEDED]
    if objective is None or second is None or data.study.pareto is None or len(points) < 2:
        return ""
    side = "at least" if data.study.pareto.at_least else "at most"
    loose, tight = (
        f"{objective.show(float(p[objective.name]))} with {side} {second.show(float(p['bound']))}"
        for p in (points[0], points[-1])
    )
    return f"The {objective.words} against the {second.words}: {loose}, {tight}."


def front_note(data: Dataset) -> str:
    """How much of the front was searched."""
    if data.study.pareto is None or data.front is None:
        return ""
    given, begun = len(set(data.study.pareto.bounds)), len(data.front)
    wanted = (data.study.pareto.points or given) if data.front_steps else given
    late = int(((data.front["ended"] == "time") & ~(data.front["kkt_residual"] <= KKT)).sum())
    text = "Every row is a search of its own, a local optimum if its residual is small."
    text += f" {begun - given} of the bounds were placed where the front bends." if begun > given else ""
    text += f" Time was up before {wanted - begun} more bounds." if begun < wanted else ""
    text += _gap(data)
    return text + (f" In {late} row{'s' if late > 1 else ''} time was up before the search had ended." if late else "")


def _gap(data: Dataset) -> str:
    """Say where the front is least known, if that is worth a word."""
    objective, second = _quantities(data)
    points = _points(data)
    if objective is None or second is None or data.study.pareto is None:
        return ""
    missed = [int(point["status"]) == codes.LIMIT_EXCEEDED for point in points]
    reached = [
        float(p["bound"]) if m else compared(second.name, float(p[second.name]))
        for p, m in zip(points, missed, strict=True)
    ]
    values = [math.nan if m else float(p[objective.name]) for p, m in zip(points, missed, strict=True)]
    bounds = np.array([float(point["bound"]) for point in points])
    found = gaps(bounds, np.array(reached), np.array(values))
    if not found or found[0].area < SHOWN:
        return ""
    ends = f"{second.show(reached[found[0].number], 4)} and {second.show(float(bounds[found[0].number + 1]), 4)}"
    count = data.study.pareto.points or len(points)
    return f" It is least known between {ends}: pareto.points, now {count}, places further bounds there."


def draw_front(axes: Axes, data: Dataset) -> None:
    """Draw the front as a curve through its designs, and the bounds within which none was found."""
    objective, second = _quantities(data)
    if objective is None or second is None:
        return
    points = _points(data)
    good = [p for p in points if int(p["status"]) != codes.LIMIT_EXCEEDED]
    if good:
        x, y = (np.array([compared(q.name, float(p[q.name])) * q.factor for p in good]) for q in (objective, second))
        axes.plot(x, y, color=OPTIMUM, linewidth=1.6, marker="o", markersize=5, zorder=4, label=f"front ({len(good)})")
    missed = [float(p["bound"]) * second.factor for p in points if p not in good]
    for k, bound in enumerate(missed):
        label = "bounds without a design" if k == 0 else None
        axes.axhline(bound, color=LIMIT, linewidth=0.8, linestyle=(0, (6, 4)), label=label)


def _quantities(data: Dataset) -> tuple[Quantity | None, Quantity | None]:
    if data.study.pareto is None or data.front is None:
        return None, None
    return data.objective, data.shown(data.study.pareto.output)


def _points(data: Dataset) -> list[dict[str, Any]]:
    return [] if data.front is None else records(data.front)


def _state(point: dict[str, Any]) -> str:
    residual = float(point["kkt_residual"])
    if residual <= KKT:
        return "settled"
    return f"{'time was up' if point['ended'] == 'time' else 'not settled'}, residual {number(residual, 2)}"


def _given_way(data: Dataset, relaxation: str) -> str:
    """Say by how much limits would have to give way, in the units of the table."""
    words = []
    for part in filter(None, relaxation.split("; ")):
        name, _, size = part.rpartition(" by ")
        shown = data.shown(name)
        words.append(f"{shown.words} by {shown.show(abs(float(size)), 3)}")
    return "; ".join(words)


def _held(active: str, second: str) -> str:
    """Return limits by name, and how many dimensions lie on the edge of what was searched."""
    words = [word.strip() for word in active.split(";") if word.strip()]
    edges = [word for word in words if word.endswith(EDGES)]
    limits = ["this bound" if word.split()[0] == second else word for word in words if word not in edges]
    if edges:
        limits.append(f"{len(edges)} dimension{'s' if len(edges) > 1 else ''} on the edge of the space")
    return "; ".join(limits)
