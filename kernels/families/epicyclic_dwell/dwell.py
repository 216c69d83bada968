"""Dwell of the geared drive around phi = 0: return dwell, deviation, band; (5)-(7) of docs/epicyclic_dwell.md."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.families.epicyclic_dwell.motion import MOST_TEETH

Array = NDArray[np.float64]
Status = NDArray[np.uint8]
HALVINGS = 60
STEPS = 64  # per turn of the pin while the end of the band is looked for


@inline
def _output(k: float, a: float, arm: float, mesh: float, phi: float) -> tuple[float, float]:
    """Return the output angle, and its velocity analogue times the squared distance of the pin from the output axis."""
    x = arm * math.cos(phi) - mesh * k * math.cos(arm * phi) + a
    y = arm * math.sin(phi) - k * math.sin(arm * phi)
    x1 = -arm * math.sin(phi) + mesh * k * arm * math.sin(arm * phi)
    y1 = arm * math.cos(phi) - k * arm * math.cos(arm * phi)
    return math.atan2(y, x), x * y1 - y * x1


@kernel
def dwell_measures(designs: Array, status: Status, dwell_angle: Array, deviation: Array, band: Array) -> None:
    """Return dwell, largest deviation from mid-dwell and band dwell around phi = 0.

    Parameters
    ----------
    designs : (n, 4) columns of :class:`kernels.families.epicyclic_dwell.motion.Design`
    status : (n,) out; OK, NO_DWELL (the pin starts at or behind the output axis, or passes behind it within the dwell,
        or the angle does not leave the band before phi = pi) or INVALID_INPUT
    dwell_angle, deviation, band : (n,) out [rad]

    Notes
    -----
    For k <= 1 the output does not turn back at phi = 0, and the three are 0.  Every root is bracketed and bisected.
    """
    for i in range(designs.shape[0]):
        k, a, n, mesh = designs[i, 0], designs[i, 1], designs[i, 2], designs[i, 3]
        arm = n + mesh
        valid = 0.0 < k < 1e30 and abs(a) < 1e30 and mesh * mesh == 1.0
        valid = valid and arm >= 1.0 and n <= MOST_TEETH and n == math.floor(n)
        code = st.OK if valid else st.INVALID_INPUT
        if valid and not arm - mesh * k + a > 0.0:
            code = st.NO_DWELL
        none = 0.0 if code == st.OK else math.nan
        dwell_angle[i], deviation[i], band[i] = none, none, none
        if code == st.OK and k > 1.0 and arm > 1.0:
            # L sin(phi)/sin(L phi) rises from 1 to infinity: one root of y
            low, high = 0.0, math.pi / arm
            for _ in range(HALVINGS):
                phi = 0.5 * (low + high)
                if arm * math.sin(phi) < k * math.sin(arm * phi):
                    low = phi
                else:
                    high = phi
            returned = 0.5 * (low + high)
            low, high = 0.0, returned
            for _ in range(HALVINGS):
                phi = 0.5 * (low + high)
                if _output(k, a, arm, mesh, phi)[1] < 0.0:
                    low = phi
                else:
                    high = phi
            most = -_output(k, a, arm, mesh, 0.5 * (low + high))[0]
            step = 2.0 * math.pi / (arm * STEPS)
            low = returned
            while low + step < math.pi and _output(k, a, arm, mesh, low + step)[0] < most:
                low += step
            high = low + step
            if not 0.0 < most < 0.5 * math.pi or high > math.pi:
                code = st.NO_DWELL
                dwell_angle[i], deviation[i], band[i] = math.nan, math.nan, math.nan
            else:
                for _ in range(HALVINGS):
                    phi = 0.5 * (low + high)
                    if _output(k, a, arm, mesh, phi)[0] < most:
                        low = phi
                    else:
                        high = phi
                dwell_angle[i], deviation[i], band[i] = 2.0 * returned, most, low + high
        status[i] = code
