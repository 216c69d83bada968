"""Motion and its rounding errors passed on from one stage to the next; equation numbers of docs/chain.md.

The kernels at the end do this for (n, m) blocks of poses of any family; their arrays may be complex128 (exact
gradients by the complex step).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels.arithmetic.sincos import sincos
from kernels.chains.form import STRIDE, Turned
from kernels.jit import inline, kernel
from kernels.types import Array

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
    """Coupling of sense kappa and angle ``offset`` [rad]; its kappa is nan where sense or angle is not valid."""
    sine, cosine = sincos(offset)
    return Link(kappa if (kappa * kappa == 1.0) & (abs(offset) < 1e5) else math.nan, cosine, sine)


@inline
def put_link(at: Any, place: int, link: Link) -> None:
    """Write a link into rows of `STRIDE` numbers."""
    at[place], at[place + STRIDE], at[place + 2 * STRIDE] = link.kappa, link.cos, link.sin


@inline
def get_link(at: Any, place: int) -> Link:
    """Read a link from rows of `STRIDE` numbers."""
    return Link(at[place], at[place + STRIDE], at[place + 2 * STRIDE])


@inline
def enter(link: Link, m: Turned) -> Input:
    """Input angle of the next stage from kappa times the output angle of this one; (1)."""
    u, v = m.cos * link.cos - m.sin * link.sin, m.sin * link.cos + m.cos * link.sin
    return Input(u, v, m.d1, m.d2, m.d3, m.d4)


@inline
def through(t: Input, y1: Any, y2: Any, y3: Any, y4: Any) -> tuple[Any, Any, Any, Any]:
    """Convert derivatives by the input angle of a stage into derivatives by the chain's crank angle; (22), order 4."""
    t1, t2, square = t.t1, t.t2, t.t1 * t.t1
    second = t2 * y1 + square * y2
    third = t.t3 * y1 + t1 * (3.0 * t2 * y2 + square * y3)
    fourth = t.t4 * y1 + (4.0 * t1 * t.t3 + 3.0 * t2 * t2) * y2 + square * (6.0 * t2 * y3 + square * y4)
    return t1 * y1, second, third, fourth


@inline
def blurred_through(
    t: Input, b0: Any, b1: Any, b2: Any, b3: Any, y1: Any, y2: Any, y3: Any, y4: Any, e: tuple[Any, ...]
) -> tuple[Any, Any, Any, Any]:
    """Errors of a function of the input angle and its first three derivatives by the crank angle, to first order.

    ``b0`` to ``b3`` are the errors of the input angle and its derivatives; ``e`` are the errors that the function and
    its derivatives y1, y2, y3 by the input angle have at an exact input angle.
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


@kernel
def input_angle(kappa: Array, offset: Array, cos_psi: Array, sin_psi: Array, cos_phi: Array, sin_phi: Array) -> None:
    """Compute the cosine and sine of the next stage's input angle kappa psi + offset, by angle addition; (1).

    Parameters
    ----------
    kappa, offset : (n,) sense of the coupling, +1 or -1, and angle between the two links on the common shaft [rad]
    cos_psi, sin_psi : (n, m) output angle of the driving stage
    cos_phi, sin_phi : (n, m) out, input angle of the driven stage
    """
    for i in range(cos_psi.shape[0]):
        # Once per design: the angle addition leaves no trigonometric call in the loop over poses.
        c0, s0 = np.cos(offset[i]), np.sin(offset[i])
        k = kappa[i]
        for j in range(cos_psi.shape[1]):
            c, s = cos_psi[i, j], k * sin_psi[i, j]
            cos_phi[i, j] = c * c0 - s * s0
            sin_phi[i, j] = s * c0 + c * s0


@kernel
def chain_rule(
    kappa: Array,
    inner1: Array,
    inner2: Array | None,
    inner3: Array | None,
    outer1: Array,
    outer2: Array | None,
    outer3: Array | None,
) -> None:
    """Compute derivatives of the driven stage with respect to the crank angle of the chain, (22) to the third order.

    Parameters
    ----------
    kappa : (n,) sense of the coupling, +1 or -1
    inner1, inner2, inner3 : (n, m) derivatives of the driving angle psi with respect to phi of the chain
    outer1, outer2, outer3 : (n, m) in: derivatives of the driven stage with respect to its own input angle;
        out: with respect to phi of the chain.  Orders that are None are neither computed nor compiled
    """
    for i in range(outer1.shape[0]):
        k = kappa[i]
        for j in range(outer1.shape[1]):
            # outer1 is overwritten before outer2 and outer3 are formed from it, so its old value is kept in y.
            x, y = k * inner1[i, j], outer1[i, j]
            outer1[i, j] = x * y
            if inner2 is not None and outer2 is not None:
                xx, yy = k * inner2[i, j], outer2[i, j]
                outer2[i, j] = xx * y + x * x * yy
                if inner3 is not None and outer3 is not None:
                    outer3[i, j] = k * inner3[i, j] * y + x * (3.0 * xx * yy + x * x * outer3[i, j])
