"""Comparison with the oracle tables: errors in units of 2^-53 max(cond, |y|), per quantity and kind of row.

The tables hold 25 digits and the condition number ``cond`` of every value: one rounding of each input moves it by
2^-53 cond.  For a derivative the condition numbers of the lower orders count too, because a single one may vanish by
accident.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kernels import status as st

if TYPE_CHECKING:
    import pandas as pd

UNIT = 2.0**-53
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Worst:
    """Largest factor of one quantity over the rows of one kind, and the factor that its sheet allows."""

    table: str
    quantity: str
    kind: str
    rows: int
    undecidable: int
    factor: float
    allowed: float


def read(folder: Path, name: str) -> list[dict[str, Any]]:
    """Return the rows of one table."""
    rows: list[dict[str, Any]] = json.loads((folder / f"{name}_open.json").read_text())["rows"]
    return rows


def judge(
    table: str,
    rows: Sequence[Row],
    got: pd.DataFrame,
    quantities: Mapping[str, tuple[str, Sequence[str]]],
    allowed: float,
    angles: Sequence[str] = (),
    size: Callable[[Row, str], float | None] | None = None,
) -> list[Worst]:
    """Compare column by column; ``quantities`` gives per output the row's key and the keys whose sizes count."""
    from mpmath import mp, mpf, pi

    found = []
    undecidable = np.isin(got["status"], (st.DEAD_POINT, st.UNDECIDABLE))
    kinds = [f"{row['kind']} {row['case']}" if "case" in row else row["kind"] for row in rows]
    for output, (key, lower) in quantities.items():
        worst: dict[str, list[float]] = {kind: [] for kind in kinds}
        with mp.workdps(40):
            for value, row, kind, skip in zip(got[output], rows, kinds, undecidable, strict=True):
                scales = [size_of(row, k) if size is None else size(row, k) for k in lower]
                if skip or row.get(key) is None or None in scales:
                    continue
                exact, error = mpf(row[key]), mpf(float(value)) - mpf(row[key])
                if output in angles:
                    error -= 2 * pi * mp.nint(error / (2 * pi))
                scale = max(abs(exact), *scales)
                worst[kind].append(float(abs(error) / (UNIT * scale)) if scale else float(abs(error) > 0.0))
        for kind, values in worst.items():
            if values:
                count = sum(bool(u) for u, k in zip(undecidable, kinds, strict=True) if k == kind)
                # nan must not pass as small: max() would drop it.
                largest = float(np.max(values))
                found.append(Worst(table, output, kind, len(values), count, largest, allowed))
    return found


def size_of(row: Row, key: str) -> float | None:
    """Return the larger of condition number and value; None if they leave float64 (scales of 1e+-100)."""
    from mpmath import mpf

    cond, value = row["cond"].get(key), abs(float(row[key]))
    return None if cond is None or (value == 0.0 and mpf(row[key]) != 0) else max(float(cond), value)
