"""Several mechanisms on one main shaft as one `Family`: dotted names, all points in the machine's frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from kernels.chains.links import chain_rule
from kernels.status import OK
from kernels.types import Array
from sweep.families.base import PER_RADIAN, Angles, Capability, Columns, Event, Family, Output, Parameter
from sweep.families.capabilities import Assembly
from sweep.families.chain import loop_of_part, magnitude
from sweep.families.curve_features import of_members
from sweep.families.frames import Frame
from sweep.families.machines.happenings import bends_of_threads, event_angles, switches_of_threads
from sweep.families.machines.main_shaft import ShaftTorque
from sweep.families.machines.moments import Taking
from sweep.families.machines.pressing import Pressing
from sweep.families.machines.relations import EventValue, Relation, Timing
from sweep.families.machines.sewing import Sewing
from sweep.families.machines.shaking import Shaking, refused
from sweep.families.machines.triangles import Entering
from sweep.families.parts import Member
from sweep.families.sites import AXES

# Relations with a step of their own, in the order in which these run.
WITH_STEP: tuple[type[Relation], ...] = (Taking, Entering, Sewing, ShaftTorque, Shaking, Pressing)


@dataclass(frozen=True, repr=False)
class Machine(Family):
    """A family made of members.

    Pose outputs of a member have its name as prefix, derivatives are with respect to the angle of the main shaft.  A
    point ``point`` of a member has ``point_x``, ``point_y``, ``point_z`` in the machine's frame, and ``dpoint_x`` ...
    if the member's outputs determine its velocity.
    """

    members: tuple[Member, ...] = ()
    relations: tuple[Relation, ...] = ()
    timings: tuple[Timing | EventValue, ...] = ()

    def member(self, name: str) -> Member:
        """Return the member of a name."""
        return next(m for m in self.members if m.name == name)

    def cycles(self, member: Member) -> int:
        """Return how often the motion of a member repeats in a turn: as the first crank that drives it turns."""
        while member.driver is not None:
            member = self.member(member.driver[0])
        return abs(member.ratio)

    def every(self, kind: type[Capability]) -> tuple[Capability, ...]:
        """All capabilities and relations of a type."""
        return (*super().every(kind), *(r for r in self.relations if isinstance(r, kind)))

    def split(self, name: str) -> tuple[Member, str] | None:
        """Split a dotted name into member and own name; None for a name of the machine itself."""
        return next(((m, m.own(name)) for m in self.members if m.own(name)), None)

    @cached_property
    def positions(self) -> Mapping[str, str]:
        """Positions of all members' followers."""
        return {f"{m.name}.{p}": f"{m.name}.{stage}" for m in self.members for p, stage in m.family.positions.items()}

    def follower(self, pose: str) -> str:
        """Name of the follower's position of the member that a pose output belongs to."""
        found = self.split(pose)
        return self.position if found is None else f"{found[0].name}.{found[0].family.position}"

    def outward_sign(self, position: str) -> str:
        """Return the sign parameter of the member with this position."""
        found = self.split(position)
        assert found is not None
        own = found[0].family.outward_sign(found[1])
        return own and f"{found[0].name}.{own}"

    @cached_property
    def _precise(self) -> Machine:
        """The machine with the most accurate poses its members have."""
        return _built(self, tuple(replace(m, family=m.family.precise()) for m in self.members))

    def with_families(self, families: Mapping[str, Family]) -> Machine:
        """Return the machine with other families of its members, such as those extended by effects."""
        return _built(self, tuple(replace(m, family=families.get(m.name, m.family)) for m in self.members))


def assemble(
    name: str, members: tuple[Member, ...], relations: tuple[Relation | Timing | EventValue | Event, ...]
) -> Machine:
    """Make the machine of members, each of which may be driven by an earlier one."""
    timings = tuple(r for r in relations if isinstance(r, Timing | EventValue))
    events = tuple(r for r in relations if isinstance(r, Event))
    others = tuple(r for r in relations if not isinstance(r, Timing | EventValue | Event))
    bare = Machine(name, "", (), "", (), _no_poses, relations=others, timings=timings, events=events)
    return _built(bare, members)


