"""Which effects a scene computes, in which order and at what cost, and which of them will matter there."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from sweep.costs import nanoseconds
from sweep.effects import applicable, called_for, effect, inputs
from sweep.effects.base import Advice, Effect, Placed
from sweep.effects.scene import first_scene
from sweep.families.base import Angles, Array, Family

SAMPLES = 64


class Finding(NamedTuple):
    """What an effect's rule of negligibility says of a scene."""

    name: str
    wanted: bool
    advice: Advice

    @property
    def words(self) -> str:
        """One sentence with the number."""
        advice, side = self.advice, "below" if self.advice.negligible else "not below"
        numbers = f"{advice.worst:.3g}, {side} {advice.threshold:.3g}{advice.unit and f' {advice.unit}'}"
        if not (self.wanted or advice.negligible):
            return f"{advice.quantity[0].upper()}{advice.quantity[1:]} is large; ask for `{self.name}`: {numbers}"
        verdict = {
            (True, True): "wanted, but will not matter",
            (True, False): "matters",
            (False, True): "rightly left out",
        }[self.wanted, advice.negligible]
        return f"{self.name}: {verdict}: {advice.quantity} {numbers}"


def closure(effects: Iterable[Effect]) -> tuple[Effect, ...]:
    """Effects with all they need, each after what it needs."""
    found: dict[str, Effect] = {}

    def visit(entry: Effect) -> None:
        for name in entry.needs:
            visit(effect(name))
        found.setdefault(entry.name, entry)

    for entry in effects:
        visit(entry)
    return tuple(found.values())


def tree(family: Family, wanted: Iterable[str], poses: float) -> list[tuple[str, str, str, str]]:
    """Rows of a small tree: effect, key, cost, share.

    What an effect needs stands below it and is part of its cost.  ``poses`` is the number of poses of one
    design, for the cost of what is computed per design.
    """
    names = frozenset(wanted)
    own = called_for(family, names)
    motion = nanoseconds("work", "joint records")
    costs = {placed.name: cost(placed, names, poses) for placed in own}
    total = poses * motion + sum(costs.values())
    rows = [("motion", "K0", f"{motion:.3g} ns per pose", f"{100.0 * poses * motion / total:.0f} %")]
    for placed in own:
        whole = costs[placed.name] > poses * placed.entry.ns_per_pose
        per_pose = f"{placed.entry.ns_per_pose:.0f} ns per pose"
        unit = f"{costs[placed.name] / 1e3:.3g} us per design" if whole else per_pose
        rows.append((placed.name, placed.entry.key, unit, f"{100.0 * costs[placed.name] / total:.0f} %"))
        for depth, need in _needs(placed.entry, 1):
            rows.append(("  " * depth + need.name, need.key, "part of it", ""))
    return rows


def cost(placed: Placed, wanted: frozenset[str], poses: float) -> float:
    """Nanoseconds per design of what is wanted of an effect."""
    per_design = not wanted.isdisjoint(o.name for o in placed.design_outputs)
    reduced = (name for name in wanted if not any(name == o.name for o in placed.design_outputs))
    per_pose = any(name.endswith(o.name) for name in reduced for o in placed.pose_outputs)
    return per_design * placed.entry.ns_per_design + per_pose * poses * placed.entry.ns_per_pose


def _needs(entry: Effect, depth: int) -> list[tuple[int, Effect]]:
    return [pair for name in entry.needs for pair in [(depth, effect(name)), *_needs(effect(name), depth + 1)]]


def left_out(family: Family, wanted: Iterable[str]) -> tuple[str, ...]:
    """Names of the effects that could be asked for and are not needed here."""
    used = {
        f"{entry.name}{placed.number}" for placed in called_for(family, wanted) for entry in closure([placed.entry])
    }
    return tuple(placed.name for placed in applicable(family) if placed.name not in used)


def findings(bare: Family, full: Family, designs: Array, wanted: Iterable[str]) -> list[Finding]:
    """Apply the rule of every effect whose inputs the scene has, wanted or not, to some designs.

    Parameters
    ----------
    bare : the family without effects, or the chain
    full : the family the design matrix belongs to;  designs : (n, P)
    wanted : names of outputs
    """
    columns = {name: np.ascontiguousarray(designs[:, k]) for k, name in enumerate(full.parameter_names)}
    own = np.column_stack([columns[name] for name in bare.parameter_names])
    angles = Angles.of(2.0 * np.pi * np.arange(SAMPLES)[None] / SAMPLES)
    computed = {f"{e.name}{placed.number}" for placed in called_for(bare, wanted) for e in closure([placed.entry])}
    needs = {placed.name: inputs(bare, [placed]) for placed in applicable(bare)}
    defaults = {p.name: p.left_out(columns) for some in needs.values() for p in some}
    # A rule may look at more than its effect's own inputs, so it gets all that is known of the scene.
    given = {name: np.full(len(designs), x) for name, x in defaults.items() if x is not None} | columns
    found = []
    for placed in applicable(bare):
        if any(p.default is None and p.name not in columns for p in needs[placed.name]):
            continue
        advice = placed.entry.advice(first_scene(bare, own, angles, given).stage(placed.stage))
        if advice is not None:
            found.append(Finding(placed.name, placed.name in computed, advice))
    return found
