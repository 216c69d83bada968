"""Dwell measures of the geared dwell drive: return dwell, deviation, band dwell."""

from __future__ import annotations

import math

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.families.geared_dwell.closure import Array, Reduced, Status, pin, reduce_design, velocity


@inline
def rising_angle(r: Reduced, psi: float, extreme: float) -> float:
    """Find where psi, rising from its extreme to pi at phi = pi, takes a value;
    nan if the iteration does not settle.
    """
    low, high = extreme, math.pi
    phi, before = min(2.0 * extreme, 0.5 * (low + high)), math.inf  # twice the extreme is the root for k -> 1
    for _ in range(100):
        u, v = math.cos(phi), math.sin(phi)
        h = r.front if u > 0.0 else r.back
        t = v * v / (1.0 + h.sign * u)
        x, y, _ = pin(h, t, h.sign * v)
        excess = math.atan2(h.sign * y, h.sign * x) - psi
        if excess < 0.0:
            low = phi
        else:
            high = phi
        # Newton's step, or bisection where it leaves the bracket or does not halve what is left.
        following = phi - excess / velocity(h, r.ak4, t, x * x + y * y)
        if not (low < following < high) or abs(excess) > 0.5 * before:
            following = 0.5 * (low + high)
        if abs(following - phi) <= 2.0**-51 * phi or not (low < following < high):
            return following
        phi, before = following, abs(excess)
    return math.nan


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
    designs : (n, 2) columns of :class:`Design`
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
        if turns is not None:
            turns[i] = r.turns if code == st.OK else math.nan
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
                    band = 2.0 * rising_angle(r, deviation, 2.0 * math.asin(math.sqrt(0.5 * t)))
                    code = st.NOT_CONVERGED if band != band else code
            if dwell_deviation is not None:
                dwell_deviation[i] = deviation
            if dwell_band is not None:
                dwell_band[i] = band
        status[i] = code
