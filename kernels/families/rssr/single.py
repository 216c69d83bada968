"""Largest acceleration over a grid of crank angles in float32: half the time of the dense loop, for sorting out only.

The constants of a design are computed in float64 and rounded once; the loop is float32.  docs/accuracy.md shows what
that costs: 1e-7 on ordinary designs, everything beyond a pressure angle of 89 degrees.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels.arithmetic.max_min import largest
from kernels.families.rssr.closure import Array, reduce_design
from kernels.families.rssr.derivatives import acceleration_fused, place_fused, rocker_fused, velocity_fused
from kernels.jit import kernel_fused

Singles: TypeAlias = NDArray[np.float32]


@kernel_fused
def dense_acceleration_single(designs: Array, cos_phi: Singles, sin_phi: Singles, max_abs_d2psi: Singles) -> None:
    """Compute the largest |psi''| over a grid of crank angles, in float32.

    Parameters
    ----------
    designs : (n, 8) columns of :class:`Design`, float64
    cos_phi, sin_phi : (m,) the grid
    max_abs_d2psi : (n,) out; nan for an invalid design, meaningless where the crank does not turn fully
    """
    # Constants of type float32: a Python number would make the whole expression float64.
    one, least = np.float32(1.0), np.float32(1e-30)
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        e, y0, ca = np.float32(r.e), np.float32(r.y0), np.float32(r.ca)
        k0, k1, k2 = np.float32(r.k0), np.float32(r.k1), np.float32(r.k2)
        most = np.float32(0.0)
        for j in range(cos_phi.size):
            place = place_fused(e, y0, ca, k0, k1, k2, cos_phi[j], sin_phi[j])
            t = np.sqrt(largest(place.delta, least))
            rocker = rocker_fused(place, t, one / (place.rr * t))
            second = acceleration_fused(rocker, place, velocity_fused(k1, k2, rocker, place))
            most = largest(most, abs(second.q))
        max_abs_d2psi[i] = most if r.valid else math.nan
