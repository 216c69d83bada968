"""Motion of the spatial slider-crank at given crank angles, joint records, ellipse of the coupler direction.

A design is brought to the constants of :mod:`kernels.linkage.slider_closure`, in lengths divided by a power of two near
the coupler length, so no scale of the drawing costs a bit.  Designs may be complex128 (exact gradients by the complex
step); decisions look at the real part.

:func:`precise_poses` is the motion for exactly the given doubles, everything in twice the working precision.  In plain
arithmetic the discriminant near a dead point is a small difference of large numbers, and so are the derivatives for
long offsets.
"""

from __future__ import annotations

import math
from collections import namedtuple

import numpy as np

from kernels import status as st
from kernels.arithmetic import double_double as two
from kernels.arithmetic.complex_step import arctan2, unit_near
from kernels.jit import inline, kernel
from kernels.linkage.outputs import put_block, write
from kernels.linkage.slider_closure import Reduced, derivatives, place, reduce_scaled, tolerance
from kernels.linkage.verdict import pose_status
from kernels.types import EPS, Array, Status


@inline
def reduce_design(designs: Array, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for zero or negative lengths and for numbers that are not finite."""
    unit, per_unit = unit_near(designs[i, 1])
    a, b, e, f = designs[i, 0] * per_unit, designs[i, 1] * per_unit, designs[i, 2] * per_unit, designs[i, 3] * per_unit
    return reduce_scaled(a, b, e, f, designs[i, 4], designs[i, 5], unit)


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
def joints(designs: Array, cos_phi: Array, sin_phi: Array, motion: Array, per_pose: Array, per_design: Array) -> None:
    """Fill the records of :mod:`kernels.linkage.joints` from the motion, for the effects.

    Parameters
    ----------
    designs : (n, 6);  cos_phi, sin_phi : (n, m) or (1, m)
    motion : (4, n, m), outputs s, ds, d2s, discriminant of :func:`poses`
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
            s, ds, d2s = motion[0, i, j], motion[1, i, j], motion[2, i, j]
            root = branch * math.sqrt(motion[3, i, j])
            r = per_pose[i, j]
            r[0], r[1], r[2] = a * u, f * sa + a * (ca * v), f * ca - a * (sa * v)
            r[3], r[4], r[5] = e, s, 0.0
            # The middle component is the root of the discriminant: a difference of points loses it near a dead point.
            r[6], r[7], r[8] = (e - r[0]) / b, root / b, -r[2] / b
            r[9], r[10], r[11] = u, ca * v, -sa * v
            r[12], r[13], r[14] = -v, ca * u, -sa * u
            r[15], r[16], r[17] = 1.0, 0.0, 0.0
            r[18], r[19], r[20] = 0.0, 1.0, 0.0
            r[21], r[22], r[23] = root / b, ds, d2s


# Pose outputs, each (n, m), and joints (6, n, m); outputs of None are not computed.
Outputs = namedtuple("Outputs", "s ds d2s d3s discriminant pressure_angle joints")


@kernel
def poses(designs: Array, cos_phi: Array, sin_phi: Array, status: Status, out: Outputs) -> None:
    """Slider displacement, transfer functions, discriminant and pressure angle of every design at its crank angles.

    Equations (1)-(3), (5) and (6) of docs/rssp.md: Q = (b - m)(b + m) - n^2, s = y_B + branch sqrt(Q), cos(pressure
    angle) = sqrt(Q)/b, and the derivatives of Q in the factored form that stays accurate for tiny cranks.

    Parameters
    ----------
    designs : (n, 6) columns as `PARAMETERS` of sweep/families/rssp.py
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT or INVALID_INPUT
    s ... pressure_angle : (n, m) out [length; rad], or None: then it is neither computed nor compiled
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
            foot, flat = (r.e, 0.0 * q) if assembled else (math.nan * q, math.nan * q)
            put_block(out.joints, i, j, (r.a * u, y, n, foot, y + w, flat), r.unit)
            if out.ds is not None or out.d2s is not None or out.d3s is not None:
                one, two, three = derivatives(r, u, v, y, 1.0 / w if code == st.OK else math.nan * w)
                write(out.ds, i, j, one * r.unit)
                write(out.d2s, i, j, two * r.unit)
                write(out.d3s, i, j, three * r.unit)


BAND = 4.0 * EPS  # effect of rounding the given numbers on Q: a dead point rounded to float64 is still one


@kernel
def precise_poses(designs: Array, cos_phi: Array, sin_phi: Array, status: Status, out: Outputs) -> None:
    """Poses as of the module ``motion``, correct to a few roundings, for float64 designs only.

    Notes
    -----
    (cos phi, sin phi) give the direction of the crank, its length is the crank's.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        unit = r.unit
        sa, ca = two.sine_cosine(designs[i, 4])
        f, ka, na = designs[i, 3] * (1.0 / unit), two.scale(ca, r.a), two.scale(sa, r.a)
        y0, n0, ae = two.scale(sa, f), two.scale(ca, f), two.two_product(r.a, r.e)
        for j in range(cos_phi.shape[1]):
            u, v = two.unit_vector(cos_phi[row, j], sin_phi[row, j])
            hu, hv = two.multiply(ka, u), two.multiply(ka, v)
            y, m = two.add(y0, hv), two.subtract((r.e, 0.0), two.scale(u, r.a))
            n = two.subtract(n0, two.multiply(na, v))
            q = two.multiply(two.subtract((r.b, 0.0), m), two.add((r.b, 0.0), m))
            q = two.subtract(q, two.multiply(n, n))
            tolerance = BAND * (abs(m[0]) * r.m_size + abs(n[0]) * r.n_size)
            tolerance += BAND * BAND * (r.m_size * r.m_size + r.n_size * r.n_size)
            code = pose_status(r.valid, q[0], tolerance, None)
            status[i, j] = code

            write(out.discriminant, i, j, (q[0] * unit) * unit if r.valid else math.nan)
            root = two.root(q) if code == st.OK else (0.0, 0.0)
            assembled = code == st.OK or code == st.DEAD_POINT
            w = two.scale(root, r.branch)
            place = two.add(y, w)[0] if assembled else math.nan
            write(out.s, i, j, place * unit)
            write(out.pressure_angle, i, j, math.atan2(math.hypot(m[0], n[0]), root[0]) if assembled else math.nan)
            foot, flat = (r.e, 0.0) if assembled else (math.nan, math.nan)
            put_block(out.joints, i, j, (r.a * u[0], y[0], n[0], foot, place, flat), unit)
            if out.ds is not None or out.d2s is not None or out.d3s is not None:
                per_w = 1.0 / w[0] if code == st.OK else math.nan
                q1 = two.subtract(two.multiply(hu, y), two.multiply(ae, v))
                w1 = two.divide(q1, w, per_w)
                write(out.ds, i, j, two.add(hu, w1)[0] * unit)
                if out.d2s is not None or out.d3s is not None:
                    q2 = two.subtract(two.multiply(hu, hu), two.add(two.multiply(hv, y), two.multiply(ae, u)))
                    w2 = two.divide(two.subtract(q2, two.multiply(w1, w1)), w, per_w)
                    write(out.d2s, i, j, two.subtract(w2, hv)[0] * unit)
                    if out.d3s is not None:
                        q3 = two.add(two.multiply(hu, hv), two.multiply(w1, w2))
                        w3 = two.divide(two.add(q1, two.scale(q3, 3.0)), w, per_w)  # negative
                        write(out.d3s, i, j, -two.add(w3, hu)[0] * unit)
