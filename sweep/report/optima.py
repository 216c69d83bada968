"""Structurally different optima of a search, their cards, and the designs that the page can show.

Starts that ended in the same design or its mirror image form one group.  The designer chooses, since the best design by
numbers may be one that nobody wants to build.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kernels import status as codes
from sweep.exchange.scene import extent
from sweep.families.base import Array
from sweep.optimise.local.kkt import AGREE
from sweep.quantities.dimensions import sizes
from sweep.quantities.limits import compared
from sweep.report.dataset import Dataset, Row, records
from sweep.report.made import design_of, sampler
from sweep.report.quantities import change, number, quantity
from sweep.report.sketch import drawn_parts, sketch
from sweep.report.tables import parameter_rows

ALIKE = 0.1  # share of the mechanism's size, or of half a turn, below which designs count as the same
SAME = 1e-6  # relative difference below which objectives are equal


@dataclass(frozen=True)
class DistinctOptimum:
    """Starts that ended in the same design or its mirror image: representative row, and number of starts."""

    row: dict[str, Any]
    starts: int
    mirrored: int = 0

    def title(self, k: int) -> str:
        """Return the title of the group as the ``k``-th of the list."""
        if self.row["role"] == "nominal":
            return "best on paper"
        return "optimum" if self.row["role"] == "optimum" else f"another optimum, {k}"


def groups(data: Dataset) -> list[DistinctOptimum]:
    """Return the different optima: the answer, the best nominal one, the others by objective; none without a search."""
    if data.optima is None or data.objective is None:
        return []
    feasible = data.optima[(data.optima["role"] != "reference") & (data.optima["status"] == codes.OK)]
    rows, name, order = records(feasible), data.objective.name, {"optimum": 0, "nominal": 1}
    rows.sort(key=lambda row: (order.get(row["role"], 2), float(compared(name, row[name]))))
    places = _places(data, rows)
    values = [float(row[name]) for row in rows]
    leaders: list[int] = []
    count, mirrored = dict.fromkeys(range(len(rows)), 0), dict.fromkeys(range(len(rows)), 0)
    for k, row in enumerate(rows):
        near = next((j for j in leaders if _apart(places, j, k) <= ALIKE), None)
        twin = next((j for j in leaders if near is None and _mirrored(places, values, j, k)), None)
        leader = near if near is not None else twin
        if leader is None:
            leaders.append(k)
        started = row["role"] != "nominal"
        count[k if leader is None else leader] += started
        if twin is not None:
            mirrored[twin] += started
    return [DistinctOptimum(rows[k], count[k], mirrored[k]) for k in leaders]


def _places(data: Dataset, rows: list[dict[str, Any]]) -> tuple[Array, Array, Array]:
    """Return lengths and ratios over the largest of them, angles, and signs, (k, number of each)."""
    parameters = [p for p in data.study.bare.parameters if p.name in data.study.family.parameter_names]
    free = [p for p in parameters if p.choices is None]
    names_of = {unit: [p.name for p in free if p.unit == unit] for unit in ("length", "ratio", "angle")}
    signs = [p.name for p in parameters if p.choices is not None]

    def matrix(names: list[str]) -> Array:
        return np.array([[float(row[name]) for name in names] for row in rows]).reshape(len(rows), len(names))

    sized = [x / np.maximum(np.abs(x).max(axis=1, initial=1e-300, keepdims=True), 1e-300)
             for x in (matrix(names_of["length"]), matrix(names_of["ratio"]))]  # fmt: skip
    return np.hstack(sized), matrix(names_of["angle"]), matrix(signs)


def _apart(places: tuple[Array, Array, Array], j: int, k: int) -> float:
    sized, angles, signs = places
    turned = np.abs(np.mod(angles[j] - angles[k] + np.pi, 2.0 * np.pi) - np.pi) / np.pi
    parts = (np.abs(sized[j] - sized[k]), turned, np.abs(signs[j] - signs[k]))
    return float(np.concatenate(parts).max(initial=0.0))


def _mirrored(places: tuple[Array, Array, Array], values: list[float], j: int, k: int) -> bool:
    """Tell whether two designs have the same lengths except for signs, and the same objective, as mirror images do."""
    sized = np.abs(places[0])
    same = abs(values[j] - values[k]) <= SAME * max(abs(values[j]), 1e-300)
    return same and float(np.abs(sized[j] - sized[k]).max(initial=0.0)) <= 1e-3 * ALIKE


OFFERED = 5  # largest number of further optima, and of designs of the front


@dataclass(frozen=True)
class Shown:
    """A design with a name; ``role`` is "result", "alternative", "front" or "reference", ``note`` its objective."""

    name: str
    role: str
    note: str
    row: Row


def shown_designs(data: Dataset, different: Sequence[DistinctOptimum]) -> list[Shown]:
    """Return the designs in the order in which the page lists them; empty if no design was found.

    ``different`` are the optima of :func:`groups`, the study's answer first.
    """
    if data.result is None:
        return []
    designs = [Shown(data.result_name, "result", _objective(data, data.result), data.result)]
    others = [one for one in different if one.row["role"] != "optimum"][:OFFERED]
    designs += [
        Shown(one.title(k), "alternative", _objective(data, one.row), one.row) for k, one in enumerate(others, 1)
    ]
    designs += _of_front(data)
    if data.reference is not None:
        designs.append(Shown("reference", "reference", _objective(data, data.reference), data.reference))
    return designs


def _of_front(data: Dataset) -> list[Shown]:
    """Return designs of the front, spaced evenly from the loosest bound to the tightest."""
    pareto = data.study.pareto
    if data.front is None or pareto is None:
        return []
    side = "at least" if pareto.at_least else "at most"
    shown = data.shown(pareto.output)
    rows = records(data.front[data.front["status"] == codes.OK])
    numbers = sorted({round(k) for k in np.linspace(0, len(rows) - 1, min(OFFERED, len(rows)))})
    names = [f"{shown.symbol} {side} {shown.show(float(rows[k]['bound']), 3)}" for k in numbers]
    return [Shown(name, "front", _objective(data, rows[k]), rows[k]) for name, k in zip(names, numbers, strict=True)]


def _objective(data: Dataset, row: Row) -> str:
    shown = data.objective
    return f"{shown.symbol} = {shown.show(float(row[shown.name]), 4)}" if shown and shown.name in row else ""


CARDS = 6  # largest number of cards
SAMPLES = 2048  # mechanisms sampled per optimum: a share accurate to 1 %
EXTRAS = ("least_link", "arm_ratio")


@dataclass(frozen=True)
class Card:
    """One optimum as the report shows it, in words.

    ``made`` is the yield of its manufactured mechanisms; empty without tolerances.  ``sizes`` are the dimensions as
    name and value, ``extras`` outputs of the dimensions.
    """

    title: str
    group: DistinctOptimum
    objective: str
    against: str
    made: str
    sizes: list[tuple[str, str]]
    extras: list[tuple[str, str]]
    picture: str | None


def optima(data: Dataset, distinct: list[DistinctOptimum]) -> list[Card]:
    """Return the cards of the first optima, with pictures to one scale; empty if there is only one."""
    objective, names = data.objective, data.study.bare.parameter_names
    tilts = {name for name in names if name.endswith("_tilt")}  # tilts of nominal designs are zero
    if len(distinct) < 2 or objective is None:
        return []
    distinct = distinct[:CARDS]
    drawn = [drawn_parts(data.study.family, group.row) for group in distinct]
    span = max((extent(placed) for placed in drawn if placed), default=0.0)
    best = float(distinct[0].row[objective.name])
    cards = []
    for k, (group, placed) in enumerate(zip(distinct, drawn, strict=True)):
        value = float(group.row[objective.name])
        shown = [x for x in parameter_rows(data, group.row, 4) if x.name in names]
        title = group.title(k)
        cards.append(
            Card(
                title=title,
                group=group,
                objective=f"{objective.words} {objective.show(value)}",
                against="" if k == 0 else change(objective, value, best),
                made=_made(data, group.row),
                sizes=[(x.name, x.value) for x in shown if group.row[x.name] or x.name not in tilts],
                extras=_extras(data, group.row),
                picture=sketch(placed, f"{title}: positions over one turn", names=False, span=span) if placed else None,
            )
        )
    return cards


def optima_sentence(data: Dataset, distinct: list[DistinctOptimum]) -> str:
    """Return a sentence about the number of different optima, for the answer."""
    objective = data.objective
    if len(distinct) < 2 or objective is None:
        return ""
    value, best = (float(group.row[objective.name]) for group in (distinct[1], distinct[0]))
    difference = change(objective, value, best)
    same = sum(abs(float(group.row[objective.name]) - best) <= AGREE * abs(best) for group in distinct)
    text = f"The search ended in {len(distinct)} structurally different optima"
    text += f", {same} of them with the best value" if same > 1 else ""
    row = distinct[1].row
    paper = row.get("role") == "nominal" or data.study.wanted_yield is not None
    nth = "best on paper" if row.get("role") == "nominal" else "next on paper" if paper else "next"
    text += f"; the {nth} has {objective.show(value)}"
    text += f" ({difference})" if difference else ""
    share = _made(data, row) if paper else ""
    return f"{text}, but {share}." if share else f"{text}."


def _made(data: Dataset, row: dict[str, Any]) -> str:
    """Describe the share of toleranced mechanisms that keep all limits."""
    study, share = data.study, float(row.get("yield", math.nan))
    limits = [limit for limit in study.output_limits if not limit.is_equation]
    if not limits:
        return ""
    if not math.isfinite(share):
        source = sampler(data, SAMPLES)
        if source is None:
            return ""
        share = source.share(design_of(data, row), limits)
    return f"{number(100.0 * share, 3)}\u00a0% of what is made keeps all limits"


def _extras(data: Dataset, row: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the design outputs that matter for building the mechanism."""
    family = data.study.bare
    design = np.array([[float(row[name]) for name in family.parameter_names]])
    extras = []
    for name in EXTRAS:
        dimension = sizes(family).get(name)
        if dimension is not None:
            shown = quantity(name, dimension.output.unit)
            extras.append((shown.words, shown.show(float(dimension.values(family, design)[0]), 4)))
    return extras
