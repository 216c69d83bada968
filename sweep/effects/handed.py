"""What a stage of a chain hands back to the one that drives it, whichever of the routes to loads its family takes."""

from __future__ import annotations

from importlib import import_module

import numpy as np

from sweep.effects.base import Scene
from sweep.families.base import Array, Columns, Family, Parameter
from sweep.families.link_tree import LinkTree

LOADS, FRICTION = "D1, D3", "D2"  # keys of the effects that hand something back
INERTIAS = ("reduced_inertia", "dreduced_inertia")
# Modules of the route by joint records and of the route by a tree of links; each has ``compute``.
_ROUTES = {LOADS: ("kinetostatics", "links"), FRICTION: ("friction", "link_friction")}


def computed(scene: Scene, key: str, wanted: frozenset[str]) -> Columns:
    """Return outputs of the effect of that key for one stage."""
    by_records, by_links = _ROUTES[key]
    route = by_records if scene.family.find(LinkTree) is None else by_links
    found: Columns = import_module(f"sweep.effects.{route}").compute(scene, wanted)
    return found


def inputs_of_loads(family: Family) -> tuple[Parameter, ...]:
    """Return the inputs of the effect that hands back a family's load; none where there is no such effect."""
    register = import_module("sweep.effects")  # it imports the users of this module when they are asked for
    return tuple(p for e in register.serving(family) if e.key == LOADS for p in e.inputs_of(family))


def behind(scene: Scene, key: str, wanted: frozenset[str]) -> Columns | None:
    """Return what the next stage hands back; None at the end of the chain."""
    if scene.driven is None:
        return None
    memo = f"behind {key}"
    if memo not in scene.memo:
        scene.memo[memo] = computed(scene.driven, key, wanted)
    found: Columns = scene.memo[memo]
    return found


def carried(scene: Scene, handed_back: Columns) -> Array:
    """Return the inertia of the later stages reduced to this crank and its derivative, (n, m, 2)."""
    inertia, slope = (np.asarray(handed_back[name], np.float64) for name in INERTIAS)
    first, second = scene.gear
    return np.stack([first * first * inertia, 2.0 * first * second * inertia + first**3 * slope], axis=2)


def on_output(scene: Scene, load: Array, handed_back: Columns | None, name: str) -> Array:
    """Return the load of the output link, and the next stage's driving torque, column ``name``,
    that acts on it besides.
    """
    if handed_back is None:
        return load
    return load - scene.after[0].kappa[:, None] * np.asarray(handed_back[name], np.float64)
