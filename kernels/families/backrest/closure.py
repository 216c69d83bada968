"""Geometry and statics of the moving back-rest at one bracket angle and one beam radius.

Equations (1)-(12) of docs/backrest.md.  Lengths are divided by a power of two near the radius of the back-rest, so no
scale of the drawing costs a bit.  Designs and bracket angles may be complex128 (exact gradients by the complex step).
"""

from __future__ import annotations

import math
from collections import namedtuple
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from kernels.arithmetic.complex_step import arctan2, divisor, hypotenuse, unit_near
from kernels.jit import inline
from kernels.types import Array


class Mode(IntEnum):
    """Condition that fixes the bracket angle."""

    LAW = 0  # the let-off regulator: phi is given over rho
    TENSION = 1  # the tension K0 is held, slider reaction at the axis of the back-rest
    COUPLE = 2  # the same, and the slider bears a couple
    CLOSURE = 3  # the source's balance of moments f N2 H = f N1 r0


# Columns of the design matrix: lengths, forces and stiffness in consistent units, angles in radians.
Design = namedtuple(
    "Design",
    "a1 b1 a2 b2 H r r0 psi xE yE f P1 P2 lM nu x3 y3 cs l0 F0 "
    "rg nug s1 s2 phi turn rho_full rho_empty K0 phi_lo phi_hi root",
)
LENGTHS = (0, 1, 2, 3, 4, 5, 6, 8, 9, 13, 15, 16, 18, 20, 26, 27)
STIFFNESS = 17
ANGLES = (7, 14, 21, 24, 25, 29, 30)


class BracketPose(NamedTuple):
    """Geometry at one bracket angle; ``reach1``, ``reach2`` are squares of lengths, below zero where there is none."""

    sin_d: Any  # of psi - phi
    cos_d: Any
    numerator: Any  # R1 sin(psi - phi)
    R1: Any
    x: Any
    y: Any
    reach1: Any
    reach2: Any
    theta: Any
    gamma: Any
    wrap: Any
    defined: bool


# Tension and reactions, with the slider's reaction at the axis of the back-rest and with the slider's couple.
Forces = namedtuple("Forces", "K N1 N2 K_couple N1_couple N2_couple")


@inline
def scaled(designs: Array, i: int, row: Array) -> tuple[float, bool]:
    """Write a design to ``row`` in units of a power of two near r; return the unit, and whether it is valid."""
    unit, per_unit = unit_near(designs[i, 5])
    good = True
    for k in range(designs.shape[1]):
        row[k] = designs[i, k]
        # 0 * x is nan exactly for numbers that are not finite
        good = good and (0.0 * designs[i, k]).real == 0.0
    for k in LENGTHS:
        row[k] = designs[i, k] * per_unit
        good = good and abs(row[k].real) < 1e140
    for k in ANGLES:
        good = good and abs(designs[i, k].real) < 1e5
    row[STIFFNESS] = designs[i, STIFFNESS] * unit
    good = good and designs[i, 5].real > 0.0 and row[6].real >= 0.0 and row[13].real >= 0.0 and row[10].real >= 0.0
    return unit, good


@inline
def place(d: Array, phi: Any, rho: Any) -> BracketPose:
    """Axis of the back-rest, yarn branches and wrap angle; (1)-(5).

    ``defined`` is false where a length is not real.
    """
    sin_p, cos_p = np.sin(phi), np.cos(phi)
    sin_g, cos_g = np.sin(d[7]), np.cos(d[7])
    sin_d, cos_d = np.sin(d[7] - phi), np.cos(d[7] - phi)
    numerator = d[6] + (d[2] - d[8]) * sin_g + (d[3] - d[9]) * cos_g + d[4] * cos_d
    arm = numerator / divisor(sin_d)
    x = d[2] - arm * cos_p + d[4] * sin_p
    y = d[3] + arm * sin_p + d[4] * cos_p
    one, two = hypotenuse(x, y), hypotenuse(d[0] - x, d[1] - y)
    excess = rho - d[5]
    reach1, reach2 = (one - excess) * (one + excess), (two - d[5]) * (two + d[5])
    defined = sin_d.real != 0.0 and reach1.real > 0.0 and reach2.real > 0.0
    if not defined:
        none = math.nan * arm
        return BracketPose(sin_d, cos_d, numerator, arm, x, y, reach1, reach2, none, none, none, False)
    theta = arctan2(excess, np.sqrt(reach1)) + arctan2(x, y)
    gamma = arctan2(d[5], np.sqrt(reach2)) - arctan2(d[1] - y, d[0] - x)
    return BracketPose(
        sin_d, cos_d, numerator, arm, x, y, reach1, reach2, theta, gamma, 0.5 * math.pi - theta + gamma, True
    )  # fmt: skip


