"""D1, D3 for mechanisms of any number of links, and a tool at their working point."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from kernels.effects import link_loads as kernel
from sweep.effects import loads
from sweep.effects.base import Advice, Effect, Index, Scene, take_over
from sweep.effects.handed import INERTIAS, LOADS, behind, carried, on_output
from sweep.families import family
from sweep.families.base import Array, Columns, Output, Parameter
from sweep.families.link_tree import LinkJoint, LinkTree

EQUATION = "docs/links.md (1)-(6)"
FORMULAS = (
    "(1) a body needs F = m (a_G - gravity), T = J eps + omega x J omega; (2) a tool m (a_P - gravity) - F_tool at P",
    "(3) what hangs on a joint is summed towards the frame; the force x_k of a line that closes a loop enters linearly",
    "(4) a freedom that nothing drives bears nothing: axis . (M - P x F) = 0 of a turn, axis . F = 0 of a slide",
    "(5) drive_torque = sum of axis . M over the cranks;  (6) J = sum of m v_G^2 + omega . J omega at unit crank speed",
)
KINDS = {
    "shaft": kernel.SHAFT,
    "hinge": kernel.HINGED_BALL,
    "sleeve": kernel.GUIDE,
    "ball": kernel.BALL,
    "contact": kernel.CONTACT,
}
AXES = "xyz"
FRAME = {
    "shaking_force": ("force", "force on the frame"),
    "shaking_moment": ("torque", "moment on the frame about the origin of the family's frame, drive torque included"),
}
SCALARS = {
    "drive_torque": ("torque", "torque that drives the cranks, about their axes"),
    "reduced_inertia": ("inertia", "inertia of all links and the tool, of later stages too, reduced to the crank"),
    "dreduced_inertia": ("inertia", "derivative of the reduced inertia by the crank angle"),
}
TOOL_TORQUE = "tool_torque"


def tree_of(scene: Scene) -> LinkTree:
    """Return the tree of a scene's family."""
    tree = scene.family.find(LinkTree)
    assert tree is not None
    return tree


@lru_cache
def body_inputs(tree: LinkTree) -> tuple[Parameter, ...]:
    """Return masses, centres and inertias of all bodies."""
    return tuple(
        p for body in tree.bodies for p in (loads.rod_inputs if body.slender else _whole)(body.name, body.axes)
    )


def _whole(name: str, axes: str) -> tuple[Parameter, ...]:
    return loads.body_inputs(name, axes, 0.0)


def inputs(tree: LinkTree) -> tuple[Parameter, ...]:
    """Return all inputs of the loads of a tree."""
    load = (loads.LINK_TORQUE,) if tree.output >= 0 else ()
    tip = loads.TIP if tree.tip is None else ()
    return (*body_inputs(tree), *loads.GRAVITY, *loads.FREE_TOOL, *tip, *load, loads.SPEED, loads.CHANGE)


def vectors(joints: tuple[LinkJoint, ...], suffix: str = "", text: str = "") -> dict[str, tuple[str, str]]:
    """Return names of the vectors that are given, with unit and meaning: forces and moments of joints, of the frame."""
    found = {}
    for joint in joints:
        found[f"force_{joint.name}{suffix}"] = ("force", f"{joint.text}: force of the {joint.acts}{text}")
        if joint.kind in ("shaft", "sleeve"):
            found[f"moment_{joint.name}{suffix}"] = (
                "torque", f"{joint.text}: moment of the {joint.acts}{text}",
            )  # fmt: skip
    return found | {f"{name}{suffix}": (unit, f"{words}{text}") for name, (unit, words) in FRAME.items()}


def vector_outputs(named: dict[str, tuple[str, str]], equation: str = EQUATION) -> tuple[Output, ...]:
    """Return the magnitude and components of vectors."""
    return tuple(
        o
        for name, (unit, text) in named.items()
        for o in (
            Output(name, unit, f"magnitude: {text}", equation),
            *(Output(f"{name}_{axis}", unit, f"{axis}: {text}", equation) for axis in AXES),
        )
    )


