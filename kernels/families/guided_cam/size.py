"""Least radius of the cam: where the pressure angle stays within what the guide allows."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.families.guided_cam.follower import displacement, follow, jam_angle
from kernels.families.guided_cam.motion import Reduced, law, reduce_design

Array = NDArray[np.float64]
Status = NDArray[np.uint8]

LOOKS = 512  # over the turn; where S is small its root has far shorter waves than the series P
STEPS = 60  # halvings of two looks' distance, which is 2^-5: the place is then as exact as float64 has it


@kernel
def least_radius(designs: Array, status: Status, radius: Array, place: Array, angle: Array, displaced: Array) -> None:
    """Compute the least R0 for which the pressure angle nowhere exceeds the jamming angle; (16) of docs/takeup.md.

    Parameters
    ----------
    designs : (n, 19), see :data:`kernels.families.guided_cam.motion.COLUMNS`; R0 is not used
    status : (n,) out; NOT_ASSEMBLED where the thread does not reach all through the turn, JAMMED where the follower
        jams at every pressure angle (mu1 mu2 >= 1), INVALID_INPUT
    radius : (n,) out [length]; cam radius at the least displacement, not below 0
    place : (n,) out [rad]; cam angle that asks for it, -pi to pi
    angle : (n,) out [rad]; jamming angle;  displaced : (n,) out [length]; least displacement S over the turn
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        limit = jam_angle(designs[i, 5], designs[i, 6])
        code = st.OK if r.least > 0.0 else st.NOT_ASSEMBLED
        # "not >" also catches a limit that is no number
        if code == st.OK and not limit > 0.0:
            code = st.JAMMED
        if not r.valid:
            code = st.INVALID_INPUT
        status[i], angle[i], displaced[i] = code, limit, r.least * r.unit
        radius[i], place[i] = math.nan, math.nan
        if code == st.OK:
            cotangent = 1.0 / math.tan(limit)
            best, where = -math.inf, 0.0
            # rise and return: the guide jams alike whichever way the follower is pressed aside
            for sign in (1.0, -1.0):
                value, at = _largest(designs, i, r, sign * cotangent)
                if value > best:
                    best, where = value, at
            radius[i] = max(best + r.least, 0.0) * r.unit
            # the bisection may have left the turn at its seam
            place[i] = where - 2.0 * math.pi * np.rint(where / (2.0 * math.pi))


@inline
def _need(designs: Array, i: int, r: Reduced, cotangent: float, phi: float) -> tuple[float, float]:
    """Evaluate S' cot - S, which is the radius needed at a cam angle but for a constant, and its derivative."""
    value, first, second = law(designs, i, math.cos(phi), math.sin(phi))
    thread = r.store + value / r.unit
    s = math.sqrt(displacement(thread, r.across_z, r.across_x))
    ds, d2s = follow(s, thread, first / r.unit, second / r.unit)
    return ds * cotangent - s, d2s * cotangent - ds


@inline
def _largest(designs: Array, i: int, r: Reduced, cotangent: float) -> tuple[float, float]:
    """Find the largest radius needed over the turn and its place: the best sample, then its slope's zero."""
    best, where, step = -math.inf, 0.0, 2.0 * math.pi / LOOKS
    for j in range(LOOKS):
        value = _need(designs, i, r, cotangent, step * j)[0]
        if value > best:
            best, where = value, step * j
    low, high = where - step, where + step
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        if _need(designs, i, r, cotangent, middle)[1] > 0.0:
            low = middle
        else:
            high = middle
    middle = 0.5 * (low + high)
    # the larger of both: where two maxima share the bracket the bisection may have come to the lower one
    return max(_need(designs, i, r, cotangent, middle)[0], best), middle
