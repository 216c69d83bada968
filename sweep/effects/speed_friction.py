"""D4 with D2: fluctuation of the crank speed where the joints rub."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from sweep.effects import friction, link_friction, speed
from sweep.effects.base import DesignResult, Effect, Scene, Status, take_over
from sweep.effects.handed import FRICTION, LOADS, computed
from sweep.effects.speed import (
    FLYWHEEL,
    FORMULAS,
    GRIDS,
    LEFT,
    MOTOR,
    OF_CONSTANT_MEAN,
    TITLE,
    advise,
    compute,
    numbers,
    outputs,
    samples,
    steady,
    turn,
)
from sweep.effects.turn import reduction_outputs
from sweep.families.base import Array

SUFFIX = "_friction"
OUTPUTS = outputs(SUFFIX, f"{OF_CONSTANT_MEAN}, friction included")
PER_TURN = numbers(SUFFIX, ", friction included")
# Friction grows with the loads, and these with the speed: it is computed again with the speed that it makes.
PASSES = 24
SETTLED = 1e-7  # share of the largest torque excess or loss by which the last pass changes the loss


def loss(grid: Scene, slope: Array) -> tuple[Array, Status]:
    """Return the torque on the crank that friction takes, (n, N), at the speed over the turn that it makes,
    and the status.

    The speed is found on a grid of GRIDS[-1] poses: what that misses of it changes the loss by as small a share.  Where
    that grid resolves no steady state, the speed is found on the whole grid.
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
    """Return the loss on the grid at a speed that is found on a coarse one, the status, NOT_CONVERGED where the loss
    does not settle, and what the last search for a steady state said.
    """
    inertia, excess = samples(coarse)
    mean, motor = grid.inputs["speed"], slope if slope.any() else None
    status = np.zeros(len(grid.designs), np.uint8)
    even = np.broadcast_to(mean[:, None], coarse.shape)
    lost = _lost(coarse, even, np.zeros(coarse.shape), status)
    phi = coarse.angles.phi
    for _ in range(PASSES):
        before = lost
        turning, change, code = _turning(inertia, excess - lost, mean, motor, phi)
        lost = _lost(coarse, turning, change, status)
        size = np.maximum(np.abs(excess).max(axis=1), np.abs(lost).max(axis=1))
        moved: NDArray[np.bool_] = np.asarray(np.abs(lost - before).max(axis=1) > SETTLED * size)
        if not moved.any():
            break
    take_over(status, np.where(moved & (code == st.OK), st.NOT_CONVERGED, code))
    if coarse is not grid:
        turning, change, code = _turning(inertia, excess - lost, mean, motor, grid.angles.phi)
        take_over(status, code)
        lost = _lost(grid, turning, change, status)
    return lost, status, code


def _turning(
    inertia: Array, excess: Array, mean: Array, motor: Array | None, phi: Array
) -> tuple[Array, Array, Status]:
    """Return the speed and acceleration over the turn, and the status; without a steady state the turning is even."""
    found, status = steady(inertia, excess, mean, motor, phi, LEFT)
    usable = np.logical_and.reduce(np.isfinite(found["crank_speed"]), axis=1, keepdims=True)
    speed = np.where(usable, found["crank_speed"], mean[:, None])
    return speed, np.where(usable, found["crank_acceleration"], 0.0), status


def _lost(grid: Scene, speed: Array, change: Array, status: Status) -> Array:
    """Return the driving torque with friction minus that without, where the crank turns like this;
    ``status`` is worsened.
    """
    turning = Scene(
        grid.family, grid.designs, grid.angles, grid.inputs, grid.after, curves=grid.curves, uneven=(speed, change)
    )
    rubbing = computed(turning, FRICTION, frozenset({"drive_torque_friction"}))
    smooth = computed(turning, LOADS, frozenset({"drive_torque"}))
    worst = np.asarray(rubbing["status"], np.uint8).max(axis=1)
    np.copyto(status, worst, where=status == st.OK)
    with_friction = np.asarray(rubbing["drive_torque_friction"], np.float64)
    return with_friction - np.asarray(smooth["drive_torque"], np.float64)


def _effect(bare: Effect, rubbing: Effect) -> Effect:
    return Effect(
        key="D4, D2",
        name=f"{bare.name}_friction",
        title=bare.title.replace(TITLE, f"{TITLE}, friction included"),
        equation="D4 (1)-(5)",
        formulas=(*FORMULAS, "(5) friction takes drive_torque_friction - drive_torque, both at omega(phi), eps(phi)"),
        followers=bare.followers,
        requires=bare.requires,
        tree=bare.tree,
        needs=(bare.name, rubbing.name),
        inputs=(*rubbing.inputs, FLYWHEEL, MOTOR),
        tool_inputs=bare.tool_inputs,
        outputs=OUTPUTS,
        compute=partial(compute, loss=loss, suffix=SUFFIX),
        called_for="unevenness of a drive whose joints rub",
        negligible="friction takes less than a tenth of the torque",
        whole_turn=True,
        even_crank=True,
        takes_load=FRICTION,
        design_result=DesignResult(
            (*PER_TURN, *reduction_outputs(OUTPUTS)), partial(turn, loss=loss, suffix=SUFFIX), block=8
        ),
        advise=advise,
    )


def of_tree(name: str) -> Effect:
    """Return the entry of a family with a tree of links."""
    return _effect(speed.of_tree(name), link_friction.friction_of(name))


EFFECT = _effect(speed.EFFECT, friction.EFFECT)
SLIDER = _effect(speed.SLIDER, friction.SLIDER)
