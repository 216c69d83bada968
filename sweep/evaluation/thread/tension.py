"""Thread tension over contours, at speed, and by Euler's law; equation numbers of docs/thread.md."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from kernels.effects.thread import (
    CONTOUR_COLUMNS,
    SPEED_COLUMNS,
    contour_of_least_tension,
    thread_contour,
    thread_speed,
)
from kernels.effects.thread import capstan as capstan_kernel
from kernels.status import SINGULAR
from sweep.errors import InputError
from sweep.evaluation.tables import Table, numbers, refuse_rows
from sweep.evaluation.thread.rows import Sheet, columns_of, computed, frame, matrix_of, warn_outside
from sweep.families.base import Parameter
from sweep.families.machines import thread_balance

TENSION = Parameter("T1", "none", "tension in front of the contour, gf", not_negative=True)
ANGLE = Parameter("theta_deg", "none", "wrap angle, degrees", not_negative=True)
FITTED = (thread_balance.ALPHA, thread_balance.BETA, thread_balance.BENDING)

_CONTOUR = Sheet("contour", (TENSION, thread_balance.RADIUS, ANGLE, *thread_balance.CONTOUR_CONSTANTS))
_CONTOURS = Sheet("contours", (thread_balance.RADIUS, *thread_balance.CONTOUR_CONSTANTS))
_CONTOURS_WITH_ANGLES = Sheet("contours", (thread_balance.RADIUS, ANGLE, *thread_balance.CONTOUR_CONSTANTS))
_CONSTANTS = Sheet("constants", thread_balance.CONTOUR_CONSTANTS)
_SPEED = Sheet("speed", (Parameter("v", "none", "speed of the thread, m/s"), *thread_balance.SPEED_CONSTANTS))
_CAPSTAN = Sheet(
    "capstan",
    (
        Parameter("T1", "force", "tension in front of the eyelet", not_negative=True),
        Parameter("wrap", "angle", "wrap angle, rad", not_negative=True),
        Parameter("mu", "ratio", "coefficient of friction", not_negative=True),
    ),
)


def contour(table: Table) -> pd.DataFrame:
    """Return the tension of a thread after one contour, with its components; equations (1) to (3).

    Parameters
    ----------
    table : columns T1 [gf], R [mm], theta_deg [degrees]; constants alpha [gf/(mm deg)], beta [1/deg], B [gf mm^2],
        N [m/g], gamma [g/cm^3], by default those of the source

    Returns
    -------
    DataFrame
        T2 [gf] and its components capstan, bending, adhesion; r_thread [mm]; status: INVALID_INPUT where T2 is beyond
        float64

    Warns
    -----
    MeasuredRangeWarning
        where R is outside 0.125 to 7.5 mm and the reported constants are used

    Notes
    -----
    Measured against the 25-digit table: relative error at most 4e-16.

    Examples
    --------
    >>> import sweep
    >>> sweep.thread.contour({"T1": 5.0, "R": 1.0, "theta_deg": 90.0}).round(3)
           T2  capstan  bending  adhesion  r_thread  status
    0  15.667   13.701    1.008     0.959      0.11       0
    """
    given = columns_of(_CONTOUR, table)
    warn_outside(given["R"], thread_balance.MEASURED_RADIUS, FITTED, table)
    data = matrix_of(given, CONTOUR_COLUMNS)
    units = {"gf": "T2 capstan bending adhesion", "mm": "r_thread"}
    return computed(table, units, thread_contour, given["T1"][:, None], given["theta_deg"][:, None], data)


def path(T1: ArrayLike, contours: Table, theta_deg: ArrayLike | None = None) -> pd.DataFrame:
    """Return the tension along a thread over several contours in sequence, at one pose or at many.

    The tension after one contour is the tension in front of the next.

    Parameters
    ----------
    T1 : tension in front of the first contour [gf], a number or one per pose
    contours : one row per contour in the order of the thread: R [mm], theta_deg [degrees], constants as in `contour`
    theta_deg : wrap angles that change over the turn, (number of contours, poses); the column is not needed then

    Returns
    -------
    DataFrame
        one row per pose: T1 in front of the first contour, T2 after it, T3 after the second, and so on [gf]; status

    Raises
    ------
    InputError
        if the shapes of T1, theta_deg and contours do not match, or a value is negative or not a number

    Warns
    -----
    MeasuredRangeWarning
        as in `contour`

    Examples
    --------
    >>> import sweep
    >>> sweep.thread.path(5.0, {"R": [1.0, 0.5], "theta_deg": [90.0, 45.0]}).round(3)
        T1      T2     T3  status
    0  5.0  15.667  27.37       0
    """
    given = columns_of(_CONTOURS if theta_deg is not None else _CONTOURS_WITH_ANGLES, contours)
    warn_outside(given["R"], thread_balance.MEASURED_RADIUS, FITTED, contours)
    count = len(given["R"])
    angles = given["theta_deg"][:, None] if theta_deg is None else numbers(theta_deg, "theta_deg", "theta_deg")
    start = numbers(T1, "T1", "T1").reshape(-1)
    if angles.ndim != 2 or len(angles) != count:
        allowed = f"one row for each of the {count} contours"
        raise InputError("theta_deg", f"shape {angles.shape}", allowed, "theta_deg")
    if 1 not in (start.size, angles.shape[1]) and start.size != angles.shape[1]:
        raise InputError("T1", f"{start.size} values", f"one, or one per pose of theta_deg, {angles.shape[1]}", "T1")
    for name, values in (("T1", start), ("theta_deg", angles)):
        refuse_rows(~(np.isfinite(values) & (values >= 0.0)), values, name, "a finite number that is not negative")
    poses = max(start.size, angles.shape[1])
    tension = np.ascontiguousarray(np.broadcast_to(start, poses))[None]
    status = np.zeros((1, poses), np.uint8)
    data = matrix_of(given, CONTOUR_COLUMNS)
    columns = {"T1": tension[0]}
    for k in range(count):
        behind, angle = np.empty((1, poses)), np.ascontiguousarray(np.broadcast_to(angles[k], (1, poses)))
        thread_contour(tension, angle, data[k : k + 1], status, behind, None, None, None, None)
        tension = behind
        columns[f"T{k + 2}"] = behind[0]
    return frame({}, columns | {"status": status[0]}, {"gf": " ".join(columns)})


def least_tension_radius(table: Table) -> pd.DataFrame:
    """Radius of the contour with the least tension after it, for any wrap angle and tension; (4).

    Parameters
    ----------
    table : constants alpha, beta, B, N, gamma as in `contour`, all with defaults

    Returns
    -------
    DataFrame
        R_least [mm]: inf without adhesion, 0 where a sharp edge is optimal; r_thread [mm]; status: SINGULAR without
        bending and adhesion, where every radius is optimal

    Examples
    --------
    >>> import sweep
    >>> sweep.thread.least_tension_radius({"B": [10.0, 0.0]}).round(4)
       R_least  r_thread  status
    0   3.2009    0.1104       0
    1   0.0000    0.1104       0
    """
    given = columns_of(_CONSTANTS, table)
    n = len(given["alpha"])
    given["R"], zero = np.zeros(n), np.zeros((n, 1))
    data, radius = matrix_of(given, CONTOUR_COLUMNS), np.empty(n)
    contour_of_least_tension(data, radius)
    thread, status = np.empty((n, 1)), np.zeros((n, 1), np.uint8)
    thread_contour(zero, zero, data, status, None, None, None, None, thread)
    status[np.isnan(radius) & (status[:, 0] == 0)] = SINGULAR
    return frame(table, {"R_least": radius, "r_thread": thread, "status": status}, {"mm": "R_least r_thread"})


def speed(table: Table) -> pd.DataFrame:
    """Tension after the disc tensioner relative to its value at the reference speed, for a speed of the thread; (7).

    Parameters
    ----------
    table : column v [m/s], used by magnitude; constants v_ref [m/s], K, n, by default through the reported points

    Returns
    -------
    DataFrame
        ratio_to_ref; status

    Warns
    -----
    MeasuredRangeWarning
        where v is outside 0.08 to 7.4 m/s and the reported constants are used

    Notes
    -----
    Measured against the 25-digit table: relative error at most 3e-16.

    Examples
    --------
    >>> import sweep
    >>> sweep.thread.speed({"v": [1.0, 4.0]}).round(4)
       ratio_to_ref  status
    0        0.9848       0
    1        1.0989       0
    """
    given = columns_of(_SPEED, table)
    warn_outside(np.abs(given["v"]), thread_balance.MEASURED_SPEED, thread_balance.SPEED_CONSTANTS, table)
    data = matrix_of(given, SPEED_COLUMNS)
    return computed(table, {"1": "ratio_to_ref"}, thread_speed, given["v"][:, None], data)


def capstan(table: Table) -> pd.DataFrame:
    """Return the tension after an eyelet by Euler's law, and the force of the thread on the eyelet; (5), (6).

    Parameters
    ----------
    table : columns T1 [force], wrap [rad], mu

    Returns
    -------
    DataFrame
        T2 and force, in the unit of T1; status

    Examples
    --------
    >>> import sweep
    >>> sweep.thread.capstan({"T1": 5.0, "wrap": 1.0, "mu": 0.2}).round(4)
          T2   force  status
    0  6.107  5.4129       0
    """
    given = columns_of(_CAPSTAN, table)
    arguments = given["T1"][:, None], given["wrap"][:, None], given["mu"]
    return computed(table, {"force": "T2 force"}, capstan_kernel, *arguments)