def _tool_vector() -> dict[str, tuple[str, str]]:
    return {"tool_load": ("force", "force of its link on the tool")}


def vector_columns(
    tree: LinkTree, forces: Array | None, on_frame: Array | None, wanted: frozenset[str], suffix: str = ""
) -> Columns:
    """Return the wanted magnitudes and components of joint reactions (n, m, Q,
    6) and of what the frame bears (n, m, 6).
    """
    found = {}
    if forces is not None:
        for k, joint in enumerate(tree.joints):
            found[f"force_{joint.name}{suffix}"] = forces[:, :, k, :3]
            found[f"moment_{joint.name}{suffix}"] = forces[:, :, k, 3:]
    if on_frame is not None:
        found |= {f"shaking_force{suffix}": on_frame[:, :, :3], f"shaking_moment{suffix}": on_frame[:, :, 3:]}
    return _columns(found, wanted)


def _columns(found: dict[str, Array], wanted: frozenset[str]) -> Columns:
    columns: Columns = {}
    for name, values in found.items():
        if name in wanted:
            columns[name] = np.sqrt((values * values).sum(axis=2))
        columns |= {f"{name}_{a}": values[:, :, k] for k, a in enumerate(AXES) if f"{name}_{a}" in wanted}
    return columns


def asked(names: dict[str, tuple[str, str]] | tuple[str, ...], wanted: frozenset[str]) -> bool:
    """Return whether a vector, or a component of one, is wanted."""
    return any(f"{name}{tail}" in wanted for name in names for tail in ("", "_x", "_y", "_z"))


def bodies(scene: Scene) -> Array:
    """Return masses, centres, inertias and gravity in the order of the kernel, (n, 10 B + 3)."""
    tree, given = tree_of(scene), scene.inputs
    columns: list[Array] = []
    zero = np.zeros(len(scene.designs))
    for body in tree.bodies:
        if body.slender:
            across = given[f"j_{body.name}"]
            columns += [given[f"m_{body.name}"], given[f"com_{body.name}_x"], *[zero] * 5, across, zero, across]
        else:
            columns += [given[p.name] for p in _whole(body.name, body.axes)]
    return np.column_stack([*columns, *(given[p.name] for p in loads.GRAVITY)])


def tool(scene: Scene) -> Array:
    """Return the mass of the tool and its place in the axes of the body that carries it, (n, 4)."""
    tree = tree_of(scene)
    tip = scene.table(tuple(p.name for p in loads.TIP)) if tree.tip is None else tree.tip(scene.designs)
    return np.column_stack([scene.inputs["m_tool"], tip])


def drive(scene: Scene, handed_back: Columns | None, name: str = "drive_torque") -> Array:
    """Return the crank speed and its rate, load of the output link, force on the tool, (n, m or 1, 6)."""
    tree, (speed, change) = tree_of(scene), scene.crank()
    load = scene.load(loads.LINK_TORQUE.name) if tree.output >= 0 else np.zeros_like(speed)
    load = on_output(scene, load, handed_back, name)
    force = [scene.load(p.name) for p in loads.FREE_TOOL[1:]]
    return np.stack(np.broadcast_arrays(speed, change, load, *force), axis=2)


@lru_cache
def joint_table(tree: LinkTree) -> Index:
    """Return the joints as the kernels take them, (Q, PER_JOINT)."""
    rows = [(KINDS[j.kind], j.body, j.freedom, *j.lines, rod(tree, j)) for j in tree.joints]
    return np.array(rows, np.int64)


