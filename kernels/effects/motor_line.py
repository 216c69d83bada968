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

import numpy as np

from kernels.curves.periodic import on_grid
from kernels.jit import inline, kernel
from kernels.types import Array

NEWTON = 40
LARGEST_STEP = 2.0 * math.pi / 256
OF_TIME_CONSTANT = 0.1  # step over the motor's time constant
MOST_STEPS = 1 << 17


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
        start, torque = _shoot(inertia, excess, mean_speed, slope, scale, start, torque, between, energy)
        if not math.isfinite(start):
            return False
        if abs(start - last) <= still * scale:
            return True
        last = start
        between *= 2
    return False


@inline
def _shoot(
    inertia: Array,
    excess: Array,
    mean_speed: float,
    slope: float,
    scale: float,
    start: float,
    torque: float,
    between: int,
    energy: Array,
) -> tuple[float, float]:
    """Find T(0) and M of the periodic solution with the given mean speed; nan where Newton's method finds none."""
    wanted = 2.0 * math.pi / mean_speed
    for _ in range(NEWTON):
        end, by_start, by_torque, time, time_start, time_torque = _march(
            inertia, excess, mean_speed, slope, start, torque, between, energy
        )
        if not math.isfinite(end + time):
            return math.nan, math.nan
        # [by_start - 1, by_torque; time_start, time_torque] (change of T, change of M) = -(end - start, time - wanted)
        first, second, det = start - end, wanted - time, (by_start - 1.0) * time_torque - by_torque * time_start
        more_start = (first * time_torque - by_torque * second) / det
        more_torque = ((by_start - 1.0) * second - time_start * first) / det
        # The energy must stay positive: never more than half of it is taken away at once.
        share = 1.0 if start + more_start > 0.5 * start else -0.5 * start / more_start
        start, torque = start + share * more_start, torque + share * more_torque
        if share == 1.0 and abs(more_start) <= 1e-14 * scale and abs(more_torque) <= 1e-13 * scale:
            return start, torque
    # The last digits fluctuate; a correction that is still large after all steps means no solution.
    near = abs(more_start) <= 1e-10 * scale and abs(more_torque) <= 1e-10 * scale
    return (start, torque) if near else (math.nan, math.nan)


@inline
def _march(
    inertia: Array,
    excess: Array,
    mean_speed: float,
    slope: float,
    start: float,
    torque: float,
    between: int,
    energy: Array,
) -> tuple[float, float, float, float, float, float]:
    """Integrate one turn: T at its end, its time, and derivatives of both by T(0) and M; T is written on the grid."""
    points = inertia.size
    step = 4.0 * math.pi / points
    t, by_start, by_torque, time, time_start, time_torque = start, 1.0, 0.0, 0.0, 0.0, 0.0
    for j in range(0, points, 2):
        if (j >> 1) % between == 0:
            energy[(j >> 1) // between] = t
        a1, b1, c1, d1, e1, f1 = _rates(inertia[j], excess[j], mean_speed, slope, torque, t, by_start, by_torque)
        h = 0.5 * step
        j2, x2 = inertia[j + 1], excess[j + 1]
        a2, b2, c2, d2, e2, f2 = _rates(
            j2, x2, mean_speed, slope, torque, t + h * a1, by_start + h * b1, by_torque + h * c1
        )
        a3, b3, c3, d3, e3, f3 = _rates(
            j2, x2, mean_speed, slope, torque, t + h * a2, by_start + h * b2, by_torque + h * c2
        )
        j4, x4 = inertia[(j + 2) % points], excess[(j + 2) % points]
        a4, b4, c4, d4, e4, f4 = _rates(
            j4, x4, mean_speed, slope, torque, t + step * a3, by_start + step * b3, by_torque + step * c3
        )
        w = step / 6.0
        t += w * (a1 + 2.0 * (a2 + a3) + a4)
        by_start += w * (b1 + 2.0 * (b2 + b3) + b4)
        by_torque += w * (c1 + 2.0 * (c2 + c3) + c4)
        time += w * (d1 + 2.0 * (d2 + d3) + d4)
        time_start += w * (e1 + 2.0 * (e2 + e3) + e4)
        time_torque += w * (f1 + 2.0 * (f2 + f3) + f4)
    return t, by_start, by_torque, time, time_start, time_torque


@inline
def _rates(
    inertia: float,
    excess: float,
    mean_speed: float,
    slope: float,
    torque: float,
    t: float,
    by_start: float,
    by_torque: float,
) -> tuple[float, float, float, float, float, float]:
    """Compute the slopes by phi of T, its derivatives by T(0) and M, the time and its two derivatives."""
    if not t > 0.0:
        return math.nan, math.nan, math.nan, math.nan, math.nan, math.nan
    omega = math.sqrt(2.0 * t / inertia)
    per_energy = 1.0 / (inertia * omega)
    damped, slower = -slope * per_energy, -per_energy / (omega * omega)
    return (
        excess + torque - slope * (omega - mean_speed),
        damped * by_start,
        1.0 + damped * by_torque,
        1.0 / omega,
        slower * by_start,
        slower * by_torque,
    )
