"""The structurally different optima of a search: starts that ended alike, or in each other's mirror image, are one.

A designer chooses: the best on paper may be the one that nobody wants to build.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from kernels import status as codes
from sweep.chunks.cascade import compared
from sweep.report.dataset import Dataset

if TYPE_CHECKING:
    from sweep.families.base import Array

ALIKE = 0.1  # of the mechanism's size, or of half a turn: what lies nearer is the same design in other numbers
SAME = 1e-6  # relative difference of objectives that are one


@dataclass(frozen=True)
class Group:
    """Starts that ended in the same design or its mirror image: the row that stands for them, and how many they are."""

    row: dict[str, Any]
    starts: int
    mirrored: int = 0

    def title(self, k: int) -> str:
        """Return what the group is called as the ``k``-th of the list."""
        if self.row["role"] == "nominal":
            return "best on paper"
        return "optimum" if self.row["role"] == "optimum" else f"another optimum, {k}"


def groups(data: Dataset) -> list[Group]:
    """Return the different optima, the study's answer first, then by their objective; empty without a search."""
    objective = data.study.objective
    if data.optima is None or objective is None:
        return []
    kept = data.optima[(data.optima["role"] != "reference") & (data.optima["status"] == codes.OK)]
    rows = [{str(key): value for key, value in row.items()} for row in kept.to_dict("records")]
    rows.sort(key=lambda row: (row["role"] != "optimum", float(compared(objective.output, row[objective.output]))))
    places = _places(data, rows)
    values = [float(row[objective.output]) for row in rows]
    leaders: list[int] = []
    count, mirrored = dict.fromkeys(range(len(rows)), 0), dict.fromkeys(range(len(rows)), 0)
    for k, row in enumerate(rows):
        near = next((j for j in leaders if _apart(places, j, k) <= ALIKE), None)
        twin = next((j for j in leaders if near is None and _mirrored(places, values, j, k)), None)
        own = near if near is not None else twin
        if own is None:
            leaders.append(k)
        started = row["role"] != "nominal"
        count[k if own is None else own] += started
        if twin is not None:
            mirrored[twin] += started
    return [Group(rows[k], count[k], mirrored[k]) for k in leaders]


def _places(data: Dataset, rows: list[dict[str, Any]]) -> tuple[Array, Array, Array]:
    """Return lengths and ratios over the largest of them, angles over half a turn, signs; (k, number of each)."""
    own = [p for p in data.study.bare.parameters if p.name in data.study.family.parameter_names]
    of = {unit: [p.name for p in own if p.unit == unit and p.choices is None] for unit in ("length", "ratio", "angle")}
    signs = [p.name for p in own if p.choices is not None]

    def matrix(names: list[str]) -> Array:
        return np.array([[float(row[name]) for name in names] for row in rows]).reshape(len(rows), len(names))

    sized = [x / np.maximum(np.abs(x).max(axis=1, initial=1e-300, keepdims=True), 1e-300)
             for x in (matrix(of["length"]), matrix(of["ratio"]))]  # fmt: skip
    return np.hstack(sized), matrix(of["angle"]), matrix(signs)


def _apart(places: tuple[Array, Array, Array], j: int, k: int) -> float:
    sized, angles, signs = places
    turned = np.abs(np.mod(angles[j] - angles[k] + np.pi, 2.0 * np.pi) - np.pi) / np.pi
    parts = (np.abs(sized[j] - sized[k]), turned, np.abs(signs[j] - signs[k]))
    return float(np.concatenate(parts).max(initial=0.0))


def _mirrored(places: tuple[Array, Array, Array], values: list[float], j: int, k: int) -> bool:
    """Return whether two designs have the same lengths but for signs, and the same objective:
    one is the other in a mirror.
    """
    sized = np.abs(places[0])
    same = abs(values[j] - values[k]) <= SAME * max(abs(values[j]), 1e-300)
    return same and float(np.abs(sized[j] - sized[k]).max(initial=0.0)) <= 1e-3 * ALIKE
