"""Looper on a cylinder whose second ball stands off the shaft's axis: both loops together fix angle and place.

The angles at which both loops close are those of :mod:`kernels.families.cylindrical_looper.closure`.  Equation
numbers are of docs/cylindrical_looper.md.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.arithmetic.complex_step import magnitude
from kernels.arithmetic.vectors import Vector, add, cross, dot
from kernels.curves.arc_roots import MOST
from kernels.families.cylindrical_looper.closure import Loops, Reduced, chosen, place, reduce_design
from kernels.families.cylindrical_looper.motion import Outputs, Slide, carried
from kernels.jit import inline, kernel
from kernels.linkage.driven_ball import Path, Swung, crank_pin, pin_path
from kernels.linkage.outputs import put_angle, put_block, put_loop, put_point
from kernels.types import EPS, Numbers, Status


class Fixed(NamedTuple):
    """Constants of the second ball's offset, with lengths in units of ``Reduced.unit``."""

    d: Any
    cos_beta: Any
    sin_beta: Any
    cos_gamma: Any
    sin_gamma: Any
    mode: int
    size: float  # magnitude of the terms of H
    valid: bool


@inline
def _fixed(designs: Numbers, i: int, r: Reduced) -> Fixed:
    per = 1.0 / r.unit
    d, beta, gamma, mode = designs[i, 19] * per, designs[i, 20], designs[i, 21], designs[i, 22].real
    valid = abs(beta.real) < 1e5 and abs(gamma.real) < 1e5 and abs(d.real) < 1e140
    valid = r.valid and valid and (mode == 1.0 or mode == 2.0)
    size = r.size1 + r.swings.c.real + r.swings.b.real + abs(d.real) + r.moves.m_size + r.moves.n_size
    return Fixed(
        d, np.cos(beta), np.sin(beta), np.cos(gamma), np.sin(gamma), 2 if mode == 2.0 else 1,
        size * size / (r.swings.c.real if r.swings.c.real > 0.0 else 1.0), valid,
    )  # fmt: skip


@inline
def _solve2(j11: Any, j12: Any, j21: Any, j22: Any, per: Any, p: Any, q: Any) -> tuple[Any, Any]:
    """Solve two linear equations; ``per`` is one over the determinant."""
    return (p * j22 - q * j12) * per, (q * j11 - p * j21) * per


@inline
def _square(t: Vector, d: Vector) -> Any:
    """Square of the part of d across t."""
    across, size = cross(t, d), dot(t, t)
    return dot(across, across) / size if size.real > 0.0 else dot(d, d)


@inline
def _along(t: Vector, d: Vector) -> Any:
    """Part of d along t; 0 where t has no direction."""
    size = dot(t, t)
    return dot(t, d) / np.sqrt(size) if size.real > 0.0 else 0.0 * size


@inline
def _together(k: Loops, cos: Any, sin: Any, s: Any) -> tuple[Any, Any, Any]:
    """Make one step of Newton's method for angle and place together.

    The place that belongs to a rounded angle is off by more than a rounding where the second coupler stands across the
    shaft; the place that solves both equations is not.
    """
    bx, by = k.d * (cos * k.cos_beta - sin * k.sin_beta), k.d * (sin * k.cos_beta + cos * k.sin_beta)
    px, py, w, height = bx - k.x2, by - k.y2, s - k.z2, k.slides * s - k.z1
    square = (k.c1 - k.b1) * (k.c1 + k.b1) + (k.x1 * k.x1 + k.y1 * k.y1) + height * height
    f1 = 0.5 * square / k.c1 - (k.x1 * cos + k.y1 * sin)
    f2 = 0.5 * ((w - k.b2) * (w + k.b2) + (px * px + py * py))
    j11, j12, j21 = k.x1 * sin - k.y1 * cos, k.slides * height / k.c1, py * bx - px * by
    det = j11 * w - j12 * j21
    per = -1.0 / det if det.real != 0.0 else 0.0 * det
    turn, step = (f1 * w - f2 * j12) * per, (f2 * j11 - f1 * j21) * per
    cos, sin = cos - turn * sin, sin + turn * cos
    unit = 1.5 - 0.5 * (cos * cos + sin * sin)
    return cos * unit, sin * unit, s + step


