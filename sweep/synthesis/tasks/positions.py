"""Tasks 1 and 2: crank-rockers through given positions, by the difference form of the closure, linear in the offset f.

Task 1 has given swing and phi0 and passes one or two intermediate positions.  Task 2 passes two, with swing and phi0
free within ranges.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from sweep.errors import InputError
from sweep.families.base import Array
from sweep.synthesis.tasks.crank_rocker import (
    LocusPoint,
    check_given,
    designs_on_locus,
    motion,
    named,
    pressure_limit,
    size_limits,
    size_names,
    turn,
)
from sweep.synthesis.tasks.problem import Candidates, Unknown, stacked

PLANAR = 1e-12  # |sin(alpha)| below which f has no influence


class Position(NamedTuple):
    """An intermediate position: crank and rocker angle from the extended position on [rad]."""

    dphi: float
    dpsi: float


def equation_names(alpha: float, count: int) -> tuple[str, ...]:
    """Which positions remain as equations: f takes the first one, unless sin(alpha) = 0."""
    first = 2 if abs(np.sin(alpha)) > PLANAR else 1
    return tuple(f"position {k}" for k in range(first, count + 1))


class Through(NamedTuple):
    """Crank-rockers (n, 8) through positions: residuals (n, k) of their closure and slacks (n, k) of their branch."""

    designs: Array
    residuals: Array
    slacks: Array


def through_positions(
    swing: Array,
    phi0: Array,
    phi1: Array,
    e: float,
    g: float | Array,
    alpha: float | Array,
    positions: tuple[Position, ...],
    f: float,
) -> Through:
    """Crank-rockers on the locus whose f makes them pass the first position exactly, and how they miss the others.

    Equation (15) of docs/synthesis.md.  With sin(alpha) = 0 the closure does not contain f: the given f is taken and
    the first position is a residual like the others.  Residuals are in squared mean distances of the rocker ball from
    the crank axis.
    """
    point = LocusPoint.of(swing, phi0, phi1, e, g, alpha)
    sa, ca = np.sin(alpha), np.cos(alpha)
    h = g * sa
    x2, y2 = point.turned(swing)
    both = point.rho1 + point.rho2
    a0, a1 = e * (point.x - x2) / both, -sa * (point.y - y2) / both
    moved = []
    for position in positions:
        x, y = point.turned(np.full(len(phi1), position.dpsi))
        angle = phi1 + position.dphi
        ahead = np.cos(angle) * (e + x) + np.sin(angle) * (ca * y - h) - point.rho1
        moved.append((e * (x - point.x) - a0 * ahead, sa * (y - point.y) + a1 * ahead))
    free = bool((np.abs(sa) > PLANAR).all())
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = moved[0][0] / moved[0][1] if free else np.full(len(phi1), f)
    offset = np.where(np.abs(offset) < 1e100, offset, np.nan)
    ones = np.ones(len(phi1))
    designs, psi1 = designs_on_locus(swing, phi0, phi1, e * ones, offset, g * ones, alpha * ones)
    scale = (0.5 * both) ** 2
    residuals = stacked(len(phi1), [(p - offset * q) / scale for p, q in moved[1 if free else 0 :]])
    slacks = np.column_stack([_branch_slack(designs, psi1 + p.dpsi, phi1 + p.dphi) for p in positions])
    return Through(designs, residuals, slacks)


def _branch_slack(designs: Array, psi: Array, phi: Array) -> Array:
    """Cosine of the pressure angle at a position, positive if it lies on the design's own branch."""
    a, b, _, e, f, _, alpha, branch = designs.T
    x, y = e - a * np.cos(phi), f * np.sin(alpha) + a * np.cos(alpha) * np.sin(phi)
    slack: Array = -branch * (x * np.sin(psi) + y * np.cos(psi)) / b
    return slack


