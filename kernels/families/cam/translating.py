"""Cam with a roller follower that slides along a fixed line; docs/cam.md (6)-(8)."""

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

R0, E, TABLE = LAW + 1, LAW + 2, LAW + 3


class Outputs(NamedTuple):
    """Pose outputs, each (n, m), or None: what is None is not computed."""

    s: Numbers | None
    ds: Numbers | None
    d2s: Numbers | None
    d3s: Numbers | None
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
    """Follower displacement, derivatives, pressure angle and pitch curve of every design at its cam angles.

    Parameters
    ----------
    designs : (n, 20) columns lift, rise, dwell, fall, start, law, r0, e, then the Fourier coefficients
    phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, SINGULAR (the roller's centre reaches the cam's axis) or INVALID_INPUT
    s ... y_p : (n, m) out, or None: what is None is neither computed nor compiled
    """
    for i in range(designs.shape[0]):
        # lengths divided by a power of two near the prime circle's radius: no square leaves float64
        _, exponent = math.frexp(designs[i, R0].real)
        unit, per_unit = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
        lift, r0, e = designs[i, LIFT] * per_unit, designs[i, R0] * per_unit, designs[i, E] * per_unit
        row = i if phi.shape[0] > 1 else 0
        valid = law_is_valid(designs, i, TABLE) and 0.0 < r0.real <= 1.0 and abs(e.real) < r0.real
        valid = valid and 1e-140 < lift.real < 1e140
        base = np.sqrt((r0 - e) * (r0 + e)) if valid else math.nan * r0
        for j in range(phi.shape[1]):
            angle = phi[row, j] + 0.0 * lift  # complex where the designs are
            known = valid and abs(angle.real) < 1e5
            status[i, j] = st.OK if known else st.INVALID_INPUT
            y, d1, d2, d3 = math.nan * angle, math.nan * angle, math.nan * angle, math.nan * angle
            if known:
                y, d1, d2, d3 = motion(designs, i, TABLE, angle)
            reach = base + lift * y
            if known and not reach.real > 0.0:
                status[i, j] = st.SINGULAR
            write(out.s, i, j, lift * y * unit)
            write(out.ds, i, j, lift * d1 * unit)
            write(out.d2s, i, j, lift * d2 * unit)
            write(out.d3s, i, j, lift * d3 * unit)
            write(
                out.pressure_angle,
                i,
                j,
                (arctan2(magnitude(lift * d1 - e), reach) if reach.real > 0.0 else math.nan * reach),
            )
            write(out.x_p, i, j, (reach * np.cos(angle) - e * np.sin(angle)) * unit)
            write(out.y_p, i, j, -(reach * np.sin(angle) + e * np.cos(angle)) * unit)
