"""One design of the guided four-bar brought to its smallest set of numbers, its closure, and derivatives of psi; (5).

Polukhin 1971, section 4.4, as worked out in docs/guide.md; the equation numbers are of that page.  Everything is
computed in lengths divided by a power of two near the rocker length.  Designs may be complex128 (exact gradients by the
complex step); decisions look at the real part.

The one set of formulas behind the motion at given angles and behind the fused kernels of chains.  Derivatives of the
closure F = X cos psi - Y sin psi + W are F_phi = ``g_ph``, F_phi psi = -``g_near``, F_phi phi psi = ``g_turn``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from kernels.arithmetic.intrinsics import power_below
from kernels.jit import inline
from kernels.types import EPS, Array


class Design(NamedTuple):
    """Columns of the design matrix: lengths in one unit, lam in radians, branch +1 or -1."""

    a: float
    b: float
    c: float
    e: float
    xi: float
    eta: float
    lam: float
    h: float
    branch: float


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``: the closure X C - Y S + W = 0 and the coupler point in the line's frame.

    X = e - a cos phi, Y = a sin phi, W = k0 - k2 cos phi; along + i (dev + h) = p e^{i phi} + q (e + c e^{i psi}) / c.
    """

    a: float
    b: float
    c: float
    e: float
    k0: float
    k2: float
    x_size: float  # sums of the magnitudes whose rounding errors make up X and W
    w_size: float
    p_along: float  # a (1 - l/b) e^{-i lam}, l = xi + i eta
    p_across: float
    q_along: float  # c (l/b) e^{-i lam}
    q_across: float
    along0: float  # (l/b) e^{-i lam} e - i h
    across0: float
    xi: float  # in units of the coupler
    eta: float
    branch: float
    unit: float
    valid: bool


@inline
def reduce_design(designs: Array, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for zero or negative lengths and for what is not finite."""
    d = Design(
        designs[i, 0], designs[i, 1], designs[i, 2], designs[i, 3], designs[i, 4], designs[i, 5], designs[i, 6],
        designs[i, 7], designs[i, 8],
    )  # fmt: skip
    return reduce_along(d, np.cos(d.lam), np.sin(d.lam))


@inline
def reduce_along(d: Any, cl: Any, sl: Any) -> Reduced:
    """Constants as of :func:`reduce_design`, from a :class:`Design` and the cosine and sine of its lam.

    Without a branch or a call, so that it vectorises.
    """
    half_unit = power_below(d.c.real)
    unit, per_unit = 2.0 * half_unit, 0.5 / half_unit
    a, b, c, e = d.a * per_unit, d.b * per_unit, d.c * per_unit, d.e * per_unit
    lam, h, branch = d.lam, d.h * per_unit, d.branch
    xi, eta = d.xi * per_unit / b, d.eta * per_unit / b
    along, across = xi * cl + eta * sl, eta * cl - xi * sl
    k0 = 0.5 * ((c - b) * (c + b) + (a * a + e * e)) / c
    k2 = a * e / c
    w_size = 0.5 * (abs(((c - b) * (c + b)).real) + (a * a + e * e).real) / c.real + abs(k2.real)
    valid = (a.real > 0.0) & (b.real > 0.0) & (c.real > 0.0) & (w_size < 1e140) & (branch.real * branch.real == 1.0)
    # 0 * x is nan exactly for what is not finite
    valid = valid & (abs(lam.real) < 1e5) & ((0.0 * (xi + eta + h)).real == 0.0)
    return Reduced(
        a, b, c, e, k0, k2, abs(e.real) + a.real, w_size,
        a * (cl - along), -a * (sl + across), c * along, c * across, along * e, across * e - h,
        xi, eta, branch, unit, valid,
    )  # fmt: skip


class ClosurePose(NamedTuple):
    """The closure at one crank angle, in units of ``Reduced.unit``."""

    u: Any  # cos phi
    v: Any  # sin phi
    x: Any  # X, Y, W of the closure
    y: Any
    w: Any
    rr: Any  # X^2 + Y^2, squared distance of the crank pin from the rocker pivot
    delta: Any  # the discriminant X^2 + Y^2 - W^2


@inline
def place(r: Any, u: Any, v: Any) -> ClosurePose:
    """Evaluate the closure at (cos phi, sin phi) = (u, v); (1), (2).  ``r`` has a, e, k0, k2 of :class:`Reduced`."""
    x, y, w = r.e - r.a * u, r.a * v, r.k0 - r.k2 * u
    rr = x * x + y * y
    return ClosurePose(u, v, x, y, w, rr, rr - w * w)


@inline
def discriminant_tolerance(r: Reduced, x: float, y: float, w: float) -> float:
    """Return the rounding error of X^2+Y^2-W^2: below it, whether the links reach cannot be decided in float64 (7)."""
    t = 8.0 * EPS
    first = abs(x.real) * r.x_size + abs(y.real) * r.a.real + abs(w.real) * r.w_size
    return t * first + t * t * (r.x_size * r.x_size + r.a.real * r.a.real + r.w_size * r.w_size)


class First(NamedTuple):
    """Derivatives of the closure, and psi'."""

    g_turn: Any
    g_near: Any
    g_ph: Any
    p: Any


@inline
def velocity(r: Any, at: ClosurePose, cos_psi: Any, sin_psi: Any, per_t: Any) -> First:
    """psi'; ``r`` has the fields a and k2 of :class:`kernels.families.guide.closure.Reduced`, ``per_t`` is 1/T."""
    u, v = at.u, at.v
    g_turn, g_near = r.a * (v * cos_psi - u * sin_psi), r.a * (u * cos_psi + v * sin_psi)
    g_ph = g_turn + r.k2 * v
    return First(g_turn, g_near, g_ph, -g_ph * per_t)


@inline
def acceleration(r: Any, at: ClosurePose, first: First, per_t: Any) -> Any:
    """Psi''."""
    p = first.p
    return -(first.g_near + r.k2 * at.u + p * (at.w * p - 2.0 * first.g_near)) * per_t


@inline
def jerk(at: ClosurePose, first: First, q: Any, t: Any, per_t: Any) -> Any:
    """Psi''' from psi'' = ``q`` and T."""
    p, g_turn = first.p, first.g_turn
    linear = first.g_ph - p * (3.0 * g_turn - p * (3.0 * g_turn + t * p))
    return (linear - 3.0 * q * (at.w * p - first.g_near)) * per_t


@inline
def snap(r: Any, at: ClosurePose, first: First, q: Any, j: Any, t: Any, per_t: Any) -> Any:
    """Fourth derivative of psi from psi'' = ``q``, psi''' = ``j`` and T."""
    p, g_turn, g_near, w = first.p, first.g_turn, first.g_near, at.w
    by_p = p * (4.0 * g_near - p * (6.0 * g_near - p * (4.0 * g_near - w * p)))
    by_q = q * (6.0 * g_turn - p * (12.0 * g_turn + 6.0 * t * p) + 3.0 * w * q)
    return (g_near + r.k2 * at.u - by_p - by_q - 4.0 * j * (w * p - g_near)) * per_t
