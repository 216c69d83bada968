"""Motion of the spatial slider-crank at given crank angles: position, transfer functions, joints, pressure angle."""

from __future__ import annotations

import math

import numpy as np

from kernels import status as st
from kernels._jit import kernel
from kernels.complex_step import arctan2
from kernels.families.rssp.closure import Array, Status, derivatives, place, reduce_design, tolerance
from kernels.verdict import pose_status


@kernel
def poses(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    status: Status,
    s: Array | None,
    ds: Array | None,
    d2s: Array | None,
    d3s: Array | None,
    discriminant: Array | None,
    pressure_angle: Array | None,
    joints: Array | None,
) -> None:
    """Compute the slider displacement, transfer functions,
    discriminant and pressure angle of every design at its crank angles.

    Equations (1)-(3), (5) and (6) of docs/rssp.md: Q = (b - m)(b + m) - n^2, s = y_B + branch sqrt(Q), cos(pressure
    angle) = sqrt(Q)/b, and the derivatives of Q in the factored form that stays accurate for tiny cranks.

    Parameters
    ----------
    designs : (n, 6) columns of :class:`Design`
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT or INVALID_INPUT
    s ... pressure_angle : (n, m) out [length; rad], or None: what is None is neither computed nor compiled
    joints : (6, n, m) out, crank pin x y z and slider ball x y z, or None

    Notes
    -----
    Where the status is not OK the values are nan, except that a dead point keeps its position (Q = 0) and the
    discriminant is always given.  The dead-point band is the rounding error of Q itself; outside it the sign is right.
    Measured: errors below 1.6 x 2^-53 max(cond, |y|) over the oracle table, lengths from 1e-100 to 1e100.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            y = r.k0 + r.ka * v
            at = place(r, u, v)
            m, n, q = at
            code = pose_status(r.valid, q.real, tolerance(r, at), None)
            status[i, j] = code

            if discriminant is not None:
                discriminant[i, j] = (q * r.unit) * r.unit if r.valid else math.nan
            root = np.sqrt(q) if code == st.OK else 0.0 * q
            assembled = code == st.OK or code == st.DEAD_POINT
            w = r.branch * root if assembled else math.nan * q
            if s is not None:
                s[i, j] = (y + w) * r.unit
            if pressure_angle is not None:
                # atan2, not acos: acos loses half the digits near zero.
                pressure_angle[i, j] = arctan2(np.sqrt(m * m + n * n), root) if assembled else math.nan
            if joints is not None:
                joints[0, i, j] = r.a * u * r.unit
                joints[1, i, j] = y * r.unit
                joints[2, i, j] = n * r.unit
                joints[3, i, j] = r.e * r.unit if assembled else math.nan
                joints[4, i, j] = (y + w) * r.unit
                joints[5, i, j] = 0.0 if assembled else math.nan
            if ds is not None or d2s is not None or d3s is not None:
                one, two, three = derivatives(r, u, v, y, 1.0 / w if code == st.OK else math.nan * w)
                if ds is not None:
                    ds[i, j] = one * r.unit
                if d2s is not None:
                    d2s[i, j] = two * r.unit
                if d3s is not None:
                    d3s[i, j] = three * r.unit
