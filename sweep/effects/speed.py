"""D4: fluctuation of the crank speed over the turn, with constant motor torque or a motor line, also with friction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from kernels import status as st
from kernels.effects.speed_fluctuation import RESOLVED
from kernels.types import EPS, Status
from sweep.effects import load_effects, loads
from sweep.effects.acceleration import NEEDED, NEEDED_NAMES, TARGET, balanced, extremes, rubbing_torque
from sweep.effects.base import Advice, DesignResult, Effect, about
from sweep.effects.load_passing import FRICTION, LOADS, compute_loads
from sweep.effects.loads import FRICTION_SUFFIX, FRICTION_TEXT
from sweep.effects.scene import Scene, take_over
from sweep.effects.turn import at_poses, on_finer_grids, per_turn, reduction_outputs
from sweep.families.base import Accuracy, Array, Columns, Output, Parameter, floats
from sweep.families.curve_features import Switches
from sweep.numerics.even_grids import FINER, GRIDS, LEFT, PER_LEFT, steady
from sweep.numerics.records import Mask

FLYWHEEL = Parameter(
    "flywheel", "inertia", "inertia on the crank shaft besides the links", default=0.0, not_negative=True
)
MOTOR = Parameter(
    "motor_slope", "rotary_damping", "torque that the motor gains per speed it loses; 0: constant torque", default=0.0,
    not_negative=True,
)  # fmt: skip

FINEST = GRIDS + FINER
RUBBING = (129, *FINER[1:])  # friction has kinks where the follower turns back: few designs are resolved by 65
LEFT_OF_CURVE = 1e-4  # share of a curve that the grid may miss: more is a jump, beside which a series overshoots
ROUNDED = 1024.0 * EPS  # share of speed^2 to which rounding may raise a zero acceleration; 324 was observed
SUFFIX = ("", FRICTION_SUFFIX)  # of the outputs, without and with friction

# Friction grows with the loads, and these with the speed: it is iterated with the resulting speed.
PASSES = 24
SETTLED = 1e-7  # share of the largest torque excess or loss by which the last pass changes the loss


def _outputs(suffix: str, text: str) -> tuple[Output, ...]:
    """Speed and angular acceleration of the crank over the turn."""
    steady = f"speed of the crank in the steady state of constant mean speed{text}"
    return (
        Output(f"crank_speed{suffix}", "rad/s", steady),
        Output(f"crank_acceleration{suffix}", "rad/s^2", f"its angular acceleration{text}"),
    )


def _numbers(suffix: str, text: str) -> tuple[Output, ...]:
    """List the outputs per turn."""
    return (
        Output(f"unevenness{suffix}", "1", f"(largest - smallest crank speed)/mean{text}"),
        Output(f"fastest{suffix}", "rad/s", f"largest magnitude of the crank speed{text}"),
        Output(f"slowest{suffix}", "rad/s", f"smallest magnitude of the crank speed{text}"),
    )


def _solve(rubs: bool, finest: int, grid: Scene, phi: Array, last: bool) -> tuple[dict[str, Array], Status]:
    inertia, excess = samples(grid)
    slope = grid.inputs["motor_slope"]
    motor = slope if slope.any() else None
    jammed = np.zeros(len(grid.designs), np.uint8)
    if rubs:
        lost, jammed = _friction_loss(grid, slope)
        excess = excess - lost
    coarsest = LEFT if last and finest > GRIDS[-1] else RESOLVED
    mean = grid.inputs["speed"]
    found, status = steady(inertia, excess, mean, motor, phi, coarsest)
    found["even_torque"] = -excess.mean(axis=1)
    if motor is not None:  # over the turn the motor supplies the work of the loads
        turning, _ = steady(inertia, excess, mean, motor, grid.angles.phi, coarsest)
        found["even_torque"] += slope * (turning["crank_speed"].mean(axis=1) - mean)
    np.copyto(status, jammed, where=jammed != st.OK)
    return found, status


def samples(grid: Scene) -> tuple[Array, Array]:
    """Reduced inertia and torque excess J'w^2/2 - M_drive(w, 0): weights and load reduced to the crank."""
    found = compute_loads(grid.even(), NEEDED)
    inertia, slope, drive = floats(found, *NEEDED_NAMES)
    speed = grid.inputs["speed"][:, None]
    return inertia + grid.inputs["flywheel"][:, None], 0.5 * slope * speed * speed - drive


def _late(scene: Scene) -> Mask:
    """Whether designs need finer grids than usual, because a tool pierces or a planet turns fast, (n,)."""
    return scene.least_samples > GRIDS[-1]


def _bent(scene: Scene) -> Mask:
    """Whether designs need finer grids from the start: loads or motion have kinks, a tool pierces, a planet is fast."""
    kinks = bool(scene.every_curve) or bool(scene.family.every(Switches))
    return _late(scene) | kinks


