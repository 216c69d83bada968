"""The guided four-bar as the last stage of a fused chain (:mod:`kernels.chains`)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from kernels.arithmetic.intrinsics import largest
from kernels.chains.form import STRIDE, Form, Travel
from kernels.families.guide.closure import Design, acceleration, jerk, place, reduce_along, snap, velocity
from kernels.jit import inline
from kernels.types import EPS, Array


class Constants(NamedTuple):
    """The numbers of :class:`kernels.families.guide.closure.Reduced`; the point in the user's unit of length."""

    a: Any
    e: Any
    k0: Any
    k2: Any
    p_along: Any
    p_across: Any
    q_along: Any
    q_across: Any
    along0: Any
    across0: Any
    branch: Any
    x_size: Any
    w_size: Any
    per_square: Any  # 1/b^2 in the unit of the closure
    doubt: Any


@inline
def _constants(at: Array, i: int, step: int, cos: Any, sin: Any) -> Constants:
    d = Design(
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
    """Errors of psi and its derivatives as of the crank-rocker's, times the arm by which they move the point."""
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
