"""One design of the spatial slider-crank brought to its smallest set of numbers.

Polukhin 1971, section 2.7, in the corrected and stable forms of docs/rssp.md; the equation numbers are of that page.
Everything is computed in lengths divided by a power of two near the coupler length, so no scale of the drawing costs a
bit.  Designs may be complex128 (exact gradients by the complex step); decisions look at the real part.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels._jit import inline

Array = NDArray[np.float64]
Status = NDArray[np.uint8]
EPS = 2.0**-53


class Design(NamedTuple):
    """Columns of the design matrix: lengths in one unit, alpha in radians, branch +1 or -1."""

    a: float
    b: float
    e: float
    f: float
    alpha: float
    branch: float


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``: y_B = k0 + ka sin phi, n = n0 - na sin phi, m = e - a cos phi."""

    a: float
    b: float
    e: float
    k0: float
    ka: float
    n0: float
    na: float
    m_size: float  # sums of the magnitudes whose rounding errors make up m and n
    n_size: float
    branch: float
    unit: float
    valid: bool


@inline
def reduce_design(designs: Array, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for zero or negative lengths and for what is not finite."""
    _, exponent = math.frexp(designs[i, 1].real)
    unit, per_unit = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
    a, b, e, f = designs[i, 0] * per_unit, designs[i, 1] * per_unit, designs[i, 2] * per_unit, designs[i, 3] * per_unit
    alpha, branch = designs[i, 4], designs[i, 5]
    sa, ca = np.sin(alpha), np.cos(alpha)
    m_size, n_size = abs(e.real) + a.real, abs(f.real) + a.real
    valid = a.real > 0.0 and 0.0 < b.real <= 1.0 and m_size < 1e140 and n_size < 1e140
    valid = valid and abs(alpha.real) < 1e5 and branch.real * branch.real == 1.0
    return Reduced(a, b, e, f * sa, a * ca, f * ca, a * sa, m_size, n_size, branch, unit, valid)


class Place(NamedTuple):
    """The coupler across the slide line at one crank angle: m and n, and the discriminant Q = b^2 - m^2 - n^2."""

    m: Any
    n: Any
    q: Any


@inline
def place(r: Reduced, u: Any, v: Any) -> Place:
    """Evaluate the closure at (cos phi, sin phi) = (u, v); (1), (2)."""
    m, n = r.e - r.a * u, r.n0 - r.na * v
    # As a product: b^2 - m^2 would lose the digits of a small difference.
    return Place(m, n, (r.b - m) * (r.b + m) - n * n)
