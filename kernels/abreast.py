"""Enclosures of several designs side by side: the rules of :mod:`kernels.jets` in loops that are vector code.

Each design has a lane.  The jets of all lanes are one array of WIDTH rows of LANES numbers, and other numbers stand in
rows alike.  The lanes in use are the first ones; what stands in the others is never read.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels._jit import kernel
from kernels.jets import EPS, GUARD, NOISE, ORDER, TAIL, get, harmonic, put, reciprocal, root_of
from kernels.reduce import largest
from kernels.sincos import sincos

Array = NDArray[np.float64]
LANES = 32
ORDERS = 3  # derivatives that can be bounded


def _derivative_factors() -> Array:
    """Tabulate k (k-1) ... (k-n+1), the factor of x^(k-n) in the n-th derivative of x^k."""
    table = np.ones((ORDERS + 1, 2 * ORDER))
    for n in range(1, ORDERS + 1):
        for k in range(2 * ORDER):
            table[n, k] = table[n - 1, k] * (k - n + 1)
    return table


_FACTORS = _derivative_factors()


@kernel
def circle(lanes: int, phi: Array, reach: Array, cos: Array, sin: Array) -> None:
    """Enclose cosine and sine of phi + z on |z| <= reach <= 1."""
    for i in range(lanes):
        v, u = sincos(phi[i])
        put(cos, i, LANES, harmonic(u, -v, -u, reach[i], 6.0 * EPS))
        put(sin, i, LANES, harmonic(v, u, -v, reach[i], 6.0 * EPS))


@kernel
def inverse(lanes: int, a: Array, out: Array, good: Array) -> None:
    """Enclose 1/a; ``good`` becomes 0 where that is impossible."""
    for i in range(lanes):
        jet, possible = reciprocal(get(a, i, LANES))
        put(out, i, LANES, jet)
        good[i] = good[i] if possible else 0.0


@kernel
def root(lanes: int, a: Array, out: Array, good: Array) -> None:
    """Enclose the positive square root of a; ``good`` becomes 0 where that is impossible."""
    for i in range(lanes):
        jet, _, possible = root_of(get(a, i, LANES))
        put(out, i, LANES, jet)
        good[i] = good[i] if possible else 0.0


@kernel
def differentiate(lanes: int, a: Array, order: int, reach: Array, share: Array, y: Array, bounds: Array) -> None:
    """Compute a derivative on the smaller discs |z| <= share reach, share <= 0.75.

    Parameters
    ----------
    lanes : in use
    a : jets
    order : of the derivative, 3 at most
    reach, share : of each lane
    y : ORDER + 1 rows out, the coefficients in x = z/reach of the derivative by z; there are ORDER + 1 - order of them
    bounds : 4 rows out; the first two are bounds of the derivative of noise and tail, as
        :func:`kernels.enclosure.remainders` has them, the others are scratch
    """
    # Rows as parts of their own: of a sum the compiler does not know that it is no index that counts from the end.
    of_noise, of_tail, scale, power = (
        bounds[:LANES], bounds[LANES : 2 * LANES], bounds[2 * LANES : 3 * LANES], bounds[3 * LANES : 4 * LANES],
    )  # fmt: skip
    for i in range(lanes):
        per = 1.0 / reach[i]
        scale[i] = per if order == 1 else (per * per if order == 2 else (per * per * per if order == 3 else 1.0))
        power[i], of_noise[i], of_tail[i] = 1.0, 0.0, 0.0
    for k in range(order, ORDER + 1):
        factor, row = _FACTORS[order, k], k - order
        these, to = a[k * LANES : (k + 1) * LANES], y[row * LANES : (row + 1) * LANES]
        for i in range(lanes):
            to[i] = these[i] * (factor * scale[i])
    for k in range(order, 2 * ORDER):
        factor, late = _FACTORS[order, k], 1.0 if k > ORDER else 0.0
        for i in range(lanes):
            here = factor * power[i]
            of_noise[i] = largest(of_noise[i], here)
            of_tail[i] = largest(of_tail[i], late * here)
            power[i] *= share[i]
    noise, tail = a[NOISE * LANES : (NOISE + 1) * LANES], a[TAIL * LANES : (TAIL + 1) * LANES]
    for i in range(lanes):
        of_noise[i] *= noise[i] * scale[i] * GUARD
        of_tail[i] *= tail[i] * scale[i] * GUARD
