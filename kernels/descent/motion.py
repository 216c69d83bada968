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
COSINE, SINE, VELOCITY, ACCELERATION, CRANK_MARGIN = 0, 1, 2, 3, 4  # rows of ``driver``
U, V, FIRST, SECOND = 0, 1, 2, 3  # rows of ``driven``: cosine and sine of the input angle, its derivatives
P, Q, J, PIN_MARGIN, PIN_MARGIN_SLOPE = 2, 3, 4, 5, 6  # rows of ``pin`` behind cosine and sine; P, Q, J: derivatives


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


class Slopes(NamedTuple):
    """Derivatives of a motion by n columns: both margins (2, n, m), angle of stage 1 (n, m), ``b``, ``w`` (3, n, m)."""

    margins: Array
    angle: Array
    b: Complex
    w: Complex


@inline
def empty_motion(m: int) -> Motion:
    """Allocate a motion at m poses."""
    return Motion(
        np.empty((5, m)), np.empty((4, m)), np.empty((7, m)), np.empty((ORDERS, m), np.complex128),
        np.empty((ORDERS, m), np.complex128),
    )  # fmt: skip


@inline
def zero_slopes(n: int, m: int) -> Slopes:
    """Allocate derivatives of a motion at m poses by n columns."""
    return Slopes(
        np.zeros((2, n, m)), np.zeros((n, m)), np.empty((ORDERS, n, m), np.complex128),
        np.empty((ORDERS, n, m), np.complex128),
    )  # fmt: skip


@inline
def _rocker_of(r: Any, u: float, v: float) -> tuple[Any, Any, Any, Any, Any]:
    """Cosine and sine of the rocker of stage 1, two derivatives by the crank angle, squared cosine of the pressure."""
    loop = rssr.place(r.e, r.y0, r.ca, r.k0, r.k1, r.k2, u, v)
    t = np.sqrt(loop.delta)
    to = rocker(loop, t, 1.0 / (loop.rr * t))
    first = velocity(r.k1, r.k2, to, loop)
    second = acceleration(to, loop, first)
    return -to.c, -r.branch * to.s, -r.branch * first.p, -r.branch * second.q, loop.delta / (r.coupler * r.coupler)


@inline
def _pin_of(r: Any, u: float, v: float) -> tuple[Any, ...]:
    """Cosine and sine of the rocker of stage 2, three derivatives by its input angle, the margin and its derivative."""
    loop = guide.place(r, u, v)
    t = r.branch * np.sqrt(loop.delta)
    c, s = -(loop.x * loop.w + loop.y * t) / loop.rr, (loop.y * loop.w - loop.x * t) / loop.rr
    first = guide.velocity(r, loop, c, s, 1.0 / t)
    second = guide.acceleration(r, loop, first, 1.0 / t)
    slope = 2.0 * (loop.x * r.a * v + loop.y * r.a * u - loop.w * r.k2 * v)
    third = guide.jerk(loop, first, second, t, 1.0 / t)
    return c, s, first.p, second, third, loop.delta / (r.b * r.b), slope / (r.b * r.b)


@inline
def first_stage(row: Any) -> Any:
    """Constants of the crank-rocker."""
    return rssr.reduce_one((row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7]))


@inline
def second_stage(row: Any) -> Any:
    """Constants of the guiding four-bar; its point and line are not used here and set to zero."""
    k, zero = GUIDE, 0.0 * row[GUIDE]
    d = (row[k], row[k + 1], row[k + 2], row[k + 3], zero, zero, zero, zero, row[k + 8])
    return guide.reduce_along(d, 1.0 + zero, zero)


@part
def motion_of(row: Array, cos: Array, sin: Array, out: Motion) -> float:
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
    stage1, stage2 = first_stage(row), second_stage(row)
    least_margin = math.inf if stage1.valid and stage2.valid else math.nan
    turn_c, turn_s, kappa = math.cos(row[OFFSET]), math.sin(row[OFFSET]), row[SENSE]
    for p in range(len(cos)):
        c, s, rate, bend, crank_margin = _rocker_of(stage1, cos[p], sin[p])
        out.driver[COSINE, p], out.driver[SINE, p], out.driver[VELOCITY, p] = c, s, rate
        out.driver[ACCELERATION, p], out.driver[CRANK_MARGIN, p] = bend, crank_margin
        u, v = c * turn_c - kappa * s * turn_s, kappa * s * turn_c + c * turn_s
        first, second = kappa * rate, kappa * bend
        out.driven[U, p], out.driven[V, p], out.driven[FIRST, p], out.driven[SECOND, p] = u, v, first, second
        c, s, p1, p2, p3, pin_margin, slope = _pin_of(stage2, u, v)
        out.pin[0, p], out.pin[1, p], out.pin[P, p], out.pin[Q, p], out.pin[J, p] = c, s, p1, p2, p3
        out.pin[PIN_MARGIN, p], out.pin[PIN_MARGIN_SLOPE, p] = pin_margin, slope
        # A comparison with nan is false: where stage 1 does not reach, its negative margin counts, not the nan behind.
        least_margin = crank_margin if crank_margin < least_margin else least_margin
        least_margin = pin_margin if pin_margin < least_margin else least_margin
        b = row[GUIDE] * complex(u, v)
        out.b[0, p], out.b[1, p] = b, 1j * first * b
        out.b[2, p] = complex(-first * first, second) * b
        arm = row[GUIDE + 2] * complex(c, s)
        t1, t2 = p1 * first, p2 * first * first + p1 * second
        out.w[0, p] = row[GUIDE + 3] + arm - b
        out.w[1, p] = 1j * t1 * arm - out.b[1, p]
        out.w[2, p] = complex(-t1 * t1, t2) * arm - out.b[2, p]
    return least_margin


