"""Solve designs on even samples of a turn, each on the coarsest grid that resolves it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels.status import NOT_CONVERGED
from kernels.types import Array, Status

Solver: TypeAlias = Callable[[NDArray[np.intp], int], tuple[dict[str, Array], Status]]
"""``solve(rows, size)``: results (k, ...) of the designs ``rows`` (k,) on a grid of that size, by name, and status."""


def on_first_grid(least: Array, grids: Sequence[int], solve: Solver) -> tuple[dict[str, Array], Status]:
    """Solve every design on the first of the ``grids`` that resolves it.

    ``least`` (n,) is the least number of samples of each design; coarser grids are skipped, except the last one.
    Designs for which ``solve`` returns NOT_CONVERGED are solved again on the next grid.
    """
    n, found = len(least), dict[str, Array]()
    status: Status = np.full(n, NOT_CONVERGED, np.uint8)
    for size in grids:
        rows = np.flatnonzero((status == NOT_CONVERGED) & ((least <= size) | (size == grids[-1])))
        if not rows.size and (found or n):
            continue
        part, status[rows] = solve(rows, size)
        for name, values in part.items():
            found.setdefault(name, np.empty((n, *values.shape[1:])))[rows] = values
    return found, status
