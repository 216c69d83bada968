"""Motion of the cylindrical looper at given crank angles: shaft, working point, their derivatives."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.complex_step import magnitude
from kernels.driven_ball import EPS, Path, Swung, rotated, swing
from kernels.families.cylindrical_looper.closure import Numbers, Reduced, Status, reduce_design
from kernels.looper_outputs import put_angle, put_loop, put_point


class Slide(NamedTuple):
    """Place of the shaft along its axis and its derivatives; root = sqrt(delta), coupler times cos(pressure angle)."""

    status: int
    s: Any
    first: Any
    second: Any
    third: Any
    delta: Any
    root: Any
    across: Any  # square of the coupler's part across the shaft


@inline
def _slide(r: Reduced, u: float, v: float) -> Slide:
    """The slider-crank that moves the shaft along, (1)."""
    y = r.k0 + r.ka * v
    m, n = r.e2 - r.a2 * u, r.n0 - r.na * v
    q = (r.b2 - m) * (r.b2 + m) - n * n
    t = 8.0 * EPS
    tolerance = t * (abs(m.real) * r.m_size + abs(n.real) * r.n_size)
    tolerance += t * t * (r.m_size * r.m_size + r.n_size * r.n_size)
    code = st.OK
    if q.real != q.real:
        code = st.INVALID_INPUT
    elif q.real < -tolerance:
        code = st.NOT_ASSEMBLED
    elif q.real <= tolerance:
        code = st.DEAD_POINT
    moving = code == st.OK
    root = np.sqrt(q) if moving else 0.0 * q
    has_place = moving or code == st.DEAD_POINT
    w = r.branch2 * root if has_place else math.nan * q
    per_w = 1.0 / w if moving else math.nan * q
    # with cos^2 + sin^2 = 1 taken out: as it stands it cancels for alpha2 near 90 deg
    q1 = r.ka * u * y - r.a2 * v * r.e2
    w1 = q1 * per_w
    w2 = (r.ka * (r.ka * u * u - v * y) - r.a2 * u * r.e2 - w1 * w1) * per_w
    w3 = (-q1 - 3.0 * r.ka * r.ka * u * v - 3.0 * w1 * w2) * per_w
    across = m * m + n * n if has_place else math.nan * q
    return Slide(code, y + w, r.ka * u + w1, w2 - r.ka * v, w3 - r.ka * u, q, root, across)


@inline
def _first_crank(r: Reduced, slide: Slide, u: float, v: float) -> Path:
    """Ball of crank 1 from the foot of the shaft's rocker, which slides with the shaft or does not, (2)."""
    hu, hv, tu, tv = r.a1 * (r.ca * u), r.a1 * (r.ca * v), r.a1 * (r.sa * u), r.a1 * (r.sa * v)
    s, s1, s2, s3 = 0.0 * slide.delta, 0.0 * slide.delta, 0.0 * slide.delta, 0.0 * slide.delta
    if r.slides == 1.0:
        s, s1, s2, s3 = slide.s, slide.first, slide.second, slide.third
    pin = (r.a1 * u - r.e1, r.y0 + hv, r.lift - r.g1 - tv - s)
    return pin, (-r.a1 * v, hu, -tu - s1), (-r.a1 * u, -hv, tv - s2), (r.a1 * v, -hu, tu - s3)


