"""One design of the spherical looper brought to its constants; equation numbers are of docs/spherical_looper.md.

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
from kernels.vectors import Vector, cross, dot, mix, scale

Numbers: TypeAlias = NDArray[Any]  # float64, or complex128 for exact gradients by the complex step
Status: TypeAlias = NDArray[np.uint8]


class Design(NamedTuple):
    """Columns of the design matrix: lengths in one unit, angles in radians, branches +1 or -1."""

    a1: float
    b1: float
    c1: float
    e1: float
    f1: float
    g1: float
    alpha1: float
    branch1: float
    o: float
    delta: float
    gamma: float
    c0x: float
    c0y: float
    c0z: float
    p0x: float
    p0y: float
    p0z: float
    a2: float
    b2: float
    x2: float
    y2: float
    z2: float
    theta2: float
    beta2: float
    offset2: float
    branch2: float


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``."""

    swings: Crank  # what swings the carrier
    o: float
    radial: Vector  # triad of the looper's axis at psi = 0: towards its ball, across, along the axis
    across: Vector
    axis: Vector
    c2: float  # distance of the looper's ball from its axis, and its place along the axis
    along: float
    point: Vector  # working point in that triad
    a2: float
    b2: float
    centre: Vector  # crank 2: centre from Os, directions of crank angles 0 and 90 deg
    first: Vector
    second: Vector
    cos_offset: float
    sin_offset: float
    branch2: float
    size2: float
    unit: float
    valid: bool


@inline
def reduce_design(designs: Numbers, i: int) -> Reduced:
    """Return constants of one design; ``valid`` is false for links of no length and for what is not finite."""
    d = designs[i]
    _, exponent = math.frexp(d[0].real)
    unit, per = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
    swings = reduce_crank(d, per)
    o = d[8] * per
    sd, cd, sg, cg = np.sin(d[9]), np.cos(d[9]), np.sin(d[10]), np.cos(d[10])
    axis = (sd * cg, sd * sg, cd)
    ball, tip = (d[11] * per, d[12] * per, d[13] * per), (d[14] * per, d[15] * per, d[16] * per)
    along = dot(ball, axis)
    foot = mix(1.0, ball, -along, axis)
    c2 = np.sqrt(dot(foot, foot))
    ball_size = abs(ball[0].real) + abs(ball[1].real) + abs(ball[2].real)
    # a ball within its own rounding of the axis has no direction from it, and so no triad
    hinged = c2.real > 8.0 * 2.0**-53 * ball_size
    radial = scale(1.0 / c2 if hinged else math.nan, foot)
    across = cross(axis, radial)
    point = (dot(tip, radial), dot(tip, across), dot(tip, axis))
    a2, b2 = d[17] * per, d[18] * per
    centre = (d[19] * per - swings.e, d[20] * per, d[21] * per - o)
    st, ct, sb, cb = np.sin(d[22]), np.cos(d[22]), np.sin(d[23]), np.cos(d[23])
    # magnitudes, not the sums themselves: where those cancel, the errors of their parts stay
    size2 = a2.real + abs((d[19] * per).real) + abs(swings.e.real) + abs(centre[1].real) + abs((d[21] * per).real)
    size2 += abs(o.real) + ball_size
    tip_size = abs(tip[0].real) + abs(tip[1].real) + abs(tip[2].real)
    valid = swings.valid and 0.0 < a2.real < 1e140 and 0.0 < b2.real < 1e140 and size2 < 1e140 and tip_size < 1e140
    for k in (9, 10, 22, 23, 24):
        valid = valid and abs(d[k].real) < 1e5
    branch2 = d[25].real
    valid = valid and branch2 * branch2 == 1.0 and unit < math.inf
    return Reduced(
        swings, o, radial, across, axis, c2 if hinged else 0.0 * c2, along, point,
        a2, b2, centre, (ct * cb, ct * sb, -st), (-sb, cb, 0.0 * cb), np.cos(d[24]), np.sin(d[24]), branch2, size2,
        unit, valid,
    )  # fmt: skip
