"""D4 with a motor line: kinetic energy over the turn of a drive whose motor torque falls with the speed.

Near the mean speed the torque of a motor is M + slope (mean speed - omega).  With T = J omega^2/2 and the excess X of
loads and weights, its mean removed,

    dT/dphi = X + M - slope (omega - mean speed),     omega = sqrt(2 T/J)

The energy is periodic and the mean speed in time is given: two conditions for T(0) and M, found by shooting with
Newton's method; the derivatives are integrated too.  A motor line damps, so the solution is unique and Newton's method
starts from that of constant torque.  The integration is Runge and Kutta's of fourth order, with steps that follow the
motor's time constant, halved until the energy no longer changes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels.curves.periodic import on_grid
from kernels.jit import inline, kernel
from kernels.types import Array

NEWTON = 40
LARGEST_STEP = 2.0 * math.pi / 256
OF_TIME_CONSTANT = 0.1  # step over the motor's time constant
MOST_STEPS = 1 << 17


class Drive(NamedTuple):
    """Inertia and torque excess at 2 N angles of a turn, mean speed and slope of the motor line."""

    inertia: Array
    excess: Array
    mean_speed: float
    slope: float


class March(NamedTuple):
    """Energy and time at an angle, each with its derivatives by T(0) and M; or the slopes of all six."""

    energy: float
    energy_start: float
    energy_torque: float
    time: float
    time_start: float
    time_torque: float


@kernel
def steady_energy(
    jc: Array,
    js: Array,
    xc: Array,
    xs: Array,
    mean_speed: float,
    slope: float,
    start: float,
    still: float,
    energy: Array,
) -> bool:
    """Compute the kinetic energy in the steady state; false where the machine stalls or the motor is too stiff.

    Parameters
    ----------
    jc, js, xc, xs : Fourier coefficients of the reduced inertia and of the torque excess without its mean
    mean_speed : mean in time [rad/s];  slope : of the motor line, positive [torque per speed]
    start : energy at phi = 0 to begin with
    still : share of J omega_mean^2 by which halving the steps may still change the energy at phi = 0
    energy : (N,) out, T at 2 pi j / N
    """
    size, scale = energy.size, jc[0] * mean_speed * mean_speed
    step = min(LARGEST_STEP, OF_TIME_CONSTANT * jc[0] * mean_speed / slope)
    between = max(1, math.ceil(2.0 * math.pi / (step * size)))
    torque, last = 0.0, math.inf
    while between * size <= MOST_STEPS:
        points = 2 * between * size
        inertia, excess, room = np.empty(points), np.empty(points), np.empty((4, points))
        on_grid(jc, js, room, inertia)
        on_grid(xc, xs, room, excess)
        drive = Drive(inertia, excess, mean_speed, slope)
        start, torque = _shoot(drive, scale, start, torque, between, energy)
        if not math.isfinite(start):
            return False
        if abs(start - last) <= still * scale:
            return True
        last = start
        between *= 2
    return False


@inline
def _shoot(drive: Drive, scale: float, start: float, torque: float, between: int, energy: Array) -> tuple[float, float]:
    """Find T(0) and M of the periodic solution with the given mean speed; nan where Newton's method finds none."""
    wanted = 2.0 * math.pi / drive.mean_speed
    for _ in range(NEWTON):
        end = _march(drive, start, torque, between, energy)
        if not math.isfinite(end.energy + end.time):
            return math.nan, math.nan
        # [energy_start - 1, energy_torque; time_start, time_torque] (change of T, change of M)
        # = -(end - start, time - wanted)
        first, second, by_start = start - end.energy, wanted - end.time, end.energy_start - 1.0
        det = by_start * end.time_torque - end.energy_torque * end.time_start
        more_start = (first * end.time_torque - end.energy_torque * second) / det
        more_torque = (by_start * second - end.time_start * first) / det
        # The energy must stay positive: never more than half of it is taken away at once.
        share = 1.0 if start + more_start > 0.5 * start else -0.5 * start / more_start
        start, torque = start + share * more_start, torque + share * more_torque
        if share == 1.0 and abs(more_start) <= 1e-14 * scale and abs(more_torque) <= 1e-13 * scale:
            return start, torque
    # The last digits fluctuate; a correction that is still large after all steps means no solution.
    near = abs(more_start) <= 1e-10 * scale and abs(more_torque) <= 1e-10 * scale
    return (start, torque) if near else (math.nan, math.nan)


@inline
def _march(drive: Drive, start: float, torque: float, between: int, energy: Array) -> March:
    """Integrate one turn: energy and time at its end; the energy is written on the grid."""
    points = drive.inertia.size
    step, at = 4.0 * math.pi / points, March(start, 1.0, 0.0, 0.0, 0.0, 0.0)
    for j in range(0, points, 2):
        if (j >> 1) % between == 0:
            energy[(j >> 1) // between] = at.energy
        one = _rates(drive, j, torque, at)
        two = _rates(drive, j + 1, torque, _moved(at, 0.5 * step, one))
        three = _rates(drive, j + 1, torque, _moved(at, 0.5 * step, two))
        four = _rates(drive, (j + 2) % points, torque, _moved(at, step, three))
        total = _moved(_moved(one, 2.0, _moved(two, 1.0, three)), 1.0, four)
        at = _moved(at, step / 6.0, total)
    return at


@inline
def _moved(at: March, step: float, rates: March) -> March:
    """Return the march moved by a step, or a sum of two rates."""
    return March(
        at.energy + step * rates.energy,
        at.energy_start + step * rates.energy_start,
        at.energy_torque + step * rates.energy_torque,
        at.time + step * rates.time,
        at.time_start + step * rates.time_start,
        at.time_torque + step * rates.time_torque,
    )


@inline
def _rates(drive: Drive, j: int, torque: float, at: March) -> March:
    """Compute the slopes by phi at angle j."""
    inertia, slope = drive.inertia[j], drive.slope
    if not at.energy > 0.0:
        return March(math.nan, math.nan, math.nan, math.nan, math.nan, math.nan)
    omega = math.sqrt(2.0 * at.energy / inertia)
    per_energy = 1.0 / (inertia * omega)
    damped, slower = -slope * per_energy, -per_energy / (omega * omega)
    return March(
        drive.excess[j] + torque - slope * (omega - drive.mean_speed),
        damped * at.energy_start,
        1.0 + damped * at.energy_torque,
        1.0 / omega,
        slower * at.energy_start,
        slower * at.energy_torque,
    )
