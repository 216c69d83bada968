"""One design of the spatial slider-crank brought to the constants of :mod:`kernels.linkage.slider_closure`.

Everything is computed in lengths divided by a power of two near the coupler length, so no scale of the drawing costs a
bit.  Designs may be complex128 (exact gradients by the complex step); decisions look at the real part.
"""

from __future__ import annotations

import math

from kernels.jit import inline
from kernels.linkage.slider_closure import ClosurePose as ClosurePose
from kernels.linkage.slider_closure import Reduced as Reduced
from kernels.linkage.slider_closure import derivatives as derivatives
from kernels.linkage.slider_closure import place as place
from kernels.linkage.slider_closure import reduce_scaled
from kernels.linkage.slider_closure import tolerance as tolerance
from kernels.types import EPS as EPS
from kernels.types import Array


@inline
def reduce_design(designs: Array, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for zero or negative lengths and for what is not finite."""
    _, exponent = math.frexp(designs[i, 1].real)
    unit, per_unit = math.ldexp(1.0, exponent), math.ldexp(1.0, -exponent)
    a, b, e, f = designs[i, 0] * per_unit, designs[i, 1] * per_unit, designs[i, 2] * per_unit, designs[i, 3] * per_unit
    return reduce_scaled(a, b, e, f, designs[i, 4], designs[i, 5], unit)
