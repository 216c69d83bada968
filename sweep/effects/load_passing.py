"""Loads of a stage of a chain, and the torque and inertia that a later stage returns to the stage driving it.

Families with joint records have their loads in closed form, families with a tree of links by virtual power.  The tree
would do for all: for crank-rockers, slider-cranks and guides at 360 angles both agree to 2e-15.  But with the poses of
its bodies it takes 3.1 times the closed form without friction (0.40 us per pose) and 4.6 times with it (1.36 us).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from kernels.types import Status
from sweep.effects import kinetostatics, link_loads, loads
from sweep.effects.base import tool_place
from sweep.effects.scene import Scene, take_over
from sweep.families.base import Array, Columns, Family, Parameter, floats
from sweep.families.capabilities import JointRecords
from sweep.families.link_tree import LinkTree

LOADS, FRICTION = "D1, D3", "D2"  # keys of the effects that return a load to the driving stage
INERTIAS = ("reduced_inertia", "dreduced_inertia")
_TORQUE = {LOADS: "drive_torque", FRICTION: "drive_torque_friction"}
_SHAKING_FORCE = frozenset(f"shaking_force{tail}" for tail in ("", "_x", "_y", "_z"))
_HANDED_BACK = {LOADS: frozenset({_TORQUE[LOADS], *INERTIAS}), FRICTION: frozenset({_TORQUE[FRICTION]})}

Reactions: TypeAlias = Callable[[Scene, Array, frozenset[str], Status], Columns]
"""``(scene, load, wanted, status)``: wanted columns under a load on the output; ``status`` is updated."""


class LoadPath(NamedTuple):
    """Computation of loads for families with a capability.

    ``inputs(family)`` lists the inputs of its loads, ``load(scene)`` names the useful load on its output, if any, and
    ``force(scene)`` an output whose computation stores all reactions in the scene.
    """

    frictionless: Reactions
    with_friction: Reactions
    inputs: Callable[[Family], tuple[Parameter, ...]]
    load: Callable[[Scene], str | None]
    force: Callable[[Scene], str]


def _inputs_by_records(family: Family) -> tuple[Parameter, ...]:
    place = tool_place(family)
    return (*loads.follower_of(family).parameters, *(() if place is None else loads.TOOLS[place]))


def _inputs_by_links(family: Family) -> tuple[Parameter, ...]:
    return link_loads.inputs(family.the(LinkTree))


_ROUTES = {
    LinkTree: LoadPath(link_loads.frictionless, link_loads.with_friction, _inputs_by_links, link_loads.load_name,
                    link_loads.force_name),
    JointRecords: LoadPath(kinetostatics.frictionless, kinetostatics.with_friction, _inputs_by_records,
                        kinetostatics.load_name, kinetostatics.force_name),
}  # fmt: skip


def route(family: Family) -> LoadPath | None:
    """Return how a family's loads are computed; None if it has neither joint records nor a tree of links."""
    return next((found for capability, found in _ROUTES.items() if family.find(capability) is not None), None)


def inputs_of_loads(family: Family) -> tuple[Parameter, ...]:
    """List the inputs of the effect that returns the load to the driving stage; empty without such an effect."""
    found = route(family)
    return () if found is None else found.inputs(family)


def compute_loads(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Compute the wanted reactions, driving torque and inertias of one stage, including later stages."""
    found, status = _route_of(scene), scene.status()
    # The torque of the next stage does not change the force on the frame.
    handed_back = None if wanted <= _SHAKING_FORCE else behind(scene, LOADS)
    columns = found.frictionless(scene, _on_output(scene, found, handed_back, LOADS), wanted, status)
    if handed_back is not None:
        take_over(status, handed_back["status"])
        if not wanted.isdisjoint(INERTIAS):
            more = _carried(scene, handed_back)
            columns |= {name: np.asarray(columns[name], np.float64) + more[name] for name in INERTIAS if name in wanted}
    return columns | {"status": status}


def compute_friction(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Compute the wanted reactions, driving torque and losses of one stage with friction."""
    found, status, handed_back = _route_of(scene), scene.status(), behind(scene, FRICTION)
    if handed_back is not None:
        take_over(status, handed_back["status"])
    columns = found.with_friction(scene, _on_output(scene, found, handed_back, FRICTION), wanted, status)
    return columns | {"status": status}


def computed(scene: Scene, key: str, wanted: frozenset[str]) -> Columns:
    """Compute outputs of the effect with a key for one stage."""
    return (compute_loads if key == LOADS else compute_friction)(scene, wanted)


def behind(scene: Scene, key: str) -> Columns | None:
    """Compute torque, inertia and status that the next stage returns to this one; None at the end of the chain."""
    if scene.driven is None:
        return None
    memo = f"behind {key}"
    if memo not in scene.memo:
        scene.memo[memo] = computed(scene.driven, key, _HANDED_BACK[key])
    found: Columns = scene.memo[memo]
    return found


def reactions(scene: Scene) -> tuple[Array, Status]:
    """Return all reactions side by side as the family's kernel gives them, (n, m, F), and the status.

    They are computed once for all bearings of a scene.
    """
    if "reactions" not in scene.memo:
        compute_loads(scene, frozenset({_route_of(scene).force(scene)}))
    found: tuple[Array, Status] = scene.memo["reactions"]
    return found


def _route_of(scene: Scene) -> LoadPath:
    found = route(scene.family)
    if found is None:
        raise TypeError(f"{scene.family.name} has neither joint records nor a tree of links")
    return found


def _carried(scene: Scene, handed_back: Columns) -> dict[str, Array]:
    """Inertia of the later stages reduced to this crank, and its derivative."""
    inertia, slope = floats(handed_back, *INERTIAS)
    first, second = scene.gear
    both = first * first * inertia, 2.0 * first * second * inertia + first**3 * slope
    return dict(zip(INERTIAS, both, strict=True))


def _on_output(scene: Scene, found: LoadPath, handed_back: Columns | None, key: str) -> Array:
    """Load of the output link, less the driving torque of the next stage."""
    name = found.load(scene)
    load = np.zeros((len(scene.designs), 1)) if name is None else scene.load(name)
    if handed_back is None:
        return load
    return load - scene.after[0].kappa[:, None] * np.asarray(handed_back[_TORQUE[key]], np.float64)
