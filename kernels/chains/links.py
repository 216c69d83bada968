"""How motion, and its rounding errors, pass from one stage to the next; equation numbers of docs/chain.md."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from kernels.arithmetic.sincos import sincos
from kernels.chains.form import STRIDE, Turned
from kernels.jit import inline

NUMBERS = 3  # of a link


class Link(NamedTuple):
    """Coupling of a stage to the one before it: sense, cosine and sine of the angle between the two links."""

    kappa: Any
    cos: Any
    sin: Any


class Input(NamedTuple):
    """Input angle of a stage: cosine, sine, derivatives by the crank angle of the chain."""

    u: Any
    v: Any
    t1: Any
    t2: Any
    t3: Any
    t4: Any


@inline
def link_of(kappa: Any, offset: Any) -> Link:
    """Coupling of that sense and angle [rad]; kappa is nan if one of them is refused."""
    sine, cosine = sincos(offset)
    return Link(kappa if (kappa * kappa == 1.0) & (abs(offset) < 1e5) else math.nan, cosine, sine)


@inline
def put_link(at: Any, place: int, link: Link) -> None:
    """Write a link into rows of `STRIDE` numbers."""
    at[place], at[place + STRIDE], at[place + 2 * STRIDE] = link.kappa, link.cos, link.sin


@inline
def get_link(at: Any, place: int) -> Link:
    """Read what :func:`put_link` wrote."""
    return Link(at[place], at[place + STRIDE], at[place + 2 * STRIDE])


@inline
def enter(link: Link, m: Turned) -> Input:
    """Input angle of the next stage from kappa times the output angle of this one; (1)."""
    u, v = m.cos * link.cos - m.sin * link.sin, m.sin * link.cos + m.cos * link.sin
    return Input(u, v, m.d1, m.d2, m.d3, m.d4)


@inline
def through(t: Input, y1: Any, y2: Any, y3: Any, y4: Any) -> tuple[Any, Any, Any, Any]:
    """Turn derivatives by the input angle of a stage into those by the chain's crank angle; (22) to order four."""
    t1, t2, square = t.t1, t.t2, t.t1 * t.t1
    second = t2 * y1 + square * y2
    third = t.t3 * y1 + t1 * (3.0 * t2 * y2 + square * y3)
    fourth = t.t4 * y1 + (4.0 * t1 * t.t3 + 3.0 * t2 * t2) * y2 + square * (6.0 * t2 * y3 + square * y4)
    return t1 * y1, second, third, fourth


@inline
def blurred_through(
    t: Input, b0: Any, b1: Any, b2: Any, b3: Any, y1: Any, y2: Any, y3: Any, y4: Any, e: tuple[Any, ...]
) -> tuple[Any, Any, Any, Any]:
    """Errors of a function of the input angle and its first three derivatives, to first order.

    ``b0`` to ``b3`` are the errors of the input angle and its derivatives, ``e`` those of the function and its
    derivatives y1, y2, y3 by the input angle at an exact one.
    """
    t1, t2, t3, square = abs(t.t1), abs(t.t2), abs(t.t3), t.t1 * t.t1
    y1, y2, y3, y4 = abs(y1), abs(y2), abs(y3), abs(y4)
    e0, e1, e2, e3 = e
    first = t1 * e1 + y1 * b1 + t1 * y2 * b0
    second = t2 * e1 + square * e2 + y1 * b2 + 2.0 * (t1 * y2) * b1
    third = t3 * e1 + 3.0 * t1 * t2 * e2 + square * t1 * e3
    third += y1 * b3 + 3.0 * (t1 * y2 * b2 + (t2 * y2 + square * y3) * b1)
    third += b0 * (t3 * y2 + 3.0 * t1 * t2 * y3 + square * t1 * y4)
    return e0 + y1 * b0, first, second + b0 * (t2 * y2 + square * y3), third
