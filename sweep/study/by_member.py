"""A study of a machine split into studies of its members, each with the members before it fixed.

The order is that of the source, I.7: the needle, the looper that takes its loop, the other blades, what moves the
fabric, the thread supply.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from sweep.errors import InputError
from sweep.families import family as find_family
from sweep.families.base import Family
from sweep.families.capabilities import ThreadPath
from sweep.families.machines.machine import Machine
from sweep.families.machines.main_shaft import ShaftTorque
from sweep.families.machines.shaking import Shaking
from sweep.families.machines.specification import Specification
from sweep.quantities.resolve import output
from sweep.study.study import Study

RELATIONS = ("relations", "thread")
BY_NAME = ("machine", "tools", *RELATIONS, "cyclogram")


def studies_of_members(study: Study, name: str) -> dict[str, dict[str, Any]]:
    """Return the tables of one study per member, in the order of design, keyed by the study's name.

    Raises
    ------
    InputError
        for a study of no machine, or one without [cyclogram].
    """
    spec, machine = study.mechanism, study.bare
    if not isinstance(spec, Specification) or not isinstance(machine, Machine) or "cyclogram" not in study.data:
        raise InputError(
            "--from-cyclogram", study.name, "a study of a machine with a table [cyclogram]", "command line"
        )
    studies: dict[str, dict[str, Any]] = {}
    members: list[str] = []
    previous: Family | None = None
    for member in order_of_design(spec, machine):
        last = f"{name}-{members[-1]}" if members else None
        members.append(member)
        part, names = _within(spec, members)
        studies[f"{name}-{member}"] = _tables(study, names, part, previous, f"{name}-{member}", last)
        previous = part
    return studies


def order_of_design(spec: Specification, machine: Machine) -> list[str]:
    """Return the members in the order of design; each sets the requirements of those behind it."""
    tools = {name: dict(table) for name, table in spec.tools}
    carriers = {name: str(table["on"]).partition(".")[0] for name, table in tools.items() if "on" in table}
    taking = {tool for _, table in spec.relations for tool in dict(table).get("take", ())}

    def rank(member: str) -> int:
        carried = [name for name, carrier in carriers.items() if carrier == member]
        if carried:
            return 0 if any("line" in tools[one] for one in carried) else 1 if taking.intersection(carried) else 2
        return 3 if machine.member(member).family.find(ThreadPath) is None else 4

    return sorted((m.name for m in machine.members), key=rank)


def _within(spec: Specification, kept: list[str]) -> tuple[Family, set[str]]:
    """Return the machine of the ``kept`` members, with every relation it can hold, and the names of all its parts."""
    members = tuple((name, table) for name, table in spec.members if name in kept)
    tools = tuple((n, t) for n, t in spec.tools if str(dict(t).get("on", kept[0])).partition(".")[0] in kept)
    built = replace(spec, members=members, tools=tools, relations=())
    machine = find_family(built)
    # An event may refer to a relation and a thread to events: repeat until no further relation fits.
    remaining = list(spec.relations)
    while True:
        left = [x for x in remaining if (more := _fits(built, x)) is None or not (built := more)]
        if len(left) == len(remaining):
            break
        remaining, machine = left, find_family(built)
    return machine, {name for names in (members, tools, built.relations) for name, _ in names}


def _fits(part: Specification, relation: tuple[str, Any]) -> Specification | None:
    extended = replace(part, relations=(*part.relations, relation))
    try:
        machine = find_family(extended)
    except InputError:
        return None
    places = [place for timing in getattr(machine, "timings", ()) for place in timing.places]
    return extended if all(_has(machine, place) for place in places) else None


def _tables(
    study: Study, known: set[str], part: Family, previous: Family | None, name: str, last: str | None
) -> dict[str, Any]:
    """Return the study of the last member in ``known``: its dimensions, and the limits that involve it."""
    data, member = study.data, name.rpartition("-")[2]

    def new(output_name: str) -> bool:
        return _has(part, output_name) and not (previous is not None and _has(previous, output_name))

    tables: dict[str, Any] = {"study": {"name": name, "title": f"{study.title}: {member}"}}
    for table in BY_NAME:
        entries = {key: entry for key, entry in data.get(table, {}).items() if key in known}
        if table == "relations":  # already limits of an earlier member
            old = {r.name for r in getattr(previous, "relations", ())}
            entries = {k: {x: y for x, y in e.items() if x != "settings" or k not in old} for k, e in entries.items()}
        if table == "cyclogram":
            entries = {k: entry for k, entry in entries.items() if k == member or new(f"phi_{k}")}
        tables |= {table: entries} if entries else {}
    design = {key: x for key, x in data["design"].items() if key == "sample" or key in part.parameter_names}
    if previous is not None:
        design = {"from": last} | {key: x for key, x in design.items() if key not in previous.parameter_names}
    goal = study.objective.output if study.objective is not None else ""
    if not new(goal) and isinstance(part, Machine):
        position = f"{member}.{part.member(member).family.position}"
        goal = f"{member}.max_abs_{part.derivative_of[part.derivative_of[position]].partition('.')[2]}"
    varied = any(isinstance(x, dict) and "value" not in x for key, x in design.items() if key != "sample")
    if not varied:  # All its dimensions are fixed: compute the goal as a wanted output.
        design.pop("sample", None)
    wanted = [x for x in data.get("scene", {}).get("want", ()) if new(x)]
    tables["scene"] = data.get("scene", {}) | {"want": wanted if varied else [*wanted, goal]}
    tables["design"] = _by_member(design, member)
    limits = {key: x for key, x in data.get("limits", {}).items() if new(key)}
    tables |= {"limits": _by_member(limits, member)} if limits else {}
    tables |= {"objective": {"minimise": goal}} if varied else {}
    if isinstance(part, Machine) and any(isinstance(r, Shaking | ShaftTorque) for r in part.relations):
        bodies = data.get("bodies", {})
        for m in part.members:
            bodies = _by_member(bodies, m.name)
        tables["bodies"] = {name: entries for name, entries in bodies.items() if name in known}
    copied = ("accuracy", "optimise") if varied else ("accuracy",)
    return tables | {key: data[key] for key in copied if key in data}


def _by_member(entries: dict[str, Any], member: str) -> dict[str, Any]:
    """Move the dotted names of a member into a table of its own."""
    of_member = {key.removeprefix(f"{member}."): x for key, x in entries.items() if key.startswith(f"{member}.")}
    shared = {key: x for key, x in entries.items() if not key.startswith(f"{member}.")}
    return shared | ({member: of_member} if of_member else {})


def _has(family: Family, name: str) -> bool:
    """Tell whether a machine has the named design output, of one of its members or of a relation between them."""
    if "." in name and isinstance(family, Machine) and family.split(name) is None:
        return False
    try:
        output(family, name)
    except InputError:
        return False
    return True
