"""D4: fluctuation of the crank speed over the turn, with constant motor torque or a motor line, without friction."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeAlias

import numpy as np

from kernels import status as st
from kernels.effects.speed_fluctuation import RESOLVED, speed_fluctuation
from sweep.effects import kinetostatics, links, loads
from sweep.effects.base import Advice, DesignResult, Effect, Scene, Status
from sweep.effects.handed import LOADS, computed
from sweep.effects.turn import at_poses, backwards, on_finer_grids, per_turn, reduction_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Array, Columns, Output, Parameter

EQUATION = "D4 (1)-(4)"
FORMULAS = (
    "(1) W(phi) = primitive of drive minus load torque, its mean removed; drive torque constant",
    "(2) omega = sqrt(2 (E + W)/J), E from 2 pi/omega_mean = integral of d phi/omega; eps = d(omega^2)/d phi/2",
    "(3) unevenness = (omega_max - omega_min)/omega_mean;",
    "    estimate [max - min of W - (J - mean J) omega^2/2]/(mean J omega^2)",
    "(4) motor line: d(J omega^2/2)/d phi = X + M - motor_slope (omega - omega_mean), X the excess of loads, M from",
    "    omega_mean; its time constant is mean J/motor_slope",
)

TITLE = "fluctuation of the crank speed at constant mean speed"
FLYWHEEL = Parameter(
    "flywheel", "inertia", "inertia on the crank shaft besides the links", default=0.0, not_negative=True
)
MOTOR = Parameter(
    "motor_slope", "rotary_damping", "torque that the motor gains per speed it loses; 0: constant torque", default=0.0,
    not_negative=True,
)  # fmt: skip

# Odd grids: the next one is tried for designs that the one before does not resolve.
GRIDS = (65, 129, 257)
# Loads that jump or have kinks: no grid resolves all of them, the error says what the last one misses.
FINER = (513, 2049)
RUBBING = (129, *FINER[1:])  # friction has kinks where the follower turns back: few designs end on the first grid
LEFT = 1e-3  # share of J omega^2 that the last of these may miss of the torque
LEFT_OF_CURVE = 1e-4  # and of a curve: more than this is a jump, beside which a series overshoots
PER_LEFT = 5.0  # a jump h leaves h/(pi K) in harmonic K and shifts the energy by h pi/N at most, N = 2 K + 1
ERROR = 1e-9
_NEEDED_NAMES = ("reduced_inertia", "dreduced_inertia", "drive_torque")
_NEEDED = frozenset(_NEEDED_NAMES)

Loss: TypeAlias = Callable[[Scene, Array], tuple[Array, Status]]
"""``loss(grid, slope)``: torque lost to friction on the grid, (n, N), and status (n,)."""


def outputs(suffix: str, text: str) -> tuple[Output, ...]:
    """Return the curves over the turn."""
    return (
        Output(f"crank_speed{suffix}", "rad/s", f"speed of the crank in the steady state{text}", EQUATION),
        Output(f"crank_acceleration{suffix}", "rad/s^2", f"its angular acceleration{text}", EQUATION),
    )


def numbers(suffix: str, text: str) -> tuple[Output, ...]:
    """Return what a turn has one of."""
    return (
        Output(f"unevenness{suffix}", "1", f"(largest - smallest crank speed)/mean{text}", EQUATION),
        Output(f"fastest{suffix}", "rad/s", f"largest magnitude of the crank speed{text}", EQUATION),
        Output(f"slowest{suffix}", "rad/s", f"smallest magnitude of the crank speed{text}", EQUATION),
    )


OF_CONSTANT_MEAN = " of constant mean speed"
OUTPUTS, _PER_TURN = outputs("", OF_CONSTANT_MEAN), numbers("", "")


def _solve(loss: Loss | None, finest: int, grid: Scene, phi: Array, last: bool) -> tuple[dict[str, Array], Status]:
    inertia, excess = samples(grid)
    slope = grid.inputs["motor_slope"]
    motor = slope if slope.any() else None
    jammed = np.zeros(len(grid.designs), np.uint8)
    if loss is not None:
        lost, jammed = loss(grid, slope)
        excess = excess - lost
    coarsest = LEFT if last and finest > GRIDS[-1] else RESOLVED
    found, status = steady(inertia, excess, grid.inputs["speed"], motor, phi, coarsest)
    np.copyto(status, jammed, where=jammed != st.OK)
    return found, status


def steady(
    inertia: Array, excess: Array, speed: Array, slope: Array | None, phi: Array, coarsest: float
) -> tuple[dict[str, Array], Status]:
    """Return the kernel's numbers, (n,), and curves at phi, (n, m), without a suffix, and the status.

    Numbers are of the magnitude of the speed.  A crank that turns backwards is one that turns forwards in -phi, where
    the torque that is left over acts the other way.
    """
    if (speed < 0.0).any():
        return _of_both_senses(inertia, excess, speed, slope, phi, coarsest)
    n = len(inertia)
    unevenness, fastest, slowest, energy, missed = (np.empty(n) for _ in range(5))
    crank_speed, acceleration = (np.empty((n, phi.shape[1])) for _ in range(2))
    status = np.empty(n, np.uint8)
    speed_fluctuation(
        inertia, excess, speed, phi, status, unevenness, fastest, slowest, energy, crank_speed, acceleration, coarsest,
        missed, slope,
    )  # fmt: skip
    found = {"unevenness": unevenness, "fastest": fastest, "slowest": slowest, "missed": missed}
    return found | {"crank_speed": crank_speed, "crank_acceleration": acceleration}, status


def _of_both_senses(
    inertia: Array, excess: Array, speed: Array, slope: Array | None, phi: Array, coarsest: float
) -> tuple[dict[str, Array], Status]:
    """Return the same where some cranks turn backwards."""
    found: dict[str, Array] = {}
    status = np.empty(len(speed), np.uint8)
    for rows, sense in ((np.flatnonzero(speed > 0.0), 1.0), (np.flatnonzero(speed < 0.0), -1.0)):
        at, stored, left = phi[rows] if len(phi) > 1 else phi, inertia[rows], excess[rows]
        if sense < 0.0:
            at, (stored, left) = backwards(at, stored, -left)
        given = None if slope is None else slope[rows]
        part, status[rows] = steady(stored, left, sense * speed[rows], given, np.ascontiguousarray(at), coarsest)
        for name, values in part.items():
            turned = sense if name in ("crank_speed", "crank_acceleration") else 1.0
            found.setdefault(name, np.empty((len(speed), *values.shape[1:])))[rows] = turned * values
    return found, status


def samples(grid: Scene) -> tuple[Array, Array]:
    """Return the reduced inertia and torque excess J'w^2/2 - M_drive(w, 0): weights and load reduced to the crank."""
    even = grid.inputs | {"speed_change": np.zeros(len(grid.designs))}
    after = tuple(d._replace(inputs=d.inputs | {"speed_change": even["speed_change"]}) for d in grid.after)
    turning = Scene(grid.family, grid.designs, grid.angles, even, after, curves=grid.curves)
    found = computed(turning, LOADS, _NEEDED)
    inertia, slope, drive = (np.asarray(found[name], np.float64) for name in _NEEDED_NAMES)
    speed = grid.inputs["speed"][:, None]
    return inertia + grid.inputs["flywheel"][:, None], 0.5 * slope * speed * speed - drive


