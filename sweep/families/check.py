"""Rules for an entry of the register, checked when the family is first used."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from typing import get_args

from kernels.linkage.bodies import DRIVEN
from sweep.families.base import Family, March, Turn
from sweep.families.capabilities import Assembly, Dimensions, JointRecords, OutputLink, Skeleton
from sweep.families.link_tree import LinkTree
from sweep.families.names import ERROR, MINUS
from sweep.families.parameter import WORDS, Unit, is_known, of_derivative

_NAME = re.compile(r"[a-z][a-z0-9_]*")
_LETTERS = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
RESERVED = ("design", "status", "offset")  # and the domain's variable, phi for a turn


class FamilyError(TypeError):
    """An entry of the register breaks a rule; the message gives the remedy to the entry's author."""


def check_family(family: Family) -> Family:
    """Return the family if it keeps every rule of an entry.

    Raises
    ------
    FamilyError
        naming the family, the faults and their remedies.
    """
    rules = (_names, _definitions, _position, _derivatives, _events, _steps, _drawing, _capabilities, _example)
    faults = [fault for rule in rules for fault in rule(family)]
    if faults:
        raise FamilyError("\n".join([f"family {family.name}: {len(faults)} faults", *(f"  {x}" for x in faults)]))
    return family


def _names(family: Family) -> list[str]:
    faults = []
    if not _NAME.fullmatch(family.name):
        faults.append(f"name {family.name!r}: use a-z, 0-9 and _, a letter first")
    seen: set[str] = set()
    for name in (*family.parameter_names, *family.pose_names):
        if not _LETTERS.fullmatch(name):
            faults.append(f"{name!r}: use letters, digits and _, a letter first; dots are for members of machines")
        if name in seen:
            faults.append(f"{name!r} stands twice among parameters and pose outputs: rename one")
        if name in RESERVED or name == family.domain.name:
            faults.append(f"{name!r} is a column of every table: choose another name")
        seen.add(name)
    for p in family.parameters:
        if p.default is not None and p.choices is not None and p.default not in p.choices:
            faults.append(f"parameter {p.name}: its default {p.default:g} is none of its choices")
        if not p.text:
            faults.append(f"parameter {p.name}: say in words what it is (text)")
        if p.unit not in get_args(Unit):
            faults.append(f"parameter {p.name}: {p.unit!r} is no unit: use one of {', '.join(get_args(Unit))}")
    return faults


def _example(family: Family) -> list[str]:
    needed = [p.name for p in family.parameters if p.default is None]
    faults = [f"example lacks {name!r}: give an ordinary design" for name in needed if name not in family.example]
    parameters = {p.name: p for p in family.parameters}
    for name, value in family.example.items():
        p = parameters.get(name)
        if p is None:
            faults.append(f"example has {name!r}, which is no parameter")
        elif p.choices is not None and value not in p.choices:
            faults.append(f"example has {name} = {value:g}: give {p.choice}")
        elif p.wrong_sign(value):
            faults.append(f"example has {name} = {value:g}: give a {p.sign} number")
    return faults


def _drawing(family: Family) -> list[str]:
    skeleton, names, faults = family.find(Skeleton), set(family.pose_names), []
    if skeleton is None:
        return [
            "no Skeleton among the capabilities: give fixed points with their axes, and links by their joints; "
            "drawings, reports and exports are made from it"
        ]
    known = {*family.points, *skeleton.fixed, *skeleton.moving}
    faults += [
        f"link {link.name}: {joint!r} is no point: name it in points, or in fixed or moving of the Skeleton"
        for link in skeleton.links
        for joint in link.joints
        if joint not in known
    ]
    faults += [
        f"point {name} needs {one!r}, which is no pose output"
        for name, point in skeleton.moving.items()
        for one in point.needs
        if one not in names
    ]
    if not skeleton.links:
        faults.append("the Skeleton has no links: name each with its joints, its pivot first")
    return faults


def _tree(tree: LinkTree) -> list[str]:
    """List faults of a tree of links: invalid numbers, and loops closed by too few or too many lines."""
    bodies, faults = range(len(tree.bodies)), []
    parents = [body.parent for body in tree.bodies]
    faults += [f"LinkTree: parent {p} of body {k} is no earlier body" for k, p in enumerate(parents) if p >= k]
    undriven = sum(kind != DRIVEN for _, kind in tree.freedoms)
    if undriven != len(tree.ends):
        faults.append(f"LinkTree: {undriven} freedoms that nothing drives need as many lines, not {len(tree.ends)}")
    lines = {line for j in tree.joints for line in range(j.lines[0], j.lines[0] + j.lines[1])}
    if lines != set(range(len(tree.ends))) or sorted(j.body for j in tree.joints if j.body >= 0) != list(bodies):
        faults.append("LinkTree: every body and every line belongs to one joint")
    return faults


