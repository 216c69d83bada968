"""A tool at the guided point: what it weighs on the joints, for the effects of loads; and its own entry."""

from __future__ import annotations

import numpy as np

from kernels.effects.tool import tool_load
from sweep.effects import loads
from sweep.effects.base import Effect, Scene
from sweep.effects.coupler import CONSTRUCTION
from sweep.families.base import Array, Columns, Output
from sweep.families.capabilities import ToolPoint

EQUATION = "docs/tool.md (1), (2)"
OUTPUTS = (
    Output("tool_load", "force", "force of the coupler on the tool along its way", EQUATION),
    Output("tool_torque", "torque", "share of the tool in the torque about this stage's crank", EQUATION),
)


def _loaded(scene: Scene) -> bool:
    """Whether a tool with mass or force hangs on the coupler: without one nothing is computed."""
    given = [scene.inputs[name] for name in ("m_tool", "tool_force", "pierce_force") if name in scene.inputs]
    return "tool_force" in scene.curves or any(bool(values.any()) for values in given)


def _data(scene: Scene) -> tuple[Array, Array]:
    """Columns of the kernel, and the working force, (n, 1) or over the turn (n, m)."""
    place = scene.family.find(ToolPoint)
    assert place is not None
    gravity = scene.table(tuple(p.name for p in loads.GRAVITY))
    mass, _, *pierce = (scene.inputs[p.name][:, None] for p in loads.TOOL)
    data = np.hstack([mass, place.point(scene.designs), place.direction(scene.designs), gravity, *pierce])
    return np.ascontiguousarray(data), np.ascontiguousarray(scene.load("tool_force"))


def wrench_and_inertia(scene: Scene, drive: Array, reduced: bool) -> tuple[Array | None, Array | None]:
    """Wrench (n, m, 6) of the tool on the coupler about B, and the inertia it adds (n, m, 2) if ``reduced``.

    None where no tool hangs on the coupler.  The status of the poses is what the kernel of loads finds as well.
    """
    if not _loaded(scene):
        return None, None
    wrench = np.empty((*scene.shape, 6))
    inertia = np.empty((*scene.shape, 2)) if reduced else None
    poses, designs = scene.records
    data, force = _data(scene)
    finger, status = scene.inputs["finger"], scene.status()
    tool_load(poses, designs, data, drive, force, finger, status, wrench, inertia, None)
    return wrench, inertia


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Force at the guided point and its share in the driving torque."""
    speed, change = scene.crank()
    drive = np.stack(np.broadcast_arrays(np.zeros_like(speed), speed, change), axis=2)
    status, along = scene.status(), np.empty((*scene.shape, 3))
    poses, designs = scene.records
    data, force = _data(scene)
    tool_load(poses, designs, data, drive, force, scene.inputs["finger"], status, None, None, along)
    columns: Columns = {"tool_load": along[:, :, 0], "tool_torque": along[:, :, 0] * along[:, :, 1]}
    return {name: columns[name] for name in wanted} | {"status": status}


EFFECT = Effect(
    key="U3",
    name="tool",
    title="inertia, weight and working force of a tool at the guided point",
    equation=EQUATION,
    formulas=(
        "(1) tool_load = m_tool (s'' omega^2 + s' eps - gravity . lam) - tool_force",
        "    + pierce_force on the way from pierce_at into the fabric, to the turning point",
        "(2) it acts on the coupler at the guided point, reversed: loads, friction, drive torque, inertia",
    ),
    needs=(),
    inputs=(*loads.TOOL, *loads.GRAVITY, loads.SPEED, loads.CHANGE, CONSTRUCTION),
    outputs=OUTPUTS,
    compute=compute,
    called_for="mass of the needle bar, force of the needle",
    negligible="mass of the tool far below that of the links, reduced to the same way",
    requires=ToolPoint,
)
