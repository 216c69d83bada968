"""One design of the slotted link brought to its smallest set of numbers; equation numbers are of docs/slotted.md.

Everything is computed in lengths divided by a power of two near the crank length, so no scale of the drawing costs a
bit.  Designs may be complex128 (exact gradients by the complex step); decisions look at the real part.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels._jit import inline

Numbers: TypeAlias = NDArray[Any]  # float64, or complex128 for exact gradients by the complex step
Status: TypeAlias = NDArray[np.uint8]
EPS = 2.0**-53


class Design(NamedTuple):
    """Columns of the design matrix: lengths in one unit, alpha in radians, tau and branch +1 or -1."""

    a: float
    e: float
    f: float
    g: float
    alpha: float
    s: float
    k: float
    tau: float
    branch: float


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
    """Return constants of one design; ``valid`` is false for a crank of no length, k < 0 and what is not finite."""
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
