"""Task 1: a crank-rocker with given swing and phi0 that passes one or two intermediate positions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from sweep.errors import InputError
from sweep.families.base import Array
from sweep.synthesis.tasks.crank_rocker import motion, named, pressure_limit, size_limits, size_names, turn
from sweep.synthesis.tasks.given import check_given
from sweep.synthesis.tasks.positions import PLANAR, Position, equation_names, through_positions
from sweep.synthesis.tasks.problem import Candidates, Unknown, stacked


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
        """See `Problem`."""
        n = len(x)
        found = through_positions(
            np.full(n, self.swing), np.full(n, self.phi0), x[:, 0], self.e, self.g, self.alpha, self.positions, self.f
        )
        columns = named(found.designs)
        sizes = size_limits(columns, self.bounds)
        limits = stacked(n, [pressure_limit(found.designs, self.max_pressure_angle), *found.slacks.T, *sizes])
        curve = np.asarray(motion(found.designs, turn(), "d2psi")["d2psi"], np.float64)
        return Candidates(found.residuals, limits, curve, columns)
