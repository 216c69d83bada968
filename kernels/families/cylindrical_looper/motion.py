"""Motion of the cylindrical looper at given crank angles, and its bodies for their loads.

The bodies are two cranks and couplers, shaft and rocker.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import magnitude
from kernels.arithmetic.vectors import add, cross, mix, scale
from kernels.families.cylindrical_looper.closure import Reduced, reduce_design
from kernels.jit import inline, kernel
from kernels.linkage import bodies as tree
from kernels.linkage.driven_ball import Path, Swung, crank_pin, pin_path, rotated, swing
from kernels.linkage.outputs import has_point, put_angle, put_block, put_loop, put_point
from kernels.linkage.slider_closure import Reduced as Slider
from kernels.linkage.slider_closure import derivatives, place, tolerance
from kernels.linkage.verdict import pose_status
from kernels.types import Array, Numbers, Status


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
    """Place of the shaft along its axis, and derivatives, from the slider-crank that moves it, (1)."""
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
    """Ball of crank 1 from the foot of the shaft's rocker, which slides with the shaft or does not, (2)."""
    m, m1, m2, m3 = pin_path(r.swings, u, v)
    if r.slides == 1.0:
        m, m1 = (m[0], m[1], m[2] - slide.s), (m1[0], m1[1], m1[2] - slide.first)
        m2, m3 = (m2[0], m2[1], m2[2] - slide.second), (m3[0], m3[1], m3[2] - slide.third)
    return m, m1, m2, m3


# Blocks (k, n, m) of outputs, or None, which is not computed.
Outputs = namedtuple("Outputs", "shaft shaft_loop slide slide_loop point velocity acceleration jerk magnitudes joints")


@kernel
def poses(designs: Numbers, cos_phi: Numbers, sin_phi: Numbers, status: Status, out: Outputs) -> None:
    """Angle and place of the looper's shaft and the working point, with derivatives, of every design and crank angle.

    Equations (1)-(5) of docs/cylindrical_looper.md.

    Parameters
    ----------
    designs : (n, 19) columns as `PARAMETERS` of sweep/families/cylindrical_looper.py
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
    Outputs of None are neither computed nor compiled.  Where a loop is not OK its coordinate is nan (but at a dead
    point only its derivatives are), and so are the outputs that depend on it.
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
            if out.slide is not None or out.slide_loop is not None:
                slide_counts = True
            if out.shaft is not None or out.shaft_loop is not None:
                shaft_counts = True
            if has_point(out) or out.joints is not None:
                slide_counts, shaft_counts = True, True
            status[i, j] = _code(r.valid, slide_counts, two.status, shaft_counts, one.status)
            undefined = 0.0 if r.valid else math.nan
            scale = r.unit + undefined
            put_angle(out.shaft, i, j, one, undefined)
            put_block(out.slide, i, j, (two.s, two.first, two.second, two.third), scale)
            put_loop(out.shaft_loop, i, j, one.delta, magnitude(one.root), one.across, r.unit, undefined)
            put_loop(out.slide_loop, i, j, two.delta, two.root, two.across, r.unit, undefined)
            foot = (drive.e, 0.0 * drive.e, drive.g)
            path = carried(r, one, two)
            put_point(out, i, j, foot, path, scale)
            put_block(out.joints, i, j, _joints(r, one, two, u, v), scale)


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
def carried(r: Reduced, one: Swung, two: Slide) -> Path:
    """Working point from the shaft's foot: fixed to the shaft, which turns and slides, (4)."""
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
def _joints(r: Reduced, one: Swung, two: Slide, u: float, v: float) -> tuple[Any, ...]:
    """Coordinates x y z of crank pin 1 and of the rocker's ball."""
    drive = r.swings
    lift = drive.g + two.s if r.slides == 1.0 else drive.g + 0.0 * drive.e
    ball = (drive.e + drive.c * one.cos, drive.c * one.sin, lift)
    return (*crank_pin(drive, u, v), *ball)


