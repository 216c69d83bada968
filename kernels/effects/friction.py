"""D2: friction of the two ball joints and the two shaft bearings, by successive approximations.

Dynamics sheet, section 2.1.  Couples follow from the latest reactions, the dyad is solved again with them, and so on;
the reactions are affine in the couples and the couples are norms of reactions, so the iteration contracts for ordinary
lubrication (6-15 passes) and diverges where the linkage jams.  A pass that fails to shrink the correction five times
in a row, or the cap, ends in JAMMED: the last iterate is never given out.

As the reactions are affine, the answers to the three couples (B, C, rocker shaft) are found once per pose and a pass is
a sum of four vectors.  Their norms bound the contraction: rho(L) < 1 proves a unique solution.
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
    contraction: Array | None,
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
    contraction : (n, m) or None; rho(L), below 1 the solution is proven unique; known also where the iteration jams
    status : also JAMMED where the iteration does not contract
    """
    answers, matrix = np.empty((3, 12)), np.empty((3, 3))
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
            none = scale(0.0, turn_b)
            # Unit couples of the size that the frictionless reactions make.
            base = solve(j, coupler, load, construction, none, none, 0.0, 0.0)
            unit_b, unit_c = f.mu_b * f.r_b * norm(base.r_b), f.mu_c * f.r_c * norm(base.r_c)
            on_d = supports(base.r_d, base.m_d, j.k, f.z_d1, f.z_d2)
            unit_d = _shaft_torque(f.mu_d, f.r_d, f.rt_d, on_d, speed_d)
            for which in range(3):
                e_b = scale(-unit_b if which == 0 else 0.0, turn_b)
                e_c = scale(-unit_c if which == 1 else 0.0, turn_c)
                r = solve(j, coupler, load, construction, e_b, e_c, unit_d if which == 2 else 0.0, 0.0)
                _remember(answers, which, r, base)
            size_b, size_c, t_d, t_a = unit_b, unit_c, unit_d, 0.0
            last, stalled, count, converged = math.inf, 0, 0, False
            while code == st.OK and not converged and count < PASSES and stalled < STALLED:
                count += 1
                x = _share(size_b, unit_b)
                y = _share(size_c, unit_c)
                z = _share(t_d, unit_d)
                new_b = f.mu_b * f.r_b * norm(_answer(answers, 0, base.r_b, x, y, z))
                new_c = f.mu_c * f.r_c * norm(_answer(answers, 3, base.r_c, x, y, z))
                force_d = _answer(answers, 6, base.r_d, x, y, z)
                moment_d = _answer(answers, 9, base.m_d, x, y, z)
                on_d = supports(force_d, moment_d, j.k, f.z_d1, f.z_d2)
                new_d = _shaft_torque(f.mu_d, f.r_d, f.rt_d, on_d, speed_d)
                change = _largest_change(new_b, size_b, new_c, size_c, new_d, t_d)
                size_b, size_c, t_d = new_b, new_c, new_d
                # The last digits wander: a change at rounding level is convergence, not a stall.
                converged = change <= TOLERANCE or (count > 3 and change < 1e-12 and change >= last)
                stalled = stalled + 1 if change >= last else 0
                last = change
            if code == st.OK and not converged:
                code = st.JAMMED
            # The crank's bearing feeds nothing back: its torque follows from the reactions with the other three.
            for round_ in range(2):
                r = solve(j, coupler, load, construction, scale(-size_b, turn_b), scale(-size_c, turn_c), t_d, t_a)
                if round_ == 0:
                    on_a = supports(r.r_a, r.m_a, j.u, f.z_a1, f.z_a2)
                    t_a = _shaft_torque(f.mu_a, f.r_a, f.rt_a, on_a, speed_a)
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
                passes[i, k] = good * count
            if contraction is not None:
                known = code == st.OK or code == st.JAMMED
                contraction[i, k] = _contraction(answers, matrix, f, j.k, unit_b, unit_c, unit_d) if known else math.nan


@inline
def _remember(answers: Array, which: int, r: Reactions, base: Reactions) -> None:
    """What one unit couple adds to r_b, r_c, r_d and m_d."""
    for k in range(3):
        answers[which, k] = r.r_b[k] - base.r_b[k]
        answers[which, 3 + k] = r.r_c[k] - base.r_c[k]
        answers[which, 6 + k] = r.r_d[k] - base.r_d[k]
        answers[which, 9 + k] = r.m_d[k] - base.m_d[k]


@inline
def _share(size: float, unit: float) -> float:
    return size / unit if unit != 0.0 else 0.0


@inline
def _answer(answers: Array, first: int, base: Vector, x: float, y: float, z: float) -> Vector:
    return (
        base[0] + x * answers[0, first] + y * answers[1, first] + z * answers[2, first],
        base[1] + x * answers[0, first + 1] + y * answers[1, first + 1] + z * answers[2, first + 1],
        base[2] + x * answers[0, first + 2] + y * answers[1, first + 2] + z * answers[2, first + 2],
    )


@inline
def _contraction(answers: Array, m: Array, f: Friction, axis: Vector, b: float, c: float, d: float) -> float:
    """Spectral radius of m = L, L_ij = mu_i r_i |d reaction_i / d couple_j|."""
    zero = (0.0, 0.0, 0.0)
    for which in range(3):
        unit = abs(b) if which == 0 else (abs(c) if which == 1 else abs(d))
        per = 1.0 / unit if unit > 0.0 else 0.0
        x, y, z = (1.0 if which == 0 else 0.0), (1.0 if which == 1 else 0.0), (1.0 if which == 2 else 0.0)
        m[0, which] = per * f.mu_b * f.r_b * norm(_answer(answers, 0, zero, x, y, z))
        m[1, which] = per * f.mu_c * f.r_c * norm(_answer(answers, 3, zero, x, y, z))
        force, moment = _answer(answers, 6, zero, x, y, z), _answer(answers, 9, zero, x, y, z)
        on = supports(force, moment, axis, f.z_d1, f.z_d2)
        m[2, which] = per * f.mu_d * (f.r_d * (on[0] + on[1]) + f.rt_d * abs(on[2]))
    # No entry is negative, so the largest root of the characteristic polynomial is real, no root lies to the right of
    # it, no row sum below it: Newton's method comes down on it from the largest row sum.
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    minors = m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0] + m[0, 0] * m[2, 2] - m[0, 2] * m[2, 0]
    minors += m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1]
    determinant = m[0, 0] * (m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1])
    determinant += m[0, 1] * (m[1, 2] * m[2, 0] - m[1, 0] * m[2, 2])
    determinant += m[0, 2] * (m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0])
    root = 0.0
    for which in range(3):
        root = max(root, m[which, 0] + m[which, 1] + m[which, 2])
    for _ in range(60):
        value = ((root - trace) * root + minors) * root - determinant
        slope = (3.0 * root - 2.0 * trace) * root + minors
        if not (value > 0.0 and slope > 0.0) or value <= 1e-12 * slope * root:
            break
        root -= value / slope
    return root


@inline
def _largest_change(b: float, b0: float, c: float, c0: float, d: float, d0: float) -> float:
    """Largest change of a couple in proportion to that couple."""
    worst = 0.0
    for new, old in ((b, b0), (c, c0), (d, d0)):
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
