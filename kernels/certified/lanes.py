"""Enclosures of several designs side by side: the rules of :mod:`kernels.certified.jets` in loops that are vector code.

Each design has a lane.  A jet of all lanes is WIDTH rows of LANES numbers, and other numbers stand in rows alike.  The
lanes in use are the first ones; what stands in the others is never read.  All jets are one array, and functions take
their places in it: an array of its own for each would have its references counted, which took a third of the time.
"""

from __future__ import annotations

from kernels.arithmetic.sincos import sincos
from kernels.certified.jets import get, harmonic, put, reciprocal, root_alone
from kernels.jit import inline
from kernels.types import EPS, Array

LANES = 32


@inline
def circle(lanes: int, phi: Array, reach: Array, jets: Array, cos: int, sin: int) -> None:
    """Enclose cosine and sine of phi + z on |z| <= reach <= 1; ``cos`` and ``sin`` are places of jets."""
    for i in range(lanes):
        v, u = sincos(phi[i])
        put(jets, cos + i, LANES, harmonic(u, -v, -u, reach[i], 6.0 * EPS))
        put(jets, sin + i, LANES, harmonic(v, u, -v, reach[i], 6.0 * EPS))


@inline
def inverse(lanes: int, jets: Array, a: int, out: int, good: Array) -> None:
    """Enclose 1/a; ``good`` becomes 0 where that is impossible."""
    for i in range(lanes):
        jet, possible = reciprocal(get(jets, a + i, LANES))
        put(jets, out + i, LANES, jet)
        good[i] = good[i] if possible else 0.0


@inline
def root(lanes: int, jets: Array, a: int, out: int, good: Array) -> None:
    """Enclose the positive square root of a; ``good`` becomes 0 where that is impossible."""
    for i in range(lanes):
        jet, possible = root_alone(get(jets, a + i, LANES))
        put(jets, out + i, LANES, jet)
        good[i] = good[i] if possible else 0.0
