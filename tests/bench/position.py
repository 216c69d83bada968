"""The dense loop with the position alone: the least that any output of the motion costs."""

from __future__ import annotations

import math

from kernels.arithmetic.intrinsics import largest, smallest
from kernels.families.rssr.closure import reduce_design
from kernels.jit import kernel_fused
from kernels.types import Array


@kernel_fused
def range_of_sine(designs: Array, cos_phi: Array, sin_phi: Array, low: Array, high: Array) -> None:
    """Smallest and largest sin(psi) over a grid of crank angles."""
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        least, most = 1.0, -1.0
        for j in range(cos_phi.size):
            u, v = cos_phi[j], sin_phi[j]
            x, y, w = r.e - u, r.y0 + r.ca * v, r.k0 + r.k1 * v - r.k2 * u
            rr = x * x + y * y
            sine = (y * w - x * math.sqrt(largest(rr - w * w, 1e-300))) / rr
            least, most = smallest(least, sine), largest(most, sine)
        low[i], high[i] = least, most
