"""Synthesis of a heddle drive: levers and rods for the strokes of the shafts; docs/heddle.md."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
import pandas as pd

from kernels import status as st
from kernels.synthesis import heddle as kernels
from sweep.errors import InputError
from sweep.evaluation.tables import Sheet, Table, design_matrix, index_of, refuse_rows
from sweep.families.base import Array, Parameter

Mode = Literal["exact", "printed"]
ANGLES = {"mu", "xi_1", "xi_2", "lever_angle_1", "lever_angle_2", "lever_swing"}

_SIDE = Parameter("side_B", "sign", "side of B: +1 left of the ray O2-C", default=1.0, choices=(-1.0, 1.0))
_FRAME = (
    Parameter("stroke", "length", "wanted stroke of the shaft", positive=True),
    Parameter("O4E", "length", "arm of the shaft lever", positive=True),
    Parameter("O1O2", "length", "from the camshaft to the pivot of the cam lever", positive=True),
    Parameter("O1O3", "length", "from the camshaft to the pivot of the bell crank", positive=True),
    Parameter("O3C", "length", "upper arm of the bell crank", positive=True),
    Parameter("kappa", "angle", "rigid angle C-O3-D of the bell crank"),
)


_EXTREMES = Sheet("extremes of a heddle drive", _FRAME)
_LEVER = Sheet(
    "lever of a heddle drive",
    (
        *_FRAME,
        Parameter("O2B", "length", "arm of the cam lever", positive=True),
        Parameter("BC", "length", "rod", positive=True),
        _SIDE,
    ),
)
_RODS = Sheet(
    "rod of a heddle drive",
    (
        *_FRAME,
        Parameter("O2B", "length", "arm of the cam lever", positive=True),
        Parameter("swing", "angle", "wanted swing of the cam lever", positive=True),
        _SIDE,
    ),
)
_SHED = Sheet(
    "shed",
    (
        Parameter("shaft", "count", "number of the shaft, 1 next to the fell", positive=True),
        Parameter("d1", "length", "distance from the fell to shaft 1", positive=True),
        Parameter("t", "length", "distance between two shafts", positive=True),
        Parameter("stroke", "length", "stroke of the shaft named by ``reference``", positive=True),
        Parameter("reference", "count", "number of the shaft with the given stroke", default=4.0, positive=True),
    ),
)
_ARMS = Sheet(
    "arms of the shafts",
    (
        Parameter("stroke", "length", "stroke of the shaft", positive=True),
        Parameter("O4E", "length", "arm of the shaft lever to the heddle rod", positive=True),
        Parameter("O4F", "length", "arm of the shaft lever to the link", positive=True),
        Parameter("O3O4", "length", "distance of the pivots of bell crank and shaft lever", positive=True),
        Parameter("mu_3", "angle", "half swing of the bell crank, common to all shafts", positive=True),
    ),
)


def extremes(table: Table, mode: Mode = "exact") -> pd.DataFrame:
    """Return both extreme positions of a heddle drive for a wanted stroke, one row per row of the table.

    Equations (1), (2) and, if the table has the columns O2B and BC, (10) of docs/heddle.md.

    Parameters
    ----------
    table : DataFrame or mapping with ``stroke O4E O1O2 O1O3 O3C`` [one length unit] and ``kappa`` [rad]; with ``O2B``,
        ``BC`` and ``side_B`` (+1 if missing) the angles of the cam lever are added
    mode : "exact" computes the half swing mu from the chord of the lever's end; "printed" from the arc tangent printed
        in the source, which makes the travel of E shorter than the stroke

    Returns
    -------
    DataFrame
        ``mu xi_1 xi_2`` [rad; xi is the angle O2-O3-C, between 0 and pi], ``O2C_1 O2C_2 vertical_travel`` [length];
        with a rod ``lever_angle_1 lever_angle_2 lever_swing`` [rad from the line O1O3; signed].  ``status`` is
        NOT_ASSEMBLED if the lever is too short for the stroke or the rod does not reach; its own columns are nan.

    Raises
    ------
    InputError
        for a missing or misspelt column, a bad number, an unknown mode, O1O3 not longer than O1O2.
    """
    with_rod = "BC" in table or "O2B" in table
    matrix = design_matrix(_LEVER if with_rod else _EXTREMES, table)[0]
    positions, status = _positions(matrix, mode)
    turn = 2.0 * np.pi
    xi = [np.abs(positions[:, k] - turn * np.rint(positions[:, k] / turn)) for k in (1, 2)]
    columns: dict[str, Array] = {"mu": positions[:, 0], "xi_1": xi[0], "xi_2": xi[1]}
    columns |= {"O2C_1": positions[:, 3], "O2C_2": positions[:, 4], "vertical_travel": positions[:, 5]}
    if with_rod:
        angles, closed = _lever_angles(_closure(matrix, positions, matrix[:, 6:9]))
        columns |= angles
        status = np.where(status == st.OK, closed, status)
    return _frame(columns | {"status": status}, index_of(table, len(matrix)))


def rods(table: Table, mode: Mode = "exact") -> pd.DataFrame:
    """Return all rods BC that give the cam lever a wanted swing, one row per rod; (11) of docs/heddle.md.

    Parameters
    ----------
    table : the columns of :func:`extremes` and ``O2B swing side_B``; ``swing`` is the magnitude [rad], below pi
    mode : as in :func:`extremes`

    Returns
    -------
    DataFrame
        ``rod`` (1, 2, ... by length), ``BC``, the angles ``lever_angle_1 lever_angle_2 lever_swing`` and ``status``,
        indexed like the table.  A row without any rod appears once, with nan and the status NOT_ADMISSIBLE.

    Raises
    ------
    InputError
        as :func:`extremes`, and for a swing of pi or more.
    """
    matrix = design_matrix(_RODS, table)[0]
    refuse_rows(matrix[:, 7] >= np.pi, matrix[:, 7], "swing", "an angle below pi")
    positions, status = _positions(matrix, mode)
    lengths, count = np.empty((len(matrix), 4)), np.empty(len(matrix), np.uint8)
    code = np.empty(len(matrix), np.uint8)
    kernels.heddle_rods(_closure(matrix, positions, matrix[:, 6:9]), lengths, count, code)
    code = np.where(status == st.OK, code, status)
    shown = np.maximum(count, 1).astype(np.int64)
    source = np.repeat(np.arange(len(matrix)), shown)
    number = np.arange(len(source)) - (np.cumsum(shown) - shown)[source]
    rod = lengths[source, number]
    lever = np.column_stack([matrix[source, 6], np.where(np.isnan(rod), 1.0, rod), matrix[source, 8]])
    angles, _ = _lever_angles(_closure(matrix[source], positions[source], lever))
    angles = {name: np.where(np.isnan(rod), np.nan, angle) for name, angle in angles.items()}
    columns = {"rod": number + 1, "BC": rod} | angles
    return _frame(columns | {"status": code[source]}, index_of(table, len(matrix))[source])


def shed(table: Table) -> pd.DataFrame:
    """Return the strokes of the shafts for a clear shed, proportional to their distance from the fell; (14).

    Parameters
    ----------
    table : ``shaft`` (its number, 1 next to the fell), ``d1`` (fell to shaft 1), ``t`` (between shafts), ``stroke`` of
        the shaft ``reference`` (4 if missing)

    Returns
    -------
    DataFrame
        ``stroke`` of every row's shaft, indexed like the table

    Raises
    ------
    InputError
        for a missing or misspelt column, a bad number.
    """
    number, d1, t, stroke, reference = design_matrix(_SHED, table)[0].T
    strokes = stroke * (d1 + (number - 1.0) * t) / (d1 + (reference - 1.0) * t)
    return _frame({"stroke": strokes}, index_of(table, len(strokes)))


def arms(table: Table) -> pd.DataFrame:
    """Return the arm O3D of every shaft for other lengths common to all shafts; (12), (13) of docs/heddle.md.

    Parameters
    ----------
    table : ``stroke O4E O4F O3O4`` [one length unit] and ``mu_3``, the common half swing of the bell crank [rad]

    Returns
    -------
    DataFrame
        ``O3D DF``, ``y_high`` and ``y_low`` of E against mid-stroke, ``asymmetry`` = y_high + y_low, and ``status``;
        NOT_ADMISSIBLE if no arm gives the stroke.  Indexed like the table.

    Raises
    ------
    InputError
        for a missing or misspelt column, a bad number, mu_3 of a right angle or more.
    """
    matrix = design_matrix(_ARMS, table)[0]
    refuse_rows(matrix[:, 4] >= 0.5 * np.pi, matrix[:, 4], "mu_3", "an angle below pi/2")
    results, status = np.empty((len(matrix), 4)), np.empty(len(matrix), np.uint8)
    kernels.heddle_shaft_arms(matrix, results, status)
    columns = dict(zip(("O3D", "DF", "y_high", "y_low"), results.T, strict=True))
    columns |= {"asymmetry": results[:, 2] + results[:, 3]}
    return _frame(columns | {"status": status}, index_of(table, len(matrix)))


def _frame(columns: Mapping[str, np.ndarray], index: pd.Index) -> pd.DataFrame:
    """Return columns with units: angles by their names, all others but number and status are lengths."""
    frame = pd.DataFrame(columns, index=index)
    units = {name: "rad" if name in ANGLES else "length" for name in columns if name != "status"}
    frame.attrs["units"] = units | ({"rod": "1"} if "rod" in columns else {})
    return frame


def _positions(matrix: Array, mode: Mode) -> tuple[Array, np.ndarray]:
    """Return the columns of the extreme positions for one of the two half angles, and their status."""
    if mode not in ("exact", "printed"):
        raise InputError("mode", mode, "exact or printed", "synthesis of a heddle drive")
    refuse_rows(matrix[:, 3] <= matrix[:, 2], matrix[:, 3], "O1O3", "a length above O1O2")
    both, status = np.empty((len(matrix), 12)), np.empty(len(matrix), np.uint8)
    kernels.heddle_extremes(np.ascontiguousarray(matrix[:, :6]), both, status)
    if mode == "exact":
        return both[:, :6], status
    return both[:, 6:], np.where(status == st.NOT_ASSEMBLED, st.OK, status).astype(np.uint8)


def _lever_angles(closure: Array) -> tuple[dict[str, Array], np.ndarray]:
    """Return the angles of the cam lever in both positions and its swing, and the status of the closure."""
    angles, status = np.empty((len(closure), 3)), np.empty(len(closure), np.uint8)
    kernels.heddle_lever_angles(closure, angles, status)
    return dict(zip(("lever_angle_1", "lever_angle_2", "lever_swing"), angles.T, strict=True)), status


def _closure(matrix: Array, positions: Array, lever: Array) -> Array:
    """Return rows for the kernels: O2O3, O3C, both angles xi, and the given lengths of the cam lever."""
    return np.column_stack([matrix[:, 3] - matrix[:, 2], matrix[:, 4], positions[:, 1], positions[:, 2], lever])
