"""Names of effects among the wanted names, each of which stands for the outputs of its effect."""

from __future__ import annotations

from collections.abc import Iterable

from sweep.effects import NAMES, applicable
from sweep.effects.base import PlacedEffect
from sweep.families.base import Family, Output
from sweep.families.machines.machine import Machine
from sweep.families.names import stem
from sweep.families.reduction import prefixes

AXES = ("_x", "_y", "_z")


def expanded(family: Family, wanted: Iterable[str], *, poses: bool = False) -> list[str]:
    """Replace the names of effects among the wanted names by their outputs.

    ``friction`` stands for the friction effect's own design outputs, and for the largest magnitude over the turn of
    each of its pose outputs; for some, such as a life, for the smallest value.  A vector counts by its length, and
    outputs that jump or wrap are left out.  With ``poses`` the name stands for all pose outputs of the effect.  An
    output of the same name has precedence.  In a chain ``friction2`` is the effect at stage 2, ``friction`` that of
    every stage that has it; in a machine the member's name is a prefix.

    Parameters
    ----------
    family : without effects
    wanted : names of outputs and of effects
    """
    asked = list(wanted)
    if all(stem(name) not in NAMES for name in asked):
        return asked
    stand = names_of_effects(family, poses)
    found = [part for name in asked for part in stand.get(name, (name,))]
    return list(dict.fromkeys(found))


def names_of_effects(family: Family, poses: bool = False) -> dict[str, tuple[str, ...]]:
    """Map the name of each effect to the outputs that it stands for."""
    found: dict[str, tuple[str, ...]] = {}
    if isinstance(family, Machine):
        for m in family.members:
            for name, own in names_of_effects(m.family, poses).items():
                found[f"{m.name}.{name}"] = tuple(f"{m.name}.{output}" for output in own)
        return found
    effects = applicable(family)
    taken = {o.name for placed in effects for o in (placed.pose_outputs if poses else placed.design_outputs)}
    for placed in effects:
        numbered = tuple(f"{o.name}{placed.number}" for o in placed.entry.outputs)
        outputs = found[placed.name] = numbered if poses else _design_names(placed, prefixes(family.domain))
        if placed.number:
            found[placed.entry.name] = (*found.get(placed.entry.name, ()), *outputs)
    return {name: outputs for name, outputs in found.items() if name not in taken}


def _design_names(placed: PlacedEffect, reductions: tuple[str, ...]) -> tuple[str, ...]:
    names = {o.name for o in placed.entry.outputs}
    poses = [o for o in placed.entry.outputs if not (o.jumps or o.wraps or _part_of_vector(o, names))]
    whole = placed.entry.design_result
    own = [o for o in whole.outputs if not _is_reduction(o, names, reductions)] if whole is not None else []
    found = (
        *(o.name for o in own if not o.jumps),
        *(f"{'min' if o.name in placed.entry.least else 'max_abs'}_{o.name}" for o in poses),
    )
    return tuple(f"{name}{placed.number}" for name in found)


def _part_of_vector(output: Output, names: set[str]) -> bool:
    return output.name.endswith(AXES) and output.name[:-2] in names


def _is_reduction(output: Output, names: set[str], reductions: tuple[str, ...]) -> bool:
    return any(output.name.removeprefix(prefix) in names for prefix in reductions if output.name.startswith(prefix))
