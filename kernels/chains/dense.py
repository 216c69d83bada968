"""Largest magnitudes of a chain's motion over a grid of crank angles: the hot loop of its sweeps, generated."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, TypeAlias

from kernels.arithmetic.intrinsics import largest, smallest
from kernels.chains.chain import Chained
from kernels.chains.form import Helper
from kernels.jit import generated, generated_inline
from kernels.linkage.outputs import write_number
from kernels.types import Array

Least: TypeAlias = tuple[float, ...]


@lru_cache(maxsize=64)
def dense_maxima(chain: Chained) -> Helper:
    """Make the kernel ``dense(designs, cos, sin, least, x1, x2, x3, y0, y1, y2)`` of a chain.

    Its arguments: designs (n, P); the grid (m,), shared by all designs, m a multiple of 8 is fastest; ``least``
    (n, stages) out, smallest discriminant of each stage on the grid less a bound of its rounding error, nan for an
    invalid design; where one is not positive the maxima mean nothing; then per design the largest |x'|, |x''|,
    |x'''|, |y|, |y'|, |y''| of `Travel`, (n,) out, or None: neither computed nor compiled.
    """
    constants, travel, doubts, stages = chain.record.constants, chain.travel, chain.record.doubts, chain.stages
    name = f"dense_{chain.record.name}"
    start, lower = (1e300,) * stages, _lower(stages, name)

    def dense(
        designs: Array, cos: Array, sin: Array, least: Array, x1: Array | None, x2: Array | None, x3: Array | None,
        y0: Array | None, y1: Array | None, y2: Array | None,
    ) -> None:  # fmt: skip
        for i in range(designs.shape[0]):
            c = constants(designs, i)
            low, a1, a2, a3, b0, b1, b2 = start, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for j in range(cos.size):
                m, deltas = travel(c, cos[j], sin[j])
                low = lower(low, deltas)
                # The compiler drops the maxima that are not stored below, with all that only they need.
                a1, a2, a3 = largest(a1, abs(m.x1)), largest(a2, abs(m.x2)), largest(a3, abs(m.x3))
                b0, b1, b2 = largest(b0, abs(m.y0)), largest(b1, abs(m.y1)), largest(b2, abs(m.y2))
            doubt = doubts(c)
            for s in range(stages):
                least[i, s] = low[s] - doubt[s]
            write_number(x1, i, a1)
            write_number(x2, i, a2)
            write_number(x3, i, a3)
            write_number(y0, i, b0)
            write_number(y1, i, b1)
            write_number(y2, i, b2)

    return generated(name, dense)


def _lower(stages: int, name: str) -> Helper:
    """Make the function that takes the smaller of two numbers at each place of two tuples."""
    last = stages - 1
    if last == 0:

        def lower(a: Any, b: Any) -> Least:
            return (smallest(a[0], b[0]),)

    else:
        before = _lower(last, name)

        def lower(a: Any, b: Any) -> Least:
            return (*before(a, b), smallest(a[last], b[last]))

    return generated_inline(f"lower{stages}_{name}", lower)
