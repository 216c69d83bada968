"""Tasks 5 and 8: a crank-rocker on its locus that drives a slotted link, or a slider with a dwell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.families import slotted
from sweep.families.base import Accuracy, Angles, Array, floats
from sweep.synthesis.tasks.crank_rocker import (
    PEAK,
    POSES,
    RSSR,
    LocusTask,
    Number,
    broadcast_columns,
    named,
    outputs_of,
    pressure_limit,
    turn,
    with_peak,
    with_tops,
)
from sweep.synthesis.tasks.problem import Candidates, Unknown, ranges, turning
from sweep.synthesis.tasks.second_stage import RSSP, chain_motion, second_pressure_limit

EXACT = Accuracy(target=1e-12)
WINDOW = 33  # poses of the dwell; the deviation is usually largest at its ends, which is not assumed


class SlotPosition(NamedTuple):
    """An intermediate value: crank angle from the extended position on [rad], and change of rho [length]."""

    dphi: float
    drho: float


class Slot(NamedTuple):
    """Distance of the pin from the pivot of the slotted link and its derivatives with respect to the rocker angle."""

    rho: Array
    first: Array
    second: Array


def slot(a2: Array, e2: Array, t: Array) -> Slot:
    """Return the motion of a planar slotted link: pin at radius a2, pivot at distance e2, t the angle between them.

    Equation (17) of docs/tasks.md, which is the fork slot of docs/slotted.md.  ``a2``, ``e2`` : (n,), their signs are
    equal and without effect; ``t`` : (n, m).
    """
    places = {"a": np.abs(a2), "e": np.abs(e2)}
    matrix = broadcast_columns(*(places.get(p.name, p.default or 0.0) for p in slotted.PARAMETERS))
    columns = slotted.poses(matrix, Angles.of(t), frozenset({"rho", "drho", "d2rho"}))
    return Slot(*floats(columns, "rho", "drho", "d2rho"))


@dataclass(frozen=True)
class Task5(LocusTask):
    """The unknowns are phi1 and f of stage 1, angle t1 and ratio e2/a2 of the slotted link; a2 follows from rho0.

    Parameters
    ----------
    swing, phi0, e, g, alpha, f_range : stage 1, as `EngineeringMethod`; |swing| < pi
    rho0 : change of rho from the extended to the folded position [length], signed
    positions : intermediate values, each an equation
    kappa : +1, or -1 if the slotted link is driven through a reversing gear
    ratio_range : range of e2/a2, not containing 1
    """

    f_range: tuple[float, float]
    rho0: float
    positions: tuple[SlotPosition, ...] = ()
    kappa: int = 1
    ratio_range: tuple[float, float] = (1.2, 5.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not abs(self.swing) < np.pi:
            raise InputError("swing", self.swing, "an angle below pi, or its negative", "Task5")

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Places of both stages on their loci."""
        return (turning("phi1"), *ranges(self, "f"), turning("t1"), *ranges(self, "ratio"))

    def candidates(self, x: Mapping[str, Array]) -> Candidates:
        """Compute equations, limits, curve and mechanisms of candidates from their unknowns, (n,) each."""
        phi1, t1, ones = x["phi1"], x["t1"], np.ones(len(x["phi1"]))
        designs, psi1 = self.drive(phi1, x["f"])
        t2 = t1 + self.kappa * self.swing
        gain = (slot(ones, x["ratio"], t2[:, None]).rho - slot(ones, x["ratio"], t1[:, None]).rho)[:, 0]
        a2 = self.rho0 / np.where(gain == 0.0, np.nan, gain)
        e2 = x["ratio"] * a2

        def rho_at(dphi: Array) -> tuple[Slot, Array, Array]:
            psi, dpsi, d2psi = RSSR.values(designs, Angles.of(phi1[:, None] + dphi), "psi", "dpsi", "d2psi")
            return slot(a2, e2, t1[:, None] + self.kappa * (psi - psi1[:, None])), dpsi, d2psi

        peak = outputs_of(designs, ["phi_max_abs_d2psi"], PEAK)["phi_max_abs_d2psi"] - phi1
        here, dpsi, d2psi = rho_at(np.column_stack([np.broadcast_to(turn().phi, (len(phi1), POSES)), peak]))
        d2rho = self.kappa * d2psi * here.first + dpsi * dpsi * here.second
        curve = with_peak(with_tops(d2rho[:, :-1]), d2rho[:, -1])
        start = slot(a2, e2, t1[:, None]).rho[:, 0]
        equations = {
            f"rho at position {k}": (rho_at(np.array([[p.dphi]]))[0].rho[:, 0] - start - p.drho) / abs(self.rho0)
            for k, p in enumerate(self.positions, 1)
        }
        sign = np.sign(np.sin(0.5 * (t1 + t2)))
        limits = {
            "pressure angle": pressure_limit(designs, self.max_pressure_angle),
            "a2 positive": a2 / abs(self.rho0),
            "no return of the pin": np.minimum(sign * np.sin(t1), sign * np.sin(t2)),
        }
        return Candidates(
            equations, limits, curve, named(designs, "1") | {"a2": a2, "e2": e2, "t1": t1, "kappa": self.kappa}
        )


