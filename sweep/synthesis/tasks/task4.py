"""Task 4: the planar crank-rocker with given swing and phi0, the problem of Alt."""

from __future__ import annotations

from dataclasses import dataclass, field

from sweep.synthesis.tasks.engineering import EngineeringMethod


@dataclass(frozen=True)
class Task4(EngineeringMethod):
    """The engineering method in the plane: alpha = 0, f = g; the only unknown is phi1.

    Give swing, phi0 and the frame e; the objective "pressure_angle" is the classical question for the best
    transmission, "acceleration" that for the smoothest motion.
    """

    g: float = field(default=0.0, init=False)
    alpha: float = field(default=0.0, init=False)
    f_range: tuple[float, float] = field(default=(0.0, 0.0), init=False)
