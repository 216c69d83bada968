"""P1 to P3: direction of the coupler force at the follower and at the crank; extrema of the pressure angle.

t_tau, t_rho, t_k are the components of the coupler's unit vector along the tangential, radial and axial direction of
the follower.  Angles are formed from them by arctangents for reporting only: theta2 is undetermined where t_rho = 0.

P1 gives every extremum of the pressure angle over a turn, in closed form but for the roots of a quartic.  The component
of the coupler's unit vector across the velocity of the driven joint draws an ellipse (r0 + rc cos + rs sin, k0 + kc cos
+ ks sin) whose distance from the origin is sin(pressure angle), so the extrema are the feet of the normals from a point
to an ellipse, 2 or 4 of them (docs/effects.md, P1).  Half the derivative of the squared distance is a1 cos + b1 sin +
a2 cos 2phi + b2 sin 2phi.
"""

from __future__ import annotations

import math

import numpy as np

from kernels import status as st
from kernels.arithmetic.vectors import dot
from kernels.curves.polynomials import roots_up_to
from kernels.jit import inline, kernel
from kernels.linkage.joints import read
from kernels.linkage.outputs import write
from kernels.types import EPS, Array, Status


@kernel
def directions(
    poses: Array,
    designs: Array,
    status: Status,
    t_tau: Array | None,
    t_rho: Array | None,
    t_k: Array | None,
    theta1: Array | None,
    theta2: Array | None,
    theta3: Array | None,
) -> None:
    """Compute components of the coupler direction and the radial, axial and crank-side pressure angles.

    Parameters
    ----------
    poses : (n, m, PER_POSE), designs : (n, PER_DESIGN), records of :mod:`kernels.linkage.joints`
    status : (n, m), in; nan where it is not OK
    t_tau, t_rho, t_k : (n, m) or None; t_tau carries the sign of the branch
    theta1 : (n, m) or None; radial angle in [0, pi/2], tan = |t_rho/t_tau|
    theta2, theta3 : (n, m) or None; axial angles in (-pi/2, pi/2], tan = t_k/t_rho (follower), n_u/n_rho (crank)
    """
    for i in range(poses.shape[0]):
        for k in range(poses.shape[1]):
            j = read(poses[i, k], designs[i])
            good = 1.0 if status[i, k] == st.OK else math.nan
            rho, along = dot(j.s, j.rho), dot(j.s, j.k)
            write(t_tau, i, k, good * j.t_tau)
            write(t_rho, i, k, good * rho)
            write(t_k, i, k, good * along)
            write(theta1, i, k, good * math.atan2(abs(rho), abs(j.t_tau)))
            if theta2 is not None:
                sign = 1.0 if rho >= 0.0 else -1.0
                theta2[i, k] = good * math.atan2(sign * along, abs(rho))
            if theta3 is not None:
                radial = dot(j.s, j.rho_b)
                side = 1.0 if radial >= 0.0 else -1.0
                theta3[i, k] = good * math.atan2(side * dot(j.s, j.u), abs(radial))


# Angles from which the turn is cut into quarters, tried in order: a root on a cut may be found twice or not at all.
CUTS = (0.2137, 0.8521, 1.3179)
NEWTON = 3
# Rounding of the components, in units of 2^-53 of the terms they are made of.
ROUNDING = 16.0


@inline
def slope_coefficients(r0: float, rc: float, rs: float, k0: float, kc: float, ks: float) -> tuple[float, ...]:
    """Coefficients a1, b1, a2, b2 of half the derivative of the squared distance."""
    a1, b1 = r0 * rs + k0 * ks, -(r0 * rc + k0 * kc)
    a2, b2 = rc * rs + kc * ks, 0.5 * ((rs - rc) * (rs + rc) + (ks - kc) * (ks + kc))
    return a1, b1, a2, b2


@inline
def extrema_expected(a1: float, b1: float, a2: float, b2: float) -> float:
    """Find the number of extrema: 4 if the origin lies inside the ellipse's evolute, 2 outside, 3 on it.

    It is 0 if the curve is a point.
    """
    size = math.hypot(a2, b2)
    if size == 0.0:
        return 0.0 if a1 == 0.0 and b1 == 0.0 else 2.0
    delta = 0.5 * math.atan2(-a2, b2)
    c, s = math.cos(delta), math.sin(delta)
    inside = (2.0 * size) ** (2.0 / 3.0)
    reach = abs(a1 * c + b1 * s) ** (2.0 / 3.0) + abs(b1 * c - a1 * s) ** (2.0 / 3.0)
    if abs(reach - inside) <= 1e-12 * inside:
        return 3.0
    return 4.0 if reach < inside else 2.0


