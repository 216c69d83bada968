"""D4: fluctuation of the crank speed over the turn."""

from __future__ import annotations

import numpy as np

from kernels.effects.speed_fluctuation import speed_fluctuation
from sweep.effects import kinetostatics, loads
from sweep.effects.base import Advice, DesignResult, Effect, Scene, Status
from sweep.effects.turn import at_poses, on_finer_grids, per_turn, reduction_outputs
from sweep.families.base import Accuracy, Array, Columns, Output, Parameter

EQUATION = "D4 (1)-(3)"
FORMULAS = (
    "(1) W(phi) = primitive of drive minus load torque, its mean removed; drive torque constant",
    "(2) omega = sqrt(2 (E + W)/J), E from 2 pi/omega_mean = integral of d phi/omega; eps = d(omega^2)/d phi/2",
    "(3) unevenness = (omega_max - omega_min)/omega_mean;",
    "    estimate [max - min of W - (J - mean J) omega^2/2]/(mean J omega^2)",
)

FLYWHEEL = Parameter(
    "flywheel", "inertia", "inertia on the crank shaft besides the links", default=0.0, not_negative=True
)
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
_NEEDED_NAMES = ("reduced_inertia", "dreduced_inertia", "drive_torque")
_NEEDED = frozenset(_NEEDED_NAMES)


def _solve(grid: Scene, phi: Array, last: bool) -> tuple[dict[str, Array], Status]:
    inertia, excess = _samples(grid)
    n = len(grid.designs)
    numbers = {name: np.empty(n) for name in ("unevenness", "fastest", "slowest", "energy")}
    curves = {o.name: np.empty((n, phi.shape[1])) for o in OUTPUTS}
    status = np.empty(n, np.uint8)
    speed_fluctuation(
        inertia, excess, grid.inputs["speed"], phi, status, *numbers.values(), *curves.values()
    )  # fmt: skip
    return numbers | curves, status


def _samples(grid: Scene) -> tuple[Array, Array]:
    """Reduced inertia and torque excess J'w^2/2 - M_drive(w, 0): weights and load reduced to the crank."""
    even = grid.inputs | {"speed_change": np.zeros(len(grid.designs))}
    after = tuple(d._replace(inputs=d.inputs | {"speed_change": even["speed_change"]}) for d in grid.after)
    found = kinetostatics.compute(Scene(grid.family, grid.designs, grid.angles, even, after), _NEEDED)
    inertia, slope, drive = (np.asarray(found[name], np.float64) for name in _NEEDED_NAMES)
    speed = grid.inputs["speed"][:, None]
    return inertia + grid.inputs["flywheel"][:, None], 0.5 * slope * speed * speed - drive


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Speed and acceleration of the crank at the wanted angles."""
    return at_poses(scene, *on_finer_grids(scene, scene.angles.phi, GRIDS, _solve), wanted)


def turn(scene: Scene, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Unevenness, extreme speeds and the reductions of speed and acceleration."""
    found, status = on_finer_grids(scene, scene.on_grid(GRIDS[-1]).angles.phi, GRIDS, _solve)
    numbers: Columns = {o.name: found[o.name] for o in _PER_TURN}
    one = np.ones(len(scene.designs))
    relative = {"unevenness": found["slowest"], "fastest": one, "slowest": one}
    numbers |= {f"err_{name}": ERROR * found["fastest"] / size for name, size in relative.items()}
    return per_turn(found, status, numbers, OUTPUTS, wanted)


def advise(scene: Scene) -> Advice | None:
    """Estimate the unevenness for small fluctuations: [max - min of W - (J - mean J) w^2/2]/(mean J w^2)."""
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


def _effect(kind: loads.Follower) -> Effect:
    return Effect(
        key="D4",
        name=f"{kind.prefix}speed_fluctuation",
        title="fluctuation of the crank speed at constant mean speed",
        equation=EQUATION,
        formulas=FORMULAS,
        followers=(kind.name,),
        needs=(f"{kind.prefix}kinetostatics",),
        inputs=(*kind.parameters, FLYWHEEL),
        tool_inputs=loads.TOOL,
        outputs=OUTPUTS,
        compute=compute,
        called_for="unevenness of the speed asked for, a light drive",
        negligible="estimated unevenness below 1 %",
        whole_turn=True,
        even_crank=True,
        takes_load=kinetostatics.KEY,
        design_result=DesignResult((*_PER_TURN, *reduction_outputs(OUTPUTS)), turn),
        advise=advise,
    )


EFFECT = _effect(loads.ROCKER)
SLIDER = _effect(loads.SLIDER)
