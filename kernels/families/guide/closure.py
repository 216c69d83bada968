"""Constants of one design of the guided four-bar, its closure, and derivatives of psi; (5).

Polukhin 1971, section 4.4, as worked out in docs/guide.md; the equation numbers are of that page.  Everything is
computed in lengths divided by a power of two near the rocker length.  Designs may be complex128 (exact gradients by the
complex step); decisions look at the real part.

The one set of formulas behind the motion at given angles and behind the fused kernels of chains.  Derivatives of the
closure F = X cos psi - Y sin psi + W are F_phi = ``g_ph``, F_phi psi = -``g_near``, F_phi phi psi = ``g_turn``.

At the end is the guided four-bar as the last stage of a fused chain (:mod:`kernels.chains`).
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from kernels.arithmetic.intrinsics import largest, power_below
from kernels.chains.form import STRIDE, Form, Travel
from kernels.jit import inline
from kernels.types import EPS, Array


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
    """Constants of one design; ``valid`` is false for zero or negative lengths and for numbers that are not finite."""
    d = designs[i]
    return reduce_along((d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7], d[8]), np.cos(d[6]), np.sin(d[6]))


@inline
def reduce_along(d: tuple[Any, ...], cl: Any, sl: Any) -> Reduced:
    """Constants as of :func:`reduce_design`, from the columns of a design and the cosine and sine of its lam.

    Without a branch or a call, so that it vectorises.
    """
    a, b, c, e, xi, eta, lam, h, branch = d
    half_unit = power_below(c.real)
    unit, per_unit = 2.0 * half_unit, 0.5 / half_unit
    a, b, c, e, h = a * per_unit, b * per_unit, c * per_unit, e * per_unit, h * per_unit
    xi, eta = xi * per_unit / b, eta * per_unit / b
    along, across = xi * cl + eta * sl, eta * cl - xi * sl
    k0 = 0.5 * ((c - b) * (c + b) + (a * a + e * e)) / c
    k2 = a * e / c
    w_size = 0.5 * (abs(((c - b) * (c + b)).real) + (a * a + e * e).real) / c.real + abs(k2.real)
    valid = (a.real > 0.0) & (b.real > 0.0) & (c.real > 0.0) & (w_size < 1e140) & (branch.real * branch.real == 1.0)
    # 0 * x is nan exactly for numbers that are not finite
    valid = valid & (abs(lam.real) < 1e5) & ((0.0 * (xi + eta + h)).real == 0.0)
    return Reduced(
        a, b, c, e, k0, k2, abs(e.real) + a.real, w_size,
        a * (cl - along), -a * (sl + across), c * along, c * across, along * e, across * e - h,
        xi, eta, branch, unit, valid,
    )  # fmt: skip


# The closure at one crank angle, in units of ``Reduced.unit``.
# ``u``: cos phi; ``v``: sin phi; ``x``: X, Y, W of the closure; ``rr``: X^2 + Y^2, squared distance of the crank pin
# from the rocker pivot; ``delta``: the discriminant X^2 + Y^2 - W^2.
ClosurePose = namedtuple("ClosurePose", "u v x y w rr delta")


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


# Derivatives of the closure, and psi'.
First = namedtuple("First", "g_turn g_near g_ph p")


@inline
def velocity(r: Any, at: ClosurePose, cos_psi: Any, sin_psi: Any, per_t: Any) -> First:
    """Compute derivatives of the closure, and psi'; ``r`` has a and k2 of :class:`Reduced`, ``per_t`` is 1/T."""
    u, v = at.u, at.v
    g_turn, g_near = r.a * (v * cos_psi - u * sin_psi), r.a * (u * cos_psi + v * sin_psi)
    g_ph = g_turn + r.k2 * v
    return First(g_turn, g_near, g_ph, -g_ph * per_t)


