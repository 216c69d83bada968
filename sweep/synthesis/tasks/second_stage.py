"""Tasks 6 and 7: a given crank-rocker as first stage, and the stages that it drives.

In task 6 it drives a guiding four-bar, a rocker-slider or a rocker-slotted linkage: a working point between two places
with given tangents.  In task 7 it drives a slider, with given stroke and given accelerations at its ends.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.families import family
from sweep.families.base import Accuracy, Angles, Array
from sweep.synthesis.tasks.crank_rocker import RSSR, Number, broadcast_columns, turn, with_tops
from sweep.synthesis.tasks.problem import Candidates, SynthesisTask, Unknown, turning

RSSP = family("rssp")
SIDEWAYS = {"along": (-4.0, 6.0), "across": (-4.0, 4.0)}


class Drive(NamedTuple):
    """A crank-rocker that turns and oscillates: its row of the design matrix and its limit positions."""

    row: Array
    psi_ext: float
    swing: float
    phi_ext: float
    phi_fold: float

    @classmethod
    def of(cls, design: Mapping[str, float], place: str) -> Drive:
        """Return the limit positions of a design of ``rssr``.

        Raises
        ------
        InputError
            for a bad design, or one that has no limit positions.
        """
        matrix, _ = design_matrix(RSSR, design)
        names = ("psi_ext", "swing", "phi_ext", "phi_fold")
        limits = design_outputs(RSSR, matrix, names, Accuracy(target=1e-12))
        if len(matrix) != 1 or limits["status"][0] != 0:
            raise InputError("drive", dict(design), "one crank-rocker that turns fully and oscillates", place)
        return cls(matrix[0], *(float(limits[name][0]) for name in names))

    @property
    def columns(self) -> dict[str, Number]:
        """Parameters of the crank-rocker as columns of stage 1, the same for all candidates."""
        return dict(zip((f"{name}1" for name in RSSR.parameter_names), self.row.tolist(), strict=True))


def chain_motion(second: str, columns: Mapping[str, Number], *wanted: str) -> list[Array]:
    """Return pose outputs of crank-rockers with their second stage over one turn, nan if there is no mechanism."""
    chain = family(["rssr", second])
    # A stage has its default place if the task does not define another.
    given = {p.name: p.default for p in chain.parameters if p.default is not None} | dict(columns)
    return chain.values(broadcast_columns(*(given[name] for name in chain.parameter_names)), turn(), *wanted)


def second_pressure_limit(angle: Array, largest: float) -> Array:
    """Return the slack of the limit on the pressure angle of stage 2 over a turn, cos^2 - cos^2[largest]."""
    slack: Array = with_tops(np.cos(angle) ** 2).min(axis=1) - np.cos(largest) ** 2
    return slack


PlanePath: TypeAlias = NDArray[np.complex128]


class FourBar:
    """A coupler point of a four-bar: ``shape`` are proportions relative to the crank, ``dimensions`` their names."""

    family = "guide"
    shape: ClassVar[Mapping[str, tuple[float, float]]] = {
        "coupler": (0.5, 5.0), "rocker": (0.5, 5.0), "frame": (0.5, 5.0), **SIDEWAYS,
    }  # fmt: skip
    dimensions: ClassVar[Mapping[str, str]] = {
        "coupler": "b",
        "rocker": "c",
        "frame": "e",
        "along": "xi",
        "across": "eta",
    }
    coordinates: tuple[str, ...] = ("s", "dev", "ds", "ddev")

    def path(self, shape: Mapping[str, Array], angles: Angles, branch: int) -> tuple[PlanePath, PlanePath]:
        """Return the working point and its derivative by the crank angle, (n, m), for a crank of 1."""
        x, y, dx, dy = self.poses(shape, angles, branch, self.coordinates)
        return x + 1j * y, dx + 1j * dy

    def poses(self, shape: Mapping[str, Array], angles: Angles, branch: int, wanted: tuple[str, ...]) -> list[Array]:
        """Return pose outputs of stages with a crank of 1, (n, m) each."""
        mechanism = family(self.family)
        columns = {"a": 1.0, "branch": float(branch)} | {self.dimensions[name]: part for name, part in shape.items()}
        rows = broadcast_columns(*(columns.get(p.name, 0.0) for p in mechanism.parameters))
        return mechanism.values(rows, angles, *wanted)

    def over_the_turn(self, drive: Drive, columns: Mapping[str, Number]) -> tuple[Array, Array | None]:
        """Return acceleration along ``lam2`` and pressure angle, if any, over a turn of the drive, (n, m)."""
        d2s, angle = chain_motion(self.family, columns, "d2s", "pressure_angle2")
        return d2s, angle


class RockerSlider(FourBar):
    """A point of the rod of a slider-crank, along the rod and across from the crank pin."""

    family = "slider_crank"
    shape: ClassVar[Mapping[str, tuple[float, float]]] = {"coupler": (1.05, 5.0), "offset": (-4.0, 4.0), **SIDEWAYS}
    dimensions: ClassVar[Mapping[str, str]] = {"coupler": "b", "offset": "e", "along": "xi", "across": "eta"}

    def path(self, shape: Mapping[str, Array], angles: Angles, branch: int) -> tuple[PlanePath, PlanePath]:
        """Return the working point and its derivative by the crank angle, (n, m), for a crank of 1."""
        proportions = {name: shape[name] for name in ("coupler", "offset")}
        s, ds = self.poses(proportions, angles, branch, ("s", "ds"))
        share = ((shape["along"] + 1j * shape["across"]) / shape["coupler"])[:, None]
        pin, slide = angles.cos + 1j * angles.sin, s + 1j * shape["offset"][:, None]
        point, moving = (1.0 - share) * pin + share * slide, (1.0 - share) * 1j * pin + share * ds
        return np.asarray(point, np.complex128), np.asarray(moving, np.complex128)

    def over_the_turn(self, drive: Drive, columns: Mapping[str, Number]) -> tuple[Array, Array | None]:
        """Return acceleration along ``lam2`` and pressure angle over a turn of the drive, (n, m)."""
        d2s, angle = chain_motion(self.family, columns, "d2s", "pressure_angle2")
        psi, dpsi, d2psi = RSSR.values(drive.row[None, :], turn(), "psi", "dpsi", "d2psi")
        names = ("kappa2", "offset2", "lam2", "xi2", "eta2", "b2", "a2")
        kappa, offset, lam, xi, eta, b, a = (np.reshape(columns[name], (-1, 1)) for name in names)
        with np.errstate(invalid="ignore"):  # if a linkage does not reach, all its values are nan
            share = (xi + 1j * eta) / b
            pin = a * np.exp(1j * (kappa * psi + offset - lam)) * (1j * kappa * d2psi - dpsi**2)
            return np.real((1.0 - share) * pin + share * d2s * np.exp(-1j * lam)), angle


class RockerSlotted(FourBar):
    """A point of a rod from the crank pin through a swinging block."""

    family = "swivel"
    shape: ClassVar[Mapping[str, tuple[float, float]]] = {"frame": (1.05, 6.0), "rod": (0.0, 12.0)}
    dimensions: ClassVar[Mapping[str, str]] = {"frame": "e", "rod": "Lw"}
    coordinates = ("x_p", "y_p", "dx_p", "dy_p")

    def over_the_turn(self, drive: Drive, columns: Mapping[str, Number]) -> tuple[Array, Array | None]:
        """Return acceleration along ``lam2`` over a turn of the drive, (n, m), and None for the pressure angle."""
        d2x, d2y = chain_motion(self.family, columns, "d2x_p", "d2y_p")
        lam = np.reshape(columns["lam2"], (-1, 1))
        return d2x * np.cos(lam) + d2y * np.sin(lam), None


STAGES: Mapping[str, FourBar] = {one.family: one for one in (FourBar(), RockerSlider(), RockerSlotted())}


@dataclass(frozen=True)
class Task6(SynthesisTask):
    """The unknowns are shape and place of a second stage whose working point moves from J1 to J2 with given tangents.

    Size, direction and place of the stage follow from J1 and J2 (they are similarity transformations), so the unknowns
    are its proportions and the crank angle at J1; the two tangents are the equations.

    Parameters
    ----------
    drive : the crank-rocker, parameters of ``rssr``; J1 belongs to its extended, J2 to its folded position
    start, end : J1 and J2 (x, y) in the plane of the second stage [length]
    start_direction, end_direction : directions of the path there, in the sense from J1 to J2 [rad]
    second : the second stage: "guide", a coupler point of a four-bar; "slider_crank", one of a rocker-slider; "swivel",
        a point of the rod of a rocker-slotted linkage
    kappa, branch : sense of the connection of the stages, assembly mode of the second stage
    max_pressure_angle : limit of the second stage over the whole motion [rad]; below pi/2 keeps dead points away; a
        rod through a block has none
    """

    drive: Mapping[str, float]
    start: tuple[float, float]
    end: tuple[float, float]
    start_direction: float
    end_direction: float
    second: Literal["guide", "slider_crank", "swivel"] = "guide"
    kappa: int = 1
    branch: int = 1
    max_pressure_angle: float = field(default=np.radians(60.0), kw_only=True)

    _first: Drive = field(init=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if tuple(self.start) == tuple(self.end):
            raise InputError("end", self.end, "another place than the start", "Task6")
        object.__setattr__(self, "_first", Drive.of(self.drive, "Task6"))

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Proportions of the second stage relative to its crank, and the crank angle at J1."""
        return (*(Unknown(name, *ends) for name, ends in STAGES[self.second].shape.items()), turning("theta1"))

    def candidates(self, x: Mapping[str, Array]) -> Candidates:
        """Compute equations, limits, curve and mechanisms of candidates from their unknowns, (n,) each."""
        first, stage, theta = self._first, STAGES[self.second], x["theta1"]
        shape = {name: x[name] for name in stage.shape}
        angles = Angles.of(np.column_stack([theta, theta + self.kappa * first.swing]))
        point, moving = stage.path(shape, angles, self.branch)
        chord = complex(*self.end) - complex(*self.start)
        with np.errstate(divide="ignore", invalid="ignore"):
            similarity = chord / (point[:, 1] - point[:, 0])
            along = moving * (similarity * np.sign(self.kappa * first.swing))[:, None]
            along /= np.abs(along)
        wanted = np.exp(1j * np.array([self.start_direction, self.end_direction]))
        turned = along * wanted.conj()
        size, beta = np.abs(similarity), np.angle(similarity)
        origin = complex(*self.start) - similarity * point[:, 0]
        columns = first.columns | {
            "a2": size,
            **{f"{stage.dimensions[name]}2": size * part for name, part in shape.items()},
            "lam2": np.angle(chord) - beta,
            "h2": 0.0,
            "branch2": self.branch,
            "kappa2": self.kappa,
            "offset2": theta - self.kappa * first.psi_ext,
        }
        d2s, angle = stage.over_the_turn(first, columns)
        ends = ("start", "end")
        limits = {f"sense at the {end}": part for end, part in zip(ends, turned.real.T, strict=True)}
        limits |= {} if angle is None else {"pressure angle 2": second_pressure_limit(angle, self.max_pressure_angle)}
        equations = {f"tangent at the {end}": part for end, part in zip(ends, turned.imag.T, strict=True)}
        beyond = {f"{name}2" for name in ("lam", "h", "branch")}.difference(
            family(["rssr", self.second]).parameter_names
        )
        named_columns = {name: column for name, column in columns.items() if name not in beyond}
        return Candidates(
            equations, limits, with_tops(d2s), named_columns | {"x0": origin.real, "y0": origin.imag, "beta0": beta}
        )


