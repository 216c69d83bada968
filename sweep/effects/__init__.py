"""The register of effects, from which a scene's plan, ``sweep effects`` and docs/effects.md are made.

:func:`extended` gives a family the outputs and inputs of exactly those effects that some wanted output belongs to; to
everything downstream the result is a `Family` like any other.  What is not wanted is not imported, not compiled, and
asks for no input.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache, partial
from importlib import import_module

import numpy as np

from kernels.status import OK
from sweep.effects.base import Effect, Scene
from sweep.families.base import Accuracy, Angles, Array, Columns, Family, Parameter, Step

# Name of each effect's entry: module and constant.  A new effect is a kernel file, an entry file and its line here.
_ENTRIES = {
    "pressure": ("pressure", "EFFECT"),
    "coupler": ("coupler", "EFFECT"),
    "kinetostatics": ("kinetostatics", "EFFECT"),
    "friction": ("friction", "EFFECT"),
    "speed_fluctuation": ("speed", "EFFECT"),
    "sliding_bearings": ("bearings", "SLIDING"),
    "rolling_bearings": ("bearings", "ROLLING"),
    "elasticity": ("elasticity", "STATIC"),
    "dynamic_elasticity": ("elasticity", "DYNAMIC"),
}
NAMES = tuple(_ENTRIES)

# Prefixes of the general reductions over the turn (sweep/catalogue.py): max_abs_force_d asks for force_d.
_REDUCTIONS = ("phi_max_abs_", "max_abs_", "max_", "min_", "range_", "rms_", "")


@lru_cache
def effect(name: str) -> Effect:
    """The register's entry of that name."""
    module, constant = _ENTRIES[name]
    entry: Effect = getattr(import_module(f"sweep.effects.{module}"), constant)
    return entry


def applicable(family: Family) -> tuple[Effect, ...]:
    """Effects that can be asked of a family, in the order of the register."""
    return tuple(entry for entry in map(effect, NAMES) if family.name in entry.families)


def called_for(family: Family, wanted: Iterable[str]) -> tuple[Effect, ...]:
    """The effects that some wanted pose output, design output or reduction belongs to, in the order of the register."""
    names = {name[len(prefix) :] for name in wanted for prefix in _REDUCTIONS if name.startswith(prefix)}
    return tuple(entry for entry in applicable(family) if names & _own_outputs(entry))


def _own_outputs(entry: Effect) -> set[str]:
    design = entry.design_result.outputs if entry.design_result else ()
    return {o.name for o in (*entry.outputs, *design)}


def extended(family: Family, wanted: Iterable[str]) -> Family:
    """The family with the effects that ``wanted`` calls for; the family itself where it calls for none.

    The inputs of the effects become further parameters, after the family's own.
    """
    return with_effects(family, called_for(family, wanted))


def with_effects(family: Family, effects: tuple[Effect, ...]) -> Family:
    """The family with the outputs and inputs of these effects."""
    if not effects:
        return family
    inputs = _inputs(effects)
    own = len(family.parameters)
    steps = tuple(
        Step(
            name=entry.name,
            provides=entry.design_result.outputs,
            run=partial(_run_design, family, entry, inputs, own),
            ns_per_design=entry.design_result.ns_per_design,
        )
        for entry in effects
        if entry.design_result is not None
    )
    return replace(
        family,
        parameters=(*family.parameters, *inputs),
        pose_outputs=(*family.pose_outputs, *(o for entry in effects for o in entry.outputs)),
        poses=partial(_poses, family, effects, inputs, own),
        steps=(*(_on_own_columns(step, own) for step in family.steps), *steps),
    )


def _inputs(effects: tuple[Effect, ...]) -> tuple[Parameter, ...]:
    """Inputs of all effects; one that several share stands once, and is required if any of them requires it."""
    merged: dict[str, Parameter] = {}
    for entry in effects:
        for p in entry.inputs:
            p = replace(p, text=f"{p.text}; for {entry.name}")
            kept = merged.get(p.name)
            if kept is not None:
                p = replace(
                    kept, text=f"{kept.text}, {entry.name}", default=kept.default if p.default is not None else None
                )
            merged[p.name] = p
    return tuple(merged.values())


def _on_own_columns(step: Step, own: int) -> Step:
    def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
        return step.run(np.ascontiguousarray(designs[:, :own]), wanted, accuracy)

    return replace(step, run=run)


def _columns(inputs: tuple[Parameter, ...], designs: Array, own: int) -> dict[str, Array]:
    return {p.name: np.ascontiguousarray(designs[:, own + k]) for k, p in enumerate(inputs)}


def _run_design(
    family: Family,
    entry: Effect,
    inputs: tuple[Parameter, ...],
    own: int,
    designs: Array,
    wanted: frozenset[str],
    accuracy: Accuracy,
) -> Columns:
    assert entry.design_result is not None
    bare = np.ascontiguousarray(designs[:, :own])
    return entry.design_result.run(family, bare, _columns(inputs, designs, own), wanted, accuracy)


def _poses(
    family: Family,
    effects: tuple[Effect, ...],
    inputs: tuple[Parameter, ...],
    own: int,
    designs: Array,
    angles: Angles,
    wanted: frozenset[str],
) -> Columns:
    """The family's own poses, then each effect with a wanted output; the status is the first that is not OK."""
    bare = np.ascontiguousarray(designs[:, :own])
    columns = family.poses(bare, angles, wanted & frozenset(family.pose_names))
    scene = Scene(family, bare, angles, _columns(inputs, designs, own))
    status = np.array(columns["status"])
    for entry in effects:
        asked = wanted & frozenset(o.name for o in entry.outputs)
        if asked:
            found = entry.compute(scene, asked)
            np.copyto(status, found.pop("status"), where=status == OK)
            columns |= found
    return columns | {"status": status}
