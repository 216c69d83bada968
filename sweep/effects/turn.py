"""Design outputs of whole-turn effects: reductions of curves that are Fourier series."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from kernels import status as st
from kernels.curves.periodic import turn_extremes
from kernels.types import TWO_PI, Status
from sweep.effects.scene import Scene, take_over
from sweep.families.base import Array, Columns, Output, Turn
from sweep.families.poses import chosen
from sweep.families.reduction import REDUCTIONS
from sweep.numerics.even_grids import beyond, on_first_grid
from sweep.numerics.records import Indices

RESOLVED = 1e-9
NONE: Mapping[str, Array] = MappingProxyType({})

GridSolver: TypeAlias = Callable[[Scene, Array, bool], tuple[dict[str, Array], Status]]
"""``solve(scene, phi, last)``: design outputs (n,) and curves (n, m) at phi from a scene on a grid, status (n,)."""


def on_finer_grids(
    scene: Scene, phi: Array, grids: Sequence[int], solve: GridSolver
) -> tuple[dict[str, Array], Status]:
    """Solve every design on the first of the ``grids`` that resolves it.

    ``phi`` is (n, m) or (1, m); designs for which ``solve`` returns NOT_CONVERGED are solved again on the next grid.  A
    grid that does not resolve the loads is skipped, except the last one.
    """

    def on_grid(rows: Indices, size: int) -> tuple[dict[str, Array], Status]:
        own = np.ascontiguousarray(phi[rows] if phi.shape[0] > 1 else phi)
        return solve(scene.only(rows).on_grid(size), own, size == grids[-1])

    return on_first_grid(scene.least_samples, grids, on_grid)


def at_poses(scene: Scene, found: dict[str, Array], turn: Status, wanted: frozenset[str]) -> Columns:
    """Return curves of a whole-turn effect at the scene's poses; the turn's status holds for all of them."""
    status = scene.status()
    take_over(status, np.broadcast_to(turn[:, None], status.shape))
    return chosen(found, wanted, status)


def per_turn(
    found: dict[str, Array],
    status: Status,
    numbers: Columns,
    curves: Sequence[Output],
    wanted: frozenset[str],
    limit: float = RESOLVED,
    known: Array | float = RESOLVED,
    known_of: Mapping[str, Array] = NONE,
) -> Columns:
    """Select the wanted ones of ``numbers`` and of the reductions of ``curves``, sampled on an odd grid in ``found``.

    ``limit`` is the share of a curve that the grid may miss, ``known`` the relative error of the steady state,
    ``known_of`` the errors of single curves.
    """
    columns = dict(numbers)
    for o in curves:
        if any(name.endswith(f"_{o.name}") for name in wanted):
            columns |= reductions(o.name, found[o.name], status, limit, known_of.get(o.name, known))
    return chosen(columns, wanted, status)


def reduction_outputs(outputs: Sequence[Output]) -> tuple[Output, ...]:
    """Reductions over the turn of pose outputs, as design outputs of the effect itself."""
    return tuple(reduction.output(o, Turn()) for o in outputs for reduction in REDUCTIONS)


def reductions(
    name: str, values: Array, status: Status, limit: float = RESOLVED, known: Array | float = RESOLVED
) -> Columns:
    """Compute all reductions of one curve from its samples on a uniform odd grid, (n, N), with their errors.

    ``status`` (n,) becomes NOT_CONVERGED where the grid misses more than the share ``limit`` of the curve; failed
    designs give nan.
    """
    n = len(values)
    largest, phi_largest, least, phi_least, rms, missed = (np.empty(n) for _ in range(6))
    turn_extremes(np.ascontiguousarray(values), np.full(n, known), largest, phi_largest, least, phi_least, rms, missed)
    status[(status == st.OK) & ~(missed < limit)] = st.NOT_CONVERGED
    size = np.maximum(np.abs(largest), np.abs(least))
    # The curve is as accurate as the steady state that it comes from, and lacks all harmonics of a narrow peak above
    # those of the grid, which fold back into its highest ones.
    missed = np.fmax(missed, np.divide(2.0 * beyond(values), size, out=np.zeros(n), where=size > 0.0))
    err, early = (missed + known) * size, np.sqrt(missed + known)
    phi_largest, phi_least = np.mod(phi_largest, TWO_PI), np.mod(phi_least, TWO_PI)  # just before 0 rounds to 2 pi
    # Of a top and a bottom as far from zero within their errors the first in the turn counts, 0 within its error too.
    first = np.mod(phi_largest + early, TWO_PI) <= np.mod(phi_least + early, TWO_PI)
    upward = np.where(np.abs(largest + least) <= 2.0 * err, first, largest >= -least)
    found = {
        "max": (largest, err),
        "min": (least, err),
        "max_abs": (size, err),
        # The slope's zero is as accurate as the square root of the value's error.
        "phi_max_abs": (np.where(upward, phi_largest, phi_least), early),
        "phi_max": (phi_largest, early),
        "phi_min": (phi_least, early),
        "range": (largest - least, 2.0 * err),
        "rms": (rms, err),
    }
    columns: Columns = {}
    for base, (value, error) in found.items():
        columns[f"{base}_{name}"] = np.where(status == st.OK, value, np.nan)
        columns[f"err_{base}_{name}"] = error
    return columns
