"""Mechanisms in series: the output angle of one stage drives the next.  The equation numbers are of docs/chain.md.

The kernels work on (n, m) blocks of poses and know no family.  All arrays may be complex128 (exact gradients by the
complex step).
"""

from __future__ import annotations

import numpy as np

from kernels.jit import kernel
from kernels.types import Array


@kernel
def input_angle(kappa: Array, offset: Array, cos_psi: Array, sin_psi: Array, cos_phi: Array, sin_phi: Array) -> None:
    """Compute the cosine and sine of the next stage's input angle kappa psi + offset, by angle addition; (1).

    Parameters
    ----------
    kappa, offset : (n,) sense of the coupling, +1 or -1, and angle between the two links on the common shaft [rad]
    cos_psi, sin_psi : (n, m) output angle of the driving stage
    cos_phi, sin_phi : (n, m) out, input angle of the driven stage
    """
    for i in range(cos_psi.shape[0]):
        # Once per design: the angle addition leaves no trigonometric call in the loop over poses.
        c0, s0 = np.cos(offset[i]), np.sin(offset[i])
        k = kappa[i]
        for j in range(cos_psi.shape[1]):
            c, s = cos_psi[i, j], k * sin_psi[i, j]
            cos_phi[i, j] = c * c0 - s * s0
            sin_phi[i, j] = s * c0 + c * s0


@kernel
def chain_rule(
    kappa: Array,
    inner1: Array,
    inner2: Array | None,
    inner3: Array | None,
    outer1: Array,
    outer2: Array | None,
    outer3: Array | None,
) -> None:
    """Compute derivatives of the driven stage with respect to the crank angle of the chain, (22) to the third order.

    Parameters
    ----------
    kappa : (n,) sense of the coupling, +1 or -1
    inner1, inner2, inner3 : (n, m) derivatives of the driving angle psi with respect to phi of the chain
    outer1, outer2, outer3 : (n, m) in: derivatives of the driven stage with respect to its own input angle;
        out: with respect to phi of the chain.  Orders that are None are neither computed nor compiled
    """
    for i in range(outer1.shape[0]):
        k = kappa[i]
        for j in range(outer1.shape[1]):
            # outer1 is overwritten before outer2 and outer3 are formed from it, so its old value is kept in y.
            x, y = k * inner1[i, j], outer1[i, j]
            outer1[i, j] = x * y
            if inner2 is not None and outer2 is not None:
                xx, yy = k * inner2[i, j], outer2[i, j]
                outer2[i, j] = xx * y + x * x * yy
                if inner3 is not None and outer3 is not None:
                    outer3[i, j] = k * inner3[i, j] * y + x * (3.0 * xx * yy + x * x * outer3[i, j])
