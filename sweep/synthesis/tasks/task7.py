"""Task 7: a slider driven by a crank-rocker, with given stroke and given accelerations at its ends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from sweep.errors import InputError
from sweep.families import family
from sweep.families.base import Angles, Array
from sweep.synthesis.tasks.crank_rocker import RSSR, size_limits, size_names
from sweep.synthesis.tasks.given import check_given
from sweep.synthesis.tasks.problem import Candidates, Unknown, stacked
from sweep.synthesis.tasks.second_stage import Drive, chain_motion, chain_of, second_pressure_limit

RSSP = family("rssp")


@dataclass(frozen=True)
class Task7:
    """The unknowns are a2, b2, e2 and the angle of the second crank; stroke and both accelerations are the equations.

    At a limit of stage 1 its velocity vanishes, so the output's acceleration there is psi'' S', and S' = w/psi''.

    Parameters
    ----------
    drive : the crank-rocker, parameters of ``rssr``
    stroke : slider position at the folded minus at the extended position of the drive [length], signed
    start_acceleration, end_acceleration : d2s/dphi2 at the extended and at the folded position [length]; of opposite
        signs, as the slider turns round there: the first has the sign of the stroke
    f2, alpha2 : of the slider-crank, 0 for a planar one [length, rad]
    kappa, branch : sense of the connection of the stages, assembly mode of the slider-crank
    size_range : where a2, b2 and |e2| are looked for, in strokes
    max_pressure_angle : limit of the slider-crank over the whole motion [rad]
    objective : what the surplus of unknowns goes to: "acceleration", max |d2s| over the turn, or "pressure_angle", the
        largest of the slider-crank
    bounds : of what is found, by name (a2, b2, e2)

    Raises
    ------
    InputError
        for accelerations whose signs do not belong to the stroke, or a drive without limits.
    """

    drive: Mapping[str, float]
    stroke: float
    start_acceleration: float
    end_acceleration: float
    f2: float = 0.0
    alpha2: float = 0.0
    kappa: int = 1
    branch: int = 1
    size_range: tuple[float, float] = (0.3, 6.0)
    max_pressure_angle: float = np.radians(45.0)
    objective: Literal["acceleration", "pressure_angle"] = "acceleration"
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    equations: tuple[str, ...] = field(
        default=("stroke", "acceleration at the start", "acceleration at the end"), init=False
    )
    _first: Drive = field(init=False, repr=False)
    _second_derivatives: tuple[float, float] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_given(self)
        for name, value, sign in (
            ("start_acceleration", self.start_acceleration, 1.0), ("end_acceleration", self.end_acceleration, -1.0),
        ):  # fmt: skip
            if not value * sign * self.stroke > 0.0:
                raise InputError(name, value, "the sign with which the slider turns round there", "Task7")
        first = Drive.of(self.drive, "Task7")
        law = RSSR.poses(
            first.row[None, :], Angles.of(np.array([[first.phi_ext, first.phi_fold]])), frozenset(("d2psi",))
        )
        object.__setattr__(self, "_first", first)
        object.__setattr__(self, "_second_derivatives", tuple(np.asarray(law["d2psi"], np.float64)[0].tolist()))

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Crank, coupler, offset and crank angle of the slider-crank."""
        low, high = (limit * abs(self.stroke) for limit in self.size_range)
        return (
            Unknown("a2", low, high),
            Unknown("b2", low, high),
            Unknown("e2", -high, high),
            Unknown("theta1", 0.0, 2.0 * np.pi, periodic=True),
        )

    @property
    def limits(self) -> tuple[str, ...]:
        """Pressure angle of the slider-crank, bounds."""
        return ("pressure angle 2", *size_names(self.bounds))

    def evaluate(self, x: Array) -> Candidates:
        """See `Problem`."""
        n, first = len(x), self._first
        ones, theta = np.ones(n), x[:, 3]
        columns = first.columns(n) | {
            "a2": x[:, 0],
            "b2": x[:, 1],
            "e2": x[:, 2],
            "f2": self.f2 * ones,
            "alpha2": self.alpha2 * ones,
            "branch2": self.branch * ones,
            "kappa2": self.kappa * ones,
            "offset2": theta - self.kappa * first.psi_ext,
        }
        stage = np.column_stack([columns[f"{name}2"] for name in RSSP.parameter_names])
        ends = RSSP.poses(
            stage, Angles.of(np.column_stack([theta, theta + self.kappa * first.swing])), frozenset(("s", "ds"))
        )
        s, ds = (np.asarray(ends[name], np.float64) for name in ("s", "ds"))
        wanted = (self.start_acceleration, self.end_acceleration)
        residuals = [(s[:, 1] - s[:, 0] - self.stroke) / abs(self.stroke)]
        for k, second in enumerate(self._second_derivatives):
            residuals.append(self.kappa * second * ds[:, k] / wanted[k] - 1.0)
        motion = chain_motion(chain_of("rssp"), columns, "d2s", "pressure_angle2")
        slacks = [second_pressure_limit(motion, self.max_pressure_angle), *size_limits(columns, self.bounds)]
        if self.objective == "acceleration":
            curve = np.asarray(motion["d2s"], np.float64)
        else:
            curve = np.sin(np.asarray(motion["pressure_angle2"], np.float64))
        return Candidates(stacked(n, residuals), stacked(n, slacks), curve, columns)