def _no_poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    raise AssertionError("a machine without members")


def _built(machine: Machine, members: tuple[Member, ...]) -> Machine:
    parameters: list[Parameter] = []
    placed = []
    for m in members:
        start = len(parameters)
        mine = (*m.family.parameters, *m.added)
        parameters += [replace(p, name=f"{m.name}.{p.name}", text=f"{m.name}: {p.text}") for p in mine]
        placed.append(replace(m, columns=slice(start, start + len(m.family.parameters))))
    parameters += [p for relation in machine.relations for p in relation.parameters]
    for shaft in dict.fromkeys(m.mount.shaft for m in members if m.mount):
        own = shaft.parameters
        columns = slice(len(parameters), len(parameters) + len(own))
        parameters += own
        placed = [
            replace(m, mount=replace(m.mount, columns=columns)) if m.mount and m.mount.shaft == shaft else m
            for m in placed
        ]
    outputs = _outputs(placed)
    derivative_of = {
        f"{m.name}.{name}": f"{m.name}.{of}" for m in placed for name, of in m.family.derivative_of.items()
    }
    sums = [r for r in machine.relations if isinstance(r, Shaking | ShaftTorque)]
    kinked = {o.name for o in outputs if o.kinks}
    outputs += [
        replace(o, kinks=o.kinks or (r in sums and not kinked.isdisjoint(r.needs(frozenset((o.name,))))))
        for r in machine.relations
        for o in r.outputs
    ]
    derivative_of |= {name: rate for r in machine.relations for name, rate in r.rates.items()}
    loops = tuple(_loop(m, loop) for m in placed for loop in m.family.every(Assembly))
    found = replace(
        machine,
        title=" and ".join(f"{m.name} ({m.family.title})" for m in placed),
        parameters=tuple(parameters),
        position=f"{placed[0].name}.{placed[0].family.position}",
        pose_outputs=tuple(outputs),
        derivative_of=derivative_of,
        outward="",
        analytic=all(m.family.analytic for m in placed),
        capabilities=(*loops, *of_members(placed, frozenset(o.name for r in sums for o in r.outputs))),
        dear={f"{m.name}.{k}": (f"{m.name}.{what}", ns) for m in placed for k, (what, ns) in m.family.dear.items()},
        members=tuple(placed),
    )
    found = replace(found, poses=partial(_poses, found))  # events of a thread are searched on poses of the others
    precise = partial(_precise_poses, found) if any(m.family.precise_poses for m in placed) else None
    smooth = (one for r in sums for one in r.smooth)
    known = (*found.capabilities, *switches_of_threads(found), *bends_of_threads(found), *smooth)
    found = replace(found, poses=partial(_poses, found), precise_poses=precise, capabilities=known)
    steps = [r.step(found) for kind in WITH_STEP for r in machine.relations if isinstance(r, kind)]
    return replace(found, steps=tuple(step for step in steps if step is not None))


def _outputs(placed: list[Member]) -> list[Output]:
    """List the pose outputs of the members, and the coordinates and velocities of their points."""
    outputs = [
        replace(o, name=f"{m.name}.{o.name}", own=f"{m.name}.{o.base}") for m in placed for o in m.family.pose_outputs
    ]
    for m in placed:
        for rate, unit, points, what in (
            ("", "length", m.points, ""),
            ("d", PER_RADIAN, m.moving, "velocity analogue, "),
        ):
            outputs += [
                Output(f"{m.name}.{rate}{p}_{axis}", unit, f"{m.name}: {what}{axis} of {p}, machine's frame", "ours")
                for p in points
                for axis in AXES
            ]
    return outputs


def _loop(member: Member, loop: Assembly) -> Assembly:
    return loop_of_part(loop, lambda name: f"{member.name}.{name}", member.designs)


