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
from kernels.looper_drive import Crank, reduce_crank
from kernels.slider_closure import Reduced as Slider
from kernels.slider_closure import reduce_scaled
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
    """Per-design numbers in units of ``unit``: of the drive that swings the shaft, and of the one that slides it."""

    swings: Crank
    moves: Slider
    size1: float  # sum of the magnitudes whose rounding errors make up the driving ball's coordinates
    cos_offset: float
    sin_offset: float
    slides: float
    point: Vector
    unit: float
    valid: bool


@inline
def reduce_design(designs: Numbers, i: int) -> Reduced:
    """Return constants of one design; ``valid`` is false for links of no length and for what is not finite."""
    d = designs[i]
    _, exponent = math.frexp(d[0].real)
    unit, per = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
    swings = reduce_crank(d, per)
    moves = reduce_scaled(d[8] * per, d[9] * per, d[10] * per, d[11] * per, d[12], d[14].real, unit)
    point = (d[16] * per, d[17] * per, d[18] * per)
    slides = d[15].real
    # a slide longer than all links of the slider-crank together is not possible
    size1 = swings.size + slides * (moves.n_size + moves.b.real)
    tip_size = abs(point[0].real) + abs(point[1].real) + abs(point[2].real)
    valid = swings.valid and moves.valid and size1 < 1e140 and abs(d[13].real) < 1e5
    valid = valid and slides * slides == slides and tip_size < 1e140 and unit < math.inf
    return Reduced(swings, moves, size1, np.cos(d[13]), np.sin(d[13]), slides, point, unit, valid)
