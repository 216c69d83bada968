"""Largest transfer functions over a grid of crank angles: the hot loop of a sweep."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels.arithmetic.intrinsics import largest, smallest
from kernels.families.rssr.closure import Array, reduce_design
from kernels.families.rssr.derivatives import (
    acceleration_fused,
    jerk_fused,
    place_fused,
    rocker_fused,
    velocity_fused,
)
from kernels.jit import kernel_fused

Indices: TypeAlias = NDArray[np.int64]


@kernel_fused
def dense_maxima(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    min_delta: Array,
    max_abs_dpsi: Array | None,
    max_abs_d2psi: Array | None,
    max_abs_d3psi: Array | None,
    at: Indices | None = None,
    values: Array | None = None,
) -> None:
    """Largest |psi'|, |psi''|, |psi'''| over a grid of crank angles, and the smallest Delta; the sweep's hot loop.

    Parameters
    ----------
    designs : (n, 8) columns of :class:`Design`
    cos_phi, sin_phi : (m,) the grid, shared by all designs; m a multiple of 8 is fastest
    min_delta : (n,) out, smallest Delta/b^2 on the grid; where it is not positive the maxima mean nothing
    max_abs_dpsi, max_abs_d2psi, max_abs_d3psi : (n,) out, or None: not computed, not compiled
    at : (n,) int64 out, or None: position on the grid of the largest value of the highest order wanted
    values : (m,) scratch, needed with ``at``

    Notes
    -----
    Delta is clamped to a tiny positive number under the root, so the loop has no branch and vectorises;
    the unclamped minimum tells whether the clamp was used.  An invalid design has min_delta nan.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        # The helpers of this loop are contracted like the loop itself: a product and a sum become one instruction.
        least, m1, m2, m3 = 1e300, 0.0, 0.0, 0.0
        for j in range(cos_phi.size):
            place = place_fused(r.e, r.y0, r.ca, r.k0, r.k1, r.k2, cos_phi[j], sin_phi[j])
            least = smallest(least, place.delta)
            if max_abs_dpsi is not None or max_abs_d2psi is not None or max_abs_d3psi is not None:
                # A clamp instead of a branch; the minimum of the discriminant itself tells that it was used.
                t = math.sqrt(largest(place.delta, 1e-300))
                rocker = rocker_fused(place, t, 1.0 / (place.rr * t))
                first = velocity_fused(r.k1, r.k2, rocker, place)
                if max_abs_dpsi is not None:
                    m1 = largest(m1, abs(first.p))
                    if values is not None:
                        values[j] = abs(first.p)
                if max_abs_d2psi is not None or max_abs_d3psi is not None:
                    second = acceleration_fused(rocker, place, first)
                    if max_abs_d2psi is not None:
                        m2 = largest(m2, abs(second.q))
                        if values is not None:
                            values[j] = abs(second.q)
                    if max_abs_d3psi is not None:
                        jerk = jerk_fused(rocker, place, first, second)
                        m3 = largest(m3, abs(jerk))
                        if values is not None:
                            values[j] = abs(jerk)
        min_delta[i] = least / (r.coupler * r.coupler) if r.valid else math.nan
        if max_abs_dpsi is not None:
            max_abs_dpsi[i] = m1
        if max_abs_d2psi is not None:
            max_abs_d2psi[i] = m2
        if max_abs_d3psi is not None:
            max_abs_d3psi[i] = m3
        if at is not None and values is not None:
            most = m3 if max_abs_d3psi is not None else (m2 if max_abs_d2psi is not None else m1)
            # The maximum is one of the stored values, so it is found again by equality.
            at[i] = 0
            for j in range(cos_phi.size):
                if values[j] == most:
                    at[i] = j
                    break