def _grids(scene: Scene, loss: Loss | None) -> tuple[int, ...]:
    if loss is not None:
        return RUBBING
    return GRIDS if scene.smooth else GRIDS + FINER


def compute(scene: Scene, wanted: frozenset[str], loss: Loss | None = None, suffix: str = "") -> Columns:
    """Return the speed and acceleration of the crank at the wanted angles."""
    grids = _grids(scene, loss)
    found, status = on_finer_grids(scene, scene.angles.phi, grids, partial(_solve, loss, grids[-1]))
    return at_poses(scene, {f"{name}{suffix}": x for name, x in found.items()}, status, wanted)


def turn(
    scene: Scene, wanted: frozenset[str], accuracy: Accuracy, loss: Loss | None = None, suffix: str = ""
) -> Columns:
    """Return the unevenness, extreme speeds and the reductions of speed and acceleration."""
    grids = _grids(scene, loss)
    found, status = on_finer_grids(scene, scene.on_grid(grids[-1]).angles.phi, grids, partial(_solve, loss, grids[-1]))
    found = {f"{name}{suffix}": x for name, x in found.items()}
    columns: Columns = {f"{name}{suffix}": found[f"{name}{suffix}"] for name in ("unevenness", "fastest", "slowest")}
    one, fastest = np.ones(len(scene.designs)), found[f"fastest{suffix}"]
    known = np.maximum(ERROR, PER_LEFT * found[f"missed{suffix}"])
    error = known * fastest
    relative = {"unevenness": found[f"slowest{suffix}"], "fastest": one, "slowest": one}
    columns |= {f"err_{name}{suffix}": error / size for name, size in relative.items()}
    limit = RESOLVED if grids == GRIDS else LEFT_OF_CURVE
    # What is missed of the torque is a share of J omega^2: of a small acceleration it is a larger share.
    change = f"crank_acceleration{suffix}"
    size = np.abs(found[change]).max(axis=1)
    ratio = np.divide(fastest**2, size, out=one.copy(), where=size > 0.0)
    of_change = np.maximum(known, PER_LEFT * found[f"missed{suffix}"] * ratio)
    return per_turn(found, status, columns, outputs(suffix, ""), wanted, limit, known, {change: of_change})


def advise(scene: Scene) -> Advice | None:
    """Estimate the unevenness for small fluctuations: [max - min of W - (J - mean J) w^2/2]/(mean J w^2)."""
    inertia, excess = samples(scene.on_grid(GRIDS[0]))
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


def _effect(name: str, title: str, loaded: Effect) -> Effect:
    """Return the entry of that name for the mechanisms whose loads ``loaded`` gives."""
    return Effect(
        key="D4",
        name=name,
        title=title,
        equation=EQUATION,
        formulas=FORMULAS,
        followers=loaded.followers,
        requires=loaded.requires,
        tree=loaded.tree,
        needs=(loaded.name,),
        inputs=(*loaded.inputs, FLYWHEEL, MOTOR),
        tool_inputs=loaded.tool_inputs,
        outputs=OUTPUTS,
        compute=compute,
        called_for="unevenness of the speed asked for, a light drive",
        negligible="estimated unevenness below 1 %",
        whole_turn=True,
        even_crank=True,
        takes_load=LOADS,
        design_result=DesignResult((*_PER_TURN, *reduction_outputs(OUTPUTS)), turn),
        advise=advise,
    )


def of_tree(name: str) -> Effect:
    """Return the entry of a family with a tree of links."""
    return _effect(f"{name}_speed_fluctuation", f"{TITLE}: {family(name).title}", links.loads_of(name))


EFFECT = _effect("speed_fluctuation", TITLE, kinetostatics.EFFECT)
SLIDER = _effect(f"{loads.SLIDER.prefix}speed_fluctuation", TITLE, kinetostatics.SLIDER)
