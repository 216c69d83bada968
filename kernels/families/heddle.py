"""Lever chain of a heddle shaft: cam lever, rod, bell crank, link to the shaft lever, heddle shaft; planar.

Equations (3)-(9) of docs/heddle.md.  Everything is computed in lengths divided by a power of two near the rod length,
so no scale of the drawing costs a bit.  Designs may be complex128 (exact gradients by the complex step).
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2, divisor, magnitude, unit_near
from kernels.jit import inline, kernel
from kernels.linkage.outputs import put_block, write
from kernels.linkage.verdict import pose_status
from kernels.types import EPS, Array, Status


class FourBar(NamedTuple):
    """A four-bar in scaled lengths: driving arm a, coupler b, driven arm c, pivot distance e.

    W = k0 - k2 u, and R^2 - c^2 = gap - 2 a e u for the distance R of the driving pin from the driven pivot.
    """

    a: Any
    b: Any
    c: Any
    e: Any
    k0: Any
    k2: Any
    gap: Any
    x_size: float  # sums of the magnitudes whose rounding errors make up X and W
    w_size: float
    side: float


class Reduced(NamedTuple):
    """Per-design numbers of the chain in units of ``unit``."""

    first: FourBar
    second: FourBar
    parallel: bool  # equal lever angles: the second stage is a parallelogram
    rod: Any
    sin_mid: Any
    cos_mid: Any
    arm: Any
    heddle: Any
    slide: Any
    finite: bool  # a heddle rod of finite length on a vertical slide
    side_f: float
    unit: float
    valid: bool


@inline
def four_bar(a: Any, b: Any, c: Any, e: Any, side: float) -> FourBar:
    """Constants of the closure X C + Y S + W = 0 of a four-bar with coupler b; (3)."""
    difference = (c - b) * (c + b)
    by = divisor(c)
    k0 = 0.5 * (difference + (a * a + e * e)) / by
    k2 = a * e / by
    size = 0.5 * (abs(difference.real) + (a * a + e * e).real) / by.real + abs(k2.real)
    gap = (e - c) * (e + c) + a * a
    return FourBar(a, b, c, e, k0, k2, gap, abs(e.real) + a.real, size, side)


@inline
def _alike(one: Any, other: Any) -> bool:
    """Whether two finite lengths are equal but for rounding, which would turn a parallelogram at its dead points.

    A complex step in one of them is no rounding: the linkage is solved, so that its gradient is that of the length.
    """
    apart = one - other
    alike: bool = one == other or (abs(apart.real) < 8.0 * EPS * abs(one.real) and apart.imag == 0.0)
    return alike


@inline
def reduce_design(designs: Array, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for zero or negative lengths and for numbers that are not finite."""
    unit, per_unit = unit_near(designs[i, 1])
    a, b, c, e = designs[i, 0] * per_unit, designs[i, 1] * per_unit, designs[i, 2] * per_unit, designs[i, 3] * per_unit
    arm, chi_mid = designs[i, 4] * per_unit, designs[i, 5]
    d, f, o, link = (
        designs[i, 6] * per_unit,
        designs[i, 7] * per_unit,
        designs[i, 8] * per_unit,
        designs[i, 9] * per_unit,
    )
    heddle, slide = designs[i, 10] * per_unit, designs[i, 11] * per_unit
    side_f, side_c = designs[i, 12].real, designs[i, 13].real
    parallel = _alike(designs[i, 6], designs[i, 7]) and _alike(designs[i, 8], designs[i, 9])
    first = four_bar(a, b, c, e, side_c)
    # A parallelogram is not solved; unit lengths keep its constants finite.
    one = 1.0 + 0.0 * a
    second = four_bar(one, one, one, one, side_f) if parallel else four_bar(d, link, f, o, side_f)
    valid = a.real > 0.0 and b.real > 0.0 and c.real > 0.0 and e.real > 0.0 and arm.real > 0.0
    valid = valid and first.w_size < 1e140 and second.w_size < 1e140
    valid = valid and (parallel or (d.real > 0.0 and f.real > 0.0 and o.real > 0.0 and link.real > 0.0))
    valid = valid and abs(chi_mid.real) < 1e5 and side_f * side_f == 1.0 and side_c * side_c == 1.0
    # 0 * x is nan exactly for numbers that are not finite
    valid = valid and (0.0 * (arm + heddle + slide)).real == 0.0 and heddle.real >= 0.0
    return Reduced(
        first, second, parallel, divisor(b), np.sin(chi_mid), np.cos(chi_mid),
        arm, heddle, slide, heddle.real > 0.0, side_f, unit, valid,
    )  # fmt: skip


