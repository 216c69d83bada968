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

from sweep.effects.base import Effect
from sweep.effects.evaluation import effect_poses, on_own_columns, run_design
from sweep.families.base import Family, Output, Parameter, Step
from sweep.families.chain import Chain, chain

# Name of each effect's entry: module and constant.  A new effect is a kernel file, an entry file and its line here.
_ENTRIES = {
    "pressure": ("pressure", "EFFECT"),
    "pressure_extrema": ("pressure_extrema", "EFFECT"),
    "coupler": ("coupler", "EFFECT"),
    "kinetostatics": ("kinetostatics", "EFFECT"),
    "slider_kinetostatics": ("kinetostatics", "SLIDER"),
    "friction": ("friction", "EFFECT"),
    "speed_fluctuation": ("speed", "EFFECT"),
    "sliding_bearings": ("bearings", "SLIDING"),
    "rolling_bearings": ("bearings", "ROLLING"),
    "sliding_limits": ("bearings", "SLIDING_LIMIT"),
    "rolling_limits": ("bearings", "ROLLING_LIMIT"),
    "bearing_life": ("bearing_life", "EFFECT"),
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
    return tuple(entry for entry in applicable(family) if not names.isdisjoint(o.name for o in outputs(entry)))


def outputs(entry: Effect) -> tuple[Output, ...]:
    """Pose and design outputs of an effect."""
    return (*entry.outputs, *(entry.design_result.outputs if entry.design_result else ()))


def input_names(family: Family) -> frozenset[str]:
    """Inputs of all effects that can be asked of a family, or of the stages of a chain."""
    if isinstance(family, Chain):
        return frozenset(f"{name}{s.number}" for s in family.stages for name in input_names(s.family))
    return frozenset(p.name for entry in applicable(family) for p in entry.inputs)


def offered(family: Family) -> tuple[Output, ...]:
    """Pose and design outputs of all effects that can be asked of a family, or of a chain's first stage."""
    if isinstance(family, Chain):
        return tuple(replace(o, name=f"{o.name}1") for o in offered(family.stages[0].family))
    return tuple(o for entry in applicable(family) for o in outputs(entry))


def extended(family: Family, wanted: Iterable[str]) -> Family:
    """The family with the effects that ``wanted`` calls for; the family itself where it calls for none.

    The inputs of the effects become further parameters, after the family's own.  In a chain an effect belongs to a
    stage, and its inputs and outputs carry the stage's number.
    """
    names = tuple(wanted)
    if isinstance(family, Chain):
        stages = tuple(_extended_stage(family, k, names) for k in range(len(family.stages)))
        same = all(new is stage.family for new, stage in zip(stages, family.stages, strict=True))
        return family if same else chain(stages)
    return with_effects(family, called_for(family, names))


def _extended_stage(family: Chain, k: int, wanted: tuple[str, ...]) -> Family:
    stage = family.stages[k]
    number = str(stage.number)
    own = [name.removesuffix(number) for name in wanted if name.endswith(number)]
    if k == len(family.stages) - 1:
        own += [name for name in wanted if not name.endswith(number)]
    return with_effects(stage.family, tuple(e for e in called_for(stage.family, own) if k == 0 or _any_crank(e)))


def _any_crank(entry: Effect) -> bool:
    """Whether an effect also holds where the crank does not turn evenly, as in the later stages of a chain."""
    steady = any(p.name == "speed" for p in entry.inputs)
    return not (steady or entry.whole_turn or entry.design_result)


def with_effects(family: Family, effects: tuple[Effect, ...]) -> Family:
    """The family with the outputs and inputs of these effects."""
    if not effects:
        return family
    added = _inputs(effects)
    own = len(family.parameters)
    steps = tuple(
        Step(
            name=entry.name,
            provides=entry.design_result.outputs,
            run=partial(run_design, family, entry, added, own),
            ns_per_design=entry.design_result.ns_per_design,
        )
        for entry in effects
        if entry.design_result is not None
    )
    return replace(
        family,
        parameters=(*family.parameters, *added),
        pose_outputs=(*family.pose_outputs, *(o for entry in effects for o in entry.outputs)),
        poses=partial(effect_poses, family, effects, added, own),
        steps=(*(on_own_columns(step, own) for step in family.steps), *steps),
        dear={o.name: (entry.name, entry.ns_per_pose) for entry in effects for o in entry.outputs},
    )


def _inputs(effects: tuple[Effect, ...]) -> tuple[Parameter, ...]:
    """Inputs of all effects; one that several share stands once, and is required if any of them requires it."""
    merged: dict[str, Parameter] = {}
    for entry in effects:
        for p in entry.inputs:
            kept = merged.get(p.name)
            if kept is None:
                merged[p.name] = replace(p, text=f"{p.text}; for {entry.name}")
            else:
                default = kept.default if p.default is not None else None
                merged[p.name] = replace(kept, text=f"{kept.text}, {entry.name}", default=default)
    return tuple(merged.values())
