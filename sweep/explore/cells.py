"""Feasible designs of a dataset counted in cells over pairs of its columns, for any number of rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sweep.dataset.reading import of_number, scan
from sweep.errors import InputError, whole
from sweep.explore.hand import Hand
from sweep.families.base import Array
from sweep.quantities.limits import compared
from sweep.report.tables import limited

MOST_BINS, NOWHERE = 64, 255
BinNumbers: TypeAlias = NDArray[np.uint8]


class RankedColumn(NamedTuple):
    """A column of the feasible designs, the best first, with its ends."""

    values: Array
    low: float
    high: float

    def bins(self, count: int) -> BinNumbers:
        """Return the number of the cell of every value, NOWHERE for a missing one."""
        share = (self.values - self.low) / (self.high - self.low)
        known = np.minimum(np.nan_to_num(share) * count, count - 1)
        return np.where(np.isfinite(share), known, NOWHERE).astype(np.uint8)


def cells(
    hand: Hand, pairs: Sequence[Sequence[str]], ranges: Mapping[str, Sequence[float]], bins: int
) -> dict[str, Any]:
    """Return counts of feasible designs in the cells of pairs of columns, each with the best design in it.

    ``ranges`` are ends of columns in displayed units: only designs within all of them are counted.

    Raises
    ------
    InputError
        without a run, for a column that the dataset does not have, or for too many cells.
    """
    if hand.folder is None:
        raise InputError("designs", "none", "the folder of a run: sweep explore results/NAME/designs", "explore")
    whole("bins", bins, "explore", 1, MOST_BINS)
    objective = hand.study.objective
    merit = objective.output if objective is not None else "design"
    names = dict.fromkeys([*chain.from_iterable(pairs), *ranges])
    columns = {name: _column(hand.folder, merit, name) for name in names}
    shown = {name: limited(hand.data, name) for name in columns}
    design = _column(hand.folder, merit, "design").values
    within = np.ones(design.size, np.bool_)
    for name, ends in dict(ranges).items():
        low, high = sorted(float(end) / shown[name].factor for end in ends)
        room = 1e-9 * (columns[name].high - columns[name].low)
        within &= (columns[name].values >= low - room) & (columns[name].values <= high + room)
    rows = np.flatnonzero(within)
    number = design if rows.size == design.size else design[rows]
    places = {name: _places(hand.folder, merit, name, bins) for name in dict.fromkeys(chain.from_iterable(pairs))}
    if rows.size < design.size:
        places = {name: column_places[rows] for name, column_places in places.items()}
    return {
        "axes": {
            name: {
                "title": quantity.title,
                "symbol": quantity.symbol,
                "ends": sorted([columns[name].low * quantity.factor, columns[name].high * quantity.factor]),
                "turned": quantity.factor < 0.0,
            }
            for name, quantity in shown.items()
        },
        "pairs": [_counted(places[x], places[y], bins, number) for x, y in pairs],
        "kept": int(rows.size),
        "of": int(design.size),
    }


def _counted(x: BinNumbers, y: BinNumbers, bins: int, design: Array) -> list[list[int]]:
    """Return the non-empty cells as position, count and the first design, which is the best."""
    cell = np.where((x == NOWHERE) | (y == NOWHERE), bins * bins, y.astype(np.intp) * bins + x)
    count = np.bincount(cell, minlength=bins * bins)[: bins * bins]
    first = np.zeros(bins * bins + 1, np.intp)
    first[cell[::-1]] = np.arange(cell.size - 1, -1, -1)  # written backwards: the first design of a cell remains
    return [[int(c % bins), int(c // bins), int(count[c]), int(design[first[c]])] for c in np.flatnonzero(count)]


@lru_cache(64)
def _places(folder: Path, merit: str, name: str, bins: int) -> BinNumbers:
    return _column(folder, merit, name).bins(bins)


@lru_cache(64)
def _column(folder: Path, merit: str, name: str) -> RankedColumn:
    """Read a column of the feasible designs, the best first."""
    values = _read(folder, name)[_order(folder, merit)]
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    return RankedColumn(values, low, high if high > low else low + (abs(low) or 1.0))


@lru_cache(2)
def _order(folder: Path, merit: str) -> NDArray[np.intp]:
    return np.argsort(compared(merit, _read(folder, merit)), kind="stable")


def _read(folder: Path, name: str) -> Array:
    import pyarrow.compute as pc

    source = scan(folder)
    if name not in source.schema.names:
        raise InputError("column", name, ", ".join(source.schema.names), "explore")
    column = source.to_table(columns=[name], filter=pc.field("status") == 0).column(name)
    return np.asarray(column.to_numpy(), np.float64)


def design_of(hand: Hand, number: int) -> dict[str, float]:
    """Return a design of the dataset by its number in the column ``design``."""
    if hand.folder is None:
        raise InputError("design", number, "a design of a run", "explore")
    row = of_number(hand.folder, number).iloc[0]
    return {name: float(row.get(name, hand.first[name])) for name in hand.first}
