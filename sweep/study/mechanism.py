"""[mechanism], or [machine], [relations] and [tools]: the mechanism of a study, and the relations of its members."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from sweep.errors import InputError, MissingInput, choices, closest
from sweep.families import NAMES
from sweep.families import family as find_family
from sweep.families.base import Family
from sweep.families.machines.specification import RELATION_KINDS, Specification, specification
from sweep.quantities import units
from sweep.quantities.resolve import check_timings
from sweep.study.file import (
    TEXT,
    Angle,
    Faults,
    Key,
    Length,
    LengthOrPlace,
    Section,
    StudyFile,
    TextOrNumber,
    Three,
    ThreeLengths,
    TwoLengths,
    copied_table,
    holds,
    quantity,
    read_section,
)


class ToolSection(Section):
    """Table ``tools.<name>``: a needle, a blade with a back, or a seam that stands still."""

    on: str | None = holds('a moving point of a needle, as "needle.point"; a member of a blade')
    line: str | None = holds('the line that the needle lies along, as "line"')
    sense: int | None = holds("1 or -1: the needle points along the line or against it")
    scarf: Three | None = holds("a direction [x, y, z] of the machine's frame, out of the scarf")
    diameter: Length | None = holds('of the needle above the scarf, as "0.75 mm"')
    floor: Length | None = holds("from the needle's axis to the floor of the scarf; half the diameter")
    top: Length | None = holds("from the guided point to where the needle begins; negative: above it")
    scarf_end: Length | None = holds("from the guided point to the upper end of the scarf")
    eye: LengthOrPlace | None = holds(
        "from the guided point to the upper edge of the needle's eye; of a blade three lengths as tip"
    )
    point: Length | None = holds("from the guided point to the needle's point")
    tip: ThreeLengths | None = holds("three lengths along, across, along the axis of the output link")
    back: ThreeLengths | None = holds("the other end of the blade, as tip")
    hold: ThreeLengths | None = holds("where the blade holds a loop, or meets the plane of the seam, as tip")
    at: ThreeLengths | None = holds(
        "of the last stitch, or a point of the throat plate, three lengths in the machine's frame"
    )
    radius: Length | None = holds('of the blade as a capsule, as "0.4 mm"; 0 if left out')
    normal: Three | None = holds("of a throat plate, a direction [x, y, z] of the machine's frame, up from it")
    fabric: Length | None = holds('of a throat plate, thickness of what lies on it, as "2 mm"')


Names = Annotated[list[str], Field(min_length=1)]

# Tables in which the entries of a member may stand in a table of the member's name, and keys that only an entry has.
ENTRY = {"min", "max", "from", "to", "value", "values", "kind", "mean", "file", "material"}
BY_MEMBER = (("design",), ("bodies",), ("loads",), ("limits",), ("reference", "design"))


class MechanismSection(Section):
    """Table [mechanism]."""

    family: str | None = holds('the name of a family; a row of them is chain = ["rssr", "guide"]')
    chain: list[str] | None = holds("a list of names of families", min_length=1)


class PlaceTable(Section):
    """Table ``machine.<member>.place``."""

    at: ThreeLengths | None = holds('three lengths, as ["0 mm", "30 mm", "12 mm"]')
    axis: Three | None = holds("a direction [x, y, z]: the member's z")
    zero: Three | None = holds("a direction [x, y, z]: the member's x")
    stage: int | None = holds("of a chain, 1 where its first stage stands there; else its last")


class ShaftSection(Section):
    """Table ``shafts.<name>``."""

    at: ThreeLengths | None = holds('a point of the axis, as ["0 mm", "30 mm", "12 mm"]')
    axis: Three | None = holds("its direction [x, y, z]")
    zero: Three | None = holds("the direction [x, y, z] of its mark at angle 0")
    ratio: int | None = holds("whole turns for one of the main shaft, with the sense, not 0")
    phase: Angle | None = holds('its angle where that of the main shaft is 0, as "30 deg"')


class MemberSection(Section):
    """Table ``machine.<member>``."""

    family: str | None = holds("the name of a family")
    chain: Names | None = holds("a list of names of families")
    ratio: int | None = holds("a whole number of turns of its crank for one of what drives it, not 0")
    offset: Angle | None = holds('an angle with its unit, as "180 deg"')
    driver: str | None = holds('"shaft", or an angle of an earlier member, as "needle.psi1"')
    place: PlaceTable | None = holds("{ at = [...], axis = [...], zero = [...] }")
    shaft: str | None = holds("the shaft that its crank sits on, one of [shafts]")
    sense: int | None = holds("1 or -1: its crank axis along the shaft or against it")
    shift: Length | None = holds('place of its origin along the shaft, as "12 mm"')
    turn: Angle | None = holds('angle of its frame about the shaft, as "90 deg"')
    key: Angle | None = holds('angle of its crank on the shaft, as "15 deg"')
    tip: ThreeLengths | None = holds('three lengths along, across, along the axis, as ["30 mm", "0 mm", "2 mm"]')
    eye: ThreeLengths | None = holds(
        'three lengths along the coupler, across it, along its axes, as ["30 mm", "0 mm", "0 mm"]'
    )


class RelationSection(Section):
    """Table ``relations.<name>``."""

    distance: Names | None = holds('two points, as ["needle.point", "looper.tip"]')
    timing: Names | None = holds('two crank angles, as ["needle.phi_ext", "phi_min_clearance"]')
    speed: Names | None = holds('one or two points, as ["looper.tip"]')
    event: str | None = holds('a pose output, as "clearance" or "looper.tip_x"')
    level: TextOrNumber | None = holds('what it passes, in its unit, as "1 mm"; 0 if left out')
    rising: bool | None = holds("true or false: whether it passes upwards; true if left out")
    value: Names | None = holds('a pose output and a crank angle, as ["pace", "phi_arrive"]')
    gap: Names | None = holds('two bodies, links or tools, as ["needle.rocker1", "blade"]')
    radii: TwoLengths | None = holds('of a gap, the radius of each body, as ["4 mm", "3 mm"]')
    take: Names | None = holds('a needle and a blade of [tools], as ["thin", "blade"]')
    enter: Names | None = holds('what passes, a blade and the seam of [tools], as ["thin", "upper", "seam"]')
    above: Names | None = holds('a needle, blade or moving point and a plate of [tools], as ["thin", "plate"]')
    sense: int | None = holds(
        "1 or -1: of a take along n x w of the needle or against it, of an enter the triangle's normal",
    )
    fields: dict[str, TwoLengths] | None = holds(
        'of a take, the least and most rise of each field of work, { slow = ["1.5 mm", "3 mm"] }'
    )
    vary: bool | None = holds("of a take, true or false: whether the ends of its fields are parameters of the machine")
    window: list[Angle] | None = holds(
        'of an enter, from and to, as ["200 deg", "300 deg"]', min_length=2, max_length=2
    )
    settings: str | None = holds('of a take, a real machine whose settings are limits: "juki-mo-104d"')
    torque: Names | None = holds('members, as ["needle", "looper"]')
    shaking: Names | None = holds('members, as ["needle", "looper"]')
    sew: Names | None = holds('a moment A, and any of B and C, as ["a", "b", "c"]')
    speeds: list[Annotated[float, quantity("rad/s"), TEXT]] | None = holds(
        'of a sew, as ["500 rpm", "8500 rpm"], growing', min_length=1
    )
    clearance: TwoLengths | None = holds('of a sew, between which the tip takes the loop, as ["0 mm", "0.1 mm"]')
    shaft: str | None = holds("of a sew, a relation torque whose unevenness counts")
    press: str | None = holds('the feed whose rack lifts the presser foot, a member, as "feed"')


def flattened(data: Mapping[str, Any], members: object) -> dict[str, Any]:
    """Move members' entries to dotted names: ``[design.needle] a1`` becomes ``design."needle.a1"``."""
    result = dict(data)
    if not isinstance(members, dict):
        return result
    for key in BY_MEMBER:
        table, flat = copied_table(result, key) or {}, dict[str, Any]()
        for name, entry in table.items():
            nested = name in members and isinstance(entry, dict)
            flat |= {f"{name}.{inner}": value for inner, value in entry.items()} if nested else {name: entry}
        table.clear()
        table |= flat
    return result


