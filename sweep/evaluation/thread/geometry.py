"""Wrap angle and length of the thread over eyelets and cams; equation numbers of docs/takeup.md."""

from __future__ import annotations

import numpy as np
import pandas as pd

from kernels.effects.thread import guide_line, thread_over_point
from kernels.families import eyelet as eyelet_kernels
from kernels.families import free_cam as free_cam_kernels
from kernels.families import guided_cam as guided_cam_kernels
from kernels.status import OK, SINGULAR
from sweep.evaluation.tables import Table
from sweep.evaluation.thread.rows import Sheet, columns_of, computed, frame, matrix_of
from sweep.families.base import Array, Parameter
from sweep.families.eyelet import PARAMETERS as EYELET_PARAMETERS
from sweep.families.free_cam import PARAMETERS as FREE_CAM_PARAMETERS


def _lengths(names: str, text: str, default: float | None = None) -> tuple[Parameter, ...]:
    return tuple(Parameter(name, "length", f"{text} {name}", default=default) for name in names.split())


GUIDES = ("X1", "Y1", "Z1", "X2", "Y2", "Z2")
POINT = ("X_E", "Y_E", "Z_E")
FIRST = ("dX_E", "dY_E", "dZ_E")
SECOND = ("d2X_E", "d2Y_E", "d2Z_E")
_POINTS = (*_lengths(" ".join(GUIDES), "coordinate of a guide"), *_lengths(" ".join(POINT), "coordinate of the eyelet"))
_RATES = (
    *_lengths(" ".join(FIRST), "derivative of the eyelet's coordinate", 0.0),
    *_lengths(" ".join(SECOND), "second derivative of the eyelet's coordinate", 0.0),
)
_WRAP, _FEED = Sheet("wrap", _POINTS), Sheet("feed", (*_POINTS, *_RATES))
_EYELET = Sheet(
    "eyelet",
    (
        *EYELET_PARAMETERS[:8],
        Parameter("phi", "angle", "crank angle"),
        Parameter("P", "length", "wanted P", default=0.0),
    ),
)
_FOLLOWER = Sheet(
    "follower",
    (
        Parameter("L", "length", "length of the thread between the guides", positive=True),
        *_lengths("dL d2L", "derivative of the length:", 0.0),
        *_lengths("Z1 e X1", "place of the guides:"),
        Parameter("mu1", "ratio", "coefficient of friction on the cam", default=0.0, not_negative=True),
        Parameter("mu2", "ratio", "coefficient of friction in the guide", default=0.0, not_negative=True),
    ),
)
_FREE_CAM = Sheet(
    "free_cam",
    (
        *FREE_CAM_PARAMETERS[:7],
        Parameter("phi", "angle", "cam angle"),
        Parameter("mu", "ratio", "coefficient of friction along the edge", default=0.0, not_negative=True),
        Parameter("tension_ratio", "ratio", "T2/T1", default=1.0, positive=True),
        Parameter("mu_thread", "ratio", "coefficient of friction along the thread", default=0.0, not_negative=True),
    ),
)


def wrap(table: Table) -> pd.DataFrame:
    """Wrap angle at an eyelet E between two guides, thread length, and the coordinates of (26) of the source; (1).

    Parameters
    ----------
    table : columns X1 Y1 Z1 and X2 Y2 Z2 of the guides, X_E Y_E Z_E of the eyelet [length]

    Returns
    -------
    DataFrame
        L; wrap [rad], 0 for a straight thread; x, distance of the eyelet from the line of the guides; y, its place
        along the line from the middle of the guides; half_distance_c of the guides; status: SINGULAR where the eyelet
        is at a guide, or where both guides coincide, so that x and y are undefined (L and wrap are not)

    Examples
    --------
    >>> import sweep
    >>> guides = {"X1": 0.0, "Y1": 0.0, "Z1": 0.0, "X2": 4.0, "Y2": 0.0, "Z2": 0.0}
    >>> sweep.thread.wrap(guides | {"X_E": 2.0, "Y_E": 2.0, "Z_E": 0.0})[["L", "wrap", "status"]].round(4)
            L    wrap  status
    0  5.6569  1.5708       0
    """
    given = columns_of(_WRAP, table)
    guides, place = matrix_of(given, GUIDES), matrix_of(given, POINT)
    n = len(place)
    status, (total, angle) = np.zeros((n, 1), np.uint8), (np.empty((n, 1)) for _ in range(2))
    thread_over_point(guides, place[:, None], None, None, status, total, None, None, angle)
    off, along, half = (np.empty(n) for _ in range(3))
    guide_line(guides, place, off, along, half)
    status[np.isnan(off) & (status[:, 0] == OK)] = SINGULAR
    columns = {"L": total, "wrap": angle, "x": off, "y": along, "half_distance_c": half}
    return frame(table, columns | {"status": status}, {"length": "L x y half_distance_c", "rad": "wrap"})


