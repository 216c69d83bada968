"""Common parts of the formulas for boxes of crank-rockers: inputs, rows, and the motion over the turn.

A box is a set of designs on the locus of limit positions, where swing and phi0 hold exactly (docs/synthesis.md).  The
motion is that of docs/rssr.md, (1)-(4), in the given unit of length, at crank angles counted from the extended
position.  Position 1 is extended, position 2 folded.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.boxes.tape import Number, Operations, Tape
from kernels.types import Array

# Inputs after the seven coordinates: cosine and sine of the crank angle after the extended position, branch, least
# cos^2 of the pressure angle, cosine and sine of a rocker angle after the extended position, a crank length that is a
# variable, then least and most of every length that may have limits.
COORDINATES = 7
COS_THETA, SIN_THETA, BRANCH, COS2, COS_TURN, SIN_TURN, ANY_CRANK, LIMITS = range(COORDINATES, COORDINATES + 8)
MOST_LIMITED = 5
INPUTS = LIMITS + 2 * MOST_LIMITED

# Parts of the tape, in the order in which they run.
PLACE, ARRIVAL, FREE, LENGTHS, CLOSURE, ANGLE, MOTION = range(7)

# Slots of the forms from which the rows of a box are made.
ACCEPTANCE = 0  # five: both distances from the crank axis, order of the limits, crank, branch at both limits
LIMITED = 5  # two per length: above its least, below its most
PRESSURE, SIN2, PSI1, PSI2, SIGNED, SIGN, CRANK, PASSED, FREE_PASSED, FREE_CRANK = range(15, 25)
CENTRES, STARTS = 25, 35  # ten numbers each
SLOTS = STARTS + 10


class Formulas(NamedTuple):
    """Recorded tape, and the forms of its results in ``slots``, -1 where there is none."""

    operations: Operations
    factors: Array
    ends: Operations
    slots: Operations
    forms: int
    early: int  # number of lengths whose limits are known without a division


class LimitPositions(NamedTuple):
    """Numbers that fix the motion in the limit positions: rho1, X1, Y1 and the crank are ratios of them.

    ``total`` is rho1 + rho2 and ``crank`` a times it; ``total``, ``n1``, ``x1``, ``y1`` share a further factor.
    """

    total: Number
    crank: Number
    n1: Number
    x1: Number
    y1: Number
    e: Number
    fs: Number  # f sa
    ca: Number
    u1: Number
    v1: Number


class Linkage(NamedTuple):
    """Numbers of a design that its motion needs; ``k0, k1, k2`` are those of W = k0 + k1 v - k2 u."""

    one: Number
    a: Number
    e: Number
    fs: Number  # f sa
    ac: Number  # a ca
    k0: Number
    k1: Number
    k2: Number
    b2: Number
    u1: Number
    v1: Number


def arrival(tape: Tape, at: LimitPositions) -> Number:
    """Record the number whose sign tells whether the rocker has passed a given angle at a crank angle.

    It is F(phi, psi) of docs/rssr.md, (1), times ``branch`` and times numbers that are positive in a mechanism, from
    the equation of displacements, (15) of docs/synthesis.md.  There xi - rho1, the way of the ball along the crank, is
    written with the ball's place in the plane of the crank at the extended position:

        xi - rho1 = rho1 (cos(theta) - 1) + u (X - X1) + v ca (Y - Y1)                                               (1)
    """
    total, crank, n1, x1, y1, e, fs, ca, u1, v1 = at
    one, cos, sin = tape.one(), tape.input(COS_THETA), tape.input(SIN_THETA)
    less, sin_turn = tape.input(COS_TURN) - one, tape.input(SIN_TURN)
    u, v = u1 * cos - v1 * sin, v1 * cos + u1 * sin
    x, y = x1 * less - y1 * sin_turn, y1 * less + x1 * sin_turn
    along, across = n1 * (cos - one) + (u * x + v * (ca * y)), e * x - fs * y
    return tape.input(BRANCH) * (total * across - crank * along)


def turn(tape: Tape, at: Linkage) -> dict[int, Number]:
    """Record the discriminant, the pressure angle and the motion at one crank angle; forms by slot."""
    one, a, e, fs, ac, k0, k1, k2, b2, u1, v1 = at
    branch, cos, sin = tape.input(BRANCH), tape.input(COS_THETA), tape.input(SIN_THETA)
    u, v = u1 * cos - v1 * sin, v1 * cos + u1 * sin
    x, y, w = e - a * u, fs + ac * v, k0 + (k1 * v - k2 * u)
    r = x.square() + y.square()
    delta = r - w.square()
    found = {PRESSURE: delta - tape.input(COS2) * b2}
    tape.end()
    found[SIN2] = one - delta * b2.inverse()
    tape.end()
    # psi' = -G_phi/T, psi'' = -(G_phiphi + psi' (2 G_phipsi + W psi'))/T; (2*), (3), (4) of docs/rssr.md.
    t, per_r = branch * delta.root(), r.inverse()
    per_t = t.inverse()
    cos_psi, sin_psi = -((x * w + y * t) * per_r), (y * w - x * t) * per_r
    au, av, acu, acv = a * u, a * v, ac * u, ac * v
    first = -((av * cos_psi - acu * sin_psi + (k1 * u + k2 * v)) * per_t)
    mixed = (av * sin_psi + acu * cos_psi).times(-2.0)
    straight = au * cos_psi + acv * sin_psi + (k2 * u - k1 * v)
    found[PSI1], found[PSI2] = first, -((straight + first * (mixed + w * first)) * per_t)
    tape.end()
    return found


def constant_of_closure(at: Linkage, cos1: Number, sin1: Number) -> Number:
    """Record k0, from X C - Y S + W = 0 at the extended position; the linkage's own k0 is not used."""
    w1 = (at.fs + at.ac * at.v1) * sin1 - (at.e - at.a * at.u1) * cos1
    return w1 - (at.k1 * at.v1 - at.k2 * at.u1)


