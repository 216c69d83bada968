"""E2 where the driven side changes over the turn: periodic steady state of eta'' + b eta' + c eta = r.

An elastic coupler that drives further stages, or a tool, drives an inertia and a load that depend on the follower's
angle.  The linear equation then has two periodic coefficients of its own (docs/effects.md (5) of the elasticities)
instead of the one, p^2, of :mod:`kernels.effects.elasticity`.  The methods are the same: Fourier coefficients by
Gaussian elimination in a band, Floquet multipliers by Magnus steps.
"""

from __future__ import annotations

import math

import numpy as np

from kernels import status as st
from kernels.curves.periodic import coefficients, series, significant, tail
from kernels.effects.elasticity import LINEAR, PHASE_STEP, RESOLVED, Steady, magnus_step, modulus_of, solve_band
from kernels.jit import inline, kernel
from kernels.types import Array

KEPT = 1e-12  # share of its largest harmonic below which a coefficient is the rounding of what it is made of


@inline
def _harmonic(cosines: Array, sines: Array, step: int) -> complex:
    """Complex coefficient of a series; harmonics that it does not have are zero."""
    k = abs(step)
    if k >= cosines.size:
        return complex(0.0, 0.0)
    if k == 0:
        return complex(cosines[0], 0.0)
    return complex(0.5 * cosines[k], -0.5 * sines[k] if step > 0 else 0.5 * sines[k])


@kernel
def driven_solution(bc: Array, bs: Array, cc: Array, cs: Array, c: Array, s: Array) -> None:
    """Solve eta'' + b eta' + c eta = r for the series of eta.

    ``bc``, ``bs`` and ``cc``, ``cs`` series of b and c;  ``c``, ``s`` (K + 1,) series of r in, of eta out.
    """
    order, w = c.size - 1, max(bc.size, cc.size) - 1
    size, width = 2 * order + 1, 3 * w + 1
    band, x = np.zeros((size, width), np.complex128), np.empty(size, np.complex128)
    for row in range(size):
        m = row - order
        x[row] = _harmonic(c, s, m)
        for step in range(-w, w + 1):
            if 0 <= row - step < size:
                # harmonic m of the products: b_step i (m - step) + c_step times harmonic m - step of eta
                entry = _harmonic(bc, bs, step) * complex(0.0, float(m - step)) + _harmonic(cc, cs, step)
                band[row, w - step] = entry
        band[row, w] -= m * m
    solve_band(band, x, w, c, s)


@kernel
def driven_multiplier(bc: Array, bs: Array, cc: Array, cs: Array) -> float:
    """Largest modulus of the multipliers of eta'' + b eta' + c eta = 0 by Magnus steps of fourth order."""
    largest = 0.0
    for k in range(cc.size):
        largest += math.hypot(cc[k], cs[k])
    steps = int(2.0 * math.pi * max(math.sqrt(largest), float(max(cc.size, bc.size))) / PHASE_STEP) + 1
    step = 2.0 * math.pi / steps
    m11, m12, m21, m22 = 1.0, 0.0, 0.0, 1.0
    q0, d0 = series(cc, cs, 0.0)[0], series(bc, bs, 0.0)[0]
    for j in range(steps):
        half, end = step * (j + 0.5), step * (j + 1.0)
        q1, d1 = series(cc, cs, half)[0], series(bc, bs, half)[0]
        q2, d2 = series(cc, cs, end)[0], series(bc, bs, end)[0]
        m11, m12, m21, m22 = magnus_step((m11, m12, m21, m22), step, (q0, q1, q2), (d0, d1, d2))
        q0, d0 = q2, d2
    # The product of the multipliers is what the mean of b alone makes of it (Liouville).
    return modulus_of(m11 + m22, math.exp(-math.pi * bc[0]))


@kernel
def driven_steady_state(
    p: Array, b: Array, c: Array, r: Array, radius: Array, reach: Array, phi: Array, last: bool, found: Steady
) -> None:
    """Compute the periodic steady state of the lag and the largest Floquet multiplier from coefficients on a grid.

    Parameters
    ----------
    p : (n, N) c t_tau, on the grid phi_j = 2 pi j/N, N odd
    b, c, r : (n, N) coefficients of eta'' + b eta' + c eta = r
    radius : (n,) c of the driven joint
    reach, phi, last, found : as in :func:`kernels.effects.elasticity.steady_state`
    """
    n, (status, eta, elongation, floquet) = p.shape[1], found
    half = (n + 1) // 2
    turn, bc, bs, cc, cs = np.empty((4, half)), np.empty(half), np.empty(half), np.empty(half), np.empty(half)
    pc, ps, ec, es = np.empty(half), np.empty(half), np.empty(half), np.empty(half)
    for i in range(p.shape[0]):
        row, bad = i if phi.shape[0] > 1 else 0, False
        for j in range(n):
            bad = bad or not math.isfinite(b[i, j] + c[i, j] + r[i, j] + p[i, j])
        if bad:
            status[i], floquet[i] = st.NOT_ROTATABLE, math.nan
            eta[i, :], elongation[i, :] = math.nan, math.nan
            continue
        coefficients(b[i], turn, bc, bs)
        coefficients(c[i], turn, cc, cs)
        coefficients(p[i], turn, pc, ps)
        coefficients(r[i], turn, ec, es)
        nb, nc = significant(bc, bs, KEPT), significant(cc, cs, KEPT)
        driven_solution(bc[:nb], bs[:nb], cc[:nc], cs[:nc], ec, es)
        resolved = tail(ec, es, 0.0) < RESOLVED
        floquet[i] = math.nan
        if resolved or last:
            floquet[i] = driven_multiplier(bc[:nb], bs[:nb], cc[:nc], cs[:nc])
        # Without damping the multipliers are 1 exactly, and c is known to KEPT of its size.
        status[i] = st.OK if resolved and floquet[i] <= 1.0 + 1e3 * KEPT else st.NOT_CONVERGED
        for j in range(n):
            lag = series(ec, es, 2.0 * math.pi * j / n)[0] if status[i] == st.OK else 0.0
            if not abs(lag) <= LINEAR * reach[i] * abs(p[i, j]) / radius[i]:
                status[i] = st.NOT_LINEAR
        for j in range(phi.shape[1]):
            value = series(ec, es, phi[row, j])[0] if status[i] != st.NOT_CONVERGED else math.nan
            eta[i, j] = value
            elongation[i, j] = value * series(pc, ps, phi[row, j])[0]
