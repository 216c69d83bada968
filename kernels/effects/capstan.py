"""Euler's law for a thread over an eyelet: tension behind it and the force the thread puts on the eyelet.

The limit alpha = B = 0 of :mod:`kernels.effects.thread_contour`; docs/thread.md (5), (6).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import kernel

Array = NDArray[np.float64]
Status = NDArray[np.uint8]


@kernel
def capstan(
    before: Array, wrap: Array, friction: Array, status: Status, tension: Array | None, force: Array | None
) -> None:
    """Compute the tension behind the eyelet and magnitude of the force on it.

    Parameters
    ----------
    before : (n, m), tension T1 in front of the eyelet [force]
    wrap : (n, m), wrap angle [rad];  friction : (n,), coefficient of friction mu
    status : (n, m), in and out; INVALID_INPUT where T1, the angle or mu is negative or not finite: these give nan
    tension : (n, m) or None, T2 = T1 e^(mu wrap)
    force : (n, m) or None, |T1 e1 + T2 e2| = sqrt((T2 - T1)^2 + 4 T1 T2 sin^2(wrap/2))
    """
    for i in range(before.shape[0]):
        mu = friction[i]
        for j in range(before.shape[1]):
            t1, angle = before[i, j], wrap[i, j]
            t2 = t1 * math.exp(mu * angle)
            valid = mu >= 0.0 and t1 >= 0.0 and angle >= 0.0 and math.isfinite(t2)
            if status[i, j] == st.OK and not valid:
                status[i, j] = st.INVALID_INPUT
            good = 1.0 if status[i, j] == st.OK else math.nan
            if tension is not None:
                tension[i, j] = good * t2
            if force is not None:
                # As a sum of squares it keeps its digits for a nearly straight thread.
                force[i, j] = good * math.hypot(
                    t1 * math.expm1(mu * angle), 2.0 * math.sqrt(t1 * t2) * math.sin(0.5 * angle)
                )
