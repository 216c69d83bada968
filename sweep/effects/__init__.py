"""The register of effects, which ``sweep effects``, docs/effects.md and a scene's plan are generated from.

:func:`extended` adds to a family the outputs and inputs of exactly those effects that provide some wanted output; all
other code sees a `Family` like any other.  Other effects are not imported, not compiled, and need no input.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache, partial
from importlib import import_module
from types import MappingProxyType

from sweep.effects.base import CURVED, REGISTER, Effect, PlacedEffect
from sweep.effects.evaluation import Added, bent, effect_poses, features, on_own_columns, run_design
from sweep.errors import InputError
from sweep.families.base import Accuracy, Family, Output, Parameter, Step, Work, of_family
from sweep.families.chain import Chain
from sweep.families.machines.machine import Machine
from sweep.families.machines.relations import EventValue
from sweep.families.names import at_stage, stem
from sweep.families.reduction import reduced
from sweep.numerics.curves import Curve

# By name: entry of the effect, module and constant, or module and function, with the family that it is made for.
_ENTRIES: dict[str, tuple[str, str]] = {name: (table["entry"], "") for name, table in REGISTER["effects"].items()}
_ENTRIES |= {
    f"{family}_{kind}": (table["entry"], family)
    for kind, table in REGISTER["of_families"].items()
    for family in table["families"]
}
NAMES = tuple(_ENTRIES)

# In later stages, speed and acceleration are those of the first stage's crank.
_FIRST_ONLY = ("speed", "speed_change")

JUMP_NS = 12e6  # a whole turn takes its finest grid where a load jumps: unevenness was measured at 10 and 13 ms

NO_CURVES: Mapping[str, Curve] = MappingProxyType({})


@lru_cache
def effect(name: str) -> Effect:
    """Look up an effect's entry in the register."""
    place, of = _ENTRIES[name]
    module, _, attribute = place.partition(".")
    found = getattr(import_module(f"sweep.effects.{module}"), attribute)
    entry: Effect = found(of) if of else found
    return entry


@of_family
def serving(family: Family) -> tuple[Effect, ...]:
    """Effects whose requirements a family meets, in the order of the register.

    Effects that are made for other families are not made for it.
    """
    found = (effect(name) for name, (_, of) in _ENTRIES.items() if of in ("", family.name))
    return tuple(entry for entry in found if entry.serves(family))


@of_family
def applicable(family: Family) -> tuple[PlacedEffect, ...]:
    """Effects of a family or of the stages of a chain, in the order of the register.

    A later stage of a chain turns unevenly; an effect whose load includes that of later stages needs them all to return
    it.
    """
    stages = family.stages
    found = [
        PlacedEffect(entry, k, stage.tail, k == len(stages) - 1)
        for k, stage in enumerate(stages)
        for entry in serving(stage.family)
        if not (k > 0 and entry.even_crank)
    ]
    return tuple(
        p
        for p in found
        if not p.entry.takes_load or p.entry.may_drive_nothing or p.stage == len(stages) - 1 or _handing(family, p)
    )


def called_for(family: Family, wanted: Iterable[str]) -> tuple[PlacedEffect, ...]:
    """Effects that provide some wanted output or the output of a wanted reduction, in the order of the register."""
    # max_abs_force_d needs force_d; outputs of the family itself need no effect, so that none is imported.
    asked = (reduced(name, family.domain) for name in wanted)
    names = {about for abouts in asked if family.pose_output.keys().isdisjoint(abouts) for about in abouts}
    names -= {o.name for step in family.steps for o in step.provides}
    if not names or names.isdisjoint(_effect_names(family)):
        return ()
    found = (p for p in applicable(family) if not names.isdisjoint(o.name for o in p.outputs))
    return tuple(p.narrowed(names) for p in found)


@of_family
def _effect_names(family: Family) -> frozenset[str]:
    """Names of the outputs of all effects of a family."""
    return frozenset(o.name for placed in applicable(family) for o in placed.outputs)


