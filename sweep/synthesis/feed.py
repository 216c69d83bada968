"""Refinement of a feed mechanism's lift chain: the weighted difference (23) as a linear problem; docs/feed.md."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from kernels import status as st
from kernels.families import feed as kernels
from sweep.errors import InputError
from sweep.evaluation.tables import Table, numbers, one_design, refuse_rows
from sweep.families import family
from sweep.families.base import Array

Norm = Literal["squares", "largest"]


class LiftChain(NamedTuple):
    """Dimensions of a lift chain and their residual.

    ``fx``, ``fy`` are the coordinates of the joint F on the rack, ``q`` is the coupler [length]; ``difference`` is the
    excess length of the coupler in each pose, Delta q/(2 q) [length]; ``bar_branch`` the assembly mode, 0 if it differs
    between poses.
    """

    fx: float
    fy: float
    q: float
    bar_branch: int
    difference: Array


def rack_angles(table: Table, phi: Sequence[float] | Array, height: Sequence[float] | Array, side: int = 1) -> Array:
    """Return the angles of the rack at which the tooth has the wanted heights; docs/feed.md.

    Parameters
    ----------
    table : one design of ``feed`` (its fx, fy are not used)
    phi : crank angles [rad]
    height : wanted y_t at these angles [length]
    side : +1 or -1 for the choice of the angle: +1 lets the tooth rise with the angle (dy_t/dchi > 0)

    Returns
    -------
    array
        rack angles [rad in (-pi, pi]]; nan if the rocker is not assembled or the tooth does not reach

    Raises
    ------
    InputError
        for more than one design, a bad number, lengths that differ, a side other than +1 or -1.
    """
    matrix, grid, wanted = _given(table, phi, height, "height")
    if side not in (1, -1):
        raise InputError("side", side, "1 or -1", "rack_angles")
    _, rows = _rows(matrix, grid, np.zeros_like(grid))
    names = family("feed").parameter_names
    tx = matrix[0, names.index("tx")] + matrix[0, names.index("tooth")] * matrix[0, names.index("pitch")]
    ty = matrix[0, names.index("ty")]
    # tx sin chi + ty cos chi = k: chi is ahead of the tooth's own direction by the angle whose sine is k/|t|
    k, reach = wanted - rows[4], np.hypot(tx, ty)
    with np.errstate(invalid="ignore"):
        across = side * np.sqrt((reach - k) * (reach + k))
    chi = np.arctan2(k, across) - np.arctan2(ty, tx)
    turned: Array = np.arctan2(np.sin(chi), np.cos(chi))
    return turned


def lift_chain(
    table: Table,
    phi: Sequence[float] | Array,
    chi: Sequence[float] | Array,
    *,
    weights: Sequence[float] | Array | None = None,
    norm: Norm = "squares",
) -> LiftChain:
    """Return the joint F and coupler q that guide the rack best through wanted angles; (10) of docs/feed.md.

    The weighted difference |F - E|^2 - q^2 is linear in fx, fy and q^2 - fx^2 - fy^2, so no initial guess is needed.

    Parameters
    ----------
    table : one design of ``feed``; its fx, fy are not used, q only as a scale
    phi, chi : crank angles and wanted angles of the rack, at least 3 [rad]
    weights : weights of the poses; equal if not given
    norm : "squares" minimises the sum of the squared weighted differences, "largest" the largest one (minimax)

    Returns
    -------
    LiftChain

    Raises
    ------
    InputError
        for fewer than 3 poses, a bad number, a rocker that is not assembled, poses that do not determine the
        dimensions, or a result without a real coupler.
    """
    matrix, grid, angles = _given(table, phi, chi, "chi")
    weight = np.ones_like(grid) if weights is None else numbers(weights, "weights", "weights, position")
    if grid.size < 3 or weight.shape != grid.shape:
        raise InputError("poses", grid.size, "at least 3, with as many weights", "lift_chain")
    refuse_rows(~(np.isfinite(weight) & (weight >= 0.0)), weight, "weights", "finite numbers that are not negative")
    if norm not in ("squares", "largest"):
        raise InputError("norm", norm, "squares or largest", "lift_chain")
    status, rows = _rows(matrix, grid, angles)
    if (status != st.OK).any():
        bad = int(np.argmax(status != st.OK))
        raise InputError("phi", float(grid[bad]), st.MEANING[int(status[bad])], f"phi, position {bad}")
    system = np.column_stack([rows[0], rows[1], -np.ones_like(grid)])
    size = float(np.abs(rows[:2]).max())
    solution = (_least if norm == "squares" else _minimax)(system / [size, size, 1.0], -rows[2], weight)
    fx, fy, p0 = solution[0] / size, solution[1] / size, solution[2]
    square = p0 + fx * fx + fy * fy
    if not square > 0.0:
        raise InputError("chi", float(square), "angles that a coupler of real length can lead through", "lift_chain")
    q = float(np.sqrt(square))
    difference = (rows[0] * fx + rows[1] * fy + rows[2] - p0) / (2.0 * q)
    # sign of w.(i Rot(chi) f) is minus the assembly mode
    across = -(rows[1] * fx - rows[0] * fy)
    mode = int(np.sign(across[0])) if (np.sign(across) == np.sign(across[0])).all() else 0
    return LiftChain(float(fx), float(fy), q, mode, difference)


def _given(table: Table, phi: object, other: object, name: str) -> tuple[Array, Array, Array]:
    matrix = one_design(family("feed"), table, unused=("phi",))
    grid = np.atleast_1d(numbers(phi, "phi", "phi, position"))
    values = np.atleast_1d(numbers(other, name, f"{name}, position"))
    for column, array in (("phi", grid), (name, values)):
        refuse_rows(~np.isfinite(array), array, column, "a finite number")
    if values.shape != grid.shape or grid.ndim != 1:
        raise InputError(name, f"{values.size} values", f"one for each crank angle, {grid.size}", name)
    return matrix, grid, values


def _rows(matrix: Array, phi: Array, chi: Array) -> tuple[np.ndarray, Array]:
    status, rows = np.empty((1, phi.size), np.uint8), np.empty((5, 1, phi.size))
    kernels.lift_rows(matrix, np.cos(phi)[None, :], np.sin(phi)[None, :], chi[None, :], status, rows)
    return status[0], rows[:, 0]


def _least(system: Array, right: Array, weights: Array) -> Array:
    solution, _, rank, _ = np.linalg.lstsq(system * weights[:, None], right * weights, rcond=1e-12)
    if rank < 3:
        raise InputError("poses", int(rank), "three poses or more that fix fx, fy and q", "lift_chain")
    return np.asarray(solution, dtype=np.float64)


def _minimax(system: Array, right: Array, weights: Array) -> Array:
    """Minimise the largest weighted residual: a linear programme in the three unknowns and the bound."""
    from scipy.optimize import linprog

    start = _least(system, right, weights)
    scale = float(np.abs(weights * (system @ start - right)).max()) or 1.0
    rows, residual = system * weights[:, None], (right - system @ start) * weights / scale
    bound = -np.ones((len(rows), 1))
    above, below = np.hstack([rows, bound]), np.hstack([-rows, bound])
    solution = linprog([0.0, 0.0, 0.0, 1.0], A_ub=np.vstack([above, below]), b_ub=np.concatenate([residual, -residual]),
                    bounds=[(None, None)] * 3 + [(0.0, None)])  # fmt: skip
    if solution.status != 0 or solution.x is None:
        raise InputError("poses", solution.message, "a linear programme with a solution", "lift_chain")
    return start + scale * solution.x[:3]
