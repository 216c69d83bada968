"""Largest transfer functions of the geared dwell drive over a grid of carrier angles: the sweep's hot loop."""

from __future__ import annotations

import math

from kernels import status as st
from kernels._jit import kernel_fused
from kernels.families.geared_dwell.closure import Array, Status, reduce_design
from kernels.reduce import largest, smallest


@kernel_fused
def dense_maxima(
    designs: Array,
    front: Array,
    back: Array,
    status: Status,
    max_abs_dpsi: Array | None,
    max_abs_d2psi: Array | None,
    max_abs_d3psi: Array | None,
) -> None:
    """Compute the largest |psi'|, |psi''|, |psi'''| over a grid of carrier angles; the sweep's hot loop.

    Parameters
    ----------
    designs : (n, 2) columns of :class:`Design`
    front, back : (2, m) rows t = 1 - cos(phi), sin(phi) of the grid in [0, pi/2], and t = 1 + cos(phi), sin(phi) in
        (pi/2, pi]; the other half of the turn is its mirror image and adds nothing
    status : (n,) out; OK, SINGULAR or INVALID_INPUT
    max_abs_dpsi, max_abs_d2psi, max_abs_d3psi : (n,) out, or None: not computed, not compiled

    Notes
    -----
    D is clamped before the division, so the loop has no branch and vectorises; a design whose pin passes through the
    axis, on the grid or between its points, is nan with status SINGULAR.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        least, m1, m2, m3 = 1e300, 0.0, 0.0, 0.0
        for side in range(2):
            h = r.front if side == 0 else r.back
            grid = front if side == 0 else back
            for j in range(grid.shape[1]):
                t, s = grid[0, j], grid[1, j]
                # The pin as in closure.pin near phi = 0, written out without that one's branch, so that it vectorises.
                ss = s * s
                x, y = h.e - 2.0 * t + 2.0 * h.k * ss, 2.0 * s * (h.below + h.k * t)
                square = x * x + y * y
                least = smallest(least, square)
                # A clamp instead of a branch; ``least`` tells that it was used.
                per = 1.0 / largest(square, 1e-100)
                if max_abs_dpsi is not None:
                    m1 = largest(m1, abs(1.0 - h.total * (h.e - 2.0 * t) * per))
                if max_abs_d2psi is not None or max_abs_d3psi is not None:
                    q = (h.q0 + t * (h.q1 + r.ak4 * t)) * per
                    if max_abs_d2psi is not None:
                        m2 = largest(m2, abs(s * q) * per)
                    if max_abs_d3psi is not None:
                        q_t, d_t = h.q1 + 2.0 * r.ak4 * t, h.d1 - 2.0 * r.ak4 * t
                        bend = (1.0 - t) * q + ss * (q_t - 2.0 * q * d_t) * per
                        m3 = largest(m3, abs(bend) * per)
        code = st.OK
        if not r.valid:
            code = st.INVALID_INPUT
        elif not r.regular or least <= 1e-100:
            code = st.SINGULAR
        status[i] = code
        scale = 2.0 * abs(r.front.total) if code == st.OK else math.nan
        if max_abs_dpsi is not None:
            max_abs_dpsi[i] = m1 if code == st.OK else math.nan
        if max_abs_d2psi is not None:
            max_abs_d2psi[i] = scale * m2
        if max_abs_d3psi is not None:
            max_abs_d3psi[i] = scale * m3
