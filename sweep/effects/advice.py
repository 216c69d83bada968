"""Advice on a scene's effects: which are computed, in which order and at what cost, and which of them matter."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from sweep.costs import nanoseconds
from sweep.effects import applicable, asked_of_machine, asks_speed, called_for, effect, inputs
from sweep.effects.base import Advice, Effect, PlacedEffect
from sweep.effects.scene import first_scene
from sweep.families.base import Angles, Array, Family
from sweep.families.machines.machine import Machine
from sweep.families.machines.main_shaft import ShaftTorque

SAMPLES = 64


class _Part(NamedTuple):
    """Family, chain or machine's member with effects, the prefix of its names, and its wanted outputs.

    ``even``: no other member drives it.  ``shared``: a relation torque tells the speed of its shaft.
    """

    before: str
    family: Family
    wanted: frozenset[str]
    even: bool = True
    shared: bool = False

    @property
    def offered(self) -> list[PlacedEffect]:
        """Effects of the part, without those that need a speed if another member drives it."""
        of = self.family
        return [p for p in applicable(of) if self.even or not asks_speed(one.name for one in inputs(of, [p]))]


def _parts(family: Family, wanted: Iterable[str]) -> list[_Part]:
    if not isinstance(family, Machine):
        return [_Part("", family, frozenset(wanted))]
    asked = asked_of_machine(family, wanted)
    shared = {one.member for r in family.relations if isinstance(r, ShaftTorque) for one in r.driven}
    return [
        _Part(f"{m.name}.", m.family, frozenset(map(m.own, asked)) - {""}, m.driver is None, m.name in shared)
        for m in family.members
    ]


class Finding(NamedTuple):
    """Result of an effect's rule of negligibility for a scene."""

    name: str
    wanted: bool
    advice: Advice

    @property
    def words(self) -> str:
        """The finding as one sentence with the number."""
        advice, side = self.advice, "below" if self.advice.negligible else "not below"
        numbers = f"{advice.worst:.3g}{advice.unit and f' {advice.unit}'}, {side} {advice.threshold:.3g}"
        if not (self.wanted or advice.negligible):
            return f"{advice.quantity[0].upper()}{advice.quantity[1:]} is large ({numbers}); ask for `{self.name}`"
        verdict = {
            (True, True): "wanted, but will not matter",
            (True, False): "matters",
            (False, True): "rightly left out",
        }[self.wanted, advice.negligible]
        return f"{self.name}: {verdict}: {advice.quantity} {numbers}"


def closure(effects: Iterable[Effect]) -> tuple[Effect, ...]:
    """Effects with all the effects that they need, each after those it needs."""
    found: dict[str, Effect] = {}

    def visit(entry: Effect) -> None:
        for name in entry.needs:
            visit(effect(name))
        found.setdefault(entry.name, entry)

    for entry in effects:
        visit(entry)
    return tuple(found.values())


def tree(family: Family, wanted: Iterable[str], poses: float) -> list[tuple[str, str, str, str]]:
    """List the rows of a small tree: effect, key, cost, share.

    Effects needed by an effect are listed below it and included in its cost.  ``poses`` is the number of poses of one
    design, for the cost per design.
    """
    parts = _parts(family, wanted)
    each = [(part, placed) for part in parts for placed in called_for(part.family, part.wanted)]
    motion = len(parts) * nanoseconds("work", "joint records")
    costs = [cost(placed, part.wanted, poses) for part, placed in each]
    total = poses * motion + sum(costs)
    rows = [("motion", "K0", f"{motion:.3g} ns per pose", f"{100.0 * poses * motion / total:.0f} %")]
    for (part, placed), ns in zip(each, costs, strict=True):
        whole = ns > poses * placed.entry.ns_per_pose
        unit = f"{ns / 1e3:.3g} us per design" if whole else f"{placed.entry.ns_per_pose:.0f} ns per pose"
        rows.append((f"{part.before}{placed.name}", placed.entry.key, unit, f"{100.0 * ns / total:.0f} %"))
        for depth, need in _needs(placed.entry, 1):
            rows.append(("  " * depth + need.name, need.key, "part of it", ""))
    return rows


def cost(placed: PlacedEffect, wanted: frozenset[str], poses: float) -> float:
    """Time of an effect's wanted outputs [ns per design]."""
    per_design = not wanted.isdisjoint(o.name for o in placed.design_outputs)
    reduced = (name for name in wanted if not any(name == o.name for o in placed.design_outputs))
    per_pose = any(name.endswith(o.name) for name in reduced for o in placed.pose_outputs)
    return per_design * placed.entry.ns_per_design + per_pose * poses * placed.entry.ns_per_pose


def _needs(entry: Effect, depth: int) -> list[tuple[int, Effect]]:
    return [pair for name in entry.needs for pair in [(depth, effect(name)), *_needs(effect(name), depth + 1)]]


def left_out(family: Family, wanted: Iterable[str]) -> tuple[str, ...]:
    """List the effects that the family has but that are not computed."""
    found: list[str] = []
    for part in _parts(family, wanted):
        used = _computed(part)
        found += [f"{part.before}{placed.name}" for placed in part.offered if placed.name not in used]
    return tuple(found)


def _computed(part: _Part) -> set[str]:
    """Names of the effects that the wanted outputs need, directly or through other effects."""
    called = called_for(part.family, part.wanted)
    return {f"{entry.name}{placed.number}" for placed in called for entry in closure([placed.entry])}


def findings(bare: Family, full: Family, designs: Array, wanted: Iterable[str]) -> list[Finding]:
    """Apply the rule of every effect whose inputs the scene has, wanted or not, to some designs.

    Parameters
    ----------
    bare : the family, chain or machine without effects
    full : the family the design matrix belongs to;  designs : (n, P)
    wanted : names of outputs
    """
    whole = {name: np.ascontiguousarray(designs[:, k]) for k, name in enumerate(full.parameter_names)}
    found = []
    for part in _parts(bare, wanted):
        columns = {name.removeprefix(part.before): x for name, x in whole.items() if name.startswith(part.before)}
        found += [one._replace(name=f"{part.before}{one.name}") for one in _findings(part, columns)]
    return found


def _findings(part: _Part, columns: dict[str, Array]) -> list[Finding]:
    bare, computed = part.family, _computed(part)
    own = np.column_stack([columns[name] for name in bare.parameter_names])
    angles = Angles.of(2.0 * np.pi * np.arange(SAMPLES)[None] / SAMPLES)
    needs = {placed.name: inputs(bare, [placed]) for placed in part.offered}
    defaults = {p.name: p.left_out(columns) for some in needs.values() for p in some}
    # A rule may need more than its effect's own inputs, so it gets all inputs of the scene.
    given = {name: np.full(len(own), x) for name, x in defaults.items() if x is not None} | columns
    found = []
    for placed in part.offered:
        if any(p.default is None and p.name not in columns for p in needs[placed.name]):
            continue
        if part.shared and "D4" in placed.entry.key and placed.name not in computed:
            continue  # the fluctuation of the shaft, with all members and its flywheel
        advice = placed.entry.advice(first_scene(bare, own, angles, given).stage(placed.stage))
        if advice is not None:
            found.append(Finding(placed.name, placed.name in computed, advice))
    return found