@dataclass(frozen=True)
class Task1:
    """The unknowns are phi1 and f.  The first position gives f, in which it is linear, a second an equation for phi1.

    Parameters
    ----------
    swing, phi0, e, g, alpha : as `EngineeringMethod`
    positions : one or two intermediate positions, from the extended one on; planar mechanisms (alpha = 0) have room
        for one, and it fixes phi1
    f : offset of the crank plane where alpha = 0, elsewhere it is found
    max_pressure_angle : limit over the whole turn [rad]; pi/2 asks for a full turn only
    bounds : of the lengths found, by name (a, b, c, f)

    Raises
    ------
    InputError
        for no position, or more than the mechanism has room for.
    """

    swing: float
    phi0: float
    e: float
    g: float
    alpha: float
    positions: tuple[Position, ...]
    f: float = 0.0
    max_pressure_angle: float = 0.5 * np.pi
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    unknowns: tuple[Unknown, ...] = field(default=(Unknown("phi1", 0.0, 2.0 * np.pi, periodic=True),), init=False)
    objective: str = field(default="largest |d2psi|", init=False)

    def __post_init__(self) -> None:
        check_given(self)
        room = 2 if abs(np.sin(self.alpha)) > PLANAR else 1
        if not 1 <= len(self.positions) <= room:
            raise InputError("positions", len(self.positions), f"1 to {room}", "Task1")

    @property
    def equations(self) -> tuple[str, ...]:
        """The positions that f does not take."""
        return equation_names(self.alpha, len(self.positions))

    @property
    def limits(self) -> tuple[str, ...]:
        """Pressure angle, the branch at every position, bounds of the lengths."""
        branches = tuple(f"branch at position {k + 1}" for k in range(len(self.positions)))
        return ("pressure angle", *branches, *size_names(self.bounds))

    def evaluate(self, x: Array) -> Candidates:
        """See `SynthesisTask`."""
        n = len(x)
        found = through_positions(
            np.full(n, self.swing), np.full(n, self.phi0), x[:, 0], self.e, self.g, self.alpha, self.positions, self.f
        )
        columns = named(found.designs)
        sizes = size_limits(columns, self.bounds)
        limits = stacked(n, [pressure_limit(found.designs, self.max_pressure_angle), *found.slacks.T, *sizes])
        curve = np.asarray(motion(found.designs, turn(), "d2psi")["d2psi"], np.float64)
        return Candidates(found.residuals, limits, curve, columns)


@dataclass(frozen=True)
class Task2:
    """The unknowns are swing, phi0, phi1 and f; closure at the two positions and at both limits are the equations.

    The limits hold by the locus, the first position by f, the second one is left as an equation; the two degrees of
    freedom that remain, four with g and alpha, go to the objective.  Only ratios of lengths matter: e sets the scale.

    Parameters
    ----------
    swing_range, phi0_range : where swing (one sign) and phi0 are looked for [rad]
    e, g, alpha : position of the rocker axis and of the rocker's plane on it [length, rad]; sin(alpha) not 0
    positions : two intermediate positions, from the extended one on
    g_range, alpha_range : where g and alpha are looked for, if they are to be found as well
    max_pressure_angle : limit over the whole turn [rad]; pi/2 asks for a full turn only
    bounds : of the lengths found, by name (a, b, c, f)

    Raises
    ------
    InputError
        for a planar mechanism, which has no f to give, or another number of positions.
    """

    swing_range: tuple[float, float]
    phi0_range: tuple[float, float]
    e: float
    g: float
    alpha: float
    positions: tuple[Position, Position]
    g_range: tuple[float, float] | None = None
    alpha_range: tuple[float, float] | None = None
    max_pressure_angle: float = 0.5 * np.pi
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    objective: str = field(default="largest |d2psi|", init=False)

    def __post_init__(self) -> None:
        check_given(self)
        alphas = (self.alpha,) if self.alpha_range is None else self.alpha_range
        if min(abs(np.sin(alpha)) for alpha in alphas) <= PLANAR or np.ptp(np.sign(np.sin(alphas))):
            raise InputError("alpha", alphas, "angles whose sines are not 0", "Task2")
        if len(self.positions) != 2:
            raise InputError("positions", len(self.positions), "2", "Task2")

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Swing, phi0 and phi1, g and alpha where they are free."""
        free = {"g": self.g_range, "alpha": self.alpha_range}
        return (
            Unknown("swing", *self.swing_range),
            Unknown("phi0", *self.phi0_range),
            Unknown("phi1", 0.0, 2.0 * np.pi, periodic=True),
            *(Unknown(name, *ends) for name, ends in free.items() if ends is not None),
        )

    @property
    def equations(self) -> tuple[str, ...]:
        """The second position; f takes the first."""
        return ("position 2",)

    @property
    def limits(self) -> tuple[str, ...]:
        """Pressure angle, the branch at both positions, bounds of the lengths."""
        return ("pressure angle", "branch at position 1", "branch at position 2", *size_names(self.bounds))

    def evaluate(self, x: Array) -> Candidates:
        """See `SynthesisTask`."""
        values = dict(zip((u.name for u in self.unknowns), x.T, strict=True))
        g, alpha = values.get("g", self.g), values.get("alpha", self.alpha)
        found = through_positions(x[:, 0], x[:, 1], x[:, 2], self.e, g, alpha, self.positions, 0.0)
        columns = named(found.designs)
        sizes = size_limits(columns, self.bounds)
        limits = stacked(len(x), [pressure_limit(found.designs, self.max_pressure_angle), *found.slacks.T, *sizes])
        curve = np.asarray(motion(found.designs, turn(), "d2psi")["d2psi"], np.float64)
        return Candidates(found.residuals, limits, curve, columns)
