"""D1-D3 of any number of links: reactions, driving torque, friction and a tool, from a :class:`LinkTree`."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from kernels.effects import link_friction, link_loads
from kernels.linkage.bodies import SLIDE
from kernels.types import Status
from sweep.effects import loads
from sweep.effects.loads import FRICTION_SUFFIX, FRICTION_TEXT, Named, together
from sweep.effects.scene import Scene, refuse
from sweep.families.base import Array, Columns, Parameter
from sweep.families.link_tree import LinkJoint, LinkTree
from sweep.numerics.records import Indices, Mask

KINDS = {
    "shaft": link_loads.SHAFT,
    "hinge": link_loads.HINGED_BALL,
    "sleeve": link_loads.GUIDE,
    "ball": link_loads.BALL,
    "contact": link_loads.CONTACT,
}
INERTIAS = {
    "reduced_inertia": ("inertia", "inertia of all links and the tool, of later stages too, reduced to the crank"),
    "dreduced_inertia": ("inertia", "derivative of the reduced inertia by the crank angle"),
}
TOOL_VECTOR = {"tool_load": ("force", "force of its link on the tool")}
TOOL_TORQUE = "tool_torque"
SCALARS = {
    "drive_torque": ("torque", "torque that drives the cranks, about their axes"),
    **INERTIAS,
    TOOL_TORQUE: ("torque", "share of the tool in the torque about this stage's crank"),
}
TORQUE_WITH_FRICTION = f"drive_torque{FRICTION_SUFFIX}"
SUPPORTED = ("shaft", "sleeve")


def tree_of(scene: Scene) -> LinkTree:
    """Tree of links of a scene's family."""
    return scene.family.the(LinkTree)


@lru_cache
def body_inputs(tree: LinkTree) -> tuple[Parameter, ...]:
    """Masses, centres and inertias of all bodies."""
    rods, found = rods_of(tree), []
    for k, body in enumerate(tree.bodies):
        own = (loads.rod_inputs if body.slender else _whole)(body.name, body.axes)
        found += [*own, *loads.as_rod(body.name, own)] if k in rods else [loads.as_point(own[0]), *own[1:]]
    return tuple(found)


@lru_cache
def _whole(name: str, axes: str) -> tuple[Parameter, ...]:
    return loads.body_inputs(name, axes, 0.0)


@lru_cache
def rods_of(tree: LinkTree) -> dict[int, tuple[int, int]]:
    """Bodies that may be slender rods, by number, with the body or line at their far end, (body, line).

    The far end is the joint of a body that hangs on the rod, (body, -1), or the line of a ball that closes a loop, (-1,
    line).  A body that slides on another, or touches it, is no end of a rod; a body with nothing else reaches to the
    point of its arm, or, (-1, -1), to the place of the tool that it carries.
    """
    found: dict[int, tuple[int, int]] = {}
    sliding = {joint.body for joint in tree.joints if joint.kind == "sleeve"}
    for joint in tree.joints:
        line, body = joint.lines[0], joint.body
        hung = (tree.bodies[body].parent,) if joint.kind != "contact" else ()
        ends = tree.ends[line] if joint.kind == "ball" else hung
        for k in ends:
            if k >= 0 and k not in sliding and body not in sliding:
                found.setdefault(k, (-1, line) if joint.kind == "ball" else (body, -1))
    tips = ((tree.carrier, -1),) if tree.tip is not None and tree.carrier not in sliding else ()
    return {body: (-1, line) for body, line in (*tips, *tree.arms)} | found


def inputs(tree: LinkTree) -> tuple[Parameter, ...]:
    """All inputs of the loads of a tree."""
    load, tip = useful(tree), loads.TIP if tree.tip is None else ()
    own = tuple(p for p in (load, tree.unit) if p is not None)
    return (*body_inputs(tree), *loads.GRAVITY, *loads.FREE_TOOL, *tip, *own, loads.SPEED, loads.CHANGE)


def useful(tree: LinkTree) -> Parameter | None:
    """Return the useful load: torque on an output link that turns, force on one that slides; None without one."""
    if tree.output < 0:
        return None
    return loads.LINK_FORCE if tree.freedoms[tree.output][1] == SLIDE else loads.LINK_TORQUE


def friction_inputs(joint: LinkJoint) -> tuple[Parameter, ...]:
    """List the friction inputs that a joint has, in the order of the kernel's columns."""
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


def vectors(tree: LinkTree, suffix: str = "", text: str = "") -> Named:
    """Vector outputs: forces and moments of the joints, and force and moment on the frame."""
    found = {}
    for joint in tree.joints:
        found[f"force_{joint.name}{suffix}"] = ("force", f"{joint.text}: force of the {joint.acts}{text}")
        if joint.kind in SUPPORTED:
            found[f"moment_{joint.name}{suffix}"] = (
                "torque", f"{joint.text}: moment of the {joint.acts}{text}",
            )  # fmt: skip
    return found | loads.frame(suffix, text)