def sense(tape: Tape, total: Number, crank: Number, e: Number, fs: Number, ca: Number, u: Number, v: Number,
          x: Number, y: Number) -> Number:  # fmt: skip
    """Record T of a limit position with the sign of the branch, times ``total``, for a crank of length crank/total.

    It is positive where the limit lies on the branch; x, y are the ball's coordinates about the rocker axis.
    """
    return -(tape.input(BRANCH) * ((e * total - crank * u) * y + (fs * total + crank * ca * v) * x))


def within(tape: Tape, number: int, value: Number, unit: Number, power: int = 1) -> tuple[Number, Number]:
    """Record the rows value - least^power unit >= 0 and most^power unit - value >= 0 of a limited length."""
    least, most = tape.input(LIMITS + 2 * number), tape.input(LIMITS + 2 * number + 1)
    if power == 2:
        least, most = least.square(), most.square()
    return value - least * unit, most * unit - value


def formulas(
    tape: Tape, at: Linkage, found: dict[int, Number], acceptance: Sequence[Number],
    limits: Sequence[tuple[Number, Number]], early: int, start: LimitPositions,
    signs: tuple[Number, Number] | None = None,
) -> Formulas:  # fmt: skip
    """Collect the recorded tape and the table of its forms.

    Parameters
    ----------
    tape, at, found : the tape, its linkage, and rows of the turn, by slot
    acceptance : five rows that a mechanism keeps
    limits : two rows of every limited length; of the first ``early`` ones they stand in the part PLACE
    start : the limit positions
    signs : a number whose sign must be known before the part LENGTHS, and the form that takes it as +1 or -1
    """
    slots = np.full(SLOTS, -1, np.int64)
    for k, number in enumerate(acceptance):
        slots[ACCEPTANCE + k] = number.form
    for k, pair in enumerate(limits):
        slots[LIMITED + 2 * k], slots[LIMITED + 2 * k + 1] = pair[0].form, pair[1].form
    for slot, number in found.items():
        slots[slot] = number.form
    if signs is not None:
        slots[SIGNED], slots[SIGN] = signs[0].form, signs[1].form
    slots[CRANK] = at.a.form
    for k, number in enumerate(at[1:]):
        slots[CENTRES + k] = number.form
    for k, number in enumerate(start):
        slots[STARTS + k] = number.form
    return Formulas(*tape.recorded(), slots, tape.forms, early)
