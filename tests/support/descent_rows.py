"""Rows of one design of a descent and their gradients, as the descents of `kernels.descent` compute them."""

from __future__ import annotations

import numpy as np

from kernels.descent.descents import _copy, _empty_design, _evaluate
from kernels.descent.motion import motion_of
from kernels.descent.rows import Task, columns_of
from kernels.jit import kernel


@kernel
def rows_at(
    task: Task, kind: int, place: np.ndarray, x: np.ndarray, values: np.ndarray, slopes: np.ndarray
) -> None:  # fmt: skip
    """Compute the rows (r,) of one design that turns, and their gradients (n + 5, r) by places and unknowns."""
    d = _empty_design(task)
    _copy(place, d.place)
    _copy(x, d.x)
    columns_of(task, kind, d.place, d.row)
    motion_of(d.row, task.cos, task.sin, d.motion)
    _evaluate(task, kind, d, slopes)
    _copy(d.values, values)
