"""Tasks 6 and 7: a given crank-rocker as first stage, and the chains that it drives.

In task 6 it drives a guiding four-bar: a coupler point between two places with given tangents.  In task 7 it drives a
slider, with given stroke and given accelerations at its ends.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.families import family
from sweep.families.base import Accuracy, Angles, Array, Columns, Family
from sweep.synthesis.tasks.crank_rocker import RSSR, check_given, size_limits, size_names, turn
from sweep.synthesis.tasks.problem import Candidates, Unknown, stacked


class Drive(NamedTuple):
    """A crank-rocker that turns and oscillates: its row of the design matrix and its limits."""

    row: Array
    psi_ext: float
    swing: float
    phi_ext: float
    phi_fold: float

    @classmethod
    def of(cls, design: Mapping[str, float], place: str) -> Drive:
        """Return the limits of a design of ``rssr``.

        Raises
        ------
        InputError
            for a bad design, or one that has no limit positions.
        """
        matrix, _ = design_matrix(RSSR, design)
        names = ("psi_ext", "swing", "phi_ext", "phi_fold")
        found = design_outputs(RSSR, matrix, names, Accuracy(target=1e-12))
        if len(matrix) != 1 or found["status"][0] != 0:
            raise InputError("drive", dict(design), "one crank-rocker that turns fully and oscillates", place)
        return cls(matrix[0], *(float(found[name][0]) for name in names))

    def columns(self, count: int) -> dict[str, Array]:
        """Its parameters as columns of stage 1."""
        return {f"{name}1": np.full(count, value) for name, value in zip(RSSR.parameter_names, self.row, strict=True)}


def chain_of(second: str) -> Family:
    """Return a crank-rocker and what it drives."""
    return family(["rssr", second])


def chain_motion(chain: Family, columns: Mapping[str, Array], *wanted: str) -> Columns:
    """Pose outputs of chains over one turn, nan where there is no mechanism or a stage does not reach."""
    # A stage stands where it does by default, as far as the task says nothing of its place.
    defaults = {p.name: np.full_like(columns["a1"], p.default) for p in chain.parameters if p.default is not None}
    rows = np.column_stack([(defaults | dict(columns))[name] for name in chain.parameter_names])
    return chain.poses(rows, turn(), frozenset(wanted))


def second_pressure_limit(motion: Columns, largest: float) -> Array:
    """Slack of the limit on the pressure angle of stage 2 over the poses of a turn, cos^2 - cos^2[largest]."""
    angle = np.asarray(motion["pressure_angle2"], np.float64)
    slack: Array = (np.cos(angle) ** 2).min(axis=1) - np.cos(largest) ** 2
    return slack


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
        """See `SynthesisTask`."""
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
        """See `SynthesisTask`."""
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
