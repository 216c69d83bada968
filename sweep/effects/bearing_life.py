"""B2: rolling bearings of the rocker under the joint reactions: loads over the turn, mean load, life."""

from __future__ import annotations

import numpy as np

from kernels import status as st
from kernels.effects.bearing_life import bearing_loads, mean_load
from sweep.effects import kinetostatics, loads
from sweep.effects.base import DesignResult, Effect, Scene, refuse
from sweep.effects.bearings import CATALOGUE, SUPPORTS, together
from sweep.effects.turn import chosen
from sweep.families.base import Accuracy, Array, Columns, Output, filled

EQUATION = "B2 (1)-(3)"
FORMULAS = (
    "(1) F2 = (M x k - z1 F_r)/(z2 - z1), F1 = F_r - F2 from force F and moment M of the frame on the rocker;",
    "    F_r across the axis k",
    "(2) P_m = (integral of P^p |psi'| d phi/integral of |psi'| d phi)^(1/p), ours",
    "(3) life = 10^6 (C/P_m)^p turns; the rocker's travel counts in full turns, ours",
)

OUTPUTS = (
    Output("radial_load_d1", "force", "radial load of the rocker's support 1 from the joint reactions", EQUATION),
    Output("radial_load_d2", "force", "radial load of the rocker's support 2 from the joint reactions", EQUATION),
    Output("axial_load_d", "force", "axial load of the rocker's bearings", EQUATION),
    Output("equivalent_load_d1", "force", "equivalent load of rolling bearing 1 from the joint reactions", EQUATION),
    Output("equivalent_load_d2", "force", "equivalent load of rolling bearing 2 from the joint reactions", EQUATION),
)
PER_TURN = tuple(
    o
    for k in "12"
    for o in (
        Output(f"mean_load_d{k}", "force", f"load of equal effect over the turn, bearing {k}, by travel", EQUATION),
        Output(
            f"life_d{k}", "time", f"running time that 90 % of bearings {k} reach; travel counted as turns", EQUATION
        ),
    )
)
_NAMES = tuple(o.name for o in OUTPUTS)
# |dpsi| has a kink at each limit position: the error of the sum falls with the square of the number of samples.
SAMPLES = 720


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Wanted loads of every pose."""
    if "forces" not in scene.memo:
        kinetostatics.compute(scene, frozenset({"force_d", "moment_d"}))
    forces, status = scene.memo["forces"]
    status = status.copy()
    refuse(status, together(scene, "d"))
    axis = np.ascontiguousarray(scene.records[1][:, 3:6])
    return filled(bearing_loads, (forces, axis, _data(scene)), _NAMES, wanted, status)


def _data(scene: Scene) -> Array:
    return np.column_stack([scene.records[1][:, 14], scene.table(tuple(p.name for p in (*SUPPORTS, *CATALOGUE)))])


def per_turn(scene: Scene, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Mean loads and lives; the error is what half the samples would change."""
    scene = scene.on_grid(SAMPLES)
    found = compute(scene, frozenset({"equivalent_load_d1", "equivalent_load_d2"}))
    # Poses that do not assemble, or lie at a dead point, are those of a crank that does not turn.
    worst = found["status"].max(axis=1)
    status = np.where(worst == st.OK, st.OK, np.maximum(worst, st.NOT_ROTATABLE)).astype(np.uint8)
    dpsi, exponent = np.ascontiguousarray(scene.records[0][:, :, 22]), scene.inputs["life_exponent"]
    columns: Columns = {}
    for k in "12":
        load = np.asarray(found[f"equivalent_load_d{k}"], np.float64)
        mean, travel = _mean(load, dpsi, exponent)
        half, _ = _mean(load[:, ::2], dpsi[:, ::2], exponent)
        turns = 1e6 * (scene.inputs["dynamic_capacity"] / mean) ** exponent
        life = turns * (2.0 * np.pi) ** 2 / (travel * scene.inputs["speed"])
        columns |= {f"mean_load_d{k}": mean, f"err_mean_load_d{k}": np.abs(mean - half)}
        columns |= {f"life_d{k}": life, f"err_life_d{k}": life * exponent * np.abs(mean - half) / mean}
    return chosen(columns, wanted, status)


def _mean(load: Array, dpsi: Array, exponent: Array) -> tuple[Array, Array]:
    mean, travel = np.empty(len(load)), np.empty(len(load))
    mean_load(np.ascontiguousarray(load), np.ascontiguousarray(dpsi), exponent, mean, travel)
    return mean, travel


EFFECT = Effect(
    key="B2",
    name="bearing_life",
    title="rolling bearings of the rocker under the joint reactions: loads, mean load over the turn, life",
    equation=EQUATION,
    formulas=FORMULAS,
    followers=(loads.ROCKER.name,),
    needs=("kinetostatics",),
    inputs=(*loads.ROCKER.parameters, *SUPPORTS, *CATALOGUE),
    outputs=OUTPUTS,
    compute=compute,
    called_for="life of the rocker's bearings",
    negligible="sliding bearings; elsewhere never, the life is what is asked for",
    even_crank=True,
    takes_load=kinetostatics.KEY,
    design_result=DesignResult(PER_TURN, per_turn),
)
