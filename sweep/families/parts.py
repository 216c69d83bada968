"""Member of a machine with its place in the machine's frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from kernels.types import Array
from sweep.errors import InputError, known_keys
from sweep.families.base import Family, Parameter
from sweep.families.capabilities import Rates
from sweep.families.frames import Frame, crank_axis, place_parameters, stage_frames, tilted
from sweep.families.shafts import Mount
from sweep.families.sites import AXES, EYE, TIP, Site, sites_of


@dataclass(frozen=True)
class Placement:
    """Frame of a member in the machine's frame.

    Parameters
    ----------
    at : origin of the member's frame [length]
    axis : direction of the member's z, of any length
    zero : direction of the member's x; its component along ``axis`` is ignored
    stage : of a chain, 1 to place the first stage, 0 to place the last one
    """

    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    zero: tuple[float, float, float] = (1.0, 0.0, 0.0)
    stage: int = 0

    @cached_property
    def rotation(self) -> Array:
        """R (3, 3): a vector v of the member's frame is R v in the machine's frame."""
        z = np.array(self.axis) / np.linalg.norm(self.axis)
        x = np.array(self.zero) - np.dot(self.zero, z) * z
        x /= np.linalg.norm(x)
        return np.column_stack([x, np.cross(z, x), z])


def placement(member: str, given: Placement | dict[str, Any] | None) -> Placement:
    """Read and check the placement of a member.

    Raises
    ------
    InputError
        for an unknown key, a vector without three finite numbers, an axis of zero length or along ``zero``.
    """
    if given is None:
        return Placement()
    if isinstance(given, Placement):
        return given
    where = f"machine.{member}.place"
    known_keys(given, ("at", "axis", "zero", "stage"), where)
    if given.get("stage", 1) != 1:
        raise InputError("stage", given["stage"], "1 for the first stage; the last one if left out", where)
    vectors = {key: vector(value, f"{where}.{key}") for key, value in given.items() if key != "stage"}
    found = Placement(**vectors, stage=given.get("stage", 0))
    if not np.linalg.norm(found.axis) > 0.0:
        raise InputError("axis", found.axis, "a direction", where)
    if not np.linalg.norm(np.cross(found.axis, found.zero)) > 1e-9 * np.linalg.norm(found.axis) * np.linalg.norm(
        found.zero
    ):
        raise InputError("zero", found.zero, "a direction that is not along axis", where)
    return found


def vector(value: object, where: str) -> tuple[float, float, float]:
    """Read three finite numbers.

    Raises
    ------
    InputError
        for anything else.
    """
    allowed, name = "three finite numbers [x, y, z]", where.rpartition(".")[2]
    if not isinstance(value, Sequence | np.ndarray) or isinstance(value, str) or len(value) != 3:
        raise InputError(name, value, allowed, where)
    try:
        x, y, z = (float(part) for part in value)
    except (TypeError, ValueError):
        raise InputError(name, value, allowed, where) from None
    if not np.isfinite([x, y, z]).all():
        raise InputError(name, value, allowed, where)
    return x, y, z


@dataclass(frozen=True)
class Member:
    """One mechanism of a machine.

    Parameters
    ----------
    name : prefix of its parameters and outputs, before the dot
    family : a family or chain, evaluated over a closed turn
    ratio : whole turns of its crank per turn of its driver, with the sense; not 0
    offset : its crank angle where the driving angle is 0 [rad]; the default of the parameter ``offset``
    driver : member and pose output that drive it, as ("needle", "psi1"); None is the main shaft
    place : its frame in the machine's frame; ``at`` is the default of the parameters ``x_at``, ``y_at``, ``z_at``
    drives : derivative of each output of the driver
    tip : a point fixed to the output link: along it, across it, along its axis; the defaults of ``x_tip`` ...
    eye : a point of the coupler: along it from its first joint; of a planar one also across it and along the axes; the
        defaults of ``x_eye`` ...
    columns : columns of its own parameters in the machine's design matrix
    mount : seat of its first crank on a shaft of the machine, instead of place, ratio, offset and driver
    carried : named points that turn with its output link, as a tip: those of the blade on it
    """

    name: str
    family: Family
    ratio: int = 1
    offset: float = 0.0
    driver: tuple[str, str] | None = None
    drives: Mapping[str, str] = field(default_factory=dict)
    place: Placement = field(default_factory=Placement)
    tip: tuple[float, float, float] | None = None
    eye: tuple[float, ...] | None = None
    columns: slice = field(default_factory=lambda: slice(0, 0))
    mount: Mount | None = None
    carried: tuple[tuple[str, tuple[float, float, float]], ...] = ()

    @property
    def alone(self) -> bool:
        """Whether the crank turns as the main shaft does, so that extrema over a turn are those of the family."""
        return self.driver is None and self.ratio == 1

    def designs(self, designs: Array) -> Array:
        """Design matrix of this member's family."""
        return np.ascontiguousarray(designs[:, self.columns])

    def column(self, designs: Array, name: str) -> Array:
        """Column of a parameter that the machine adds to those of the family, (n,)."""
        return designs[:, self.columns.stop + self._place[name]]

    @cached_property
    def _place(self) -> Mapping[str, int]:
        """Position of each added parameter behind those of the family."""
        return {p.name: k for k, p in enumerate(self.added)}

    def phase(self, designs: Array) -> Array:
        """Crank angle where the driving angle is 0, (n,)."""
        if self.mount is None:
            return self.column(designs, "offset")
        return self.mount.phase(designs, self.column(designs, "turn"), self.column(designs, "key"))

    def frame(self, designs: Array) -> Frame:
        """Frame of the family, of a chain the frame of the last stage, in the machine's frame."""
        if self.mount is None and not self.place.stage:
            return self._given(designs)
        found = self.frames(designs)[-1]
        assert found is not None
        return found

    def _given(self, designs: Array) -> Frame:
        """Frame of the stage to which ``place`` applies, in the machine's frame."""
        at, tilt = (self.columns.stop + self._place[name] for name in ("x_at", "x_tilt"))
        return Frame(tilted(self.place.rotation[None], designs[:, tilt : tilt + 3]), designs[:, at : at + 3])

    def frames(self, designs: Array) -> list[Frame | None]:
        """Frames of all stages in the machine's frame; None where a chain does not define the place of its stages."""
        own, stages = self.designs(designs), self.family.stages
        if len(stages) > 1 and not stages[-1].is_placed:
            return [None] * (len(stages) - 1) + [self.frame(designs)]
        inner = stage_frames(stages, own)
        if self.mount is not None:
            crank = crank_axis(stages[0].family, stages[0].designs(own))
            assert crank is not None
            first = self.mount.frame(designs, crank, self.column(designs, "shift"), self.column(designs, "turn"))
        elif self.place.stage:
            first = self._given(designs)
        else:
            last = self._given(designs)
            first = inner[-1].inverse.within(last)
            return [*(frame.within(first) for frame in inner[:-1]), last]
        return [frame.within(first) for frame in inner]

    def driving(self, most: int) -> list[str]:
        """Dotted names of the angle that drives it, and of the first derivatives of that angle."""
        assert self.driver is not None
        names = [self.driver[1]]
        for _ in range(most):
            names.append(self.drives[names[-1]])
        return [f"{self.driver[0]}.{name}" for name in names]

    def own(self, name: str) -> str:
        """Return the family's name for a dotted name; "" for a name of another member."""
        prefix = f"{self.name}."
        return name.removeprefix(prefix) if name.startswith(prefix) else ""

    def geared_parts(self, name: str) -> tuple[str, ...]:
        """Return the components of a magnitude that a crank with another motion than the main shaft's changes."""
        output = self.family.pose_output.get(name)
        return () if output is None or self.alone else output.parts

    @cached_property
    def added(self) -> tuple[Parameter, ...]:
        """Parameters beside those of the family: phase and place, tip, eye."""
        place = [
            Parameter("offset", "angle", "crank angle where the driving angle is 0", default=self.offset),
            *place_parameters("the member", self.place.at),
        ]
        tip = [
            Parameter(f"{axis}_tip", "length", f"tip {way} the output link", default=x)
            for axis, way, x in zip(AXES, ("along", "across", "along the axis of"), self.tip or (), strict=False)
        ]
        eye = [
            Parameter(f"{axis}_eye", "length", f"point of the coupler {way}", default=x)
            for axis, way, x in zip(AXES, ("along it", "across it", "along the axes"), self.eye or (), strict=False)
        ]
        return *(place if self.mount is None else self.mount.parameters), *tip, *eye

    @cached_property
    def derivatives(self) -> frozenset[str]:
        """Pose outputs that are derivatives with respect to the crank angle."""
        return frozenset(self.geared.derivative_of.values())

    @cached_property
    def geared(self) -> Family:
        """The family with the rates of effects among its derivatives."""
        rates = {low: high for found in self.family.every(Rates) for low, high in found.of.items()}
        return replace(self.family, derivative_of={**self.family.derivative_of, **rates}) if rates else self.family

    @cached_property
    def sites(self) -> Mapping[str, Site]:
        """Joints of all stages, points of links, fixed axes, by name."""
        return sites_of(self)

    @cached_property
    def site_of(self) -> Mapping[str, str]:
        """Name of the site of each coordinate."""
        return {f"{name}_{axis}": name for name in self.sites for axis in AXES}

    @cached_property
    def points(self) -> tuple[str, ...]:
        """Names of the points whose coordinates are given in the machine's frame."""
        return (*self.family.points, *(name for name, at in ((TIP, self.tip), (EYE, self.eye)) if at is not None))

    @cached_property
    def moving(self) -> tuple[str, ...]:
        """Names of the points whose velocity is given in the machine's frame."""
        return tuple(name for name in (*self.points, *dict(self.carried)) if self.sites[name].velocity is not None)