@inline
def _derived(k: Loops, first: Path, second: Path, cos: Any, sin: Any, s: Any, code: int) -> tuple[Swung, Slide]:
    """Three derivatives of angle and place, from d . d = b^2 of both couplers; (8), (9)."""
    r1: Vector = (k.c1 * cos, k.c1 * sin, 0.0 * cos)
    r2: Vector = (
        k.d * (cos * k.cos_beta - sin * k.sin_beta), k.d * (sin * k.cos_beta + cos * k.sin_beta), 0.0 * cos,
    )  # fmt: skip
    t1, t2 = (-r1[1], r1[0], 0.0 * cos), (-r2[1], r2[0], 0.0 * cos)
    d1 = (r1[0] - k.x1, r1[1] - k.y1, k.slides * s - k.z1)
    d2 = (r2[0] - k.x2, r2[1] - k.y2, s - k.z2)
    j11, j12, j21, j22 = dot(d1, t1), k.slides * d1[2], dot(d2, t2), d2[2]
    det = j11 * j22 - j12 * j21
    moving = code == st.OK and det.real != 0.0
    per = 1.0 / det if moving else math.nan * det
    p1, s1 = _solve2(j11, j12, j21, j22, per, dot(d1, first[1]), dot(d2, second[1]))
    e1 = _rate(t1, p1, k.slides * s1, first[1])
    e2 = _rate(t2, p1, s1, second[1])
    q1 = dot(d1, first[2]) + p1 * p1 * dot(d1, r1) - dot(e1, e1)
    q2 = dot(d2, second[2]) + p1 * p1 * dot(d2, r2) - dot(e2, e2)
    p2, s2 = _solve2(j11, j12, j21, j22, per, q1, q2)
    f1 = _curve(r1, t1, p1, p2, k.slides * s2, first[2])
    f2 = _curve(r2, t2, p1, p2, s2, second[2])
    q1 = dot(d1, first[3]) + 3.0 * p1 * p2 * dot(d1, r1) + p1 * p1 * p1 * j11 - 3.0 * dot(e1, f1)
    q2 = dot(d2, second[3]) + 3.0 * p1 * p2 * dot(d2, r2) + p1 * p1 * p1 * j21 - 3.0 * dot(e2, f2)
    p3, s3 = _solve2(j11, j12, j21, j22, per, q1, q2)
    # direction in which each ball can move while the other coupler keeps its length
    way1 = (t1[0] * j22, t1[1] * j22, -k.slides * j21)
    way2 = (-t2[0] * j12, -t2[1] * j12, j11)
    if k.d == 0.0:  # turning the shaft does not move the second ball
        way2 = (0.0 * j11, 0.0 * j11, 1.0 + 0.0 * j11)
    along1, along2 = _along(way1, d1), _along(way2, d2)
    one = Swung(code, cos, sin, magnitude(along1), _square(way1, d1), along1 * along1, p1, p2, p3)
    return one, Slide(code, s, s1, s2, s3, along2 * along2, magnitude(along2), _square(way2, d2))


@inline
def _rate(t: Vector, p: Any, s: Any, pin: Vector) -> Vector:
    return t[0] * p - pin[0], t[1] * p - pin[1], s - pin[2]


@inline
def _curve(r: Vector, t: Vector, p1: Any, p2: Any, s2: Any, pin: Vector) -> Vector:
    square = p1 * p1
    return t[0] * p2 - r[0] * square - pin[0], t[1] * p2 - r[1] * square - pin[1], s2 - pin[2]


@inline
def _pins(r: Reduced, o: Fixed, u: float, v: float) -> tuple[Path, Path]:
    """Pins of both cranks from the rocker's foot at s = 0, with three derivatives; (2), (6)."""
    two = r.moves
    u2, v2 = u * r.cos_offset - v * r.sin_offset, v * r.cos_offset + u * r.sin_offset
    m, n, y = two.a * u2 - two.e, two.n0 - two.na * v2, two.k0 + two.ka * v2
    second = (
        _about(o, m, n, y),
        _about(o, -two.a * v2, -two.na * u2, two.ka * u2),
        _about(o, -two.a * u2, two.na * v2, -two.ka * v2),
        _about(o, two.a * v2, two.na * u2, -two.ka * u2),
    )
    return pin_path(r.swings, u, v), second


@inline
def _about(o: Fixed, x: Any, z: Any, y: Any) -> Vector:
    """Turn a vector from the frame of crank 2, whose y runs along the shaft, into that of the looper."""
    return x * o.cos_gamma + z * o.sin_gamma, x * o.sin_gamma - z * o.cos_gamma, y


