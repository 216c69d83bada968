"""How the deviation and the travel of the guided point depend on the parameters; equation numbers of docs/guide.md."""

from __future__ import annotations

import math

import numpy as np

from kernels import status as st
from kernels._jit import kernel
from kernels.families.guide.closure import EPS, Array, Status, place, reduce_design
from kernels.families.guide.motion import poses


@kernel
def point_shares(designs: Array, shares: Array) -> None:
    """Compute the guided point as a combination of the two turning angles, (4).

    Travel is s = p1 u - p2 v + q1 C - q2 S + a constant, deviation is dev = p2 u + p1 v + q2 C + q1 S + constant.

    Parameters
    ----------
    designs : (n, 9) columns of :class:`Design`
    shares : (n, 8) out [length]; p1, p2, q1, q2, bounds of the rounding errors of the p and of the q, the constant of
        dev and a bound of its rounding error
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        reach = abs(r.xi) + abs(r.eta)
        shares[i, 0], shares[i, 1] = r.p_along * r.unit, r.p_across * r.unit
        shares[i, 2], shares[i, 3] = r.q_along * r.unit, r.q_across * r.unit
        # l/b is rounded once, sine and cosine to one unit in the last place, then two products and two sums.
        shares[i, 4], shares[i, 5] = 10.0 * EPS * r.a * (1.0 + reach) * r.unit, 8.0 * EPS * r.c * reach * r.unit
        shares[i, 6] = r.across0 * r.unit
        shares[i, 7] = 10.0 * EPS * reach * abs(r.e) * r.unit + 2.0 * EPS * abs(designs[i, 7])


@kernel
def dev_sensitivities(designs: Array, cos_phi: Array, sin_phi: Array, sensitivities: Array, status: Status) -> None:
    """Compute partial derivatives of dev with respect to phi, a, b, c, e, xi, eta, lam, h; (8).

    Parameters
    ----------
    designs : (n, 9) columns of :class:`Design`
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    sensitivities : (9, n, m) out [1 or length/rad]; nan where the status is not OK
    status : (n, m) out, as of :func:`poses`
    """
    poses(designs, cos_phi, sin_phi, status, None, None, None, None, None, None, None, None, None, None)
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        cl, sl = np.cos(designs[i, 6]), np.sin(designs[i, 6])
        for j in range(cos_phi.shape[1]):
            if status[i, j] != st.OK:
                for k in range(9):
                    sensitivities[k, i, j] = math.nan
                continue
            at = place(r, cos_phi[row, j], sin_phi[row, j])
            u, v, x, y, w = at.u, at.v, at.x, at.y, at.w
            t = r.branch * np.sqrt(at.delta)
            cos_psi, sin_psi = -(x * w + y * t) / at.rr, (y * w - x * t) / at.rr
            cx, cy = r.e + r.c * cos_psi, r.c * sin_psi
            dx, dy = (cx - r.a * u) / r.b, (cy - y) / r.b
            # What moves the point across the line: a turn of the coupler, a shift of the point along it and across it.
            turn_across = (r.xi * dx - r.eta * dy) * cl + (r.xi * dy + r.eta * dx) * sl
            d_across, id_across = dy * cl - dx * sl, dx * cl + dy * sl
            # A parameter p turns the coupler by (C_p + c psi_p k' - B_p) . (i d)/b, where k' . (i d) is the cosine of
            # the pressure angle at C.
            k_turn = sin_psi * dy + cos_psi * dx
            per_t = 1.0 / t
            crank_radial, crank_tangential = u * cx + v * cy, u * cy - v * cx
            # The rocker pin moves by c psi_p, where psi_p = -h_p/(c T).
            by_phi = r.a * crank_tangential * per_t
            by_a, by_b = (crank_radial - r.a) * per_t, r.b * per_t
            by_c, by_e = (w - r.c) * per_t, -(cx - r.a * u) * per_t
            bet_phi = by_phi * k_turn - r.a * (v * dy + u * dx)
            bet_a = by_a * k_turn - (v * dx - u * dy)
            bet_c = by_c * k_turn + (sin_psi * dx - cos_psi * dy)
            bet_e = by_e * k_turn - dy
            sensitivities[0, i, j] = (r.a * (u * cl + v * sl) + bet_phi * turn_across) * r.unit
            sensitivities[1, i, j] = v * cl - u * sl + bet_a * turn_across
            sensitivities[2, i, j] = by_b * k_turn * turn_across
            sensitivities[3, i, j] = bet_c * turn_across
            sensitivities[4, i, j] = bet_e * turn_across
            sensitivities[5, i, j] = d_across
            sensitivities[6, i, j] = id_across
            mx, my = r.a * u + r.b * (r.xi * dx - r.eta * dy), y + r.b * (r.xi * dy + r.eta * dx)
            sensitivities[7, i, j] = -(mx * cl + my * sl) * r.unit
            sensitivities[8, i, j] = -1.0