def losses(tree: LinkTree) -> Named:
    """Shares of the joints' friction in the driving torque, and the passes of the iteration."""
    found = {
        f"lost_torque_{j.name}": ("torque", f"share of the friction in the driving torque: {j.text}")
        for j in tree.joints
    }
    return found | loads.PASSES


def support_loads(tree: LinkTree) -> dict[str, tuple[int, int, str]]:
    """Map the names of support loads to joint number, support number and text."""
    return {
        f"load_support_{j.name}{k + 1}": (q, k, f"load across the axis of support {k + 1}: {j.text}{FRICTION_TEXT}")
        for q, j in enumerate(tree.joints)
        if j.kind in SUPPORTED
        for k in (0, 1)
    }


@lru_cache
def joint_table(tree: LinkTree) -> Indices:
    """Table of joints for the kernels, (Q, PER_JOINT)."""
    rows = [(KINDS[j.kind], j.body, tree.freedom(j), *j.lines, rod(tree, j)) for j in tree.joints]
    return np.array(rows, np.int64)


def rod(tree: LinkTree, joint: LinkJoint) -> int:
    """Return the number of the slender body among those of a joint; -1 if there is none."""
    ends = (joint.body,) if joint.lines[1] == 0 else tree.ends[joint.lines[0]]
    return next((k for k in ends if k >= 0 and tree.bodies[k].slender), -1)


def load_name(scene: Scene) -> str | None:
    """Name of the useful load on the output link; None without such a link."""
    load = useful(tree_of(scene))
    return None if load is None else load.name


def force_name(scene: Scene) -> str:
    """Name of a force whose computation stores all reactions in the scene."""
    return f"force_{tree_of(scene).joints[0].name}"


def _bodies(scene: Scene) -> Array:
    """Masses, centres, inertias and gravity in the order of the kernel, (n, 10 B + 3)."""
    tree, given = tree_of(scene), scene.inputs
    zero, rods, found = np.zeros(len(scene.designs)), rods_of(tree), []
    for k, body in enumerate(tree.bodies):
        columns = [given[p.name] for p in (loads.rod_inputs if body.slender else _whole)(body.name, body.axes)]
        if body.slender:
            columns = [*columns[:2], *[zero] * 5, columns[2], zero, columns[2]]
        own = np.column_stack(columns)
        if k in rods and given[f"rod_{body.name}"].any():
            is_rod, line_mass, gyration = (given[f"{name}_{body.name}"] for name in loads.ROD)
            loads.put_rod(own, is_rod, line_mass, gyration, *_rod_ends(scene, k, *rods[k]))
        found.append(own)
    return np.hstack([*found, *(given[p.name][:, None] for p in loads.GRAVITY)])


def _rod_ends(scene: Scene, k: int, child: int, line: int) -> tuple[Array, Array]:
    """Both ends of a rod in the axes of its body, each (n, 3); ``child`` and ``line`` as in :func:`rods_of`."""
    links = scene.still_links  # joints stand still in a body
    record = links.bodies[:, 0, k]

    def seen(point: Array) -> Array:
        return np.asarray(np.einsum("nij,nj->ni", record[:, 15:24].reshape(-1, 3, 3), point - record[:, :3]))

    start = seen(record[:, 24:27])
    if child >= 0:
        return start, seen(links.bodies[:, 0, child, 24:27])
    return start, seen(links.lines[:, 0, line, :3]) if line >= 0 else _tool(scene)[:, 1:]


def _tool(scene: Scene) -> Array:
    """Mass of the tool and its place in the axes of the body that carries it, (n, 4)."""
    tree = tree_of(scene)
    # the output link turns about an axis along z, so the height of its origin is that of every pose
    of_design = scene.still_links.bodies[:, 0, tree.carrier, 2]
    tip = loads.tip_from(scene, of_design) if tree.tip is None else tree.tip(scene.designs)
    return np.column_stack([scene.inputs["m_tool"], tip])


def _loading(scene: Scene, load: Array) -> link_loads.TreeLoading:
    """Bodies, tool and drive in the order of the kernels."""
    tree, force = tree_of(scene), [scene.load(p.name) for p in loads.FREE_TOOL[1:]]
    drive = np.stack(np.broadcast_arrays(*scene.crank(), load, *force), axis=2)
    return link_loads.TreeLoading(_bodies(scene), _tool(scene), drive, tree.carrier, tree.output)


def _vector_columns(tree: LinkTree, forces: Array | None, wanted: frozenset[str], suffix: str = "") -> Columns:
    """Extract the wanted magnitudes and components of joint reactions (n, m, Q, 6)."""
    if forces is None:
        return {}
    found = {}
    for k, joint in enumerate(tree.joints):
        found[f"force_{joint.name}{suffix}"] = forces[:, :, k, :3]
        found[f"moment_{joint.name}{suffix}"] = forces[:, :, k, 3:]
    return loads.vector_columns(found, wanted)


