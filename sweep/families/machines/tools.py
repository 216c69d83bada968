"""Tools of a machine: needles on a guided point, blades on an output link, the seam and the throat plate."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from sweep.errors import InputError, MissingInput, choices, known_keys, number, sign
from sweep.families.base import PER_RADIAN, Output
from sweep.families.capabilities import OutputLink
from sweep.families.machines.relations import Relation, pair, two_names
from sweep.families.machines.segments import Capsule, Gap, dot, minus
from sweep.families.parts import Member, vector
from sweep.families.sites import Spot, links_of

NEEDLE_KEYS = ("on", "line", "sense", "scarf", "diameter", "floor", "top", "scarf_end", "eye", "point")
BLADE_KEYS = ("on", "tip", "back", "eye", "hold", "radius")
SEAM_KEYS = ("at",)
PLATE_KEYS = ("at", "normal", "fabric")
PLACES = ("tip", "back", "eye", "hold")  # of a blade, as a member's tip


@dataclass(frozen=True)
class Needle:
    """A needle, machine-and-stitch 5.1; lengths are measured along its axis from the guided point.

    Parameters
    ----------
    name : of the tool
    on : dotted name of the guided point
    line : dotted name of the direction of its line
    sense : +1 or -1: whether the needle points along the line or against it
    scarf : a vector out of the scarf, in the machine's frame
    diameter : of the blade above the scarf
    floor : distance from the axis to the floor of the scarf
    top, scarf_end, eye, point : places of the upper end, the end of the scarf, the eye and the point
    """

    name: str
    on: str
    line: str
    sense: int
    scarf: tuple[float, float, float]
    diameter: float
    floor: float
    top: float
    scarf_end: float
    eye: float
    point: float

    @property
    def body(self) -> Capsule:
        """Capsule of the needle from its top to its point."""
        return Capsule(self.name, (Spot(self.on, self.line, self.sense * self.top), self.working), self.radius)

    @property
    def working(self) -> Spot:
        """Point of the needle."""
        return Spot(self.on, self.line, self.sense * self.point)

    @property
    def radius(self) -> float:
        """Radius of the capsule."""
        return 0.5 * self.diameter


@dataclass(frozen=True)
class Blade:
    """A blade on an output link: its tip, its back end, its radius; points by their dotted names.

    ``eye`` is where its thread leaves it and ``hold`` where it holds a loop or meets the seam's plane; "" unknown.
    """

    name: str
    tip: str
    back: str
    radius: float
    eye: str = ""
    hold: str = ""

    @property
    def body(self) -> Capsule:
        """Capsule of the blade from its tip to its back end."""
        return Capsule(self.name, (self.working, Spot(self.back)), self.radius)

    @property
    def working(self) -> Spot:
        """Tip of the blade."""
        return Spot(self.tip)


@dataclass(frozen=True)
class Seam:
    """The last stitch, a fixed point."""

    name: str
    at: tuple[float, float, float]


@dataclass(frozen=True)
class Plate:
    """The throat plate, a fixed plane, with fabric on it.

    Parameters
    ----------
    name : of the tool
    at : a point of its upper side
    normal : unit vector out of that side
    fabric : thickness of the fabric
    """

    name: str
    at: tuple[float, float, float]
    normal: tuple[float, float, float]
    fabric: float


Tool: TypeAlias = Needle | Blade | Seam | Plate


@dataclass(frozen=True)
class Height(Relation):
    """Height of a point above a throat plate, and above the fabric on it."""

    of: str
    spot: Spot
    plate: Plate

    @property
    def rates(self) -> Mapping[str, str]:
        """Derivative by the angle of the main shaft, common to both heights."""
        return {self.name: f"d{self.name}", f"{self.name}_fabric": f"d{self.name}"}

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Both heights and their derivative."""
        text = f"height of {self.of} above {self.plate.name}"
        return (
            Output(self.name, "length", text, "ours"),
            Output(f"{self.name}_fabric", "length", f"{text}, less the fabric's thickness", "ours"),
            Output(f"d{self.name}", PER_RADIAN, f"derivative of the {text} by phi of the main shaft", "ours"),
        )

    def needs(self, wanted: frozenset[str]) -> frozenset[str]:
        """Return coordinates of the point, and velocities where the derivative is wanted."""
        return frozenset(self.spot.needs(f"d{self.name}" in wanted))

    def compute(self, found: Mapping[str, Any], wanted: frozenset[str]) -> dict[str, Any]:
        """Return the wanted outputs, (n, m)."""
        normal = list(self.plate.normal)
        height = dot(minus(self.spot.position(found), list(self.plate.at)), normal)
        columns = {self.name: height, f"{self.name}_fabric": height - self.plate.fabric}
        if f"d{self.name}" in wanted:
            columns[f"d{self.name}"] = dot(self.spot.velocity(found), normal)
        return columns


