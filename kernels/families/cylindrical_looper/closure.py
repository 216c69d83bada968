"""One design of the cylindrical looper brought to its constants; equation numbers are of docs/cylindrical_looper.md.

Everything is computed in lengths divided by a power of two near the first crank, so no scale of the drawing costs a
bit.  Designs may be complex128 (exact gradients by the complex step); decisions look at the real part.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels._jit import inline
from kernels.vectors import Vector

Numbers: TypeAlias = NDArray[Any]  # float64, or complex128 for exact gradients by the complex step
Status: TypeAlias = NDArray[np.uint8]


class Design(NamedTuple):
    """Columns of the design matrix: lengths in one unit, angles in radians, branches +1 or -1, slides 0 or 1."""

    a1: float
    b1: float
    c1: float
    e1: float
    f1: float
    g1: float
    alpha1: float
    branch1: float
    a2: float
    b2: float
    e2: float
    f2: float
    alpha2: float
    offset2: float
    branch2: float
    slides: float
    p0x: float
    p0y: float
    p0z: float


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``; the slider's as in the slider-crank."""

    a1: float
    b1: float
    c1: float
    e1: float
    sa: float
    ca: float
    y0: float  # crank pin 1 from the origin: (a u, y0 + a ca v, lift - a sa v)
    lift: float
    g1: float
    branch1: float
    size1: float  # sum of the magnitudes whose rounding errors make up the driving ball's coordinates
    a2: float
    b2: float
    e2: float
    k0: float  # crank pin 2 along the shaft: k0 + ka sin phi2;  across it: e2 - a2 cos phi2, n0 - na sin phi2
    ka: float
    n0: float
    na: float
    m_size: float
    n_size: float
    cos_offset: float
    sin_offset: float
    branch2: float
    slides: float
    point: Vector
    unit: float
    valid: bool


@inline
def reduce_design(designs: Numbers, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for links of no length and for what is not finite."""
    d = designs[i]
    _, exponent = math.frexp(d[0].real)
    unit, per = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
    a1, b1, c1, e1, f1, g1 = d[0] * per, d[1] * per, d[2] * per, d[3] * per, d[4] * per, d[5] * per
    a2, b2, e2, f2 = d[8] * per, d[9] * per, d[10] * per, d[11] * per
    sa, ca, sa2, ca2 = np.sin(d[6]), np.cos(d[6]), np.sin(d[12]), np.cos(d[12])
    point = (d[16] * per, d[17] * per, d[18] * per)
    m_size, n_size = abs(e2.real) + a2.real, abs(f2.real) + a2.real
    slides = d[15].real
    # a slide longer than all links of the slider-crank together is not possible
    size1 = a1.real + abs(e1.real) + abs(f1.real) + abs(g1.real) + slides * (n_size + b2.real)
    tip_size = abs(point[0].real) + abs(point[1].real) + abs(point[2].real)
    valid = 0.0 < a1.real <= 1.0 and 0.0 < b1.real < 1e140 and 0.0 < c1.real < 1e140 and size1 < 1e140
    valid = valid and 0.0 < a2.real < 1e140 and 0.0 < b2.real < 1e140 and m_size < 1e140 and n_size < 1e140
    valid = valid and abs(d[6].real) < 1e5 and abs(d[12].real) < 1e5 and abs(d[13].real) < 1e5
    branch1, branch2 = d[7].real, d[14].real
    valid = valid and branch1 * branch1 == 1.0 and branch2 * branch2 == 1.0 and slides * slides == slides
    valid = valid and tip_size < 1e140 and unit < math.inf
    return Reduced(
        a1, b1, c1, e1, sa, ca, f1 * sa, f1 * ca, g1, branch1, size1,
        a2, b2, e2, f2 * sa2, a2 * ca2, f2 * ca2, a2 * sa2, m_size, n_size,
        np.cos(d[13]), np.sin(d[13]), branch2, slides, point, unit, valid,
    )  # fmt: skip
