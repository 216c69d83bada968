"""Task 2: a crank-rocker through two intermediate positions, swing and phi0 free within ranges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from sweep.errors import InputError
from sweep.families.base import Array
from sweep.synthesis.tasks.crank_rocker import motion, named, pressure_limit, size_limits, size_names, turn
from sweep.synthesis.tasks.given import check_given
from sweep.synthesis.tasks.positions import PLANAR, Position, through_positions
from sweep.synthesis.tasks.problem import Candidates, Unknown, stacked


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
        """See `Problem`."""
        values = dict(zip((u.name for u in self.unknowns), x.T, strict=True))
        g, alpha = values.get("g", self.g), values.get("alpha", self.alpha)
        found = through_positions(x[:, 0], x[:, 1], x[:, 2], self.e, g, alpha, self.positions, 0.0)
        columns = named(found.designs)
        sizes = size_limits(columns, self.bounds)
        limits = stacked(len(x), [pressure_limit(found.designs, self.max_pressure_angle), *found.slacks.T, *sizes])
        curve = np.asarray(motion(found.designs, turn(), "d2psi")["d2psi"], np.float64)
        return Candidates(found.residuals, limits, curve, columns)
