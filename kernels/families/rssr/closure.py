"""Constants of one design of the spatial crank-rocker, and its transfer functions at one pose.

The numbers are those of :mod:`kernels.linkage.crank_closure`.  The transfer functions are equations (3)-(5), (5a) of
docs/rssr.md: the one set of formulas behind the motion at given angles, the dense grid and the search for true maxima.
Derivatives of the closure are written ``w_ph``, ``g_phps`` and so on: ``ph`` stands for phi, ``ps`` for psi.

Everything is of the mechanism mirrored to branch +1.  The first two transfer functions are returned with the opposite
sign, because so they need no negation in between; changing a sign changes no other bit.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

from kernels.arithmetic.intrinsics import largest
from kernels.jit import inline
from kernels.linkage.crank_closure import Reduced, reduce_scaled, unit_scale
from kernels.types import Numbers


@inline
def reduce_design(designs: Numbers, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for zero or negative lengths and for numbers that are not finite."""
    d = designs[i]
    return reduce_one((d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7]))


@inline
def reduce_one(d: tuple[Any, ...]) -> Reduced:
    """As :func:`reduce_design`, from the columns of one; without a branch or a call, so that it vectorises."""
    a, b, c, e, f, g, alpha, branch = d
    unit = unit_scale(c.real)
    return reduce_scaled(a * unit, b * unit, c * unit, e * unit, f * unit, g * unit, alpha, branch.real)


# The closure at one crank angle; ``hu``, ``hv`` are cos(phi), sin(phi) times the cosine of the axes' angle.
# ``u``: cos phi; ``v``: sin phi; ``x``: X, Y, W of the closure; ``w1``: W = k0 - w1; ``rr``: X^2 + Y^2, squared
# distance of the crank pin from the rocker axis; ``delta``: the discriminant X^2 + Y^2 - W^2.
ClosurePose = namedtuple("ClosurePose", "u v hu hv x y w1 w rr delta")


@inline
def place(e: Any, y0: Any, ca: Any, k0: Any, k1: Any, k2: Any, u: Any, v: Any) -> ClosurePose:
    """Evaluate the closure of a reduced design at (cos phi, sin phi) = (u, v); (2).

    It takes float32, float64 and complex128 alike, so no literal number may stand in it.
    """
    hu, hv = ca * u, ca * v
    x, y, w1 = e - u, y0 + hv, k2 * u - k1 * v
    w = k0 - w1
    rr = x * x + y * y
    return ClosurePose(u, v, hu, hv, x, y, w1, w, rr, rr - w * w)


@inline
def closure_terms(
    e: float, y0: float, ca: float, k0: float, k1: float, k2: float, u: float, v: float
) -> tuple[float, ...]:
    """Return X, Y, W of the closure alone, for margins, limit positions, error estimates and enclosures.

    W is summed in another order than in :func:`place`.  The order decides its last bit and with it that of every
    margin, so both are kept.
    """
    return e - u, y0 + ca * v, k0 + k1 * v - k2 * u


# The rocker of the mirrored mechanism: minus cos psi, minus sin psi, T = sqrt(Delta) and 1/T.
Rocker = namedtuple("Rocker", "c s t per_t")


# Derivatives of the closure with respect to phi, and minus psi'.
First = namedtuple("First", "w_ph g_ph p")


# Second derivatives of the closure, twice by phi and once by each angle, and minus psi''.
Second = namedtuple("Second", "g_phph g_phps q")


@inline
def rocker(at: ClosurePose, t: Any, per: Any) -> Rocker:
    """Rocker from T and ``per`` = 1/(R T): one division gives both reciprocals, 1/R and 1/T."""
    per_r, per_t = t * per, at.rr * per
    return Rocker((at.x * at.w + at.y * t) * per_r, (at.x * t - at.y * at.w) * per_r, t, per_t)


@inline
def velocity(k1: Any, k2: Any, to: Rocker, at: ClosurePose) -> First:
    """Compute derivatives of the closure by phi, and minus psi'; equation (3)."""
    w_ph = k1 * at.u + k2 * at.v
    g_ph = w_ph - (at.v * to.c - at.hu * to.s)
    return First(w_ph, g_ph, g_ph * to.per_t)


@inline
def acceleration(to: Rocker, at: ClosurePose, first: First) -> Second:
    """Second derivatives of the closure, and minus psi''; equation (4)."""
    g_phps = at.v * to.s + at.hu * to.c
    g_phph = at.w1 - (at.u * to.c + at.hv * to.s)
    # A sum instead of a product with 2: it leaves float32 what it is.
    q = (g_phph + first.p * (at.w * first.p - (g_phps + g_phps))) * to.per_t
    return Second(g_phph, g_phps, q)


@inline
def jerk(to: Rocker, at: ClosurePose, first: First, second: Second) -> Any:
    """Third transfer function psi''', with its own sign; equation (5)."""
    p, q = first.p, second.q
    g_phphps, g_phpsps = at.u * to.s - at.hv * to.c, first.w_ph - first.g_ph
    by_p = p * (3.0 * g_phphps - p * (3.0 * g_phpsps + to.t * p))
    return (first.g_ph + by_p + 3.0 * q * (second.g_phps - at.w * p)) * to.per_t


@inline
def snap(to: Rocker, at: ClosurePose, first: First, second: Second, j: Any) -> Any:
    """Fourth transfer function, with its own sign, from the third, ``j``."""
    p, q, t, w = -first.p, -second.q, to.t, at.w
    g_phphps, g_phpsps, g_phps = at.u * to.s - at.hv * to.c, first.w_ph - first.g_ph, second.g_phps
    by_p = p * (-4.0 * g_phps + p * (6.0 * (at.w1 - second.g_phph) - p * (4.0 * g_phps + w * p)))
    by_q = q * (6.0 * g_phphps + p * (12.0 * g_phpsps - 6.0 * t * p) + 3.0 * w * q)
    return (second.g_phph - by_p - by_q - 4.0 * (g_phps + w * p) * j) * to.per_t


@inline
def follower(
    e: float, y0: float, ca: float, k0: float, k1: float, k2: float, u: float, v: float
) -> tuple[float, float, float, float]:
    """psi', psi'', psi''', psi'''' of the mirrored mechanism at (cos phi, sin phi) = (u, v).

    It is meant for designs that turn fully.  There is no branch in it, so that it vectorises over whatever the loop
    runs over, and what the caller does not use is not computed.
    """
    at = place(e, y0, ca, k0, k1, k2, u, v)
    # Clamped to a tiny positive number: a design that turns fully has a positive discriminant, except for rounding.
    t = math.sqrt(largest(at.delta, 1e-300))
    to = rocker(at, t, 1.0 / (at.rr * t))
    first = velocity(k1, k2, to, at)
    second = acceleration(to, at, first)
    j = jerk(to, at, first, second)
    k = snap(to, at, first, second, j)
    return -first.p, -second.q, j, k


@inline
def order_pair(order: int, p: float, q: float, j: float, k: float) -> tuple[float, float]:
    """Transfer function of that order and its derivative."""
    if order == 1:
        return p, q
    if order == 2:
        return q, j
    return j, k
