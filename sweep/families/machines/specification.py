"""Machines from the members, shafts, tools and relations that a user writes, with all checks."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sweep.errors import InputError, MissingInput, choices, known_keys, nearest, number
from sweep.families.base import PER_RADIAN, Event, Family, Turn
from sweep.families.capabilities import OutputLink
from sweep.families.frames import crank_axis
from sweep.families.link_tree import LinkTree
from sweep.families.machines.happenings import check_happenings
from sweep.families.machines.machine import Machine, assemble
from sweep.families.machines.main_shaft import DrivenMember, ShaftTorque
from sweep.families.machines.pressing import read_pressing
from sweep.families.machines.relations import (
    Distance,
    EventValue,
    PointSpeed,
    Relation,
    Timing,
    check_unique,
    known_names,
    two_names,
)
from sweep.families.machines.shaking import Shaken, Shaking, shaken
from sweep.families.machines.stitching import read_entering, read_sewing, read_taking, read_thread
from sweep.families.machines.tools import (
    BLADE_KEYS,
    NEEDLE_KEYS,
    PLATE_KEYS,
    SEAM_KEYS,
    Tool,
    read_gap,
    read_height,
    read_tools,
)
from sweep.families.names import ends_in_digit
from sweep.families.parameter import reads_as_degrees
from sweep.families.parts import Member, placement, vector
from sweep.families.shafts import MOUNT_KEYS, SHAFT_KEYS, Mount, Shaft, read_mount, read_shafts, turns
from sweep.families.sites import coupler_joints, is_planar

MEMBER_KEYS = ("family", "chain", "ratio", "offset", "driver", "place", "tip", "eye", *MOUNT_KEYS)
RELATION_KINDS = (
    "distance", "speed", "timing", "event", "value", "torque", "shaking", "thread", "gap", "take", "enter", "sew",
    "above", "press",
)  # fmt: skip
READERS: dict[str, Callable[[str, Mapping[str, Any], Mapping[str, Member], Mapping[str, Tool]], Relation]] = {
    "gap": read_gap, "take": read_taking, "enter": read_entering, "above": read_height, "thread": read_thread,
}  # fmt: skip
DERIVATIVES = 3  # of the angle that drives a member: its jerk needs all of them
_WORD = re.compile(r"[A-Za-z][A-Za-z0-9_]*")

FindFamily = Callable[[str | Sequence[str]], Family]


@dataclass(frozen=True)
class Specification:
    """The text of a machine as nested tuples: hashable, so that each machine is built once."""

    members: tuple[tuple[str, tuple[tuple[str, Any], ...]], ...]
    relations: tuple[tuple[str, tuple[tuple[str, Any], ...]], ...]
    shafts: tuple[tuple[str, tuple[tuple[str, Any], ...]], ...] = ()
    tools: tuple[tuple[str, tuple[tuple[str, Any], ...]], ...] = ()


def specification(
    members: Mapping[str, Any],
    relations: Mapping[str, Any] | None,
    shafts: Mapping[str, Any] | None = None,
    tools: Mapping[str, Any] | None = None,
) -> Specification:
    """Convert the tables that a user wrote to a hashable specification.

    Raises
    ------
    InputError
        if a member is neither a family's name, a list of them, nor a table.
    """
    found = []
    for name, given in members.items():
        if isinstance(given, str):
            table: Mapping[str, Any] = {"family": given}
        elif isinstance(given, Mapping):
            table = given
        elif isinstance(given, Sequence):
            table = {"chain": given}
        else:
            raise InputError(str(name), given, "a family, a list of families, or a table", "machine")
        found.append((name, _frozen(table)))
    between = tuple((name, _frozen(r)) for name, r in (relations or {}).items())
    turning = tuple((name, _frozen(s, "shaft", SHAFT_KEYS)) for name, s in (shafts or {}).items())
    working = tuple(
        (name, _frozen(t, "tool", (*NEEDLE_KEYS, *BLADE_KEYS, *SEAM_KEYS, *PLATE_KEYS)))
        for name, t in (tools or {}).items()
    )
    return Specification(tuple(found), between, turning, working)


def _frozen(table: Any, what: str = "relation", keys: Sequence[str] = RELATION_KINDS) -> tuple[tuple[str, Any], ...]:
    if not isinstance(table, Mapping):
        raise InputError(what, table, f"a table with one of {', '.join(keys)}", "machine")
    return tuple((str(key), _hashable(value)) for key, value in table.items())


def _hashable(value: Any) -> Any:
    if isinstance(value, Mapping):
        return tuple((str(key), _hashable(part)) for key, part in value.items())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return tuple(_hashable(part) for part in value)
    return value


def built(given: Specification, find: FindFamily) -> Machine:
    """Build and check the machine of a specification.

    Raises
    ------
    InputError
        for a name that is no plain word, an unknown key or family, a ratio that is no whole number, a driver that does
        not stand before, a tip of a member without a turning output link, or a relation of unknown points.
    """
    if not given.members:
        raise InputError("members", {}, "at least one member", "machine")
    members: dict[str, Member] = {}
    shafts = read_shafts({name: dict(table) for name, table in given.shafts}, placement)
    for name, table in given.members:
        if not _WORD.fullmatch(name) or name in members:
            raise InputError("member", name, "a plain word, each once", "machine")
        members[name] = _member(name, dict(table), members, shafts, find)
    for name, _ in given.tools:
        if not _WORD.fullmatch(name) or name in members:
            raise InputError("tool", name, "a plain word that is no member", "machine.tools")
    tools = read_tools({name: dict(table) for name, table in given.tools}, members)
    plain = {name: dict(table) for name, table in given.relations if not {"event", "value"} & set(dict(table))}
    known: dict[str, Any] = {
        name: read_pressing(name, table, members, find) if "press" in table else _relation(name, table, members, tools)
        for name, table in plain.items()
        if "sew" not in table
    }
    known |= {name: read_sewing(name, table, known) for name, table in plain.items() if "sew" in table}
    before = assemble("", tuple(members.values()), tuple(r for r in known.values() if not isinstance(r, Timing)))
    events = {
        name: (_event if "event" in dict(table) else _reading)(name, dict(table), before)
        for name, table in given.relations
        if name not in plain
    }
    relations = tuple(known[name] if name in known else events[name] for name, _ in given.relations)
    for relation in relations:
        if not _WORD.fullmatch(relation.name) or ends_in_digit(relation.name) or relation.name in members:
            allowed = "a plain word without a digit at its end that is no member"
            raise InputError("relation", relation.name, allowed, "machine.relations")
    title = ", ".join(f"{m.name}: {m.family.name}" for m in members.values())
    machine = assemble(f"machine ({title})", tuple(members.values()), relations)
    check_happenings(machine)
    every = [output for relation in machine.relations for output in relation.outputs]
    every += [output for step in machine.steps for output in step.provides] + [t.output for t in machine.timings]
    places = [f"{word}_{event.name}" for event in machine.events for word in ("phi", "count")]
    check_unique([*machine.parameter_names, *(output.name for output in every), *places])
    return machine


def _member(
    name: str, table: dict[str, Any], earlier: Mapping[str, Member], shafts: Mapping[str, Shaft], find: FindFamily
) -> Member:
    where = f"machine.{name}"
    known_keys(table, MEMBER_KEYS, where)
    if ("family" in table) == ("chain" in table):
        raise InputError("family", table.get("family"), "either family or chain", where)
    family = find(table["family"]) if "family" in table else find(list(table["chain"]))
    if not isinstance(family.domain, Turn):
        raise InputError("family", family.name, "a family over a closed turn", where)
    mount = _mount(table, family, shafts, where)
    ratio = turns(table, where) if mount is None else mount.ratio
    offset = number("offset", table.get("offset", 0.0), where, "an angle in rad")
    if reads_as_degrees(offset):
        allowed = "an angle in rad, which this does not look like; math.radians makes it one"
        raise InputError("offset", offset, allowed, where)
    tip = None if table.get("tip") is None else vector(table["tip"], f"{where}.tip")
    if tip is not None and family.find(OutputLink) is None:
        raise InputError("tip", tip, f"a member whose output link turns; {family.name} has none", where)
    driver = _driver(table.get("driver"), earlier, where)
    drives = {} if driver is None else dict(earlier[driver[0]].family.derivative_of)
    spot = placement(name, None if table.get("place") is None else dict(table["place"]))
    if spot.stage and len(family.stages) > 1 and not family.stages[-1].is_placed:
        allowed = "a chain whose stages have places; left out, the frame is that of the last stage"
        raise InputError("stage", spot.stage, allowed, f"{where}.place")
    member = Member(name, family, ratio, offset, driver, drives, spot, tip, mount=mount)
    return member if table.get("eye") is None else replace(member, eye=_eye(member, table["eye"], f"{where}.eye"))


def _mount(table: dict[str, Any], family: Family, shafts: Mapping[str, Shaft], where: str) -> Mount | None:
    """Read the mount of a member on a shaft; None where the machine has no shafts or another member drives it."""
    if "shaft" not in table:
        for key in MOUNT_KEYS[1:]:
            if key in table:
                raise InputError(key, table[key], "nothing here: it belongs to a member that names its shaft", where)
        if shafts and table.get("driver", "shaft") == "shaft":
            raise MissingInput("shaft", f"the shaft that drives it: {', '.join(shafts)}", where)
        return None
    first, *_, last = (*family.stages, family.stages[-1])
    has_axis = crank_axis(first.family, np.ones((1, len(first.family.parameters)))) is not None
    if not has_axis or (last is not first and not last.is_placed):
        raise InputError("family", family.name, "a family with a crank axis, its stages in one frame", where)
    return read_mount(table, shafts, where)


def _eye(member: Member, given: Any, where: str) -> tuple[float, ...]:
    """Read a point of the coupler; on a spatial one only along its line, as its spin about that is undetermined."""
    x, y, z = vector(given, where)
    if coupler_joints(member) is None:
        raise InputError("eye", given, f"a member with a coupler; {member.family.name} has none", where)
    if is_planar(member):
        return x, y, z
    if (y, z) != (0.0, 0.0):
        raise InputError("eye", given, "[x, 0, 0]: on the line of the joints of a coupler that moves in space", where)
    return (x,)


def _driver(given: object, earlier: Mapping[str, Member], where: str) -> tuple[str, str] | None:
    if given is None or given == "shaft":
        return None
    angles = [
        f"{m.name}.{o.name}"
        for m in earlier.values()
        for o in m.family.pose_outputs
        if o.wraps and len(m.family.derivatives(o.name)) > DERIVATIVES
    ]
    if given not in angles:
        known = ", ".join(["shaft", *angles])
        allowed = f"the main shaft, or an angle with three derivatives of a member that stands before: {known}"
        raise InputError("driver", given, allowed, where)
    member, _, output = str(given).partition(".")
    return member, output


def _reading(name: str, table: dict[str, Any], before: Machine) -> EventValue:
    """Make the relation that reads a pose output of a member or an earlier relation at a crank angle."""
    where, given = f"machine.relations.{name}", table["value"]
    if len(table) != 1:
        raise InputError(name, dict(table), "value alone", where)
    if not isinstance(given, tuple) or len(given) != 2 or not all(isinstance(part, str) for part in given):
        raise InputError("value", given, "a pose output and a crank angle", where)
    of, place = given
    if of not in before.pose_output:
        raise InputError("value", of, f"a pose output of the machine{nearest(of, before.pose_output)}", where)
    output, order = before.pose_output[of], len(before.orders(of))
    if order and output.unit == "length":  # the name no longer says that it is a derivative
        output = replace(output, unit=PER_RADIAN if order == 1 else f"{PER_RADIAN}^{order}")
    return EventValue(name, output, (place,))


def _event(name: str, table: dict[str, Any], before: Machine) -> Event:
    """Make the event at which a pose output of the machine, a relation's or a member's, passes a level."""
    where = f"machine.relations.{name}"
    known_keys(table, ("event", "level", "rising"), where)
    of, rising = table["event"], table.get("rising", True)
    if of not in before.pose_output:
        raise InputError("event", of, f"a pose output of the machine{nearest(str(of), before.pose_output)}", where)
    level = number("level", table.get("level", 0.0), where, f"a number, in the unit of {of}")
    if not isinstance(rising, bool):
        raise InputError("rising", rising, "true or false", where)
    text = f"{of} passes {level:g} {'upwards' if rising else 'downwards'}"
    return Event(name, of, text, level, rising)


def _relation(
    name: str, table: dict[str, Any], members: Mapping[str, Member], tools: Mapping[str, Tool]
) -> Relation | Timing:
    where = f"machine.relations.{name}"
    for key, read in READERS.items():
        if key in table:
            return read(name, table, members, tools)
    if len(kinds := [key for key in table if key in RELATION_KINDS]) > 1:
        raise InputError(name, dict(table), f"one kind of relation, not {' and '.join(kinds)}", where)
    if len(table) != 1 or not kinds:
        raise InputError(name, dict(table), f"one of {choices(' '.join(table), RELATION_KINDS)}", where)
    kind, given = next(iter(table.items()))
    if not isinstance(given, tuple) or not all(isinstance(part, str) for part in given):
        raise InputError(kind, given, "a list of names", where)
    if kind == "distance":
        points = [f"{m.name}.{point}" for m in members.values() for point in m.points]
        return Distance(name, two_names(given, points, "points", where))
    if kind == "speed":
        moving = [f"{m.name}.{point}" for m in members.values() for point in m.moving]
        if len(given) == 1:
            return PointSpeed(name, known_names(given, moving, "points whose velocity is known", where))
        return PointSpeed(name, two_names(given, moving, "points whose velocity is known", where))
    if kind == "timing":
        return Timing(name, two_names(given, None, "crank angles", where))
    known = {f"{m.name}{number}": (m.name, number) for m in members.values() for number in _stages(m.family)}
    known |= {m.name: (m.name, _stages(m.family)[0]) for m in members.values()}
    for part in given:
        if part not in known:
            raise InputError(kind, part, f"members: {choices(part, known)}", where)
    if kind == "torque":
        return _shaft_torque(name, [known[part] for part in given], members, where)
    return Shaking(name, tuple(_shaken(members, [known[part] for part in given], where)))


def _shaft_torque(name: str, listed: list[tuple[str, str]], members: Mapping[str, Member], where: str) -> ShaftTorque:
    """Make the torque that members take from the main shaft, at the first stage of each."""
    for member, stage in listed:
        if stage not in ("", "1") or listed.count((member, stage)) > 1:
            raise InputError("torque", f"{member}{stage}", "members each once: a chain takes torque at stage 1", where)
    rubs = all(
        (tree := stage.find(LinkTree)) is None or tree.rubs
        for member, _ in listed
        for stage in (s.family for s in members[member].family.stages)
    )
    return ShaftTorque(
        name, tuple(DrivenMember(member, stage, members[member].ratio) for member, stage in listed), rubs
    )


def _shaken(members: Mapping[str, Member], listed: list[tuple[str, str]], where: str) -> Iterator[Shaken]:
    """Yield the stages whose shaking force is asked for, each once and in a known frame."""
    for member, stage in listed:
        m = members[member]
        stages = m.family.stages
        if listed.count((member, stage)) > 1:
            raise InputError("shaking", f"{member}{stage}", "every stage once", where)
        if len(stages) > 1 and not stages[-1].is_placed:
            allowed = "a chain whose stages have places. For shaking forces, give one stage and its place"
            raise InputError("shaking", f"{member}{stage}", allowed, where)
        yield shaken(member, stage, stages[int(stage) - 1].family if stage else m.family, listed)


def _stages(family: Family) -> list[str]:
    return [stage.tail for stage in family.stages]
