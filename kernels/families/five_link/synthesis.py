"""Five-links with the limit positions of a crank-rocker; (10) of docs/five_link.md.

In its limit positions the five-link lies in the plane of crank axis and crank, as the crank-rocker does, so that the
same rocker and the same axes serve: only crank and coupler change with h.
"""

from __future__ import annotations

import math

import numpy as np

from kernels import status as st
from kernels._jit import kernel
from kernels.crank_closure import Array, Status


@kernel
def with_limits_of(
    designs: Array, psi_ext: Array, psi_fold: Array, h: Array, status: Status, a: Array, b: Array
) -> None:
    """Compute the crank and coupler of the five-links with s2 = 0
    that have the limit positions of given crank-rockers.

    Parameters
    ----------
    designs : (n, 8) crank-rockers: a, b, c, e, f, g, alpha, branch
    psi_ext, psi_fold : (n,) their rocker angles in the extended and the folded limit position [rad]
    h : (n,) common perpendicular of the two revolutes
    status : (n,) out; OK, INVALID_INPUT, or NOT_ADMISSIBLE where no crank of positive length, or no coupler that
        reaches beyond the second revolute, has these limit positions
    a, b : (n,) out [length]; nan where the status is not OK
    """
    for i in range(designs.shape[0]):
        crank, c, e, f, g, alpha = (
            designs[i, 0],
            designs[i, 2],
            designs[i, 3],
            designs[i, 4],
            designs[i, 5],
            designs[i, 6],
        )
        sa, ca = math.sin(alpha), math.cos(alpha)
        # distance of the ball from the crank axis in both positions, and its height over the crank plane in the first
        y1, y2 = c * math.sin(psi_ext[i]), c * math.sin(psi_fold[i])
        rho1 = math.hypot(c * math.cos(psi_ext[i]) + e, y1 * ca - g * sa)
        rho2 = math.hypot(c * math.cos(psi_fold[i]) + e, y2 * ca - g * sa)
        between = rho1 + rho2 - 2.0 * h[i]
        found = (crank * (rho1 + rho2) - h[i] * (rho1 - rho2)) / between
        across = rho1 - found - h[i]
        admissible = found > 0.0 and across > 0.0 and rho2 + found > h[i]
        status[i] = st.OK if admissible else st.NOT_ADMISSIBLE
        if found - found != 0.0:  # infinite or no number
            status[i] = st.INVALID_INPUT
        a[i] = found if status[i] == st.OK else math.nan
        b[i] = np.hypot(across, y1 * sa + g * ca - f) if status[i] == st.OK else math.nan