def _refined(scene: Scene, rubs: bool, run: Callable[[Scene, tuple[int, ...]], Columns]) -> Columns:
    """Run on coarse grids, then on finer ones for designs with kinks and for outputs that are not resolved."""
    if rubs:
        return run(scene, RUBBING)
    bent = _bent(scene)
    found = run(scene, FINEST if bent.all() else GRIDS)
    if bent.all():  # so are none at all
        return found
    unresolved = (found["status"] == st.NOT_CONVERGED).reshape(len(bent), -1).any(axis=1)
    again = np.flatnonzero(bent | unresolved)
    if not again.size:
        return found
    finer = run(scene.only(again), FINEST)
    # An output that the coarse grids resolve keeps its bits, whatever else is wanted.
    lost = {name: np.isnan(x[again]) for name, x in found.items() if not name.startswith("err_")}
    lost["status"] = np.ones(found["status"][again].shape, np.bool_)
    for name, x in found.items():
        of = bent[again].reshape(-1, *[1] * (x.ndim - 1)) | lost[name.removeprefix("err_")]
        x[again] = np.where(of, finer[name], x[again])
    return found


def _solved(scene: Scene, phi: Array, rubs: bool, grids: tuple[int, ...]) -> tuple[dict[str, Array], Status]:
    """Return design outputs and curves at phi by name, and the status."""
    found, status = on_finer_grids(scene, phi, grids, partial(_solve, rubs, grids[-1]))
    for values in found.values():
        values[status == st.NOT_CONVERGED] = np.nan
    return {f"{name}{SUFFIX[rubs]}": x for name, x in found.items()}, status


def compute(scene: Scene, wanted: frozenset[str], rubs: bool = False) -> Columns:
    """Compute speed and acceleration of the crank at the wanted angles."""
    return _refined(scene, rubs, partial(_compute, wanted=wanted, rubs=rubs))


def _compute(scene: Scene, grids: tuple[int, ...], wanted: frozenset[str], rubs: bool) -> Columns:
    found, status = _solved(scene, scene.angles.phi, rubs, grids)
    change = f"crank_acceleration{SUFFIX[rubs]}"
    if change in wanted:
        speed, even = (found[f"{name}{SUFFIX[rubs]}"] for name in ("crank_speed", "even_torque"))
        found[change] = balanced(scene, speed, even, rubs, status)
    return at_poses(scene, found, status, wanted)


def turn(scene: Scene, wanted: frozenset[str], accuracy: Accuracy, rubs: bool = False) -> Columns:
    """Compute unevenness, extreme speeds and the reductions of speed and acceleration."""
    return _refined(scene, rubs, partial(_turn, wanted=wanted, rubs=rubs, target=accuracy.target))


def _turn(scene: Scene, grids: tuple[int, ...], wanted: frozenset[str], rubs: bool, target: float | None) -> Columns:
    suffix, grid = SUFFIX[rubs], scene.on_grid(grids[-1])
    curves = _outputs(suffix, "")
    found, status = _solved(scene, grid.angles.phi, rubs, grids)
    columns: Columns = {f"{name}{suffix}": found[f"{name}{suffix}"] for name in ("unevenness", "fastest", "slowest")}
    one, fastest = np.ones(len(scene.designs)), found[f"fastest{suffix}"]
    known = found[f"energy_error{suffix}"]
    # The missed energy is a share of the largest energy: of a slow speed it is a larger share.
    steep = fastest / found[f"slowest{suffix}"]
    size = {"unevenness": steep / np.abs(scene.inputs["speed"]), "fastest": one, "slowest": steep}
    columns |= {f"err_{name}{suffix}": known * fastest * share for name, share in size.items()}
    limit = RESOLVED if grids == GRIDS else LEFT_OF_CURVE
    # The missed torque is a share of J omega^2: of a small acceleration it is a larger share.
    torque = found[f"torque_error{suffix}"]
    if grids != GRIDS:
        torque = np.maximum(torque, PER_LEFT * found[f"missed{suffix}"])
    change = curves[1].name
    if rubs and any(name.endswith(f"_{change}") for name in wanted):
        steady_state = (found[curves[0].name], found[change], found[f"even_torque{suffix}"])
        columns |= extremes(grid, steady_state, known, curves[1], wanted, target or TARGET, status)
        curves = curves[:1]
    size = np.abs(found[change]).max(axis=1)
    ratio = np.divide(fastest**2, size, out=one.copy(), where=size > 0.0)
    of_change = np.maximum(known, (torque + ROUNDED) * ratio)
    known_of = {change: of_change, f"crank_speed{suffix}": known * steep}
    return per_turn(found, status, columns, curves, wanted, limit, known, known_of)


def _friction_loss(grid: Scene, slope: Array) -> tuple[Array, Status]:
    """Compute the torque loss by friction on the crank, (n, N), at the resulting speed, and the status.

    The speed is computed on a grid of GRIDS[-1] poses, whose error changes the loss by as small a share.  Where that
    grid resolves no steady state, the speed is computed on the whole grid.
    """
    if grid.shape[1] <= GRIDS[-1]:
        lost, status, _ = _settled(grid, grid, slope)
        return lost, status
    lost, status, steady_state = _settled(grid.on_grid(GRIDS[-1]), grid, slope)
    again = np.flatnonzero(steady_state != st.OK)
    if again.size:
        whole = grid.only(again)
        lost[again], status[again], _ = _settled(whole, whole, slope[again])
    return lost, status