@inline
def acceleration(r: Any, at: ClosurePose, first: First, per_t: Any) -> Any:
    """Second derivative of psi from psi' and the derivatives of the closure."""
    p = first.p
    return -(first.g_near + r.k2 * at.u + p * (at.w * p - 2.0 * first.g_near)) * per_t


@inline
def jerk(at: ClosurePose, first: First, q: Any, t: Any, per_t: Any) -> Any:
    """Third derivative of psi from psi'' = ``q`` and T."""
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


# The numbers of :class:`kernels.families.guide.closure.Reduced`; the point in the user's unit of length.
# ``per_square``: 1/b^2 in the unit of the closure.
Constants = namedtuple(
    "Constants", "a e k0 k2 p_along p_across q_along q_across along0 across0 branch x_size w_size per_square doubt"
)


@inline
def _constants(at: Array, i: int, step: int, cos: Any, sin: Any) -> Constants:
    d = (
        at[i], at[i + step], at[i + 2 * step], at[i + 3 * step], at[i + 4 * step], at[i + 5 * step], at[i + 6 * step],
        at[i + 7 * step], at[i + 8 * step],
    )  # fmt: skip
    r = reduce_along(d, cos, sin)
    unit = 8.0 * EPS
    # discriminant_tolerance where every term has its full size
    doubt = (unit + unit * unit) * (r.x_size * r.x_size + r.a * r.a + r.w_size * r.w_size) if r.valid else math.nan
    return Constants(
        r.a, r.e, r.k0, r.k2, r.p_along * r.unit, r.p_across * r.unit, r.q_along * r.unit, r.q_across * r.unit,
        r.along0 * r.unit, r.across0 * r.unit, r.branch, r.x_size, r.w_size, 1.0 / (r.b * r.b), doubt,
    )  # fmt: skip


@inline
def _put(at: Array, i: int, c: Constants) -> None:
    at[i], at[i + STRIDE], at[i + 2 * STRIDE], at[i + 3 * STRIDE] = c.a, c.e, c.k0, c.k2
    at[i + 4 * STRIDE], at[i + 5 * STRIDE] = c.p_along, c.p_across
    at[i + 6 * STRIDE], at[i + 7 * STRIDE] = c.q_along, c.q_across
    at[i + 8 * STRIDE], at[i + 9 * STRIDE], at[i + 10 * STRIDE] = c.along0, c.across0, c.branch
    at[i + 11 * STRIDE], at[i + 12 * STRIDE] = c.x_size, c.w_size
    at[i + 13 * STRIDE], at[i + 14 * STRIDE] = c.per_square, c.doubt


@inline
def _get(at: Array, i: int) -> Constants:
    return Constants(
        at[i], at[i + STRIDE], at[i + 2 * STRIDE], at[i + 3 * STRIDE], at[i + 4 * STRIDE], at[i + 5 * STRIDE],
        at[i + 6 * STRIDE], at[i + 7 * STRIDE], at[i + 8 * STRIDE], at[i + 9 * STRIDE], at[i + 10 * STRIDE],
        at[i + 11 * STRIDE], at[i + 12 * STRIDE], at[i + 13 * STRIDE], at[i + 14 * STRIDE],
    )  # fmt: skip


