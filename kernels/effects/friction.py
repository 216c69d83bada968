"""D2: friction of ball joints, crank shaft and follower's guidance (shaft or way), by successive approximations.

The friction couples follow from the latest reactions, the reactions are solved again with these couples, and so on.
Reactions are linear in the couples, and couples are norms of reactions, so the iteration contracts for ordinary
lubrication (6 to 15 passes) and diverges where the linkage jams.  If five passes in a row do not shrink the correction,
or the largest number of passes is reached, the status is JAMMED; the last iterate is never returned.  Near jamming the
corrections form a slow geometric series, whose remainder is added every tenth pass.

Because the reactions are linear, those to each of the three couples (B, C, guidance) are found once per pose, and a
pass is a sum of four vectors.  Their norms bound the contraction: rho(L) < 1 proves that the solution is unique.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.vectors import Vector, cross, dot, mix, norm, scale, sub
from kernels.effects.coupler import Coupler, orientation
from kernels.effects.kinetostatics import (
    SPEED,
    Loading,
    Loads,
    loads_of,
    pose_status,
    solve,
    store_forces,
)
from kernels.jit import inline, kernel
from kernels.linkage.joints import Joints, read
from kernels.types import EPS, Array, Status

TOLERANCE = 1e-14
ROUNDING = 4.0 * EPS / 1e-12  # share of the largest load to which the change of a small one is compared at least
PASSES = 5000  # a pose that nearly jams converges slowly
STALLED = 5
LEAP = 10  # passes after which the rest of the geometric series is added at once (Aitken)
STRAIGHT = 0.9  # squared cosine of the angle between two steps, below which they are no geometric series
STILL = 2.0**-44  # relative angular velocity of a ball joint below this share of its links' is rounding
ANSWER = 20  # the six vectors of :func:`kernels.effects.kinetostatics.store_forces`, finger couple, driving torque


class Friction(NamedTuple):
    """Columns of the friction matrix: coefficients; radii, thrust radii, supports along the shafts [length].

    Of a slider: r_d = 1, rt_d = 0, its two shoes along its way from C.
    """

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
def _of_moving(f: Friction, load: Loads) -> Friction:
    """Set the friction of a ball joint to zero where its links turn together, since it has no direction there.

    In planar linkages coupler and rocker turn together where the crank points along the frame; their relative speed is
    rounding then.
    """
    size1, size2, size3 = norm(load.omega1), norm(load.omega2), norm(load.omega3)
    at_b = norm(sub(load.omega2, load.omega1)) > STILL * (size1 + size2)
    at_c = norm(sub(load.omega2, load.omega3)) > STILL * (size2 + size3)
    return Friction(
        f.mu_a, f.mu_b if at_b else 0.0, f.mu_c if at_c else 0.0, f.mu_d, f.r_a, f.r_b, f.r_c, f.r_d, f.rt_a, f.rt_d,
        f.z_a1, f.z_a2, f.z_d1, f.z_d2,
    )  # fmt: skip


@inline
def support_forces(force: Vector, moment: Vector, axis: Vector, z1: float, z2: float) -> tuple[Vector, Vector, float]:
    """Compute forces across a shaft on both supports, and the force along it; the moment is about the origin of z."""
    axial = dot(force, axis)
    radial = mix(1.0, force, -axial, axis)
    second = scale(1.0 / (z2 - z1), mix(1.0, cross(moment, axis), -z1, radial))
    return sub(radial, second), second, axial


@inline
def supports(force: Vector, moment: Vector, axis: Vector, z1: float, z2: float) -> tuple[float, float, float]:
    """Radial loads of a shaft's two supports and the axial force; see :func:`support_forces`."""
    first, second, axial = support_forces(force, moment, axis, z1, z2)
    return norm(first), norm(second), axial


@inline
def _shaft_torque(mu: float, r: float, rt: float, loads: tuple[float, float, float], speed: float) -> float:
    sign = math.copysign(1.0, speed) if speed != 0.0 else 0.0
    return -sign * mu * (r * (loads[0] + loads[1]) + rt * abs(loads[2]))


@inline
def unit_vector(a: Vector) -> Vector:
    """Return the unit vector along a vector; zero for a vector without length."""
    length = norm(a)
    return scale(1.0 / length, a) if length > 0.0 else a