def _settled(coarse: Scene, grid: Scene, slope: Array) -> tuple[Array, Status, Status]:
    """Iterate the loss on the grid and the speed on a coarse grid; NOT_CONVERGED if they do not converge.

    The second status is that of the last steady state.
    """
    inertia, excess = samples(coarse)
    mean, motor = grid.inputs["speed"], slope if slope.any() else None
    status = np.zeros(len(grid.designs), np.uint8)
    even = np.broadcast_to(mean[:, None], coarse.shape)
    lost = rubbing_torque(coarse, even, np.zeros(coarse.shape), status)
    phi = coarse.angles.phi
    for _ in range(PASSES):
        before = lost
        turning, change, code = _turning(inertia, excess - lost, mean, motor, phi)
        lost = rubbing_torque(coarse, turning, change, status)
        size = np.maximum(np.abs(excess).max(axis=1), np.abs(lost).max(axis=1))
        moved: Mask = np.asarray(np.abs(lost - before).max(axis=1) > SETTLED * size)
        if not moved.any():
            break
    take_over(status, np.where(moved & (code == st.OK), st.NOT_CONVERGED, code))
    if coarse is not grid:
        turning, change, code = _turning(inertia, excess - lost, mean, motor, grid.angles.phi)
        take_over(status, code)
        lost = rubbing_torque(grid, turning, change, status)
    return lost, status, code


def _turning(
    inertia: Array, excess: Array, mean: Array, motor: Array | None, phi: Array
) -> tuple[Array, Array, Status]:
    """Compute speed and acceleration over the turn, and the status; without a steady state the speed is constant."""
    found, status = steady(inertia, excess, mean, motor, phi, LEFT)
    usable = np.logical_and.reduce(np.isfinite(found["crank_speed"]), axis=1, keepdims=True)
    speed = np.where(usable, found["crank_speed"], mean[:, None])
    return speed, np.where(usable, found["crank_acceleration"], 0.0), status


def advise(scene: Scene) -> Advice | None:
    """Estimate the unevenness for small fluctuations: [max - min of W - (J - mean J) w^2/2]/(mean J w^2)."""
    inertia, excess = samples(scene.on_grid(FINER[-1] if _late(scene).any() else GRIDS[0]))
    speed = scene.inputs["speed"]
    harmonics = np.fft.rfft(excess, axis=1)
    orders = np.arange(harmonics.shape[1])
    harmonics = np.where(orders > 0, harmonics / (1j * np.maximum(orders, 1)), 0.0)
    work = np.fft.irfft(harmonics, n=excess.shape[1], axis=1)
    mean = inertia.mean(axis=1)
    swing = work - 0.5 * (inertia - mean[:, None]) * (speed * speed)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):  # links without a mass have no estimate
        estimate = (swing.max(axis=1) - swing.min(axis=1)) / (mean * speed * speed)
    return Advice.of_turning("estimated unevenness of the crank speed", estimate, 0.01)


def _effect(kind: str, loaded: Effect, rubbing: Effect | None = None, of: str = "") -> Effect:
    """Make the entry for mechanisms with the load effect ``loaded`` and, if given, the friction of ``rubbing``.

    ``of`` is the name of the family that both are made for, if any.
    """
    rubs = rubbing is not None
    suffix, text = SUFFIX[rubs], FRICTION_TEXT if rubs else ""
    curves, texts = _outputs(suffix, text), about(f"{kind}{suffix}", of)
    results = (*_numbers(suffix, text), *reduction_outputs(curves))
    return replace(
        loaded,
        **texts,
        needs=(loaded.name,) if rubbing is None else (texts["name"].removesuffix(suffix), rubbing.name),
        inputs=(*(loaded if rubbing is None else rubbing).inputs, FLYWHEEL, MOTOR),
        outputs=curves,
        compute=partial(compute, rubs=rubs),
        whole_turn=True,
        even_crank=True,
        takes_load=FRICTION if rubs else LOADS,
        design_result=DesignResult(results, partial(turn, rubs=rubs), block=8 if rubs else 32),
        advise=advise,
    )


def of_tree(name: str, rubbing: Effect | None = None) -> Effect:
    """Make the entry of a family with a tree of links."""
    return _effect("speed_fluctuation", load_effects.loads_of(name), rubbing, name)


def rubbing_tree(name: str) -> Effect:
    """Make the entry of a family with a tree of links, friction included."""
    return of_tree(name, load_effects.friction_of(name))


_OF_SLIDER = f"{loads.SLIDER.prefix}speed_fluctuation"
EFFECT = _effect("speed_fluctuation", load_effects.KINETOSTATICS)
SLIDER = _effect(_OF_SLIDER, load_effects.SLIDER_KINETOSTATICS)
RUBBING_EFFECT = _effect("speed_fluctuation", load_effects.KINETOSTATICS, load_effects.CLOSED_FRICTION)
RUBBING_SLIDER = _effect(_OF_SLIDER, load_effects.SLIDER_KINETOSTATICS, load_effects.SLIDER_FRICTION)