SHAFT = 2  # its number among the bodies


@kernel
def links(designs: Array, cos_phi: Array, sin_phi: Array, motion: Array, out: tree.Links) -> None:
    """Fill the bodies, freedoms and closing lines of every pose; symbols are those of docs/cylindrical_looper.md.

    The rocker sits on the shaft, which guides it across and takes its torque by a key.  Along the shaft it is held by
    the shaft where it slides with it, and by the frame where it stays at its height.

    Parameters
    ----------
    designs : (n, 23);  cos_phi, sin_phi : (n, m) or (1, m)
    motion : (6, n, m), outputs psi, dpsi, d2psi, s, ds, d2s of ``poses``
    out : crank 1, crank 2, shaft, rocker, coupler 1, coupler 2; shaft and rocker from the axis at the height of the
        rocker's ball at s = 0, the shaft moved by s, the rocker where it slides.  Nine freedoms; seven lines, of both
        balls, whose forces act on rocker and shaft, and along the shaft on the rocker
    """
    for i in range(designs.shape[0]):
        d = designs[i]
        shaft1, k, foot = tree.main_shaft(d[6], d[4]), (0.0, 0.0, 1.0), (d[3], 0.0, d[5])
        # Frame of crank 2: x2 across the shaft, y2 = k along it, z2 = x2 x k; its slide is the shaft's axis.
        x2 = (math.cos(d[21]), math.sin(d[21]), 0.0)
        z2 = cross(x2, k)
        sa, ca = math.sin(d[12]), math.cos(d[12])
        u2, g2 = mix(sa, k, ca, z2), mix(ca, k, -sa, z2)
        shaft2 = tree.Shaft(add(mix(1.0, foot, -d[10], x2), scale(d[11], u2)), u2, x2, g2)
        co, so = math.cos(d[13]), math.sin(d[13])
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(motion.shape[2]):
            psi, dpsi, d2psi = motion[0, i, j], motion[1, i, j], motion[2, i, j]
            s, ds, d2s = motion[3, i, j], motion[4, i, j], motion[5, i, j]
            bodies, axes, lines = out.bodies[i, j], out.axes[i, j], out.lines[i, j]
            u, v = cos_phi[row, j], sin_phi[row, j]
            w, x = u * co - v * so, v * co + u * so
            crank1, pin1 = tree.put_crank(bodies[0], axes[0], shaft1, d[0], u, v)
            crank2, pin2 = tree.put_crank(bodies[1], axes[1], shaft2, d[8], w, x)
            rho = (math.cos(psi), math.sin(psi), 0.0)
            omega, eps = scale(dpsi, k), scale(d2psi, k)
            place = mix(1.0, foot, s, k)
            looper = tree.Moving(place, scale(ds, k), scale(d2s, k), omega, eps)
            tree.put_body(bodies[2], looper, rho, cross(k, rho), k, foot)
            held = mix(1.0, foot, d[15] * s, k)
            rocker = tree.Moving(held, scale(d[15] * ds, k), scale(d[15] * d2s, k), omega, eps)
            tree.put_body(bodies[3], rocker, rho, cross(k, rho), k, held)
            tree.put(axes[2], k)
            tree.put(axes[3], k)
            tree.put(axes[4], k)
            ball1 = add(held, scale(d[2], rho))
            beta = psi + d[20]
            ball2 = add(place, scale(d[19], (math.cos(beta), math.sin(beta), 0.0)))
            tree.put_rod(bodies[4], axes[5:], crank1, pin1, rocker, ball1)
            tree.put_rod(bodies[5], axes[7:], crank2, pin2, looper, ball2)
            tree.put_ball(lines, ball1)
            tree.put_ball(lines[3:], ball2)
            tree.put_line(lines[6], held, k)
            out.ends[i, 6, 1] = SHAFT if d[15] == 1.0 else tree.FRAME
