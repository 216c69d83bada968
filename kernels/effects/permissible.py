"""B1: utilisation of the rocker's bearings, and the radial pressure angle that they permit.

At a given axial angle theta2 the loads grow with the radial angle theta1.  The permissible theta1 is the first at which
the utilisation passes 1.  Utilisation is the largest mean pressure, or equivalent load, over its
permissible value; it is infinite where friction locks.
"""

from __future__ import annotations

import math
from typing import Any

from kernels import status as st
from kernels.effects.bearings import equivalent_load, in_plane, sliding_criteria, sliding_data, support_arms
from kernels.jit import inline, kernel
from kernels.types import EPS, Array, Status

# Mean pressures rise with theta1 everywhere: one bracket is enough.  An equivalent load rises on both sides of a step.
BEFORE = 1.0 - 1e-12  # share of tan(theta1/2) at the step, where the first formula surely holds
STEPS = 100


@inline
def sliding_utilisation(
    bearings: Array, limits: Array, i: int, moment: float, cos1: float, sin1: float, axial: float
) -> float:
    """Largest mean pressure of journals and collar over its permissible value; inf where friction locks."""
    r = sliding_criteria(sliding_data(bearings, i), moment, cos1, sin1, axial)
    worst = max(r.p1 / limits[i, 0], max(r.p2 / limits[i, 1], r.p3 / limits[i, 2]))
    return worst if r.arm > 0.0 else math.inf


@inline
def rolling_utilisation(
    bearings: Array, limits: Array, i: int, moment: float, cos1: float, sin1: float, axial: float
) -> float:
    """Larger equivalent load of the two bearings over the permissible one; inf where no torque passes."""
    pi1, pi2 = support_arms(bearings[i, 0], bearings[i, 1], bearings[i, 2], cos1, sin1, axial)
    force = moment / (bearings[i, 0] * cos1)
    per_span = force / abs(bearings[i, 2] - bearings[i, 1])
    thrust = abs(force * axial)
    first = equivalent_load(bearings, i, pi1 * per_span, thrust if bearings[i, 10] == 1.0 else 0.0)
    second = equivalent_load(bearings, i, pi2 * per_span, thrust if bearings[i, 10] == 2.0 else 0.0)
    return max(first, second) / limits[i, 0] if cos1 > 0.0 else math.inf


@inline
def _spare(utilisation: Any, bearings: Array, limits: Array, i: int, moment: float, half: float, tan2: float) -> float:
    """Reserve 1/utilisation - 1 at theta1 = 2 arctan(half): nearly linear, and finite where friction locks."""
    per = 1.0 / (1.0 + half * half)
    sin1 = 2.0 * half * per
    used: float = utilisation(bearings, limits, i, moment, (1.0 - half) * (1.0 + half) * per, sin1, sin1 * tan2)
    return 1.0 / used - 1.0


@inline
def _step(bearings: Array, i: int, tan2: float) -> float:
    """Return tan(theta1/2) at which an equivalent load changes to its second formula; 0 if it never does."""
    z1, z2, share = bearings[i, 1], bearings[i, 2], bearings[i, 6] * bearings[i, 3]
    z = z2 if bearings[i, 10] == 1.0 else z1
    rest = (z2 - z1) ** 2 - (share * (bearings[i, 0] + z / tan2)) ** 2 if tan2 != 0.0 else 0.0
    tan1: float = share * abs(z / tan2) / math.sqrt(rest) if rest > 0.0 else 0.0
    return tan1 / (1.0 + math.hypot(1.0, tan1))


