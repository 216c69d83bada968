"""M1: shaking force without masses: the acceleration of the common centre of mass of links like slender rods.

Ours.  Rods of one mass per length have their centres in the middle, so with lengths a, b, c of crank, coupler, rocker

    (a + b + c) S'' = a B''/2 + b (B'' + C'')/2 + c C''/2,                                                    (1)

primes being derivatives with respect to the crank angle; the centres of the fixed pivots do not move.  A slider has no
length and counts for nothing.  Where the crank turns unevenly, as that of a chain's later stage, its rates w, w' with
respect to the angle that counts make P'' into w^2 P'' + w' P' (2).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import kernel
from kernels.joints import read
from kernels.vectors import dot, mix

Array = NDArray[np.float64]
Status = NDArray[np.uint8]


@kernel
def centre_acceleration(
    poses: Array,
    designs: Array,
    first: Array,
    second: Array,
    status: Status,
    size: Array | None,
    x: Array | None,
    y: Array | None,
    z: Array | None,
) -> None:
    """Compute the acceleration analogue S'' of the common centre of mass, and its magnitude.

    Parameters
    ----------
    poses : (n, m, PER_POSE), designs : (n, PER_DESIGN), records of :mod:`kernels.joints`
    first, second : (n, m) first and second derivative of the crank angle with respect to the angle that counts
    status : (n, m), in; nan where it is not OK
    size, x, y, z : (n, m) or None; magnitude and components along the fixed axes
    """
    for i in range(poses.shape[0]):
        for k in range(poses.shape[1]):
            j = read(poses[i, k], designs[i])
            good = 1.0 if status[i, k] == st.OK else math.nan
            w, dw = first[i, k], second[i, k]
            crank = mix(-j.a * w * w, j.rho_b, j.a * dw, j.tau_b)
            along = j.c * (j.d2psi * w * w + j.dpsi * dw)
            driven = mix(-j.turns * j.c * (j.dpsi * w) ** 2, j.rho, along, j.tau)
            rocker = j.turns * j.c
            total = j.a + j.b + rocker
            s = mix(0.5 * good * (j.a + j.b) / total, crank, 0.5 * (j.b + rocker) / total, driven)
            if size is not None:
                size[i, k] = math.sqrt(dot(s, s))
            if x is not None:
                x[i, k] = s[0]
            if y is not None:
                y[i, k] = s[1]
            if z is not None:
                z[i, k] = s[2]
