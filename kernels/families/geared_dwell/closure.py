"""Design of the geared dwell drive, its constants, and the pin seen from the output axis; (1)-(4)."""

from __future__ import annotations

import math
from typing import NamedTuple

from kernels.arithmetic.complex_step import magnitude
from kernels.jit import inline
from kernels.types import EPS, Numbers

TOO_NEAR = 1e-50  # a pin that passes the axis nearer than this has derivatives outside float64


class Design(NamedTuple):
    """Columns of the design matrix: pin distance and axis offset in planet radii."""

    k: float
    a: float


class Half(NamedTuple):
    """Constants of the half turn around phi = 0 (sign +1) or pi (sign -1, with -k and -a) in t = 1 -+ cos(phi)."""

    sign: float
    k: float
    below: float  # 1 - k
    total: float  # a + k
    e: float  # a - k + 2, the pin's coordinate x at t = 0
    v0: float  # psi' D = v0 + v1 t - ak4 t^2
    v1: float
    q0: float  # Q = q0 + q1 t + ak4 t^2
    q1: float
    d1: float  # D = e^2 + d1 t - ak4 t^2


class Reduced(NamedTuple):
    """Constants of both halves of the turn, 4 a k, output turns per carrier turn, and the output angle at phi = 0."""

    front: Half
    back: Half
    ak4: float
    turns: float
    psi0: float
    regular: bool  # the pin never passes through the output axis
    valid: bool


@inline
def reduce_half(sign: float, k: float, a: float, ak4: float) -> Half:
    """Return constants of one half turn."""
    below = 1.0 - k
    rough = a - k
    back = rough - a
    e = (rough + 2.0) + ((a - (rough - back)) - (k + back))  # with the rounding error of a - k, so exact near e = 0
    if magnitude(e).real < 0.5:
        # The same three numbers with a = k - 2 + e inserted: no cancellation near k = 1, a = -1.
        v1 = (4.0 * k - 2.0) * (k - 1.0) + (4.0 * k - 1.0) * e
        q = 4.0 * (k - 1.0) * (k - 1.0) + (4.0 * k - 1.0) * e
        d1 = 2.0 * (k - 1.0) * (k - 1.0) + (2.0 * k - 1.0) * e
    else:
        v1 = ak4 - a + 3.0 * k
        q = ak4 - a + k + 2.0
        d1 = 0.5 * ak4 + k - a
    return Half(sign, k, below, a + k, e, 2.0 * below * e, 2.0 * v1, e * q, -ak4 * e, 4.0 * d1)


@inline
def reduce_design(designs: Numbers, i: int) -> Reduced:
    """Return constants of one design; ``valid`` is false for k <= 0 and for what is not finite or above 1e30."""
    k, a = designs[i, 0], designs[i, 1]
    ak4 = 4.0 * (a * k)
    front, back = reduce_half(1.0, k, a, ak4), reduce_half(-1.0, -k, -a, ak4)
    e0, e1, total = front.e.real, back.e.real, front.total.real
    if e0 >= 0.0 and e1 >= 0.0:
        turns, psi0 = 1.0, 0.0
    elif e1 < 0.0:
        turns, psi0 = 0.0, 0.0
    elif k.real > 1.0 and total > 0.0:
        turns, psi0 = 2.0, math.pi
    elif k.real > 1.0 and total == 0.0:
        turns, psi0 = (
            1.0,
            0.5 * math.pi,
        )  # psi = phi + pi while the pin is on the far side, phi outside: both within pi/2
    else:
        turns, psi0 = 0.0, math.pi
    regular = abs(e0) > TOO_NEAR and abs(e1) > TOO_NEAR and not (total == 0.0 and k.real >= 1.0)
    valid = k.real > 0.0 and k.real < 1e30 and abs(a.real) < 1e30
    return Reduced(front, back, ak4, turns, psi0, regular, valid)


@inline
def pin(h: Half, t: float, s: float) -> tuple[float, float, float]:
    """Return pin coordinates in the half's own frame, and the rounding error of the two together."""
    m = h.below + h.k * t
    y = 2.0 * (s * m)
    c = 1.0 - t
    if t.real < 0.5:
        x = h.e - 2.0 * t + 2.0 * h.k * (s * s)
        x_size = abs(h.e.real) + 2.0 * t.real + 2.0 * abs(h.k.real) * (s.real * s.real)
    else:
        x = h.total + 2.0 * (c * m)
        x_size = abs(h.total.real) + 2.0 * abs(c.real) * (abs(h.below.real) + abs(h.k.real) * t.real)
    y_size = 2.0 * abs(s.real) * (abs(h.below.real) + abs(h.k.real) * t.real)
    return x, y, 4.0 * EPS * (x_size + y_size)


@inline
def velocity(h: Half, ak4: float, t: float, square: float) -> float:
    """Return the velocity analogue from the squared distance D of the pin, (4):
    the form that does not cancel at this place.
    """
    ratio = h.total * (h.e - 2.0 * t) / square
    if abs(ratio.real - 1.0) > 0.5:
        return 1.0 - ratio
    return (h.v0 + t * (h.v1 - ak4 * t)) / square
