"""Spatial slider-crank: revolute crank, two ball joints, prismatic slider (RSSP); planar for alpha = 0.

Polukhin 1971, section 2.7, in the corrected and stable forms of docs/rssp.md; the equation numbers are of that page.
Everything is computed in lengths divided by a power of two near the coupler length, so no scale of the drawing costs a
bit.  Designs may be complex128 (exact gradients by the complex step); decisions look at the real part.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.complex_step import arctan2

Array = NDArray[np.float64]
Status = NDArray[np.uint8]
EPS = 2.0**-53


class Design(NamedTuple):
    """Columns of the design matrix: lengths in one unit, alpha in radians, branch +1 or -1."""

    a: float
    b: float
    e: float
    f: float
    alpha: float
    branch: float


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``: y_B = k0 + ka sin phi, n = n0 - na sin phi, m = e - a cos phi."""

    a: float
    b: float
    e: float
    k0: float
    ka: float
    n0: float
    na: float
    m_size: float  # sums of the magnitudes whose rounding errors make up m and n
    n_size: float
    branch: float
    unit: float
    valid: bool


@inline
def reduce_design(designs: Array, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for zero or negative lengths and for what is not finite."""
    _, exponent = math.frexp(designs[i, 1].real)
    unit, per_unit = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
    a, b, e, f = designs[i, 0] * per_unit, designs[i, 1] * per_unit, designs[i, 2] * per_unit, designs[i, 3] * per_unit
    alpha, branch = designs[i, 4], designs[i, 5]
    sa, ca = np.sin(alpha), np.cos(alpha)
    m_size, n_size = abs(e.real) + a.real, abs(f.real) + a.real
    valid = a.real > 0.0 and b.real > 0.0 and m_size < 1e140 and n_size < 1e140
    valid = valid and abs(alpha.real) < 1e5 and branch.real * branch.real == 1.0
    return Reduced(a, b, e, f * sa, a * ca, f * ca, a * sa, m_size, n_size, branch, unit, valid)


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
    """Slider displacement, transfer functions, discriminant and pressure angle of every design at its crank angles.

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
            m, n = r.e - r.a * u, r.n0 - r.na * v
            q = (r.b - m) * (r.b + m) - n * n
            error = 8.0 * EPS
            tolerance = error * (abs(m.real) * r.m_size + abs(n.real) * r.n_size)
            tolerance += error * error * (r.m_size * r.m_size + r.n_size * r.n_size)
            code = st.OK
            if not r.valid or q.real != q.real:
                code = st.INVALID_INPUT
            elif q.real < -tolerance:
                code = st.NOT_ASSEMBLED
            elif q.real <= tolerance:
                code = st.DEAD_POINT
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
                per_w = 1.0 / w if code == st.OK else math.nan * w
                m1, n1 = r.a * v, -(r.na * u)
                q1 = -(m * m1 + n * n1)
                w1 = q1 * per_w
                if ds is not None:
                    ds[i, j] = (r.ka * u + w1) * r.unit
                if d2s is not None or d3s is not None:
                    m2, n2 = r.a * u, r.na * v
                    q2 = -(m1 * m1 + n1 * n1 + m * m2 + n * n2)
                    w2 = (q2 - w1 * w1) * per_w
                    if d2s is not None:
                        d2s[i, j] = (w2 - r.ka * v) * r.unit
                    if d3s is not None:
                        q3 = -q1 - 3.0 * (m1 * m2 + n1 * n2)
                        d3s[i, j] = ((q3 - 3.0 * w1 * w2) * per_w - r.ka * u) * r.unit