def _reactions(scene: Scene, wanted: frozenset[str], suffix: str = "") -> Array | None:
    """Allocate the reactions of the joints; None if none of them is wanted."""
    tree, frame = tree_of(scene), loads.frame(suffix)
    joints = tuple(name for name in vectors(tree, suffix) if name not in frame)
    return np.empty((*scene.shape, len(tree.joints), 6)) if loads.asked(joints, wanted) else None


def _fill(scene: Scene, load: Array, status: Status, *out: Array | None) -> None:
    """Run the kernel, which writes the results that are not None, (n, ...) each, in blocks of designs."""
    tree, given = tree_of(scene), _loading(scene, load)
    for rows, links in scene.links_by_parts():
        some = given._replace(bodies=given.bodies[rows], tool=given.tool[rows], drive=given.drive[rows])
        part = (x if x is None else x[rows] for x in out)
        link_loads.link_loads(links, joint_table(tree), some, status[rows], *part)


def frictionless(scene: Scene, load: Array, wanted: frozenset[str], status: Status) -> Columns:
    """Compute the wanted reactions, driving torque and inertias; other results are not compiled."""
    tree, shape = tree_of(scene), scene.shape
    forces, on_frame = _reactions(scene, wanted), loads.frame_room(scene.shape, wanted)
    torque = np.empty(shape) if "drive_torque" in wanted else None
    inertia = np.empty((*shape, 2)) if not wanted.isdisjoint(INERTIAS) else None
    of_tool = loads.asked(TOOL_VECTOR, wanted) or TOOL_TORQUE in wanted
    on_tool = np.empty((*shape, 4)) if of_tool else None
    _fill(scene, load, status, forces, *on_frame, torque, inertia, on_tool)
    if forces is not None:
        scene.memo["reactions"] = forces.reshape(*shape, 6 * len(tree.joints)), status
    columns = _vector_columns(tree, forces, wanted) | loads.frame_columns(on_frame, wanted)
    if on_tool is not None:
        columns |= loads.vector_columns({"tool_load": on_tool[:, :, :3]}, wanted)
        columns |= {TOOL_TORQUE: on_tool[:, :, 3]} if TOOL_TORQUE in wanted else {}
    if torque is not None:
        columns["drive_torque"] = torque
    return columns | loads.scalar_columns(INERTIAS, inertia, wanted)


def _friction_data(scene: Scene) -> Array:
    """Columns of the friction kernel of each joint, (n, Q, 5); 0 for inputs that a joint does not have."""
    zero, rows = np.zeros(len(scene.designs)), []
    for j in (joint.name for joint in tree_of(scene).joints):
        names = (f"mu_{j}", f"radius_{j}", f"thrust_radius_{j}", f"support_{j}1", f"support_{j}2")
        rows.append(np.column_stack([scene.inputs.get(name, zero) for name in names]))
    return np.ascontiguousarray(np.stack(rows, axis=1))


def with_friction(scene: Scene, load: Array, wanted: frozenset[str], status: Status) -> Columns:
    """Compute the wanted quantities with friction; status JAMMED where the iteration does not converge."""
    tree, shape = tree_of(scene), scene.shape
    same: Mask = np.zeros(len(scene.designs), np.bool_)
    for joint in tree.joints:
        same |= together(scene, joint.name) if joint.kind in SUPPORTED else False
    refuse(status, same)
    number, lost, supports = len(tree.joints), tuple(losses(tree)), support_loads(tree)
    forces = _reactions(scene, wanted, FRICTION_SUFFIX)
    torque = np.empty(shape) if TORQUE_WITH_FRICTION in wanted else None
    given = np.empty((*shape, number + 1)) if not wanted.isdisjoint(lost) else None
    carried = np.empty((*shape, number, 2)) if not wanted.isdisjoint(supports) else None
    link_friction.link_friction(
        scene.links, joint_table(tree), _loading(scene, load), _friction_data(scene), status, forces, torque, given,
        carried,
    )  # fmt: skip
    columns = _vector_columns(tree, forces, wanted, FRICTION_SUFFIX)
    on_frame = loads.frame_room(scene.shape, wanted, FRICTION_SUFFIX)
    if any(part is not None for part in on_frame):  # friction is internal: it does not change the load on the frame
        _fill(scene, load, status, None, *on_frame, None, None, None)
    columns |= loads.frame_columns(on_frame, wanted, FRICTION_SUFFIX)
    if torque is not None:
        columns[TORQUE_WITH_FRICTION] = torque
    columns |= loads.scalar_columns(lost, given, wanted)
    if carried is not None:
        columns |= {name: carried[:, :, q, k] for name, (q, k, _) in supports.items() if name in wanted}
    return columns
