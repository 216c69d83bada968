"""B1, B2 for mechanisms of any number of links: sliding and rolling bearings of every shaft under its reactions."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from kernels.effects.bearings import journal_pressures
from sweep.effects.base import DesignResult, Effect, about
from sweep.effects.bearing_life import BLOCK, BearingShaft, load_outputs, turn_outputs
from sweep.effects.bearing_life import bends as bends_of_shaft
from sweep.effects.bearing_life import per_turn as turn_of_shaft
from sweep.effects.bearings import CATALOGUE, REQUIRED_LIFE, permissible_load
from sweep.effects.link_loads import SUPPORTED, friction_inputs, tree_of
from sweep.effects.load_effects import axis_of, friction_of, loads_of, tree_bends
from sweep.effects.load_passing import compute_friction
from sweep.effects.loads import FRICTION_SUFFIX, FRICTION_TEXT
from sweep.effects.scene import Scene, refuse, take_over
from sweep.families import family
from sweep.families.base import Accuracy, Array, Columns, Output, Parameter, floats
from sweep.families.link_tree import LinkJoint, LinkTree
from sweep.families.poses import filled_all
from sweep.families.sites import AXES


def shafts(tree: LinkTree) -> tuple[LinkJoint, ...]:
    """Joints on two rolling bearings: those that turn about an axis and do not slide along it."""
    return tuple(j for j in tree.joints if j.kind == "shaft")


def journals(tree: LinkTree) -> tuple[LinkJoint, ...]:
    """Joints on two journals: shafts, and guides, which have no collar."""
    return tuple(j for j in tree.joints if j.kind in SUPPORTED)


def _sliding_inputs(joint: LinkJoint) -> tuple[Parameter, ...]:
    """Dimensions of the journals, and of a shaft's collar, in the order of the kernel's columns."""
    j, words = joint.name, joint.text
    found = [Parameter(f"journal_diameter_{j}", "length", f"diameter of both journals: {words}", positive=True)]
    found += [Parameter(f"journal_length_{j}{k}", "length", f"length of journal {k}: {words}", positive=True)
              for k in "12"]  # fmt: skip
    if joint.kind == "shaft":
        text = f"outer diameter of the thrust collar: {words}"
        found.append(Parameter(f"collar_diameter_{j}", "length", text, positive=True))
    return tuple(found)


def _pressure_limits(joint: LinkJoint) -> tuple[Parameter, ...]:
    parts = ("journal 1", "journal 2", "the collar")[: 3 if joint.kind == "shaft" else 2]
    return tuple(
        Parameter(f"permissible_pressure_{joint.name}{k + 1}", "pressure",
                  f"permissible mean pressure of {part}: {joint.text}", positive=True)
        for k, part in enumerate(parts)
    )  # fmt: skip


def _sliding_outputs(joint: LinkJoint) -> tuple[Output, ...]:
    """Pressures and utilisation, in the order of the kernel's results."""
    j, words = joint.name, f"{joint.text}{FRICTION_TEXT}"
    found = [Output(f"journal_pressure_{j}{k}", "pressure", f"mean pressure of journal {k}: {words}")
             for k in "12"]  # fmt: skip
    if joint.kind == "shaft":
        found.append(Output(f"collar_pressure_{j}", "pressure", f"mean pressure of the collar: {words}"))
    text = f"largest mean pressure over its permissible value: {words}"
    return (*found, Output(f"sliding_utilisation_{j}", "1", text))


def _columns(scene: Scene, inputs: tuple[Parameter, ...], size: int) -> Array:
    """Stack inputs side by side, (n, size); the remaining columns are zero."""
    table = np.zeros((len(scene.designs), size))
    for k, p in enumerate(inputs):
        table[:, k] = scene.inputs[p.name]
    return table


