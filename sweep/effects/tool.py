"""A tool on the coupler or at the tip of the rocker: its load on the linkage, and its own entry."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kernels.effects.tool import ToolLoad, tool_load
from kernels.types import Status
from sweep.effects import loads
from sweep.effects.base import ON_TIP, Effect, about, tool_place
from sweep.effects.motion import CONSTRUCTION
from sweep.effects.scene import Scene
from sweep.families.base import Array, Columns, Output
from sweep.families.capabilities import JointRecords, ToolPoint
from sweep.families.poses import chosen

_SHARE = "in the torque about this stage's crank"
OUTPUTS = (
    Output("tool_load", "force", "force of the coupler on the tool: along its way, or its magnitude if it moves "
           "freely"),
    Output("tool_torque", "torque", f"share of the tool {_SHARE}"),
)  # fmt: skip
TIP_OUTPUTS = (
    Output("tip_load", "force", "magnitude of the force of the rocker on the tool at its tip", "docs/tool.md (6)"),
    Output("tip_torque", "torque", f"share of the tool at the tip {_SHARE}", "docs/tool.md (6)"),
)
_FORCES = tuple(p.name for p in loads.FREE_TOOL[1:])


class Weighs(NamedTuple):
    """Wrenches of a tool on coupler and rocker, (n, m, 6) each, and its inertia, (n, m, 2); None for absent ones."""

    coupler: Array | None
    follower: Array | None
    inertia: Array | None


def _loaded(scene: Scene) -> bool:
    """Whether a tool with mass or force hangs on the linkage; otherwise it is not computed."""
    names = ("m_tool", "tool_force", "pierce_force", *_FORCES)
    given = [scene.inputs[name] for name in names if name in scene.inputs]
    return not scene.curves.keys().isdisjoint(names) or any(bool(values.any()) for values in given)


def _data(scene: Scene) -> tuple[Array, Array]:
    """Columns of the kernel of a tool, and the working force, (n, m or 1, 3), or (n, m or 1, 1) along its line."""
    place = scene.family.find(ToolPoint)
    point = loads.tip_from(scene, scene.records[1][:, 11]) if place is None else place.point(scene.designs)
    data = np.column_stack([scene.inputs["m_tool"], point, scene.table(tuple(p.name for p in loads.GRAVITY))])
    if place is None or place.direction is None:
        return data, np.stack(np.broadcast_arrays(*(scene.load(name) for name in _FORCES)), axis=2)
    pierce = [scene.inputs[p.name] for p in loads.TOOL[2:]]
    return np.column_stack([data, place.direction(scene.designs), *pierce]), scene.load("tool_force")[:, :, None]


def weighs(scene: Scene, drive: Array, reduced: bool) -> Weighs:
    """Compute the wrenches of the tool on the links, and its reduced inertia if ``reduced``.

    The status of the poses is also determined by the kernel of loads.
    """
    place = tool_place(scene.family)
    if place is None or not _loaded(scene):
        return Weighs(None, None, None)
    wrench = np.empty((*scene.shape, 6))
    inertia = np.empty((*scene.shape, 2)) if reduced else None
    _fill(scene, drive, scene.status(), ToolLoad(wrench, inertia))
    return Weighs(None, wrench, inertia) if place == ON_TIP else Weighs(wrench, None, inertia)


def _fill(scene: Scene, drive: Array, status: Status, out: ToolLoad) -> None:
    """Run the kernel of a tool."""
    data, force = _data(scene)
    on_rocker = tool_place(scene.family) == ON_TIP
    tool_load(*scene.records, data, drive, np.ascontiguousarray(force), scene.inputs["finger"], on_rocker, status, out)


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Compute the force at the working point and its share in the driving torque."""
    speed, change = scene.crank()
    drive = np.stack(np.broadcast_arrays(np.zeros_like(speed), speed, change), axis=2)
    status, along = scene.status(), np.empty((*scene.shape, 2))
    _fill(scene, drive, status, ToolLoad(along=along))
    load, torque = TIP_OUTPUTS if tool_place(scene.family) == ON_TIP else OUTPUTS
    return chosen({load.name: along[:, :, 0], torque.name: along[:, :, 1]}, wanted, status)


EFFECT = Effect(
    **about("tool"),
    inputs=(*loads.GRAVITY, loads.SPEED, loads.CHANGE, CONSTRUCTION),
    tool_inputs=loads.TOOLS,
    outputs=OUTPUTS,
    compute=compute,
    requires=ToolPoint,
)

TIP = replace(
    EFFECT,
    **about("tip_tool"),
    outputs=TIP_OUTPUTS,
    requires=JointRecords,
    carried_at=ON_TIP,
)
