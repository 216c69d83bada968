"""Cams with a roller follower that slides along a line or swings on a lever, for a given law of motion; docs/cam.md.

The law is rise, dwell, return, dwell by a curve, or a Fourier table, (1)-(5); the sliding follower has (6)-(8), the
lever (9)-(11).  Designs and angles may be complex128 (exact gradients by the complex step); decisions look at the real
part.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2, magnitude, unit_near
from kernels.curves.periodic import harmonics
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write
from kernels.types import TWO_PI, Numbers, Status

POLYNOMIAL_345, MODIFIED_SINE, CYCLOIDAL, FOURIER = 1, 2, 3, 4
HARMONICS = 6
COEFFICIENTS = 2 * HARMONICS
# Columns of the design matrix that every cam begins with; the Fourier coefficients end it.
LIFT, RISE, DWELL, FALL, START, LAW = range(6)
# The Fourier coefficients begin behind r0, e of a sliding follower and r0, c, e, branch of a lever.
SLIDING_TABLE, SWINGING_TABLE = LAW + 3, LAW + 5
_SUM = 4.0 + math.pi


# The law's value, 0 at rest and 1 at full lift, and its derivatives with respect to the cam angle.
Motion = namedtuple("Motion", "y d1 d2 d3")


@inline
def _polynomial(x: Any) -> Motion:
    rest = 1.0 - x
    return Motion(
        x * x * x * (10.0 - x * (15.0 - 6.0 * x)),
        30.0 * (x * rest) * (x * rest),
        60.0 * x * rest * (1.0 - 2.0 * x),
        60.0 * (1.0 - 6.0 * x * rest),
    )


@inline
def _cycloidal(x: Any) -> Motion:
    turn = TWO_PI * x
    s, half = np.sin(turn), np.sin(0.5 * turn)
    return Motion(x - s / TWO_PI, 2.0 * half * half, TWO_PI * s, TWO_PI * TWO_PI * np.cos(turn))


@inline
def _modified_sine(x: Any) -> Motion:
    """Evaluate Neklutin's rise: a sine of short period over an eighth at each end, one of long period between."""
    ends = x.real < 0.125 or x.real > 0.875
    turn = 4.0 * math.pi * x if ends else (4.0 * math.pi * x + math.pi) / 3.0
    s, c = np.sin(turn), np.cos(turn)
    shift = 0.0 if x.real < 0.125 else (4.0 if x.real > 0.875 else 2.0)
    wave, rate = (0.25, 1.0) if ends else (2.25, 1.0 / 3.0)
    bend = 4.0 * math.pi * math.pi / _SUM
    return Motion(
        (shift + math.pi * x - wave * s) / _SUM,
        math.pi * (1.0 - 4.0 * wave * rate * c) / _SUM,
        bend * s,
        4.0 * math.pi * rate * bend * c,
    )


@inline
def normalised(law: int, x: Any) -> Motion:
    """Curve of a rise at x in [0, 1], and its derivatives with respect to x; (2)-(4)."""
    if law == POLYNOMIAL_345:
        return _polynomial(x)
    if law == MODIFIED_SINE:
        return _modified_sine(x)
    return _cycloidal(x)


@inline
def law_is_valid(designs: Numbers, i: int, first: int) -> bool:
    """Whether the columns of the law are valid: a known law, phases within a turn, finite coefficients."""
    law, rise, dwell, fall = (
        designs[i, LAW].real, designs[i, RISE].real, designs[i, DWELL].real, designs[i, FALL].real,
    )  # fmt: skip
    total = 0.0
    for k in range(COEFFICIENTS):
        total += abs(designs[i, first + k].real)
    known = law == 1.0 or law == 2.0 or law == 3.0 or law == 4.0
    phases = rise > 1e-6 and fall > 1e-6 and dwell >= 0.0 and rise + dwell + fall <= TWO_PI * (1.0 + 1e-14)
    return known and phases and total < 1e140 and abs(designs[i, START].real) < 1e5


@inline
def motion(designs: Numbers, i: int, first: int, phi: Any) -> Motion:
    """Law of one valid design at one cam angle, and its derivatives with respect to the angle; (1)."""
    law = int(designs[i, LAW].real)
    if law == FOURIER:
        return Motion(*harmonics(designs[i, first:], HARMONICS, np.cos(phi), np.sin(phi)))
    rise, dwell, fall = designs[i, RISE], designs[i, DWELL], designs[i, FALL]
    t = phi - designs[i, START]
    t = t - TWO_PI * math.floor(t.real / TWO_PI)
    back = t - rise - dwell
    if t.real < rise.real:
        m = normalised(law, t / rise)
        return Motion(m.y, m.d1 / rise, m.d2 / (rise * rise), m.d3 / (rise * rise * rise))
    if back.real < 0.0:
        return Motion(1.0 + 0.0 * t, 0.0 * t, 0.0 * t, 0.0 * t)
    if back.real < fall.real:
        # counted back from the end, near which the remaining lift is small
        m = normalised(law, (fall - back) / fall)
        return Motion(m.y, -m.d1 / fall, m.d2 / (fall * fall), -m.d3 / (fall * fall * fall))
    return Motion(0.0 * t, 0.0 * t, 0.0 * t, 0.0 * t)


# Pose outputs, each (n, m), or None, which is not computed.
Outputs = namedtuple("Outputs", "s ds d2s d3s pressure_angle x_p y_p")


