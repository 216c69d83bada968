"""D4: fluctuation of the crank speed over the turn."""

from __future__ import annotations

import numpy as np

from kernels import status as st
from kernels.effects.kinetostatics import kinetostatics
from kernels.effects.speed_fluctuation import speed_fluctuation
from sweep.effects import loads
from sweep.effects.base import DesignResult, Effect, Scene
from sweep.families.base import Accuracy, Angles, Array, Columns, Family, Output, Parameter

EQUATION = "dynamics sheet 3"

FLYWHEEL = Parameter("flywheel", "inertia", "inertia on the crank shaft besides the links", default=0.0)
OUTPUTS = (
    Output("crank_speed", "rad/s", "speed of the crank in the steady state of constant mean speed", EQUATION),
    Output("crank_acceleration", "rad/s^2", "its angular acceleration", EQUATION),
)
DESIGN_OUTPUTS = (
    Output("unevenness", "1", "(largest - smallest crank speed)/mean", EQUATION),
    Output("fastest", "rad/s", "largest crank speed", EQUATION),
    Output("slowest", "rad/s", "smallest crank speed", EQUATION),
)

# Odd grids: the next one is tried for designs that the one before does not resolve.
GRIDS = (65, 129, 257)


def _steady(scene: Scene, phi: Array) -> tuple[dict[str, Array], np.ndarray]:
    n = len(scene.designs)
    found = {name: np.empty(n) for name in ("unevenness", "fastest", "slowest", "energy")}
    found |= {name: np.empty((n, phi.shape[1])) for name in ("crank_speed", "crank_acceleration")}
    status = np.full(n, st.NOT_CONVERGED, np.uint8)
    rows = np.arange(n)
    for size in GRIDS:
        inputs = {name: np.ascontiguousarray(values[rows]) for name, values in scene.inputs.items()}
        grid = Scene(scene.family, scene.designs[rows], Angles.of(2.0 * np.pi * np.arange(size)[None] / size), inputs)
        inertia, excess = _samples(grid)
        own = np.ascontiguousarray(phi[rows] if phi.shape[0] > 1 else phi)
        part = {name: np.empty((rows.size, *values.shape[1:])) for name, values in found.items()}
        codes = np.empty(rows.size, np.uint8)
        speed_fluctuation(inertia, excess, inputs["speed"], own, codes, *part.values())
        for name, values in part.items():
            found[name][rows] = values
        status[rows] = codes
        rows = rows[codes == st.NOT_CONVERGED]
        if rows.size == 0:
            break
    return found, status


def _samples(grid: Scene) -> tuple[Array, Array]:
    """Reduced inertia and torque excess J'w^2/2 - M_drive(w, 0): weights and load reduced to the crank."""
    table = grid.table(loads.LOAD_NAMES)
    table[:, loads.LOAD_NAMES.index("speed_change")] = 0.0
    inertia, slope, drive = (np.empty(grid.shape) for _ in range(3))
    # The finger's construction moves the coupler's spin, so it enters the inertia; each is sampled on its own.
    for finger in np.unique(grid.inputs["finger"]):
        rows = np.flatnonzero(grid.inputs["finger"] == finger)
        per_pose, per_design = (np.ascontiguousarray(record[rows]) for record in grid.records)
        status = np.ascontiguousarray(grid.status()[rows])
        part = [np.empty(status.shape) for _ in range(3)]
        kinetostatics(per_pose, per_design, table[rows], int(finger), status, *[*[None] * 7, *part])
        drive[rows], inertia[rows], slope[rows] = part
    speed = grid.inputs["speed"][:, None]
    return inertia + grid.inputs["flywheel"][:, None], 0.5 * slope * speed * speed - drive


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Speed and acceleration of the crank at the wanted angles."""
    found, turn = _steady(scene, scene.angles.phi)
    status = scene.status()
    np.copyto(status, turn[:, None], where=(status == st.OK) & (turn[:, None] != st.OK))
    columns: Columns = {name: found[name] for name in wanted}
    return columns | {"status": status}


def _design(
    family: Family, designs: Array, inputs: dict[str, Array], wanted: frozenset[str], accuracy: Accuracy
) -> Columns:
    found, status = _steady(Scene(family, designs, Angles.of(np.zeros((1, 1))), inputs), np.zeros((1, 1)))
    columns: Columns = {name: found[name] for name in wanted}
    return columns | {"status": status}


EFFECT = Effect(
    key="D4",
    name="speed_fluctuation",
    title="fluctuation of the crank speed at constant mean speed",
    equation=EQUATION,
    families=("rssr",),
    needs=("kinetostatics",),
    inputs=(*loads.INPUTS, FLYWHEEL),
    outputs=OUTPUTS,
    compute=compute,
    ns_per_pose=50.0,
    called_for="unevenness of the speed asked for, a light drive",
    negligible="estimated unevenness below 1 %",
    whole_turn=True,
    design_result=DesignResult(DESIGN_OUTPUTS, _design, 150_000.0),
)
