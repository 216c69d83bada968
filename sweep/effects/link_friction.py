"""D2 for mechanisms of any number of links: joint reactions and driving torque with friction."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from kernels.effects import link_friction as kernel
from sweep.effects import link_stops, links
from sweep.effects.base import Effect, Scene, largest, refuse, take_over
from sweep.effects.bearings import together
from sweep.effects.handed import FRICTION, behind
from sweep.families import family
from sweep.families.base import Array, Columns, Output, Parameter
from sweep.families.link_tree import LinkJoint, LinkTree

EQUATION = "docs/links.md (7)-(9)"
FORMULAS = (
    "(7) shaft, guide: at each support mu F along (r omega, s') reversed; balls: couple mu r |R| against their",
    "    turning; contacts: that and a force mu |R| against their sliding",
    "(8) lost torque of a joint: its friction's power over the crank speed; drive_torque_friction = drive_torque at",
    "    the loads with friction, plus all of them",
    "(9) loads of joints: shaft r (F1 + F2) + r_t |F_axial| over r, guide F1 + F2, else |R|; iterated to 1e-14",
)
SUFFIX, TEXT = "_friction", ", friction included"
PASSES = "friction_passes"
SUPPORTED = ("shaft", "sleeve")


def of_joint(joint: LinkJoint) -> tuple[Parameter, ...]:
    """Return inputs of a joint in the order of the kernel's columns: those that it has."""
    j, text = joint.name, joint.text
    bare = 0.0 if joint.kind in ("contact", "sleeve") else None
    found = [
        Parameter(f"mu_{j}", "ratio", f"coefficient of friction: {text}", not_negative=True),
        Parameter(f"radius_{j}", "length", f"friction radius: {text}", default=bare, not_negative=True),
    ]
    if joint.kind == "shaft":
        words = f"mean thrust radius: {text}"
        found.append(Parameter(f"thrust_radius_{j}", "length", words, default=0.0, not_negative=True))
    if joint.kind in SUPPORTED:
        found += [
            Parameter(f"support_{j}{k}", "length", f"{which} support along the axis, from its joint: {text}")
            for k, which in ((1, "first"), (2, "second"))
        ]
    return tuple(found)


def _columns_of(joint: LinkJoint) -> tuple[str, ...]:
    j = joint.name
    return f"mu_{j}", f"radius_{j}", f"thrust_radius_{j}", f"support_{j}1", f"support_{j}2"


def _data(scene: Scene) -> Array:
    """Return columns of the kernel of each joint, (n, Q, 5); 0 for what a kind of joint does not have."""
    zero, tree = np.zeros(len(scene.designs)), links.tree_of(scene)
    rows = [np.column_stack([scene.inputs.get(name, zero) for name in _columns_of(j)]) for j in tree.joints]
    return np.ascontiguousarray(np.stack(rows, axis=1))


def _losses(tree: LinkTree) -> dict[str, tuple[str, str]]:
    found = {
        f"lost_torque_{j.name}": ("torque", f"share of the friction in the driving torque: {j.text}")
        for j in tree.joints
    }
    return found | {PASSES: ("1", "passes of the friction iteration")}


def _supports(tree: LinkTree) -> dict[str, tuple[int, int, str]]:
    """Return loads of supports by name: the number of the joint, that of the support, in words."""
    return {
        f"load_support_{j.name}{k + 1}": (q, k, f"load across the axis of support {k + 1}: {j.text}{TEXT}")
        for q, j in enumerate(tree.joints)
        if j.kind in SUPPORTED
        for k in (0, 1)
    }


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Return the wanted quantities with friction; status JAMMED where the iteration does not settle."""
    tree, status, shape = links.tree_of(scene), scene.status(), scene.shape
    handed_back = behind(scene, FRICTION, frozenset({"drive_torque_friction"}))
    if handed_back is not None:
        take_over(status, handed_back["status"])
    same: NDArray[np.bool_] = np.zeros(len(scene.designs), np.bool_)
    for joint in tree.joints:
        same |= together(scene, joint.name) if joint.kind in SUPPORTED else False
    refuse(status, same)
    named, frame = links.vectors(tree.joints, SUFFIX), tuple(f"{name}{SUFFIX}" for name in links.FRAME)
    of_joints = tuple(name for name in named if name not in frame)
    number, losses, supports = len(tree.joints), tuple(_losses(tree)), _supports(tree)
    forces = np.empty((*shape, number, 6)) if links.asked(of_joints, wanted) else None
    on_frame = np.empty((*shape, 6)) if links.asked(frame, wanted) else None
    torque = np.empty(shape) if "drive_torque_friction" in wanted else None
    lost = np.empty((*shape, number + 1)) if not wanted.isdisjoint(losses) else None
    carried = np.empty((*shape, number, 2)) if not wanted.isdisjoint(supports) else None
    kernel.link_friction(
        scene.links, links.joint_table(tree), links.bodies(scene), links.tool(scene),
        links.drive(scene, handed_back, "drive_torque_friction"), _data(scene), tree.carrier, tree.output, status,
        forces, on_frame, torque, lost, carried,
    )  # fmt: skip
    columns = links.vector_columns(tree, forces, on_frame, wanted, SUFFIX)
    if torque is not None:
        columns["drive_torque_friction"] = torque
    if lost is not None:
        columns |= {name: lost[:, :, k] for k, name in enumerate(losses) if name in wanted}
    if carried is not None:
        columns |= {name: carried[:, :, q, k] for name, (q, k, _) in supports.items() if name in wanted}
    return columns | {"status": status}


@lru_cache
def friction_of(name: str) -> Effect:
    """Return the entry of the friction of a family with a tree of links."""
    bare = links.loads_of(name)
    tree = bare.tree
    assert tree is not None
    scalars = {"drive_torque_friction": ("torque", f"torque that drives the cranks{TEXT}")} | _losses(tree)
    supports = {at: ("force", words) for at, (_, _, words) in _supports(tree).items()}
    found = (
        *links.vector_outputs(links.vectors(tree.joints, SUFFIX, TEXT), EQUATION),
        *(Output(n, u, t, EQUATION, n == PASSES) for n, (u, t) in (scalars | supports).items()),
    )
    return Effect(
        key=FRICTION,
        name=f"{name}_friction",
        title=f"friction of all joints by successive approximations: {family(name).title}",
        equation=EQUATION,
        formulas=FORMULAS,
        needs=(bare.name,),
        inputs=(*bare.inputs, *(p for joint in tree.joints for p in of_joint(joint))),
        outputs=tuple(replace(o, kinks=not o.jumps) for o in found),
        compute=compute,
        called_for="losses, drive sizing, loads of bearings, a check against jamming",
        negligible="a few passes settle it: joint loads change by less than 1 %",
        takes_load=FRICTION,
        requires=LinkTree,
        tree=tree,
        bends=link_stops.bends(tree, tuple(o.name for o in found)),
        advise=partial(
            largest, compute=compute, name=PASSES, quantity="most passes of the friction iteration", threshold=4.0
        ),
    )
