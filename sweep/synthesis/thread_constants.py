"""Constants of a thread from measured tensions: least squares with confidence intervals; docs/thread.md, section 5."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sweep.errors import InputError
from sweep.evaluation.tables import Table
from sweep.evaluation.thread.rows import Sheet, columns_of
from sweep.families.base import Array, Parameter
from sweep.families.machines.thread_balance import ALPHA, BENDING, BETA, COUNT, DENSITY, RADIUS, REFERENCE_SPEED

CONTOUR = ("alpha", "beta", "B")
SPEED = ("K", "n")
# Relative singular value of the scaled Jacobian below which the measurements do not determine the constants.  Tensions
# are measured to some per cent, never to a millionth.
LEAST_RANK = 1e-6

_MEASURED = Sheet(
    "measured tensions",
    (
        Parameter("T1", "none", "tension in front of the contour, gf", positive=True),
        Parameter("T2", "none", "tension behind the contour, gf", positive=True),
        RADIUS,
        Parameter("theta_deg", "none", "wrap angle, degrees", positive=True),
        COUNT,
        DENSITY,
    ),
)
_SPEEDS = Sheet(
    "measured speed ratios",
    (
        Parameter("v", "none", "speed of the thread, m/s", positive=True),
        Parameter("ratio_to_ref", "none", "tension over its value at the reference speed", positive=True),
        REFERENCE_SPEED,
    ),
)


@dataclass(frozen=True)
class ConstantsFit:
    """Constants fitted to measurements, with their confidence intervals.

    ``constants`` has a row per constant: value, standard_error, low and high of its confidence interval at
    ``confidence``.  ``residual`` is the root mean square of the relative errors of the fit.  ``undetermined`` names
    the constants that the measurements do not determine: their intervals are infinite.
    """

    constants: pd.DataFrame
    residual: float
    confidence: float
    undetermined: tuple[str, ...]

    @property
    def values(self) -> dict[str, float]:
        """Constants by name, as columns for `sweep.thread.contour` or `sweep.thread.speed`."""
        return {str(name): float(x) for name, x in self.constants["value"].items()}


def fit_contour(table: Table, confidence: float = 0.95) -> ConstantsFit:
    """Find alpha, beta and B from measured pairs of tensions over contours of several radii or wrap angles.

    Parameters
    ----------
    table : columns T1, T2 [gf], R [mm], theta_deg [degrees]; N and gamma of the thread as in `sweep.thread.contour`
    confidence : confidence level of the intervals

    Returns
    -------
    ConstantsFit
        Relative errors of T2 are minimised, with no constant below 0.

    Raises
    ------
    InputError
        for a bad table, or fewer measurements than constants.
    """
    from scipy.special import exprel, hyp1f1

    given = columns_of(_MEASURED, table)
    t1, t2, radius, theta = (given[name] for name in ("T1", "T2", "R", "theta_deg"))
    pressed = 1.0 / (radius + 1.0 / np.sqrt(np.pi * given["gamma"] * given["N"])) ** 2

    def law(x: Array) -> Array:
        alpha, beta, b = x
        power = beta * theta
        model: Array = t1 * np.exp(power) + b * pressed * np.expm1(power) + alpha * radius * theta * exprel(power)
        return model / t2 - 1.0

    def slopes(x: Array) -> Array:
        alpha, beta, b = x
        power = beta * theta
        rise = theta * np.exp(power)
        growth_slope = 0.5 * hyp1f1(2.0, 3.0, power)  # the derivative of exprel, (e^x - 1)/x
        by_beta = t1 * rise + b * pressed * rise + alpha * radius * theta * theta * growth_slope
        columns = (radius * theta * exprel(power), by_beta, pressed * np.expm1(power))
        return np.column_stack([column / t2 for column in columns])

    start = np.array([float(p.default or 0.0) for p in (ALPHA, BETA, BENDING)])
    return _fitted(CONTOUR, law, slopes, start, len(t1), np.full(3, np.inf), confidence)


def fit_speed(table: Table, confidence: float = 0.95) -> ConstantsFit:
    """Find K and n of the law of speed from measured ratios of tensions.

    Parameters
    ----------
    table : columns v [m/s], ratio_to_ref, v_ref [m/s] (1.23 by default)
    confidence : confidence level of the intervals

    Returns
    -------
    ConstantsFit
        K between 0 and 1, n positive.

    Raises
    ------
    InputError
        for a bad table, or fewer measurements than constants.
    """
    given = columns_of(_SPEEDS, table)
    relative, measured = np.log(given["v"] / given["v_ref"]), given["ratio_to_ref"]

    def law(x: Array) -> Array:
        residual: Array = (1.0 + x[0] * np.expm1(x[1] * relative)) / measured - 1.0
        return residual

    def slopes(x: Array) -> Array:
        power = np.exp(x[1] * relative)
        return np.column_stack([np.expm1(x[1] * relative) / measured, x[0] * relative * power / measured])

    return _fitted(SPEED, law, slopes, np.array([0.4, 0.2]), len(measured), np.array([1.0, np.inf]), confidence)


def _fitted(
    names: tuple[str, ...], law: Callable[[Array], Array], slopes: Callable[[Array], Array], start: Array, count: int,
    most: Array, confidence: float,
) -> ConstantsFit:  # fmt: skip
    from scipy.optimize import least_squares
    from scipy.stats import t as student

    if count < len(names):
        raise InputError("table", f"{count} rows", f"at least {len(names)}, one per constant", "measurements")
    if not 0.0 < confidence < 1.0:
        raise InputError("confidence", confidence, "a number between 0 and 1", "measurements")
    result = least_squares(law, start, slopes, bounds=(0.0, most), x_scale=start, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    values, free = result.x, count - len(names)
    scaled = slopes(values) * start
    _, singular_values, directions = np.linalg.svd(scaled, full_matrices=False)
    weak = singular_values <= LEAST_RANK * singular_values[0]
    # A constant with a component in a weak direction is not determined.
    undetermined = (np.abs(directions[weak]) > 1e-3).any(axis=0) if weak.any() else np.zeros(len(names), np.bool_)
    square = float(result.fun @ result.fun)
    variance = square / free if free > 0 else np.nan
    spread = np.sqrt(variance * ((directions[~weak].T / singular_values[~weak]) ** 2).sum(axis=1)) * start
    spread = np.where(undetermined, np.inf, spread)
    half_width = float(student.ppf(0.5 + 0.5 * confidence, free)) * spread if free > 0 else np.full(len(names), np.inf)
    columns = {"value": values, "standard_error": spread, "low": values - half_width, "high": values + half_width}
    return ConstantsFit(
        pd.DataFrame(columns, index=pd.Index(names, name="constant")),
        float(np.sqrt(square / count)),
        confidence,
        tuple(name for name, gone in zip(names, undetermined, strict=True) if gone),
    )
