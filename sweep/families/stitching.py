"""The moments of the stitch from what a user writes: machine-and-stitch, 5."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from sweep.errors import InputError, choices
from sweep.families.main_shaft import ShaftTorque
from sweep.families.moments import RiseWindow, Taking
from sweep.families.relations import each, two
from sweep.families.sewing import Sewing
from sweep.families.tools import Blade, Needle, Seam, Spot, Tool, length, number
from sweep.families.triangles import Entering


def read_taking(name: str, table: dict[str, Any], tools: Mapping[str, Tool], where: str) -> Taking:
    """Read a relation ``take``: a needle, a blade, the sense, fields of work."""
    for key in table:
        if key not in ("take", "sense", "fields"):
            raise InputError(key, table[key], "take, sense, fields", where)
    needle, blade = (tools[one] for one in two(table["take"], list(tools), "tools", where))
    if not isinstance(needle, Needle) or not isinstance(blade, Blade):
        raise InputError("take", table["take"], "a needle, then a blade", where)
    window = _rise_window(table["fields"], where) if "fields" in table else None
    return Taking(name, needle, blade, _sense(table, "the tip passes along n x w or against it", where), window)


def _rise_window(given: tuple[tuple[str, Any], ...], where: str) -> RiseWindow:
    """Read what rise each field of work permits; refuse fields that leave none in common."""
    fields = []
    for name, ends in given:
        if not isinstance(ends, tuple) or len(ends) != 2:
            raise InputError("fields", ends, "of each field the least and the most rise", where)
        least, most = (length(name, end, where) for end in ends)
        fields.append((name, least, most))
    if not fields:
        raise InputError("fields", {}, "at least one field with the least and the most rise", where)
    window = RiseWindow(tuple(fields))
    if window.least > window.most:
        raise InputError("fields", dict(given), f"fields that leave a window in common, {window.words}: none is", where)
    return window


def read_entering(name: str, table: dict[str, Any], tools: Mapping[str, Tool], where: str) -> Entering:
    """Read a relation ``enter``: what passes, a blade, the seam, the sense, a window."""
    for key in table:
        if key not in ("enter", "sense", "window"):
            raise InputError(key, table[key], "enter, sense, window", where)
    if len(table["enter"]) != 3:
        raise InputError("enter", table["enter"], "three tools: what passes, a blade, the seam", where)
    entering, blade, seam = (tools[one] for one in each(table["enter"], list(tools), "tools", where))
    if not isinstance(entering, Needle | Blade) or not isinstance(blade, Blade) or not isinstance(seam, Seam):
        raise InputError("enter", table["enter"], "a needle or blade, a blade, a seam", where)
    if not (blade.eye and blade.hold):
        raise InputError("enter", blade.name, "a blade with eye and hold", where)
    window = None
    if "window" in table:
        if not isinstance(table["window"], tuple) or len(table["window"]) != 2:
            raise InputError("window", table["window"], "two crank angles, from and to", where)
        start, end = (number("window", one, where) for one in table["window"])
        window = (start, end)
    corners = (Spot(blade.eye), Spot(blade.hold), Spot(at=seam.at))
    sense = _sense(table, "the tip passes along the normal of eye, hold, seam, or against it", where)
    return Entering(name, entering.working, corners, entering.radius, sense, window)


def read_sewing(name: str, table: dict[str, Any], known: Mapping[str, Any]) -> Sewing:
    """Read a relation ``sew``: the moments, speeds, the clearance that takes a loop, the torque of the main shaft."""
    where = f"machine.relations.{name}"
    for key in table:
        if key not in ("sew", "speeds", "clearance", "shaft"):
            raise InputError(key, table[key], "sew, speeds, clearance, shaft", where)
    moments = list(each(table["sew"], list(known), "relations", where))
    taking = [known[one] for one in moments if isinstance(known[one], Taking) and known[one].window]
    entering = tuple(known[one] for one in moments if isinstance(known[one], Entering))
    if len(taking) != 1 or len(entering) + 1 != len(moments):
        raise InputError("sew", table["sew"], "one moment A with fields of work (take), any of B and C (enter)", where)
    speeds = tuple(length("speeds", speed, where) for speed in table.get("speeds", ()))
    if len(speeds) < 2 or any(b <= a for a, b in pairwise(speeds)):
        raise InputError("speeds", table.get("speeds"), "speeds of the main shaft, growing, at least two", where)
    given = table.get("clearance", (0.0, 0.1))
    if not isinstance(given, tuple) or len(given) != 2 or not given[0] <= given[1]:
        raise InputError("clearance", given, "the least and the largest clearance at A", where)
    shaft = known.get(table["shaft"]) if "shaft" in table else None
    if "shaft" in table and not isinstance(shaft, ShaftTorque):
        names = [one for one, relation in known.items() if isinstance(relation, ShaftTorque)]
        raise InputError("shaft", table["shaft"], f"a relation torque: {choices(str(table['shaft']), names)}", where)
    low, high = (number("clearance", end, where) for end in given)
    return Sewing(name, taking[0], entering, speeds, (low, high), shaft)


def _sense(table: Mapping[str, Any], words: str, where: str) -> int:
    sense = table.get("sense", 1)
    if sense not in (1, -1) or isinstance(sense, bool):
        raise InputError("sense", sense, f"1 or -1: {words}", where)
    return int(sense)
