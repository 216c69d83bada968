"""Motion of the swivel linkage at given crank angles: the rod in its block, the working point, their derivatives."""

from __future__ import annotations

import math

import numpy as np

from kernels import status as st
from kernels._jit import kernel
from kernels.families.swivel.closure import EPS, Numbers, Status, reduce_design
from kernels.vectors import dot, mix, scale


@kernel
def poses(
    designs: Numbers,
    cos_phi: Numbers,
    sin_phi: Numbers,
    status: Status,
    rod: Numbers | None,
    point: Numbers | None,
    velocity: Numbers | None,
    acceleration: Numbers | None,
    jerk: Numbers | None,
    joints: Numbers | None,
) -> None:
    """Compute the rod between crank pin and block, and the working point, with derivatives,
    of every design and crank angle.

    Equations (1)-(4) of docs/swivel.md.

    Parameters
    ----------
    designs : (n, 6) columns of :class:`Design`
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, SINGULAR (the crank pin lies in the block's centre) or INVALID_INPUT
    rod : (4, n, m) out [length], distance of crank pin and block and its three derivatives, or None
    point, velocity, acceleration, jerk : (3, n, m) out [length], x y z of the working point and of its derivatives, or
        None
    joints : (6, n, m) out, crank pin x y z and direction of the rod x y z, or None

    Notes
    -----
    What is None is neither computed nor compiled.  Where the status is not OK the values are nan.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            pin = (r.a * u, r.y0 + r.ka * v, r.lift - r.na * v)
            reach = (r.e - pin[0], -pin[1], r.g - pin[2])
            reach1, reach2 = (r.a * v, -r.ka * u, r.na * u), (r.a * u, r.ka * v, -r.na * v)
            square = dot(reach, reach)
            tolerance = 4.0 * EPS * r.size
            code = st.OK
            if not r.valid or square.real != square.real:
                code = st.INVALID_INPUT
            elif square.real <= tolerance * tolerance:
                code = st.SINGULAR
            status[i, j] = code
            length = np.sqrt(square) if code == st.OK else square * math.nan
            per = 1.0 / length if code == st.OK else length
            n = scale(per, reach)
            # rho rho' = E.E', and so on; then n = E/rho
            h1 = dot(n, reach1)
            n1 = scale(per, mix(1.0, reach1, -h1, n))
            h2 = dot(n1, reach1) + dot(n, reach2)
            n2 = scale(per, mix(1.0, mix(1.0, reach2, -h2, n), -2.0 * h1, n1))
            h3 = dot(n2, reach1) + 2.0 * dot(n1, reach2) - h1  # the third derivative of the rod is minus the first
            if rod is not None:
                rod[0, i, j] = length * r.unit
                rod[1, i, j] = h1 * r.unit
                rod[2, i, j] = h2 * r.unit
                rod[3, i, j] = h3 * r.unit
            for k in range(3):
                if point is not None:
                    point[k, i, j] = (pin[k] + r.length * n[k]) * r.unit
                if velocity is not None:
                    velocity[k, i, j] = (r.length * n1[k] - reach1[k]) * r.unit
                if acceleration is not None:
                    acceleration[k, i, j] = (r.length * n2[k] - reach2[k]) * r.unit
                if jerk is not None:
                    bend = per * (-reach1[k] - h3 * n[k] - 3.0 * (h2 * n1[k] + h1 * n2[k]))
                    jerk[k, i, j] = (r.length * bend + reach1[k]) * r.unit
                if joints is not None:
                    joints[k, i, j] = pin[k] * r.unit if code == st.OK else math.nan
                    joints[3 + k, i, j] = n[k]