@inline
def _write(out: Slopes, k: int, p: int, b: Any, arm: Any, of_b: Any, of_arm: Any, stretch: float, frame: float) -> None:
    """Write the derivatives of B and w by a column, from those of their angles.

    ``b`` is B with the first and second derivative of its angle by the crank angle; ``of_b`` are the derivatives of the
    angle and these two by the column.  ``arm`` and ``of_arm`` are the same of the arm from the rocker pivot to its pin;
    ``stretch`` is the derivative of the logarithm of the arm's length, ``frame`` that of the frame's length.
    """
    for pivot in range(2):
        (z, first, second), (d0, d1, d2) = (b, of_b) if pivot == 0 else (arm, of_arm)
        dz = complex(0.0, d0) * z if pivot == 0 else complex(stretch, d0) * z
        v0 = dz
        v1 = complex(0.0, d1) * z + complex(0.0, first) * dz
        v2 = complex(-2.0 * first * d1, d2) * z + complex(-first * first, second) * dz
        if pivot == 0:
            out.b[0, k, p], out.b[1, k, p], out.b[2, k, p] = v0, v1, v2
        else:
            out.w[0, k, p] = v0 + frame - out.b[0, k, p]
            out.w[1, k, p], out.w[2, k, p] = v1 - out.b[1, k, p], v2 - out.b[2, k, p]


@inline
def _by_input(out: Slopes, k: int, p: int, row: Array, motion: Motion, d0: float, d1: float, d2: float) -> None:
    """Write the derivatives of stage 2 by a column that moves its input angle (d0) and two derivatives (d1, d2)."""
    first, second = motion.driven[FIRST, p], motion.driven[SECOND, p]
    p1, p2, p3 = motion.pin[P, p], motion.pin[Q, p], motion.pin[J, p]
    t1, t2 = p1 * first, p2 * first * first + p1 * second
    e1 = p2 * d0 * first + p1 * d1
    e2 = p3 * d0 * first * first + 2.0 * p2 * first * d1 + p2 * d0 * second + p1 * d2
    arm = row[GUIDE + 2] * complex(motion.pin[0, p], motion.pin[1, p])
    _write(out, k, p, (motion.b[0, p], first, second), (arm, t1, t2), (d0, d1, d2), (p1 * d0, e1, e2), 0.0, 0.0)
    out.margins[1, k, p] = motion.pin[PIN_MARGIN_SLOPE, p] * d0


@part
def gradients(row: Array, motion: Motion, columns: Index, cos: Array, sin: Array, out: Slopes) -> None:
    """Compute the derivatives of a motion by some columns of its design, which must turn.

    Parameters
    ----------
    row : (P,) the design
    motion : its motion
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
                _by_input(out, k, p, row, motion, 1.0, 0.0, 0.0)
            continue
        design[column] += complex(0.0, STEP)
        if column < GUIDE:
            stage1 = first_stage(design)
            for p in range(len(cos)):
                c, s, rate, bend, crank_margin = _rocker_of(stage1, cos[p], sin[p])
                angle = (motion.driver[COSINE, p] * s.imag - motion.driver[SINE, p] * c.imag) / STEP
                out.angle[k, p], out.margins[0, k, p] = angle, crank_margin.imag / STEP
                _by_input(out, k, p, row, motion, kappa * angle, kappa * rate.imag / STEP, kappa * bend.imag / STEP)
        else:
            stage2 = second_stage(design)
            stretch = 1.0 / row[column] if column == GUIDE + 2 else 0.0
            frame = 1.0 if column == GUIDE + 3 else 0.0
            for p in range(len(cos)):
                c, s, p1, p2, _, pin_margin, _ = _pin_of(stage2, motion.driven[U, p], motion.driven[V, p])
                first, second = motion.driven[FIRST, p], motion.driven[SECOND, p]
                d0 = (motion.pin[0, p] * s.imag - motion.pin[1, p] * c.imag) / STEP
                d1, d2 = p1.imag / STEP * first, (p2.imag * first * first + p1.imag * second) / STEP
                t1, t2 = motion.pin[P, p] * first, motion.pin[Q, p] * first * first + motion.pin[P, p] * second
                arm = row[GUIDE + 2] * complex(motion.pin[0, p], motion.pin[1, p])
                b = (motion.b[0, p], first, second)
                _write(out, k, p, b, (arm, t1, t2), (0.0, 0.0, 0.0), (d0, d1, d2), stretch, frame)
                out.margins[1, k, p] = pin_margin.imag / STEP
        design[column] = row[column]