def sliding(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Compute the wanted pressures and utilisations under the loads with friction."""
    asked = [j for j in journals(tree_of(scene)) if not wanted.isdisjoint(o.name for o in _sliding_outputs(j))]
    supports = {j.name: [f"load_support_{j.name}{k}" for k in "12"] for j in asked}
    axial = {j.name: [f"force_{j.name}{FRICTION_SUFFIX}_{x}" for x in AXES] for j in asked if j.kind == "shaft"}
    names = frozenset(name for found in (supports, axial) for part in found.values() for name in part)
    loads = compute_friction(scene, names)
    columns: Columns = {}
    status = np.array(loads["status"], np.uint8)
    for joint in asked:
        outputs = tuple(o.name for o in _sliding_outputs(joint))
        first, second = (np.ascontiguousarray(loads[name], np.float64) for name in supports[joint.name])
        along = np.zeros(scene.shape)
        if joint.kind == "shaft":
            force = np.stack(floats(loads, *axial[joint.name]), axis=2)
            along = (force * axis_of(scene, joint)).sum(axis=2)
            refuse(
                status, scene.inputs[f"collar_diameter_{joint.name}"] <= scene.inputs[f"journal_diameter_{joint.name}"]
            )
        limits = _columns(scene, _pressure_limits(joint) if outputs[-1] in wanted else (), 3)
        size = _columns(scene, _sliding_inputs(joint), 4)
        shaft = joint.kind == "shaft"
        named = outputs if shaft else (*outputs[:2], f"collar_pressure_{joint.name}", outputs[-1])
        columns |= filled_all(
            journal_pressures, (first, second, along, size, limits), named, wanted & frozenset(outputs), status
        )  # fmt: skip
    return columns | {"status": status}


def _rolling_inputs(joint: LinkJoint) -> tuple[Parameter, ...]:
    """Places of the supports, data of the catalogue, and the required life."""
    supports = [p for p in friction_inputs(joint) if p.name.startswith("support_")]
    of_bearings = (*CATALOGUE, REQUIRED_LIFE)
    named = [replace(p, name=f"{p.name}_{joint.name}", text=f"{p.text}: {joint.text}") for p in of_bearings]
    return (*supports, *named)


def _rolling_outputs(joint: LinkJoint) -> tuple[Output, ...]:
    text = f"larger equivalent load over the permissible one: {joint.text}"
    return (
        *load_outputs(joint.name, joint.text),
        Output(f"rolling_utilisation_{joint.name}", "1", text, kinks=True),
    )


def _turning(scene: Scene, joint: LinkJoint) -> Array:
    """Angular velocity of a shaft in its bearings per unit crank speed, (n, m)."""
    bodies, parent = scene.links.bodies, scene.links.parents[joint.body]
    turn = bodies[:, :, joint.body, 9:12]
    if parent >= 0:
        turn = turn - bodies[:, :, parent, 9:12]
    rate: Array = (turn * axis_of(scene, joint)).sum(axis=2)
    return rate


def _shaft(tree: LinkTree, joint: LinkJoint) -> BearingShaft:
    at = 6 * tree.joints.index(joint)
    return BearingShaft(
        joint.name, f"_{joint.name}", (at, at + 3), partial(axis_of, joint=joint), partial(_turning, joint=joint)
    )


def rolling(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Compute the wanted bearing loads, and their ratio to the permissible load."""
    columns: Columns = {}
    status = scene.status()
    tree = tree_of(scene)
    for joint in shafts(tree):
        names = tuple(o.name for o in _rolling_outputs(joint))
        used = names[-1]
        own = wanted & frozenset(names)
        if not own:
            continue
        pair = frozenset(names[3:5]) if used in own else frozenset[str]()
        found = _shaft(tree, joint).loads(scene, own - {used} | pair)
        take_over(status, found.pop("status"))
        if used in own:
            larger = np.maximum(*floats(found, *names[3:5]))
            found[used] = larger / permissible_load(scene, f"_{joint.name}")
        columns |= {name: found[name] for name in own}
    return columns | {"status": status}


def rolling_turn(scene: Scene, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute mean loads and lives of the wanted shafts; see :mod:`sweep.effects.bearing_life`."""
    columns: Columns = {}
    status = np.zeros(len(scene.designs), np.uint8)
    tree = tree_of(scene)
    for joint in shafts(tree):
        own = wanted & frozenset(o.name for o in turn_outputs(joint.name, ""))
        if own:
            found = turn_of_shaft(scene, own, accuracy, _shaft(tree, joint))
            take_over(status, found.pop("status"))
            columns |= found
    return columns | {"status": status}


def sliding_of(name: str) -> Effect:
    """Make the entry of the sliding bearings of a family with a tree of links."""
    rubbing, tree = friction_of(name), family(name).the(LinkTree)
    found = {j: (_sliding_inputs(j), _pressure_limits(j), _sliding_outputs(j)) for j in journals(tree)}
    only = {p.name: tuple(o.name for o in out) for own, _, out in found.values() for p in own}
    only |= {p.name: (out[-1].name,) for _, limits, out in found.values() for p in limits}
    own = tuple(p for sizes, limits, _ in found.values() for p in (*sizes, *limits))
    return replace(
        rubbing,
        **about("sliding_bearings", name),
        needs=(rubbing.name,),
        inputs=(*rubbing.inputs, *own),
        only_for=only,
        outputs=tuple(replace(o, kinks=True) for _, _, out in found.values() for o in out),
        compute=sliding,
        advise=None,
        bends=tree_bends(tree, tuple(o.name for _, _, out in found.values() for o in out)),
    )


def rolling_of(name: str) -> Effect:
    """Make the entry of the rolling bearings of a family with a tree of links."""
    bare, tree = loads_of(name), family(name).the(LinkTree)
    found = {j: (_rolling_inputs(j), _rolling_outputs(j), turn_outputs(j.name, j.text)) for j in shafts(tree)}
    only = {p.name: tuple(o.name for o in (*out, *turn)) for (*own, _), out, turn in found.values() for p in own}
    only |= {life.name: (out[-1].name,) for (*_, life), out, _ in found.values()}
    return replace(
        bare,
        **about("rolling_bearings", name),
        needs=(bare.name,),
        inputs=(*bare.inputs, *(p for own, _, _ in found.values() for p in own)),
        only_for=only,
        outputs=tuple(o for _, out, _ in found.values() for o in out),
        compute=rolling,
        even_crank=True,
        advise=None,
        bends=tuple(b for j, (_, out, _) in found.items() for b in bends_of_shaft(_shaft(tree, j), out[-1].name)),
        design_result=DesignResult(tuple(o for _, _, turn in found.values() for o in turn), rolling_turn, BLOCK),
    )
