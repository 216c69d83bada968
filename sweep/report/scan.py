"""One pass over a dataset, part by part, that collects the data of maps, trade-off and counts of the report.

Memory is bounded by a batch of rows, whatever the size of the dataset.  Values are in stored units: mm, rad.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

import numpy as np

from sweep.dataset.chunk_files import batches
from sweep.dataset.reading import non_dominated
from sweep.families.base import Array
from sweep.families.names import is_error, without_error
from sweep.quantities.limits import compared
from sweep.study import Study
from sweep.study.space import Axis

SCATTER_POINTS = 40_000
CELLS_OF_PAIR, CELLS_OF_MANY = 240, 32
DESIGNS_PER_CELL = 3.0


@dataclass(frozen=True)
class Cells:
    """Division of one axis of the design space into cells, one per value or per run of neighbouring values.

    ``edges`` are the boundaries in stored units; ``weights`` the share of the axis in each cell.
    """

    name: str
    edges: Array
    weights: Array

    @classmethod
    def of_values(cls, name: str, values: Array, most: int) -> Cells:
        """Divide a lattice axis; with more than ``most`` values, neighbouring values share a cell."""
        ordered = np.unique(values)
        if ordered.size == 1:
            reach = 0.5 * abs(ordered[0]) or 0.5
            return cls(name, np.array([ordered[0] - reach, ordered[0] + reach]), np.ones(1))
        continued = np.pad(ordered, 1, mode="reflect", reflect_type="odd")
        boundaries = 0.5 * (continued[1:] + continued[:-1])
        count = min(most, ordered.size)
        starts = np.arange(count + 1) * ordered.size // count
        return cls(name, boundaries[starts], np.diff(starts) / ordered.size)

    @classmethod
    def of_range(cls, name: str, low: float, high: float, count: int) -> Cells:
        """Divide a sampled axis into equal cells."""
        return cls(name, np.linspace(low, high, count + 1), np.full(count, 1.0 / count))

    def placed(self, value: float) -> float:
        """Reduce an angle that is swept over a whole turn to the axis by whole turns; leave any other value alone."""
        low, high = float(self.edges[0]), float(self.edges[-1])
        if abs(high - low - 2.0 * np.pi) > 1e-6 * np.pi:
            return value
        return low + (value - low) % (2.0 * np.pi)

    def index(self, values: Array) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
        """Return the number of the cell of each value; values beyond the ends belong to the outer cells."""
        return np.clip(np.searchsorted(self.edges, values, side="right") - 1, 0, self.edges.size - 2)


@dataclass
class Grid:
    """Best objective and number of feasible designs in each cell of two axes, shape (y, x)."""

    best: Array
    count: Array


@dataclass
class Scan:
    """Result of one pass over the rows.

    ``grids`` and ``lines`` are cells over two axes and over one.  ``scatter`` holds a subset of the points (objective,
    second output) for the figure, ``front`` the non-dominated ones of all points.  ``errors`` has the largest error
    estimate of each output, absolute and relative.  ``best_row`` is the feasible design with the smallest objective.
    """

    rows: int = 0
    feasible: int = 0
    best_row: dict[str, float] = field(default_factory=dict)
    grids: dict[tuple[str, str], Grid] = field(default_factory=dict)
    lines: dict[str, Grid] = field(default_factory=dict)
    scatter: Array = field(default_factory=lambda: np.empty((0, 2)))
    front: Array = field(default_factory=lambda: np.empty((0, 2)))
    errors: dict[str, tuple[float, float]] = field(default_factory=dict)


def divided_axes(study: Study, feasible: int) -> list[Cells]:
    """Return the swept axes divided into cells: finely if a single map shows them all, otherwise coarsely.

    Axes of a sample are divided so that a cell holds DESIGNS_PER_CELL of the ``feasible`` designs on average.  Signs,
    which have no map, and parameters that [locus] or [fit] sets are left out.
    """
    signs = {p.name for p in study.family.parameters if p.choices is not None}
    left_out = signs.union(study.made, study.rescaled)
    swept = [axis for axis in study.space.axes if axis.varies and axis.name not in left_out]
    most = CELLS_OF_PAIR if len(swept) <= 2 else CELLS_OF_MANY
    # A power of two: a Sobol sequence puts equally many points into each cell.
    sampled = 2 ** min(5, max(2, math.floor(0.5 * math.log2(max(feasible, 1) / DESIGNS_PER_CELL))))

    def divided(axis: Axis) -> Cells:
        if axis.values is None:
            return Cells.of_range(axis.name, axis.low, axis.high, sampled)
        return Cells.of_values(axis.name, axis.values, most)

    return [divided(axis) for axis in swept]


def scan(
    parts: Sequence[Path],
    cells: Sequence[Cells],
    objective: str | None,
    second: str | None,
    larger: bool = False,
    total: int = 0,
) -> Scan:
    """Read every part of the dataset once.

    Parameters
    ----------
    parts : Parquet files of the dataset
    cells : divided axes; every pair of them gets a grid
    objective, second : output columns, smaller is better; None if the study has none
    larger : whether larger values of the second are better
    total : approximate number of rows, which sets the stride of the points in the figure
    """
    sense = -1.0 if larger else 1.0
    result = Scan()
    for c in cells:
        result.lines[c.name] = Grid(np.full(c.weights.size, np.inf), np.zeros(c.weights.size))
    for x, y in combinations(cells, 2):
        shape = (y.weights.size, x.weights.size)
        result.grids[x.name, y.name] = Grid(np.full(shape, np.inf), np.zeros(shape))
    stride = max(1, total // SCATTER_POINTS)
    best, samples = np.inf, []
    for rows in batches(parts):
        names = list(rows.schema.names)
        batch = {name: np.asarray(rows[name], np.float64) for name in names}
        ok = batch["status"] == 0
        offset = -result.rows % stride
        result.rows += ok.size
        if objective is not None:
            ok &= np.isfinite(batch[objective])
        result.feasible += int(ok.sum())
        for name in names:
            if is_error(name) and ok.any():
                _note_errors(result, name, np.abs(batch[name][ok]), np.abs(batch[without_error(name)][ok]))
        if not ok.any():
            continue
        score = compared(objective, batch[objective]) if objective is not None else np.zeros(ok.size)
        _fill(result, cells, batch, ok, score)
        row = int(np.argmin(np.where(ok, score, np.inf)))
        if score[row] < best:
            best, result.best_row = float(score[row]), {name: float(batch[name][row]) for name in names}
        if objective is not None and second is not None:
            other = sense * compared(second, batch[second])
            complete = ok & np.isfinite(other)
            points = np.column_stack([score, other])
            points_so_far = np.vstack([result.front, points[complete]])
            result.front = points_so_far[non_dominated(*points_so_far.T)]
            sampled = points[offset::stride]
            samples.append(sampled[complete[offset::stride]])
    if samples:
        result.scatter = np.vstack(samples) * (1.0, sense)
        result.front = result.front * (1.0, sense)
    return result


def _fill(result: Scan, cells: Sequence[Cells], batch: dict[str, Array], ok: Array, score: Array) -> None:
    index = {c.name: c.index(batch[c.name][ok]) for c in cells}
    good = score[ok]
    for name, line in result.lines.items():
        np.minimum.at(line.best, index[name], good)
        line.count += np.bincount(index[name], minlength=line.count.size)
    for (x, y), grid in result.grids.items():
        flat = index[y] * grid.best.shape[1] + index[x]
        np.minimum.at(grid.best.reshape(-1), flat, good)
        grid.count += np.bincount(flat, minlength=grid.count.size).reshape(grid.count.shape)


def _note_errors(result: Scan, name: str, errors: Array, values: Array) -> None:
    finite = np.isfinite(errors) & np.isfinite(values) & (values > 0.0)
    if finite.any():
        relative = float(np.max(errors[finite] / values[finite]))
        before = result.errors.get(name, (0.0, 0.0))
        result.errors[name] = (max(before[0], float(errors[finite].max())), max(before[1], relative))


def most_telling(scanned: Scan) -> tuple[str, str] | None:
    """Return the pair of axes whose map varies most.

    That is the pair with the largest variation of the best objective over its cells; for equal pairs, the one with the
    largest variation of the share of feasible designs.
    """
    scores: dict[tuple[str, str], tuple[float, float]] = {}
    for pair, grid in scanned.grids.items():
        reached = np.isfinite(grid.best)
        if not reached.any():
            continue
        # A cell without a feasible design counts as the worst cell with one.
        filled = np.where(reached, grid.best, grid.best[reached].max())
        share = grid.count / max(float(grid.count.max()), 1.0)
        scores[pair] = float(filled.std()), float(share.std())
    return max(scores, key=lambda pair: scores[pair]) if scores else None
