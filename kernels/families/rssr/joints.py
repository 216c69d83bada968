"""Joint records of the spatial crank-rocker for the effects (:mod:`kernels.linkage.joints`).

Beside them the ellipse that the direction of the coupler draws across the velocity of the rocker's joint.
"""

from __future__ import annotations

import math

import numpy as np

from kernels.arithmetic.sincos import sincos
from kernels.families.rssr.closure import Array, axial_terms
from kernels.jit import kernel


@kernel
def joints(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    cos_psi: Array,
    sin_psi: Array,
    dpsi: Array,
    d2psi: Array,
    discriminant: Array,
    per_pose: Array,
    per_design: Array,
) -> None:
    """Fill the records of :mod:`kernels.linkage.joints` from the motion.

    Parameters
    ----------
    designs : (n, 8);  cos_phi, sin_phi : (n, m) or (1, m)
    cos_psi, sin_psi, dpsi, d2psi, discriminant : (n, m), outputs of ``poses``
    per_pose : (n, m, PER_POSE) out;  per_design : (n, PER_DESIGN) out

    Notes
    -----
    The component t_tau of the coupler's direction along the rocker's motion has the sign of the branch.  It is taken
    from the discriminant, which keeps its digits near a dead point.
    """
    for i in range(designs.shape[0]):
        a, b, c = designs[i, 0], designs[i, 1], designs[i, 2]
        e, f, g, branch = designs[i, 3], designs[i, 4], designs[i, 5], designs[i, 7]
        sa, ca = math.sin(designs[i, 6]), math.cos(designs[i, 6])
        d = per_design[i]
        d[0], d[1], d[2], d[3], d[4], d[5] = 0.0, sa, ca, 0.0, 0.0, 1.0
        d[6], d[7], d[8], d[9], d[10], d[11] = 0.0, f * sa, f * ca, e, 0.0, g
        d[12], d[13], d[14], d[15], d[16] = a, b, c, branch, 1.0
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v, cp, sp = cos_phi[row, j], sin_phi[row, j], cos_psi[i, j], sin_psi[i, j]
            r = per_pose[i, j]
            r[0], r[1], r[2] = a * u, f * sa + a * (ca * v), f * ca - a * (sa * v)
            r[3], r[4], r[5] = e + c * cp, c * sp, g
            for k in range(3):
                r[6 + k] = (r[3 + k] - r[k]) / b
            r[9], r[10], r[11] = u, ca * v, -sa * v
            r[12], r[13], r[14] = -v, ca * u, -sa * u
            r[15], r[16], r[17] = cp, sp, 0.0
            r[18], r[19], r[20] = -sp, cp, 0.0
            # From the root of the discriminant: near a dead point a difference of points has no digit left.
            r[21] = branch * np.sqrt(discriminant[i, j]) / (2.0 * b * c)
            r[22], r[23] = dpsi[i, j], d2psi[i, j]


@kernel
def pressure_ellipse(designs: Array, ellipse: Array) -> None:
    """Compute the radial and axial component of the coupler's unit vector as functions of the crank angle.

    t_rho = (A3 + 2 c^2)/(2 b c) and t_k = (z_C - z_B)/b are of first degree in cos(phi), sin(phi) and need no rocker
    angle; sin^2(pressure angle) = t_rho^2 + t_k^2.

    Parameters
    ----------
    designs : (n, 8)
    ellipse : (n, 7) out; t_rho and t_k as constant, cosine, sine each, and the size of the terms that round
    """
    for i in range(designs.shape[0]):
        a, b, c = designs[i, 0], designs[i, 1], designs[i, 2]
        e, f, g = designs[i, 3], designs[i, 4], designs[i, 5]
        sa, ca = sincos(designs[i, 6])
        q, q_size, rise = axial_terms(f, g, designs[i, 6], ca)
        per = 1.0 / (b * c)
        out = ellipse[i]
        # The sizes of the terms are kept apart from their sums: rounding is proportional to the former.
        out[0] = 0.5 * per * (b * b + c * c - a * a - e * e - q)
        out[1], out[2] = per * (a * e), -per * (a * g * sa)
        out[3], out[4], out[5] = -rise / b, 0.0, a * sa / b
        radial = 0.5 * per * (b * b + c * c + a * a + e * e + q_size) + per * a * (abs(e) + abs(g * sa))
        out[6] = radial + (abs(g) + abs(f * ca) + a) / b
