"""One heddle drive brought to its constants, and the four-bar that both of its stages are.

Equations (3)-(9) of docs/heddle.md.  Everything is computed in lengths divided by a power of two near the rod length,
so no scale of the drawing costs a bit.  Designs may be complex128 (exact gradients by the complex step).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import inline
from kernels.complex_step import divisor
from kernels.verdict import pose_status

Array: TypeAlias = NDArray[np.float64]
Status: TypeAlias = NDArray[np.uint8]
EPS = 2.0**-53


class Design(NamedTuple):
    """Columns of the design matrix: lengths in one unit, chi_mid in radians, sides +1 or -1."""

    O2B: float
    BC: float
    O3C: float
    O2O3: float
    O4E: float
    chi_mid: float
    O3D: float
    O4F: float
    O3O4: float
    DF: float
    EG: float
    x_s: float
    side_F: float
    side_C: float


class FourBar(NamedTuple):
    """A four-bar in scaled lengths: driving arm a, coupler b, driven arm c, pivot distance e; W = k0 - k2 u,
    R^2 - c^2 = gap - 2 a e u for the distance R of the driving pin from the driven pivot.
    """

    a: Any
    b: Any
    c: Any
    e: Any
    k0: Any
    k2: Any
    gap: Any
    x_size: float  # sums of the magnitudes whose rounding errors make up X and W
    w_size: float
    side: float


class Reduced(NamedTuple):
    """Per-design numbers of the chain in units of ``unit``."""

    first: FourBar
    second: FourBar
    parallel: bool  # equal lever angles: the second stage is a parallelogram
    rod: Any
    sin_mid: Any
    cos_mid: Any
    arm: Any
    heddle: Any
    slide: Any
    finite: bool  # a heddle rod of finite length on a vertical slide
    side_f: float
    unit: float
    valid: bool


@inline
def four_bar(a: Any, b: Any, c: Any, e: Any, side: float) -> FourBar:
    """Return constants of the closure X C + Y S + W = 0 of a four-bar with coupler b; (3)."""
    difference = (c - b) * (c + b)
    by = divisor(c)
    k0 = 0.5 * (difference + (a * a + e * e)) / by
    k2 = a * e / by
    size = 0.5 * (abs(difference.real) + (a * a + e * e).real) / by.real + abs(k2.real)
    gap = (e - c) * (e + c) + a * a
    return FourBar(a, b, c, e, k0, k2, gap, abs(e.real) + a.real, size, side)


@inline
def reduce_design(designs: Array, i: int) -> Reduced:
    """Return constants of one design; ``valid`` is false for zero or negative lengths and for what is not finite."""
    _, exponent = math.frexp(designs[i, 1].real)
    unit, per_unit = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
    a, b, c, e = designs[i, 0] * per_unit, designs[i, 1] * per_unit, designs[i, 2] * per_unit, designs[i, 3] * per_unit
    arm, chi_mid = designs[i, 4] * per_unit, designs[i, 5]
    d, f, o, link = (
        designs[i, 6] * per_unit,
        designs[i, 7] * per_unit,
        designs[i, 8] * per_unit,
        designs[i, 9] * per_unit,
    )
    heddle, slide = designs[i, 10] * per_unit, designs[i, 11] * per_unit
    side_f, side_c = designs[i, 12].real, designs[i, 13].real
    parallel = designs[i, 6] == designs[i, 7] and designs[i, 8] == designs[i, 9]
    first = four_bar(a, b, c, e, side_c)
    # A parallelogram is not solved; unit lengths keep its constants finite.
    one = 1.0 + 0.0 * a
    second = four_bar(one, one, one, one, side_f) if parallel else four_bar(d, link, f, o, side_f)
    valid = a.real > 0.0 and b.real > 0.0 and c.real > 0.0 and e.real > 0.0 and arm.real > 0.0
    valid = valid and first.w_size < 1e140 and second.w_size < 1e140
    valid = valid and (parallel or (d.real > 0.0 and f.real > 0.0 and o.real > 0.0 and link.real > 0.0))
    valid = valid and abs(chi_mid.real) < 1e5 and side_f * side_f == 1.0 and side_c * side_c == 1.0
    # 0 * x is nan exactly for what is not finite
    valid = valid and (0.0 * (arm + heddle + slide)).real == 0.0 and heddle.real >= 0.0
    return Reduced(
        first, second, parallel, divisor(b), np.sin(chi_mid), np.cos(chi_mid),
        arm, heddle, slide, heddle.real > 0.0, side_f, unit, valid,
    )  # fmt: skip


@inline
def driven(bar: FourBar, u: Any, v: Any) -> tuple[Any, Any, Any, Any, int]:
    """Return the direction (C, S) of the driven arm, signed root t, Delta and status for the driving arm along (u,
    v); (3)-(4).

    The dead-point band is the rounding error of Delta itself.  At a dead point the position stays defined (t = 0).
    """
    x, y, w = bar.e - bar.a * u, -(bar.a * v), bar.k0 - bar.k2 * u
    rr = x * x + y * y
    # Heron's product for R^2 - W^2: of a long driven arm on a far pivot both squares are alike to most of their digits.
    reach = np.sqrt(rr) + bar.c
    beyond = (bar.gap - 2.0 * (bar.a * bar.e) * u) / divisor(reach)
    delta = (bar.b - beyond) * (bar.b + beyond) * ((reach - bar.b) * (reach + bar.b)) / (4.0 * divisor(bar.c * bar.c))
    band = 8.0 * EPS
    tolerance = band * (abs(x.real) * bar.x_size + abs(y.real) * bar.a.real + abs(w.real) * bar.w_size)
    tolerance += band * band * (bar.x_size * bar.x_size + bar.a.real * bar.a.real + bar.w_size * bar.w_size)
    # SINGULAR: the driving pin on the driven pivot leaves the arm free; a dead point has one position.
    code = pose_status(True, delta.real, tolerance, rr.real)
    t = bar.side * (np.sqrt(delta) if code == st.OK else 0.0 * delta)
    per_rr = 1.0 / rr if code in (st.OK, st.DEAD_POINT) else math.nan * rr
    return -(x * w + y * t) * per_rr, (x * t - y * w) * per_rr, t, delta, code


@inline
def driven_rates(bar: FourBar, u: Any, v: Any, cos: Any, sin: Any, t: Any) -> tuple[Any, Any, Any]:
    """Return the first three derivatives of the driven arm's angle with respect to that of the driving arm; (5)."""
    w = bar.k0 - bar.k2 * u
    turn, near = bar.a * (v * cos - u * sin), bar.a * (u * cos + v * sin)
    g = turn + bar.k2 * v
    per_t = 1.0 / t
    one = g * per_t
    two = (near + bar.k2 * u + one * (w * one - 2.0 * near)) * per_t
    linear = g - one * (3.0 * turn - one * (3.0 * turn - t * one))
    three = -(linear - 3.0 * two * (w * one - near)) * per_t
    return one, two, three