def read_mechanism(
    section: MechanismSection, file: StudyFile, threads: Mapping[str, dict[str, Any]] | None
) -> tuple[tuple[str, ...] | Specification, Family] | None:
    """Read the mechanism as the study names it, and its family without effects, or return None with its faults.

    Parameters
    ----------
    section : [mechanism]
    threads : threads of a machine as relations; None if one is faulty, as the names of its outputs are unknown then
    """
    data, faults = file.data, file.faults
    if "machine" not in file:
        if "mechanism" not in file:
            faults.missing(("mechanism",), "a table [mechanism]")
        for table in ("relations", "shafts", "tools"):
            if table in file:
                faults.value((table,), data[table], f"nothing here: {table} are those of a [machine]")
        names = _families(section, data, faults)
        family = _family(names, data, faults)
        return None if family is None else (names, family)
    if "mechanism" in file:
        faults.value(("mechanism",), data["mechanism"], "either [mechanism] or [machine.NAME], not both")
    if isinstance(data["machine"], dict) and ("mechanism" in file or _misspelt_members(data, faults)):
        return None  # entries of the other tables would be faults too: what they describe is not known
    for table in ("locus", "fit"):
        if table in file:
            faults.value((table,), data[table], "nothing here: it finishes the links of a [mechanism] alone")
    return _machine(data, faults, threads)


