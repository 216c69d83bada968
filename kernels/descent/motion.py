"""Motion of a crank-rocker that drives a guided point, at fixed poses: the part not linear in point, line and scale.

With the crank pin B of the guide and the way w from it to the rocker pin, both complex and for a crank of length 1,

    s + i (dev + h) = z1 B + z2 w,      z1 = scale e^{-i lam},  z2 = scale (xi + i eta)/b e^{-i lam}

(docs/internals/optimiser.md, Proportions).  Gradients of the crank-rocker and of the rocker pin come by the complex
step; the effect of the first stage on the second follows by the chain rule.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.families.guide import closure as guide
from kernels.families.rssr import closure as rssr
from kernels.families.rssr.closure import acceleration, rocker, velocity
from kernels.jit import inline, part
from kernels.types import Array

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]

STEP = 1e-30  # of the complex step
GUIDE, SENSE, OFFSET, COLUMNS = 8, 17, 18, 19  # first column of stage 2, columns of the coupling, number of columns
ORDERS = 3  # position, velocity and acceleration
TURN, SINE, RATE, BEND, MARGIN = 0, 1, 2, 3, 4  # rows of ``driver``: cosine, sine, first and second derivative
U, V, FIRST, SECOND = 0, 1, 2, 3  # rows of ``driven``: cosine and sine of the input angle, its derivatives
P, Q, J, DIP, SLOPE = 2, 3, 4, 5, 6  # rows of ``pin`` behind cosine and sine: 3 derivatives; margin, its derivative


class Motion(NamedTuple):
    """Motion of one design at m poses.

    ``driver`` (5, m) is the rocker of stage 1, ``driven`` (4, m) the input of stage 2, ``pin`` (7, m) the rocker of
    stage 2 with derivatives by that input, ``b`` and ``w`` (3, m) B and w of the module docstring with two derivatives
    by the crank angle.
    """

    driver: Array
    driven: Array
    pin: Array
    b: Complex
    w: Complex


class Moved(NamedTuple):
    """Derivatives of a motion by n columns: both margins (2, n, m), angle of stage 1 (n, m), ``b``, ``w`` (3, n, m)."""

    margins: Array
    angle: Array
    b: Complex
    w: Complex


@inline
def no_motion(m: int) -> Motion:
    """Allocate a motion at m poses."""
    return Motion(
        np.empty((5, m)), np.empty((4, m)), np.empty((7, m)), np.empty((ORDERS, m), np.complex128),
        np.empty((ORDERS, m), np.complex128),
    )  # fmt: skip


@inline
def nothing_moved(n: int, m: int) -> Moved:
    """Allocate derivatives of a motion at m poses by n columns."""
    return Moved(
        np.zeros((2, n, m)), np.zeros((n, m)), np.empty((ORDERS, n, m), np.complex128),
        np.empty((ORDERS, n, m), np.complex128),
    )  # fmt: skip


@inline
def _rocker_of(r: Any, u: float, v: float) -> tuple[Any, Any, Any, Any, Any]:
    """Cosine and sine of the rocker of stage 1, two derivatives by the crank angle, squared cosine of the pressure."""
    at = rssr.place(r.e, r.y0, r.ca, r.k0, r.k1, r.k2, u, v)
    t = np.sqrt(at.delta)
    to = rocker(at, t, 1.0 / (at.rr * t))
    first = velocity(r.k1, r.k2, to, at)
    second = acceleration(to, at, first)
    return -to.c, -r.branch * to.s, -r.branch * first.p, -r.branch * second.q, at.delta / (r.coupler * r.coupler)


@inline
def _pin_of(r: Any, u: float, v: float) -> tuple[Any, ...]:
    """Cosine and sine of the rocker of stage 2, three derivatives by its input angle, the margin and its derivative."""
    at = guide.place(r, u, v)
    t = r.branch * np.sqrt(at.delta)
    c, s = -(at.x * at.w + at.y * t) / at.rr, (at.y * at.w - at.x * t) / at.rr
    first = guide.velocity(r, at, c, s, 1.0 / t)
    second = guide.acceleration(r, at, first, 1.0 / t)
    slope = 2.0 * (at.x * r.a * v + at.y * r.a * u - at.w * r.k2 * v)
    third = guide.jerk(at, first, second, t, 1.0 / t)
    return c, s, first.p, second, third, at.delta / (r.b * r.b), slope / (r.b * r.b)


@inline
def first_stage(row: Any) -> Any:
    """Constants of the crank-rocker."""
    return rssr.reduce_one((row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7]))


@inline
def second_stage(row: Any) -> Any:
    """Constants of the guiding four-bar; its point and line are not used here and set to zero."""
    k, none = GUIDE, 0.0 * row[GUIDE]
    d = (row[k], row[k + 1], row[k + 2], row[k + 3], none, none, none, none, row[k + 8])
    return guide.reduce_along(d, 1.0 + none, none)


@part
def moving(row: Array, cos: Array, sin: Array, out: Motion) -> float:
    """Compute the motion of one design.

    Parameters
    ----------
    row : (P,) columns of the design
    cos, sin : (m,) of the crank angles
    out : written

    Returns
    -------
    Least of both margins over the turn; negative or nan where the mechanism does not turn, and ``out`` is meaningless.
    """
    one, two = first_stage(row), second_stage(row)
    least = math.inf if one.valid and two.valid else math.nan
    turn_c, turn_s, kappa = math.cos(row[OFFSET]), math.sin(row[OFFSET]), row[SENSE]
    for p in range(len(cos)):
        c, s, rate, bend, margin = _rocker_of(one, cos[p], sin[p])
        out.driver[TURN, p], out.driver[SINE, p], out.driver[RATE, p] = c, s, rate
        out.driver[BEND, p], out.driver[MARGIN, p] = bend, margin
        u, v = c * turn_c - kappa * s * turn_s, kappa * s * turn_c + c * turn_s
        first, second = kappa * rate, kappa * bend
        out.driven[U, p], out.driven[V, p], out.driven[FIRST, p], out.driven[SECOND, p] = u, v, first, second
        c, s, p1, p2, p3, dip, slope = _pin_of(two, u, v)
        out.pin[0, p], out.pin[1, p], out.pin[P, p], out.pin[Q, p], out.pin[J, p] = c, s, p1, p2, p3
        out.pin[DIP, p], out.pin[SLOPE, p] = dip, slope
        # A comparison with nan is false: where stage 1 does not reach, its negative margin counts, not the nan behind.
        least = margin if margin < least else least
        least = dip if dip < least else least
        b = row[GUIDE] * complex(u, v)
        out.b[0, p], out.b[1, p] = b, 1j * first * b
        out.b[2, p] = complex(-first * first, second) * b
        arm = row[GUIDE + 2] * complex(c, s)
        t1, t2 = p1 * first, p2 * first * first + p1 * second
        out.w[0, p] = row[GUIDE + 3] + arm - b
        out.w[1, p] = 1j * t1 * arm - out.b[1, p]
        out.w[2, p] = complex(-t1 * t1, t2) * arm - out.b[2, p]
    return least


@inline
def _put(out: Moved, k: int, p: int, b: Any, arm: Any, of_b: Any, of_arm: Any, stretch: float, frame: float) -> None:
    """Write the derivatives of B and w by a column, from those of their angles.

    ``b`` is B with the first and second derivative of its angle by the crank angle; ``of_b`` are the derivatives of the
    angle and these two by the column.  ``arm`` and ``of_arm`` are the same of the arm from the rocker pivot to its pin;
    ``stretch`` is the derivative of the logarithm of the arm's length, ``frame`` that of the frame's length.
    """
    for which in range(2):
        (z, first, second), (d0, d1, d2) = (b, of_b) if which == 0 else (arm, of_arm)
        dz = complex(0.0, d0) * z if which == 0 else complex(stretch, d0) * z
        v0 = dz
        v1 = complex(0.0, d1) * z + complex(0.0, first) * dz
        v2 = complex(-2.0 * first * d1, d2) * z + complex(-first * first, second) * dz
        if which == 0:
            out.b[0, k, p], out.b[1, k, p], out.b[2, k, p] = v0, v1, v2
        else:
            out.w[0, k, p] = v0 + frame - out.b[0, k, p]
            out.w[1, k, p], out.w[2, k, p] = v1 - out.b[1, k, p], v2 - out.b[2, k, p]


@inline
def _turned(out: Moved, k: int, p: int, row: Array, at: Motion, d0: float, d1: float, d2: float) -> None:
    """Write the derivatives of stage 2 by a column that moves its input angle (d0) and two derivatives (d1, d2)."""
    first, second = at.driven[FIRST, p], at.driven[SECOND, p]
    p1, p2, p3 = at.pin[P, p], at.pin[Q, p], at.pin[J, p]
    t1, t2 = p1 * first, p2 * first * first + p1 * second
    e1 = p2 * d0 * first + p1 * d1
    e2 = p3 * d0 * first * first + 2.0 * p2 * first * d1 + p2 * d0 * second + p1 * d2
    arm = row[GUIDE + 2] * complex(at.pin[0, p], at.pin[1, p])
    _put(out, k, p, (at.b[0, p], first, second), (arm, t1, t2), (d0, d1, d2), (p1 * d0, e1, e2), 0.0, 0.0)
    out.margins[1, k, p] = at.pin[SLOPE, p] * d0


@part
def gradients(row: Array, at: Motion, columns: Index, cos: Array, sin: Array, out: Moved) -> None:
    """Compute the derivatives of a motion by some columns of its design, which must turn.

    Parameters
    ----------
    row : (P,) the design
    at : its motion
    columns : (n,) numbers of columns, of either stage or of the angle between them
    cos, sin : (m,) of the crank angles
    out : written
    """
    kappa = row[SENSE]
    design = row.astype(np.complex128)
    for k in range(len(columns)):
        column = columns[k]
        if column == OFFSET:
            for p in range(len(cos)):
                _turned(out, k, p, row, at, 1.0, 0.0, 0.0)
            continue
        design[column] += complex(0.0, STEP)
        if column < GUIDE:
            one = first_stage(design)
            for p in range(len(cos)):
                c, s, rate, bend, margin = _rocker_of(one, cos[p], sin[p])
                angle = (at.driver[TURN, p] * s.imag - at.driver[SINE, p] * c.imag) / STEP
                out.angle[k, p], out.margins[0, k, p] = angle, margin.imag / STEP
                _turned(out, k, p, row, at, kappa * angle, kappa * rate.imag / STEP, kappa * bend.imag / STEP)
        else:
            two = second_stage(design)
            stretch = 1.0 / row[column] if column == GUIDE + 2 else 0.0
            frame = 1.0 if column == GUIDE + 3 else 0.0
            for p in range(len(cos)):
                c, s, p1, p2, _, dip, _ = _pin_of(two, at.driven[U, p], at.driven[V, p])
                first, second = at.driven[FIRST, p], at.driven[SECOND, p]
                d0 = (at.pin[0, p] * s.imag - at.pin[1, p] * c.imag) / STEP
                d1, d2 = p1.imag / STEP * first, (p2.imag * first * first + p1.imag * second) / STEP
                t1, t2 = at.pin[P, p] * first, at.pin[Q, p] * first * first + at.pin[P, p] * second
                arm = row[GUIDE + 2] * complex(at.pin[0, p], at.pin[1, p])
                b = (at.b[0, p], first, second)
                _put(out, k, p, b, (arm, t1, t2), (0.0, 0.0, 0.0), (d0, d1, d2), stretch, frame)
                out.margins[1, k, p] = dip.imag / STEP
        design[column] = row[column]
