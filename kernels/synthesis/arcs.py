"""Where the admissible arcs of a locus end: crank angles phi1 at which the side condition changes."""

from __future__ import annotations

import math

from kernels.arithmetic.sincos import sine_cosine
from kernels.jit import kernel
from kernels.types import TWO_PI, Array


@kernel
def rssr_arc_ends(requirements: Array, ends: Array) -> None:
    """Compute crank angles phi1 at which the rocker ball would lie on the crank axis or at infinity.

    Equation (4) of docs/synthesis.md: the zeros of rho1, rho2 and of the determinant.

    Parameters
    ----------
    requirements : (n, 7) columns of :func:`kernels.synthesis.rssr_on_locus`; phi1 and f are not used
    ends : (n, 8) out [rad] in [0, 2 pi), ascending; nan last, where there are fewer
    """
    for i in range(requirements.shape[0]):
        phi0, e, g = requirements[i, 1], requirements[i, 3], requirements[i, 5]
        sh, ch = sine_cosine(0.5 * requirements[i, 0])
        s0, c0 = sine_cosine(phi0)
        sa, ca = sine_cosine(requirements[i, 6])
        h, ss, q = g * sa, 2.0 * sh * ch, 2.0 * sh * sh
        first = math.atan2(ca * (h * q + e * ca * ss), h * ss - e * ca * q) - phi0
        second = math.atan2(-ca * (h * q - e * ca * ss), h * ss + e * ca * q)
        # det = 0: cos(2 phi1 + phi0) = level/size
        size, level = ss * (sa * sa), (1.0 + ca * ca) * c0 * ss - 2.0 * ca * (1.0 - q) * s0
        inner = (size - level) * (size + level)
        infinite = math.nan
        if inner >= 0.0 and size != 0.0:
            infinite = math.atan2(math.sqrt(inner), math.copysign(level, level * size))
        ends[i, 0], ends[i, 1] = first, first + math.pi
        ends[i, 2], ends[i, 3] = second, second + math.pi
        ends[i, 4], ends[i, 5] = 0.5 * (infinite - phi0), 0.5 * (infinite - phi0) + math.pi
        ends[i, 6], ends[i, 7] = 0.5 * (-infinite - phi0), 0.5 * (-infinite - phi0) + math.pi
        for k in range(8):
            turned = ends[i, k] % TWO_PI
            place = k
            while place > 0 and not (ends[i, place - 1] <= turned) and turned == turned:
                ends[i, place] = ends[i, place - 1]
                place -= 1
            ends[i, place] = turned


@kernel
def rssp_arc_ends(requirements: Array, ends: Array) -> None:
    """Crank angles phi1 at which the slider ball would lie on the crank axis; equation (10) of docs/synthesis.md.

    Parameters
    ----------
    requirements : (n, 5) columns of :func:`kernels.synthesis.rssp_on_locus`; phi1, f and alpha are not used
    ends : (n, 4) out [rad] in [0, 2 pi), ascending
    """
    for i in range(requirements.shape[0]):
        phi0 = requirements[i, 1]
        ends[i, 0], ends[i, 1] = 0.5 * math.pi, 1.5 * math.pi
        for k in range(2, 4):
            turned = (0.5 * math.pi - phi0 + (k - 2) * math.pi) % TWO_PI
            place = k
            while place > 0 and ends[i, place - 1] > turned:
                ends[i, place] = ends[i, place - 1]
                place -= 1
            ends[i, place] = turned
