"""Points and axes of a member: joints of all stages, fixed axes, tip, eye, blades; points of relations and tools."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from kernels.types import Array
from sweep.families.base import Coordinates, Stage
from sweep.families.capabilities import DesignMap, OutputLink, skeleton_of
from sweep.families.names import ends_in_digit

if TYPE_CHECKING:
    from sweep.families.parts import Member

AXES = "xyz"
TIP = "tip"
EYE = "eye"  # on the coupler, the link between the points b and c

VectorFunction: TypeAlias = Callable[[Array, Mapping[str, Any]], list[Any]]
"""Coordinates x, y, z in the frame of a stage from designs of the machine and pose outputs of the member."""


class Site(NamedTuple):
    """A point or direction of one stage.

    Parameters
    ----------
    stage : index of the stage, from 0
    made_of : pose outputs of the member
    at : coordinates from these pose outputs
    free : whether it is a direction
    rates, velocity : pose outputs and function of the derivative by the crank angle; empty and None if not available
    """

    stage: int
    made_of: tuple[str, ...]
    at: VectorFunction
    free: bool = False
    rates: tuple[str, ...] = ()
    velocity: VectorFunction | None = None


def sites_of(member: Member) -> dict[str, Site]:
    """Return the sites of a member by name: joints of a chain's stage have its number, those of the last one need none.

    ``line_axis`` is the direction of the fixed axis or line ``line``.
    """
    found: dict[str, Site] = {}
    stages = member.family.stages
    for k, stage in enumerate(stages):
        for name, at in stage.family.points.items():
            for tail in _tails(stages, k, name):
                x, y, z = (one and f"{one}{tail}" for one in at)
                found[f"{name}{tail}"] = _moving(member, k, (x, y, z))
        for name, fixed in skeleton_of(stage.family).fixed.items():
            for tail in _tails(stages, k, name):
                found[f"{name}{tail}"] = Site(k, (), partial(_standing, member, stage, fixed.at))
                if fixed.axis is not None:
                    axis = partial(_standing, member, stage, fixed.axis)
                    found[f"{name}{tail}_axis"] = Site(k, (), axis, free=True)
    if member.tip is not None:
        found[TIP] = _on_link(member)
    if member.eye is not None:
        found[EYE] = _on_coupler(member)
    return found | {name: _on_link(member, at) for name, at in member.carried}


def _tails(stages: Sequence[Stage], k: int, *names: str) -> list[str]:
    """Return the permitted suffixes of names of stage k: its number, for the last stage also nothing."""
    tail = stages[k].tail
    bare = tail and k + 1 == len(stages) and not any(map(ends_in_digit, names))
    return [tail, ""] if bare else [tail]


def links_of(member: Member) -> dict[str, tuple[str, str]]:
    """Return the links of a member as segments, by the names of their two sites, if both ends are sites."""
    found, known, stages = {}, member.sites, member.family.stages
    for k, stage in enumerate(stages):
        for link in skeleton_of(stage.family).links:
            for tail in _tails(stages, k, link.name, *link.joints[:2]):
                ends = [f"{joint}{tail}" for joint in link.joints[:2]]
                if len(ends) == 2 and set(ends) <= known.keys():
                    found[f"{link.name}{tail}".replace(" ", "_")] = (ends[0], ends[1])
    return found


def _moving(member: Member, stage: int, at: Coordinates) -> Site:
    """Make a point whose coordinates are pose outputs, as for most joints."""
    of = member.family.derivative_of
    known = all(x is None or x in of for x in at)
    rates = [x and of[x] for x in at] if known else []
    moved = partial(_read, rates) if known else None
    return Site(stage, _named(at), partial(_read, at), rates=_named(rates), velocity=moved)


def _named(names: Sequence[str | None]) -> tuple[str, ...]:
    return tuple(name for name in names if name)


def _read(names: Sequence[str | None], designs: Array, result: Mapping[str, Any]) -> list[Any]:
    return [result[name] if name else 0.0 for name in names]


def _standing(member: Member, stage: Stage, of: DesignMap, designs: Array, result: Mapping[str, Any]) -> list[Any]:
    at = of(stage.designs(member.designs(designs)))
    return [at[:, [k]] for k in range(3)]


def _on_link(member: Member, fixed: tuple[float, float, float] | None = None) -> Site:
    """Make a point that turns with the output link: the tip, with its place in the designs, or a ``fixed`` one."""
    family = member.family
    link, position, rate = family.find(OutputLink), family.position, family.derivative_of.get(family.position)

    def point(designs: Array) -> Sequence[Any]:
        return fixed or [member.column(designs, f"{axis}_tip")[:, None] for axis in AXES]

    def at(designs: Array, result: Mapping[str, Any]) -> list[Any]:
        assert link is not None
        return link.carried(member.designs(designs), result[position], point(designs))

    def velocity(designs: Array, result: Mapping[str, Any]) -> list[Any]:
        assert rate is not None
        x, y, _ = point(designs)
        cos, sin, speed = np.cos(result[position]), np.sin(result[position]), result[rate]
        return [speed * (-x * sin - y * cos), speed * (x * cos - y * sin), 0.0 * speed]

    last = len(family.stages) - 1
    if rate is None:
        return Site(last, (position,), at)
    return Site(last, (position,), at, rates=(position, rate), velocity=velocity)


def coupler_joints(member: Member) -> tuple[Coordinates, Coordinates] | None:
    """Coordinates of both joints of the coupler; None if the family has none of that name."""
    points = member.family.points
    return (points["b"], points["c"]) if {"b", "c"} <= points.keys() else None


def is_planar(member: Member) -> bool:
    """Whether the coupler moves in a plane z = constant, so that its two joints define its position."""
    joints = coupler_joints(member)
    return joints is not None and all(at[2] is None for at in joints)


def _on_coupler(member: Member) -> Site:
    """Make a point of the coupler: along it from b; of a planar one also across it, counter-clockwise, and along z."""
    joints, count = coupler_joints(member), len(member.eye or ())
    assert joints is not None

    def at(designs: Array, result: Mapping[str, Any]) -> list[Any]:
        eye = [member.column(designs, f"{axis}_eye")[:, None] for axis in AXES[:count]]
        b, c = (_read(names, designs, result) for names in joints)
        along = [end - start for start, end in zip(b, c, strict=True)]
        length = np.sqrt(along[0] ** 2 + along[1] ** 2 + along[2] ** 2)
        point = [start + eye[0] / length * part for start, part in zip(b, along, strict=True)]
        if count == 1:
            return point
        return [point[0] - eye[1] / length * along[1], point[1] + eye[1] / length * along[0], point[2] + eye[2]]

    return Site(len(member.family.stages) - 1, (*_named(joints[0]), *_named(joints[1])), at)


@dataclass(frozen=True)
class Spot:
    """A point of a relation: one of a member, one at the distance ``far`` along a line from it, or a fixed one ``at``.

    ``on`` and ``line`` are dotted names of the point and of the direction, "" for none.
    """

    on: str = ""
    line: str = ""
    far: float = 0.0
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def needs(self, moving: bool) -> set[str]:
        """Return the names of the coordinates of point and line, with velocities if ``moving``."""
        return components(self.on, self.line, rate_of(self.on) if moving else "")

    def position(self, found: Mapping[str, Any]) -> list[Any]:
        """Return the coordinates of the point, each (n, m) or a number."""
        if not self.on:
            return list(self.at)
        start = vector_of(self.on, found)
        if not self.line:
            return start
        return [x + self.far * along for x, along in zip(start, vector_of(self.line, found), strict=True)]

    def velocity(self, found: Mapping[str, Any]) -> list[Any]:
        """Return the derivative of the coordinates by the main shaft's angle, (n, m): a needle keeps its direction."""
        return vector_of(rate_of(self.on), found) if self.on else [0.0, 0.0, 0.0]


def rate_of(name: str) -> str:
    """Return the dotted name of the velocity of a point; "" for a name without a dot."""
    member, dot, own = name.partition(".")
    return f"{member}.d{own}" if dot else ""


def components(*names: str) -> set[str]:
    """Return the names of the components of vectors in the machine's frame; "" is none."""
    return {f"{name}_{axis}" for name in names if name for axis in AXES}


def vector_of(name: str, found: Mapping[str, Any]) -> list[Any]:
    """Return the components of a vector in the machine's frame."""
    return [found[f"{name}_{axis}"] for axis in AXES]
