"""Ellipse of the coupler direction of the spatial slider-crank, for the extrema of its pressure angle."""

from __future__ import annotations

import math

from kernels._jit import kernel
from kernels.families.rssp.closure import Array


@kernel
def pressure_ellipse(designs: Array, ellipse: Array) -> None:
    """Compute the ellipse that the coupler direction draws in the plane across the slide;
    see kernels.effects.pressure_extrema.

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