def _misspelt_members(data: Mapping[str, Any], faults: Faults) -> bool:
    """Report tables named by a misspelt member, as [design.loper]; tell whether there are any."""
    before = len(faults.lines)
    for key in BY_MEMBER:
        for name, entry in (copied_table(dict(data), key) or {}).items():
            if isinstance(entry, dict) and ENTRY.isdisjoint(entry) and closest(name, data["machine"]) is not None:
                faults.unknown((*key, name), data["machine"], "member")
    return len(faults.lines) > before


def _families(section: MechanismSection, data: Mapping[str, Any], faults: Faults) -> tuple[str, ...]:
    raw = data.get("mechanism")
    if isinstance(raw, dict) and "family" in raw and "chain" in raw:
        faults.value(("mechanism", "chain"), raw["chain"], "either family or chain, not both")
        return ()  # which of them the other tables describe is not known
    if isinstance(raw, dict) and "family" not in raw and "chain" not in raw:
        faults.missing(("mechanism", "family"), f"one of {', '.join(NAMES)}; or chain, a list of them", instead="chain")
    if section.family is not None:
        names = section.family.split("+")
        if len(names) > 1:
            right = ", ".join(f'"{name.strip()}"' for name in names)
            faults.value(("mechanism", "family"), section.family, f"one family; a row of them is chain = [{right}]")
            return ()
        return (section.family,)
    return tuple(section.chain or ())


def _family(names: tuple[str, ...], data: Mapping[str, Any], faults: Faults) -> Family | None:
    """Return the family or chain, or None with a fault for each unknown name or for an impossible chain.

    A misspelt family is a fault; the other tables are checked against the closest match, so that one run finds all
    faults.  If they name what it does not have, or lack what it needs, it is the wrong match and its faults are none.
    """
    single = "family" in data.get("mechanism", {}) if names else False
    unknown = [k for k, name in enumerate(names) if name not in NAMES]
    for k in unknown:
        key: Key = ("mechanism", "family") if single else ("mechanism", "chain", k)
        faults.value(key, names[k], f"one of {choices(names[k], NAMES)}")
    if unknown:
        faults.guess()
    guessed = tuple(closest(name, NAMES) if name not in NAMES else name for name in names)
    if not guessed or None in guessed:
        return None
    try:
        return find_family([name for name in guessed if name is not None])
    except InputError as error:
        faults.value(("mechanism", "chain"), list(names), error.allowed)
        return None


