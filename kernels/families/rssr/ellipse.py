"""The ellipse that the direction of the coupler draws across the velocity of the rocker's joint."""

from __future__ import annotations

from kernels.arithmetic.sincos import sincos
from kernels.families.rssr.closure import Array, axial_terms
from kernels.jit import kernel


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
