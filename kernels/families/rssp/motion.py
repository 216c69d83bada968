"""Motion of the spatial slider-crank at given crank angles, joint records, ellipse of the coupler direction."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2
from kernels.families.rssp.closure import derivatives, place, reduce_design, tolerance
from kernels.jit import kernel
from kernels.linkage.outputs import write
from kernels.linkage.verdict import pose_status
from kernels.types import Array, Status


@kernel
def pressure_ellipse(designs: Array, ellipse: Array) -> None:
    """Ellipse that the coupler direction draws in the plane across the slide; see kernels.effects.pressure.

    ``designs`` (n, 6); ``ellipse`` (n, 7) out: (x_C - x_B)/b and (z_C - z_B)/b as constant, cosine, sine each, and the
    size of the terms that round.
    """
    for i in range(designs.shape[0]):
        a, b, e, f = designs[i, 0], designs[i, 1], designs[i, 2], designs[i, 3]
        sa, ca = math.sin(designs[i, 4]), math.cos(designs[i, 4])
        out = ellipse[i]
        out[0], out[1], out[2] = e / b, -a / b, 0.0
        out[3], out[4], out[5] = -f * ca / b, 0.0, a * sa / b
        out[6] = (abs(e) + abs(f) + 2.0 * a) / b


@kernel
def joints(
    designs: Array, cos_phi: Array, sin_phi: Array, s: Array, ds: Array, d2s: Array, discriminant: Array,
    per_pose: Array, per_design: Array,
) -> None:  # fmt: skip
    """Fill the records of :mod:`kernels.linkage.joints` from the motion, for the effects.

    Parameters
    ----------
    designs : (n, 6);  cos_phi, sin_phi : (n, m) or (1, m)
    s, ds, d2s, discriminant : (n, m), outputs of :func:`poses`
    per_pose : (n, m, PER_POSE) out;  per_design : (n, PER_DESIGN) out

    Notes
    -----
    The slider's triad is (common perpendicular, slide direction, normal of both); t_tau comes from the discriminant.
    """
    for i in range(designs.shape[0]):
        a, b, e, f, branch = designs[i, 0], designs[i, 1], designs[i, 2], designs[i, 3], designs[i, 5]
        sa, ca = math.sin(designs[i, 4]), math.cos(designs[i, 4])
        d = per_design[i]
        d[0], d[1], d[2], d[3], d[4], d[5] = 0.0, sa, ca, 0.0, 0.0, 1.0
        d[6], d[7], d[8], d[9], d[10], d[11] = 0.0, f * sa, f * ca, e, 0.0, 0.0
        d[12], d[13], d[14], d[15], d[16] = a, b, 1.0, branch, 0.0
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            root = branch * math.sqrt(discriminant[i, j])
            r = per_pose[i, j]
            r[0], r[1], r[2] = a * u, f * sa + a * (ca * v), f * ca - a * (sa * v)
            r[3], r[4], r[5] = e, s[i, j], 0.0
            # The middle component is the root of the discriminant: a difference of points loses it near a dead point.
            r[6], r[7], r[8] = (e - r[0]) / b, root / b, -r[2] / b
            r[9], r[10], r[11] = u, ca * v, -sa * v
            r[12], r[13], r[14] = -v, ca * u, -sa * u
            r[15], r[16], r[17] = 1.0, 0.0, 0.0
            r[18], r[19], r[20] = 0.0, 1.0, 0.0
            r[21], r[22], r[23] = root / b, ds[i, j], d2s[i, j]


class Outputs(NamedTuple):
    """Pose outputs, each (n, m), or None: what is None is not computed."""

    s: Array | None
    ds: Array | None
    d2s: Array | None
    d3s: Array | None
    discriminant: Array | None
    pressure_angle: Array | None


@kernel
def poses(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    status: Status,
    out: Outputs,
    joints: Array | None,
) -> None:
    """Slider displacement, transfer functions, discriminant and pressure angle of every design at its crank angles.

    Equations (1)-(3), (5) and (6) of docs/rssp.md: Q = (b - m)(b + m) - n^2, s = y_B + branch sqrt(Q), cos(pressure
    angle) = sqrt(Q)/b, and the derivatives of Q in the factored form that stays accurate for tiny cranks.

    Parameters
    ----------
    designs : (n, 6) columns as `PARAMETERS` of sweep/families/rssp.py
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

            write(out.discriminant, i, j, (q * r.unit) * r.unit if r.valid else math.nan)
            root = np.sqrt(q) if code == st.OK else 0.0 * q
            assembled = code == st.OK or code == st.DEAD_POINT
            w = r.branch * root if assembled else math.nan * q
            write(out.s, i, j, (y + w) * r.unit)
            # atan2, not acos: acos loses half the digits near zero.
            write(out.pressure_angle, i, j, arctan2(np.sqrt(m * m + n * n), root) if assembled else math.nan)
            if joints is not None:
                joints[0, i, j] = r.a * u * r.unit
                joints[1, i, j] = y * r.unit
                joints[2, i, j] = n * r.unit
                joints[3, i, j] = r.e * r.unit if assembled else math.nan
                joints[4, i, j] = (y + w) * r.unit
                joints[5, i, j] = 0.0 if assembled else math.nan
            if out.ds is not None or out.d2s is not None or out.d3s is not None:
                one, two, three = derivatives(r, u, v, y, 1.0 / w if code == st.OK else math.nan * w)
                write(out.ds, i, j, one * r.unit)
                write(out.d2s, i, j, two * r.unit)
                write(out.d3s, i, j, three * r.unit)