@dataclass(frozen=True)
class Task8(LocusTask):
    """The unknowns are phi1 and f of the crank-rocker, proportions of the slider-crank; the stroke gives its size.

    Both stages stand in a limit position at the same time, the first in its extended one: velocity, acceleration and
    jerk vanish there, and the slider moves by psi''^2 S'' dphi^4/8 to leading order.

    Parameters
    ----------
    swing, phi0, e, g, alpha, f_range : stage 1, as `EngineeringMethod`
    stroke : stroke of the slider, positive [length]
    dwell : crank angle of the dwell [rad], with the extended position in its middle
    tolerance : largest deviation from the dwell position during it [length]
    limit : limit position of stage 2 during the dwell
    kappa, branch : sense of the connection of the stages, assembly mode of the slider-crank
    coupler_range, offset_range : ranges of b2/a2 and e2/a2
    f2_ratio, alpha2 : f2/a2 and the angle of a spatial slider-crank [1, rad]; 0 for a planar one
    max_pressure_angle : limit of both stages over the whole turn [rad]
    """

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
    max_pressure_angle: float = field(default=np.radians(60.0), kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.stroke > 0.0:
            raise InputError("stroke", self.stroke, "a positive length", "Task8")

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Places on both loci."""
        return (turning("phi1"), *ranges(self, "f", "coupler", "offset"))

    def candidates(self, x: Mapping[str, Array]) -> Candidates:
        """Compute equations, limits, curve and mechanisms of candidates from their unknowns, (n,) each."""
        coupler, offset = x["coupler"], x["offset"]
        designs, psi1 = self.drive(x["phi1"], x["f"])
        shape = broadcast_columns(1.0, coupler, offset, self.f2_ratio, self.alpha2, self.branch)
        # nan if the slider-crank does not turn fully and so has no limit positions
        place = "phi_ext" if self.limit == "extended" else "phi_fold"
        theta = np.asarray(design_outputs(RSSP, shape, [place], EXACT)[place], np.float64)
        span = np.linspace(0.0, self.kappa * self.swing, 9)
        (slide,) = RSSP.values(shape, Angles.of(theta[:, None] + span), "s")
        travel = slide[:, -1] - slide[:, 0]
        a2 = self.stroke / np.abs(travel)
        columns: dict[str, Number] = {
            **named(designs, "1"),
            "a2": a2,
            "b2": a2 * coupler,
            "e2": a2 * offset,
            "f2": a2 * self.f2_ratio,
            "alpha2": self.alpha2,
            "branch2": self.branch,
            "kappa2": self.kappa,
            "offset2": theta - self.kappa * psi1,
        }
        deviation = self._deviation(designs, x["phi1"], psi1, theta, a2[:, None] * shape[:, :4])
        d2s, angle = chain_motion("rssp", columns, "d2s", "pressure_angle2")
        limits = {
            "dwell": np.log(self.tolerance / deviation),
            "pressure angle 1": pressure_limit(designs, self.max_pressure_angle),
            "pressure angle 2": second_pressure_limit(angle, self.max_pressure_angle),
            # all steps of the slider have the direction of the whole stroke
            "no return of the slider": (np.diff(slide, axis=1) * np.sign(travel)[:, None]).min(axis=1),
        }
        return Candidates({}, limits, with_tops(d2s), columns | {"dwell_deviation": deviation})

    def _deviation(self, designs: Array, phi1: Array, psi1: Array, theta: Array, lengths: Array) -> Array:
        """Return the largest distance from the dwell position during the dwell."""
        window = np.linspace(-0.5 * self.dwell, 0.5 * self.dwell, WINDOW)
        turned = RSSR.values(designs, Angles.of(phi1[:, None] + window), "psi")[0] - psi1[:, None]
        stage = broadcast_columns(*lengths.T, self.alpha2, self.branch)
        (s,) = RSSP.values(stage, Angles.of(theta[:, None] + self.kappa * turned), "s")
        largest: Array = np.abs(s - s[:, [WINDOW // 2]]).max(axis=1)
        return largest
