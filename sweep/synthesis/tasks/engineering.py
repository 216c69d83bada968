"""The engineering method: of all crank-rockers with a given swing and phi0 the one with the least acceleration.

Task 4 is the same in the plane, the problem of Alt.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from sweep.families.base import Array
from sweep.synthesis.tasks.crank_rocker import (
    check_given,
    designs_on_locus,
    least_cos2,
    motion,
    named,
    pressure_limit,
    size_limits,
    size_names,
    turn,
)
from sweep.synthesis.tasks.problem import Candidates, Unknown, stacked


@dataclass(frozen=True)
class EngineeringMethod:
    """Swing, phi0, e, g, alpha are given; the place phi1 on the locus and the offset f of the crank plane are unknown.

    Parameters
    ----------
    swing, phi0 : rocker angle (signed) and crank angle from the extended to the folded position [rad]
    e, g, alpha : position of the rocker axis and of the rocker's plane on it [length, rad]
    f_range : where f is looked for [length]; two equal numbers fix it.  With alpha = 0 only f - g matters.
    max_pressure_angle : limit over the whole turn [rad]; pi/2 asks for a full turn only
    objective : "acceleration", max |d2psi|, or "pressure_angle", the largest over the turn
    bounds : of what is found, by name: the lengths a, b, c, and the place x_ext, y_ext of the rocker ball at the
        extended position, from the rocker axis: a box for the joint C1

    Raises
    ------
    InputError
        for a number out of its range or a word that is none of those allowed, here and in every task.
    """

    swing: float
    phi0: float
    e: float
    g: float
    alpha: float
    f_range: tuple[float, float]
    max_pressure_angle: float = 0.5 * np.pi
    objective: Literal["acceleration", "pressure_angle"] = "acceleration"
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_given(self)

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """phi1, and f where it is free."""
        place = Unknown("phi1", 0.0, 2.0 * np.pi, periodic=True)
        low, high = self.f_range
        return (place,) if low == high else (place, Unknown("f", low, high))

    equations: tuple[str, ...] = field(default=(), init=False)

    @property
    def limits(self) -> tuple[str, ...]:
        """Pressure angle (the full turn with it) and bounds of the lengths."""
        return ("pressure angle", *size_names(self.bounds))

    def evaluate(self, x: Array) -> Candidates:
        """See `SynthesisTask`."""
        f = x[:, 1] if x.shape[1] > 1 else np.full(len(x), self.f_range[0])
        swing, phi0 = np.full(len(x), self.swing), np.full(len(x), self.phi0)
        e, g, alpha = (np.full(len(x), value) for value in (self.e, self.g, self.alpha))
        designs, psi1 = designs_on_locus(swing, phi0, x[:, 0], e, f, g, alpha)
        columns = named(designs)
        columns |= {"x_ext": columns["c"] * np.cos(psi1), "y_ext": columns["c"] * np.sin(psi1)}
        limits = [pressure_limit(designs, self.max_pressure_angle), *size_limits(columns, self.bounds)]
        if self.objective == "acceleration":
            curve = np.asarray(motion(designs, turn(), "d2psi")["d2psi"], np.float64)
        else:
            curve = np.sqrt(1.0 - least_cos2(designs))[:, None]  # sine of the largest pressure angle
        return Candidates(np.empty((len(x), 0)), stacked(len(x), limits), curve, columns)


@dataclass(frozen=True)
class Task4(EngineeringMethod):
    """The engineering method in the plane: alpha = 0, f = g; the only unknown is phi1.

    Give swing, phi0 and the frame e; the objective "pressure_angle" is the classical question for the best
    transmission, "acceleration" that for the smoothest motion.
    """

    g: float = field(default=0.0, init=False)
    alpha: float = field(default=0.0, init=False)
    f_range: tuple[float, float] = field(default=(0.0, 0.0), init=False)
