"""Parts of chains and machines: a stage, a member with its place in the machine's frame, and points of a member."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from kernels.types import Array
from sweep.errors import InputError
from sweep.families.base import Family, Parameter
from sweep.families.capabilities import Coordinates, OutputLink, Points
from sweep.families.frames import WHOLE, Frame, crank_axis, place_parameters, stage_frames, tilted
from sweep.families.shafts import Mount
from sweep.families.sites import AXES, Site, sites_of

TIP = "tip"
EYE = "eye"  # on the coupler, the link between the points b and c


@dataclass(frozen=True)
class Placement:
    """A member's frame in the machine's frame.

    Parameters
    ----------
    at : where the origin of the member's frame stands [length]
    axis : direction of the member's z, of any length
    zero : direction of the member's x; what it has along ``axis`` does not count
    stage : of a chain, 1 where the first stage stands there, 0 for the last one
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
    """Placement of a member from what a user gives, checked.

    Raises
    ------
    InputError
        for a key that is none, a vector without three finite numbers, an axis of no length or along ``zero``.
    """
    if given is None:
        return Placement()
    if isinstance(given, Placement):
        return given
    where = f"machine.{member}.place"
    for key in given:
        if key not in ("at", "axis", "zero", "stage"):
            raise InputError(key, given[key], "at, axis, zero, stage", where)
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
    """Three finite numbers out of what a user gives.

    Raises
    ------
    InputError
        for anything else.
    """
    allowed = "three finite numbers [x, y, z]"
    if not isinstance(value, Sequence | np.ndarray) or isinstance(value, str) or len(value) != 3:
        raise InputError(where, value, allowed, where)
    try:
        x, y, z = (float(part) for part in value)
    except (TypeError, ValueError):
        raise InputError(where, value, allowed, where) from None
    if not np.isfinite([x, y, z]).all():
        raise InputError(where, value, allowed, where)
    return x, y, z


@dataclass(frozen=True)
class Stage:
    """One mechanism of a chain: its number from 1, and where its parameters stand in the chain's design matrix."""

    number: int
    family: Family
    columns: slice
    kappa: int | None = None  # columns of the coupling to the stage before; none for stage 1
    offset: int | None = None
    shift: int | None = None  # columns of its place on the shaft between; none where the families name no such axis
    turn: int | None = None

    @property
    def is_placed(self) -> bool:
        """Whether it is known where its frame stands in that of the stage before."""
        return self.shift is not None

    def designs(self, designs: Array) -> Array:
        """Design matrix of this stage alone."""
        return np.ascontiguousarray(designs[:, self.columns])


@dataclass(frozen=True)
class Member:
    """One mechanism of a machine.

    Parameters
    ----------
    name : what stands before the dot of its parameters and outputs
    family : a family or chain, evaluated over a closed turn
    ratio : whole turns of its crank for one of what drives it, with the sense; not 0
    offset : its crank angle where the driving angle is 0 [rad]; the default of the parameter ``offset``
    driver : member and pose output that drive it, as ("needle", "psi1"); None is the main shaft
    place : its frame in the machine's frame; ``at`` is the default of the parameters ``x_at``, ``y_at``, ``z_at``
    drives : of the driver's outputs, the derivative of each
    tip : a point fixed to the output link: along it, across it, along its axis; the defaults of ``x_tip`` ...
    eye : a point of the coupler: along it from its first joint; of a planar one also across it and along the axes; the
        defaults of ``x_eye`` ...
    columns : where its own parameters stand in the machine's design matrix
    mount : how its first crank sits on a shaft of the machine, instead of place, ratio, offset and driver
    carried : named points that turn with its output link, as a tip: those of the blade that it carries
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

    def designs(self, designs: Array) -> Array:
        """Design matrix of this member's family."""
        return np.ascontiguousarray(designs[:, self.columns])

    def column(self, designs: Array, name: str) -> Array:
        """Column of one of the added parameters, (n,)."""
        return designs[:, self.columns.stop + self._place[name]]

    @cached_property
    def _place(self) -> Mapping[str, int]:
        """Of each added parameter where it stands behind those of the family."""
        return {p.name: k for k, p in enumerate(self.added)}

    def phase(self, designs: Array) -> Array:
        """Crank angle where the driving angle is 0, (n,)."""
        if self.mount is None:
            return self.column(designs, "offset")
        return self.mount.phase(designs, self.column(designs, "turn"), self.column(designs, "key"))

    def frame(self, designs: Array) -> Frame:
        """Frame of its family, of a chain that of the last stage, in the machine's."""
        if self.mount is None and not self.place.stage:
            return self._given(designs)
        found = self.frames(designs)[-1]
        assert found is not None
        return found

    def _given(self, designs: Array) -> Frame:
        """Frame that ``place`` gives, of the stage that it is about."""
        at, tilt = (self.columns.stop + self._place[name] for name in ("x_at", "x_tilt"))
        return Frame(tilted(self.place.rotation[None], designs[:, tilt : tilt + 3]), designs[:, at : at + 3])

    def frames(self, designs: Array) -> list[Frame | None]:
        """Frames of all stages in the machine's; None where a chain does not say how they stand to each other."""
        own, stages = self.designs(designs), getattr(self.family, "stages", ())
        if stages and not stages[-1].is_placed:
            return [None] * (len(stages) - 1) + [self.frame(designs)]
        inner = stage_frames(stages, own) if stages else [WHOLE]
        if self.mount is not None:
            family = stages[0].family if stages else self.family
            crank = crank_axis(family, stages[0].designs(own) if stages else own)
            assert crank is not None
            first = self.mount.frame(designs, crank, self.column(designs, "shift"), self.column(designs, "turn"))
        elif self.place.stage:
            first = self._given(designs)
        else:
            last = self._given(designs)
            first = inner[-1].inverse.within(last)
            return [*(frame.within(first) for frame in inner[:-1]), last]
        return [frame.within(first) for frame in inner]

    def own(self, name: str) -> str:
        """Give a dotted name as the member's family knows it; "" for a name of another member."""
        prefix = f"{self.name}."
        return name.removeprefix(prefix) if name.startswith(prefix) else ""

    def geared_parts(self, name: str) -> tuple[str, ...]:
        """Name what a magnitude is made of anew where the crank does not turn as the main shaft does."""
        output = self.family.pose_output.get(name)
        return () if output is None or (self.driver is None and self.ratio == 1) else output.parts

    @cached_property
    def added(self) -> tuple[Parameter, ...]:
        """Its parameters beside those of its family: phase and place, tip, eye."""
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
        return frozenset(self.family.derivative_of.values())

    @cached_property
    def sites(self) -> Mapping[str, Site]:
        """Joints of all stages, carried points and fixed axes, by name."""
        return sites_of(self)

    @cached_property
    def site_of(self) -> Mapping[str, str]:
        """Of the name of each coordinate of a site, that of the site; points have their own."""
        return {f"{name}_{axis}": name for name in self.sites if name not in self.points for axis in AXES}

    @cached_property
    def points(self) -> tuple[str, ...]:
        """Names of the points whose coordinates are given in the machine's frame."""
        named = [name for points in self.family.every(Points) for name in points.at]
        return (*named, *((TIP,) if self.tip is not None else ()), *((EYE,) if self.eye is not None else ()))

    @cached_property
    def moving(self) -> Mapping[str, tuple[str | None, ...]]:
        """Of the points whose velocity the family's outputs give, the outputs that it is made of."""
        found: dict[str, tuple[str | None, ...]] = {}
        rates = self.family.derivative_of
        for name, at in ((n, at) for points in self.family.every(Points) for n, at in points.at.items()):
            if all(x is None or x in rates for x in at):
                found[name] = tuple(x and rates[x] for x in at)
        on_link = [*((TIP,) if self.tip is not None else ()), *(name for name, _ in self.carried)]
        if self.family.position in rates:
            found |= dict.fromkeys(on_link, (rates[self.family.position],))
        return found


