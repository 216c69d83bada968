"""One design of the slotted link brought to its smallest set of numbers, and the crank for a wanted phi0.

The equation numbers are of docs/slotted.md.

Everything is computed in lengths divided by a power of two near the crank length, so no scale of the drawing costs a
bit.  Designs may be complex128 (exact gradients by the complex step); decisions look at the real part.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.jit import inline, kernel
from kernels.types import Numbers, Status


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``: x = a u - e, y = y0 + ka v, z = z0 - na v (ball from the point D)."""

    a: float
    e: float
    y0: float
    ka: float
    lift: float  # f cos(alpha), the crank's centre above the origin
    z0: float
    na: float
    s: float
    k: float  # 0 for the fork slot
    tau: float
    branch: float
    x_size: float  # sums of the magnitudes whose rounding errors make up x, y and z
    y_size: float
    z_size: float
    unit: float
    valid: bool


@inline
def reduce_design(designs: Numbers, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for a crank of no length, k < 0 and what is not finite."""
    _, exponent = math.frexp(designs[i, 0].real)
    unit, per_unit = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
    a, e, f, g = designs[i, 0] * per_unit, designs[i, 1] * per_unit, designs[i, 2] * per_unit, designs[i, 3] * per_unit
    alpha, s, k = designs[i, 4], designs[i, 5] * per_unit, designs[i, 6] * per_unit
    tau, branch = designs[i, 7].real, designs[i, 8].real
    sa, ca = np.sin(alpha), np.cos(alpha)
    y0, ka, lift, z0, na = f * sa, a * ca, f * ca, f * ca - g, a * sa
    x_size, y_size = abs(e.real) + a.real, abs(y0.real) + abs(ka.real)
    z_size = abs(lift.real) + abs(g.real) + abs(na.real)
    valid = 0.0 < a.real <= 1.0 and x_size < 1e140 and y_size < 1e140 and z_size < 1e140
    valid = valid and 0.0 <= k.real < 1e140 and abs(s.real) < 1e140 and abs(alpha.real) < 1e5
    valid = valid and tau * tau == 1.0 and branch * branch == 1.0 and unit < math.inf
    return Reduced(a, e, y0, ka, lift, z0, na, s, k, tau, branch, x_size, y_size, z_size, unit, valid)


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
