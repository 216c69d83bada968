"""Crank of a central slot for a wanted crank angle between the limit positions; (8) of docs/slotted.md."""

from __future__ import annotations

import math

from kernels import status as st
from kernels._jit import kernel
from kernels.families.slotted.closure import Numbers, Status


@kernel
def crank_of_phi0(phi0: Numbers, e: Numbers, f: Numbers, alpha: Numbers, status: Status, a: Numbers) -> None:
    """Compute the crank length a = cos(phi0/2) hypot(e, f tan(alpha)) of the fork slot with s = 0.

    Parameters
    ----------
    phi0 : (n,) crank angle of the shorter stroke between the limit positions [rad], 0 < phi0 < pi
    e, f : (n,) common perpendicular and offset of the crank plane [length];  alpha : (n,) [rad]
    status : (n,) out; OK, or NOT_ADMISSIBLE where phi0 is outside (0, pi), the driven axis meets the crank's, or
        cos(alpha) = 0 within rounding, where the projected crank circle is a segment
    a : (n,) out [length]; nan where the status is not OK
    """
    for i in range(phi0.shape[0]):
        tangent = math.tan(alpha[i])
        reach = math.hypot(e[i], f[i] * tangent)
        fine = 0.0 < phi0[i] < math.pi and 0.0 < reach < math.inf and abs(tangent) < 1e15
        status[i] = st.OK if fine else st.NOT_ADMISSIBLE
        a[i] = math.cos(0.5 * phi0[i]) * reach if fine else math.nan