@dataclass(frozen=True)
class Task7(SynthesisTask):
    """The unknowns are a2, b2, e2 and the angle of the second crank; stroke and both accelerations are the equations.

    At a limit of stage 1 its velocity vanishes, so the output's acceleration there is psi'' S', and S' = w/psi''.

    Parameters
    ----------
    drive : the crank-rocker, parameters of ``rssr``
    stroke : slider position at the folded minus at the extended position of the drive [length], signed
    start_acceleration, end_acceleration : d2s/dphi2 at the extended and at the folded position [length]; of opposite
        signs, as the slider reverses there: the first has the sign of the stroke
    f2, alpha2 : dimensions of the slider-crank, 0 for a planar one [length, rad]
    kappa, branch : sense of the connection of the stages, assembly mode of the slider-crank
    size_range : range of a2, b2 and |e2|, in strokes
    max_pressure_angle : limit of the slider-crank over the whole motion [rad]
    objective : objective for the surplus of unknowns: "acceleration", max |d2s| over the turn, or "pressure_angle", the
        largest of the slider-crank

    Raises
    ------
    InputError
        for accelerations whose signs contradict the stroke, or a drive without limits.
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
    max_pressure_angle: float = field(default=np.radians(45.0), kw_only=True)
    objective: Literal["acceleration", "pressure_angle"] = "acceleration"

    _first: Drive = field(init=False, repr=False)
    _second_derivatives: tuple[float, float] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, value, sign in (
            ("start_acceleration", self.start_acceleration, 1.0), ("end_acceleration", self.end_acceleration, -1.0),
        ):  # fmt: skip
            if not value * sign * self.stroke > 0.0:
                raise InputError(name, value, "the sign with which the slider turns round there", "Task7")
        first = Drive.of(self.drive, "Task7")
        ends = Angles.of(np.array([[first.phi_ext, first.phi_fold]]))
        (accelerations,) = RSSR.values(first.row[None, :], ends, "d2psi")
        object.__setattr__(self, "_first", first)
        object.__setattr__(self, "_second_derivatives", tuple(accelerations[0].tolist()))

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Crank, coupler, offset and crank angle of the slider-crank."""
        low, high = (limit * abs(self.stroke) for limit in self.size_range)
        return Unknown("a2", low, high), Unknown("b2", low, high), Unknown("e2", -high, high), turning("theta1")

    def candidates(self, x: Mapping[str, Array]) -> Candidates:
        """Compute equations, limits, curve and mechanisms of candidates from their unknowns, (n,) each."""
        theta, first = x["theta1"], self._first
        columns = first.columns | {f"{name}2": x[f"{name}2"] for name in ("a", "b", "e")}
        columns |= {"f2": self.f2, "alpha2": self.alpha2, "branch2": self.branch, "kappa2": self.kappa}
        columns["offset2"] = theta - self.kappa * first.psi_ext
        stage = broadcast_columns(*(columns[f"{name}2"] for name in RSSP.parameter_names))
        ends = Angles.of(np.column_stack([theta, theta + self.kappa * first.swing]))
        s, ds = RSSP.values(stage, ends, "s", "ds")
        wanted = {"start": self.start_acceleration, "end": self.end_acceleration}
        equations = {"stroke": (s[:, 1] - s[:, 0] - self.stroke) / abs(self.stroke)}
        for k, ((end, value), second) in enumerate(zip(wanted.items(), self._second_derivatives, strict=True)):
            equations[f"acceleration at the {end}"] = self.kappa * second * ds[:, k] / value - 1.0
        d2s, angle = chain_motion("rssp", columns, "d2s", "pressure_angle2")
        limits = {"pressure angle 2": second_pressure_limit(angle, self.max_pressure_angle)}
        return Candidates(equations, limits, with_tops(d2s if self.objective == "acceleration" else angle), columns)
