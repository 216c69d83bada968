"""The first stage of every task: crank-rockers on their locus, their motion over a turn and at single positions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from kernels import synthesis as kernels
from sweep.errors import InputError, choices
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Angles, Array, Columns

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
