"""B2: rolling bearings of the rocker under the joint reactions: loads over the turn, mean load, life."""

from __future__ import annotations

from functools import partial

import numpy as np

from kernels import status as st
from kernels.effects.bearing_life import bearing_loads
from sweep.effects import kinetostatics, loads
from sweep.effects.base import DesignResult, Effect, Rows, Scene, Status, refuse
from sweep.effects.bearings import CATALOGUE, SUPPORTS, together
from sweep.effects.turn import chosen
from sweep.families.base import Accuracy, Array, Columns, Output, filled
from sweep.families.capabilities import Assembly
from sweep.numerics.events import sign_changes, with_events
from sweep.numerics.quadrature import integrate
from sweep.numerics.singularities import TWO_PI, crowded, singularities, turn_edges

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
_LOADS = ("equivalent_load_d1", "equivalent_load_d2")
PANEL = 1.0  # length of the first panels of a turn against the distance of the nearest singularity
LOOK = 1.0 / 16.0  # spacing of the poses among which kinks and jumps are looked for, against that distance
SIZING = 64  # poses from which the size of the loads is taken, so that no power of them leaves float64
BLOCK = 256  # designs at once: bisections ask for one pose of each kink
EPS = 2.0**-53


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Return the wanted loads of every pose."""
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
    """Return mean loads and lives, on samples (no errors then) or with the integrals refined to the
    accuracy asked for.

    |psi'| has a kink at each limit position, and a load jumps where the axial one passes e_limit: the integrals are
    split at these places, and on panels that close in on whatever else there is.  A bearing that carries nothing has no
    life: INVALID_INPUT.
    """
    n = len(scene.designs)
    look = scene.on_grid(accuracy.samples or SIZING)
    load, way, worst = _loads(look)
    size = np.maximum(load.max(axis=1, initial=0.0), np.finfo(float).tiny)
    # Poses that do not assemble, or lie at a dead point, are those of a crank that does not turn.
    status = _of_turn(worst)
    good = np.flatnonzero(status == st.OK)
    exponent = scene.inputs["life_exponent"]
    total, err = np.full((n, 3), np.nan), np.full((n, 3), np.nan)
    if accuracy.target is None:
        values = _integrands(load[good], way[good], size[good], exponent[good])
        total[good] = values.mean(axis=1) * TWO_PI
    else:
        total[good], err[good], status[good] = _refined(scene, good, size[good], accuracy.target)
    travel, err_travel = total[:, 2], err[:, 2]
    columns: Columns = {}
    for k, bearing in enumerate("12"):
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = size[:, k] * (total[:, k] / travel) ** (1.0 / exponent)
            share = err[:, k] / total[:, k] + err_travel / travel + 8.0 * EPS
            life = 1e6 * (scene.inputs["dynamic_capacity"] / mean) ** exponent
            life *= TWO_PI**2 / (travel * scene.inputs["speed"])
        err_mean = np.where(mean > 0.0, mean * np.expm1(np.log1p(share) / exponent), 0.0)
        columns |= {f"mean_load_d{bearing}": mean, f"err_mean_load_d{bearing}": err_mean}
        columns |= {f"life_d{bearing}": life, f"err_life_d{bearing}": life * (share + err_travel / travel)}
        if f"life_d{bearing}" in wanted:
            status[(status == st.OK) & ~np.isfinite(life)] = st.INVALID_INPUT
            life[~np.isfinite(life)] = np.nan
    return chosen(columns, wanted, status)


def _of_turn(worst: Status) -> Status:
    turns: Status = np.where(worst == st.OK, st.OK, np.maximum(worst, st.NOT_ROTATABLE)).astype(np.uint8)
    return turns


def _loads(scene: Scene) -> tuple[Array, Array, Status]:
    """Return equivalent loads of both bearings (n, m, 2), |psi'| (n, m) and the worst status of each design."""
    found = compute(scene, frozenset(_LOADS))
    load = np.stack([np.asarray(found[name], np.float64) for name in _LOADS], axis=2)
    return load, np.abs(scene.records[0][:, :, 22]), np.asarray(found["status"].max(axis=1), np.uint8)


def _integrands(load: Array, way: Array, size: Array, exponent: Array) -> Array:
    """Return (P/size)^p |psi'| of both bearings and |psi'|, (k, m, 3)."""
    power = (load / size[:, None, :]) ** exponent[:, None, None]
    return np.concatenate([power * way[:, :, None], way[:, :, None]], axis=2)


def _switches(scene: Scene) -> Array:
    """Return what changes its sign where the integrands have kinks or jumps, (k, m, 3).

    The rocker's speed; the axial load; and by how much it exceeds the part e V of the radial load of its bearing.
    """
    names = ("radial_load_d1", "radial_load_d2", "axial_load_d")
    found = compute(scene, frozenset(names))
    first, second, axial = (np.asarray(found[name], np.float64) for name in names)
    given = scene.inputs
    radial = np.where(given["axial_support"][:, None] == 1.0, first, second)
    limit = (given["e_limit"] * given["rotation_factor"])[:, None] * radial
    return np.stack([scene.records[0][:, :, 22], axial, np.abs(axial) - limit], axis=2)


def _discriminant(scene: Scene, rows: Rows, stage: int, name: str, which: Rows, phi: Array) -> Array:
    posed = scene.posed(rows[which], phi).stage(stage)
    return np.asarray(posed.family.poses(posed.designs, posed.angles, frozenset([name]))[name], np.float64)


def _refined(scene: Scene, rows: Rows, size: Array, target: float) -> tuple[Array, Array, Status]:
    """Return the three integrals over the turn of some designs, their errors and the status."""
    status, scene = np.zeros(rows.size, np.uint8), scene.precise()  # plain poses may be noise near a change point
    exponent = scene.inputs["life_exponent"][rows]

    def integrands(which: Rows, origins: Rows, phi: Array) -> Array:
        load, way, worst = _loads(scene.posed(rows[which], phi))
        bad = worst != st.OK
        status[which[bad]] = worst[bad]
        return np.where(bad[:, None, None], np.nan, _integrands(load, way, size[which], exponent[which]))

    def switches(which: Rows, phi: Array) -> Array:
        return _switches(scene.posed(rows[which], phi))

    families = [scene.family, *(driven.family for driven in scene.after)]
    curves = [
        partial(_discriminant, scene, rows, stage, loop.discriminant)
        for stage, one in enumerate(families)
        for loop in one.every(Assembly)
    ]
    near = singularities(curves, rows.size)
    places = sign_changes(switches, crowded(near, LOOK))
    edges = with_events(turn_edges(near, PANEL), *places)
    # The mean load is a root of order p, so it is as accurate as the integrals at least where p >= 2.
    found = integrate(integrands, edges, 0.25 * target)
    turns = _of_turn(status)
    turns[(turns == st.OK) & ~found.settled] = st.NOT_CONVERGED
    return found.value, found.err, turns


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
    outputs=OUTPUTS,
    compute=compute,
    called_for="life of the rocker's bearings",
    negligible="sliding bearings; elsewhere never, the life is what is asked for",
    even_crank=True,
    takes_load=kinetostatics.KEY,
    design_result=DesignResult(PER_TURN, per_turn, BLOCK),
)
