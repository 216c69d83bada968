"""Load on an elastic coupler beyond its own follower: the later stages, and a tool at the rocker's tip."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sweep.effects import loads
from sweep.effects.base import ON_TIP, tool_place
from sweep.effects.load_passing import INERTIAS, LOADS, behind, compute_loads, inputs_of_loads
from sweep.effects.scene import Scene
from sweep.families.base import Array
from sweep.numerics.records import Mask

# Units of the inputs by which a stage needs a torque.
WEIGHING = frozenset({"mass", "line_mass", "inertia", "force", "torque"})

STEP = 2e-3  # of the follower's angle in the load's slope: balances truncation of fourth order and rounding


class DrivenSide(NamedTuple):
    """Torque that the driven side needs along the rigid motion, its derivatives, and its inertia, (n, m) each.

    ``torque`` T(psi, psi', psi'') about the follower's axis; ``slope`` dT/dpsi at the same rates; ``inertia`` J and
    ``bend`` dJ/dpsi.
    """

    torque: Array
    slope: Array
    inertia: Array
    bend: Array


def _behind_weighs(scene: Scene) -> Mask:
    """Whether any later stage has a mass or a load in each design, (n,)."""
    found = np.zeros(len(scene.designs), np.bool_)
    for stage in scene.after:
        for p in inputs_of_loads(stage.family):
            if p.unit in WEIGHING:
                found |= (stage.inputs[p.name] != 0.0) if p.name in stage.inputs else False
                found |= p.name in stage.curves
    return found


def driven_side(scene: Scene, slopes: bool) -> DrivenSide | None:
    """Compute torque and inertia of the driven side, None without one; slopes are 0 unless wanted."""
    found = _stages(scene, slopes) if _behind_weighs(scene).any() else None
    tip = _tip(scene)
    if found is None or tip is None:
        return found if tip is None else tip
    return DrivenSide(*(one + other for one, other in zip(found, tip, strict=True)))


def _stages(scene: Scene, slopes: bool) -> DrivenSide | None:
    """Compute torque and inertia of the later stages; phi of the next one is kappa psi + offset."""
    handed_back = behind(scene, LOADS)
    if handed_back is None:
        return None
    kappa, weighs = scene.after[0].kappa[:, None], _behind_weighs(scene)[:, None]
    good = np.where(np.asarray(handed_back["status"]) == 0, 1.0, np.nan)
    # A massless stage needs no torque, even where it cannot move.
    torque, inertia, bend = (
        np.where(weighs, np.asarray(handed_back[n], np.float64) * good, 0.0) for n in ("drive_torque", *INERTIAS)
    )
    slope = np.zeros_like(torque)
    if slopes:
        near, far = (_moved(scene, k * STEP) - _moved(scene, -k * STEP) for k in (1.0, 2.0))
        slope = np.where(weighs, (8.0 * near - far) / (12.0 * STEP), 0.0)
    # kappa is +1 or -1: its square is 1
    return DrivenSide(kappa * torque, slope, inertia, kappa * bend)


def _moved(scene: Scene, angle: float) -> Array:
    """Torque of the next stage with the rocker turned further by an angle, at the same rates.

    A force that jumps where a tool pierces has no slope: it is left out of the difference.
    """
    first, *rest = (
        driven._replace(inputs=driven.inputs | {"pierce_force": 0.0 * driven.inputs["pierce_force"]})
        if "pierce_force" in driven.inputs
        else driven
        for driven in scene.after
    )
    first = first._replace(offset=first.offset + first.kappa * angle)
    there = replace(scene, after=(first, *rest), memo={}).driven
    assert there is not None
    return first.kappa[:, None] * np.asarray(
        compute_loads(there, frozenset({"drive_torque"}))["drive_torque"], np.float64
    )


def _tip(scene: Scene) -> DrivenSide | None:
    """Compute torque and inertia of a tool at the tip of the rocker."""
    if tool_place(scene.family) != ON_TIP or "m_tool" not in scene.inputs:
        return None
    names = tuple(p.name for p in loads.FREE_TOOL[1:])
    force = np.stack(np.broadcast_arrays(*(scene.load(name) for name in names)), axis=2)
    mass, tip = scene.inputs["m_tool"][:, None], scene.table(tuple(p.name for p in loads.TIP))
    if not (mass.any() or force.any()):
        return None
    poses = scene.records[0]
    rho, tau = poses[:, :, 15:18], poses[:, :, 18:21]
    along, aside = tip[:, 0, None, None], tip[:, 1, None, None]
    moved, turned = along * tau - aside * rho, -along * rho - aside * tau  # dP/dpsi and d2P/dpsi2
    weight = force + mass[:, :, None] * scene.table(tuple(p.name for p in loads.GRAVITY))[:, None, :]
    inertia = np.broadcast_to(mass * (tip[:, :1] ** 2 + tip[:, 1:2] ** 2), scene.shape)
    speed = scene.inputs["speed"][:, None]
    torque = inertia * speed * speed * poses[:, :, 23] - (weight * moved).sum(axis=2)
    return DrivenSide(torque, -(weight * turned).sum(axis=2), inertia, np.zeros(scene.shape))