def feed(table: Table) -> pd.DataFrame:
    """Length of the thread over a point of any link, and its derivatives from those of the point; (2) to (4).

    Parameters
    ----------
    table : columns X1 Y1 Z1 and X2 Y2 Z2 of the guides, X_E Y_E Z_E of the point, its derivatives with respect to the
        crank angle dX_E ... dZ_E, d2X_E ... d2Z_E (0 by default) [length]

    Returns
    -------
    DataFrame
        L, dL_dphi, d2L_dphi2 [length]; wrap [rad]; status: SINGULAR where the point is at a guide

    Examples
    --------
    >>> import sweep
    >>> guides = {"X1": 0.0, "Y1": 0.0, "Z1": 0.0, "X2": 4.0, "Y2": 0.0, "Z2": 0.0}
    >>> found = sweep.thread.feed(guides | {"X_E": 2.0, "Y_E": 2.0, "Z_E": 0.0, "dY_E": 1.0})
    >>> found[["L", "dL_dphi", "status"]].round(4)
            L  dL_dphi  status
    0  5.6569   1.4142       0
    """
    given = columns_of(_FEED, table)
    guides = matrix_of(given, GUIDES)
    place, first, second = (matrix_of(given, names)[:, None] for names in (POINT, FIRST, SECOND))
    units = {"length": "L dL_dphi d2L_dphi2", "rad": "wrap"}
    return computed(table, units, thread_over_point, guides, place, first, second)


def eyelet(table: Table) -> pd.DataFrame:
    """Eyelet on a crank against a wanted P: motion, thread, weighted difference (27) of the source; (5) to (8).

    Parameters
    ----------
    table : columns a e f alpha Z1 Z2 phi_h P_h of the family `eyelet`, phi [rad], P wanted there (0 by default)

    Returns
    -------
    DataFrame
        X_E Y_E Z_E, L, dL_dphi, d2L_dphi2 [length]; wrap [rad]; length_error = P_h + P - L; dq [length^2] and weight
        [length], with dq = weight * length_error to first order; status: INVALID_INPUT where P_h + P <= 0

    Examples
    --------
    >>> import sweep
    >>> crank = {"a": 2.0, "e": 3.0, "f": 1.0, "alpha": 0.5, "Z1": -3.0, "Z2": 4.0, "phi_h": 0.0, "P_h": 8.0}
    >>> sweep.thread.eyelet(crank | {"phi": [0.0, 1.0]})[["X_E", "Y_E", "Z_E", "L", "wrap"]].round(4)
          X_E     Y_E     Z_E       L    wrap
    0  2.0000  0.4794  0.8776  7.3466  0.6198
    1  1.0806  1.9563  0.0707  8.9066  1.3377
    """
    given = columns_of(_EYELET, table)
    parameters = matrix_of(given, ("a", "e", "f", "alpha", "Z1", "Z2", "phi_h", "P_h"))
    n = len(parameters)
    designs = np.hstack([parameters, np.zeros((n, 4))])
    cos, sin = np.cos(given["phi"])[:, None], np.sin(given["phi"])[:, None]
    status, judged = np.empty((n, 1), np.uint8), np.empty((n, 1), np.uint8)
    names = ("dL_dphi", "d2L_dphi2", "L", "wrap", *POINT)
    columns: dict[str, Array] = {name: np.empty((n, 1)) for name in names}
    eyelet_kernels.poses(designs, cos, sin, status, eyelet_kernels.Outputs(None, *columns.values()))
    difference, weight = np.empty((n, 1)), np.empty((n, 1))
    eyelet_kernels.weighted_difference(designs, cos, sin, given["P"][:, None], difference, weight, judged)
    columns |= {"length_error": (given["P_h"] + given["P"])[:, None] - columns["L"], "dq": difference, "weight": weight}
    lengths = "dL_dphi d2L_dphi2 L X_E Y_E Z_E length_error weight"
    units = {"length": lengths, "rad": "wrap", "length^2": "dq"}
    return frame(table, columns | {"status": np.where(status == OK, judged, status)}, units)


