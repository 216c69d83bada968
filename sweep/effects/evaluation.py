"""Computation of effects together with the motion, in blocks whose joint records stay in the cache.

Kinks and waves that effects add to the curves of a family are described by :mod:`sweep.families.curve_features`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias

import numpy as np

from kernels.effects.coupler import DRIVING
from kernels.types import Status
from sweep.effects.base import PlacedEffect
from sweep.effects.scene import Scene, first_scene, take_over
from sweep.families.base import Accuracy, Angles, Array, Columns, Family, Output, Parameter, Step
from sweep.families.capabilities import Rates, ThreadPath
from sweep.families.curve_features import Bends, Crossing, Singular, of_order, of_table
from sweep.families.poses import blocks, differenced
from sweep.numerics.curves import Curve, TableCurve
from sweep.numerics.records import Mask

# Poses per block: many enough that the overhead of a block, some milliseconds, is small per pose.
BLOCK = 32768
# Designs per block of an effect that samples the turn itself, with some hundred poses of each.
TURNS = 32


@dataclass(frozen=True)
class Added:
    """A family or a chain with inputs of effects after its own parameters, and loads over the turn by input."""

    family: Family
    inputs: tuple[Parameter, ...]
    curves: Mapping[str, Curve]

    def own(self, designs: Array) -> Array:
        """Columns of the family itself."""
        return np.ascontiguousarray(designs[:, : len(self.family.parameters)])

    def scene(self, designs: Array, angles: Angles) -> Scene:
        """Make the scene of the first stage, of all designs at their angles."""
        columns = np.ascontiguousarray(designs[:, len(self.family.parameters) :].T)
        given = {p.name: column for p, column in zip(self.inputs, columns, strict=True)}
        return first_scene(self.family, self.own(designs), angles, given, self.curves)


def effect_poses(
    added: Added, effects: tuple[PlacedEffect, ...], designs: Array, angles: Angles, wanted: frozenset[str]
) -> Columns:
    """Compute the family's own poses and each effect with a wanted output; the status is the first that is not OK.

    Parameters
    ----------
    added, effects : the extended family and the effects
    designs : (n, P) with the inputs after the family's own columns;  angles : (n, m) or (1, m)
    wanted : pose outputs of family and effects
    """
    family = added.family
    own = wanted & frozenset(family.pose_names)
    if np.iscomplexobj(designs) or np.iscomplexobj(angles.cos):
        of_effects = wanted & frozenset(o.name for placed in effects for o in placed.pose_outputs)
        turned = differenced(partial(effect_poses, added, effects), designs, angles, of_effects) if of_effects else {}
        return turned | family.poses(added.own(designs), angles, own)
    asked = [(placed, names) for placed in effects if (names := [name for name in placed.own if name in wanted])]
    last, shape = len(family.stages) - 1, (len(designs), angles.cos.shape[1])
    # Without a wanted output of the family its motion is computed by the scenes only.
    bare = not own and bool(asked) and not any(placed.entry.whole_turn for placed, _ in asked)
    columns: Columns = {} if bare else family.poses(added.own(designs), angles, own)
    if not asked:
        return columns
    status: Status = np.zeros(shape, np.uint8) if bare else np.array(columns["status"], dtype=np.uint8)
    columns |= {name: np.empty(shape) for _, names in asked for name in names}
    pointwise = [pair for pair in asked if not pair[0].entry.whole_turn]
    whole = [pair for pair in asked if pair[0].entry.whole_turn]
    # A whole-turn effect solves the turn of a design once, however many poses are wanted.
    turns = ((slice(i, i + TURNS), slice(None)) for i in range(0, shape[0], TURNS))
    for parts, where in ((pointwise, blocks(shape, BLOCK)), (whole, turns)):
        for rows, poses in where if parts else ():
            scene = added.scene(designs[rows], angles.part(rows, poses))
            if bare:
                status[rows, poses] = scene.stage(last).status()
            for placed, names in parts:
                found = placed.entry.compute(scene.stage(placed.stage), frozenset(placed.own[name] for name in names))
                take_over(status[rows, poses], found["status"])
                for name in names:
                    columns[name][rows, poses] = found[placed.own[name]]
    return columns | {"status": status}


def run_design(
    added: Added, placed: PlacedEffect, designs: Array, wanted: frozenset[str], accuracy: Accuracy
) -> Columns:
    """Compute design outputs of an effect, block by block."""
    whole_turn = placed.entry.design_result
    assert whole_turn is not None
    names = frozenset(placed.own[name] for name in wanted)
    at_rest = Angles.of(np.zeros((1, 1)))
    parts = []
    for start in range(0, max(len(designs), 1), whole_turn.block):
        scene = added.scene(designs[start : start + whole_turn.block], at_rest)
        parts.append(whole_turn.run(scene, names, accuracy))
    whole = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    pairs = [(f"{e}{name}", f"{e}{placed.own[name]}") for name in wanted for e in ("", "err_")]
    return {"status": whole["status"]} | {name: whole[own] for name, own in pairs if own in whole}


def bend_curves(added: Added, placed: PlacedEffect, bend: Bends, designs: Array, angles: Angles) -> Array:
    """Evaluate the functions at whose zeros outputs of an effect bend, (n, m, q), block by block."""
    shape = len(designs), angles.cos.shape[1]
    found: list[Array] = []
    for rows, poses in blocks(shape, BLOCK):
        scene = added.scene(designs[rows], angles.part(rows, poses))
        values = bend.curves(scene.stage(placed.stage))
        found = found or [np.empty((*shape, values.shape[2]))]
        found[0][rows, poses] = values
    return found[0]


def on_own_columns(step: Step, own: int) -> Step:
    """Adapt a family's own step to a design matrix with further columns after the family's."""

    def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
        return step.run(np.ascontiguousarray(designs[:, :own]), wanted, accuracy)

    return replace(step, run=run)


Feeling: TypeAlias = Callable[[str], frozenset[str]]
"""Function that names the pose outputs of effects that depend on an input."""


def bent(
    family: Family, effects: tuple[PlacedEffect, ...], curves: Mapping[str, Curve], feeling: Feeling
) -> list[Output]:
    """Pose outputs of effects, marked with kinks where a table of loads may cause a narrow peak.

    Outputs of a thread are also marked where it comes to lie on its take-up and leaves it.
    """
    felt = frozenset().union(*(feeling(name) for name, curve in curves.items() if isinstance(curve, TableCurve)))
    path = family.find(ThreadPath)
    if path is not None and family.pose_output[path.wrap].kinks:
        felt |= {o.name for placed in effects if placed.entry.requires is ThreadPath for o in placed.pose_outputs}
    found = [o for placed in effects for o in placed.pose_outputs]
    return [replace(o, kinks=not (o.wraps or o.jumps)) if o.name in felt else o for o in found]


def paces(curves: Mapping[str, Curve], feeling: Feeling) -> list[object]:
    """Features of load curves: kinks of tables, and number of waves of series."""
    return [
        of_table(c.phi, feeling(name))
        if isinstance(c, TableCurve)
        else of_order(max(len(c.cos), len(c.sin)), feeling(name))
        for name, c in curves.items()
    ]


def piercing(family: Family, added: tuple[Parameter, ...], feeling: Feeling) -> list[Crossing]:
    """Crossings at which a tool pierces: a position of its stage's follower."""
    columns = {p.name: len(family.parameters) + k for k, p in enumerate(added)}
    found = []
    for stage in family.stages:
        force, at = columns.get(f"pierce_force{stage.tail}"), columns.get(f"pierce_at{stage.tail}")
        if force is not None and at is not None:
            position = f"{stage.family.position}{stage.tail}"
            felt = feeling(f"pierce_force{stage.tail}")
            found.append(Crossing(position, partial(_column, at), partial(_is_given, force), felt))
    return found


