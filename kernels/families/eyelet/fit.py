"""What a least-squares fit of an eyelet to a wanted P(phi) works with: weighted difference and analytic Jacobian."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import kernel
from kernels.families.eyelet.motion import eyelet, poses, reduce_design
from kernels.thread_path import length
from kernels.vectors import dot, norm, scale, sub

Array = NDArray[np.float64]
Status = NDArray[np.uint8]


@kernel
def weighted_difference(
    designs: Array, cos_phi: Array, sin_phi: Array, wanted: Array, difference: Array, weight: Array, status: Status
) -> None:
    """Compute the weighted difference (27) and its weight; docs/takeup.md (7), (8).

    Parameters
    ----------
    designs : (n, 12) columns of :class:`kernels.families.eyelet.motion.Design`, guides on the line x = e, y = 0
    cos_phi, sin_phi : (n, m) or (1, m);  wanted : (n, m) or (1, m), wanted P [length]
    difference : (n, m) out, Dq [length^2];  weight : (n, m) out, dDq/dP at the design's own length [length]
    status : (n, m) out, as of :func:`kernels.families.eyelet.motion.poses`; INVALID_INPUT also where P_h + P <= 0 or a
        guide is off the line x = e, y = 0, for which (27) does not hold
    """
    poses(designs, cos_phi, sin_phi, status, None, None, None, None, None, None, None, None)
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row, target = i if cos_phi.shape[0] > 1 else 0, i if wanted.shape[0] > 1 else 0
        on_line = designs[i, 8] == 0.0 and designs[i, 9] == 0.0 and designs[i, 10] == 0.0 and designs[i, 11] == 0.0
        for j in range(cos_phi.shape[1]):
            place = eyelet(r, cos_phi[row, j], sin_phi[row, j])[0]
            d1, d2 = sub(place, r.n1), sub(place, r.n2)
            whole = r.store + wanted[target, j] / r.unit
            if status[i, j] == st.OK and not (whole > 0.0 and on_line):
                status[i, j] = st.INVALID_INPUT
            good = 1.0 if status[i, j] == st.OK else math.nan
            r1, r2 = norm(d1), norm(d2)
            # (27) as a product: zero to rounding exactly where the thread has the wanted length.
            # r1^2 - ((r2^2 - r1^2 - L^2)/(2L))^2 = -((L - r1)^2 - r2^2)((L + r1)^2 - r2^2)/(4 L^2)
            first = (whole - r1 - r2) * (whole - r1 + r2)
            second = (whole + r1 - r2) * (whole + r1 + r2)
            difference[i, j] = -good * first * second / (4.0 * whole * whole) * r.unit * r.unit
            weight[i, j] = -good * 2.0 * r1 * r2 / length(place, r.n1, r.n2) * r.unit


@kernel
def length_sensitivities(designs: Array, cos_phi: Array, sin_phi: Array, jacobian: Array, status: Status) -> None:
    """Compute partial derivatives of L with respect to a, e, f, alpha, Z1, Z2, phi_h; docs/takeup.md (9).

    Parameters
    ----------
    designs : (n, 12) columns of :class:`kernels.families.eyelet.motion.Design`
    cos_phi, sin_phi : (n, m) or (1, m)
    jacobian : (7, n, m) out [1 or length/rad]; nan where the status is not OK
    status : (n, m) out, as of :func:`kernels.families.eyelet.motion.poses`
    """
    poses(designs, cos_phi, sin_phi, status, None, None, None, None, None, None, None, None)
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            place, turning, _ = eyelet(r, cos_phi[row, j], sin_phi[row, j])
            d1, d2 = sub(place, r.n1), sub(place, r.n2)
            good = 1.0 if status[i, j] == st.OK else math.nan
            u1, u2 = scale(good / norm(d1), d1), scale(good / norm(d2), d2)
            g = (u1[0] + u2[0], u1[1] + u2[1], u1[2] + u2[2])
            jacobian[0, i, j] = dot(g, sub(place, r.centre)) / r.a
            jacobian[1, i, j] = -g[0]
            jacobian[2, i, j] = g[1] * r.sin_alpha + g[2] * r.cos_alpha
            # Turning by alpha about x: E_alpha = (0, E_z, -E_y); f turns the same way.
            jacobian[3, i, j] = (g[1] * place[2] - g[2] * place[1]) * r.unit
            jacobian[4, i, j] = -u1[2]
            jacobian[5, i, j] = -u2[2]
            jacobian[6, i, j] = dot(g, turning) * r.unit
