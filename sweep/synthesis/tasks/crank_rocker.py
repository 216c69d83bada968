"""The first stage of every task: crank-rockers on their locus, their motion over a turn and at single positions.

What tasks are given is checked when a task is made: every number in its range, every choice among its words.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from kernels import synthesis as kernels
from kernels.types import TWO_PI
from sweep.errors import InputError, choices
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Angles, Array, Columns

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Rule: TypeAlias = tuple[str, Callable[[Any], bool]]

_NUMBER: Rule = ("a finite number", math.isfinite)
_SIGN: Rule = ("+1 or -1", lambda x: x in (1, -1))
_POSITIVE: Rule = ("a positive number", lambda x: 0.0 < x < math.inf)
_TURN: Rule = ("an angle between 0 and 2 pi", lambda x: 0.0 < x < TWO_PI)
_PLACES: Rule = ("finite numbers", lambda x: bool(np.isfinite(np.asarray(x, np.float64)).all()))
_RANGE: Rule = ("two finite numbers, the lower one first", lambda x: -math.inf < x[0] <= x[1] < math.inf)
_LENGTHS: Rule = ("two positive numbers, the lower one first", lambda x: 0.0 < x[0] <= x[1] < math.inf)
RULES: dict[str, Rule] = {
    "swing": ("an angle between 0 and 2 pi, or its negative", lambda x: 0.0 < abs(x) < TWO_PI),
    "phi0": _TURN,
    "max_pressure_angle": ("an angle between 0 and pi/2", lambda x: 0.0 < x <= 0.5 * math.pi),
    "objective": ("acceleration or pressure_angle", lambda x: x in ("acceleration", "pressure_angle")),
    "limit": ("extended or folded", lambda x: x in ("extended", "folded")),
    "adjusted": ("a, b, c, e, f or g", lambda x: x in tuple("abcefg")),
    "swing_range": (
        "two angles of one sign below 2 pi, the lower one first",
        lambda x: -TWO_PI < x[0] <= x[1] < TWO_PI and x[0] * x[1] > 0.0,
    ),
    "phi0_range": ("two angles between 0 and 2 pi, the lower one first", lambda x: 0.0 < x[0] <= x[1] < TWO_PI),
    "ratio_range": (
        "two positive numbers on one side of 1, the lower one first",
        lambda x: 0.0 < x[0] <= x[1] < math.inf and (x[0] - 1.0) * (x[1] - 1.0) > 0.0,
    ),
    "rho0": ("a length, positive or negative, not zero", lambda x: 0.0 < abs(x) < math.inf),
    "dwell": _TURN,
    "tolerance": _POSITIVE,
    "bounds": (
        "two finite numbers for every name, the lower one first",
        lambda x: all(-math.inf < low < high < math.inf for low, high in x.values()),
    ),
    **dict.fromkeys(("e", "f", "g", "alpha", "f2", "alpha2", "f2_ratio", "stroke"), _NUMBER),
    **dict.fromkeys(("start_acceleration", "end_acceleration", "start_direction", "end_direction"), _NUMBER),
    **dict.fromkeys(("kappa", "branch"), _SIGN),
    **dict.fromkeys(("f_range", "g_range", "alpha_range", "adjusted_range", "offset_range"), _RANGE),
    **dict.fromkeys(("size_range", "coupler_range"), _LENGTHS),
    **dict.fromkeys(("positions", "start", "end"), _PLACES),
}


def check_given(task: DataclassInstance) -> None:
    """Check every field of a task that is given and has a rule; None is "not given".

    Raises
    ------
    InputError
        for the first field out of its range.
    """
    for entry in fields(task):
        value = getattr(task, entry.name) if entry.init and entry.name in RULES else None
        if value is None:
            continue
        allowed, holds = RULES[entry.name]
        if not holds(value):
            shown = dict(value) if isinstance(value, Mapping) else value
            raise InputError(entry.name, shown, allowed, type(task).__name__)


POSES = 180
RSSR = family("rssr")
_EXACT = Accuracy(target=1e-10)


@lru_cache(maxsize=8)
def turn(poses: int = POSES) -> Angles:
    """Equidistant crank angles of one turn, (1, poses)."""
    phi: Array = np.arange(poses, dtype=np.float64)[None, :] * (2.0 * np.pi / poses)
    return Angles.of(phi)


def designs_on_locus(
    swing: Array, phi0: Array, phi1: Array, e: Array, f: Array, g: Array, alpha: Array
) -> tuple[Array, Array]:
    """Design matrix (n, 8) and rocker angle psi1 (n,) of the extended position; nan where a test (i)-(iii) fails."""
    columns = np.broadcast_arrays(swing, phi0, phi1, e, f, g, alpha)
    requirements = np.column_stack(columns).astype(np.float64)
    n = len(requirements)
    designs, psi1 = np.empty((n, 8)), np.empty(n)
    kernels.rssr_on_locus(requirements, np.empty(n, np.uint8), np.empty(n, np.uint8), designs, psi1)
    return designs, psi1


@dataclass(frozen=True)
class LocusPoint:
    """Points of the locus before f, a, b are chosen, (n,) each: ball X, Y about the rocker axis and rho1, rho2."""

    x: Array
    y: Array
    rho1: Array
    rho2: Array

    @classmethod
    def of(cls, swing: Array, phi0: Array, phi1: Array, e: float, g: float | Array, alpha: float | Array) -> LocusPoint:
        """Return the points at crank angles phi1."""
        columns = np.broadcast_arrays(swing, phi0, phi1, e, 0.0, g, alpha)
        requirements = np.column_stack(columns).astype(np.float64)
        points = np.empty((len(requirements), 4))
        kernels.rssr_points(requirements, points)
        return cls(*points.T)

    def turned(self, angle: Array) -> tuple[Array, Array]:
        """Return X, Y after the rocker has turned by the angle."""
        c, s = np.cos(angle), np.sin(angle)
        return self.x * c - self.y * s, self.x * s + self.y * c


def motion(designs: Array, angles: Angles, *wanted: str) -> Columns:
    """Pose outputs of crank-rockers, nan where there is no mechanism."""
    return RSSR.poses(designs, angles, frozenset(wanted))


def least_cos2(designs: Array) -> Array:
    """Smallest cos^2 of the pressure angle over the turn, exact; nan where there is no mechanism."""
    whole = np.full(len(designs), np.nan)
    alive = np.isfinite(designs).all(axis=1)
    found = design_outputs(RSSR, designs[alive], ["margin"], _EXACT)
    whole[alive] = found["margin"]
    return whole


def pressure_limit(designs: Array, largest: float) -> Array:
    """Slack of the limit on the pressure angle, cos^2 - cos^2[largest]; pi/2 asks for a full turn only."""
    slack: Array = least_cos2(designs) - np.cos(largest) ** 2
    return slack


def named(designs: Array, suffix: str = "") -> dict[str, Array]:
    """Design matrix as columns."""
    return {f"{name}{suffix}": column for name, column in zip(RSSR.parameter_names, designs.T, strict=True)}


Bounds = Mapping[str, tuple[float, float]]


def size_limits(columns: Mapping[str, Array], bounds: Bounds) -> list[Array]:
    """Slacks of the bounds on lengths, lower then upper each, in units of the range.

    Raises
    ------
    InputError
        for a name that is not among what is found.
    """
    slacks = []
    for name, (low, high) in bounds.items():
        if name not in columns:
            raise InputError("bounds", name, choices(name, columns), "task")
        slacks += [(columns[name] - low) / (high - low), (high - columns[name]) / (high - low)]
    return slacks


def size_names(bounds: Bounds) -> tuple[str, ...]:
    """Return names of the limits of `size_limits`."""
    return tuple(f"{name} {side}" for name in bounds for side in ("not below", "not above"))
