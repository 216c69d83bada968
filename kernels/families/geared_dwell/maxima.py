"""True maxima of the geared dwell drive over the turn, from all stationary points, and measures of its dwell."""

from __future__ import annotations

import math

import numpy as np

from kernels import status as st
from kernels.curves.polynomials import roots_up_to, value_and_slope
from kernels.curves.root_search import newton_root
from kernels.families.geared_dwell.motion import Reduced, pin, reduce_design, velocity
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write_number
from kernels.types import Array, Status


@inline
def stretch(
    r: Reduced, k: float, a: float, number: int, s2: Array, q: Array, d: Array, lean: Array
) -> tuple[float, float]:
    """Write the quadratics of a stretch of the half turn in its variable tau >= 0; return length, |dtau/dcos(phi)|.

    ``s2`` is sin^2(phi), ``q`` and ``d`` are Q and D.  The turn is cut at phi = pi/2 with tau = t (number 0) and
    tau = 1 + cos(phi) (number 1).  Where the pin passes nearest to the axis at cos(phi) = 1/k, near a = -k, it is cut
    there, with tau = 1 - k cos(phi) (number 2) and its negative (number 3), and psi' = 1 - lean/D.
    """
    h = r.front if number != 1 else r.back
    if number < 2:
        s2[0], s2[1], s2[2] = 0.0, 2.0, -1.0
        q[0], q[1], q[2] = h.q0, h.q1, r.ak4
        d[0], d[1], d[2] = h.e * h.e, h.d1, -r.ak4
        return 1.0, 1.0
    g, per_k, total = (1.0 if number == 2 else -1.0), 1.0 / k, h.total
    s2[0], s2[1], s2[2] = (1.0 - per_k) * (1.0 + per_k), 2.0 * g * per_k * per_k, -per_k * per_k
    q[0], q[1], q[2] = (
        total * (3.0 * total - 4.0 * k + 4.0 * per_k),
        g * (8.0 - 4.0 * a * (a - k) - 8.0 * total * per_k),
        4.0 * a * per_k,
    )
    d[0], d[1], d[2] = total * total, 4.0 * g * total * per_k, -4.0 * a * per_k
    lean[0], lean[1] = total * (2.0 * per_k + (a - k)), -2.0 * g * total * per_k
    return k + g, k


@inline
def angle_at(k: float, number: int, tau: float) -> float:
    """Carrier angle in [0, pi] at a place of a stretch."""
    if number == 1:
        return math.pi - 2.0 * math.asin(math.sqrt(0.5 * tau))
    t = tau if number == 0 else ((k - 1.0) + (tau if number == 2 else -tau)) / k
    return 2.0 * math.asin(math.sqrt(0.5 * min(max(t, 0.0), 2.0)))


@inline
def quadratic(p: Array, x: float) -> float:
    """Return p[0] + p[1] x + p[2] x^2."""
    value: float = p[0] + x * (p[1] + x * p[2])
    return value


@inline
def _bend(s2: Array, q: Array, d: Array, bend: Array) -> None:
    """Write the polynomial s2'/2 q d + s2 (q' d - 2 q d').

    psi'' is stationary where it vanishes, and psi''' is this polynomial divided by d^3.
    """
    # The derivative of a product of powers is their product times a sum of exponents.
    bend[:] = 0.0
    for x in range(3):
        for y in range(3):
            for z in range(3):
                if x + y + z > 0:
                    factor = 0.5 * x + y - 2.0 * z
                    bend[x + y + z - 1] += factor * (s2[x] * q[y] * d[z])


@inline
def _slope(bend: Array, d: Array, slope: Array) -> None:
    """Write the polynomial bend' d - 3 bend d', which vanishes where psi''' is stationary."""
    slope[:] = 0.0
    for x in range(6):
        for z in range(3):
            if x + z > 0:
                slope[x + z - 1] += (x - 3.0 * z) * (bend[x] * d[z])


@inline
def _speed_at(r: Reduced, number: int, tau: float, d: Array, lean: Array) -> float:
    """Compute |psi'| at a place of a stretch."""
    square = quadratic(d, tau)
    if number < 2:
        return abs(velocity(r.front if number == 0 else r.back, r.ak4, tau, square))
    return abs(1.0 - (lean[0] + lean[1] * tau) / square)  # type: ignore[no-any-return]