@kernel
def poses(designs: Numbers, phi: Numbers, status: Status, out: Outputs) -> None:
    """Follower displacement, derivatives, pressure angle and pitch curve of every design at its cam angles.

    Parameters
    ----------
    designs : (n, 20) columns lift, rise, dwell, fall, start, law, r0, e, then the Fourier coefficients
    phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, SINGULAR (the roller's centre reaches the cam's axis) or INVALID_INPUT
    s ... y_p : (n, m) out, or None: then it is neither computed nor compiled
    """
    for i in range(designs.shape[0]):
        # lengths divided by a power of two near the prime circle's radius: no square leaves float64
        unit, per_unit = unit_near(designs[i, LAW + 1])
        lift, r0, e = designs[i, LIFT] * per_unit, designs[i, LAW + 1] * per_unit, designs[i, LAW + 2] * per_unit
        row = i if phi.shape[0] > 1 else 0
        valid = law_is_valid(designs, i, SLIDING_TABLE) and 0.0 < r0.real <= 1.0 and abs(e.real) < r0.real
        valid = valid and 1e-140 < lift.real < 1e140
        base = np.sqrt((r0 - e) * (r0 + e)) if valid else math.nan * r0
        for j in range(phi.shape[1]):
            angle = phi[row, j] + 0.0 * lift  # complex where the designs are
            known = valid and abs(angle.real) < 1e5
            status[i, j] = st.OK if known else st.INVALID_INPUT
            y, d1, d2, d3 = math.nan * angle, math.nan * angle, math.nan * angle, math.nan * angle
            if known:
                y, d1, d2, d3 = motion(designs, i, SLIDING_TABLE, angle)
            reach = base + lift * y
            if known and not reach.real > 0.0:
                status[i, j] = st.SINGULAR
            write(out.s, i, j, lift * y * unit)
            write(out.ds, i, j, lift * d1 * unit)
            write(out.d2s, i, j, lift * d2 * unit)
            write(out.d3s, i, j, lift * d3 * unit)
            pressure = arctan2(magnitude(lift * d1 - e), reach) if reach.real > 0.0 else math.nan * reach
            write(out.pressure_angle, i, j, pressure)
            write(out.x_p, i, j, (reach * np.cos(angle) - e * np.sin(angle)) * unit)
            write(out.y_p, i, j, -(reach * np.sin(angle) + e * np.cos(angle)) * unit)


# Pose outputs, each (n, m), or None, which is not computed.
LeverOutputs = namedtuple("LeverOutputs", "psi dpsi d2psi d3psi pressure_angle x_p y_p")


@kernel
def lever_poses(designs: Numbers, phi: Numbers, status: Status, out: LeverOutputs) -> None:
    """Compute the lever angle, derivatives, pressure angle and pitch curve of every design at its cam angles.

    Parameters
    ----------
    designs : (n, 22) columns lift [rad], rise, dwell, fall, start, law, r0, c, e, branch, then the Fourier coefficients
    phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED (the lever does not reach the prime circle) or INVALID_INPUT
    psi ... y_p : (n, m) out, or None: then it is neither computed nor compiled
    """
    for i in range(designs.shape[0]):
        # lengths divided by a power of two near the lever's: no square leaves float64
        unit, per_unit = unit_near(designs[i, LAW + 2])
        lift, branch = designs[i, LIFT], designs[i, LAW + 4].real
        r0, c, e = designs[i, LAW + 1] * per_unit, designs[i, LAW + 2] * per_unit, designs[i, LAW + 3] * per_unit
        row = i if phi.shape[0] > 1 else 0
        valid = law_is_valid(designs, i, SWINGING_TABLE) and r0.real > 0.0 and 0.0 < c.real <= 1.0 and e.real > 0.0
        valid = valid and r0.real < 1e140 and e.real < 1e140 and 1e-140 < lift.real < 1e140 and branch * branch == 1.0
        # the angle at the lever's axis between the line to the cam's axis and the lever, of the triangle e, c, r0
        far, near = (e + c - r0) * (e + c + r0), (r0 - (e - c)) * (r0 + (e - c))
        reaches = valid and far.real > 0.0 and near.real > 0.0
        rest = math.nan * far
        if reaches:
            rest = math.pi - 2.0 * arctan2(np.sqrt(near), np.sqrt(far))
        for j in range(phi.shape[1]):
            angle = phi[row, j] + 0.0 * lift  # complex where the designs are
            known = valid and abs(angle.real) < 1e5
            status[i, j] = st.INVALID_INPUT
            if known:
                status[i, j] = st.OK if reaches else st.NOT_ASSEMBLED
            y, d1, d2, d3 = math.nan * angle, math.nan * angle, math.nan * angle, math.nan * angle
            if known and reaches:
                y, d1, d2, d3 = motion(designs, i, SWINGING_TABLE, angle)
            # lifting brings the lever nearer to the direction away from the cam
            value, slope = branch * (rest - lift * y), -branch * lift * d1
            write(out.psi, i, j, value)
            write(out.dpsi, i, j, slope)
            write(out.d2psi, i, j, -branch * lift * d2)
            write(out.d3psi, i, j, -branch * lift * d3)
            if out.pressure_angle is not None:
                radial, across = e * np.cos(value) + c * (1.0 - slope), e * np.sin(value)
                write(out.pressure_angle, i, j, arctan2(magnitude(radial), magnitude(across)))
            if out.x_p is not None or out.y_p is not None:
                x, z = e + c * np.cos(value), c * np.sin(value)
                write(out.x_p, i, j, (x * np.cos(angle) + z * np.sin(angle)) * unit)
                write(out.y_p, i, j, (z * np.cos(angle) - x * np.sin(angle)) * unit)
