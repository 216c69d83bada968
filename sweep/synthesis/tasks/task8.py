"""Task 8: a slider driven by a crank-rocker that dwells at one end of its stroke."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Angles, Array
from sweep.synthesis.tasks.crank_rocker import (
    RSSR,
    check_given,
    designs_on_locus,
    named,
    pressure_limit,
    size_limits,
    size_names,
)
from sweep.synthesis.tasks.problem import Candidates, Unknown, stacked
from sweep.synthesis.tasks.second_stage import chain_motion, chain_of, second_pressure_limit

RSSP = family("rssp")
EXACT = Accuracy(target=1e-12)
WINDOW = 33  # poses of the dwell; the deviation is largest at its ends, but this is not taken for granted


@dataclass(frozen=True)
class Task8:
    """The unknowns are phi1 and f of the crank-rocker, proportions of the slider-crank; its size is that of the stroke.

    Both stages stand in a limit position at the same time, the first in its extended one: velocity, acceleration and
    jerk vanish there, and the slider moves by psi''^2 S'' dphi^4/8 to leading order.

    Parameters
    ----------
    swing, phi0, e, g, alpha, f_range : stage 1, as `EngineeringMethod`
    stroke : of the slider, positive [length]
    dwell : crank angle over which the slider has to stand still [rad], with the extended position in its middle
    tolerance : largest deviation from the dwell position during it [length]
    limit : in which of its limit positions stage 2 stands during the dwell
    kappa, branch : sense of the connection of the stages, assembly mode of the slider-crank
    coupler_range, offset_range : where b2/a2 and e2/a2 are looked for
    f2_ratio, alpha2 : f2/a2 and the angle of a spatial slider-crank [1, rad]; 0 for a planar one
    max_pressure_angle : limit of both stages over the whole turn [rad]
    bounds : of the lengths found, by name (a1, b1, c1, a2, b2, e2)
    """

    swing: float
    phi0: float
    e: float
    g: float
    alpha: float
    f_range: tuple[float, float]
    stroke: float
    dwell: float
    tolerance: float
    limit: Literal["extended", "folded"] = "extended"
    kappa: int = 1
    branch: int = 1
    coupler_range: tuple[float, float] = (1.5, 6.0)
    offset_range: tuple[float, float] = (-2.0, 2.0)
    f2_ratio: float = 0.0
    alpha2: float = 0.0
    max_pressure_angle: float = np.radians(60.0)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    equations: tuple[str, ...] = field(default=(), init=False)
    objective: str = field(default="largest |d2s/dphi2| over the turn", init=False)

    def __post_init__(self) -> None:
        check_given(self)
        if not self.stroke > 0.0:
            raise InputError("stroke", self.stroke, "a positive length", "Task8")

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Places on both loci."""
        return (
            Unknown("phi1", 0.0, 2.0 * np.pi, periodic=True),
            Unknown("f", *self.f_range),
            Unknown("coupler", *self.coupler_range),
            Unknown("offset", *self.offset_range),
        )

    @property
    def limits(self) -> tuple[str, ...]:
        """Dwell, pressure angles of both stages, one way per stroke, bounds."""
        own = ("dwell", "pressure angle 1", "pressure angle 2", "no return of the slider")
        return (*own, *size_names(self.bounds))

    def evaluate(self, x: Array) -> Candidates:
        """See `SynthesisTask`."""
        n, ones = len(x), np.ones(len(x))
        phi1, coupler, offset = x[:, 0], x[:, 2], x[:, 3]
        fixed = (self.swing * ones, self.phi0 * ones, phi1, self.e * ones, x[:, 1])
        designs, psi1 = designs_on_locus(*fixed, self.g * ones, self.alpha * ones)
        shape = np.column_stack([ones, coupler, offset, self.f2_ratio * ones, self.alpha2 * ones, self.branch * ones])
        # nan where the slider-crank does not turn fully and so has no limit positions
        place = "phi_ext" if self.limit == "extended" else "phi_fold"
        theta = np.asarray(design_outputs(RSSP, shape, [place], EXACT)[place], np.float64)
        span = np.linspace(0.0, self.kappa * self.swing, 9)
        slide = np.asarray(RSSP.poses(shape, Angles.of(theta[:, None] + span), frozenset("s"))["s"], np.float64)
        travel = slide[:, -1] - slide[:, 0]
        a2 = self.stroke / np.abs(travel)
        columns = named(designs, "1") | {
            "a2": a2,
            "b2": a2 * coupler,
            "e2": a2 * offset,
            "f2": a2 * self.f2_ratio,
            "alpha2": self.alpha2 * ones,
            "branch2": self.branch * ones,
            "kappa2": self.kappa * ones,
            "offset2": theta - self.kappa * psi1,
        }
        deviation = self._deviation(designs, phi1, psi1, theta, a2[:, None] * shape[:, :4])
        motion = chain_motion(chain_of("rssp"), columns, "d2s", "pressure_angle2")
        slacks = [
            np.log(self.tolerance / deviation),
            pressure_limit(designs, self.max_pressure_angle),
            second_pressure_limit(motion, self.max_pressure_angle),
            # all steps of the slider go the way of the whole stroke
            (np.diff(slide, axis=1) * np.sign(travel)[:, None]).min(axis=1),
        ]
        limits = stacked(n, [*slacks, *size_limits(columns, self.bounds)])
        results = columns | {"dwell_deviation": deviation}
        return Candidates(np.empty((n, 0)), limits, np.asarray(motion["d2s"], np.float64), results)

    def _deviation(self, designs: Array, phi1: Array, psi1: Array, theta: Array, lengths: Array) -> Array:
        """Largest distance from the dwell position during the dwell."""
        window = np.linspace(-0.5 * self.dwell, 0.5 * self.dwell, WINDOW)
        law = RSSR.poses(designs, Angles.of(phi1[:, None] + window), frozenset(("psi",)))
        turned = np.asarray(law["psi"], np.float64) - psi1[:, None]
        rest = np.full((len(designs), 2), [self.alpha2, float(self.branch)])
        stage = np.column_stack([lengths, rest])
        s = RSSP.poses(stage, Angles.of(theta[:, None] + self.kappa * turned), frozenset("s"))["s"]
        away = np.abs(np.asarray(s, np.float64) - np.asarray(s, np.float64)[:, [WINDOW // 2]])
        largest: Array = away.max(axis=1)
        return largest