def coordinates(
    m: Member, point: str, frame: Frame | None, designs: Array, own_designs: Array, result: Mapping[str, Any]
) -> dict[str, Any]:
    """Coordinates of a point in the machine's frame, (n, m), from those in the frame of the family."""
    assert frame is not None
    if point == TIP:
        link = m.family.find(OutputLink)
        assert link is not None
        tip = (m.column(designs, f"{axis}_tip")[:, None] for axis in AXES)
        local = link.carried(own_designs, result[m.family.position], tip)
    elif point == EYE:
        eye = [m.column(designs, f"{axis}_eye")[:, None] for axis, _ in zip(AXES, m.eye or (), strict=False)]
        local = _on_coupler(m, result, eye)
    else:
        local = _local(m, point, result)
    placed = frame.placed(local)
    return {f"{point}_{axis}": part for axis, part in zip(AXES, placed, strict=True)}


def coupler_joints(m: Member) -> tuple[Coordinates, Coordinates] | None:
    """Coordinates of both joints of the coupler; None where the family does not give them."""
    named = {name: at for points in m.family.every(Points) for name, at in points.at.items()}
    return (named["b"], named["c"]) if {"b", "c"} <= set(named) else None


def is_planar(m: Member) -> bool:
    """Whether the coupler moves in a plane z = constant, so that its two joints tell how it stands."""
    joints = coupler_joints(m)
    return joints is not None and all(at[2] is None for at in joints)


def _local(m: Member, point: str, result: Mapping[str, Any]) -> list[Any]:
    names = next(points.at[point] for points in m.family.every(Points) if point in points.at)
    return [result[name] if name else 0.0 for name in names]


def _on_coupler(m: Member, result: Mapping[str, Any], eye: list[Any]) -> list[Any]:
    """Place a point of the coupler: along it from b; of a planar one also across it, counter-clockwise, and along z."""
    b, c = (_local(m, point, result) for point in "bc")
    along = [end - start for start, end in zip(b, c, strict=True)]
    length = np.sqrt(along[0] ** 2 + along[1] ** 2 + along[2] ** 2)
    point = [start + eye[0] / length * part for start, part in zip(b, along, strict=True)]
    if len(eye) == 1:
        return point
    return [point[0] - eye[1] / length * along[1], point[1] + eye[1] / length * along[0], point[2] + eye[2]]


def velocity(m: Member, point: str, frame: Frame | None, designs: Array, result: Mapping[str, Any]) -> dict[str, Any]:
    """Velocity analogue of a point in the machine's frame, (n, m): the frame of a member does not move."""
    assert frame is not None
    carried = dict(m.carried)
    if point == TIP or point in carried:
        x, y = (
            carried[point][:2]
            if point in carried
            else (m.column(designs, name)[:, None] for name in ("x_tip", "y_tip"))
        )
        angle, rate = result[m.family.position], result[str(m.moving[point][0])]
        cos, sin = np.cos(angle), np.sin(angle)
        local = [rate * (-x * sin - y * cos), rate * (x * cos - y * sin), 0.0 * rate]
    else:
        local = [result[name] if name else 0.0 for name in m.moving[point]]
    turned = frame.turned(local)
    return {f"d{point}_{axis}": part for axis, part in zip(AXES, turned, strict=True)}