def bends(added: Added, effects: tuple[PlacedEffect, ...]) -> list[Bends]:
    """Bends of outputs of effects, from the most accurate poses: a cut must hit a narrow peak."""
    precise, found = replace(added, family=added.family.precise()), []
    for placed in effects:
        for bend in placed.entry.bends:
            of = frozenset(name for name, own in placed.own.items() if own in bend.of)
            found += [replace(bend, of=of, curves=partial(bend_curves, precise, placed, bend))] if of else []
    return found


def fingers(added: Added, feeling: Feeling) -> list[Singular]:
    """Singularities of a finger in the crank's ball joint, where the coupler is along the crank axis."""
    precise, own = replace(added, family=added.family.precise()), len(added.family.parameters)
    columns = {p.name: own + k for k, p in enumerate(added.inputs)}
    names = [f"finger{stage.tail}" for stage in added.family.stages]
    return [
        Singular(partial(_finger_sine, precise, k, columns[name]), of=feeling(name))
        for k, name in enumerate(names)
        if name in columns
    ]


def _finger_sine(added: Added, stage: int, column: int, designs: Array, angles: Angles, _: Columns) -> Array:
    """Squared sine of the angle between coupler and crank axis of a stage, (n, m); 1 without a finger at the crank."""
    held = np.flatnonzero(designs[:, column] == DRIVING)
    square = np.ones((len(designs), angles.cos.shape[1]))
    for rows, poses in blocks((held.size, square.shape[1]), BLOCK):
        some = held[rows]
        part = Angles(*(np.broadcast_to(x, square.shape)[some, poses] for x in angles))
        square[some, poses] = added.scene(designs[some], part).stage(stage).finger_square
    return square


def features(added: Added, effects: tuple[PlacedEffect, ...], feeling: Feeling) -> list[object]:
    """Kinks, waves and singularities that effects and loads add to curves."""
    pierced = piercing(added.family, added.inputs, feeling)
    rates = Rates({low: high for placed in effects for low, high in placed.rates.items()})
    return [*paces(added.curves, feeling), *pierced, *bends(added, effects), *fingers(added, feeling), rates]


def _column(column: int, designs: Array) -> Array:
    return designs[:, column]


def _is_given(column: int, designs: Array) -> Mask:
    given: Mask = designs[:, column] != 0.0
    return given