@kernel
def friction_loads(
    poses: Array,
    designs: Array,
    finger: Array,
    given: Loading,
    friction: Array,
    status: Status,
    forces: Array | None,
    couples: Array | None,
    losses: Array | None,
    contraction: Array | None,
) -> None:
    """Compute joint reactions and driving torque with friction.

    Parameters
    ----------
    poses, designs, finger, given, status, forces, couples : as in :func:`kernels.effects.kinetostatics`
    friction : (n, 14) columns of :class:`Friction`
    losses : (n, m, 9) or None; friction torque on the crank about u; friction torque on the rocker about k, or force on
        the slider along tau; magnitudes of the friction couples of the ball joints B and C; radial loads of crank
        supports 1, 2 and follower supports 1, 2; passes of the iteration
    contraction : (n, m) or None; rho(L), below 1 the solution is proven unique; known also where the iteration jams
    status : also JAMMED where the iteration does not contract
    """
    answers, total, matrix = np.empty((4, ANSWER)), np.empty(ANSWER), np.empty((3, 3))
    shares, new, steps, weights = np.empty(3), np.empty(3), np.empty(3), np.ones(3)
    for i in range(poses.shape[0]):
        rubbing = _columns(friction, i)
        for k in range(poses.shape[1]):
            j = read(poses[i, k], designs[i])
            coupler = orientation(j, finger[i])
            code = pose_status(status[i, k], j, coupler)
            load = loads_of(j, coupler, given, i, k)
            f = _of_moving(rubbing, load)
            speed_a = given.drive[i, k if given.drive.shape[1] > 1 else 0, SPEED]
            speed_d = speed_a * j.dpsi
            # A rocker turns about k on two supports, a slider moves along tau on two shoes.
            axis = mix(j.turns, j.k, 1.0 - j.turns, j.tau)
            unit = _answers(j, coupler, load, finger[i], f, speed_d, answers)
            passes = settled(_couples, shares, new, steps, weights, answers, f, axis, speed_d, unit, total)
            if code == st.OK and passes < 0:
                code = st.JAMMED
            status[i, k] = code
            good = 1.0 if code == st.OK else math.nan
            # The crank's bearing feeds nothing back: its torque follows from the reactions with the other three.
            _total(answers, shares, total)
            moment_a = (total[12], total[13], total[14])
            on_a = supports((total[0], total[1], total[2]), moment_a, j.u, f.z_a1, f.z_a2)
            t_a = _shaft_torque(f.mu_a, f.r_a, f.rt_a, on_a, speed_a)
            if forces is not None:
                for n in range(18):
                    forces[i, k, n] = good * total[n]
                for n in range(3):
                    forces[i, k, 12 + n] -= t_a * j.u[n]
            if couples is not None:
                couples[i, k, 0] = good * total[18]
                couples[i, k, 1] = good * (total[19] - t_a)
            if losses is not None:
                on = _guidance(total, axis, f)
                losses[i, k, 0], losses[i, k, 1] = good * t_a, good * (shares[2] * unit[2])
                losses[i, k, 2], losses[i, k, 3] = good * (shares[0] * unit[0]), good * (shares[1] * unit[1])
                losses[i, k, 4], losses[i, k, 5] = good * on_a[0], good * on_a[1]
                losses[i, k, 6], losses[i, k, 7], losses[i, k, 8] = good * on[0], good * on[1], good * passes
            if contraction is not None:
                known = code == st.OK or code == st.JAMMED
                contraction[i, k] = _contraction(answers, matrix, f, axis, unit) if known else math.nan


@inline
def _answers(
    j: Joints, coupler: Coupler, load: Loads, finger: float, f: Friction, speed_d: float, answers: Array
) -> Vector:
    """Solve for the reactions without friction, then to each friction couple alone; return the sizes of the couples."""
    turn_b = unit_vector(sub(load.omega2, load.omega1))
    turn_c = unit_vector(sub(load.omega2, load.omega3))
    unit_b, unit_c, unit_d = 0.0, 0.0, 0.0
    for which in range(4):
        e_b = scale(-unit_b if which == 1 else 0.0, turn_b)
        e_c = scale(-unit_c if which == 2 else 0.0, turn_c)
        r = solve(j, coupler, load, finger, e_b, e_c, unit_d if which == 3 else 0.0, 0.0)
        store_forces(answers[which], 1.0, r)
        answers[which, 18], answers[which, 19] = r.finger, r.drive
        if which == 0:
            # Couples sized by the largest force: a joint without load at first may be loaded later.
            size = max(norm(r.r_b), max(norm(r.r_c), norm(r.r_d)))
            unit_b, unit_c = f.mu_b * f.r_b * size, f.mu_c * f.r_c * size
            unit_d = _shaft_torque(f.mu_d, f.r_d, f.rt_d, (size, size, size), speed_d)
        else:
            for at in range(ANSWER):
                answers[which, at] -= answers[0, at]
    return unit_b, unit_c, unit_d