def _handing(family: Family, placed: PlacedEffect) -> list[PlacedEffect]:
    """Effects of all later stages that return the load on this one; empty if one of these stages has none."""
    key = placed.entry.takes_load
    found = [
        PlacedEffect(entry, k, stage.tail, False)
        for k, stage in enumerate(family.stages)
        for entry in serving(stage.family)
        if key and k > placed.stage and entry.key == key
    ]
    return found if len(found) == len(family.stages) - 1 - placed.stage else []


@of_family
def all_inputs(family: Family) -> Mapping[str, Parameter]:
    """Collect the inputs of all effects of a family, by name with the number of a stage or the name of a member."""
    if isinstance(family, Machine):
        return {f"{m.name}.{name}": p for m in family.members for name, p in all_inputs(m.family).items()}
    return {p.name: p for p in inputs(family, applicable(family))}


def input_names(family: Family) -> frozenset[str]:
    """Collect the names of the inputs of all effects of a family, or of the stages of a chain."""
    return frozenset(all_inputs(family))


def inputs_beside(family: Family, given: Iterable[str]) -> Mapping[str, Parameter]:
    """Return :func:`all_inputs` if a given name is not the family's own; otherwise no effect is imported."""
    return {} if {*family.parameter_names, family.domain.name}.issuperset(given) else all_inputs(family)


def curved_inputs(family: Family) -> tuple[str, ...]:
    """List the inputs to which a load over the turn can be added, for a family, a chain or a machine."""
    if isinstance(family, Machine):
        return tuple(f"{m.name}.{name}" for m in family.members for name in curved_inputs(m.family))
    known = {f"{own}{stage.tail}" for own in CURVED for stage in family.stages}
    return tuple(sorted(known & input_names(family)))


def offered(family: Family) -> tuple[Output, ...]:
    """Pose and design outputs of all effects of a family, or of the stages of a chain."""
    if isinstance(family, Machine):
        return tuple(replace(o, name=f"{m.name}.{o.name}") for m in family.members for o in offered(m.family))
    return tuple(o for placed in applicable(family) for o in placed.outputs)


def elsewhere(family: Family, name: str) -> str:
    """Words for an error: effects with this output that the family, or the stage of a chain, does not have."""
    if isinstance(family, Machine):
        found = family.split(name)
        return elsewhere(found[0].family, found[1]) if found else ""
    plain = reduced(name, family.domain)
    if isinstance(family, Chain):
        plain |= {stem(about) for about in plain}
    others = [
        entry for entry in map(effect, NAMES) if not plain.isdisjoint(o.name for o in PlacedEffect(entry).outputs)
    ]
    if not others:
        return ""
    words = ", ".join(f"{entry.name} ({', '.join(entry.families)})" for entry in others)
    first = isinstance(family, Chain) and all(entry.even_crank for entry in others)
    even = " at the first stage of a chain only" if first else ""
    return f"; {name} is an output of the effects{even}, families in brackets: {words}"


def extended(family: Family, wanted: Iterable[str], curves: Mapping[str, Curve] = NO_CURVES) -> Family:
    """Add the effects that ``wanted`` needs to a family; without any the family itself is returned.

    The inputs of the effects become further parameters, after the family's own.  In a chain an effect belongs to a
    stage, and its inputs and outputs carry the stage's number.  ``curves`` are loads over the turn of the crank, by the
    input to which they are added; inputs that no wanted effect has are ignored.
    """
    if isinstance(family, Machine):
        asked = asked_of_machine(family, wanted)
        found = {
            m.name: extended(
                m.family,
                [own for own in map(m.own, asked) if own],
                {own: curve for name, curve in curves.items() if (own := m.own(name))},
            )
            for m in family.members
        }
        _check_even(family, found)
        same = all(found[m.name] is m.family for m in family.members)
        return family if same else family.with_families(found)
    return with_effects(family, called_for(family, wanted), curves)


def asks_speed(names: Iterable[str]) -> bool:
    """Whether one of the inputs is the speed of a crank, of a chain that of its first stage."""
    return any(stem(name) == "speed" for name in names)


