"""Readers of the relations of a stitch: its moments, its program and its threads; machine-and-stitch, 5 and 7."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from kernels.types import TWO_PI
from sweep.errors import InputError, choices, known_keys, number, sign
from sweep.families.capabilities import ThreadPath
from sweep.families.machines.main_shaft import ShaftTorque
from sweep.families.machines.moments import RiseWindow, Taking
from sweep.families.machines.relations import known_names, pair, two_names
from sweep.families.machines.sewing import Sewing
from sweep.families.machines.thread_balance import ThreadBalance
from sweep.families.machines.thread_way import Edge, TakeUp, Waypoint, spots
from sweep.families.machines.tools import Blade, Needle, Seam, Tool, length
from sweep.families.machines.triangles import Entering
from sweep.families.parts import Member, vector
from sweep.families.sites import Spot
from sweep.numerics.curves import TableCurve, table_curve

ROUNDED = 1e-9  # rad: 30 deg to 390 deg, each rounded, is a whole turn
THREAD_KEYS = (
    "thread", "stock", "tension", "stiffness", "radius", "allowed", "sewn", "feeding", "drawing",
)  # fmt: skip


def read_taking(
    name: str, table: Mapping[str, Any], members: Mapping[str, Member], tools: Mapping[str, Tool]
) -> Taking:
    """Read a relation ``take``: needle, blade, sense and fields of work."""
    where = f"machine.relations.{name}"
    known_keys(table, ("take", "sense", "fields", "vary"), where)
    needle, blade = (tools[one] for one in two_names(table["take"], list(tools), "tools", where))
    if not isinstance(needle, Needle) or not isinstance(blade, Blade):
        raise InputError("take", table["take"], "a needle, then a blade", where)
    vary = table.get("vary", False)
    if not isinstance(vary, bool) or (vary and "fields" not in table):
        raise InputError("vary", vary, "true or false: whether the ends of its fields are parameters", where)
    window = _rise_window(name, table["fields"], vary, where) if "fields" in table else None
    sense = sign("sense", table.get("sense", 1), where, "the tip passes along n x w or against it")
    return Taking(name, needle, blade, sense, window)


def _rise_window(name: str, given: object, vary: bool, where: str) -> RiseWindow:
    """Read the least and the largest permitted rise of each field of work."""
    if not isinstance(given, tuple) or not given:
        raise InputError("fields", given or {}, "at least one field with the least and the most rise", where)
    fields, allowed = [], "of each field the least and the most rise"
    for one in given:
        field, ends = pair("fields", one, allowed, where)
        least, most = (length("fields", end, where) for end in pair("fields", ends, allowed, where))
        fields.append((field, least, most))
    return RiseWindow(name, tuple(fields), vary)


def read_entering(
    name: str, table: Mapping[str, Any], members: Mapping[str, Member], tools: Mapping[str, Tool]
) -> Entering:
    """Read a relation ``enter``: the tool that enters, a blade, the seam, the sense and a window."""
    where = f"machine.relations.{name}"
    known_keys(table, ("enter", "sense", "window"), where)
    found = [tools[one] for one in known_names(table["enter"], list(tools), "tools", where)]
    if len(found) != 3:
        raise InputError("enter", table["enter"], "three tools: what passes, a blade, the seam", where)
    entering, blade, seam = found
    if not isinstance(entering, Needle | Blade) or not isinstance(blade, Blade) or not isinstance(seam, Seam):
        raise InputError("enter", table["enter"], "a needle or blade, a blade, a seam", where)
    if not (blade.eye and blade.hold):
        raise InputError("enter", blade.name, "a blade with eye and hold", where)
    window = None
    if "window" in table:
        both = pair("window", table["window"], "two crank angles, from and to", where)
        start, end = (number("window", one, where) for one in both)
        window = (start, end) if end - start < TWO_PI - ROUNDED else None
    corners = (Spot(blade.eye), Spot(blade.hold), Spot(at=seam.at))
    words = "the tip passes along the normal of eye, hold, seam, or against it"
    sense = sign("sense", table.get("sense", 1), where, words)
    return Entering(name, entering.working, corners, entering.radius, sense, window)


def read_sewing(name: str, table: dict[str, Any], known: Mapping[str, Any]) -> Sewing:
    """Read a relation ``sew``: moments, speeds, permitted clearance at moment A and torque of the main shaft."""
    where = f"machine.relations.{name}"
    known_keys(table, ("sew", "speeds", "clearance", "shaft"), where)
    moments = list(known_names(table["sew"], list(known), "relations", where))
    taking = [known[one] for one in moments if isinstance(known[one], Taking) and known[one].window]
    entering = tuple(known[one] for one in moments if isinstance(known[one], Entering))
    if len(taking) != 1 or len(entering) + 1 != len(moments):
        raise InputError("sew", table["sew"], "one moment A with fields of work (take), any of B and C (enter)", where)
    listed = table["speeds"] if isinstance(table.get("speeds"), tuple) else ()
    speeds = tuple(length("speeds", speed, where, "a speed") for speed in listed)
    if len(speeds) < 2 or any(b <= a for a, b in pairwise(speeds)):
        raise InputError("speeds", table.get("speeds"), "speeds of the main shaft, growing, at least two", where)
    between = "the least and the largest clearance at A"
    given = pair("clearance", table.get("clearance", (0.0, 0.1)), between, where)
    low, high = (number("clearance", end, where) for end in given)
    if low > high:
        raise InputError("clearance", given, between, where)
    shaft = known.get(table["shaft"]) if "shaft" in table else None
    if "shaft" in table and not isinstance(shaft, ShaftTorque):
        names = [one for one, relation in known.items() if isinstance(relation, ShaftTorque)]
        raise InputError("shaft", table["shaft"], f"a relation torque: {choices(str(table['shaft']), names)}", where)
    return Sewing(name, taking[0], entering, speeds, (low, high), shaft)


def read_thread(
    name: str, table: Mapping[str, Any], members: Mapping[str, Member], tools: Mapping[str, Tool]
) -> ThreadBalance:
    """Read a relation ``thread``: path, tension, stock, and the events that begin and end sewing and drawing.

    Raises
    ------
    InputError
        for an unknown key, point or member, fewer than two places, a value that is no number, a wrong number of radii.
    """
    where = f"machine.relations.{name}"
    known_keys(table, THREAD_KEYS, where)
    places = table["thread"] if isinstance(table["thread"], tuple) else ()
    path = tuple(_place(given, members, tools, where) for given in places)
    bends = _bends(path)
    if bends is None:
        allowed = "points and take-ups in order, two points at least in a row; each row begins and ends with a point"
        raise InputError("thread", table["thread"], f"{allowed} over which it always runs, as between blades", where)
    tension, stiffness, sewn = (
        length(key, table.get(key, 0.0), where, what)
        for key, what in (("tension", "a force"), ("stiffness", "a force over a length"), ("sewn", "a length"))
    )
    given = table.get("radius", 1.0)
    radii = tuple(length("radius", x, where) for x in (given if isinstance(given, tuple) else (given,) * bends))
    if len(radii) != bends:
        raise InputError("radius", given, f"one number, or one for each of the {bends} bends", where)
    feeding, drawing = (_events(key, table.get(key, ()), where) for key in ("feeding", "drawing"))
    if bool(feeding) != bool(drawing) or bool(feeding) != ("sewn" in table):
        raise InputError("sewn", table.get("sewn"), "sewn, feeding and drawing together, or none of them", where)
    known = {f"{m.name}.{point}" for m in members.values() for point in m.moving}
    return ThreadBalance(
        name,
        path,
        number("stock", table.get("stock", 0.0), where),
        tension,
        stiffness,
        radii,
        _allowed(table.get("allowed"), where),
        sewn,
        feeding,
        drawing,
        all(not spot.on or spot.on in known for place in path for spot in spots(place)),
    )


def _bends(path: Sequence[Waypoint]) -> int | None:
    """Return the number of bends of a path, one for each take-up and inner point; None if no piece is straight."""
    bends, pieces = 0, 0
    ends = [-1, *(k for k, place in enumerate(path) if isinstance(place.on, TakeUp)), len(path)]
    for first, last in pairwise(ends):
        run = path[first + 1 : last]
        sure = [
            "p" if isinstance(place.on, Spot) and not place.held else "b" * isinstance(place.on, Edge) for place in run
        ]
        if run and (sure[0] != "p" or sure[-1] != "p" or "bb" in "".join(sure)):
            return None
        bends, pieces = bends + max(len(run) - 2, 0), pieces + len(run) // 2
    return bends + len(ends) - 2 if pieces else None


def _place(given: Any, members: Mapping[str, Member], tools: Mapping[str, Tool], where: str) -> Waypoint:
    """Read a place of a path: a name, coordinates, or a table with one of these, a wrap angle and events."""
    table = dict(given) if isinstance(given, tuple) and given and isinstance(given[0], tuple) else {"on": given}
    known_keys(table, ("on", "held", "wrap", "fixed"), f"{where}.thread")
    held, fixed = (_events(key, table.get(key, ()), f"{where}.thread") for key in ("held", "fixed"))
    wrap = length("wrap", table.get("wrap", 0.0), f"{where}.thread", "an angle")
    return Waypoint(_on(table.get("on"), members, tools, where), held, wrap, fixed)


def _on(given: Any, members: Mapping[str, Member], tools: Mapping[str, Tool], where: str) -> Spot | Edge | TakeUp:
    """Read the place over which a thread runs: a point of the frame or a member, a take-up, a tool, a blade's eye."""
    if not isinstance(given, str):
        return Spot(at=vector(given, f"{where}.thread"))
    known: dict[str, Spot | Edge | TakeUp] = {}
    for name, tool in tools.items():
        if isinstance(tool, Needle):
            known[name] = Spot(tool.on, tool.line, tool.sense * tool.eye)
        elif isinstance(tool, Seam):
            known[name] = Spot(at=tool.at)
        elif isinstance(tool, Blade):
            known[name] = Edge(Spot(tool.tip), Spot(tool.back))
            known |= {f"{name}.eye": Spot(tool.eye)} if tool.eye else {}
    for m in members.values():
        known |= {f"{m.name}.{point}": Spot(f"{m.name}.{point}") for point in m.points}
        if (path := m.family.find(ThreadPath)) is not None:
            kinks = m.family.pose_output[path.wrap].kinks
            known[m.name] = TakeUp(f"{m.name}.{path.taken}", f"{m.name}.{path.wrap}", kinks)
    if given not in known:
        raise InputError("thread", given, f"points, take-ups: {choices(given, list(known))}", where)
    return known[given]


def _events(key: str, given: Any, where: str) -> tuple[str, ...]:
    if not isinstance(given, tuple) or len({*given}) not in (0, 2) or not all(isinstance(end, str) for end in given):
        raise InputError(key, given, "two events or moments by name, from and to", where)
    return given


def _allowed(given: Any, where: str) -> TableCurve | None:
    if given is None:
        return None
    table = dict(given) if isinstance(given, tuple) else {}
    if set(table) != {"phi", "values"}:
        raise InputError("allowed", given, "phi [rad] and values: the most surplus over the turn", where)
    try:
        return table_curve(np.array(table["phi"], np.float64), np.array(table["values"], np.float64))
    except (TypeError, ValueError) as error:
        raise InputError("allowed", given, str(error), where) from None
