"""One design of the spatial crank-rocker brought to the numbers of :mod:`kernels.linkage.crank_closure`."""

from __future__ import annotations

from typing import Any, NamedTuple

from kernels.jit import inline
from kernels.linkage.crank_closure import Reduced as Reduced
from kernels.linkage.crank_closure import axial_terms as axial_terms
from kernels.linkage.crank_closure import discriminant_tolerance as discriminant_tolerance
from kernels.linkage.crank_closure import reduce_scaled as reduce_scaled
from kernels.linkage.crank_closure import unit_scale as unit_scale
from kernels.linkage.crank_closure import within_unit_range as within_unit_range
from kernels.types import EPS as EPS
from kernels.types import Array as Array
from kernels.types import Numbers as Numbers
from kernels.types import Status as Status


class Design(NamedTuple):
    """Columns of the design matrix: lengths in one unit, alpha in radians, branch +1 or -1."""

    a: float
    b: float
    c: float
    e: float
    f: float
    g: float
    alpha: float
    branch: float


@inline
def reduce_design(designs: Numbers, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for zero or negative lengths and for what is not finite."""
    d = Design(
        designs[i, 0], designs[i, 1], designs[i, 2], designs[i, 3], designs[i, 4], designs[i, 5], designs[i, 6],
        designs[i, 7],
    )  # fmt: skip
    return reduce_one(d)


@inline
def reduce_one(d: Any) -> Reduced:
    """As :func:`reduce_design`, from a :class:`Design`; without a branch or a call, so that it vectorises."""
    unit = unit_scale(d.c.real)
    a, b, c, e, f, g = d.a * unit, d.b * unit, d.c * unit, d.e * unit, d.f * unit, d.g * unit
    return reduce_scaled(a, b, c, e, f, g, d.alpha, d.branch.real)


class ClosurePose(NamedTuple):
    """The closure at one crank angle; ``hu``, ``hv`` are cos(phi), sin(phi) times the cosine of the axes' angle."""

    u: Any  # cos phi
    v: Any  # sin phi
    hu: Any
    hv: Any
    x: Any  # X, Y, W of the closure
    y: Any
    w1: Any  # W = k0 - w1
    w: Any
    rr: Any  # X^2 + Y^2, squared distance of the crank pin from the rocker axis
    delta: Any  # the discriminant X^2 + Y^2 - W^2


@inline
def place(e: Any, y0: Any, ca: Any, k0: Any, k1: Any, k2: Any, u: Any, v: Any) -> ClosurePose:
    """Evaluate the closure of a reduced design at (cos phi, sin phi) = (u, v); (2).

    It takes float32, float64 and complex128 alike, so no literal number may stand in it.
    """
    hu, hv = ca * u, ca * v
    x, y, w1 = e - u, y0 + hv, k2 * u - k1 * v
    w = k0 - w1
    rr = x * x + y * y
    return ClosurePose(u, v, hu, hv, x, y, w1, w, rr, rr - w * w)


@inline
def closure_terms(
    e: float, y0: float, ca: float, k0: float, k1: float, k2: float, u: float, v: float
) -> tuple[float, ...]:
    """Return X, Y, W of the closure alone, for margins, limit positions, error estimates and enclosures.

    W is summed in another order than in :func:`place`.  The order decides its last bit and with it that of every
    margin, so both are kept.
    """
    return e - u, y0 + ca * v, k0 + k1 * v - k2 * u