@inline
def _solved(r: Reduced, o: Fixed, first: Path, second: Path, at: NDArray[np.float64]) -> tuple[Swung, Slide]:
    """Solve both loops at one crank angle; ``at`` is scratch for the scan."""
    p1, p2 = first[0], second[0]
    b1, c1, b2, branch = r.swings.b, r.swings.c, r.moves.b, r.moves.branch
    k = Loops(p1[0], p1[1], p1[2], p2[0], p2[1], p2[2], b1, c1, b2, o.d, o.cos_beta, o.sin_beta, branch, r.slides)
    real = Loops(
        p1[0].real, p1[1].real, p1[2].real, p2[0].real, p2[1].real, p2[2].real, b1.real, c1.real, b2.real,
        o.d.real, o.cos_beta.real, o.sin_beta.real, branch, r.slides,
    )  # fmt: skip
    noise = 16.0 * EPS * o.size
    code, c, s, short = st.INVALID_INPUT, math.nan, math.nan, math.nan
    if o.valid:
        code, c, s, short = chosen(real, r.swings.branch, o.mode, noise, at)
    cos, sin = c + 0.0 * k.x1, s + 0.0 * k.x1
    if code == st.OK:
        # Two Newton steps on the complex numbers: only rounding is left, and the imaginary parts are exact.
        for _ in range(2):
            here = place(k, cos, sin)
            turn = -here.value / here.slope if here.slope.real != 0.0 else 0.0 * cos
            cos, sin = cos - turn * sin, sin + turn * cos
            per = 1.0 / np.sqrt(cos * cos + sin * sin)
            cos, sin = cos * per, sin * per
        # a slope of H within the noise is a dead point of both loops together
        here = place(real, cos.real, sin.real)
        away = here.q > 32.0 * EPS * real.b2 * real.b2
        if not away or not here.slope * here.slope > 4.0 * noise * (abs(here.slope) + o.size):
            code = st.DEAD_POINT
    if code == st.OK or code == st.DEAD_POINT:
        s0 = place(k, cos, sin).s
        if code == st.OK:
            cos, sin, s0 = _together(k, cos, sin, s0)
            cos, sin, s0 = _together(k, cos, sin, s0)
        return _derived(k, first, second, cos, sin, s0, code)
    none = math.nan * k.x1
    lost = short + 0.0 * k.x1
    return Swung(code, none, none, none, none, lost, none, none, none), Slide(
        code, none, none, none, none, lost, none, none
    )


@kernel
def coupled_poses(designs: Numbers, cos_phi: Numbers, sin_phi: Numbers, status: Status, out: Outputs) -> None:
    """Poses as of the module ``motion``, for designs whose second ball is off the shaft's axis.

    Parameters
    ----------
    designs : (n, 23) columns as `PARAMETERS` of sweep/families/cylindrical_looper.py
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED (no solution on these branches), DEAD_POINT (the determinant of both loops
        vanishes), INVALID_INPUT
    shaft ... joints : as of ``poses``; a discriminant is the square of the coupler's part along the direction in which
        its ball can move while the other coupler keeps its length, and negative where there is no solution
    """
    at = np.empty(MOST)
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        o = _fixed(designs, i, r)
        row = i if cos_phi.shape[0] > 1 else 0
        undefined = 0.0 if o.valid else math.nan
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            first, second = _pins(r, o, u, v)
            one, two = _solved(r, o, first, second, at)
            status[i, j] = one.status
            scale = r.unit + undefined
            put_angle(out.shaft, i, j, one, undefined)
            put_loop(out.shaft_loop, i, j, one.delta, one.root, one.across, r.unit, undefined)
            put_block(out.slide, i, j, (two.s, two.first, two.second, two.third), scale)
            put_loop(out.slide_loop, i, j, two.delta, two.root, two.across, r.unit, undefined)
            foot = (r.swings.e, 0.0 * r.swings.e, r.swings.g)
            path = carried(r, one, two)
            put_point(out, i, j, foot, path, scale)
            pin, ball = crank_pin(r.swings, u, v), (r.swings.c * one.cos, r.swings.c * one.sin, r.slides * two.s)
            put_block(out.joints, i, j, (*pin, *add(foot, ball)), scale)
