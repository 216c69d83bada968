"""B1, B2: sliding and rolling bearings of a shaft under its joint reactions, of a rocker under the coupler force.

Polukhin 1971, (15)-(17), with his misprints corrected.  Only the direction of the coupler force enters: its in-plane
part P has the tangential and radial shares cos(theta1), sin(theta1), and ``axial`` = sin(theta1) tan(theta2) is the
axial force in units of P.  The product stays finite where theta2 does not, which is where there is no radial force.

The matrix of a rolling bearing has eleven columns: radius c of the ball joint on the rocker, supports z1 and z2 along
the shaft's axis, rotation factor V, radial factor X, axial factor Y, e, life exponent (3 for balls, 10/3 for rollers),
dynamic load rating C_dyn, shock factor K_b, and 1 or 2 for the support that takes the axial force.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kernels import status as st
from kernels.effects.friction import supports
from kernels.jit import inline, kernel
from kernels.linkage.bodies import vector
from kernels.types import Array, Status


class Sliding(NamedTuple):
    """Columns of the sliding-bearing matrix [length, -]; r_t is the mean thrust radius of the collar."""

    c: float  # radius of the ball joint on the rocker
    z1: float  # supports along the rocker axis, rocker plane at zero
    z2: float
    d: float  # journal diameter
    l1: float  # journal lengths
    l2: float
    d0: float  # collar diameter
    kj: float  # journal factor: 1 point contact, 4/pi run-in, pi/2 new
    rt: float
    mu: float


class Criteria(NamedTuple):
    """Arms, coupler force, support forces, mean pressures for one direction of the coupler force."""

    arm: float
    force: float
    r1: float
    r2: float
    axial: float
    p1: float
    p2: float
    p3: float


@inline
def sliding_data(data: Array, i: int) -> Sliding:
    """Row of the sliding-bearing matrix."""
    return Sliding(
        data[i, 0], data[i, 1], data[i, 2], data[i, 3], data[i, 4], data[i, 5], data[i, 6], data[i, 7], data[i, 8],
        data[i, 9],
    )  # fmt: skip


@inline
def in_plane(t_tau: float, t_rho: float, t_k: float) -> tuple[float, float, float]:
    """Return cos(theta1), sin(theta1) and sin(theta1) tan(theta2) of a coupler direction."""
    size = math.hypot(t_tau, t_rho)
    return abs(t_tau) / size, t_rho / size, t_k / size


@inline
def support_arms(c: float, z1: float, z2: float, cos1: float, sin1: float, axial: float) -> tuple[float, float]:
    """Compute Pi_1 and Pi_2, support forces times their distance per unit of P; the axial force acts at radius c."""
    return math.hypot(z2 * cos1, z2 * sin1 + c * axial), math.hypot(z1 * cos1, z1 * sin1 + c * axial)


@inline
def sliding_criteria(s: Sliding, moment: float, cos1: float, sin1: float, axial: float) -> Criteria:
    """Evaluate (15)-(17): support forces and mean pressures while the rocker overcomes ``moment``; arm <= 0 locks."""
    pi1, pi2 = support_arms(s.c, s.z1, s.z2, cos1, sin1, axial)
    span = abs(s.z2 - s.z1)
    arm = s.c * cos1 - s.mu * (0.5 * s.kj * s.d * (pi1 + pi2) / span + s.rt * abs(axial))
    force = moment / arm
    r1, r2, x = force * pi1 / span, force * pi2 / span, force * axial
    p1, p2, p3 = mean_pressures(r1, r2, x, s.d, s.l1, s.l2, s.d0)
    return Criteria(arm, force, r1, r2, x, p1, p2, p3)


@inline
def mean_pressures(
    r1: float, r2: float, axial: float, d: float, l1: float, l2: float, d0: float
) -> tuple[float, float, float]:
    """Mean pressures of two journals, diameter ``d``, lengths ``l1`` and ``l2``, of a collar up to ``d0``."""
    return r1 / (d * l1), r2 / (d * l2), 4.0 * abs(axial) / (math.pi * (d0 - d) * (d0 + d))


@kernel
def sliding_bearings(
    t_tau: Array,
    t_rho: Array,
    t_k: Array,
    moment: Array,
    bearings: Array,
    status: Status,
    out: Array,
) -> None:
    """Compute support forces and mean pressures of two journals and a collar, massless estimate.

    Parameters
    ----------
    t_tau, t_rho, t_k : (n, m) components of the coupler direction at the rocker
    moment : (n,) resisting torque M_c on the rocker
    bearings : (n, 10) columns of :class:`Sliding`
    status : (n, m), in and out; JAMMED where friction leaves no driving arm
    out : (6, n, m); radial forces of the supports, axial force, mean pressures of the journals and the collar
    """
    for i in range(t_tau.shape[0]):
        data = sliding_data(bearings, i)
        for j in range(t_tau.shape[1]):
            cos1, sin1, axial = in_plane(t_tau[i, j], t_rho[i, j], t_k[i, j])
            r = sliding_criteria(data, moment[i], cos1, sin1, axial)
            if status[i, j] == st.OK and not r.arm > 0.0:
                status[i, j] = st.JAMMED
            good = 1.0 if status[i, j] == st.OK else math.nan
            out[0, i, j], out[1, i, j], out[2, i, j] = good * r.r1, good * r.r2, good * r.axial
            out[3, i, j], out[4, i, j], out[5, i, j] = good * r.p1, good * r.p2, good * r.p3


@inline
def rolling_loads(
    bearings: Array, i: int, moment: float, cos1: float, sin1: float, axial: float
) -> tuple[float, float]:
    """Equivalent loads of two rolling bearings while the rocker overcomes ``moment`` without friction."""
    pi1, pi2 = support_arms(bearings[i, 0], bearings[i, 1], bearings[i, 2], cos1, sin1, axial)
    force = abs(moment / (bearings[i, 0] * cos1))
    thrust, span = force * abs(axial), abs(bearings[i, 2] - bearings[i, 1])
    first = equivalent_load(bearings, i, force * pi1 / span, thrust if bearings[i, 10] == 1.0 else 0.0)
    second = equivalent_load(bearings, i, force * pi2 / span, thrust if bearings[i, 10] == 2.0 else 0.0)
    return first, second


@kernel
def rolling_bearings(
    t_tau: Array,
    t_rho: Array,
    t_k: Array,
    moment: Array,
    bearings: Array,
    status: Status,
    out: Array,
) -> None:
    """Compute equivalent loads and L10 lives [10^6 turns] of two rolling bearings, frictionless support forces.

    Parameters
    ----------
    t_tau, t_rho, t_k : (n, m) components of the coupler direction at the rocker
    moment : (n,) resisting torque on the rocker
    bearings : (n, 11), matrix of the rolling bearings, as at the head of this file
    status : (n, m), in and out; JAMMED at cos(theta1) <= 0
    out : (4, n, m); equivalent loads and lives of both bearings
    """
    for i in range(t_tau.shape[0]):
        for j in range(t_tau.shape[1]):
            cos1, sin1, axial = in_plane(t_tau[i, j], t_rho[i, j], t_k[i, j])
            if status[i, j] == st.OK and not cos1 > 0.0:
                status[i, j] = st.JAMMED
            good = 1.0 if status[i, j] == st.OK else math.nan
            first, second = rolling_loads(bearings, i, moment[i], cos1, sin1, axial)
            out[0, i, j], out[1, i, j] = good * first, good * second
            out[2, i, j] = good * (bearings[i, 8] / first) ** bearings[i, 7]
            out[3, i, j] = good * (bearings[i, 8] / second) ** bearings[i, 7]


@inline
def equivalent_load(bearings: Array, i: int, radial: float, thrust: float) -> float:
    """Dynamic equivalent load of a rolling bearing: K_b (V R) or K_b (X V R + Y F_a)."""
    v, x, y, e_limit, shock = bearings[i, 3], bearings[i, 4], bearings[i, 5], bearings[i, 6], bearings[i, 9]
    load: float = v * radial if thrust <= e_limit * v * radial else x * v * radial + y * thrust
    return float(shock * load)


@kernel
def bearing_loads(
    forces: Array,
    force: int,
    moment: int,
    axis: Array,
    bearings: Array,
    status: Status,
    out: Array,
) -> None:
    """Compute loads of two bearings that carry the force and the moment on a shaft.

    Parameters
    ----------
    forces : (n, m, F) joint reactions;  force, moment : columns of the force on the shaft and of its moment
    axis : (n, m or 1, 3) axis of the shaft
    bearings : (n, 11), matrix of the rolling bearings, as at the head of this file; c is not read
    status : (n, m), in; nan where it is not OK
    out : (5, n, m); radial loads of both, axial load, equivalent loads of both
    """
    for i in range(forces.shape[0]):
        for j in range(forces.shape[1]):
            k = vector(axis[i, j if axis.shape[1] > 1 else 0])
            f, m = vector(forces[i, j, force:]), vector(forces[i, j, moment:])
            first, second, along = supports(f, m, k, bearings[i, 1], bearings[i, 2])
            good = 1.0 if status[i, j] == st.OK else math.nan
            on_first, on_second = (abs(along), 0.0) if bearings[i, 10] == 1.0 else (0.0, abs(along))
            out[0, i, j], out[1, i, j], out[2, i, j] = good * first, good * second, good * along
            out[3, i, j] = good * equivalent_load(bearings, i, first, on_first)
            out[4, i, j] = good * equivalent_load(bearings, i, second, on_second)


@kernel
def journal_pressures(
    first: Array,
    second: Array,
    axial: Array,
    journals: Array,
    limits: Array,
    status: Status,
    out: Array,
) -> None:
    """Compute mean pressures of two journals and a collar, and the largest one over its permissible value.

    Parameters
    ----------
    first, second, axial : (n, m) loads of the journals and of the collar
    journals : (n, 4) diameter, lengths of journal 1 and 2, diameter of the collar; 0 for a shaft without one
    limits : (n, 3); permissible pressures of journal 1, journal 2, collar; 0 where the share is not wanted
    status : (n, m), in; nan where it is not OK
    out : (4, n, m); pressures of the journals and the collar, the largest one over its permissible value
    """
    for i in range(first.shape[0]):
        for j in range(first.shape[1]):
            good = 1.0 if status[i, j] == st.OK else math.nan
            collar = journals[i, 3] > 0.0
            outer = journals[i, 3] if collar else 2.0 * journals[i, 0]
            p1, p2, p3 = mean_pressures(
                first[i, j], second[i, j], axial[i, j] if collar else 0.0, journals[i, 0], journals[i, 1],
                journals[i, 2], outer,
            )  # fmt: skip
            share = max(p1 / limits[i, 0], p2 / limits[i, 1])
            out[0, i, j], out[1, i, j], out[2, i, j] = good * p1, good * p2, good * p3
            out[3, i, j] = good * (max(share, p3 / limits[i, 2]) if collar else share)
