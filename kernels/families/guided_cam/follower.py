"""Displacement of the follower for a given length of thread, and the pressure angle at which it jams in its guide."""

from __future__ import annotations

import math

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2
from kernels.jit import inline, kernel
from kernels.linkage.verdict import pose_status
from kernels.types import EPS, Array, Status


@inline
def displacement(thread: float, across_z: float, across_x: float) -> float:
    """Return S^2 = L^2/4 - Z1^2 - (e - X1)^2 without the cancellation of large squares; (10)."""
    half = 0.5 * thread
    off = np.sqrt(across_z * across_z + across_x * across_x)
    return (half - off) * (half + off)  # type: ignore[no-any-return]


@inline
def reaches(square: float, thread: float) -> int:
    """Return the status of a squared displacement:
    within the rounding of L^2/4 it is zero, the thread just as long as its way.
    """
    code = pose_status(math.isfinite(square), square, EPS * thread * thread, None)
    return st.NOT_ASSEMBLED if code != st.INVALID_INPUT and not thread > 0.0 else code


@inline
def follow(s: float, thread: float, first: float, second: float) -> tuple[float, float]:
    """Return S' and S'' from L, L', L''; (11), (12)."""
    ds = thread * first / (4.0 * s)
    return ds, (0.25 * (first * first + thread * second) - ds * ds) / s


@kernel
def follower(data: Array, status: Status, S: Array | None, dS: Array | None, d2S: Array | None) -> None:
    """Compute the displacement of the follower and its derivatives from the length of thread;
    (10) to (12) of docs/takeup.md.

    Parameters
    ----------
    data : (n, 6), columns L, dL, d2L, Z1, e, X1 [length]
    status : (n,) out; NOT_ASSEMBLED where the thread is shorter than the way between the guides, DEAD_POINT where it is
        just as long (S = 0, infinite slope), INVALID_INPUT where a number is not finite
    S, dS, d2S : (n,) out or None [length]; nan where the status is not OK, but S = 0 at a dead point

    Notes
    -----
    Measured on the oracle table: errors below 8 * 2^-53 * max(cond, |y|).
    """
    for i in range(data.shape[0]):
        thread, first, second = data[i, 0], data[i, 1], data[i, 2]
        square = displacement(thread, data[i, 3], data[i, 4] - data[i, 5])
        code = reaches(square, thread) if math.isfinite(first + second) else st.INVALID_INPUT
        status[i] = code
        good = 1.0 if code == st.OK else math.nan
        s = math.sqrt(square) if code == st.OK else 0.0 if code == st.DEAD_POINT else math.nan
        ds, d2s = follow(good * s, thread, first, second)
        if S is not None:
            S[i] = s
        if dS is not None:
            dS[i] = ds
        if d2S is not None:
            d2S[i] = d2s


@inline
def jam_angle(mu1: float, mu2: float) -> float:
    """Return the pressure angle at which the follower jams: 90 deg - arctan mu1 - arctan mu2; (13)."""
    # one arctangent of the sum's tangent: it goes on below 0 where mu1 mu2 > 1 and subtracts nothing from 90 deg
    return arctan2(1.0 - mu1 * mu2, mu1 + mu2)  # type: ignore[no-any-return]


@kernel
def jam_angles(friction: Array, angle: Array, tan_half: Array) -> None:
    """Compute the permissible pressure angle of the follower and the tangent of its half;
    (13), (14) of docs/takeup.md.

    Parameters
    ----------
    friction : (n, 2), coefficients of friction mu1 on the cam, mu2 in the guide, not negative
    angle : (n,) out [rad]; negative where mu1 mu2 > 1: it jams at every angle
    tan_half : (n,) out
    """
    for i in range(friction.shape[0]):
        mu1, mu2 = friction[i, 0], friction[i, 1]
        angle[i] = jam_angle(mu1, mu2)
        # -m + sqrt(1 + m^2) with numerator and denominator multiplied: no difference for mu1 mu2 < 1.
        rest, both = 1.0 - mu1 * mu2, mu1 + mu2
        tan_half[i] = rest / (math.hypot(rest, both) + both)