@inline
def driven(bar: FourBar, u: Any, v: Any) -> tuple[Any, Any, Any, Any, int]:
    """Direction (C, S) of the driven arm, signed root t, Delta and status for the driving arm along (u, v); (3)-(4).

    The dead-point band is the rounding error of Delta itself.  At a dead point the position stays defined (t = 0).
    """
    x, y, w = bar.e - bar.a * u, -(bar.a * v), bar.k0 - bar.k2 * u
    rr = x * x + y * y
    # Heron's product for R^2 - W^2: of a long driven arm on a far pivot both squares are alike to most of their digits.
    reach = np.sqrt(rr) + bar.c
    beyond = (bar.gap - 2.0 * (bar.a * bar.e) * u) / divisor(reach)
    delta = (bar.b - beyond) * (bar.b + beyond) * ((reach - bar.b) * (reach + bar.b)) / (4.0 * divisor(bar.c * bar.c))
    band = 8.0 * EPS
    tolerance = band * (abs(x.real) * bar.x_size + abs(y.real) * bar.a.real + abs(w.real) * bar.w_size)
    tolerance += band * band * (bar.x_size * bar.x_size + bar.a.real * bar.a.real + bar.w_size * bar.w_size)
    # SINGULAR: the driving pin on the driven pivot leaves the arm free; a dead point has one position.
    code = pose_status(True, delta.real, tolerance, rr.real)
    t = bar.side * (np.sqrt(delta) if code == st.OK else 0.0 * delta)
    if code not in (st.OK, st.DEAD_POINT):
        return math.nan * x, math.nan * x, t, delta, code
    # W and t are rounded apart: of long arms their squares add up to R^2 only to R/c of their digits
    cos, sin = -(x * w + y * t), x * t - y * w
    per = 1.0 / np.sqrt(cos * cos + sin * sin)
    return cos * per, sin * per, t, delta, code


@inline
def driven_rates(bar: FourBar, u: Any, v: Any, cos: Any, sin: Any, t: Any) -> tuple[Any, Any, Any]:
    """First three derivatives of the driven arm's angle with respect to that of the driving arm; (5)."""
    w = bar.k0 - bar.k2 * u
    turn, near = bar.a * (v * cos - u * sin), bar.a * (u * cos + v * sin)
    g = turn + bar.k2 * v
    per_t = 1.0 / t
    one = g * per_t
    two = (near + bar.k2 * u + one * (w * one - 2.0 * near)) * per_t
    linear = g - one * (3.0 * turn - one * (3.0 * turn - t * one))
    three = -(linear - 3.0 * two * (w * one - near)) * per_t
    return one, two, three


@inline
def _shaft_lever(r: Reduced, cos_turn: Any, sin_turn: Any, rates: bool) -> tuple[Any, Any, tuple[Any, Any, Any], int]:
    """Cosine and sine of the shaft lever's angle from mid-stroke, its rates by the bell crank's, and status; (6)."""
    if r.parallel:
        one = 1.0 + 0.0 * cos_turn
        return cos_turn, sin_turn, (one, 0.0 * one, 0.0 * one), st.OK
    u, v = -(r.side_f * sin_turn), r.side_f * cos_turn
    cos, sin, t, _, code = driven(r.second, u, v)
    # at a dead point the position stands but its rates do not exist: nan, so that no quotient by t = 0 is taken
    safe = t if code == st.OK else math.nan * t
    slopes = driven_rates(r.second, u, v, cos, sin, safe) if rates else (safe, safe, safe)
    return r.side_f * sin, -(r.side_f * cos), slopes, code


