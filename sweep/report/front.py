"""The front: the cost of each bound on the second output, as a table and sentences."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from kernels import status as codes
from sweep.errors import how_many
from sweep.optimise.front.pareto import SHOWN, gaps
from sweep.optimise.local.descent import KKT
from sweep.optimise.local.kkt import NO_VALUE
from sweep.quantities.limits import compared
from sweep.report.dataset import Dataset, records
from sweep.report.quantities import ShownQuantity, change, number
from sweep.study import ParetoSettings

EDGES = (" at its lower bound", " at its upper bound")


@dataclass(frozen=True)
class Front:
    """The front of a dataset: objective, second output, and a point for each bound, the loosest first."""

    data: Dataset
    objective: ShownQuantity
    second: ShownQuantity
    settings: ParetoSettings
    points: list[dict[str, Any]]

    @classmethod
    def of(cls, data: Dataset) -> Front | None:
        """Return the front of a dataset, or None if none was searched."""
        settings, objective = data.study.pareto, data.objective
        if settings is None or objective is None or data.front is None:
            return None
        return cls(data, objective, data.shown(settings.output), settings, records(data.front))

    @property
    def side(self) -> str:
        """Side of its bounds on which the second output lies, in words."""
        return "at least" if self.settings.at_least else "at most"

    def change(self, point: dict[str, Any]) -> str:
        """Return the change of the objective against the optimum."""
        name, optimum = self.objective.name, self.data.optimum
        best = math.nan if optimum is None else float(optimum[name])
        return change(self.objective, float(point[name]), best)

    def reached(self, point: dict[str, Any]) -> float:
        """Return the second output of a design, swing and stroke by magnitude."""
        return float(compared(self.second.name, float(point[self.second.name])))

    def held(self, point: dict[str, Any]) -> str:
        """Name the active limits of a design within a bound, or those that gave way where there is none."""
        if is_missed(point):
            return _given_way(self.data, str(point["relaxation"]))
        return _held(str(point["active"]), self.second.name)

    def sentence(self) -> str:
        """Return a sentence about the ends of the front, and about the bounds within which no design was found."""
        objective, second = self.objective, self.second
        points, missed = ([p for p in self.points if is_missed(p) == beyond] for beyond in (False, True))
        beyond = ""
        if missed:
            of = f"{len(missed)} of {how_many(len(self.points), 'bound')} on the {second.words}"
            loosest = f"{self.side} {second.show(float(missed[0]['bound']))}"
            beyond = f"No design was found within {of}, the loosest of them {loosest}."
        if len(points) < 2:
            return beyond
        loose, tight = (
            f"{objective.show(float(p[objective.name]))} with {self.side} {second.show(float(p['bound']))}"
            for p in (points[0], points[-1])
        )
        return f"The {objective.words} against the {second.words}: {loose}, {tight}. {beyond}".rstrip()

    def note(self) -> str:
        """Describe how much of the front was searched."""
        given, begun = len(set(self.settings.bounds)), len(self.points)
        wanted = (self.settings.points or given) if self.data.front_steps else given
        late = sum(p["ended"] == "time" and not p["kkt_residual"] <= KKT for p in self.points)
        text = "Every row is a search of its own, a local optimum where it has settled."
        text += f" {begun - given} of the bounds were placed where the front bends." if begun > given else ""
        text += f" Time was up before {wanted - begun} more bounds." if begun < wanted else ""
        text += self._gap()
        return text + (f" In {how_many(late, 'row')} time was up before the search had ended." if late else "")

    def _gap(self) -> str:
        """Name the largest gap of the front, if it is large enough to mention."""
        objective, second, points = self.objective.name, self.second, self.points
        reached = [float(p["bound"]) if is_missed(p) else self.reached(p) for p in points]
        values = [math.nan if is_missed(p) else float(p[objective]) for p in points]
        bounds = np.array([float(p["bound"]) for p in points])
        largest = gaps(bounds, np.array(reached), np.array(values))
        if not largest or largest[0].area < SHOWN:
            return ""
        k = largest[0].number
        ends = f"{second.show(reached[k], 4)} and {second.show(float(bounds[k + 1]), 4)}"
        count = self.settings.points or len(points)
        return f" It is least known between {ends}: pareto.points, now {count}, places further bounds there."


def is_missed(point: dict[str, Any]) -> bool:
    """Tell whether no design was found within a bound."""
    return int(point["status"]) == codes.LIMIT_EXCEEDED


def search_state(point: dict[str, Any]) -> str:
    """Tell whether the search within a bound has settled."""
    residual = float(point["kkt_residual"])
    if residual <= KKT:
        return "settled"
    return f"{'time was up' if point['ended'] == 'time' else 'not settled'}, residual {number(residual, 2)}"


def _given_way(data: Dataset, relaxation: str) -> str:
    """Describe the relaxation of each violated limit, in the units of the table."""
    words = []
    for part in filter(None, relaxation.split("; ")):
        name, _, size = part.partition(" ")
        shown = data.shown(name)
        words.append(f"{shown.words} {size if size == NO_VALUE else f'by {shown.show(abs(float(size[3:])), 3)}'}")
    return "; ".join(words)


def _held(active: str, second: str) -> str:
    """Return active limits by name, and the number of dimensions on the edge of the searched space."""
    words = [word.strip() for word in active.split(";") if word.strip()]
    edges = [word for word in words if word.endswith(EDGES)]
    limits = ["this bound" if word.split()[0] == second else word for word in words if word not in edges]
    if edges:
        limits.append(f"{how_many(len(edges), 'dimension')} on the edge of the space")
    return "; ".join(limits)