@inline
def _first_crossing(
    utilisation: Any, step: float, bearings: Array, limits: Array, i: int, moment: float, tan2: float
) -> float:
    """Largest theta1 from 0 on with utilisation <= 1 all the way; 0 if there is none.  ``step``: see :func:`_step`."""
    # With half = tan(theta1/2) no sine is called; the reserve falls through zero at the crossing.
    low, high, at_high = 0.0, 1.0, -1.0
    at_low = _spare(utilisation, bearings, limits, i, moment, 0.0, tan2)
    if at_low < 0.0:
        return 0.0
    if step > 0.0:
        half = step * BEFORE
        value = _spare(utilisation, bearings, limits, i, moment, half, tan2)
        if value < 0.0:
            high, at_high = half, value
        else:
            low, at_low = half, value
    side, before, half = 0, math.inf, low
    for _ in range(STEPS):
        # Regula falsi that halves the value of an end which stays (Illinois), kept in the bracket.
        half = (low * at_high - high * at_low) / (at_high - at_low)
        if not low < half < high:
            half = 0.5 * (low + high)
        value = _spare(utilisation, bearings, limits, i, moment, half, tan2)
        if value < 0.0:
            high, at_high = half, value
            at_low = 0.5 * at_low if side == -1 else at_low
            side = -1
        else:
            low, at_low = half, value
            at_high = 0.5 * at_high if side == 1 else at_high
            side = 1
        if abs(half - before) <= 2.0 * EPS * half or value == 0.0:
            break
        before = half
    return 2.0 * math.atan(half)


@inline
def _fill(
    utilisation: Any, rolls: bool, direction: tuple[Array, Array, Array], moment: Array, bearings: Array, limits: Array,
    status: Status, used: Array | None, permissible: Array | None, reserve: Array | None,
) -> None:  # fmt: skip
    t_tau, t_rho, t_k = direction
    for i in range(t_tau.shape[0]):
        for j in range(t_tau.shape[1]):
            good = 1.0 if status[i, j] == st.OK else math.nan
            rho, along = t_rho[i, j], t_k[i, j]
            if used is not None:
                cos1, sin1, axial = in_plane(t_tau[i, j], rho, along)
                value = utilisation(bearings, limits, i, moment[i], cos1, sin1, axial)
                if status[i, j] == st.OK and not value < math.inf:
                    status[i, j] = st.JAMMED
                    value = math.nan
                used[i, j] = good * value
            if permissible is not None or reserve is not None:
                # theta2 stands still where there is no radial force; any axial force then permits no radial angle.
                tan2 = along / rho if rho != 0.0 else (math.copysign(1e300, along) if along != 0.0 else 0.0)
                step = _step(bearings, i, tan2) if rolls else 0.0
                limit = _first_crossing(utilisation, step, bearings, limits, i, moment[i], tan2)
                if permissible is not None:
                    permissible[i, j] = good * limit
                if reserve is not None:
                    reserve[i, j] = good * (limit - math.atan2(abs(rho), abs(t_tau[i, j])))


@kernel
def sliding_limits(
    t_tau: Array,
    t_rho: Array,
    t_k: Array,
    moment: Array,
    bearings: Array,
    limits: Array,
    status: Status,
    used: Array | None,
    permissible: Array | None,
    reserve: Array | None,
) -> None:
    """Compute the utilisation of sliding bearings and the radial pressure angle they permit.

    Parameters
    ----------
    t_tau, t_rho, t_k : (n, m) components of the coupler direction at the rocker
    moment : (n,) resisting torque;  bearings : (n, 10) columns of :class:`kernels.effects.bearings.Sliding`
    limits : (n, 3) permissible mean pressures of journal 1, journal 2, collar
    status : (n, m), in and out; JAMMED where ``used`` is asked for and friction leaves no driving arm
    used : (n, m) or None; largest pressure over its permissible value
    permissible : (n, m) or None [rad]; permissible theta1 at the pose's theta2, 0 if even theta1 = 0 is too much
    reserve : (n, m) or None [rad]; permissible minus actual theta1, negative where a bearing is overloaded
    """
    direction = t_tau, t_rho, t_k
    _fill(sliding_utilisation, False, direction, moment, bearings, limits, status, used, permissible, reserve)


@kernel
def rolling_limits(
    t_tau: Array,
    t_rho: Array,
    t_k: Array,
    moment: Array,
    bearings: Array,
    limits: Array,
    status: Status,
    used: Array | None,
    permissible: Array | None,
    reserve: Array | None,
) -> None:
    """Compute the utilisation of rolling bearings and the radial pressure angle they permit.

    As :func:`sliding_limits`, with the (n, 11) columns of the head of :mod:`kernels.effects.bearings` and the
    permissible equivalent load as the one column of ``limits``.
    """
    direction = t_tau, t_rho, t_k
    _fill(rolling_utilisation, True, direction, moment, bearings, limits, status, used, permissible, reserve)
