"""The designs that can be looked at on the page: the result, other optima, designs of the front, the reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kernels import status as codes
from sweep.report.dataset import Dataset, Row
from sweep.report.groups import Group
from sweep.report.quantities import quantity

MOST = 5  # other optima, and as many designs of the front


@dataclass(frozen=True)
class Shown:
    """A design under a name; ``role`` is "result", "alternative", "front" or "reference", ``note`` its objective."""

    name: str
    role: str
    note: str
    row: Row


def shown_designs(data: Dataset, different: Sequence[Group]) -> list[Shown]:
    """Return designs in the order in which they are offered; empty where no design was found.

    ``different`` are the optima of :func:`sweep.report.groups.groups`, the study's answer first.
    """
    if data.result is None:
        return []
    found = [Shown(data.result_name, "result", _objective(data, data.result), data.result)]
    others = [one for one in different if one.row["role"] != "optimum"][:MOST]
    found += [Shown(one.title(k), "alternative", _objective(data, one.row), one.row) for k, one in enumerate(others, 1)]
    found += _of_front(data)
    if data.reference is not None:
        found.append(Shown("reference", "reference", _objective(data, data.reference), data.reference))
    return found


def _of_front(data: Dataset) -> list[Shown]:
    """Return designs of the front, spread evenly from the loosest bound to the tightest."""
    pareto = data.study.pareto
    if data.front is None or pareto is None:
        return []
    side = "at least" if pareto.at_least else "at most"
    shown = quantity(pareto.output, data.units.get(pareto.output, ""))
    rows = [_row(row) for row in data.front.to_dict("records") if int(row["status"]) == codes.OK]
    chosen = sorted({round(k) for k in np.linspace(0, len(rows) - 1, min(MOST, len(rows)))})
    names = [f"{shown.symbol} {side} {shown.show(float(rows[k]['bound']), 3)}" for k in chosen]
    return [Shown(name, "front", _objective(data, rows[k]), rows[k]) for name, k in zip(names, chosen, strict=True)]


def _row(row: Any) -> dict[str, Any]:
    return {str(key): value for key, value in row.items()}


def _objective(data: Dataset, row: Row) -> str:
    objective = data.study.objective
    if objective is None or objective.output not in row:
        return ""
    shown = quantity(objective.output, data.units.get(objective.output, ""))
    return f"{shown.symbol} = {shown.show(float(row[objective.output]), 4)}"