def read_height(
    name: str, table: Mapping[str, Any], members: Mapping[str, Member], tools: Mapping[str, Tool]
) -> Height:
    """Read a relation ``above``: a needle, a blade or a moving point of a member, and a plate."""
    where = f"machine.relations.{name}"
    spots = {tool.name: tool.working for tool in tools.values() if isinstance(tool, Needle | Blade)}
    spots |= {point: Spot(point) for m in members.values() for point in (f"{m.name}.{own}" for own in m.moving)}
    plates = {tool.name: tool for tool in tools.values() if isinstance(tool, Plate)}
    of, plate = two_names(table["above"], list(dict.fromkeys((*spots, *tools))), "tools and points", where)
    if len(table) != 1 or of not in spots or plate not in plates:
        allowed = f"a needle, a blade or a moving point, then a plate: {', '.join(plates) or 'there is none'}"
        raise InputError("above", table["above"], allowed, where)
    return Height(name, of, spots[of], plates[plate])


def read_tools(given: Mapping[str, Mapping[str, Any]], members: dict[str, Member]) -> dict[str, Tool]:
    """Read the tools of a machine; the points of blades are added to the members that carry these.

    Raises
    ------
    InputError
        for unknown or missing keys, a point without line, a member without output link, a value that is no number.
    """
    found: dict[str, Tool] = {}
    for name, table in given.items():
        where = f"machine.tools.{name}"
        kind = "blade" if "back" in table else "plate" if "normal" in table else "seam" if "at" in table else "needle"
        keys, needed, read = KINDS[kind]
        known_keys(table, keys, where, f"for a {kind}, ")
        for key in needed:
            if key not in table:
                raise MissingInput(key, f"what a {kind} needs: {', '.join(needed)}", where)
        found[name] = read(name, table, members, where)
    return found


def _seam(name: str, table: Mapping[str, Any], members: Mapping[str, Member], where: str) -> Tool:
    return Seam(name, vector(table["at"], f"{where}.at"))


def _plate(name: str, table: Mapping[str, Any], members: Mapping[str, Member], where: str) -> Tool:
    x, y, z = vector(table["normal"], f"{where}.normal")
    size = math.hypot(x, y, z)
    if size == 0.0:
        raise InputError("normal", table["normal"], "a direction", where)
    fabric = length("fabric", table.get("fabric", 0.0), where)
    return Plate(name, vector(table["at"], f"{where}.at"), (x / size, y / size, z / size), fabric)


