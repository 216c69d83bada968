"""Feasible designs of a dataset over two of its columns, counted in cells: a page shows any number of rows so."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from sweep.dataset.reading import scan
from sweep.errors import InputError
from sweep.explore.hand import Hand
from sweep.families.base import Array
from sweep.quantities.limits import compared
from sweep.report.quantities import quantity

ACROSS, UP = 48, 32


def cells(hand: Hand, x: str, y: str) -> dict[str, Any]:
    """Return counts of feasible designs in cells, each with the number of the design that is best in it.

    Raises
    ------
    InputError
        where nothing was run, or for a column that the dataset has not.
    """
    if hand.folder is None:
        raise InputError("designs", "none", "the folder of a run: sweep explore results/NAME/designs", "explore")
    objective = hand.study.objective
    found = _columns(hand.folder, x, y, objective.output if objective is not None else x)
    axes, places = [], []
    for name, values, bins in ((x, found[x], ACROSS), (y, found[y], UP)):
        shown = quantity(name, hand.data.units.get(name, ""))
        low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
        wide = (high - low) or abs(high) or 1.0
        places.append(np.minimum(((values - low) / wide * bins).astype(np.int64), bins - 1))
        ends = sorted([low * shown.factor, (low + wide) * shown.factor])
        axes.append({"name": name, "title": shown.title, "ends": ends, "turned": shown.factor < 0.0, "bins": bins})
    cell = places[1] * ACROSS + places[0]
    order = np.lexsort((found["merit"], cell))
    filled, first, count = np.unique(cell[order], return_index=True, return_counts=True)
    best = found["design"][order][first]
    return {
        "axes": axes,
        "cells": [
            [int(c % ACROSS), int(c // ACROSS), int(n), int(d)] for c, n, d in zip(filled, count, best, strict=True)
        ],
        "of": int(cell.size),
    }


@lru_cache(8)
def _columns(folder: Path, x: str, y: str, merit: str) -> dict[str, Array]:
    """Read what feasible designs have in two columns, and how good they are; rows without a value are left out."""
    import pyarrow.compute as pc

    source = scan(folder)
    for name in (x, y, merit):
        if name not in source.schema.names:
            raise InputError("column", name, ", ".join(source.schema.names), "explore")
    names = list(dict.fromkeys([x, y, merit, "design"]))
    table = source.to_table(columns=names, filter=pc.field("status") == 0)
    columns = {name: table.column(name).to_numpy() for name in names}
    columns["merit"] = compared(merit, np.asarray(columns[merit], np.float64))
    known = np.isfinite(columns[x]) & np.isfinite(columns[y])
    return {name: values[known] for name, values in columns.items()}


def design_of(hand: Hand, number: int) -> dict[str, float]:
    """Return a design of the dataset by its number in the column ``design``."""
    import pyarrow.compute as pc

    if hand.folder is None:
        raise InputError("design", number, "a design of a run", "explore")
    rows = scan(hand.folder).to_table(filter=pc.field("design") == number).to_pylist()
    if not rows:
        raise InputError("design", number, "a number of the column design", "explore")
    return {name: float(rows[0].get(name, hand.first[name])) for name in hand.first}
