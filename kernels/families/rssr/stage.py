"""The spatial crank-rocker as a stage of a fused chain, and the beginning of a chain (:mod:`kernels.chains`)."""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

from kernels.arithmetic.intrinsics import largest
from kernels.chains.form import STRIDE, Form, Travel, Turned
from kernels.families.rssr.block import (
    ACROSS,
    BLOCK,
    DELTA,
    TOLERANCE,
    VALID,
    least_delta,
    load_block,
    new_block,
    singularity_distance,
)
from kernels.families.rssr.careful import roundings
from kernels.families.rssr.closure import acceleration, jerk, place, reduce_one, rocker, snap, velocity
from kernels.jit import inline, kernel
from kernels.linkage.verdict import turning_status
from kernels.types import EPS, Array, Status

# The numbers of the closure in units of the crank, see :class:`kernels.linkage.crank_closure.Reduced`.
# ``per_square``: 1/b^2.
Constants = namedtuple("Constants", "e y0 ca k0 k1 k2 branch w_size per_square doubt")


@inline
def _constants(at: Array, i: int, step: int, cos: Any, sin: Any) -> Constants:
    d = (
        at[i], at[i + step], at[i + 2 * step], at[i + 3 * step], at[i + 4 * step], at[i + 5 * step], at[i + 6 * step],
        at[i + 7 * step],
    )  # fmt: skip
    r = reduce_one(d)
    mx, my, mw = abs(r.e) + 1.0, abs(r.y0) + 1.0, r.w_size
    unit = 8.0 * EPS
    # discriminant_tolerance where every term has its full size
    doubt = (unit + unit * unit) * (mx * mx + my * my + mw * mw) if r.valid else math.nan
    per_square = 1.0 / (r.coupler * r.coupler)
    return Constants(r.e, r.y0, r.ca, r.k0, r.k1, r.k2, r.branch, r.w_size, per_square, doubt)


@inline
def _put(at: Array, i: int, c: Constants) -> None:
    at[i], at[i + STRIDE], at[i + 2 * STRIDE], at[i + 3 * STRIDE] = c.e, c.y0, c.ca, c.k0
    at[i + 4 * STRIDE], at[i + 5 * STRIDE], at[i + 6 * STRIDE] = c.k1, c.k2, c.branch
    at[i + 7 * STRIDE], at[i + 8 * STRIDE], at[i + 9 * STRIDE] = c.w_size, c.per_square, c.doubt


@inline
def _get(at: Array, i: int) -> Constants:
    return Constants(
        at[i], at[i + STRIDE], at[i + 2 * STRIDE], at[i + 3 * STRIDE], at[i + 4 * STRIDE], at[i + 5 * STRIDE],
        at[i + 6 * STRIDE], at[i + 7 * STRIDE], at[i + 8 * STRIDE], at[i + 9 * STRIDE],
    )  # fmt: skip


@inline
def _turn(c: Constants, kappa: Any, u: Any, v: Any) -> Turned:
    at = place(c.e, c.y0, c.ca, c.k0, c.k1, c.k2, u, v)
    t = math.sqrt(largest(at.delta, 1e-300))
    to = rocker(at, t, 1.0 / (at.rr * t))
    first = velocity(c.k1, c.k2, to, at)
    second = acceleration(to, at, first)
    third = jerk(to, at, first, second)
    fourth, sign = snap(to, at, first, second, third), c.branch * kappa
    return Turned(-to.c, -sign * to.s, -sign * first.p, -sign * second.q, sign * third, sign * fourth, at.delta)


@inline
def _travel(c: Constants, u: Any, v: Any) -> Travel:
    m = _turn(c, 1.0, u, v)
    return Travel(math.nan, m.d1, m.d2, m.d3, m.d4, 0.0, 0.0, 0.0, 0.0, 0.0, m.delta)


@inline
def _dip(c: Constants, u: Any, v: Any) -> tuple[Any, Any, Any]:
    at = place(c.e, c.y0, c.ca, c.k0, c.k1, c.k2, u, v)
    w_ph = c.k1 * u + c.k2 * v
    first = at.x * v + at.y * at.hu - at.w * w_ph
    second = v * v + at.x * u + (at.hu * at.hu - at.y * at.hv) - (w_ph * w_ph + at.w * at.w1)
    return at.delta * c.per_square, 2.0 * first * c.per_square, 2.0 * second * c.per_square


@inline
def _turn_blur(c: Constants, u: Any, v: Any, d1: Any, d2: Any, d3: Any) -> tuple[Any, Any, Any, Any]:
    """Estimate rounding errors of the angle and its derivatives as :func:`kernels.families.rssr.careful.rounding`."""
    share, angle, terms, per_t, _ = roundings(c, u, v)
    more = 1.0 + per_t
    first = abs(d1) * (1.5 * share + 8.0 * EPS) + terms
    second = abs(d2) * (2.5 * share + 8.0 * EPS) + terms * more
    third = abs(d3) * (3.5 * share + 8.0 * EPS) + terms * (more * more)
    return angle + 4.0 * EPS, first, second, third


@inline
def _travel_blur(c: Constants, u: Any, v: Any, d1: Any, d2: Any, d3: Any) -> tuple[Any, ...]:
    angle, first, second, third = _turn_blur(c, u, v, d1, d2, d3)
    _, _, _, _, tolerance = roundings(c, u, v)
    return angle, first, second, third, 0.0, 0.0, 0.0, 0.0, tolerance * c.per_square


FORM = Form("rssr", 8, None, 10, _constants, _put, _get, _turn, _travel, _dip, _turn_blur, _travel_blur)


@kernel
def opening(designs: Array, status: Status, distance: Array) -> None:
    """Decide whether the first stage of a chain turns, and find the distance of its motion's nearest singularity.

    Parameters
    ----------
    designs : (n, P), whose first columns are `PARAMETERS` of sweep/families/rssr.py
    status : (n,) out; OK, NOT_ROTATABLE, UNDECIDABLE or INVALID_INPUT
    distance : (n,) out [rad], to leading order, of the nearest singularity of the motion from the real crank angles;
        it means nothing where the status is not OK
    """
    at = new_block()
    for start in range(0, designs.shape[0], BLOCK):
        count = min(BLOCK, designs.shape[0] - start)
        load_block(designs, start, count, at)
        least_delta(count, at)
        singularity_distance(count, at)
        for k in range(count):
            status[start + k] = turning_status(at[k + DELTA], at[k + TOLERANCE], at[k + VALID] != 0.0)
            distance[start + k] = at[k + ACROSS]
