"""Tasks 1 and 2: crank-rockers through given positions, by the difference form of the closure, linear in the offset f.

Task 1 has given swing and phi0 and one or two intermediate positions.  Task 2 has two, with swing and phi0 free within
ranges.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kernels import synthesis as kernels
from sweep.errors import InputError
from sweep.families.base import Array
from sweep.synthesis.tasks.crank_rocker import (
    LocusTask,
    Number,
    acceleration,
    broadcast_columns,
    designs_on_locus,
    named,
    pressure_limit,
)
from sweep.synthesis.tasks.problem import Candidates, SynthesisTask, Unknown, ranges, turning

PLANAR = 1e-12  # |sin(alpha)| below which f has no influence
AT_LIMIT = 1e-6  # rad from a limit position, where (15) of docs/synthesis.md is 0 = 0 for every f


class Position(NamedTuple):
    """An intermediate position: crank and rocker angle from the extended position on [rad]."""

    dphi: float
    dpsi: float


def _between_limits(positions: tuple[Position, ...], limits: tuple[float, ...], task: str) -> None:
    """Refuse positions at the crank angle of a limit position: they say nothing, or contradict the swing."""
    for position in positions:
        if min(abs(np.sin(0.5 * (position.dphi - limit))) for limit in limits) < 0.5 * AT_LIMIT:
            raise InputError("positions", position, f"dphi other than at the limits, {limits}", task)


def through_positions(
    task: Task1 | Task2, swing: Number, phi0: Number, phi1: Array, g: Number, alpha: Number, f: float = 0.0
) -> Candidates:
    """Return crank-rockers on the locus whose f puts them through the first position, with residuals of the others.

    Equation (15) of docs/synthesis.md.  With sin(alpha) = 0 the closure does not contain f: the given f is used and
    the first position is a residual like the others.  Residuals are relative to the squared mean distance of the rocker
    ball from the crank axis.
    """
    points, e = np.empty((len(phi1), 4)), task.e
    kernels.rssr_points(broadcast_columns(swing, phi0, phi1, e, 0.0, g, alpha), points)
    x1, y1, rho1, rho2 = points.T  # of the ball, about the rocker axis

    def turned(angle: Number) -> tuple[Array, Array]:
        c, s = np.cos(angle), np.sin(angle)
        return x1 * c - y1 * s, x1 * s + y1 * c

    sa, ca = np.sin(alpha), np.cos(alpha)
    h = g * sa
    x2, y2 = turned(swing)
    rho_sum = rho1 + rho2
    a0, a1 = e * (x1 - x2) / rho_sum, -sa * (y1 - y2) / rho_sum
    moved = []
    for position in task.positions:
        x, y = turned(position.dpsi)
        angle = phi1 + position.dphi
        ahead = np.cos(angle) * (e + x) + np.sin(angle) * (ca * y - h) - rho1
        moved.append((e * (x - x1) - a0 * ahead, sa * (y - y1) + a1 * ahead))
    free = bool((np.abs(sa) > PLANAR).all())
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = moved[0][0] / moved[0][1] if free else np.full(len(phi1), f)
    offset = np.where(np.abs(offset) < 1e100, offset, np.nan)
    designs, psi1 = designs_on_locus(swing, phi0, phi1, e, offset, g, alpha)
    scale = (0.5 * rho_sum) ** 2
    residuals = {f"position {k}": (p - offset * q) / scale for k, (p, q) in enumerate(moved, 1) if k > free}
    limits = {"pressure angle": pressure_limit(designs, task.max_pressure_angle)}
    for k, p in enumerate(task.positions, 1):
        limits[f"branch at position {k}"] = _branch_slack(designs, psi1 + p.dpsi, phi1 + p.dphi)
    return Candidates(residuals, limits, acceleration(designs), named(designs))


def _branch_slack(designs: Array, psi: Array, phi: Array) -> Array:
    """Return the cosine of the pressure angle at a position, positive if it lies on the design's own branch."""
    a, b, _, e, f, _, alpha, branch = designs.T
    x, y = e - a * np.cos(phi), f * np.sin(alpha) + a * np.cos(alpha) * np.sin(phi)
    slack: Array = -branch * (x * np.sin(psi) + y * np.cos(psi)) / b
    return slack


@dataclass(frozen=True)
class Task1(LocusTask):
    """The unknowns are phi1 and f.  The first position gives f, in which it is linear, a second an equation for phi1.

    Parameters
    ----------
    swing, phi0, e, g, alpha : as `EngineeringMethod`
    positions : one or two intermediate positions, from the extended one on; planar mechanisms (alpha = 0) can take
        one, and it determines phi1
    f : offset of the crank plane if alpha = 0, otherwise it is found

    Raises
    ------
    InputError
        for no position, more than the mechanism can take, or one at a limit.
    """

    positions: tuple[Position, ...]
    f: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        room = 2 if abs(np.sin(self.alpha)) > PLANAR else 1
        if not 1 <= len(self.positions) <= room:
            raise InputError("positions", len(self.positions), f"1 to {room}", "Task1")
        _between_limits(self.positions, (0.0, self.phi0), "Task1")

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """The place on the locus."""
        return (turning("phi1"),)

    def candidates(self, x: Mapping[str, Array]) -> Candidates:
        """Compute equations, limits, curve and mechanisms of candidates from their unknowns, (n,) each."""
        return through_positions(self, self.swing, self.phi0, x["phi1"], self.g, self.alpha, self.f)


@dataclass(frozen=True)
class Task2(SynthesisTask):
    """The unknowns are swing, phi0, phi1 and f; closure at the two positions and at both limits are the equations.

    The limits hold by the locus, the first position by f, the second one remains as an equation; the two remaining
    degrees of freedom, four with g and alpha, serve the objective.  Only ratios of lengths matter: e sets the scale.

    Parameters
    ----------
    swing_range, phi0_range : ranges of swing (one sign) and phi0 [rad]
    e, g, alpha : position of the rocker axis and of the rocker's plane on it [length, rad]; sin(alpha) not 0
    positions : two intermediate positions, from the extended one on
    g_range, alpha_range : ranges of g and alpha, if they are unknown as well

    Raises
    ------
    InputError
        for a planar mechanism, whose closure does not contain f, another number of positions, or one at the extended
        limit.
    """

    swing_range: tuple[float, float]
    phi0_range: tuple[float, float]
    e: float
    g: float
    alpha: float
    positions: tuple[Position, Position]
    g_range: tuple[float, float] | None = None
    alpha_range: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        alphas = (self.alpha,) if self.alpha_range is None else self.alpha_range
        if min(abs(np.sin(alpha)) for alpha in alphas) <= PLANAR or np.ptp(np.sign(np.sin(alphas))):
            raise InputError("alpha", alphas, "angles whose sines are not 0", "Task2")
        if len(self.positions) != 2:
            raise InputError("positions", len(self.positions), "2", "Task2")
        _between_limits(self.positions, (0.0,), "Task2")

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Swing, phi0 and phi1, and g and alpha if they are free."""
        return (*ranges(self, "swing", "phi0"), turning("phi1"), *ranges(self, "g", "alpha"))

    def candidates(self, x: Mapping[str, Array]) -> Candidates:
        """Compute equations, limits, curve and mechanisms of candidates from their unknowns, (n,) each."""
        g, alpha = x.get("g", self.g), x.get("alpha", self.alpha)
        return through_positions(self, x["swing"], x["phi0"], x["phi1"], g, alpha)
