"""E1, E2: longitudinal elasticity of the coupler: quasi-static lag of the follower and its periodic steady state.

The numbered formulas are those of docs/effects.md.  With p = c t_tau (signed) and eta = psi - psi_0 of the rigid
linkage

    J w^2 eta'' + h w p^2 eta' + (k p^2 + h w p p') eta = M - J w^2 psi_0''

A slider has c = 1, a mass for J, a force for M, and eta is a length.  Further stages, or a tool, that the follower
drives have an inertia and a load that depend on its angle, and so add to every coefficient.  The quasi-static effect is
pointwise.  The steady state couples the whole turn: the equation is given as eta'' + b eta' + c eta = r, and the
Fourier coefficients of eta solve a linear system with as many bands as b and c have harmonics, two for a linkage of one
crank and one follower.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.arithmetic.vectors import Vector
from kernels.curves.periodic import coefficients, series, significant, tail
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write
from kernels.types import Array, Status

Matrix = tuple[float, float, float, float]  # two by two, row by row

# Columns of the data matrix: inertia of the driven side J, coupler stiffness k, damping h, crank speed, torque M.
COLUMNS = ("inertia", "stiffness", "damping", "speed", "torque")

# The equation is linearised about the rigid motion: beyond this share of cos(pressure angle) it has no meaning.
LINEAR = 0.1
RESOLVED = 1e-9
PHASE_STEP = 0.1
KEPT = 1e-12  # share of its largest harmonic below which a Fourier coefficient is rounding


@kernel
def quasi_static(
    p: Array,
    d2psi: Array,
    c: Array,
    reach: Array,
    data: Array,
    status: Status,
    eta: Array | None,
    displacement: Array | None,
    frequency_ratio: Array | None,
    varying: Array | None = None,
) -> None:
    """Compute the follower's lag under inertia and load, its displacement at the joint, the frequency ratio.

    Parameters
    ----------
    p : (n, m), c t_tau, signed [length];  d2psi : (n, m), acceleration analogue of the rigid linkage
    c : (n,), radius of the driven joint, 1 of a slider;  data : (n, 5), see COLUMNS
    reach : (n,), scale of the lag: 1 for an angle, the coupler's length for a displacement
    status : (n, m), in and out; NOT_LINEAR where |eta| > 0.1 reach cos(pressure angle); the number stays
    eta, displacement, frequency_ratio : (n, m) or None; [rad], c eta [length], sqrt(k/J) |p| / speed
    varying : (n, m) or None; torque that is added to M over the turn
    """
    for i in range(p.shape[0]):
        inertia, stiffness, speed, torque = data[i, 0], data[i, 1], data[i, 3], data[i, 4]
        for j in range(p.shape[1]):
            load = torque
            if varying is not None:
                load = torque + varying[i, j]
            lag = (load - inertia * speed * speed * d2psi[i, j]) / (stiffness * p[i, j] * p[i, j])
            if status[i, j] == st.OK and not abs(lag) <= LINEAR * reach[i] * abs(p[i, j]) / c[i]:
                status[i, j] = st.NOT_LINEAR
            good = 1.0 if status[i, j] == st.OK or status[i, j] == st.NOT_LINEAR else math.nan
            write(eta, i, j, good * lag)
            write(displacement, i, j, good * c[i] * lag)
            write(frequency_ratio, i, j, good * math.sqrt(stiffness / inertia) * abs(p[i, j]) / speed)


class Steady(NamedTuple):
    """Periodic steady state of the lag.

    Parameters
    ----------
    status : (n,) NOT_CONVERGED where N does not resolve the solution (tail above 1e-9) or a multiplier exceeds 1,
        NOT_LINEAR where |eta| > 0.1 reach cos(pressure angle) somewhere (the numbers stay), NOT_ROTATABLE where p is
        nan
    eta, elongation : (n, m) [rad], [length];  floquet : (n,) largest modulus of the multipliers, or nan
    """

    status: Status
    eta: Array
    elongation: Array
    floquet: Array


@kernel
def steady_state(
    p: Array, b: Array, c: Array, r: Array, radius: Array, reach: Array, phi: Array, last: bool, found: Steady
) -> None:
    """Compute the periodic steady state of the lag and the largest Floquet multiplier from coefficients on a grid.

    Parameters
    ----------
    p : (n, N) c t_tau, on the grid phi_j = 2 pi j/N, N odd
    b, c, r : (n, N) coefficients of eta'' + b eta' + c eta = r
    radius : (n,) c of the driven joint
    reach : (n,), see `quasi_static`
    phi : (n, m) or (1, m), where eta and elongation are wanted
    last : whether no finer grid follows
    found : out
    """
    n, (status, eta, elongation, floquet) = p.shape[1], found
    half = (n + 1) // 2
    turn, bc, bs, cc, cs = np.empty((4, half)), np.empty(half), np.empty(half), np.empty(half), np.empty(half)
    qc, qs, ec, es, square = np.empty(half), np.empty(half), np.empty(half), np.empty(half), np.empty(n)
    for i in range(p.shape[0]):
        row, bad = i if phi.shape[0] > 1 else 0, False
        for j in range(n):
            square[j] = p[i, j] * p[i, j]
            bad = bad or not math.isfinite(b[i, j] + c[i, j] + r[i, j] + square[j])
        if bad:
            status[i], floquet[i] = st.NOT_ROTATABLE, math.nan
            eta[i, :], elongation[i, :] = math.nan, math.nan
            continue
        coefficients(b[i], turn, bc, bs)
        coefficients(c[i], turn, cc, cs)
        coefficients(square, turn, qc, qs)
        coefficients(r[i], turn, ec, es)
        nb, nc, nq = significant(bc, bs, KEPT), significant(cc, cs, KEPT), significant(qc, qs)
        periodic_solution(bc[:nb], bs[:nb], cc[:nc], cs[:nc], ec, es)
        resolved = tail(ec, es, 0.0) < RESOLVED
        floquet[i] = math.nan
        if resolved or last:
            floquet[i] = largest_multiplier(bc[:nb], bs[:nb], cc[:nc], cs[:nc])
        # Without damping the multipliers are 1 exactly, and c is known to KEPT of its size.
        status[i] = st.OK if resolved and floquet[i] <= 1.0 + 1e3 * KEPT else st.NOT_CONVERGED
        for j in range(n):
            lag = series(ec, es, 2.0 * math.pi * j / n)[0] if status[i] == st.OK else 0.0
            if not abs(lag) <= LINEAR * reach[i] * abs(p[i, j]) / radius[i]:
                status[i] = st.NOT_LINEAR
        for j in range(phi.shape[1]):
            value = series(ec, es, phi[row, j])[0] if status[i] != st.NOT_CONVERGED else math.nan
            eta[i, j] = value
            # p^2 has few harmonics, and p keeps its sign over a turn.
            lever = math.sqrt(series(qc[:nq], qs[:nq], phi[row, j])[0])
            elongation[i, j] = value * math.copysign(lever, p[i, 0])


@inline
def _harmonic(cosines: Array, sines: Array, step: int) -> complex:
    """Complex coefficient of harmonic ``step`` of a series; harmonics beyond its end are zero."""
    k = abs(step)
    if k >= cosines.size:
        return complex(0.0, 0.0)
    if k == 0:
        return complex(cosines[0], 0.0)
    return complex(0.5 * cosines[k], -0.5 * sines[k] if step > 0 else 0.5 * sines[k])


@kernel
def periodic_solution(bc: Array, bs: Array, cc: Array, cs: Array, c: Array, s: Array) -> None:
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
def solve_band(band: NDArray[np.complex128], x: NDArray[np.complex128], w: int, c: Array, s: Array) -> None:
    """Solve a banded system for the harmonics -K..K of eta, by elimination with row pivoting; write its series.

    ``band`` (2 K + 1, 3 w + 1) has the diagonal in column w; ``band`` and the right side ``x`` are overwritten.
    """
    order, size = c.size - 1, x.size
    for column in range(size):
        low, right = min(column + w, size - 1), min(column + 2 * w, size - 1)
        pivot, best = column, -1.0
        for row in range(column, low + 1):
            entry = band[row, column - row + w]
            square = entry.real * entry.real + entry.imag * entry.imag
            if square > best:
                pivot, best = row, square
        if pivot != column:
            for k in range(column, right + 1):
                here, there = k - column + w, k - pivot + w
                band[column, here], band[pivot, there] = band[pivot, there], band[column, here]
            x[column], x[pivot] = x[pivot], x[column]
        per = band[column, w].conjugate() * (1.0 / best)
        band[column, w] = per
        for row in range(column + 1, low + 1):
            factor = band[row, column - row + w] * per
            for k in range(column + 1, right + 1):
                band[row, k - row + w] -= factor * band[column, k - column + w]
            x[row] -= factor * x[column]
    for back in range(size):
        row = size - 1 - back
        for k in range(row + 1, min(row + 2 * w, size - 1) + 1):
            x[row] -= band[row, k - row + w] * x[k]
        x[row] *= band[row, w]
    for k in range(order + 1):
        value = x[order + k]
        c[k], s[k] = (2.0 * value.real, -2.0 * value.imag) if k > 0 else (value.real, 0.0)


@kernel
def largest_multiplier(bc: Array, bs: Array, cc: Array, cs: Array) -> float:
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
    # The product of the multipliers depends on the mean of b alone (Liouville).
    return modulus_of(m11 + m22, math.exp(-math.pi * bc[0]))


@inline
def magnus_step(m: Matrix, step: float, q: Vector, d: Vector) -> Matrix:
    """Take (eta, eta') over one step of eta'' + d eta' + q eta = 0; q and d at its start, middle and end."""
    mean_q, mean_d = (q[0] + 4.0 * q[1] + q[2]) / 6.0, (d[0] + 4.0 * d[1] + d[2]) / 6.0
    # A = [[0, 1], [-q, -d]]; [A1, A2 - A0] = [[-dq, -dd], [d1 dq - q1 dd, dq]].
    dq, dd = q[2] - q[0], d[2] - d[0]
    t = step * step / 12.0
    w11, w12 = t * dq, step + t * dd
    w21, w22 = -step * mean_q - t * (d[1] * dq - q[1] * dd), -step * mean_d - t * dq
    mean = 0.5 * (w11 + w22)
    square = 0.25 * (w11 - w22) * (w11 - w22) + w12 * w21
    root = math.sqrt(abs(square))
    if square < 0.0:
        even, odd = math.cos(root), math.sin(root) / root
    else:
        even, odd = math.cosh(root), math.sinh(root) / root if root > 1e-8 else 1.0
    factor = math.exp(mean)
    e11, e12 = factor * (even + odd * (w11 - mean)), factor * odd * w12
    e21, e22 = factor * odd * w21, factor * (even + odd * (w22 - mean))
    return e11 * m[0] + e12 * m[2], e11 * m[1] + e12 * m[3], e21 * m[0] + e22 * m[2], e21 * m[1] + e22 * m[3]


@inline
def modulus_of(trace: float, modulus: float) -> float:
    """Larger modulus of two multipliers with the sum ``trace`` and the product ``modulus`` squared."""
    discriminant = 0.25 * trace * trace - modulus * modulus
    return modulus if discriminant < 0.0 else abs(0.5 * trace) + math.sqrt(discriminant)
