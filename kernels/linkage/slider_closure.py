"""Closure of a crank that drives a slider through a coupler: Q = b^2 - m^2 - n^2, s = y_B + branch sqrt(Q).

The spatial slider-crank and the slide of the cylindrical looper share it; Polukhin 1971, section 2.7, in the corrected
and stable forms of docs/rssp.md, whose equation numbers these are.  The slide line is y, the frame that of the family.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from kernels.jit import inline
from kernels.types import EPS


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``: y_B = k0 + ka sin phi, n = n0 - na sin phi, m = e - a cos phi."""

    a: float
    b: float
    e: float
    k0: float
    ka: float
    n0: float
    na: float
    m_size: float  # sums of the magnitudes whose rounding errors make up m and n
    n_size: float
    branch: float
    unit: float
    valid: bool


@inline
def reduce_scaled(a: Any, b: Any, e: Any, f: Any, alpha: Any, branch: Any, unit: float) -> Reduced:
    """Constants of one design whose lengths are given in ``unit``; crank a, coupler b, offsets e and f."""
    return reduce_along(a, b, e, f, alpha, np.cos(alpha), np.sin(alpha), branch, unit)


@inline
def reduce_along(a: Any, b: Any, e: Any, f: Any, alpha: Any, ca: Any, sa: Any, branch: Any, unit: float) -> Reduced:
    """Constants as of :func:`reduce_scaled`, with cosine and sine of alpha given.

    Without a branch or a call, so that it vectorises.
    """
    m_size, n_size = abs(e.real) + a.real, abs(f.real) + a.real
    valid = (a.real > 0.0) & (b.real > 0.0) & (b.real < 1e140) & (m_size < 1e140) & (n_size < 1e140)
    valid = valid & (abs(alpha.real) < 1e5) & (branch.real * branch.real == 1.0)
    return Reduced(a, b, e, f * sa, a * ca, f * ca, a * sa, m_size, n_size, branch, unit, valid)


class ClosurePose(NamedTuple):
    """The coupler across the slide line at one crank angle: m and n, and the discriminant Q = b^2 - m^2 - n^2."""

    m: Any
    n: Any
    q: Any


@inline
def place(r: Any, u: Any, v: Any) -> ClosurePose:
    """Evaluate the closure at (cos phi, sin phi) = (u, v); (1), (2).  ``r`` has a, b, e, n0, na of :class:`Reduced`."""
    m, n = r.e - r.a * u, r.n0 - r.na * v
    # As a product: b^2 - m^2 would lose the digits of a small difference.
    return ClosurePose(m, n, (r.b - m) * (r.b + m) - n * n)


@inline
def tolerance(r: Reduced, at: ClosurePose) -> float:
    """Return the rounding error of Q: below it, whether the links reach cannot be decided in float64."""
    error = 8.0 * EPS
    first = error * (abs(at.m.real) * r.m_size + abs(at.n.real) * r.n_size)
    # The squares of the errors of m and n count where m and n themselves vanish.
    return first + error * error * (r.m_size * r.m_size + r.n_size * r.n_size)  # type: ignore[no-any-return]


@inline
def derivatives(r: Reduced, u: Any, v: Any, y: Any, per_w: Any) -> tuple[Any, Any, Any]:
    """First to third derivative of s by phi; (3).

    y is y_B, ``per_w`` is branch/sqrt(Q), nan where that does not exist.

    Derivatives that the caller does not use are not compiled.
    """
    w1, w2, w3 = root_derivatives(r, u, v, y, per_w)
    return r.ka * u + w1, w2 - r.ka * v, w3 - r.ka * u


@inline
def root_derivatives(r: Any, u: Any, v: Any, y: Any, per_w: Any) -> tuple[Any, Any, Any]:
    """First to third derivative of w = branch sqrt(Q), arguments as of :func:`derivatives`; (5)."""
    # m m' + n n' with cos^2(phi) + sin^2(phi) = 1 taken out: as it stands it cancels for alpha near 90 deg.
    q1 = r.ka * u * y - r.a * v * r.e
    w1 = q1 * per_w
    w2 = (r.ka * (r.ka * u * u - v * y) - r.a * u * r.e - w1 * w1) * per_w
    w3 = (-q1 - 3.0 * r.ka * r.ka * u * v - 3.0 * w1 * w2) * per_w
    return w1, w2, w3
