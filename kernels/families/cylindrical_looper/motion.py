"""Motion of the cylindrical looper at given crank angles: shaft, working point, their derivatives."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.complex_step import magnitude
from kernels.driven_ball import Path, Swung, rotated, swing
from kernels.families.cylindrical_looper.closure import Numbers, Reduced, Status, reduce_design
from kernels.looper_drive import pin_path
from kernels.looper_outputs import put_angle, put_loop, put_point
from kernels.slider_closure import Reduced as Slider
from kernels.slider_closure import derivatives, place, tolerance
from kernels.verdict import pose_status


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
def _slide(r: Slider, u: float, v: float) -> Slide:
    """Return the slider-crank that moves the shaft along, (1)."""
    y = r.k0 + r.ka * v
    at = place(r, u, v)
    code = pose_status(True, at.q.real, tolerance(r, at), None)
    moving = code == st.OK
    root = np.sqrt(at.q) if moving else 0.0 * at.q
    has_place = moving or code == st.DEAD_POINT
    w = r.branch * root if has_place else math.nan * at.q
    first, second, third = derivatives(r, u, v, y, 1.0 / w if moving else math.nan * at.q)
    across = at.m * at.m + at.n * at.n if has_place else math.nan * at.q
    return Slide(code, y + w, first, second, third, at.q, root, across)


@inline
def _first_crank(r: Reduced, slide: Slide, u: float, v: float) -> Path:
    """Return the ball of crank 1 from the foot of the shaft's rocker, which slides with the shaft or does not, (2)."""
    m, m1, m2, m3 = pin_path(r.swings, u, v)
    if r.slides == 1.0:
        m, m1 = (m[0], m[1], m[2] - slide.s), (m1[0], m1[1], m1[2] - slide.first)
        m2, m3 = (m2[0], m2[1], m2[2] - slide.second), (m3[0], m3[1], m3[2] - slide.third)
    return m, m1, m2, m3


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
    """Compute the angle and place of the looper's shaft and the working point, with derivatives,
    of every design and crank angle.

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
            two = _slide(r.moves, u * r.cos_offset - v * r.sin_offset, v * r.cos_offset + u * r.sin_offset)
            first = _first_crank(r, two, u, v)
            drive = r.swings
            one = swing(first, r.size1, drive.b, drive.c, drive.branch)
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
            put_slide(slide, i, j, two, scale)
            if shaft_loop is not None:
                put_loop(shaft_loop, i, j, one.delta, magnitude(one.root), one.across, r.unit, undefined)
            if slide_loop is not None:
                put_loop(slide_loop, i, j, two.delta, two.root, two.across, r.unit, undefined)
            foot = (drive.e, 0.0 * drive.e, drive.g)
            path = carried(r, one, two)
            put_point(point, velocity, acceleration, jerk, magnitudes, i, j, foot, path, scale)
            if joints is not None:
                _put_joints(joints, i, j, r, first, one, two, v, scale)


@inline
def _code(valid: bool, slide_counts: bool, of_slide: int, shaft_counts: bool, of_shaft: int) -> int:
    """Return the status of the first loop that counts and is not OK."""
    if not valid:
        return st.INVALID_INPUT
    # the slider-crank first: the crank-rocker's driving ball may hang on it
    if slide_counts and of_slide != st.OK:
        return of_slide
    return of_shaft if shaft_counts else st.OK


@inline
def put_slide(slide: Numbers | None, i: int, j: int, two: Slide, scale: Any) -> None:
    """Write place of the shaft along its axis and its three derivatives [length]."""
    if slide is not None:
        slide[0, i, j] = two.s * scale
        slide[1, i, j] = two.first * scale
        slide[2, i, j] = two.second * scale
        slide[3, i, j] = two.third * scale


@inline
def carried(r: Reduced, one: Swung, two: Slide) -> Path:
    """Return the working point from the shaft's foot: fixed to the shaft, which turns and slides, (4)."""
    # zeros of the design's own kind: complex where the design is, or the tuples would mix two types
    none = 0.0 * r.swings.e
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
    drive = r.swings
    pin = (first[0][0] + drive.e, first[0][1], drive.lift - drive.a * (drive.sa * v))
    lift = drive.g + two.s if r.slides == 1.0 else drive.g + 0.0 * drive.e
    ball = (drive.e + drive.c * one.cos, drive.c * one.sin, lift)
    for k in range(3):
        joints[k, i, j] = pin[k] * scale
        joints[3 + k, i, j] = ball[k] * scale