@inline
def spring(d: Array, phi: Any) -> tuple[Any, Any, Any]:
    """Length and force of the spring, and the moment about O2 of it and the brackets' weight; (6), (7)."""
    px, py = -(d[13] * np.cos(phi + d[14])), d[13] * np.sin(phi + d[14])
    qx, qy = d[15] - d[2], d[16] - d[3]
    length = hypotenuse(qx - px, qy - py)
    force = d[19] + d[17] * (length - d[18])
    moment = force * ((py * qx - px * qy) / divisor(length)) - d[12] * d[20] * np.cos(phi + d[21])
    return length, force, moment


@inline
def directions(d: Array, phi: Any, at: BracketPose, s1: Any, s2: Any) -> tuple[Any, Any, Any, Any, Any, Any, Any, Any]:
    """Projections of both reactions on the yarn's resultant and across it; (8).

    A, S, Q2, k1, k2, sin v, cos v and twice the sine of half the wrap angle, in the symbols of the page.
    """
    f1, f2 = s1 * d[10], s2 * d[10]
    v = 0.5 * (0.5 * math.pi - at.theta - at.gamma)
    sin_1, cos_1 = np.sin(d[7] + v), np.cos(d[7] + v)
    sin_2, cos_2 = np.sin(phi + v), np.cos(phi + v)
    a = at.sin_d * (1.0 - f1 * f2) + (f1 + f2) * at.cos_d
    return (
        a, sin_1 + f1 * cos_1, sin_2 - f2 * cos_2, cos_1 - f1 * sin_1, cos_2 + f2 * sin_2,
        np.sin(v), np.cos(v), 2.0 * np.sin(0.5 * at.wrap),
    )  # fmt: skip


@inline
def forces(d: Array, phi: Any, at: BracketPose, moment: Any, s1: Any, s2: Any) -> Forces:
    """Yarn tension and reactions of guide and bracket; (9), and (10), (11) with the slider's couple."""
    a, s, q2, k1, k2, sin_v, cos_v, both = directions(d, phi, at, s1, s2)
    weight = d[11]
    n2 = moment * (at.sin_d / divisor(at.numerator))
    n1 = (n2 * q2 - weight * sin_v) / divisor(s)
    tension = (n2 * a - weight * (np.sin(d[7]) + s1 * d[10] * np.cos(d[7]))) / divisor(both * s)
    arm = at.R1 - s2 * d[10] * d[4]
    lever = s1 * d[10] * d[6]
    det = divisor(s * arm + lever * q2)
    n2_couple = (s * moment + lever * weight * sin_v) / det
    n1_couple = (q2 * moment - weight * sin_v * arm) / det
    couple = (n2_couple * k2 - n1_couple * k1 - weight * cos_v) / divisor(both)
    return Forces(tension, n1, n2, couple, n1_couple, n2_couple)


@inline
def residual(d: Array, phi: Any, rho: Any, mode: int) -> tuple[Any, bool]:
    """Left side of the equation for the bracket angle with its poles multiplied out; (12).

    False where the geometry is not defined or the slider would stand on the other side of the bracket's pivot.
    """
    at = place(d, phi, rho)
    if not (at.defined and (at.numerator * at.sin_d).real > 0.0):
        return math.nan * at.R1, False
    _, _, moment = spring(d, phi)
    s1, s2 = d[22], d[23]
    a, s, q2, k1, k2, sin_v, cos_v, both = directions(d, phi, at, s1, s2)
    weight = d[11]
    if mode == Mode.CLOSURE:
        left = moment * at.sin_d * (d[4] * s - d[6] * q2) + d[6] * weight * sin_v * at.numerator
        # Without a radius of the pin S is a factor of the whole: its zeros solve nothing.
        return left / divisor(s) if d[6].real == 0.0 else left, True
    if mode == Mode.TENSION:
        guide = weight * (np.sin(d[7]) + s1 * d[10] * np.cos(d[7]))
        return moment * at.sin_d * a - at.numerator * (guide + d[28] * both * s), True
    arm = at.numerator - s2 * d[10] * d[4] * at.sin_d
    lever = s1 * d[10] * d[6]
    det = s * arm + lever * q2 * at.sin_d
    first = q2 * moment * at.sin_d - weight * sin_v * arm
    second = (s * moment + lever * weight * sin_v) * at.sin_d
    return second * k2 - first * k1 - (weight * cos_v + d[28] * both) * det, True