@kernel
def poses(
    designs: Numbers,
    cos_phi: Numbers,
    sin_phi: Numbers,
    status: Status,
    shaft: Numbers | None,
    shaft_loop: Numbers | None,
    slide: Numbers | None,
    slide_loop: Numbers | None,
    point: Numbers | None,
    velocity: Numbers | None,
    acceleration: Numbers | None,
    jerk: Numbers | None,
    magnitudes: Numbers | None,
    joints: Numbers | None,
) -> None:
    """Angle and place of the looper's shaft and the working point, with derivatives, of every design and crank angle.

    Equations (1)-(5) of docs/cylindrical_looper.md.

    Parameters
    ----------
    designs : (n, 19) columns of :class:`Design`
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, or that of the first loop that is not, the slider-crank's before the crank-rocker's:
        NOT_ASSEMBLED, DEAD_POINT, SINGULAR (crank pin 1 on the shaft's axis); INVALID_INPUT.  A loop that nothing
        wanted depends on does not count
    shaft, slide : (4, n, m) out, psi [rad] and s [length] and their three derivatives, or None
    shaft_loop, slide_loop : (2, n, m) out, discriminant [length^2] and pressure angle [rad], or None
    point, velocity, acceleration, jerk : (3, n, m) out [length], x y z of the working point and derivatives, or None
    magnitudes : (3, n, m) out [length], lengths of velocity, acceleration and jerk, or None
    joints : (6, n, m) out [length], x y z of crank pin 1 and of the rocker's ball, or None

    Notes
    -----
    What is None is neither computed nor compiled.  Where a loop is not OK its coordinate is nan (but at a dead point
    only its derivatives are), and so is what follows from it.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            two = _slide(r, u * r.cos_offset - v * r.sin_offset, v * r.cos_offset + u * r.sin_offset)
            first = _first_crank(r, two, u, v)
            one = swing(first, r.size1, r.b1, r.c1, r.branch1)
            slide_counts, shaft_counts = r.slides == 1.0, False
            if slide is not None or slide_loop is not None:
                slide_counts = True
            if shaft is not None or shaft_loop is not None:
                shaft_counts = True
            if (
                point is not None or velocity is not None or acceleration is not None or jerk is not None
                or magnitudes is not None or joints is not None
            ):  # fmt: skip
                slide_counts, shaft_counts = True, True
            status[i, j] = _code(r.valid, slide_counts, two.status, shaft_counts, one.status)
            undefined = 0.0 if r.valid else math.nan
            scale = r.unit + undefined
            put_angle(shaft, i, j, one, undefined)
            _put_slide(slide, i, j, two, scale)
            if shaft_loop is not None:
                put_loop(shaft_loop, i, j, one.delta, magnitude(one.root), one.across, r.unit, undefined)
            if slide_loop is not None:
                put_loop(slide_loop, i, j, two.delta, two.root, two.across, r.unit, undefined)
            foot = (r.e1, 0.0 * r.e1, r.g1)
            path = _carried(r, one, two)
            put_point(point, velocity, acceleration, jerk, magnitudes, i, j, foot, path, scale)
            if joints is not None:
                _put_joints(joints, i, j, r, first, one, two, v, scale)


@inline
def _code(valid: bool, slide_counts: bool, of_slide: int, shaft_counts: bool, of_shaft: int) -> int:
    """Status of the first loop that counts and is not OK."""
    if not valid:
        return st.INVALID_INPUT
    # the slider-crank first: the crank-rocker's driving ball may hang on it
    if slide_counts and of_slide != st.OK:
        return of_slide
    return of_shaft if shaft_counts else st.OK


@inline
def _put_slide(slide: Numbers | None, i: int, j: int, two: Slide, scale: Any) -> None:
    """Write place of the shaft along its axis and its three derivatives [length]."""
    if slide is not None:
        slide[0, i, j] = two.s * scale
        slide[1, i, j] = two.first * scale
        slide[2, i, j] = two.second * scale
        slide[3, i, j] = two.third * scale


@inline
def _carried(r: Reduced, one: Swung, two: Slide) -> Path:
    """The working point from the shaft's foot: fixed to the shaft, which turns and slides, (4)."""
    # zeros of the design's own kind: complex where the design is, or the tuples would mix two types
    none = 0.0 * r.e1
    along = (
        (r.point[0], r.point[1], r.point[2] + two.s),
        (none, none, two.first),
        (none, none, two.second),
        (none, none, two.third),
    )
    return rotated(one.cos, one.sin, one.first, one.second, one.third, along)


@inline
def _put_joints(
    joints: Numbers, i: int, j: int, r: Reduced, first: Path, one: Swung, two: Slide, v: float, scale: Any
) -> None:
    """Write x y z of crank pin 1 and of the rocker's ball [length]."""
    # not from the path's own z, which the slide has been taken off
    pin = (first[0][0] + r.e1, first[0][1], r.lift - r.a1 * (r.sa * v))
    lift = r.g1 + two.s if r.slides == 1.0 else r.g1 + 0.0 * r.e1
    ball = (r.e1 + r.c1 * one.cos, r.c1 * one.sin, lift)
    for k in range(3):
        joints[k, i, j] = pin[k] * scale
        joints[3 + k, i, j] = ball[k] * scale
