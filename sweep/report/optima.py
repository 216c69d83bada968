"""Cards of the structurally different optima, each with its drawing, sizes and yield."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sweep.optimise.tolerance import deviating
from sweep.reductions.dimensions import size
from sweep.report.dataset import Dataset
from sweep.report.figures import save
from sweep.report.groups import Group
from sweep.report.mechanisms import small_figures
from sweep.report.quantities import change, number, quantity, with_unit
from sweep.report.turns import parts_over_turn

MOST = 6  # are shown
ROUNDING = 1e-9  # of the largest length: what is smaller is 0
SAMPLES = 2048  # made mechanisms of each: a share good to 1 %
EXTRAS = ("least_link", "arm_ratio")


@dataclass(frozen=True)
class Optimum:
    """One of the different optima, as a card shows it.

    ``made`` is the share of what is made that keeps all limits, in words; empty without tolerances.  ``sizes`` are the
    dimensions as name and value, ``extras`` outputs about them.
    """

    title: str
    objective: str
    against: str
    starts: int
    mirrored: int
    made: str
    sizes: tuple[tuple[str, str], ...]
    extras: tuple[tuple[str, str], ...]
    picture: str


def optima(data: Dataset, found: list[Group], folder: Path) -> list[Optimum]:
    """Return the cards of the first few, with their pictures saved in ``folder``; none where there is only one."""
    objective = data.study.objective
    if len(found) < 2 or objective is None:
        return []
    found = found[:MOST]
    drawn = small_figures(parts_over_turn(data.study, {str(k): group.row for k, group in enumerate(found)}), "mm")
    pictures = {key: save(figure, folder / f"optimum-{int(key) + 1}.svg").uri for key, figure in drawn.items()}
    shown = quantity(objective.output, data.units.get(objective.output, ""))
    best = float(found[0].row[objective.output])
    cards = []
    for k, group in enumerate(found):
        value = float(group.row[objective.output])
        cards.append(
            Optimum(
                group.title(k),
                f"{shown.words} {shown.show(value)}",
                "" if k == 0 else change(shown, value, best),
                group.starts,
                group.mirrored,
                _made(data, group.row),
                _sizes(data, group.row),
                _extras(data, group.row),
                pictures.get(str(k), ""),
            )
        )
    return cards


def optima_sentence(data: Dataset, found: list[Group]) -> str:
    """Return how many different optima there are, for the answer."""
    objective = data.study.objective
    if len(found) < 2 or objective is None:
        return ""
    shown = quantity(objective.output, data.units.get(objective.output, ""))
    value, best = (float(group.row[objective.output]) for group in (found[1], found[0]))
    difference = change(shown, value, best)
    text = f"The search ended in {len(found)} structurally different optima"
    row = found[1].row
    paper = row.get("role") == "nominal"
    text += f"; the {'best on paper' if paper else 'next'} has {shown.show(value)}"
    text += f" ({difference})" if difference else ""
    share = _made(data, row) if paper else ""
    return f"{text}, but {share}." if share else f"{text}."


def _made(data: Dataset, row: dict[str, Any]) -> str:
    """Return the share of what is made within the tolerances that keeps all limits."""
    from sweep.chunks.cascade import meets
    from sweep.evaluation.summaries import design_outputs

    study, known = data.study, float(row.get("yield", math.nan))
    limits = [x for x in study.output_limits if x.minimum is None or x.minimum != x.maximum]
    if study.tolerance is None or study.optimise is None or not limits:
        return ""
    if not math.isfinite(known):
        design = np.array([float(row[name]) for name in study.family.parameter_names])
        designs = deviating(study.family, design, study.tolerance, study.optimise.seed, SAMPLES)
        columns = design_outputs(study.family, designs, [x.output for x in limits], study.accuracy, study.window)
        known = float(np.logical_and.reduce([meets(limit, columns[limit.output]) for limit in limits]).mean())
    return f"{number(100.0 * known, 3)}\u00a0% of what is made keeps all limits"


def _sizes(data: Dataset, row: dict[str, Any]) -> tuple[tuple[str, str], ...]:
    """Return what can be measured on the drawing: lengths, angles, ratios and signs of the bare mechanism."""
    found = []
    own = data.study.bare.parameters
    longest = max((abs(float(row[p.name])) for p in own if p.unit == "length"), default=0.0)
    for p in own:
        shown = quantity(p.name, {"length": "mm", "angle": "rad"}.get(p.unit, "1"))
        value = float(row[p.name])
        if abs(value) < ROUNDING * (longest if p.unit == "length" else 1.0):
            value = 0.0
        text = f"{value:+g}" if p.choices is not None else with_unit(number(value * shown.factor, 4), shown.unit)
        found.append((p.name, text))
    return tuple(found)


def _extras(data: Dataset, row: dict[str, Any]) -> tuple[tuple[str, str], ...]:
    """Return outputs of the dimensions alone that tell whether one would build it."""
    family = data.study.bare
    design = np.array([[float(row[name]) for name in family.parameter_names]])
    found = []
    for name in EXTRAS:
        one = size(family, name)
        if one is not None:
            shown = quantity(name, one.output.unit)
            found.append((shown.words, shown.show(float(one.values(family, design)[0]), 4)))
    return tuple(found)