@inline
def _chained(outer: tuple[Any, Any, Any], inner: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
    """First three derivatives of a composed function, from those of the outer and the inner one."""
    f1, f2, f3 = outer
    g1, g2, g3 = inner
    return f1 * g1, f2 * g1 * g1 + f1 * g2, f3 * g1 * g1 * g1 + 3.0 * f2 * g1 * g2 + f1 * g3


@inline
def _lift(r: Reduced, cos: Any, sin: Any, rates: tuple[Any, Any, Any]) -> tuple[Any, Any, Any, Any, bool]:
    """Lift of the shaft and its three derivatives; false if the heddle rod does not reach the slide; (7)-(9)."""
    x, y = r.arm * cos, r.arm * sin
    l1, l2, l3 = rates
    y1, y2 = x * l1, x * l2 - y * l1 * l1
    y3 = x * (l3 - l1 * l1 * l1) - 3.0 * y * l1 * l2
    if not r.finite:
        return y, y1, y2, y3, True
    x1, x2 = -(y * l1), -(y * l2) - x * l1 * l1
    x3 = -(y * (l3 - l1 * l1 * l1)) - 3.0 * x * l1 * l2
    z = x - r.slide
    # product of sum and difference: the difference of two squares loses digits where the rod lies nearly flat
    square = (r.heddle - z) * (r.heddle + z)
    if not square.real > 0.0:
        none = math.nan * y
        return none, none, none, none, False
    h = np.sqrt(square)
    h1 = -(z * x1) / h
    h2 = -(x1 * x1 + z * x2 + h1 * h1) / h
    h3 = -(3.0 * x1 * x2 + z * x3 + 3.0 * h1 * h2) / h
    return y + h, y1 + h1, y2 + h2, y3 + h3, True


# Pose outputs, each (n, m), and places (7, n, m); outputs of None are not computed.
Outputs = namedtuple("Outputs", "chi dchi d2chi d3chi y dy d2y d3y discriminant places")


@kernel
def poses(designs: Array, cos_phi: Array, sin_phi: Array, status: Status, out: Outputs) -> None:
    """Bell-crank angle, lift of the shaft and their derivatives with respect to the angle of the cam lever.

    Equations (3)-(9) of docs/heddle.md.

    Parameters
    ----------
    designs : (n, 14) columns as `PARAMETERS` of sweep/families/heddle.py
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs; of the cam lever's angle theta
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT (rod and bell crank in line), SINGULAR or INVALID_INPUT
    chi ... d3chi : (n, m) out [rad], or None: then it is neither computed nor compiled
    y ... d3y : (n, m) out [length], or None
    discriminant : (n, m) out [length^2], or None; positive where the rod reaches
    places : (7, n, m) out, or None; sine of the transmission angle, pressure angle between rod and bell crank, angle of
        the shaft lever, B and C (x, y each)

    Where the status is not OK the values are nan, except that a dead point of the rod keeps its position.
    """
    rates_wanted = out.dy is not None or out.d2y is not None or out.d3y is not None
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            cos, sin, t, delta, code = driven(r.first, u, v)
            if not r.valid:
                code = st.INVALID_INPUT
            assembled = code == st.OK or code == st.DEAD_POINT
            if not assembled:
                cos, sin, t = math.nan * cos, math.nan * sin, math.nan * t
            turns = driven_rates(r.first, u, v, cos, sin, t if code == st.OK else math.nan * t)
            # the angle from mid-stroke by the addition theorem: no arctangent, and no jump by a full turn
            cos_turn, sin_turn = cos * r.cos_mid + sin * r.sin_mid, sin * r.cos_mid - cos * r.sin_mid
            lever_cos, lever_sin, slopes, lever_code = _shaft_lever(r, cos_turn, sin_turn, rates_wanted)
            lift, lift1, lift2, lift3, reached = _lift(r, lever_cos, lever_sin, _chained(slopes, turns))
            # the first loop that fails sets the status: the later ones have no input then
            if assembled and lever_code != st.OK:
                code = lever_code
            elif assembled and not reached:
                code = st.NOT_ASSEMBLED
            status[i, j] = code

            _put_angle(out, i, j, cos, sin, turns)
            write(out.y, i, j, lift * r.unit)
            write(out.dy, i, j, lift1 * r.unit)
            write(out.d2y, i, j, lift2 * r.unit)
            write(out.d3y, i, j, lift3 * r.unit)
            # one factor after the other: the square of the unit leaves float64 before the discriminant does
            write(out.discriminant, i, j, (delta * r.unit) * r.unit if r.valid else math.nan)
            if out.places is not None:  # the compiler does not drop its arctangents where they are not wanted
                places = _places(r, (u, v), (cos, sin, t), (lever_cos, lever_sin))
                put_block(out.places, i, j, places, 1.0)


@inline
def _put_angle(out: Outputs, i: int, j: int, cos: Any, sin: Any, turns: tuple[Any, Any, Any]) -> None:
    """Write the bell-crank angle [rad] and its derivatives where they are wanted."""
    write(out.chi, i, j, arctan2(sin, cos))
    write(out.dchi, i, j, turns[0])
    write(out.d2chi, i, j, turns[1])
    write(out.d3chi, i, j, turns[2])


@inline
def _places(r: Reduced, cam: tuple[Any, Any], bell: tuple[Any, Any, Any], lever: tuple[Any, Any]) -> tuple[Any, ...]:
    """Transmission and pressure angle of the rod, angle of the shaft lever, and B and C."""
    u, v = cam
    cos, sin, t = bell
    bar = r.first
    # atan2, not acos: acos loses half the digits near zero.
    pressure = arctan2(magnitude(bar.c - (bar.k0 - bar.k2 * u)), magnitude(t))
    b, c = (bar.a * u * r.unit, bar.a * v * r.unit), ((bar.e + bar.c * cos) * r.unit, bar.c * sin * r.unit)
    return (-t / r.rod, pressure, arctan2(lever[1], lever[0]), *b, *c)
