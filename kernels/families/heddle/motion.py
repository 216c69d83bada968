"""Motion of a heddle shaft over the angle of its cam lever: bell crank, shaft lever, lift of the shaft."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.complex_step import arctan2, magnitude
from kernels.families.heddle.closure import Array, Reduced, Status, driven, driven_rates, reduce_design


@inline
def _shaft_lever(r: Reduced, cos_turn: Any, sin_turn: Any, rates: bool) -> tuple[Any, Any, tuple[Any, Any, Any], int]:
    """Return the cosine and sine of the shaft lever's angle from mid-stroke, its rates by that of the bell crank,
    status; (6).
    """
    if r.parallel:
        one = 1.0 + 0.0 * cos_turn
        return cos_turn, sin_turn, (one, 0.0 * one, 0.0 * one), st.OK
    u, v = -(r.side_f * sin_turn), r.side_f * cos_turn
    cos, sin, t, _, code = driven(r.second, u, v)
    # at a dead point the position stands but its rates do not exist: nan, so that no quotient by t = 0 is taken
    safe = t if code == st.OK else math.nan * t
    slopes = driven_rates(r.second, u, v, cos, sin, safe) if rates else (safe, safe, safe)
    return r.side_f * sin, -(r.side_f * cos), slopes, code


@inline
def _chained(outer: tuple[Any, Any, Any], inner: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
    """Return three derivatives of a function of a function."""
    f1, f2, f3 = outer
    g1, g2, g3 = inner
    return f1 * g1, f2 * g1 * g1 + f1 * g2, f3 * g1 * g1 * g1 + 3.0 * f2 * g1 * g2 + f1 * g3


@inline
def _lift(r: Reduced, cos: Any, sin: Any, rates: tuple[Any, Any, Any]) -> tuple[Any, Any, Any, Any, bool]:
    """Return the lift of the shaft and its three derivatives;
    false if the heddle rod does not reach the slide; (7)-(9).
    """
    x, y = r.arm * cos, r.arm * sin
    l1, l2, l3 = rates
    y1, y2 = x * l1, x * l2 - y * l1 * l1
    y3 = x * (l3 - l1 * l1 * l1) - 3.0 * y * l1 * l2
    if not r.finite:
        return y, y1, y2, y3, True
    x1, x2 = -(y * l1), -(y * l2) - x * l1 * l1
    x3 = -(y * (l3 - l1 * l1 * l1)) - 3.0 * x * l1 * l2
    z = x - r.slide
    # product of sum and difference: the difference of two squares loses digits where the rod lies nearly flat
    square = (r.heddle - z) * (r.heddle + z)
    if not square.real > 0.0:
        none = math.nan * y
        return none, none, none, none, False
    h = np.sqrt(square)
    h1 = -(z * x1) / h
    h2 = -(x1 * x1 + z * x2 + h1 * h1) / h
    h3 = -(3.0 * x1 * x2 + z * x3 + 3.0 * h1 * h2) / h
    return y + h, y1 + h1, y2 + h2, y3 + h3, True


@kernel
def poses(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    status: Status,
    chi: Array | None,
    dchi: Array | None,
    d2chi: Array | None,
    d3chi: Array | None,
    y: Array | None,
    dy: Array | None,
    d2y: Array | None,
    d3y: Array | None,
    discriminant: Array | None,
    places: Array | None,
) -> None:
    """Compute the bell-crank angle, lift of the shaft
    and their derivatives with respect to the angle of the cam lever.

    Equations (3)-(9) of docs/heddle.md.

    Parameters
    ----------
    designs : (n, 14) columns of :class:`Design`
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs; of the cam lever's angle theta
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT (rod and bell crank in line), SINGULAR or INVALID_INPUT
    chi ... d3chi : (n, m) out [rad], or None: what is None is neither computed nor compiled
    y ... d3y : (n, m) out [length], or None
    discriminant : (n, m) out [length^2], or None; positive where the rod reaches
    places : (7, n, m) out, or None; sine of the transmission angle, pressure angle between rod and bell crank, angle of
        the shaft lever, B and C (x, y each)

    Where the status is not OK the values are nan, except that a dead point of the rod keeps its position.
    """
    rates_wanted = dy is not None or d2y is not None or d3y is not None
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            cos, sin, t, delta, code = driven(r.first, u, v)
            if not r.valid:
                code = st.INVALID_INPUT
            assembled = code == st.OK or code == st.DEAD_POINT
            if not assembled:
                cos, sin, t = math.nan * cos, math.nan * sin, math.nan * t
            turns = driven_rates(r.first, u, v, cos, sin, t if code == st.OK else math.nan * t)
            # the angle from mid-stroke by the addition theorem: no arctangent, and no jump by a full turn
            cos_turn, sin_turn = cos * r.cos_mid + sin * r.sin_mid, sin * r.cos_mid - cos * r.sin_mid
            lever_cos, lever_sin, slopes, lever_code = _shaft_lever(r, cos_turn, sin_turn, rates_wanted)
            lift, lift1, lift2, lift3, reached = _lift(r, lever_cos, lever_sin, _chained(slopes, turns))
            # the first loop that fails names the status: without it what follows has no input
            if assembled and lever_code != st.OK:
                code = lever_code
            elif assembled and not reached:
                code = st.NOT_ASSEMBLED
            status[i, j] = code

            _put_angle(chi, dchi, d2chi, d3chi, i, j, cos, sin, turns)
            if y is not None:
                y[i, j] = lift * r.unit
            if dy is not None:
                dy[i, j] = lift1 * r.unit
            if d2y is not None:
                d2y[i, j] = lift2 * r.unit
            if d3y is not None:
                d3y[i, j] = lift3 * r.unit
            if discriminant is not None:
                # one factor after the other: the square of the unit leaves float64 before the discriminant does
                discriminant[i, j] = (delta * r.unit) * r.unit if r.valid else math.nan
            if places is not None:
                _put_places(places, i, j, r, (u, v), (cos, sin, t), (lever_cos, lever_sin))


@inline
def _put_angle(
    chi: Array | None, dchi: Array | None, d2chi: Array | None, d3chi: Array | None,
    i: int, j: int, cos: Any, sin: Any, turns: tuple[Any, Any, Any],
) -> None:  # fmt: skip
    """Write the bell-crank angle [rad] and its derivatives where they are wanted."""
    if chi is not None:
        chi[i, j] = arctan2(sin, cos)
    if dchi is not None:
        dchi[i, j] = turns[0]
    if d2chi is not None:
        d2chi[i, j] = turns[1]
    if d3chi is not None:
        d3chi[i, j] = turns[2]


@inline
def _put_places(
    places: Array, i: int, j: int, r: Reduced, cam: tuple[Any, Any], bell: tuple[Any, Any, Any], lever: tuple[Any, Any]
) -> None:
    """Write transmission and pressure angle of the rod, angle of the shaft lever, and B and C."""
    u, v = cam
    cos, sin, t = bell
    bar = r.first
    places[0, i, j] = -t / r.rod
    # atan2, not acos: acos loses half the digits near zero.
    places[1, i, j] = arctan2(magnitude(bar.c - (bar.k0 - bar.k2 * u)), magnitude(t))
    places[2, i, j] = arctan2(lever[1], lever[0])
    places[3, i, j], places[4, i, j] = bar.a * u * r.unit, bar.a * v * r.unit
    places[5, i, j], places[6, i, j] = (bar.e + bar.c * cos) * r.unit, bar.c * sin * r.unit