def _capabilities(family: Family) -> list[str]:
    names, faults = set(family.pose_names), []
    for loop in family.every(Assembly):
        missing = [one for one in (loop.discriminant, loop.pressure_angle) if one not in names]
        faults += [f"Assembly names {one!r}, which is no pose output: add it" for one in missing]
    if "discriminant" in names and family.find(Assembly) is None:
        faults.append("a discriminant without an Assembly: say what divides it (rotatability needs it)")
    for records in family.every(JointRecords):
        missing = [one for one in records.needs if one not in names and records.moved is None]
        faults += [f"JointRecords needs {one!r}, which is no pose output" for one in missing]
    for tree in family.every(LinkTree):
        faults += [f"LinkTree needs {one!r}, which is no pose output" for one in tree.needs if one not in names]
        faults += _tree(tree)
    faults += [
        f"point {point}: {one!r} is no pose output; None is a coordinate 0"
        for point, at in family.points.items()
        for one in at
        if one is not None and one not in names
    ]
    lengths = {p.name for p in family.parameters if p.unit == "length"}
    for dimensions in family.every(Dimensions):
        faults += [f"Dimensions names {x!r}, which is no length" for x in dimensions.names if x not in lengths]
    turned = family.find(OutputLink) is not None
    if turned and family.position in names and not family.pose_output[family.position].wraps:
        faults.append("OutputLink turns by the position, which is no angle: mark it (wraps=True) or leave it out")
    if family.capabilities and not isinstance(family.domain, Turn):
        faults += [
            f"{type(found).__name__} is about a closed turn: leave it out over another domain"
            for found in family.capabilities
            if isinstance(found, Assembly | JointRecords | LinkTree | OutputLink)
        ]
    return faults


def _definitions(family: Family) -> list[str]:
    faults = []
    for o in (*family.pose_outputs, *(o for step in family.steps for o in step.provides)):
        if not o.text or not o.unit:
            faults.append(f"output {o.name}: give its unit and its definition")
        elif not is_known(o.unit):
            words = ", ".join(WORDS)
            faults.append(f"output {o.name}: nothing converts {o.unit!r}: use 1, rad, s, N, {words}, * / and ^")
        if o.name.startswith((ERROR, MINUS)):
            faults.append(f"output {o.name}: {ERROR} and {MINUS} stand before names of errors and negatives: rename it")
    faults += [f"dear names {name!r}, which is no pose output" for name in family.dear if name not in family.pose_names]
    return faults


def _position(family: Family) -> list[str]:
    faults: list[str] = []
    position = family.pose_output.get(family.position)
    if position is None:
        return [f"position {family.position!r} is no pose output: name the follower's coordinate"]
    if position.unit == "rad" and isinstance(family.domain, Turn) and not position.wraps:
        faults.append(f"position {position.name!r} is an angle over a turn: mark it wraps=True")
    if position.wraps and position.unit != "rad":
        faults.append(f"position {position.name!r} wraps, but its unit is {position.unit}: only angles do")
    if position.wraps:
        text = "is windowed, but the position is an angle: a window is a part of a stroke"
        faults += [f"{o.name} {text}" for o in family.pose_outputs if o.windowed]
    if family.outward:
        sign = next((p for p in family.parameters if p.name == family.outward), None)
        if sign is None or sign.choices != (-1.0, 1.0):
            faults.append(f"outward {family.outward!r} is no parameter with the choices -1 and +1")
    return faults


def _derivatives(family: Family) -> list[str]:
    faults, outputs, of = [], family.pose_output, family.derivative_of
    if isinstance(family.domain, March):
        if of:
            faults.append("derivative_of over a march: its poses exist on their own grid only, so leave it out")
        return faults
    for name, derivative in of.items():
        missing = [one for one in (name, derivative) if one not in outputs]
        faults += [f"derivative_of names {one!r}, which is no pose output: add it or leave it out" for one in missing]
        if missing:
            continue
        unit, variable = of_derivative(outputs[name].unit, family.domain.unit), family.domain.name
        if outputs[derivative].unit != unit:
            found = outputs[derivative].unit
            faults.append(
                f"{derivative!r} is d {name} / d {variable}, so its unit is {unit!r}, not {found!r}: mend one"
            )
        if outputs[derivative].wraps or outputs[derivative].jumps:
            faults.append(f"{derivative!r} is a derivative: it neither wraps nor jumps, so leave these marks out")
    faults += [f"{name!r} is its own derivative: name another output" for name in of if _returns(of, name)]
    for name in outputs:
        lower = name[1:] if name.startswith("d") else ""
        if lower in outputs and name not in of.values():
            faults.append(f"{name!r} looks like the derivative of {lower!r}: name it in derivative_of, or rename it")
    return faults + _orders(family)


def _orders(family: Family) -> list[str]:
    """Require derivatives of the position over a turn: limits are their roots, and an angle may drive a next stage."""
    position = family.pose_output.get(family.position)
    if position is None or not isinstance(family.domain, Turn):
        return []
    needed = 3 if position.wraps else 2
    found = len(family.derivatives(family.position, needed)) - 1
    if found == needed:
        return []
    why = "extrema, limit positions, a next stage" if position.wraps else "extrema and limit positions"
    return [f"derivative_of has {found} orders of {family.position!r}: name {needed}, for {why}"]


def _returns(of: Mapping[str, str], name: str) -> bool:
    """Whether the derivatives of an output form a cycle through it."""
    start = name
    passed: set[str] = set()
    while name in of and name not in passed:
        passed.add(name)
        name = of[name]
    return name == start and start in passed


def _events(family: Family) -> list[str]:
    names = [event.name for event in family.events]
    faults = [f"two events are called {name!r}: rename one" for name, times in Counter(names).items() if times > 1]
    return faults + [
        f"event {e.name} is about {e.of!r}, which is no pose output"
        for e in family.events
        if e.of not in family.pose_names
    ]


def _steps(family: Family) -> list[str]:
    steps = [step.name for step in family.steps]
    faults = [f"two steps are called {name!r}: rename one" for name, times in Counter(steps).items() if times > 1]
    if "size" in steps:
        faults.append("a step is called 'size', as one that every family is given: rename it")
    return faults + [
        f"step {step.name} provides {o.name!r}, which is a pose output: rename one"
        for step in family.steps
        for o in step.provides
        if o.name in family.pose_names
    ]
