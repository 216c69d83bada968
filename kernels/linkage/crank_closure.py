"""Closure ``X C - Y S + W = 0`` of a crank that drives a rocker through a coupler, in its smallest set of numbers.

The spatial crank-rocker and the five-link share it; Polukhin 1971, chapter II, in the corrected and stable forms of
docs/rssr.md; the equation numbers are of that page.  Everything is computed in units of the crank length, mirrored to
the assembly mode +1 (psi, f -> -psi, -f together with cos(alpha) -> -cos(alpha) in the axial product turns mode -1 into
+1 and changes no bit of any magnitude).
"""

from __future__ import annotations

from typing import Any, NamedTuple

from kernels.arithmetic.intrinsics import power_below
from kernels.arithmetic.sincos import sincos
from kernels.jit import inline
from kernels.types import EPS


class Reduced(NamedTuple):
    """Per-design numbers of the closure ``X C - Y S + W = 0`` in units of the crank, mirrored to branch +1."""

    e: float  # X = e - cos phi
    y0: float  # Y = y0 + ca sin phi
    ca: float
    k0: float  # W = k0 + k1 sin phi - k2 cos phi
    k1: float
    k2: float
    w_size: float  # sum of the magnitudes whose rounding errors make up W
    coupler: float  # b/a
    rocker: float  # c/a
    z0: float  # z_B - z_C = z0 - sa sin phi
    sa: float
    branch: float
    valid: bool


@inline
def axial_terms(f: Any, g: Any, alpha: Any, ca: Any) -> tuple[Any, Any, Any]:
    """Return f^2 + g^2 - 2 f g cos(alpha), the magnitude of its terms, and f cos(alpha) - g; (K*).

    Without cancellation where the axes are nearly parallel, alpha near 0 or pi, and both offsets long.
    """
    near_zero = ca.real >= 0.0
    sine, cosine = sincos(0.5 * alpha)
    h = sine if near_zero else cosine
    sign = 1.0 if near_zero else -1.0
    gap, rest = f - sign * g, 2.0 * f * h * h
    near, far = gap * gap, 2.0 * g * rest
    return near + sign * far, near.real + abs(far.real), sign * (gap - rest)


@inline
def within_unit_range(c: float) -> bool:
    """Whether a rocker of length c needs no scaling: no square can leave float64."""
    return (c > 1e-6) & (c < 1e6)


@inline
def unit_scale(c: float) -> float:
    """Power of two that brings a rocker of length c to the unit range; 1 where it is near enough."""
    return 1.0 if within_unit_range(c) else 0.5 / power_below(c)


@inline
def reduce_scaled(a: Any, b: Any, c: Any, e: Any, f: Any, g: Any, alpha: Any, branch: float) -> Reduced:
    """Constants of one design, for lengths whose squares stay in float64; without a branch, so that it vectorises."""
    sa, ca = sincos(alpha)
    q, q_size, rise = axial_terms(f, g, alpha, ca)
    square = (c - b) * (c + b) + (a * a + e * e) + q
    per_a, per_c = 1.0 / a, 1.0 / c
    k0, k1, k2 = 0.5 * square * per_c * per_a, g * sa * per_c, e * per_c
    terms = abs(((c - b) * (c + b)).real) + (a * a).real + (e * e).real + q_size
    size = 0.5 * terms * per_c.real * per_a.real + abs(k1.real) + abs(k2.real)
    valid = (a.real > 1e-140) & (per_a.real < 1e140) & (b.real > 0.0) & (c.real > 0.0) & (size < 1e140)
    valid = valid & (abs(alpha.real) < 1e5) & (branch * branch == 1.0)
    return Reduced(
        e * per_a, branch * (f * sa * per_a), branch * ca, k0, k1, k2, size,
        b * per_a, c * per_a, rise * per_a, sa, branch, valid,
    )  # fmt: skip


@inline
def discriminant_tolerance(r: Reduced, x: float, y: float, w: float) -> float:
    """Return the rounding error of X^2+Y^2-W^2: below it, whether the links reach cannot be decided in float64."""
    mx, my, mw = abs(r.e.real) + 1.0, abs(r.y0.real) + 1.0, r.w_size
    t = 8.0 * EPS
    return t * (abs(x.real) * mx + abs(y.real) * my + abs(w.real) * mw) + t * t * (mx * mx + my * my + mw * mw)
