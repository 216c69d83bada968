"""Feasible designs of the sweep as lines over their dimensions and outputs, for the page's parallel coordinates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.chunks.cascade import compared
from sweep.families.base import Array
from sweep.quantities.names import is_flag
from sweep.report.limits import limited
from sweep.report.moving import packed
from sweep.report.quantities import Quantity, quantity

if TYPE_CHECKING:
    from sweep.report.alternatives import Shown
    from sweep.report.dataset import Dataset
    from sweep.report.scan import Cells

BEST, SPREAD = 250, 550  # lines of the best designs, and of those taken evenly from all others
DIMENSIONS, OUTPUTS = 9, 4
CONSTANT = 1e-12


def parallel(data: Dataset, cells: Sequence[Cells], shown: Sequence[Shown]) -> dict[str, Any] | None:
    """Return lines, their axes and the named designs among them; None where there are no two designs to compare.

    A line's number is that of its row in :func:`sweep.load`, by which ``sweep export`` finds the design.
    """
    axes = _axes(data, cells)
    if len(axes) < 2:
        return None
    objective = data.study.objective
    rows, values = _lines(data.parts, [axis.name for axis in axes], None if objective is None else objective.output)
    if len(rows) < 2:
        return None
    told = np.ptp(values, axis=0) > CONSTANT * np.abs(values).max(axis=0)
    axes, values = [axis for axis, varies in zip(axes, told, strict=True) if varies], values[:, told]
    if len(axes) < 2:
        return None
    named = [one for one in shown if one.role != "front"]
    marks = [[float(one.row.get(axis.name, np.nan)) * axis.factor for axis in axes] for one in named]
    return {
        "axes": [{"name": axis.name, "symbol": axis.symbol, "unit": axis.unit} for axis in axes],
        "objective": next((k for k, axis in enumerate(axes) if objective and axis.name == objective.output), -1),
        "rows": rows.tolist(),
        "values": packed(values * [axis.factor for axis in axes]),
        "designs": [
            {"name": one.name, "role": one.role, "values": packed(mark)} for one, mark in zip(named, marks, strict=True)
        ],
        "of": data.counts.get(0, len(rows)),
    }


def _axes(data: Dataset, cells: Sequence[Cells]) -> list[Quantity]:
    """Return swept dimensions, then the objective and what is limited."""
    study = data.study
    objective = [] if study.objective is None else [study.objective.output]
    second = [] if data.second is None else [data.second]
    stored = set(data.units) | set(study.want)
    limits = [limit.output for limit in study.limits if limit.output in study.want and not is_flag(limit.output)]
    outputs = [name for name in dict.fromkeys([*objective, *second, *limits]) if name in stored][:OUTPUTS]
    dimensions = [limited(data, cell.name) for cell in cells][:DIMENSIONS]
    return [*dimensions, *(quantity(name, data.units.get(name, "")) for name in outputs)]


def _lines(parts: Sequence[Path], names: list[str], objective: str | None) -> tuple[Array, Array]:
    """Return row numbers and values of the best and of evenly spaced feasible designs, in the order of the rows."""
    total = sum(int(rows.size) for rows, _ in _feasible(parts, names))
    step = max(1, -(-total // SPREAD))
    seen = 0
    rows, values = np.empty(0), np.empty((0, len(names)))
    best_rows, best_values = rows, values
    for found, table in _feasible(parts, names):
        taken = slice(-seen % step, None, step)
        rows, values = np.concatenate([rows, found[taken]]), np.vstack([values, table[taken]])
        seen += found.size
        if objective is not None:
            best_rows, best_values = np.concatenate([best_rows, found]), np.vstack([best_values, table])
            order = np.argsort(compared(objective, best_values[:, names.index(objective)]), kind="stable")[:BEST]
            best_rows, best_values = best_rows[order], best_values[order]
    rows, first = np.unique(np.concatenate([rows, best_rows]), return_index=True)
    return rows.astype(np.int64), np.vstack([values, best_values])[first]


def _feasible(parts: Sequence[Path], names: list[str]) -> Iterator[tuple[Array, Array]]:
    """Yield batches of feasible designs with finite values: row numbers over all parts, and values (n, names)."""
    import pyarrow.parquet as pq

    start = 0
    for part in parts:
        with pq.ParquetFile(part) as source:
            for batch in source.iter_batches(columns=[*names, "status"]):
                columns = [np.asarray(batch.column(name).to_numpy(zero_copy_only=False), float) for name in names]
                table = np.column_stack(columns)
                status = batch.column("status").to_numpy(zero_copy_only=False)
                good = np.flatnonzero((status == 0) & np.isfinite(table).all(axis=1))
                yield (start + good).astype(np.float64), table[good]
                start += batch.num_rows