@inline
def _travel(c: Constants, u: Any, v: Any) -> Travel:
    """Equations (4) and (5) to the fourth order: each link's share of the point, turned by the derivatives of psi."""
    at = place(c, u, v)
    t = c.branch * math.sqrt(largest(at.delta, 1e-300))
    per = 1.0 / (at.rr * t)  # one division gives both reciprocals
    per_rr, per_t = t * per, at.rr * per
    cos_psi, sin_psi = -(at.x * at.w + at.y * t) * per_rr, (at.y * at.w - at.x * t) * per_rr
    first = velocity(c, at, cos_psi, sin_psi, per_t)
    p, q = first.p, acceleration(c, at, first, per_t)
    j = jerk(at, first, q, t, per_t)
    k = snap(c, at, first, q, j, t, per_t)
    b_along, b_across = c.p_along * u - c.p_across * v, c.p_along * v + c.p_across * u
    c_along, c_across = c.q_along * cos_psi - c.q_across * sin_psi, c.q_along * sin_psi + c.q_across * cos_psi
    square = p * p
    turning, drawing = j - p * square, 3.0 * p * q
    turning4, drawing4 = k - 6.0 * square * q, 4.0 * p * j + 3.0 * q * q - square * square
    return Travel(
        b_along + c_along + c.along0,
        -(b_across + p * c_across),
        -(b_along + q * c_across + square * c_along),
        b_across - turning * c_across - drawing * c_along,
        b_along - turning4 * c_across - drawing4 * c_along,
        b_across + c_across + c.across0,
        b_along + p * c_along,
        q * c_along - square * c_across - b_across,
        turning * c_along - drawing * c_across - b_along,
        b_across + turning4 * c_along - drawing4 * c_across,
        at.delta,
    )


@inline
def _dip(c: Constants, u: Any, v: Any) -> tuple[Any, Any, Any]:
    at = place(c, u, v)
    x_ph, y_ph, w_ph = c.a * v, c.a * u, c.k2 * v
    first = at.x * x_ph + at.y * y_ph - at.w * w_ph
    second = x_ph * x_ph + at.x * y_ph + (y_ph * y_ph - at.y * x_ph) - (w_ph * w_ph + at.w * (c.k2 * u))
    return at.delta * c.per_square, 2.0 * first * c.per_square, 2.0 * second * c.per_square


@inline
def _travel_blur(c: Constants, u: Any, v: Any, x1: Any, x2: Any, x3: Any) -> tuple[Any, ...]:
    """Estimate rounding errors of the point: those of psi and its derivatives (`_turn_blur` of rssr) times its arm."""
    at = place(c, u, v)
    t = c.branch * math.sqrt(largest(at.delta, 1e-300))
    per_t, per_rr = 1.0 / t, 1.0 / at.rr
    first = velocity(c, at, -(at.x * at.w + at.y * t) * per_rr, (at.y * at.w - at.x * t) * per_rr, per_t)
    second = acceleration(c, at, first, per_t)
    p, q, j, per_t = abs(first.p), abs(second), abs(jerk(at, first, second, t, per_t)), abs(per_t)
    tolerance = 4.0 * EPS * (abs(at.x) * c.x_size + abs(at.y) * c.a + abs(at.w) * c.w_size)
    share = tolerance * per_t * per_t
    angle = 4.0 * EPS * (c.x_size + c.a + c.w_size) * per_t
    terms = (2.0 * EPS * (2.0 * c.a + abs(c.k2)) + c.a * angle) * per_t
    b0, b1 = angle + 4.0 * EPS, p * (1.5 * share + 8.0 * EPS) + terms
    more = 1.0 + c.a * per_t
    b2, b3 = q * (2.5 * share + 8.0 * EPS) + terms * more, j * (3.5 * share + 8.0 * EPS) + terms * (more * more)
    arm, crank = abs(c.q_along) + abs(c.q_across), abs(c.p_along) + abs(c.p_across)
    bend, twist = q + p * p, j + p * (p * p + 3.0 * q)
    e0 = arm * b0 + 4.0 * EPS * (arm + crank + abs(c.along0) + abs(c.across0))
    e1 = arm * (b1 + p * b0) + 8.0 * EPS * (crank + arm * p)
    e2 = arm * (b2 + 2.0 * p * b1 + bend * b0) + 8.0 * EPS * (crank + arm * bend)
    e3 = arm * (b3 + 3.0 * p * b2 + 3.0 * bend * b1 + twist * b0) + 8.0 * EPS * (crank + arm * twist)
    return e0, e1, e2, e3, e0, e1, e2, e3, tolerance * c.per_square


FORM = Form("guide", 9, 6, 15, _constants, _put, _get, None, _travel, _dip, None, _travel_blur)