def _check_even(machine: Machine, found: Mapping[str, Family]) -> None:
    """Raise if a member that another one drives has an effect of an even crank or one that needs its speed."""
    for m in machine.members:
        added = found[m.name].parameter_names[len(m.family.parameter_names) :]
        if m.driver is not None and (asks_speed(added) or "shaking_estimate" in found[m.name].pose_output):
            allowed = (
                f"geometry alone, as {'.'.join(m.driver)} drives it unevenly: make one chain of both for its forces"
            )
            raise InputError("outputs", f"of loads of {m.name}", allowed, f"machine.{m.name}")


def asked_of_machine(machine: Machine, wanted: Iterable[str]) -> set[str]:
    """Find the outputs that wanted reductions, timings and relations of a machine need, members' outputs included."""
    names = {about for name in wanted for about in reduced(name, machine.domain)}
    asked = [timing for timing in machine.timings if timing.name in names]
    places = [place for timing in asked for place in timing.places]
    names |= {about for name in places for about in reduced(name, machine.domain)}
    names |= {timing.of.name for timing in asked if isinstance(timing, EventValue)}
    for relation in machine.relations:
        if not names.isdisjoint(o.name for o in (*relation.outputs, *relation.numbers)):
            names |= relation.needs(frozenset(names))
    return names


def with_effects(family: Family, effects: tuple[PlacedEffect, ...], curves: Mapping[str, Curve] = NO_CURVES) -> Family:
    """Add the outputs and inputs of the given effects to a family."""
    if not effects:
        return family
    added = Added(family, inputs(family, effects), curves)
    own, feeling = len(family.parameters), partial(_felt, family, effects)
    steps = tuple(
        Step(
            name=placed.name,
            provides=placed.design_outputs,
            run=partial(run_design, added, placed),
            work=Work.EFFECT,
            cost=partial(_design_ns, placed.entry),
            jump_ns=JUMP_NS if placed.entry.whole_turn else 0.0,
        )
        for placed in effects
        if placed.design_outputs
    )
    precise = family.precise_poses and partial(effect_poses, replace(added, family=family.precise()), effects)
    return replace(
        family,
        parameters=(*family.parameters, *added.inputs),
        pose_outputs=(*family.pose_outputs, *bent(family, effects, curves, feeling)),
        poses=partial(effect_poses, added, effects),
        precise_poses=precise,
        steps=(*(on_own_columns(step, own) for step in family.steps), *steps),
        capabilities=(*family.capabilities, *features(added, effects, feeling)),
        dear={o.name: (placed.name, placed.entry.ns_per_pose) for placed in effects for o in placed.pose_outputs},
    )


def _felt(family: Family, effects: tuple[PlacedEffect, ...], name: str) -> frozenset[str]:
    """Names of the pose outputs that depend on an input, also through the load of a later stage."""

    def takes(source: PlacedEffect) -> bool:
        own = at_stage(name, source.number) if source.number else name
        return any(p.name == own for p in source.entry.inputs_of(family.stages[source.stage].family))

    found = (placed for placed in effects if any(map(takes, (placed, *_handing(family, placed)))))
    return frozenset(o.name for placed in found for o in placed.pose_outputs)


def _design_ns(entry: Effect, accuracy: Accuracy) -> float:
    return entry.ns_per_design


def inputs(family: Family, effects: Iterable[PlacedEffect]) -> tuple[Parameter, ...]:
    """List the inputs of effects, and of the later stages' effects that return their load, with stage numbers.

    An input that several effects share is listed once, and is required if any of them requires it.
    """
    merged: dict[str, Parameter] = {}
    users: dict[str, list[str]] = {}
    first = family.stages[0].tail
    for placed in effects:
        for source in (placed, *_handing(family, placed)):
            for p in source.entry.inputs_of(family.stages[source.stage].family):
                name = f"{p.name}{first if p.name in _FIRST_ONLY else source.number}"
                optional = placed.entry.may_drive_nothing and source is not placed and p.default is None
                if name not in merged or (p.default is None and not optional):
                    merged[name] = replace(p, default=0.0) if optional and name not in merged else p
                users.setdefault(name, []).append(placed.name)
    return tuple(
        replace(p, name=name, text=f"{p.text}; for {', '.join(dict.fromkeys(users[name]))}")
        for name, p in merged.items()
    )
