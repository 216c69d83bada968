"""D4: fluctuation of the crank speed over the turn."""

from __future__ import annotations

import numpy as np

from kernels import status as st
from kernels.effects.kinetostatics import kinetostatics
from kernels.effects.speed_fluctuation import speed_fluctuation
from sweep.effects import loads
from sweep.effects.base import Advice, DesignResult, Effect, Scene, Status
from sweep.effects.turn import chosen, reduction_outputs, reductions
from sweep.families.base import Accuracy, Angles, Array, Columns, Family, Output, Parameter

EQUATION = "D4 (1)-(3)"
FORMULAS = (
    "(1) W(phi) = primitive of drive minus load torque, its mean removed; drive torque constant",
    "(2) omega = sqrt(2 (E + W)/J), E from 2 pi/omega_mean = integral of d phi/omega; eps = d(omega^2)/d phi/2",
    "(3) unevenness = (omega_max - omega_min)/omega_mean;",
    "    estimate [max - min of W - (J - mean J) omega^2/2]/(mean J omega^2)",
)

FLYWHEEL = Parameter("flywheel", "inertia", "inertia on the crank shaft besides the links", default=0.0)
OUTPUTS = (
    Output("crank_speed", "rad/s", "speed of the crank in the steady state of constant mean speed", EQUATION),
    Output("crank_acceleration", "rad/s^2", "its angular acceleration", EQUATION),
)
_PER_TURN = (
    Output("unevenness", "1", "(largest - smallest crank speed)/mean", EQUATION),
    Output("fastest", "rad/s", "largest crank speed", EQUATION),
    Output("slowest", "rad/s", "smallest crank speed", EQUATION),
)

# Odd grids: the next one is tried for designs that the one before does not resolve.
GRIDS = (65, 129, 257)
ERROR = 1e-9


def steady(scene: Scene, phi: Array) -> tuple[dict[str, Array], Status]:
    """Steady state of every design, and its curves at the angles phi, (n, m) or (1, m)."""
    n = len(scene.designs)
    found = {name: np.empty(n) for name in ("unevenness", "fastest", "slowest", "energy")}
    found |= {name: np.empty((n, phi.shape[1])) for name in ("crank_speed", "crank_acceleration")}
    status: Status = np.full(n, st.NOT_CONVERGED, np.uint8)
    rows = np.arange(n)
    for size in GRIDS:
        grid = scene.only(rows).on_grid(size)
        inertia, excess = _samples(grid)
        own = np.ascontiguousarray(phi[rows] if phi.shape[0] > 1 else phi)
        part = {name: np.empty((rows.size, *values.shape[1:])) for name, values in found.items()}
        codes = np.empty(rows.size, np.uint8)
        speed_fluctuation(inertia, excess, grid.inputs["speed"], own, codes, *part.values())
        for name, values in part.items():
            found[name][rows] = values
        status[rows] = codes
        rows = rows[codes == st.NOT_CONVERGED]
        if rows.size == 0:
            break
    return found, status


def _samples(grid: Scene) -> tuple[Array, Array]:
    """Reduced inertia and torque excess J'w^2/2 - M_drive(w, 0): weights and load reduced to the crank."""
    inertia, slope, drive = (np.empty(grid.shape) for _ in range(3))
    # The finger's construction moves the coupler's spin, so it enters the inertia; each is sampled on its own.
    for finger in np.unique(grid.inputs["finger"]):
        rows = np.flatnonzero(grid.inputs["finger"] == finger)
        scene = grid.only(rows)
        table, status = scene.table(loads.ROCKER.columns), scene.status()
        table[:, loads.ROCKER.columns.index("speed_change")] = 0.0
        part = [np.empty(status.shape) for _ in range(3)]
        kinetostatics(*scene.records, table, int(finger), status, *[*[None] * 7, *part])
        drive[rows], inertia[rows], slope[rows] = part
    speed = grid.inputs["speed"][:, None]
    return inertia + grid.inputs["flywheel"][:, None], 0.5 * slope * speed * speed - drive


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Speed and acceleration of the crank at the wanted angles."""
    found, turn = steady(scene, scene.angles.phi)
    status = scene.status()
    np.copyto(status, turn[:, None], where=(status == st.OK) & (turn[:, None] != st.OK))
    columns: Columns = {name: found[name] for name in wanted}
    return columns | {"status": status}


def per_turn(
    family: Family, designs: Array, inputs: dict[str, Array], wanted: frozenset[str], accuracy: Accuracy
) -> Columns:
    """Unevenness, extreme speeds and the reductions of speed and acceleration."""
    scene = Scene(family, designs, Angles.of(np.zeros((1, 1))), inputs)
    found, status = steady(scene, scene.on_grid(GRIDS[-1]).angles.phi)
    columns: Columns = {o.name: found[o.name] for o in _PER_TURN}
    relative = {"unevenness": found["slowest"], "fastest": np.ones(len(designs)), "slowest": np.ones(len(designs))}
    columns |= {f"err_{name}": ERROR * found["fastest"] / size for name, size in relative.items()}
    for o in OUTPUTS:
        if any(name.endswith(f"_{o.name}") for name in wanted):
            columns |= reductions(o.name, found[o.name], status)
    return chosen(columns, wanted, status)


def advise(scene: Scene) -> Advice | None:
    """Small-fluctuation estimate [max - min of W - (J - mean J) w^2/2]/(mean J w^2), sheet section 3."""
    inertia, excess = _samples(scene.on_grid(GRIDS[0]))
    turning = np.isfinite(excess).all(axis=1)
    if not turning.any():
        return None
    inertia, excess, speed = inertia[turning], excess[turning], scene.inputs["speed"][turning]
    harmonics = np.fft.rfft(excess, axis=1)
    orders = np.arange(harmonics.shape[1])
    harmonics = np.where(orders > 0, harmonics / (1j * np.maximum(orders, 1)), 0.0)
    work = np.fft.irfft(harmonics, n=excess.shape[1], axis=1)
    mean = inertia.mean(axis=1)
    swing = work - 0.5 * (inertia - mean[:, None]) * (speed * speed)[:, None]
    estimate = (swing.max(axis=1) - swing.min(axis=1)) / (mean * speed * speed)
    return Advice("estimated unevenness of the crank speed", estimate, 0.01)


EFFECT = Effect(
    key="D4",
    name="speed_fluctuation",
    title="fluctuation of the crank speed at constant mean speed",
    equation=EQUATION,
    formulas=FORMULAS,
    families=("rssr",),
    needs=("kinetostatics",),
    inputs=(*loads.ROCKER.parameters, FLYWHEEL),
    outputs=OUTPUTS,
    compute=compute,
    ns_per_pose=1050.0,
    called_for="unevenness of the speed asked for, a light drive",
    negligible="estimated unevenness below 1 %",
    whole_turn=True,
    design_result=DesignResult((*_PER_TURN, *reduction_outputs(OUTPUTS)), per_turn, 940_000.0),
    advise=advise,
)