def _machine(
    data: Mapping[str, Any], faults: Faults, threads: Mapping[str, dict[str, Any]] | None
) -> tuple[Specification, Family] | None:
    """Return the machine with its threads, or None with its faults."""
    before = len(faults.lines)
    members = _read_each(MemberSection, data, "machine", faults)
    relations = _read_each(RelationSection, data, "relations", faults)
    for relation in relations.values():
        relation.pop("settings", None)
    shafts = _read_each(ShaftSection, data, "shafts", faults)
    tools = _read_each(ToolSection, data, "tools", faults)
    for name, thread in (threads or {}).items():
        if name in relations:
            faults.value(("thread", name), thread, "a name that no relation has")
        relations[name] = thread
    if threads is None or len(faults.lines) > before:
        return None
    try:
        plain = {name: table for name, table in relations.items() if not _hangs_on_events(table)}
        outputs = (
            find_family(specification(members, plain, shafts, tools)).pose_output if len(plain) < len(relations) else {}
        )
        for name, table in relations.items():
            if "level" in table and (output := outputs.get(table.get("event", ""))) is not None:
                table["level"] = _level(table["level"], units.internal_unit(output.unit), name, faults)
        if len(faults.lines) > before:
            return None
        given = specification(members, relations, shafts, tools)
        machine = find_family(given)
        check_timings(machine)
        return given, machine
    except InputError as error:
        place: Key = tuple(error.place.removeprefix("machine.").split(".")) if error.place != "machine" else ()
        if place[:1] == ("relations",) and place[1:] and place[1] in threads:
            part = "path" if error.name == "thread" or error.place.endswith(".thread") else error.name
            written = error.value if part == "path" else data["thread"][place[1]].get(part, error.value)
            faults.value(("thread", place[1], part), written, error.allowed)
            return None
        name = "" if place[-1:] == (error.name,) else error.name
        if place[:1] == ("relations",):
            entry = relations.get(str(place[-1]), {})
            name = name if name in entry else next((kind for kind in RELATION_KINDS if kind in entry), "")
        key = place if place[:1] in (("relations",), ("shafts",), ("tools",)) else ("machine", *place)
        key = (*key, name) if name else key
        if isinstance(error, MissingInput):
            faults.missing(key, error.allowed)
        else:
            faults.value(key, _written(data, key, error.value), error.allowed)
        return None


def _written(data: Any, key: Key, value: object) -> object:
    """Return the value in the file, with its unit; of a list of names only the faulty one."""
    for part in () if isinstance(value, str) else key:
        if not isinstance(data, Mapping) or part not in data:
            return value
        data = data[part]
    return value if isinstance(value, str) else data


def _hangs_on_events(table: Mapping[str, Any]) -> bool:
    """Tell whether a relation depends on an event, or is a thread whose path changes at events."""
    return bool({"event", "value", "feeding"} & set(table)) or any(isinstance(x, dict) for x in table.get("thread", ()))


def _level(given: str | float, internal: str, name: str, faults: Faults) -> float:
    """Return the level of an event in the internal unit of its output; a bare number needs an output without unit."""
    key: Key = ("relations", name, "level")
    if isinstance(given, str):
        return faults.number(given, internal, key) or 0.0
    if internal != "1":
        faults.value(key, given, f"a text with number and unit: {units.example(internal)}")
    return given


def _read_each(model: type[Section], data: Mapping[str, Any], table: str, faults: Faults) -> dict[str, dict[str, Any]]:
    """Read the entry under each name of a table, in internal units."""
    raw = data.get(table, {})
    if not isinstance(raw, dict):
        faults.value((table,), raw, f"tables [{table}.NAME]")
        return {}
    sections = {name: read_section(model, entry, (table, name), faults) for name, entry in raw.items()}
    return {name: section.model_dump(exclude_none=True) for name, section in sections.items()}
