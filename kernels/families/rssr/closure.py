"""One design of the spatial crank-rocker brought to the numbers of :mod:`kernels.crank_closure`."""

from __future__ import annotations

from typing import NamedTuple

from kernels._jit import inline
from kernels.crank_closure import EPS as EPS
from kernels.crank_closure import Array as Array
from kernels.crank_closure import Numbers as Numbers
from kernels.crank_closure import Reduced as Reduced
from kernels.crank_closure import Status as Status
from kernels.crank_closure import axial_terms as axial_terms
from kernels.crank_closure import discriminant_tolerance as discriminant_tolerance
from kernels.crank_closure import reduce_scaled as reduce_scaled
from kernels.crank_closure import unit_scale as unit_scale
from kernels.crank_closure import within_unit_range as within_unit_range


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
    unit = unit_scale(designs[i, 2].real)
    a, b, c = designs[i, 0] * unit, designs[i, 1] * unit, designs[i, 2] * unit
    e, f, g = designs[i, 3] * unit, designs[i, 4] * unit, designs[i, 5] * unit
    return reduce_scaled(a, b, c, e, f, g, designs[i, 6], designs[i, 7].real)
