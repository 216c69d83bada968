"""E1, E2: longitudinal elasticity of the coupler: quasi-static lag of the follower and its periodic steady state.

Dynamics sheet, section 5.  With p = c t_tau (signed) and eta = psi - psi_0 of the rigid linkage

    J w^2 eta'' + h w p^2 eta' + (k p^2 + h w p p') eta = M - J w^2 psi_0''

The linkage enters only through p and psi_0''.  The quasi-static effect is pointwise; the steady state couples the whole
turn, so it is computed on a uniform odd grid by Fourier collocation and carried to any angle by its series.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.periodic import coefficients, series, significant, tail

Array = NDArray[np.float64]
Status = NDArray[np.uint8]

# Columns of the data matrix: inertia of the driven side J, coupler stiffness k, damping h, crank speed, torque M.
COLUMNS = ("inertia", "stiffness", "damping", "speed", "torque")

# The equation is linearised about the rigid motion: beyond this share of cos(pressure angle) it has no meaning.
LINEAR = 0.1
RESOLVED = 1e-9
PHASE_STEP = 0.1


@kernel
def quasi_static(
    p: Array,
    d2psi: Array,
    c: Array,
    data: Array,
    status: Status,
    eta: Array | None,
    displacement: Array | None,
    frequency_ratio: Array | None,
) -> None:
    """Lag of the follower under inertia and load, its displacement at the joint, and the frequency ratio.

    Parameters
    ----------
    p : (n, m), c t_tau, signed [length];  d2psi : (n, m), acceleration analogue of the rigid linkage
    c : (n,), radius of the driven joint;  data : (n, 5), see COLUMNS
    status : (n, m), in and out; NOT_LINEAR where |eta| > 0.1 cos(pressure angle); the number stays
    eta, displacement, frequency_ratio : (n, m) or None; [rad], c eta [length], sqrt(k/J) |p| / speed
    """
    for i in range(p.shape[0]):
        inertia, stiffness, speed, torque = data[i, 0], data[i, 1], data[i, 3], data[i, 4]
        for j in range(p.shape[1]):
            lag = (torque - inertia * speed * speed * d2psi[i, j]) / (stiffness * p[i, j] * p[i, j])
            if status[i, j] == st.OK and not abs(lag) <= LINEAR * abs(p[i, j]) / c[i]:
                status[i, j] = st.NOT_LINEAR
            good = 1.0 if status[i, j] == st.OK or status[i, j] == st.NOT_LINEAR else math.nan
            if eta is not None:
                eta[i, j] = good * lag
            if displacement is not None:
                displacement[i, j] = good * c[i] * lag
            if frequency_ratio is not None:
                frequency_ratio[i, j] = good * math.sqrt(stiffness / inertia) * abs(p[i, j]) / speed


@kernel
def steady_state(
    p: Array, d2psi: Array, c: Array, data: Array, phi: Array, last: bool, status: Status, eta: Array,
    elongation: Array, floquet: Array,
) -> None:  # fmt: skip
    """Periodic steady state of the lag and the largest Floquet multiplier.

    Parameters
    ----------
    p, d2psi : (n, N) on the grid phi_j = 2 pi j / N, N odd;  c : (n,);  data : (n, 5), see COLUMNS
    phi : (n, m) or (1, m), where eta and elongation are wanted
    last : whether no finer grid follows
    status : (n,) out; NOT_CONVERGED where N does not resolve the solution (tail above 1e-9) or a multiplier reaches 1,
        NOT_LINEAR where |eta| > 0.1 cos(pressure angle) somewhere (the numbers stay), NOT_ROTATABLE where p is nan
    eta, elongation : (n, m) out [rad], [length];  floquet : (n,) out, largest modulus or nan
    """
    n = p.shape[1]
    first = np.empty((n, n))
    for j in range(n):
        for k in range(n):
            sign = 1.0 if (j - k) % 2 == 0 else -1.0
            first[j, k] = 0.0 if j == k else 0.5 * sign / math.sin(math.pi * (j - k) / n)
    second = first @ first
    half = (n + 1) // 2
    all_pc, all_ps, all_ec, all_es = np.empty(half), np.empty(half), np.empty(half), np.empty(half)
    matrix, right = np.empty((n, n)), np.empty(n)
    for i in range(p.shape[0]):
        inertia, stiffness, damping, speed, torque = data[i, 0], data[i, 1], data[i, 2], data[i, 3], data[i, 4]
        row = i if phi.shape[0] > 1 else 0
        bad = False
        for j in range(n):
            bad = bad or not math.isfinite(p[i, j] * d2psi[i, j])
        if bad:
            status[i], floquet[i] = st.NOT_ROTATABLE, math.nan
            eta[i, :], elongation[i, :] = math.nan, math.nan
            continue
        coefficients(p[i], all_pc, all_ps)
        count = significant(all_pc, all_ps)
        pc, ps = all_pc[:count], all_ps[:count]
        mass = inertia * speed * speed
        for j in range(n):
            slope = series(pc, ps, 2.0 * math.pi * j / n)[1]
            square = p[i, j] * p[i, j]
            for k in range(n):
                matrix[j, k] = second[j, k] + damping * speed / mass * square * first[j, k]
            matrix[j, j] += (stiffness * square + damping * speed * p[i, j] * slope) / mass
            right[j] = torque / mass - d2psi[i, j]
        lag = np.linalg.solve(matrix, right)
        coefficients(lag, all_ec, all_es)  # type: ignore[arg-type]
        count = significant(all_ec, all_es)
        ec, es = all_ec[:count], all_es[:count]
        resolved = tail(all_ec, all_es, 0.0) < RESOLVED
        # The multiplier asks only that p be resolved; a grid that is too coarse for the lag is left before it.
        floquet[i] = math.nan
        if resolved or last:
            floquet[i] = _largest_multiplier(pc, ps, stiffness / mass, damping * speed / mass)
        status[i] = st.OK if resolved and floquet[i] < 1.0 else st.NOT_CONVERGED
        for j in range(n):
            if status[i] == st.OK and not abs(lag[j]) <= LINEAR * abs(p[i, j]) / c[i]:
                status[i] = st.NOT_LINEAR
        for j in range(phi.shape[1]):
            value = series(ec, es, phi[row, j])[0] if status[i] != st.NOT_CONVERGED else math.nan
            eta[i, j] = value
            elongation[i, j] = value * series(pc, ps, phi[row, j])[0]


@inline
def _largest_multiplier(pc: Array, ps: Array, stiffness: float, damping: float) -> float:
    """Largest modulus of the multipliers of eta'' + damping p^2 eta' + (stiffness p^2 + damping p p') eta = 0.

    Fourth-order Magnus steps: exact for constant p, so stiff couplers need no smaller step than the phase asks for.
    """
    largest = 0.0
    for k in range(pc.size):
        largest += math.hypot(pc[k], ps[k])
    steps = int(2.0 * math.pi * max(math.sqrt(stiffness) * largest, float(pc.size)) / PHASE_STEP) + 1
    step = 2.0 * math.pi / steps
    m11, m12, m21, m22 = 1.0, 0.0, 0.0, 1.0
    q0, d0 = _rates(pc, ps, 0.0, stiffness, damping)
    for j in range(steps):
        q1, d1 = _rates(pc, ps, step * (j + 0.5), stiffness, damping)
        q2, d2 = _rates(pc, ps, step * (j + 1.0), stiffness, damping)
        q, d = (q0 + 4.0 * q1 + q2) / 6.0, (d0 + 4.0 * d1 + d2) / 6.0
        # A = [[0, 1], [-q, -d]]; [A1, A2 - A0] = [[-dq, -dd], [d1 dq - q1 dd, dq]].
        dq, dd = q2 - q0, d2 - d0
        t = step * step / 12.0
        w11, w12 = t * dq, step + t * dd
        w21, w22 = -step * q - t * (d1 * dq - q1 * dd), -step * d - t * dq
        mean = 0.5 * (w11 + w22)
        square = 0.25 * (w11 - w22) * (w11 - w22) + w12 * w21
        if square < 0.0:
            root = math.sqrt(-square)
            even, odd = math.cos(root), math.sin(root) / root
        else:
            root = math.sqrt(square)
            even, odd = math.cosh(root), math.sinh(root) / root if root > 1e-8 else 1.0
        factor = math.exp(mean)
        e11, e12 = factor * (even + odd * (w11 - mean)), factor * odd * w12
        e21, e22 = factor * odd * w21, factor * (even + odd * (w22 - mean))
        m11, m12, m21, m22 = (
            e11 * m11 + e12 * m21, e11 * m12 + e12 * m22, e21 * m11 + e22 * m21, e21 * m12 + e22 * m22,
        )  # fmt: skip
        q0, d0 = q2, d2
    trace, determinant = m11 + m22, m11 * m22 - m12 * m21
    discriminant = 0.25 * trace * trace - determinant
    if discriminant < 0.0:
        return math.sqrt(determinant)
    return abs(0.5 * trace) + math.sqrt(discriminant)


@inline
def _rates(pc: Array, ps: Array, phi: float, stiffness: float, damping: float) -> tuple[float, float]:
    value, slope = series(pc, ps, phi)
    return stiffness * value * value + damping * value * slope, damping * value * value