def rod(tree: LinkTree, joint: LinkJoint) -> int:
    """Return the slender body among those of a joint; -1 where there is none."""
    ends = (joint.body,) if joint.lines[1] == 0 else tree.ends[joint.lines[0]]
    return next((k for k in ends if k >= 0 and tree.bodies[k].slender), -1)


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Return the wanted reactions, driving torque and inertias; what is not wanted is not compiled."""
    tree, status = tree_of(scene), scene.status()
    handed_back = behind(scene, LOADS, frozenset({"drive_torque", *INERTIAS}))
    shape = scene.shape
    joints = {name: words for name, words in vectors(tree.joints).items() if name not in FRAME}
    forces = np.empty((*shape, len(tree.joints), 6)) if asked(joints, wanted) else None
    on_frame = np.empty((*shape, 6)) if asked(FRAME, wanted) else None
    torque = np.empty(shape) if "drive_torque" in wanted else None
    inertia = np.empty((*shape, 2)) if not wanted.isdisjoint(INERTIAS) else None
    of_tool = asked(_tool_vector(), wanted) or TOOL_TORQUE in wanted
    on_tool = np.empty((*shape, 4)) if of_tool else None
    kernel.link_loads(
        scene.links, joint_table(tree), bodies(scene), tool(scene), drive(scene, handed_back), tree.carrier,
        tree.output, status, forces, on_frame, torque, inertia, on_tool,
    )  # fmt: skip
    if handed_back is not None:
        take_over(status, handed_back["status"])
        if inertia is not None:
            inertia += carried(scene, handed_back)
    if forces is not None:
        scene.memo["reactions"] = forces.reshape(*shape, 6 * len(tree.joints)), status
    columns = vector_columns(tree, forces, on_frame, wanted)
    if on_tool is not None:
        columns |= _columns({"tool_load": on_tool[:, :, :3]}, wanted)
        columns |= {TOOL_TORQUE: on_tool[:, :, 3]} if TOOL_TORQUE in wanted else {}
    if torque is not None:
        columns["drive_torque"] = torque
    if inertia is not None:
        columns |= {name: inertia[:, :, k] for k, name in enumerate(INERTIAS) if name in wanted}
    return columns | {"status": status}


def advise(scene: Scene) -> Advice | None:
    """Return the share of the driving torque's range that inertia and weight make."""
    names = frozenset({"drive_torque"})
    whole = compute(scene, names)
    still = {name: np.zeros_like(x) if name.startswith(("m_", "j_")) else x for name, x in scene.inputs.items()}
    alone = Scene(scene.family, scene.designs, scene.angles, still, scene.after, scene.before, scene.curves)
    turning = (np.asarray(whole["status"]) == 0).all(axis=1)
    if not turning.any():
        return None
    most, useful = (np.ptp(np.asarray(c["drive_torque"])[turning], axis=1) for c in (whole, compute(alone, names)))
    share = np.abs(most - useful) / np.where(most > 0.0, most, 1.0)
    return Advice("share of the driving torque's range that is not due to loads", share, 0.1)


@lru_cache
def loads_of(name: str) -> Effect:
    """Return the entry of the loads of a family with a tree of links."""
    found = family(name)
    tree = found.find(LinkTree)
    assert tree is not None
    named = vectors(tree.joints) | _tool_vector()
    scalars = SCALARS | {TOOL_TORQUE: ("torque", "share of the tool in the torque about this stage's crank")}
    return Effect(
        key=LOADS,
        name=f"{name}_loads",
        title=f"joint reactions, driving torque, reduced inertia, tool: {found.title}",
        equation=EQUATION,
        formulas=FORMULAS,
        needs=(),
        inputs=inputs(tree),
        outputs=(*vector_outputs(named), *(Output(n, u, t, EQUATION) for n, (u, t) in scalars.items())),
        compute=compute,
        called_for="joint loads, drive torque, shaking force, a tool at the working point",
        negligible="inertia and weight make less than 10 % of the driving torque's range",
        takes_load=LOADS,
        requires=LinkTree,
        tree=tree,
        advise=advise,
    )