@kernel
def turn_maxima(
    designs: Array,
    status: Status,
    max_abs_dpsi: Array | None,
    max_abs_d2psi: Array | None,
    phi_max_abs_d2psi: Array | None,
    max_abs_d3psi: Array | None,
) -> None:
    """Compute the largest |psi'|, |psi''|, |psi'''| over the turn from all stationary points; (7)-(9).

    Parameters
    ----------
    designs : (n, 2) columns as `PARAMETERS` of sweep/families/geared_dwell.py
    status : (n,) out; OK, SINGULAR (the pin passes through the output axis), NOT_CONVERGED or INVALID_INPUT
    max_abs_dpsi ... max_abs_d3psi : (n,) out, or None: not computed, not compiled
    phi_max_abs_d2psi : (n,) out, where |psi''| is largest, in [0, pi]; -phi is as good, psi'' being odd

    Notes
    -----
    Every real root of the polynomial in cos(phi) is found (degree 2, 5 and 6), for every number of output turns;
    nothing is sampled.  Each half turn uses the variable that vanishes where the pin comes nearest to the axis.
    """
    s2, q, d, lean = np.empty(3), np.empty(3), np.empty(3), np.empty(2)
    bend, slope, found, scratch = np.empty(6), np.empty(7), np.empty(6), np.empty((6, 7))
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        k, a, total = designs[i, 0], designs[i, 1], r.front.total
        code = st.OK
        if not r.valid:
            code = st.INVALID_INPUT
        elif not r.regular:
            code = st.SINGULAR
        near = k > 1.0 and 2.0 * abs(total) < abs(r.front.e)
        m1, m2, m3, phi2 = 0.0, -1.0, 0.0, 0.0
        first = 2 if near else 0
        for number in range(first, first + 2 if code == st.OK else first):
            # In the variable that vanishes at the pin's nearest approach no coefficient cancels there.
            end, steep = stretch(r, k, a, number, s2, q, d, lean)
            if max_abs_dpsi is not None:
                count = roots_up_to(end, q, 2, scratch, found)
                for n in range(-2, count):
                    value = _speed_at(r, number, found[n] if n >= 0 else (0.0 if n == -1 else end), d, lean)
                    m1 = value if not value <= m1 else m1  # nan, a root that did not settle, stays
            if max_abs_d2psi is not None or phi_max_abs_d2psi is not None or max_abs_d3psi is not None:
                _bend(s2, q, d, bend)
                if max_abs_d2psi is not None or phi_max_abs_d2psi is not None:
                    count = roots_up_to(end, bend, 5, scratch, found)
                    for n in range(-1, count):
                        tau = found[n] if n >= 0 else end
                        square = quadratic(d, tau)
                        value = math.sqrt(max(quadratic(s2, tau), 0.0)) / square * (abs(quadratic(q, tau)) / square)
                        if not value <= m2:
                            m2, phi2 = value, angle_at(k, number, tau)
                if max_abs_d3psi is not None:
                    _slope(bend, d, slope)
                    count = roots_up_to(end, slope, 6, scratch, found)
                    for n in range(-2, count):
                        tau = found[n] if n >= 0 else (0.0 if n == -1 else end)
                        square = quadratic(d, tau)
                        value = abs(value_and_slope(tau, bend, 5)[0]) * steep / square / square / square
                        m3 = value if not value <= m3 else m3
        if m1 != m1 or m2 != m2 or m3 != m3:
            code = st.NOT_CONVERGED
        status[i] = code
        scale = 2.0 * abs(total) if code == st.OK else math.nan
        valid = 1.0 if code == st.OK else math.nan
        write_number(max_abs_dpsi, i, valid * m1)
        write_number(max_abs_d2psi, i, scale * m2)
        write_number(phi_max_abs_d2psi, i, valid * phi2)
        write_number(max_abs_d3psi, i, scale * m3)


@inline
def _excess(phi: float, r: Reduced, psi: float) -> tuple[float, float]:
    """Angle psi at phi > 0 less a given one, and its slope."""
    u, v = math.cos(phi), math.sin(phi)
    h = r.front if u > 0.0 else r.back
    t = v * v / (1.0 + h.sign * u)
    x, y, _ = pin(h, t, h.sign * v)
    return math.atan2(h.sign * y, h.sign * x) - psi, velocity(h, r.ak4, t, x * x + y * y)


@kernel
def dwell_measures(
    designs: Array,
    status: Status,
    turns: Array | None,
    dwell_angle: Array | None,
    dwell_deviation: Array | None,
    dwell_band: Array | None,
) -> None:
    """Compute output turns per carrier turn, return dwell, deviation and band dwell; (10)-(12).

    Parameters
    ----------
    designs : (n, 2) columns as `PARAMETERS` of sweep/families/geared_dwell.py
    status : (n,) out; OK, SINGULAR, NOT_CONVERGED, INVALID_INPUT, or where a dwell is wanted and the output does not
        turn once per turn of the carrier NO_DWELL
    turns ... dwell_band : (n,) out, or None: not computed, not compiled

    Notes
    -----
    For k <= 1 the output never turns back: no dwell, the three measures are 0.  ``turns`` stands also with NO_DWELL.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        k, h = designs[i, 0], r.front
        code = st.OK
        if not r.valid:
            code = st.INVALID_INPUT
        elif not r.regular:
            code = st.SINGULAR
        write_number(turns, i, r.turns if code == st.OK else math.nan)
        if dwell_angle is not None or dwell_deviation is not None or dwell_band is not None:
            code = st.NO_DWELL if code == st.OK and r.turns != 1.0 else code
        returns = code == st.OK and k > 1.0
        none = 0.0 if code == st.OK else math.nan
        if dwell_angle is not None:
            dwell_angle[i] = 2.0 * math.atan(math.sqrt((k - 1.0) * (k + 1.0))) if returns else none
        if dwell_deviation is not None or dwell_band is not None:
            deviation, band = none, none
            # The stable root of the quadratic: both terms of the denominator have the same sign.
            if returns:
                t = -2.0 * h.v0 / (h.v1 + math.sqrt(h.v1 * h.v1 + 4.0 * r.ak4 * h.v0))
                x, y, _ = pin(h, t, math.sqrt(t * (2.0 - t)))
                deviation = -math.atan2(y, x)
                if dwell_band is not None:
                    # psi rises from its extreme to pi at phi = pi; twice the extreme is the root for k -> 1
                    extreme = 2.0 * math.asin(math.sqrt(0.5 * t))
                    start = min(2.0 * extreme, 0.5 * (extreme + math.pi))
                    band = 2.0 * newton_root(_excess, extreme, math.pi, -1.0, start, 0.0, r, deviation)
                    code = st.NOT_CONVERGED if band != band else code
            write_number(dwell_deviation, i, deviation)
            write_number(dwell_band, i, band)
        status[i] = code