@inline
def settled(update: Callable[..., None], loads: Array, new: Array, steps: Array, weights: Array, *data: Any) -> int:
    """Find the loads that agree with the reactions they cause, by successive approximations from 0.

    Parameters
    ----------
    update : ``update(loads, new, *data)`` writes the loads under the reactions that friction at ``loads`` causes
    loads : (Q,) out
    new, steps : (Q,) scratch
    weights : (Q,) friction per unit of each load; a load without friction changes nothing

    Returns
    -------
    Number of passes; -1 without convergence.
    """
    last, least, stalled, passes, count, largest = math.inf, math.inf, 0, -1, 0, 0.0
    for which in range(loads.shape[0]):
        loads[which], steps[which] = 0.0, 0.0
    while passes < 0 and stalled < STALLED and count < PASSES:
        count += 1
        change, step, along, square, whole, rounding = 0.0, 0.0, 0.0, 0.0, 0.0, ROUNDING * largest
        update(loads, new, *data)
        for which in range(loads.shape[0]):
            weight, before = weights[which], steps[which]
            apart, size = new[which] - loads[which], max(new[which], loads[which])
            steps[which], largest = apart, max(largest, size)
            # A load next to its zero cannot settle to its own size: its last digits are those of the other loads.
            size = max(size, rounding)
            if weight > 0.0:
                change = max(change, abs(apart) / size if size > 0.0 else 0.0)
                step = max(step, weight * abs(apart))
                along += apart * before
                square += before * before
                whole += apart * apart
        # The last digits fluctuate: a change at rounding level is convergence, not a stall.
        if math.isfinite(step) and (change <= TOLERANCE or (count > 3 and change < 1e-12 and change >= last)):
            passes = count
        last = change
        # The relative change of loads decreases even while they grow without bound, so absolute steps are compared.
        stalled = 0 if step < least else stalled + 1
        least, further = step, 1.0
        if count % LEAP == 0 and passes < 0:
            further, least = leap(along, square, whole), math.inf
        for which in range(loads.shape[0]):
            loads[which] = max(loads[which] + further * (new[which] - loads[which]), 0.0)
    return passes


@inline
def _couples(
    shares: Array, new: Array, answers: Array, f: Friction, axis: Vector, speed_d: float, unit: Vector, total: Array
) -> None:
    """Write the couples of B, C and the guidance under the reactions to some, as multiples of their first guesses."""
    _total(answers, shares, total)
    t_d = _shaft_torque(f.mu_d, f.r_d, f.rt_d, _guidance(total, axis, f), speed_d)
    new[0] = _share(f.mu_b * f.r_b * norm((total[3], total[4], total[5])), unit[0])
    new[1] = _share(f.mu_c * f.r_c * norm((total[6], total[7], total[8])), unit[1])
    new[2] = _share(t_d, unit[2])


@inline
def _share(size: float, unit: float) -> float:
    return size / unit if unit != 0.0 else 0.0


@inline
def _total(answers: Array, shares: Array, total: Array) -> None:
    """Sum the reactions without friction and to the three couples, which are multiples of their first guesses."""
    for at in range(ANSWER):
        total[at] = (
            answers[0, at] + shares[0] * answers[1, at] + shares[1] * answers[2, at] + shares[2] * answers[3, at]
        )


@inline
def _guidance(total: Array, axis: Vector, f: Friction) -> tuple[float, float, float]:
    """Return the loads of the two supports of the follower and the force along its axis."""
    return supports((total[9], total[10], total[11]), (total[15], total[16], total[17]), axis, f.z_d1, f.z_d2)


@inline
def _contraction(answers: Array, m: Array, f: Friction, axis: Vector, units: Vector) -> float:
    """Compute the spectral radius of L, L_ij = mu_i r_i |d reaction_i / d couple_j|; L is written into m."""
    for which in range(3):
        unit = abs(units[which])
        per = 1.0 / unit if unit > 0.0 else 0.0
        r = answers[which + 1]
        m[0, which] = per * f.mu_b * f.r_b * norm((r[3], r[4], r[5]))
        m[1, which] = per * f.mu_c * f.r_c * norm((r[6], r[7], r[8]))
        on = _guidance(r, axis, f)
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
def leap(along: float, square: float, size: float) -> float:
    """Sum of the remaining geometric series of steps, in units of the next step: 1/(1 - q) with q = along/square.

    It is 1, the plain step, where the steps do not shrink or change direction: these are no geometric series.
    """
    straight = along < 0.0 or along * along > STRAIGHT * square * size
    return square / (square - along) if abs(along) < square and straight else 1.0