@inline
def zeros(
    a1: float, b1: float, a2: float, b2: float, cut: float, quartic: Array, scratch: Array, found: Array, phi: Array
) -> int:
    """Find the zeros of a1 cos + b1 sin + a2 cos 2 + b2 sin 2 from ``cut`` on; return their number, -1 if above 4."""
    count = 0
    for quarter in range(4):
        start = cut + 0.5 * math.pi * quarter
        c, s = math.cos(start), math.sin(start)
        c2, s2 = (c - s) * (c + s), 2.0 * s * c
        p1, q1 = a1 * c + b1 * s, b1 * c - a1 * s
        p2, q2 = a2 * c2 + b2 * s2, b2 * c2 - a2 * s2
        # With t = tan((phi - start)/2) in (0, 1): times (1 + t^2)^2 it is a quartic.
        quartic[0], quartic[1], quartic[2] = p1 + p2, 2.0 * q1 + 4.0 * q2, -6.0 * p2
        quartic[3], quartic[4] = 2.0 * q1 - 4.0 * q2, p2 - p1
        roots = roots_up_to(1.0, quartic, 4, scratch, found)
        for k in range(roots):
            if count == 4:
                return -1
            angle = start + 2.0 * math.atan(found[k])
            for _ in range(NEWTON):
                c, s = math.cos(angle), math.sin(angle)
                c2, s2 = (c - s) * (c + s), 2.0 * s * c
                slope = b1 * c - a1 * s + 2.0 * (b2 * c2 - a2 * s2)
                step = (a1 * c + b1 * s + a2 * c2 + b2 * s2) / slope if slope != 0.0 else 0.0
                angle -= step if abs(step) < 1e-3 else 0.0
            phi[count] = angle
            count += 1
    return count


@kernel
def pressure_extrema(
    ellipse: Array, status: Status, count: Array, phi: Array, theta: Array, highest: Array, lowest: Array
) -> None:
    """Compute all extrema of the pressure angle over a turn.

    Parameters
    ----------
    ellipse : (n, 7) the components as constant, cosine, sine each, and the size of the terms that round
    status : (n,) out; NOT_ROTATABLE where the ellipse leaves the unit circle, UNDECIDABLE where float64 cannot tell,
        INVALID_INPUT where it is not finite, NOT_CONVERGED where the zeros found contradict the astroid criterion
    count : (n,) out, 2 or 4; 0 where the angle is constant; 1 and 3 do not occur, a double zero counts as none
    phi, theta : (n, 4) out [rad]; crank angles in [0, 2 pi) ascending and the pressure angles there, nan beyond count
    highest, lowest : (n, 4) out [rad]; greater maximum and its crank angle, smaller maximum and its crank angle, and
        the same of the minima, the least first; a single maximum or minimum stands twice

    Notes
    -----
    Measured on the oracle tables: pressure angles within 1.4 x 2^-53 times the size of the terms that round, crank
    angles within 0.7 x 2^-53 size^2/|curvature|.
    """
    quartic, scratch, found, at = np.empty(5), np.empty((4, 5)), np.empty(4), np.empty(4)
    for i in range(ellipse.shape[0]):
        r0, rc, rs, k0, kc, ks, size = ellipse[i]
        phi[i, :], theta[i, :], highest[i, :], lowest[i, :] = math.nan, math.nan, math.nan, math.nan
        count[i] = math.nan
        a1, b1, a2, b2 = slope_coefficients(r0, rc, rs, k0, kc, ks)
        if not (math.isfinite(a1 + b1 + a2 + b2) and math.isfinite(size)):
            status[i] = st.INVALID_INPUT
            continue
        expected = extrema_expected(a1, b1, a2, b2)
        number = -1
        for cut in CUTS:
            number = 0 if expected == 0.0 else zeros(a1, b1, a2, b2, cut, quartic, scratch, found, at)
            if number == expected or (expected == 3.0 and (number == 2 or number == 4)):
                break
            number = -1
        if number < 0:
            status[i] = st.NOT_CONVERGED
            continue
        if number == 0:
            at[0] = 0.0
        most = 0.0
        for k in range(max(number, 1)):
            at[k] = at[k] - 2.0 * math.pi * math.floor(at[k] / (2.0 * math.pi))
        at[:number].sort()
        for k in range(max(number, 1)):
            c, s = math.cos(at[k]), math.sin(at[k])
            sine = math.hypot(r0 + rc * c + rs * s, k0 + kc * c + ks * s)
            most = max(most, sine)
            phi[i, k] = at[k]
            theta[i, k] = sine
        band = ROUNDING * EPS * size
        status[i] = st.OK if most < 1.0 - band else (st.NOT_ROTATABLE if most > 1.0 + band else st.UNDECIDABLE)
        if status[i] != st.OK:
            phi[i, :], theta[i, :] = math.nan, math.nan
            continue
        count[i] = number
        for k in range(max(number, 1)):
            sine = theta[i, k]
            theta[i, k] = math.atan2(sine, math.sqrt((1.0 - sine) * (1.0 + sine)))
        _order(phi[i], theta[i], number, 1.0, highest[i])
        _order(phi[i], theta[i], number, -1.0, lowest[i])


@inline
def _order(phi: Array, theta: Array, number: int, sign: float, out: Array) -> None:
    """Sort the extrema: the outermost of one kind, then the other of that kind; the kinds alternate over the turn."""
    best = 0
    for k in range(1, number):
        if sign * theta[k] > sign * theta[best]:
            best = k
    other = (best + 2) % 4 if number == 4 else best
    out[0], out[1], out[2], out[3] = theta[best], phi[best], theta[other], phi[other]
