"""One design of the swivel linkage brought to its smallest set of numbers; equation numbers are of docs/swivel.md.

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
    """Columns of the design matrix: lengths in one unit, alpha in radians."""

    a: float
    e: float
    f: float
    g: float
    alpha: float
    Lw: float


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``: B = (a u, y0 + ka v, lift - na v), Q = (e, 0, g)."""

    a: float
    e: float
    y0: float
    ka: float
    lift: float
    na: float
    g: float
    length: float  # Lw
    size: float  # sum of the magnitudes whose rounding errors make up the vector from B to Q
    unit: float
    valid: bool


@inline
def reduce_design(designs: Numbers, i: int) -> Reduced:
    """Return constants of one design; ``valid`` is false for a crank of no length and for what is not finite."""
    _, exponent = math.frexp(designs[i, 0].real)
    unit, per_unit = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
    a, e, f, g = designs[i, 0] * per_unit, designs[i, 1] * per_unit, designs[i, 2] * per_unit, designs[i, 3] * per_unit
    alpha, length = designs[i, 4], designs[i, 5] * per_unit
    sa, ca = np.sin(alpha), np.cos(alpha)
    size = abs(e.real) + abs(f.real) + abs(g.real) + a.real
    valid = 0.0 < a.real <= 1.0 and size < 1e140 and abs(length.real) < 1e140
    valid = valid and abs(alpha.real) < 1e5 and unit < math.inf
    return Reduced(a, e, f * sa, a * ca, f * ca, a * sa, g, length, size, unit, valid)
