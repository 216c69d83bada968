"""D4: fluctuation of the crank speed over a turn in the steady state of a drive of constant mean speed.

W is the integral of the excess of torque over the crank angle, less its mean.  The speed is omega = sqrt(2 (E + W)/J).
The constant E follows from the mean speed in time: 2 pi / omega_mean is the integral of d phi / omega, which falls
strictly with E.  The effect needs the whole turn and takes samples on a uniform odd grid.
A motor whose torque falls with the speed is in kernels/effects/motor_line.py.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.curves.periodic import (
    LEVEL,
    coefficients,
    highest_top,
    on_grid,
    series,
    series_at,
    significant,
    tail,
)
from kernels.effects.motor_line import steady_energy
from kernels.jit import inline, kernel
from kernels.types import Array, Status

NEWTON = 60
RESOLVED = 1e-9
FINER = 4  # points per sample before an extreme speed is refined
# The period is summed on FINER times as many angles until E no longer changes; more than MOST mean a near stall.
MOST = 20000
STILL = 1e-12


class Uneven(NamedTuple):
    """Steady state of a crank that turns unevenly.

    Parameters
    ----------
    delta, fastest, slowest, energy : (n,) (max - min)/mean, extremes of omega, the constant E
    missed : (n,) share of the kinetic energy's scale that the highest harmonics of the excess have; under a motor line
        also those of the energy's slope
    speed, acceleration : (n, m) omega and d omega/d t = (1/2) d(omega^2)/d phi
    """

    delta: Array
    fastest: Array
    slowest: Array
    energy: Array
    missed: Array
    speed: Array
    acceleration: Array


@kernel
def speed_fluctuation(
    inertia: Array,
    excess: Array,
    mean_speed: Array,
    phi: Array,
    status: Status,
    found: Uneven,
    coarsest: float = RESOLVED,
    slope: Array | None = None,
) -> None:
    """Compute the steady-state speed, its extremes and the degree of unevenness.

    Parameters
    ----------
    inertia : (n, N) inertia reduced to the crank on the grid 2 pi j / N, N odd
    excess : (n, N) drive minus load torque, reduced to the crank; its mean is removed
    mean_speed : (n,) mean in time [rad/s]
    phi : (n, m) or (1, m), where speed and acceleration are wanted
    status : (n,) out; JAMMED where the machine stalls (no E above -min W), NOT_CONVERGED where N resolves too little,
        NOT_ROTATABLE where a sample is nan, INVALID_INPUT where nothing has inertia
    found : out
    coarsest : share of the kinetic energy's scale that the highest harmonics of the excess may have; above RESOLVED for
        loads that jump, of which no grid resolves all
    slope : (n,) or None; torque that the motor gains per speed it loses, 0 for a constant torque
    """
    n = inertia.shape[1]
    half = (n + 1) // 2
    all_jc, all_js, all_wc, all_ws = np.empty(half), np.empty(half), np.empty(half), np.empty(half)
    all_xc, all_xs = (np.empty(half), np.empty(half)) if slope is not None else (all_wc, all_ws)
    work, turn = np.empty(n), np.empty((4, half))
    fine_j, fine_w, looks = np.empty(FINER * n), np.empty(FINER * n), np.empty((4, FINER * n))
    turning, at = np.empty((4, phi.shape[1])), np.empty((4, phi.shape[1]))
    for i in range(inertia.shape[0]):
        row = i if phi.shape[0] > 1 else 0
        coefficients(inertia[i], turn, all_jc, all_js)
        coefficients(excess[i], turn, all_wc, all_ws)
        # A torque excess far below the inertia torque moves no speed: its noise need not be resolved.
        energy_scale = all_jc[0] * mean_speed[i] * mean_speed[i]
        left = tail(all_wc, all_ws, energy_scale)
        code = _checked(all_jc, all_js, all_wc, left, coarsest)
        all_wc[0], all_ws[0] = 0.0, 0.0
        if slope is not None:
            all_xc[:], all_xs[:] = all_wc, all_ws
        _integrate(all_wc, all_ws)
        count = significant(all_jc, all_js)
        jc, js = all_jc[:count], all_js[:count]
        on_grid(jc, js, looks, fine_j)
        count = significant(all_wc, all_ws)
        wc, ws = all_wc[:count], all_ws[:count]
        on_grid(wc, ws, looks, work)
        on_grid(wc, ws, looks, fine_w)
        e = math.nan
        if code == st.OK:
            e = _energy(inertia[i], work, mean_speed[i], 0.5 * energy_scale)
            e = _settled(jc, js, wc, ws, fine_j, fine_w, mean_speed[i], e, max(STILL, left))
            code = st.OK if math.isfinite(e) else st.JAMMED
        if slope is not None and code == st.OK and slope[i] > 0.0:
            if steady_energy(jc, js, all_xc, all_xs, mean_speed[i], slope[i], e + work[0], max(STILL, left), work):
                coefficients(work, turn, all_wc, all_ws)
                e, all_wc[0] = all_wc[0], 0.0
                # A steep line bends the energy more than the loads do: its slope must be resolved, too.
                left = max(left, _slope_tail(all_wc, all_ws, all_xc, all_xs, energy_scale))
                code = st.NOT_CONVERGED if left > coarsest else st.OK
                count = significant(all_wc, all_ws)
                wc, ws = all_wc[:count], all_ws[:count]
                on_grid(wc, ws, looks, fine_w)
            else:
                code = st.JAMMED
        status[i], found.energy[i], found.missed[i] = code, e, left
        high = _extreme(jc, js, wc, ws, e, 1.0, fine_j, fine_w) if code == st.OK else math.nan
        low = _extreme(jc, js, wc, ws, e, -1.0, fine_j, fine_w) if code == st.OK else math.nan
        found.fastest[i], found.slowest[i], found.delta[i] = high, low, (high - low) / mean_speed[i]
        found.speed[i], found.acceleration[i] = math.nan, math.nan
        if code == st.OK:
            _speeds(phi[row], jc, js, wc, ws, e, turning, at, found.speed[i], found.acceleration[i])


@inline
def _checked(jc: Array, js: Array, wc: Array, left: float, coarsest: float) -> int:
    """Status by the harmonics of inertia and excess; ``left`` is the share of the excess in its highest harmonics."""
    if not math.isfinite(jc[0] + wc[0]):
        return st.NOT_ROTATABLE
    if not jc[0] > 0.0:
        return st.INVALID_INPUT
    return st.NOT_CONVERGED if tail(jc, js, 0.0) > RESOLVED or left > coarsest else st.OK


@inline
def _integrate(c: Array, s: Array) -> None:
    """Integrate a Fourier series without a mean over the crank angle, in place."""
    for k in range(1, c.size):
        c[k], s[k] = -s[k] / k, c[k] / k


@inline
def _slope_tail(c: Array, s: Array, slope_c: Array, slope_s: Array, scale: float) -> float:
    """Share of the scale that the highest harmonics of the series' slope have; its coefficients go to ``slope_...``."""
    for k in range(c.shape[0]):
        slope_c[k], slope_s[k] = k * s[k], -k * c[k]
    return tail(slope_c, slope_s, scale)


