"""P2, P3: direction of the coupler force at the follower and at the crank.

t_tau, t_rho, t_k are the components of the coupler's unit vector along the tangential, radial and axial direction of
the follower.  Angles are formed from them by arctangents for reporting only: theta2 is undetermined where t_rho = 0.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import kernel
from kernels.joints import read
from kernels.vectors import dot

Array = NDArray[np.float64]
Status = NDArray[np.uint8]


@kernel
def directions(
    poses: Array,
    designs: Array,
    status: Status,
    t_tau: Array | None,
    t_rho: Array | None,
    t_k: Array | None,
    theta1: Array | None,
    theta2: Array | None,
    theta3: Array | None,
) -> None:
    """Compute components of the coupler direction and the radial, axial and crank-side pressure angles.

    Parameters
    ----------
    poses : (n, m, PER_POSE), designs : (n, PER_DESIGN), records of :mod:`kernels.joints`
    status : (n, m), in; nan where it is not OK
    t_tau, t_rho, t_k : (n, m) or None; t_tau carries the sign of the branch
    theta1 : (n, m) or None; radial angle in [0, pi/2], tan = |t_rho/t_tau|
    theta2, theta3 : (n, m) or None; axial angles in (-pi/2, pi/2], tan = t_k/t_rho (follower), n_u/n_rho (crank)
    """
    for i in range(poses.shape[0]):
        for k in range(poses.shape[1]):
            j = read(poses[i, k], designs[i])
            good = 1.0 if status[i, k] == st.OK else math.nan
            rho, along = dot(j.s, j.rho), dot(j.s, j.k)
            if t_tau is not None:
                t_tau[i, k] = good * j.t_tau
            if t_rho is not None:
                t_rho[i, k] = good * rho
            if t_k is not None:
                t_k[i, k] = good * along
            if theta1 is not None:
                theta1[i, k] = good * math.atan2(abs(rho), abs(j.t_tau))
            if theta2 is not None:
                sign = 1.0 if rho >= 0.0 else -1.0
                theta2[i, k] = good * math.atan2(sign * along, abs(rho))
            if theta3 is not None:
                radial = dot(j.s, j.rho_b)
                side = 1.0 if radial >= 0.0 else -1.0
                theta3[i, k] = good * math.atan2(side * dot(j.s, j.u), abs(radial))