def _needle(name: str, table: Mapping[str, Any], members: dict[str, Member], where: str) -> Tool:
    points = [f"{m.name}.{point}" for m in members.values() for point in m.moving]
    if table["on"] not in points:
        raise InputError("on", table["on"], f"a moving point: {choices(str(table['on']), points)}", where)
    owner = members[str(table["on"]).partition(".")[0]]
    lines = [site.removesuffix("_axis") for site, one in owner.sites.items() if one.free and not site[-1].isdigit()]
    if table["line"] not in lines:
        raise InputError("line", table["line"], f"an axis or line of it: {choices(str(table['line']), lines)}", where)
    sense = sign("sense", table.get("sense", 1), where, "the needle points along the line or against it")
    diameter = length("diameter", table["diameter"], where)
    places = {key: number(key, table.get(key, 0.0), where) for key in ("top", "scarf_end", "eye", "point")}
    top, end, eye, point = places.values()
    if not top <= end < eye < point:
        raise InputError("eye", eye, "top <= scarf_end < eye < point", where)
    floor = length("floor", table["floor"], where) if "floor" in table else 0.5 * diameter
    scarf = vector(table["scarf"], f"{where}.scarf")
    if not any(scarf):
        raise InputError("scarf", scarf, "a direction", where)
    line = f"{owner.name}.{table['line']}_axis"
    return Needle(name, str(table["on"]), line, sense, scarf, diameter, floor, **places)


def _blade(name: str, table: Mapping[str, Any], members: dict[str, Member], where: str) -> Tool:
    carriers = [m.name for m in members.values() if m.family.find(OutputLink) is not None]
    owner = table["on"]
    if owner not in carriers:
        allowed = f"a member whose output link turns: {choices(str(owner), carriers)}"
        raise InputError("on", owner, allowed, where)
    ends = tuple((f"{name}_{end}", vector(table[end], f"{where}.{end}")) for end in PLACES if end in table)
    member = members[owner]
    members[owner] = replace(member, carried=(*member.carried, *ends))
    radius = length("radius", table["radius"], where) if "radius" in table else 0.0
    tip, back, eye, hold = (f"{owner}.{name}_{end}" if end in table else "" for end in PLACES)
    return Blade(name, tip, back, radius, eye, hold)


# Keys of each kind of tool, those that it needs, and its reader.
KINDS: dict[str, tuple[tuple[str, ...], tuple[str, ...], Callable[..., Tool]]] = {
    "needle": (NEEDLE_KEYS, ("on", "line", "scarf", "diameter", "eye", "point"), _needle),
    "blade": (BLADE_KEYS, ("on", "tip", "back"), _blade),
    "seam": (SEAM_KEYS, ("at",), _seam),
    "plate": (PLATE_KEYS, ("at", "normal"), _plate),
}


def length(key: str, value: object, where: str, what: str = "a length") -> float:
    """Read a length, or another quantity named by ``what``; refuse a value that is no number or negative."""
    found = number(key, value, where)
    if found < 0.0:
        raise InputError(key, value, f"{what} that is not negative", where)
    return found


def bodies(members: Mapping[str, Member], tools: Mapping[str, Tool]) -> dict[str, Capsule]:
    """Return the bodies between which gaps are defined: tools by name, links by "member.link"."""
    found = {name: tool.body for name, tool in tools.items() if isinstance(tool, Needle | Blade)}
    for m in members.values():
        for link, (first, second) in links_of(m).items():
            ends = Spot(f"{m.name}.{first}"), Spot(f"{m.name}.{second}")
            found[f"{m.name}.{link}"] = Capsule(f"{m.name}.{link}", ends)
    return found


def read_gap(name: str, table: Mapping[str, Any], members: Mapping[str, Member], tools: Mapping[str, Tool]) -> Gap:
    """Read a gap between two bodies, with radii of its own if they are given."""
    where, known = f"machine.relations.{name}", bodies(members, tools)
    known_keys(table, ("gap", "radii"), where)
    first, second = (known[one] for one in two_names(table["gap"], list(known), "bodies", where))
    if "radii" in table:
        both = pair("radii", table["radii"], "the radius of each body", where)
        a, b = (length("radii", radius, where) for radius in both)
        first, second = replace(first, radius=a), replace(second, radius=b)
    return Gap(name, (first, second))