def follower(table: Table) -> pd.DataFrame:
    """Follower of a guided cam from the length of the thread, and the pressure angle at which it jams; (10) to (14).

    Parameters
    ----------
    table : columns L, dL, d2L of the thread, Z1 e X1 of the guides [length]; mu1, mu2 (0 by default)

    Returns
    -------
    DataFrame
        S, dS, d2S [length]; theta_jam [rad], negative where the follower jams at every angle; tan_half_theta_jam;
        status: NOT_ASSEMBLED where the thread is too short, DEAD_POINT where S = 0

    Examples
    --------
    >>> import sweep
    >>> sweep.thread.follower({"L": 11.0, "dL": 1.0, "Z1": 3.0, "e": 4.0, "X1": 0.0})[["S", "dS", "status"]].round(4)
            S      dS  status
    0  2.2913  1.2002       0
    """
    given = columns_of(_FOLLOWER, table)
    data = matrix_of(given, ("L", "dL", "d2L", "Z1", "e", "X1"))
    n = len(data)
    status, out = np.empty(n, np.uint8), [np.empty(n) for _ in range(5)]
    guided_cam_kernels.follower(data, status, *out[:3])
    guided_cam_kernels.jam_angles(matrix_of(given, ("mu1", "mu2")), out[3], out[4])
    names = ("S", "dS", "d2S", "theta_jam", "tan_half_theta_jam")
    units = {"length": "S dS d2S", "rad": "theta_jam", "1": "tan_half_theta_jam"}
    return frame(table, dict(zip(names, out, strict=True)) | {"status": status}, units)


def free_cam(table: Table) -> pd.DataFrame:
    """Thread over the bare edge of a turning cam: contact without friction, and the limit points of sticking.

    Equations (18) to (25).

    Parameters
    ----------
    table : columns a [1/length], phi [rad], X1 Y1 Z1, X2 Y2 Z2 of the guides [length]; mu along the edge, tension_ratio
        T2/T1 and mu_thread along the thread, by which the ratio becomes tension_ratio e^(mu_thread wrap)

    Returns
    -------
    DataFrame
        y_contact, X, Y, L [length]; wrap [rad]; contact, 1 on the edge; n_minima of the length along the edge;
        y_limit_plus, y_limit_minus, where the resultant leans by the angle of friction towards growing and falling y,
        nearest to the shortest thread; status: INVALID_INPUT where both guides are on one side, NOT_CONVERGED where a
        limit point lies far outside

    Examples
    --------
    >>> import sweep
    >>> cam = {"a": 0.4, "X1": 0.83, "Y1": -2.08, "Z1": -3.56, "X2": 3.3, "Y2": -0.85, "Z2": 3.7}
    >>> sweep.thread.free_cam(cam | {"phi": 5.0})[["L", "wrap", "contact", "status"]].round(4)
            L    wrap  contact  status
    0  7.8488  0.2897      1.0       0
    """
    given = columns_of(_FREE_CAM, table)
    n = len(given["a"])
    designs = np.hstack([matrix_of(given, ("a", *GUIDES)), np.zeros((n, 1))])
    cos, sin = np.cos(given["phi"])[:, None], np.sin(given["phi"])[:, None]
    status, judged = np.empty((n, 1), np.uint8), np.empty((n, 1), np.uint8)
    names = ("L", "wrap", "y_contact", "X", "Y", "contact", "n_minima")
    columns: dict[str, Array] = {name: np.empty((n, 1)) for name in names}
    free_cam_kernels.poses(designs, cos, sin, status, free_cam_kernels.Outputs(None, None, None, *columns.values()))
    friction = matrix_of(given, ("tension_ratio", "mu_thread", "mu"))
    limits: dict[str, Array] = {name: np.empty((n, 1)) for name in ("y_limit_plus", "y_limit_minus")}
    free_cam_kernels.limit_points(designs, friction, cos, sin, judged, *limits.values())
    units = {"length": "L y_contact X Y y_limit_plus y_limit_minus", "rad": "wrap", "1": "contact n_minima"}
    return frame(table, columns | limits | {"status": np.where(status == OK, judged, status)}, units)
