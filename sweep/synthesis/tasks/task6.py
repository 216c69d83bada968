"""Task 6: a guiding four-bar driven by a crank-rocker: a coupler point between two places with given tangents."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from sweep.errors import InputError
from sweep.families import family
from sweep.families.base import Angles, Array
from sweep.synthesis.tasks.crank_rocker import size_limits, size_names
from sweep.synthesis.tasks.given import check_given
from sweep.synthesis.tasks.problem import Candidates, Unknown, stacked
from sweep.synthesis.tasks.second_stage import Drive, chain_motion, chain_of, second_pressure_limit

GUIDE = family("guide")


@dataclass(frozen=True)
class Task6:
    """The unknowns are shape and place of a guiding four-bar whose coupler point goes from J1 to J2 on given tangents.

    Size, direction and place of the four-bar follow from J1 and J2 (they are similarity transformations), so the
    unknowns are its proportions and the crank angle at J1; the two tangents are the equations.

    Parameters
    ----------
    drive : the crank-rocker, parameters of ``rssr``; J1 belongs to its extended, J2 to its folded position
    start, end : J1 and J2 (x, y) in the plane of the four-bar [length]
    start_direction, end_direction : of the path there, in the sense of going from J1 to J2 [rad]
    kappa, branch : sense of the connection of the stages, assembly mode of the four-bar
    max_pressure_angle : limit of the four-bar over the whole motion [rad]; below pi/2 keeps dead points away
    bounds : of what is found, by name (a2, b2, c2, e2, xi2, eta2)
    """

    drive: Mapping[str, float]
    start: tuple[float, float]
    end: tuple[float, float]
    start_direction: float
    end_direction: float
    kappa: int = 1
    branch: int = 1
    max_pressure_angle: float = np.radians(60.0)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    unknowns: tuple[Unknown, ...] = field(
        default=(
            Unknown("coupler", 0.5, 5.0), Unknown("rocker", 0.5, 5.0), Unknown("frame", 0.5, 5.0),
            Unknown("along", -4.0, 6.0), Unknown("across", -4.0, 4.0),
            Unknown("theta1", 0.0, 2.0 * np.pi, periodic=True),
        ),
        init=False,
    )  # fmt: skip
    equations: tuple[str, ...] = field(default=("tangent at the start", "tangent at the end"), init=False)
    objective: str = field(default="largest |d2s/dphi2| along the line from J1 to J2", init=False)
    _first: Drive = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_given(self)
        if tuple(self.start) == tuple(self.end):
            raise InputError("end", self.end, "another place than the start", "Task6")
        object.__setattr__(self, "_first", Drive.of(self.drive, "Task6"))

    @property
    def limits(self) -> tuple[str, ...]:
        """Senses of the tangents, pressure angle of the four-bar, bounds."""
        return ("sense at the start", "sense at the end", "pressure angle 2", *size_names(self.bounds))

    def evaluate(self, x: Array) -> Candidates:
        """See `Problem`."""
        n, first = len(x), self._first
        ones = np.ones(n)
        theta = x[:, 5]
        four_bar = np.column_stack([ones, *x[:, :5].T, 0.0 * ones, 0.0 * ones, self.branch * ones])
        angles = Angles.of(np.column_stack([theta, theta + self.kappa * first.swing]))
        path = GUIDE.poses(four_bar, angles, frozenset(("s", "dev", "ds", "ddev")))
        s, dev, ds, ddev = (np.asarray(path[name], np.float64) for name in ("s", "dev", "ds", "ddev"))
        point, moving = s + 1j * dev, ds + 1j * ddev
        chord = complex(*self.end) - complex(*self.start)
        with np.errstate(divide="ignore", invalid="ignore"):
            similarity = chord / (point[:, 1] - point[:, 0])
            along = moving * (similarity * np.sign(self.kappa * first.swing))[:, None]
            along /= np.abs(along)
        wanted = np.exp(1j * np.array([self.start_direction, self.end_direction]))
        turned = along * wanted.conj()
        size, beta = np.abs(similarity), np.angle(similarity)
        origin = complex(*self.start) - similarity * point[:, 0]
        columns = first.columns(n) | {
            "a2": size,
            "b2": size * x[:, 0],
            "c2": size * x[:, 1],
            "e2": size * x[:, 2],
            "xi2": size * x[:, 3],
            "eta2": size * x[:, 4],
            "lam2": np.angle(chord) - beta,
            "h2": 0.0 * ones,
            "branch2": self.branch * ones,
            "kappa2": self.kappa * ones,
            "offset2": theta - self.kappa * first.psi_ext,
        }
        motion = chain_motion(chain_of("guide"), columns, "d2s", "pressure_angle2")
        slacks = [*turned.real.T, second_pressure_limit(motion, self.max_pressure_angle)]
        limits = stacked(n, [*slacks, *size_limits(columns, self.bounds)])
        placing = {"x0": origin.real, "y0": origin.imag, "beta0": beta}
        return Candidates(turned.imag, limits, np.asarray(motion["d2s"], np.float64), columns | placing)
