"""Transfer functions of one pose up to the fourth, for the search of their true maxima."""

from __future__ import annotations

import math

from kernels._jit import inline
from kernels.reduce import largest


@inline
def follower(
    e: float, y0: float, ca: float, k0: float, k1: float, k2: float, u: float, v: float
) -> tuple[float, float, float, float]:
    """psi', psi'', psi''', psi'''' of the mirrored mechanism at (cos phi, sin phi) = (u, v); equations (3)-(5), (5a).

    Delta is clamped to a tiny positive number: it is called for designs that turn fully.  Without a branch, so that it
    vectorises over whatever the loop runs over; what the caller does not use is not computed.
    """
    hu, hv = ca * u, ca * v
    x, y, w1 = e - u, y0 + hv, k2 * u - k1 * v
    w = k0 - w1
    rr = x * x + y * y
    t = math.sqrt(largest(rr - w * w, 1e-300))
    shared = 1.0 / (rr * t)
    per_r, per_t = t * shared, rr * shared
    c, s = (x * w + y * t) * per_r, (x * t - y * w) * per_r  # minus cos psi, minus sin psi
    w_ph = k1 * u + k2 * v
    g_ph = w_ph - (v * c - hu * s)
    p = -g_ph * per_t
    g_phph, g_phps = w1 - (u * c + hv * s), v * s + hu * c
    q = -(g_phph + p * (2.0 * g_phps + w * p)) * per_t
    g_phphps, g_phpsps = u * s - hv * c, w_ph - g_ph
    mixed = g_phps + w * p
    j = (g_ph - p * (3.0 * g_phphps + p * (3.0 * g_phpsps - t * p)) - 3.0 * q * mixed) * per_t
    by_p = p * (-4.0 * g_phps + p * (6.0 * (w1 - g_phph) - p * (4.0 * g_phps + w * p)))
    by_q = q * (6.0 * g_phphps + p * (12.0 * g_phpsps - 6.0 * t * p) + 3.0 * w * q)
    k = (g_phph - by_p - by_q - 4.0 * mixed * j) * per_t
    return p, q, j, k


@inline
def order_pair(order: int, p: float, q: float, j: float, k: float) -> tuple[float, float]:
    """The transfer function of that order and its derivative."""
    if order == 1:
        return p, q
    if order == 2:
        return q, j
    return j, k
