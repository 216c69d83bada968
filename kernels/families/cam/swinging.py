"""Cam with a roller on a lever that swings about a fixed axis; docs/cam.md (9)-(11)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2, magnitude
from kernels.families.cam.law import LAW, LIFT, law_is_valid, motion
from kernels.jit import kernel
from kernels.linkage.outputs import write
from kernels.types import Numbers, Status

R0, C, E, BRANCH, TABLE = LAW + 1, LAW + 2, LAW + 3, LAW + 4, LAW + 5


class Outputs(NamedTuple):
    """Pose outputs, each (n, m), or None: what is None is not computed."""

    psi: Numbers | None
    dpsi: Numbers | None
    d2psi: Numbers | None
    d3psi: Numbers | None
    pressure_angle: Numbers | None
    x_p: Numbers | None
    y_p: Numbers | None


@kernel
def poses(
    designs: Numbers,
    phi: Numbers,
    status: Status,
    out: Outputs,
) -> None:
    """Compute the lever angle, derivatives, pressure angle and pitch curve of every design at its cam angles.

    Parameters
    ----------
    designs : (n, 22) columns lift [rad], rise, dwell, fall, start, law, r0, c, e, branch, then the Fourier coefficients
    phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED (the lever does not reach the prime circle) or INVALID_INPUT
    psi ... y_p : (n, m) out, or None: what is None is neither computed nor compiled
    """
    for i in range(designs.shape[0]):
        # lengths divided by a power of two near the lever's: no square leaves float64
        _, exponent = math.frexp(designs[i, C].real)
        unit, per_unit = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
        lift, branch = designs[i, LIFT], designs[i, BRANCH].real
        r0, c, e = designs[i, R0] * per_unit, designs[i, C] * per_unit, designs[i, E] * per_unit
        row = i if phi.shape[0] > 1 else 0
        valid = law_is_valid(designs, i, TABLE) and r0.real > 0.0 and 0.0 < c.real <= 1.0 and e.real > 0.0
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
                y, d1, d2, d3 = motion(designs, i, TABLE, angle)
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
