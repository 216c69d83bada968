"""Acceleration of a crank by the balance of torques at each pose, and with friction its extremes over the turn.

With friction the acceleration jumps where a joint reverses: no series of the turn resolves it.  The energy of the turn
has kinks there at most.  So the turn is solved once, and the acceleration searched on panels of single poses.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.types import TWO_PI, Array, Status
from sweep.effects.load_passing import compute_friction, compute_loads
from sweep.effects.scene import Scene
from sweep.families.base import Columns, Output, Turn, floats
from sweep.families.reduction import REDUCTIONS
from sweep.numerics.panel_search import PANELS, CurveValues, Top, climbed, fitted, places
from sweep.numerics.quadrature import integrate
from sweep.numerics.records import Indices, put

NEEDED_NAMES = ("reduced_inertia", "dreduced_inertia", "drive_torque")
NEEDED = frozenset(NEEDED_NAMES)
PASSES = 24  # secants until friction and acceleration of a pose agree
STILL = 2.0**-48  # share of the torques that their rounding may move
UNSETTLED = 1e-9  # share of the torques; a pose whose balance still misses more has no value
EVEN = 2 * PANELS  # first panels of a turn: no place of a jump is known beforehand
TARGET = 1e-8  # relative accuracy of the search where none is asked for


def rubbing_torque(scene: Scene, speed: Array, change: Array, status: Status) -> Array:
    """Compute the driving torque with friction minus that without, at the given speed; update ``status`` (n,)."""
    turning = replace(scene, before=None, uneven=(speed, change), memo={})
    rubbing = compute_friction(turning, frozenset({"drive_torque_friction"}))
    smooth = compute_loads(turning, frozenset({"drive_torque"}))
    worst = np.asarray(rubbing["status"], np.uint8).max(axis=1)
    np.copyto(status, worst, where=status == st.OK)
    with_friction = np.asarray(rubbing["drive_torque_friction"], np.float64)
    return with_friction - np.asarray(smooth["drive_torque"], np.float64)


def balanced(scene: Scene, speed: Array, even: Array, rubs: bool, status: Status) -> Array:
    """Acceleration from the balance of torques at each pose: beside kinks of the loads a Fourier series is inaccurate.

    ``even`` (n,) is the motor's torque at the mean speed.  Friction depends on the acceleration, and secants find both;
    ``status`` (n,) is updated: NOT_CONVERGED where they do not.
    """
    inertia, slope, drive = floats(compute_loads(scene.even(), NEEDED), *NEEDED_NAMES)
    mean, motor, flywheel = (scene.inputs[name][:, None] for name in ("speed", "motor_slope", "flywheel"))
    inertia = inertia + flywheel
    left = even[:, None] - motor * (speed - mean) - drive + 0.5 * slope * (mean * mean - speed * speed)
    change: Array = left / inertia
    if not rubs:
        return change
    size = (np.abs(left) + np.abs(drive)) / inertia
    step, off = np.zeros_like(change), np.ones_like(change)
    for _ in range(PASSES):
        before, off = off, (left - rubbing_torque(scene, speed, change, status)) / inertia - change
        ratio = np.divide(step, before - off, out=np.ones_like(off), where=(step != 0.0) & (before != off))
        step = np.where(np.abs(off) > STILL * size, ratio * off, 0.0)
        if not step.any():
            break
        change = change + step
    settled = np.abs(off) <= UNSETTLED * size
    np.copyto(status, st.NOT_CONVERGED, where=(status == st.OK) & ~settled.all(axis=1))
    return np.where(settled, change, np.nan)


class SteadyTurn(NamedTuple):
    """Steady state of designs on an even grid: energy and its slope, (n, N); motor torque at the mean speed, (n,)."""

    energy: Array
    slope: Array
    even: Array

    def at(self, row: Indices, phi: Array) -> Array:
        """Energy of the designs ``row`` (k,) at angles (k, m), by cubics through the grid."""
        size = self.energy.shape[1]
        step, whole = TWO_PI / size, np.floor(phi * (size / TWO_PI))
        share, here = phi / step - whole, np.mod(whole, size).astype(np.int64)
        after, row = np.mod(here + 1, size), row[:, None]
        rest, low, high = 1.0 - share, self.energy[row, here], self.energy[row, after]
        bent = rest * self.slope[row, here] - share * self.slope[row, after]
        cubic = rest * rest * (1.0 + 2.0 * share) * low + share * share * (3.0 - 2.0 * share) * high
        found: Array = cubic + step * share * rest * bent
        return found


def _curves(scene: Scene, turned: SteadyTurn, status: Status) -> CurveValues:
    """Acceleration of the designs of a scene as curves; jammed poses update the ``status`` (n,) in place."""
    sense, flywheel = np.sign(scene.inputs["speed"])[:, None], scene.inputs["flywheel"][:, None]

    def curves(row: Indices, phi: Array, middle: Array) -> Array:
        posed, each = scene.posed(row, phi), np.zeros(row.size, np.uint8)
        (inertia,) = floats(compute_loads(posed.even(), frozenset(NEEDED_NAMES[:1])), NEEDED_NAMES[0])
        speed = sense[row] * np.sqrt(2.0 * turned.at(row, phi) / (inertia + flywheel[row]))
        found = balanced(posed, speed, turned.even[row], True, each)
        bad = np.flatnonzero((each != st.OK) & (status[row] == st.OK))
        status[row[bad]] = each[bad]
        return found

    return curves


def extremes(
    grid: Scene, steady: tuple[Array, Array, Array], known: Array, of: Output, wanted: frozenset[str], target: float,
    status: Status,
) -> Columns:  # fmt: skip
    """Compute the wanted reductions of the acceleration with friction and their errors, each (n,).

    Parameters
    ----------
    grid, steady : even grid of the turn; on it speed and acceleration of the steady state, (n, N), and the motor's
        torque at the mean speed, (n,)
    known : (n,) error of the steady state as a share of its energy
    of : pose output of the acceleration
    status : (n,) updated: JAMMED where a pose jams, NOT_CONVERGED where panels do not settle
    """
    speed, change, even = steady
    inertia, slope = floats(compute_loads(grid.even(), frozenset(NEEDED_NAMES[:2])), *NEEDED_NAMES[:2])
    inertia = inertia + grid.inputs["flywheel"][:, None]
    turned = SteadyTurn(0.5 * inertia * speed**2, inertia * change + 0.5 * slope * speed**2, even)
    # The motor's mean torque misses over a turn what the energy misses; half its share is missed by the speed.  That is
    # an estimate: a pulse shorter than a sample is missed by more.
    felt = 0.5 * (np.abs(slope) + grid.inputs["motor_slope"][:, None] / np.abs(speed))
    shift = known * ((inertia.mean(axis=1)[:, None] / TWO_PI + felt) * speed**2 / inertia).max(axis=1)
    curves = _curves(grid, turned, status)
    edges = np.tile(np.linspace(0.0, TWO_PI, EVEN + 1), (len(speed), 1))
    row, low, high = np.repeat(np.arange(len(speed)), EVEN), edges[:, :-1].ravel(), edges[:, 1:].ravel()
    values = curves(row, places(low, high), low[:, None])
    tops: dict[int, Top] = {}
    columns: Columns = {}
    for reduction in REDUCTIONS:
        name = reduction.output(of, Turn()).name
        if name not in wanted:
            continue
        for mode in reduction.modes:
            if mode not in tops:
                top, size = climbed(curves, fitted(row, low, high, values, mode), len(speed), mode, target, True)
                tops[mode] = Top(np.arange(len(speed)), *np.full((4, len(speed)), np.nan))
                put(tops[mode], top.row, top)
                late = tops[mode].err > np.maximum(target * size, shift)
                status[late & (status == st.OK)] = st.NOT_CONVERGED
        ends = [tops[mode] for mode in reduction.modes]
        if reduction.place:
            columns |= {name: np.mod(ends[0].phi, TWO_PI), f"err_{name}": ends[0].err_phi + np.sqrt(known)}
        elif ends:
            value, err = np.sum([[top.value, top.err + shift] for top in ends], axis=0)
            columns |= {name: -value if reduction.modes == (-1,) else value, f"err_{name}": err}
        else:
            squares = integrate(lambda row, _, phi: curves(row, phi, phi)[:, :, None] ** 2, edges, 2.0 * target)
            mean = np.sqrt(squares.value[:, 0] / TWO_PI)
            off = 0.5 * squares.err[:, 0] / (TWO_PI * mean)
            status[~squares.settled & (off > shift) & (status == st.OK)] = st.NOT_CONVERGED
            columns |= {name: mean, f"err_{name}": off + shift}
    failed = (status != st.OK) & (status != st.NOT_CONVERGED)
    return {name: np.where(failed, np.nan, column) for name, column in columns.items()}