def _precise_poses(machine: Machine, designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    return machine.precise().poses(designs, angles, wanted)


def _poses(machine: Machine, designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Compute the wanted outputs of members and relations, and the first status that is not OK."""
    # A search asks for few sets of outputs, many times.
    known: dict[frozenset[str], _Needs] = machine.derived.setdefault(_needs, {})
    if wanted not in known:
        known[wanted] = _needs(machine, wanted)
    asked = known[wanted]
    shape = (len(designs), angles.cos.shape[1])
    status = np.zeros(shape, np.uint8)
    found: dict[str, Any] = {}
    for needs in asked.members:
        columns = _member(needs, designs, angles, found)
        np.copyto(status, columns.pop("status"), where=status == OK)
        found |= {f"{needs.member.name}.{name}": values for name, values in columns.items()}
    found["phi"] = angles.phi
    if asked.events:
        events, code = event_angles(machine, designs)
        np.copyto(status, code[:, None], where=status == OK)
        found |= events
    found |= {name: designs[:, [column]] for name, column in asked.inputs.items()}
    frames = _frames(machine, designs) if any(isinstance(r, Shaking) for r in asked.relations) else {}
    for r in asked.relations:
        found |= r.on_frame(found, frames, wanted) if isinstance(r, Shaking) else r.compute(found, wanted)
        found |= refused(machine, r, designs, wanted, found, status)
    return {name: _whole(found[name], shape) for name in wanted} | {"status": status}


@dataclass(frozen=True)
class _OfMember:
    """Outputs needed of a member, by own names, and the motion and points that they are computed from."""

    member: Member
    own: frozenset[str]
    motion: frozenset[str]
    placed: tuple[str, ...]
    moving: tuple[str, ...]


@dataclass(frozen=True)
class _Needs:
    """Members, relations, columns of the design matrix and event angles needed for some wanted outputs."""

    members: tuple[_OfMember, ...]
    relations: tuple[Relation, ...]
    inputs: Mapping[str, int]
    events: bool


def _needs(machine: Machine, wanted: frozenset[str]) -> _Needs:
    relations = [r for r in machine.relations if not wanted.isdisjoint(o.name for o in r.outputs)]
    columns_of = machine.parameter_names
    needed = set(wanted).union(*(r.needs(wanted) for r in relations))
    inputs = needed.intersection(columns_of) | {p.name for r in relations for p in r.parameters}
    needed -= inputs
    changes = {name for name in needed if name.startswith("phi_")}
    needed -= changes
    for m in reversed(machine.members):
        needed |= {f"{m.name}.{part}" for name in needed for part in m.geared_parts(m.own(name))}
        needed |= _driving(m, frozenset(map(m.own, needed)) - {""})
    members = tuple(_of_member(m, own) for m in machine.members if (own := frozenset(map(m.own, needed)) - {""}))
    return _Needs(members, tuple(relations), {name: columns_of.index(name) for name in inputs}, bool(changes))


def _of_member(m: Member, own: frozenset[str]) -> _OfMember:
    placed = {m.site_of[name] for name in own if name in m.site_of}
    moving = tuple(name for name in m.moving if any(f"d{name}_{axis}" in own for axis in AXES))
    motion = {name for name in own if name in m.family.pose_output}
    motion |= {x for name in placed for x in m.sites[name].made_of}
    motion |= {x for name in moving for x in m.sites[name].rates}
    motion |= {name for derivative in motion for name in m.geared.orders(derivative)}
    return _OfMember(m, own, frozenset(motion), tuple(sorted(placed)), moving)


def _frames(machine: Machine, designs: Array) -> dict[str, Frame]:
    """Compute the frames of all stages, by names such as "looper2" or "looper"."""
    found: dict[str, Frame] = {}
    for m in machine.members:
        placed = zip(m.family.stages, m.frames(designs), strict=True)
        found |= {f"{m.name}{stage.tail}": frame for stage, frame in placed if frame is not None}
    return found


def _whole(values: Any, shape: tuple[int, int]) -> Any:
    """Expand values of one design to all, contiguous along poses, so that sums over the turn keep their bits."""
    return values if values.shape == shape else np.array(np.broadcast_to(values, shape), order="C")


def _driving(member: Member, own: frozenset[str]) -> set[str]:
    """Names of the driver's outputs that a member needs: its angle, and derivatives for the member's outputs."""
    if member.driver is None or not own:
        return set()
    most = max((len(member.geared.orders(name)) for name in _of_member(member, own).motion), default=0)
    return set(member.driving(most))


def _member(needs: _OfMember, designs: Array, angles: Angles, found: Mapping[str, Any]) -> dict[str, Any]:
    """Compute pose outputs of a member by own names, and ``status``; only once if no design varies it."""
    m = needs.member
    own_designs, phase = m.designs(designs), m.phase(designs)
    once = m.driver is None and angles.cos.shape[0] == 1 and len(designs) > 1
    if once and (own_designs[1:] == own_designs[0]).all() and (phase[1:] == phase[0]).all():
        own_designs, phase = own_designs[:1], phase[:1]
    turned = _turned(m, phase, angles, found)
    result: dict[str, Any] = dict(m.family.poses(own_designs, turned, needs.motion))
    _with_respect_to_shaft(m, result, found)
    if needs.placed or needs.moving:
        result |= _placed(needs, designs, result)
    return {name: result[name] for name in (*needs.own, "status")}


def _placed(needs: _OfMember, designs: Array, result: Mapping[str, Any]) -> dict[str, Any]:
    """Compute coordinates and velocities of a member's points in the machine's frame."""
    m, found = needs.member, dict[str, Any]()
    last = len(m.family.stages) - 1
    alone = all(m.sites[name].stage == last for name in needs.placed)
    frames = [None] * last + [m.frame(designs)] if alone else m.frames(designs)
    for order, names in (("", needs.placed), ("d", needs.moving)):
        for name in names:
            site = m.sites[name]
            frame, vector = frames[site.stage], site.velocity if order else site.at
            assert frame is not None and vector is not None
            put = frame.turned if order or site.free else frame.placed
            parts = put(vector(designs, result))
            found |= {f"{order}{name}_{axis}": part for axis, part in zip(AXES, parts, strict=True)}
    return found


def _turned(m: Member, phase: Array, angles: Angles, found: Mapping[str, Any]) -> Angles:
    """Compute the input angles of a member: the driver's angle times its ratio, plus its phase."""
    if m.driver is not None:
        return Angles.of(m.ratio * found[".".join(m.driver)] + phase[:, None])
    if m.ratio == 1 and not phase.any():
        return angles
    if angles.cos.shape[0] == 1 and (phase == phase[:1]).all():
        phase = phase[:1]
    return Angles.of(m.ratio * angles.phi + phase[:, None])


def _with_respect_to_shaft(m: Member, result: dict[str, Any], found: Mapping[str, Any]) -> None:
    """Convert derivatives by the member's crank angle to those by the main shaft's angle, in place."""
    if m.driver is None and m.ratio == 1:
        return
    tops = [name for name in result if name in m.derivatives and m.geared.derivative_of.get(name) not in result]
    for top in tops:
        names = m.geared.orders(top)
        if m.driver is None:
            for order, name in enumerate(names, start=1):
                result[name] = result[name] * float(m.ratio) ** order
            continue
        outer: list[Any] = [result[name] for name in names]
        # a driver that no design varies has a single row
        whole = [np.broadcast_to(found[name], outer[0].shape) for name in m.driving(len(names))[1:]]
        given: list[Any] = [np.ascontiguousarray(rate) for rate in whole]
        missing: list[Any] = [None] * (3 - len(names))
        chain_rule(np.full(len(outer[0]), float(m.ratio)), *given, *missing, *outer, *missing)
    result |= {name: magnitude(result, parts) for name in result if (parts := m.geared_parts(name))}
