"""The spatial slider-crank as the last stage of a fused chain or by itself (:mod:`kernels.chains`); the planar one too.

The planar slider-crank is the spatial one with alpha = 0 and f = 0 whose crank angle is a quarter turn less.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

from kernels.arithmetic.intrinsics import largest, power_below, smallest
from kernels.chains.form import STRIDE, Form, Travel
from kernels.curves.polynomials import far_minimum, point
from kernels.families.rssp.margin import least_q
from kernels.families.rssp.motion import reduce_design
from kernels.jit import inline, kernel
from kernels.linkage.slider_closure import Reduced, place, reduce_along, root_derivatives
from kernels.linkage.verdict import turning_status
from kernels.types import EPS, Array, Status

# The numbers of :class:`kernels.linkage.slider_closure.Reduced`.
# ``per_square``: 1/b^2.
Constants = namedtuple("Constants", "a b e k0 ka n0 na m_size n_size branch unit per_square doubt")


@inline
def _of(r: Reduced) -> Constants:
    unit = 8.0 * EPS
    # kernels.linkage.slider_closure.tolerance where m and n have their full size
    doubt = (unit + unit * unit) * (r.m_size * r.m_size + r.n_size * r.n_size) if r.valid else math.nan
    return Constants(
        r.a, r.b, r.e, r.k0, r.ka, r.n0, r.na, r.m_size, r.n_size, r.branch, r.unit, 1.0 / (r.b * r.b), doubt
    )


@inline
def _constants(at: Array, i: int, step: int, cos: Any, sin: Any) -> Constants:
    half_unit = power_below(at[i + step])
    per_unit = 0.5 / half_unit
    a, b, e, f = at[i] * per_unit, at[i + step] * per_unit, at[i + 2 * step] * per_unit, at[i + 3 * step] * per_unit
    return _of(reduce_along(a, b, e, f, at[i + 4 * step], cos, sin, at[i + 5 * step], 2.0 * half_unit))


@inline
def _planar_constants(at: Array, i: int, step: int, cos: Any, sin: Any) -> Constants:
    half_unit = power_below(at[i + step])
    per_unit = 0.5 / half_unit
    a, b, e = at[i] * per_unit, at[i + step] * per_unit, at[i + 2 * step] * per_unit
    return _of(reduce_along(a, b, -e, 0.0, 0.0, 1.0, 0.0, at[i + 3 * step], 2.0 * half_unit))


@inline
def _put(at: Array, i: int, c: Constants) -> None:
    at[i], at[i + STRIDE], at[i + 2 * STRIDE], at[i + 3 * STRIDE] = c.a, c.b, c.e, c.k0
    at[i + 4 * STRIDE], at[i + 5 * STRIDE], at[i + 6 * STRIDE] = c.ka, c.n0, c.na
    at[i + 7 * STRIDE], at[i + 8 * STRIDE], at[i + 9 * STRIDE] = c.m_size, c.n_size, c.branch
    at[i + 10 * STRIDE], at[i + 11 * STRIDE], at[i + 12 * STRIDE] = c.unit, c.per_square, c.doubt


@inline
def _get(at: Array, i: int) -> Constants:
    return Constants(
        at[i], at[i + STRIDE], at[i + 2 * STRIDE], at[i + 3 * STRIDE], at[i + 4 * STRIDE], at[i + 5 * STRIDE],
        at[i + 6 * STRIDE], at[i + 7 * STRIDE], at[i + 8 * STRIDE], at[i + 9 * STRIDE], at[i + 10 * STRIDE],
        at[i + 11 * STRIDE], at[i + 12 * STRIDE],
    )  # fmt: skip


@inline
def _travel(c: Constants, u: Any, v: Any) -> Travel:
    """Equations (1), (2) and (5) to the fourth order; x is s."""
    _, _, q = place(c, u, v)
    y, lift, swing = c.k0 + c.ka * v, c.ka * u, c.ka * v
    w = c.branch * math.sqrt(largest(q, 1e-300))
    per_w = 1.0 / w
    w1, w2, w3 = root_derivatives(c, u, v, y, per_w)
    q2 = c.ka * (lift * u - v * y) - c.a * u * c.e
    # Q''''/2 = -Q''/2 - 3 ka^2 cos 2 phi
    w4 = (-q2 - 3.0 * (lift * lift - swing * swing) - 4.0 * w1 * w3 - 3.0 * w2 * w2) * per_w
    return Travel(
        (y + w) * c.unit,
        (lift + w1) * c.unit,
        (w2 - swing) * c.unit,
        (w3 - lift) * c.unit,
        (w4 + swing) * c.unit,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        q,
    )


@inline
def _dip(c: Constants, u: Any, v: Any) -> tuple[Any, Any, Any]:
    _, _, q = place(c, u, v)
    y = c.k0 + c.ka * v
    q1 = c.ka * u * y - c.a * v * c.e
    q2 = c.ka * (c.ka * u * u - v * y) - c.a * u * c.e
    return q * c.per_square, 2.0 * q1 * c.per_square, 2.0 * q2 * c.per_square


@inline
def _travel_blur(c: Constants, u: Any, v: Any, x1: Any, x2: Any, x3: Any) -> tuple[Any, ...]:
    """Estimate rounding errors of s and its derivatives, from those of Q by w w' = Q'/2 and its derivatives."""
    m, n, q = place(c, u, v)
    root = math.sqrt(largest(q, 1e-300))
    per_w = 1.0 / root
    w1, w2, w3 = root_derivatives(c, u, v, c.k0 + c.ka * v, c.branch * per_w)
    w1, w2, w3, lift = abs(w1), abs(w2), abs(w3), abs(c.ka)
    # As kernels.linkage.slider_closure.tolerance: where f is long and Q small, Q has most of that.
    tolerance = 8.0 * EPS * (abs(m) * c.m_size + abs(n) * c.n_size) + 4.0 * EPS * abs(q)
    share = 0.5 * tolerance * per_w * per_w + 4.0 * EPS  # relative error of w, and of a sum times 1/w
    terms = 8.0 * EPS * (lift * (abs(c.k0) + 4.0 * lift) + c.a * abs(c.e))
    b1 = w1 * share + terms * per_w
    b2 = w2 * share + (terms + 2.0 * w1 * b1) * per_w
    b3 = w3 * share + (terms + 3.0 * (w1 * b2 + w2 * b1)) * per_w
    e0 = root * share + 4.0 * EPS * (abs(c.k0) + lift)
    e1, e2, e3 = b1 + 4.0 * EPS * (lift + w1), b2 + 4.0 * EPS * (lift + w2), b3 + 4.0 * EPS * (lift + w3)
    return e0 * c.unit, e1 * c.unit, e2 * c.unit, e3 * c.unit, 0.0, 0.0, 0.0, 0.0, tolerance * c.per_square


@inline
def _planar_travel(c: Constants, u: Any, v: Any) -> Travel:
    return _travel(c, -v, u)


@inline
def _planar_dip(c: Constants, u: Any, v: Any) -> tuple[Any, Any, Any]:
    return _dip(c, -v, u)


@inline
def _planar_travel_blur(c: Constants, u: Any, v: Any, x1: Any, x2: Any, x3: Any) -> tuple[Any, ...]:
    return _travel_blur(c, -v, u, x1, x2, x3)


FORM = Form("rssp", 6, 4, 13, _constants, _put, _get, None, _travel, _dip, None, _travel_blur)
PLANAR_FORM = Form(
    "slider_crank", 4, None, 13, _planar_constants, _put, _get, None, _planar_travel, _planar_dip, None,
    _planar_travel_blur,
)  # fmt: skip


@kernel
def opening(designs: Array, status: Status, distance: Array) -> None:
    """Decide whether the crank of a single slider-crank turns, and find the distance of the nearest singularity.

    Parameters
    ----------
    designs : (n, 6) columns as `PARAMETERS` of sweep/families/rssp.py
    status : (n,) out; OK, NOT_ROTATABLE, UNDECIDABLE or INVALID_INPUT
    distance : (n,) out [rad], to leading order, of the nearest complex zero of Q from the real crank angles; there
        alone the motion is singular.  It means nothing where the status is not OK
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        least = least_q(r)
        status[i] = turning_status(least.q, least.tolerance, r.valid)
        # Q less a constant, as least_q has it.  Its second minimum, where there is one, counts too.
        c1, s1, c2 = 2.0 * r.a * r.e, 2.0 * r.n0 * r.na, -0.5 * r.ka * r.ka
        here = point(c1, s1, c2, 0.0, least.cos, least.sin)
        there = point(c1, s1, c2, 0.0, *far_minimum(c2, 1e-150, least.cos, least.sin))
        near = 2.0 * least.q / largest(here.curvature, 1e-300)
        far = 2.0 * (least.q + there.value - here.value) / largest(there.curvature, 1e-300)
        distance[i] = math.sqrt(largest(smallest(near, far), 0.0))
