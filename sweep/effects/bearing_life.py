"""B2: rolling bearings of the rocker under the joint reactions: loads over the turn, mean load, life."""

from __future__ import annotations

from functools import partial

from sweep.effects import kinetostatics, loads
from sweep.effects.base import DesignResult, Effect, Scene, refuse
from sweep.effects.bearings import CATALOGUE, SUPPORTS, together
from sweep.effects.shaft_life import BLOCK, FORMULAS, Shaft, bends, load_outputs, per_turn, turn_outputs
from sweep.families.base import Array, Columns

EQUATION = "B2 (1)-(3)"
TEXT = "the rocker's bearings"
_FORCE, _MOMENT = 9, 15  # columns of the joint reactions: of the frame on the rocker


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Return the wanted loads of every pose."""
    if "forces" not in scene.memo:
        kinetostatics.compute(scene, frozenset({"force_d", "moment_d"}))
    forces, status = scene.memo["forces"]
    status = status.copy()
    refuse(status, together(scene, "d"))
    axis = scene.records[1][:, None, 3:6]
    return ROCKER.of_reactions(scene, forces, (_FORCE, _MOMENT), axis, wanted, status)


def turning(scene: Scene) -> Array:
    """Return psi', (n, m)."""
    return scene.records[0][:, :, 22]


ROCKER = Shaft("d", "", compute, turning)

EFFECT = Effect(
    key="B2",
    name="bearing_life",
    title="rolling bearings of the rocker under the joint reactions: loads, mean load over the turn, life",
    equation=EQUATION,
    formulas=FORMULAS,
    followers=(loads.ROCKER.name,),
    needs=("kinetostatics",),
    inputs=(*loads.ROCKER.parameters, *SUPPORTS, *CATALOGUE),
    tool_inputs=loads.TOOLS,
    outputs=load_outputs("d", TEXT, EQUATION),
    compute=compute,
    called_for="life of the rocker's bearings",
    negligible="sliding bearings; elsewhere never, the life is what is asked for",
    even_crank=True,
    takes_load=kinetostatics.KEY,
    bends=bends(ROCKER),
    design_result=DesignResult(turn_outputs("d", TEXT, EQUATION), partial(per_turn, shaft=ROCKER), BLOCK),
)
