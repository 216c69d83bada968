"""Rules that the pose outputs of an entry keep: units, position, derivatives, events, own routes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from sweep.families.base import Family
from sweep.families.domain import March, Turn
from sweep.families.unit_words import WORDS, is_known, of_derivative

ERROR, MINUS = "err_", "minus_"  # what stands before the columns of errors and of negatives


def output_faults(family: Family) -> list[str]:
    """Return what is wrong with the outputs of an entry, each with its remedy."""
    return [*_definitions(family), *_position(family), *_derivatives(family), *_events(family), *_steps(family)]


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
    """Demand the derivatives of the position over a turn:
    limits are their roots, and an angle may drive a next stage.
    """
    position = family.pose_output.get(family.position)
    if position is None or not isinstance(family.domain, Turn):
        return []
    needed, found, name = (3 if position.wraps else 2), 0, family.position
    while name in family.derivative_of and found < needed:
        name, found = family.derivative_of[name], found + 1
    if found == needed:
        return []
    why = "extrema, limit positions, a next stage" if position.wraps else "extrema and limit positions"
    return [f"derivative_of has {found} orders of {family.position!r}: name {needed}, for {why}"]


def _returns(of: Mapping[str, str], name: str) -> bool:
    """Return whether the derivatives of an output lead back to it."""
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
