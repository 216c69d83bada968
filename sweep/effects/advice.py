"""Which effects a scene computes, in which order and at what cost, and which of them will matter there."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from sweep.effects import applicable, called_for, effect
from sweep.effects.base import Advice, Effect, Scene
from sweep.families.base import Angles, Array, Family
from sweep.families.chain import Chain

SAMPLES = 64
# The motion with what the joint records take of it [ns per pose], measured (tests/bench/effects.py).
MOTION_NS = 60.0


class Finding(NamedTuple):
    """What an effect's rule of negligibility says of a scene."""

    effect: Effect
    wanted: bool
    advice: Advice

    @property
    def words(self) -> str:
        """One sentence with the number."""
        side = "below" if self.advice.negligible else "not below"
        verdict = {
            (True, True): "wanted, but will not matter",
            (True, False): "matters",
            (False, True): "rightly left out",
            (False, False): "not wanted, but will matter",
        }[self.wanted, self.advice.negligible]
        numbers = f"{self.advice.quantity} {self.advice.worst:.3g}, {side} {self.advice.threshold:.3g}"
        return f"{self.effect.name}: {verdict}: {numbers}"


def wanted_effects(family: Family, wanted: Iterable[str]) -> tuple[Effect, ...]:
    """The effects that a family, or the first stage of a chain, computes for these names."""
    if isinstance(family, Chain):
        return called_for(family.stages[0].family, [name.removesuffix("1") for name in wanted if name.endswith("1")])
    return called_for(family, wanted)


def closure(effects: Iterable[Effect]) -> tuple[Effect, ...]:
    """The effects with all they need, each after what it needs."""
    found: dict[str, Effect] = {}

    def visit(entry: Effect) -> None:
        for name in entry.needs:
            visit(effect(name))
        found.setdefault(entry.name, entry)

    for entry in effects:
        visit(entry)
    return tuple(found.values())


def tree(family: Family, wanted: Iterable[str], poses: float) -> list[tuple[str, str, str, str]]:
    """Rows of a small tree: effect, key, cost, share; what an effect needs stands below it and is part of its cost.

    ``poses`` is the number of poses of one design, for the cost of what is computed per design.
    """
    names = tuple(wanted)
    own = wanted_effects(family, names)
    costs = {entry.name: cost(entry, names, poses) for entry in own}
    total = poses * MOTION_NS + sum(costs.values())
    rows = [("motion", "K0", f"{MOTION_NS:.3g} ns per pose", f"{100.0 * poses * MOTION_NS / total:.0f} %")]
    for entry in own:
        whole = costs[entry.name] > poses * entry.ns_per_pose
        unit = f"{costs[entry.name] / 1e3:.3g} us per design" if whole else f"{entry.ns_per_pose:.0f} ns per pose"
        rows.append((entry.name, entry.key, unit, f"{100.0 * costs[entry.name] / total:.0f} %"))
        for depth, need in _needs(entry, 1):
            rows.append(("  " * depth + need.name, need.key, "part of it", ""))
    return rows


def cost(entry: Effect, wanted: Iterable[str], poses: float) -> float:
    """Nanoseconds per design of what is wanted of an effect."""
    design = {o.name for o in entry.design_result.outputs} if entry.design_result else set()
    names = {name.removesuffix("1") if name not in design else name for name in wanted}
    whole = entry.design_result.ns_per_design if entry.design_result and names & design else 0.0
    per_pose = entry.ns_per_pose * poses
    return whole + (per_pose if not whole or called_for_poses(entry, names) else 0.0)


def called_for_poses(entry: Effect, names: Iterable[str]) -> bool:
    """Whether a pose output of the effect is wanted by itself or through a general reduction."""
    if entry.whole_turn:
        return False
    return any(name.endswith(o.name) for name in names for o in entry.outputs)


def _needs(entry: Effect, depth: int) -> list[tuple[int, Effect]]:
    return [pair for name in entry.needs for pair in [(depth, effect(name)), *_needs(effect(name), depth + 1)]]


def left_out(family: Family, wanted: Iterable[str]) -> tuple[Effect, ...]:
    """Effects that could be asked for and are not needed here."""
    first = family.stages[0].family if isinstance(family, Chain) else family
    used = {entry.name for entry in closure(wanted_effects(family, wanted))}
    return tuple(entry for entry in applicable(first) if entry.name not in used)


def findings(bare: Family, full: Family, designs: Array, wanted: Iterable[str]) -> list[Finding]:
    """Apply the rule of every effect whose inputs the scene has, wanted or not, to some designs.

    Parameters
    ----------
    bare : the family without effects, or the chain, whose first stage counts
    full : the family the design matrix belongs to;  designs : (n, P)
    wanted : names of outputs
    """
    names = tuple(wanted)
    suffix = "1" if isinstance(bare, Chain) else ""
    first = bare.stages[0].family if isinstance(bare, Chain) else bare
    if first.joints is None:
        return []
    columns = {name: np.ascontiguousarray(designs[:, k]) for k, name in enumerate(full.parameter_names)}
    own = np.column_stack([columns[f"{name}{suffix}"] for name in first.parameter_names])
    angles = Angles.of(2.0 * np.pi * np.arange(SAMPLES)[None] / SAMPLES)
    computed = {entry.name for entry in wanted_effects(bare, names)}
    found = []
    for entry in applicable(first):
        inputs = {p.name: columns.get(f"{p.name}{suffix}", _default(p.default, len(designs))) for p in entry.inputs}
        if entry.advise is None or any(x is None for x in inputs.values()):
            continue
        known = {name: x for name, x in inputs.items() if x is not None}
        advice = entry.advise(Scene(first, own, angles, known))
        if advice is not None:
            found.append(Finding(entry, entry.name in computed, advice))
    return found


def _default(value: float | None, n: int) -> Array | None:
    return None if value is None else np.full(n, value)
