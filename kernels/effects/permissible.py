"""B1: utilisation of the rocker's bearings, and the radial pressure angle that they permit.

At a given axial angle theta2 the loads grow with the radial angle theta1.  The permissible theta1 is the first at which
the utilisation passes 1.  Utilisation is the largest mean pressure, or equivalent load, over its
permissible value; it is infinite where friction locks.
"""

from __future__ import annotations

import math

from kernels import status as st
from kernels.curves.root_search import false_position
from kernels.effects.bearings import in_plane, rolling_loads, sliding_criteria, sliding_data
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write
from kernels.types import Array, Status

# Mean pressures rise with theta1 everywhere: one bracket is enough.  An equivalent load rises on both sides of a step.
ROLLING = 11  # columns of a rolling bearing; a sliding one has ten
BEFORE = 1.0 - 1e-12  # share of tan(theta1/2) at the step, where the first formula surely holds


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
    first, second = rolling_loads(bearings, i, moment, cos1, sin1, axial)
    return max(first, second) / limits[i, 0] if cos1 > 0.0 else math.inf


@inline
def _utilisation(
    bearings: Array, limits: Array, i: int, moment: float, cos1: float, sin1: float, axial: float
) -> float:
    if bearings.shape[1] == ROLLING:
        return rolling_utilisation(bearings, limits, i, moment, cos1, sin1, axial)
    return sliding_utilisation(bearings, limits, i, moment, cos1, sin1, axial)


@inline
def _spare(half: float, bearings: Array, limits: Array, i: int, moment: float, tan2: float) -> float:
    """Reserve 1/utilisation - 1 at theta1 = 2 arctan(half): nearly linear, and finite where friction locks."""
    per = 1.0 / (1.0 + half * half)
    sin1 = 2.0 * half * per
    used = _utilisation(bearings, limits, i, moment, (1.0 - half) * (1.0 + half) * per, sin1, sin1 * tan2)
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
def _first_crossing(step: float, bearings: Array, limits: Array, i: int, moment: float, tan2: float) -> float:
    """Largest theta1 from 0 on with utilisation <= 1 all the way; 0 if there is none.  ``step``: see :func:`_step`."""
    # With half = tan(theta1/2) no sine is called; the reserve falls through zero at the crossing.
    low, high, at_high = 0.0, 1.0, -1.0
    at_low = _spare(0.0, bearings, limits, i, moment, tan2)
    if at_low < 0.0:
        return 0.0
    if step > 0.0:
        before = step * BEFORE
        value = _spare(before, bearings, limits, i, moment, tan2)
        if value < 0.0:
            high, at_high = before, value
        else:
            low, at_low = before, value
    half = false_position(_spare, low, high, at_low, at_high, bearings, limits, i, moment, tan2)
    return 2.0 * math.atan(half)


@kernel
def bearing_limits(
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
    """Compute the utilisation of sliding or rolling bearings and the radial pressure angle they permit.

    Parameters
    ----------
    t_tau, t_rho, t_k : (n, m) components of the coupler direction at the rocker
    moment : (n,) resisting torque
    bearings : (n, 10) columns of :class:`kernels.effects.bearings.Sliding`, or (n, 11) of a rolling bearing as at the
        head of :mod:`kernels.effects.bearings`
    limits : (n, 3) permissible mean pressures of journal 1, journal 2, collar, or (n, 1) permissible equivalent load
    status : (n, m), in and out; JAMMED where ``used`` is asked for and friction leaves no driving arm
    used : (n, m) or None; largest pressure, or equivalent load, over its permissible value
    permissible : (n, m) or None [rad]; permissible theta1 at the pose's theta2, 0 if even theta1 = 0 is too much
    reserve : (n, m) or None [rad]; permissible minus actual theta1, negative where a bearing is overloaded
    """
    for i in range(t_tau.shape[0]):
        for j in range(t_tau.shape[1]):
            good = 1.0 if status[i, j] == st.OK else math.nan
            rho, along = t_rho[i, j], t_k[i, j]
            if used is not None:
                cos1, sin1, axial = in_plane(t_tau[i, j], rho, along)
                value = _utilisation(bearings, limits, i, moment[i], cos1, sin1, axial)
                if status[i, j] == st.OK and not value < math.inf:
                    status[i, j] = st.JAMMED
                    value = math.nan
                used[i, j] = good * value
            if permissible is not None or reserve is not None:
                # theta2 stands still where there is no radial force; any axial force then permits no radial angle.
                tan2 = along / rho if rho != 0.0 else (math.copysign(1e300, along) if along != 0.0 else 0.0)
                step = _step(bearings, i, tan2) if bearings.shape[1] == ROLLING else 0.0
                limit = _first_crossing(step, bearings, limits, i, moment[i], tan2)
                write(permissible, i, j, good * limit)
                write(reserve, i, j, good * (limit - math.atan2(abs(rho), abs(t_tau[i, j]))))