@inline
def _speeds(
    phi: Array, jc: Array, js: Array, wc: Array, ws: Array, e: float, turn: Array, at: Array, speed: Array,
    acceleration: Array,
) -> None:  # fmt: skip
    """Compute the speed and d omega/d t at crank angles; ``turn`` and ``at`` are (4, m) scratch."""
    series_at(jc, js, phi, turn, at[0], at[1])
    series_at(wc, ws, phi, turn, at[2], at[3])
    for j in range(phi.size):
        square = 2.0 * (e + at[2, j]) / at[0, j]
        speed[j] = math.sqrt(square)
        acceleration[j] = (at[3, j] - 0.5 * square * at[1, j]) / at[0, j]


@inline
def _settled(
    jc: Array, js: Array, wc: Array, ws: Array, inertia: Array, work: Array, mean_speed: float, e: float, still: float
) -> float:
    """Find E on finer and finer grids until it no longer changes; nan where the machine nearly stands still (stall).

    The slower it gets, the sharper the peak of 1/omega: a grid that resolves J and W may miss it.
    """
    while True:
        new = _energy(inertia, work, mean_speed, e)
        if abs(new - e) <= still * (abs(new) + jc[0] * mean_speed * mean_speed):
            return new
        e, size = new, FINER * work.size
        if size > MOST:
            return math.nan
        inertia, work, looks = np.empty(size), np.empty(size), np.empty((4, size))
        on_grid(jc, js, looks, inertia)
        on_grid(wc, ws, looks, work)


@inline
def _energy(inertia: Array, work: Array, mean_speed: float, e: float) -> float:
    """Find E by Newton's method on the period, from e; E stays above -min W, and is nan where the machine stalls."""
    n, low = work.size, -math.inf
    for j in range(n):
        low = max(low, -work[j])
    if not e > low:
        e = low + 1e-3 * abs(low) + 1e-300
    for _ in range(NEWTON):
        period, slope = 0.0, 0.0
        for j in range(n):
            room = e + work[j]
            slow = math.sqrt(0.5 * inertia[j] / room)
            period += slow
            slope -= 0.5 * slow / room
        # In 1/period^2 the relation is nearly linear in E, so the step is taken there.
        ratio = period / n * mean_speed
        step = 0.5 * (ratio * ratio - 1.0) * period / -slope
        new = e + step
        if new <= low:
            new = 0.5 * (e + low)
        if abs(new - e) <= 1e-15 * abs(new):
            return new
        e = new
        if e - low < 1e-12 * max(abs(low), 1e-300):
            return math.nan
    return e


@inline
def _half_square(phi: float, jc: Array, js: Array, wc: Array, ws: Array, e: float) -> tuple[float, float]:
    """Half the square of the speed, (E + W)/J, and its slope."""
    inertia, inertia1 = series(jc, js, phi)
    work, work1 = series(wc, ws, phi)
    value = (e + work) / inertia
    return value, (work1 - value * inertia1) / inertia


@inline
def _extreme(jc: Array, js: Array, wc: Array, ws: Array, e: float, sign: float, inertia: Array, work: Array) -> float:
    """Find the largest (sign +1) or smallest (-1) speed."""
    samples = sign * (e + work) / inertia
    # an even speed has rounding tops alone
    level = LEVEL * float(np.abs(samples).max())
    return math.sqrt(2.0 * abs(highest_top(_half_square, sign, samples, level, (jc, js, wc, ws, e))[1]))
