"""D2: friction of the two ball joints and the two shaft bearings, by successive approximations.

Dynamics sheet, section 2.1.  Couples follow from the latest reactions, the dyad is solved again with them, and so on;
the reactions are affine in the couples and the couples are norms of reactions, so the iteration contracts for ordinary
lubrication (6-15 passes) and diverges where the linkage jams.  A pass that fails to shrink the correction five times
in a row, or the cap, ends in JAMMED: the last iterate is never given out.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.effects.coupler import orientation
from kernels.effects.kinetostatics import Reactions, inertia_loads, pose_status, solve, store_reactions
from kernels.joints import read
from kernels.vectors import Vector, cross, dot, mix, norm, scale, sub

Array = NDArray[np.float64]
Status = NDArray[np.uint8]

TOLERANCE = 1e-14
PASSES = 200
STALLED = 5


class Friction(NamedTuple):
    """Columns of the friction matrix: coefficients; radii, thrust radii, supports along the shafts [length]."""

    mu_a: float
    mu_b: float
    mu_c: float
    mu_d: float
    r_a: float
    r_b: float
    r_c: float
    r_d: float
    rt_a: float
    rt_d: float
    z_a1: float
    z_a2: float
    z_d1: float
    z_d2: float


@inline
def _columns(friction: Array, i: int) -> Friction:
    return Friction(
        friction[i, 0], friction[i, 1], friction[i, 2], friction[i, 3], friction[i, 4], friction[i, 5], friction[i, 6],
        friction[i, 7], friction[i, 8], friction[i, 9], friction[i, 10], friction[i, 11], friction[i, 12],
        friction[i, 13],
    )  # fmt: skip


@inline
def supports(force: Vector, moment: Vector, axis: Vector, z1: float, z2: float) -> tuple[float, float, float]:
    """Radial loads of the two supports of a shaft and the axial force, from force and moment about the origin of z."""
    axial = dot(force, axis)
    radial = mix(1.0, force, -axial, axis)
    second = scale(1.0 / (z2 - z1), mix(1.0, cross(moment, axis), -z1, radial))
    return norm(sub(radial, second)), norm(second), axial


@inline
def _shaft_torque(mu: float, r: float, rt: float, loads: tuple[float, float, float], speed: float) -> float:
    sign = math.copysign(1.0, speed) if speed != 0.0 else 0.0
    return -sign * mu * (r * (loads[0] + loads[1]) + rt * abs(loads[2]))


@inline
def _unit(a: Vector) -> Vector:
    length = norm(a)
    return scale(1.0 / length, a) if length > 0.0 else a


@kernel
def friction_loads(
    poses: Array,
    designs: Array,
    loads: Array,
    friction: Array,
    construction: int,
    status: Status,
    r_a: Array | None,
    r_b: Array | None,
    r_c: Array | None,
    r_d: Array | None,
    m_a: Array | None,
    m_d: Array | None,
    m_finger: Array | None,
    m_drive: Array | None,
    torque_a: Array | None,
    torque_d: Array | None,
    couple_b: Array | None,
    couple_c: Array | None,
    support_loads: Array | None,
    passes: Array | None,
) -> None:
    """Joint reactions and driving torque with friction.

    Parameters
    ----------
    poses, designs, loads, construction, status, r_a ... m_drive : as in :func:`kernels.effects.kinetostatics`
    friction : (n, 14) columns of :class:`Friction`
    torque_a, torque_d : (n, m) or None; friction torque on the crank about u and on the rocker about k
    couple_b, couple_c : (n, m, 3) or None; friction couples of the ball joints on the coupler
    support_loads : (n, m, 4) or None; radial loads of crank supports 1, 2 and rocker supports 1, 2
    passes : (n, m) or None; passes of the iteration
    status : also JAMMED where the iteration does not contract
    """
    for i in range(poses.shape[0]):
        f = _columns(friction, i)
        for k in range(poses.shape[1]):
            j = read(poses[i, k], designs[i])
            coupler = orientation(j, construction)
            code = pose_status(status[i, k], j, coupler)
            load = inertia_loads(j, coupler, loads[i])
            turn_b = _unit(sub(load.omega2, load.omega1))
            turn_c = _unit(sub(load.omega2, load.omega3))
            speed_a, speed_d = dot(load.omega1, j.u), dot(load.omega3, j.k)
            size_b, size_c, t_d, t_a = 0.0, 0.0, 0.0, 0.0
            r = solve(j, coupler, load, construction, scale(0.0, turn_b), scale(0.0, turn_c), 0.0, 0.0)
            last, stalled, count, converged = math.inf, 0, 0, False
            while code == st.OK and not converged and count < PASSES and stalled < STALLED:
                count += 1
                new_b, new_c = f.mu_b * f.r_b * norm(r.r_b), f.mu_c * f.r_c * norm(r.r_c)
                on_d = supports(r.r_d, r.m_d, j.k, f.z_d1, f.z_d2)
                on_a = supports(r.r_a, r.m_a, j.u, f.z_a1, f.z_a2)
                new_d = _shaft_torque(f.mu_d, f.r_d, f.rt_d, on_d, speed_d)
                new_a = _shaft_torque(f.mu_a, f.r_a, f.rt_a, on_a, speed_a)
                change = _largest_change(new_b, size_b, new_c, size_c, new_d, t_d, new_a, t_a)
                size_b, size_c, t_d, t_a = new_b, new_c, new_d, new_a
                r = solve(j, coupler, load, construction, scale(-size_b, turn_b), scale(-size_c, turn_c), t_d, t_a)
                # The last digits wander: a change at rounding level is convergence, not a stall.
                converged = change <= TOLERANCE or (count > 3 and change < 1e-12 and change >= last)
                stalled = stalled + 1 if change >= last else 0
                last = change
            if code == st.OK and not converged:
                code = st.JAMMED
            status[i, k] = code
            good = 1.0 if code == st.OK else math.nan
            store_reactions(r, good, i, k, r_a, r_b, r_c, r_d, m_a, m_d, m_finger, m_drive)
            if torque_a is not None:
                torque_a[i, k] = good * t_a
            if torque_d is not None:
                torque_d[i, k] = good * t_d
            if couple_b is not None:
                _store(couple_b, i, k, scale(-good * size_b, turn_b))
            if couple_c is not None:
                _store(couple_c, i, k, scale(-good * size_c, turn_c))
            if support_loads is not None:
                _store_supports(support_loads, i, k, good, r, f, j.u, j.k)
            if passes is not None:
                passes[i, k] = count


@inline
def _largest_change(b: float, b0: float, c: float, c0: float, d: float, d0: float, a: float, a0: float) -> float:
    """Largest change of a couple in proportion to that couple."""
    worst = 0.0
    for new, old in ((b, b0), (c, c0), (d, d0), (a, a0)):
        size = max(abs(new), abs(old))
        if size > 0.0:
            worst = max(worst, abs(new - old) / size)
    return worst


@inline
def _store_supports(
    out: Array, i: int, k: int, good: float, r: Reactions, f: Friction, u: Vector, axis: Vector
) -> None:
    on_a = supports(r.r_a, r.m_a, u, f.z_a1, f.z_a2)
    on_d = supports(r.r_d, r.m_d, axis, f.z_d1, f.z_d2)
    out[i, k, 0], out[i, k, 1], out[i, k, 2], out[i, k, 3] = (
        good * on_a[0],
        good * on_a[1],
        good * on_d[0],
        good * on_d[1],
    )


@inline
def _store(out: Array, i: int, k: int, a: Vector) -> None:
    out[i, k, 0], out[i, k, 1], out[i, k, 2] = a[0], a[1], a[2]
