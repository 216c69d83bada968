"""Largest transfer functions over a grid of crank angles: the hot loop of a sweep."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels._jit import kernel_fused
from kernels.families.rssr.closure import Array, reduce_design
from kernels.reduce import largest, smallest

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
        least, m1, m2, m3 = 1e300, 0.0, 0.0, 0.0
        for j in range(cos_phi.size):
            u, v = cos_phi[j], sin_phi[j]
            hu, hv = r.ca * u, r.ca * v
            x, y, w1 = r.e - u, r.y0 + hv, r.k2 * u - r.k1 * v
            w = r.k0 - w1
            rr = x * x + y * y
            delta = rr - w * w
            least = smallest(least, delta)
            if max_abs_dpsi is not None or max_abs_d2psi is not None or max_abs_d3psi is not None:
                t = math.sqrt(largest(delta, 1e-300))
                shared = 1.0 / (rr * t)  # one division for 1/R and 1/T
                per_r, per_t = t * shared, rr * shared
                c, s = (x * w + y * t) * per_r, (x * t - y * w) * per_r
                w_ph = r.k1 * u + r.k2 * v
                g_ph = w_ph - (v * c - hu * s)
                p = g_ph * per_t  # -psi'
                if max_abs_dpsi is not None:
                    m1 = largest(m1, abs(p))
                    if values is not None:
                        values[j] = abs(p)
                if max_abs_d2psi is not None or max_abs_d3psi is not None:
                    g_phps = v * s + hu * c
                    q = (w1 - (u * c + hv * s) + p * (w * p - (g_phps + g_phps))) * per_t  # -psi''
                    if max_abs_d2psi is not None:
                        m2 = largest(m2, abs(q))
                        if values is not None:
                            values[j] = abs(q)
                    if max_abs_d3psi is not None:
                        g_phphps = u * s - hv * c
                        jerk = (
                            g_ph + p * (3.0 * g_phphps - p * (3.0 * (w_ph - g_ph) + t * p)) + 3.0 * q * (g_phps - w * p)
                        ) * per_t
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
            at[i] = 0
            for j in range(cos_phi.size):
                if values[j] == most:
                    at[i] = j
                    break
