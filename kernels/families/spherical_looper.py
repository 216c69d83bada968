"""Looper on a sphere: a carrier swung by a crank-rocker, on it a looper swung by a second crank; both axes meet.

Everything is computed in lengths divided by a power of two near the first crank, so no scale of the drawing costs a
bit.  Designs may be complex128 (exact gradients by the complex step); decisions look at the real part.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import magnitude, unit_near
from kernels.arithmetic.vectors import Vector, add, cross, dot, mix, scale, turned
from kernels.jit import inline, kernel
from kernels.linkage import bodies as tree
from kernels.linkage.driven_ball import Crank, Path, Swung, crank_pin, pin_path, reduce_crank, rotated, swing
from kernels.linkage.outputs import has_point, put_angle, put_block, put_loop, put_point
from kernels.types import Array, Numbers, Status


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``."""

    swings: Crank  # drive that swings the carrier
    o: float
    radial: Vector  # triad of the looper's axis at psi = 0: towards its ball, across, along the axis
    across: Vector
    axis: Vector
    c2: float  # distance of the looper's ball from its axis, and its place along the axis
    along: float
    point: Vector  # working point in that triad
    a2: float
    b2: float
    shaft2: Vector  # centre of crank 2
    centre: Vector  # the same from Os; directions of crank angles 0 and 90 deg
    first: Vector
    second: Vector
    cos_offset: float
    sin_offset: float
    branch2: float
    size2: float
    unit: float
    valid: bool


@inline
def reduce_design(designs: Numbers, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for links of no length and for numbers that are not finite."""
    d = designs[i]
    unit, per = unit_near(d[0])
    swings = reduce_crank(d, per, d[7].real)
    o = d[8] * per
    sd, cd, sg, cg = np.sin(d[9]), np.cos(d[9]), np.sin(d[10]), np.cos(d[10])
    axis = (sd * cg, sd * sg, cd)
    ball, tip = (d[11] * per, d[12] * per, d[13] * per), (d[14] * per, d[15] * per, d[16] * per)
    along = dot(ball, axis)
    foot = mix(1.0, ball, -along, axis)
    c2 = np.sqrt(dot(foot, foot))
    ball_size = abs(ball[0].real) + abs(ball[1].real) + abs(ball[2].real)
    # a ball within its own rounding of the axis has no direction from it, and so no triad
    hinged = c2.real > 8.0 * 2.0**-53 * ball_size
    radial = scale(1.0 / c2 if hinged else math.nan, foot)
    across = cross(axis, radial)
    point = (dot(tip, radial), dot(tip, across), dot(tip, axis))
    a2, b2 = d[17] * per, d[18] * per
    shaft2 = (d[19] * per, d[20] * per, d[21] * per)
    centre = (shaft2[0] - swings.e, shaft2[1], shaft2[2] - o)
    st, ct, sb, cb = np.sin(d[22]), np.cos(d[22]), np.sin(d[23]), np.cos(d[23])
    # magnitudes, not the sums themselves: where those cancel, the errors of their parts stay
    size2 = a2.real + abs(shaft2[0].real) + abs(swings.e.real) + abs(centre[1].real) + abs(shaft2[2].real)
    size2 += abs(o.real) + ball_size
    tip_size = abs(tip[0].real) + abs(tip[1].real) + abs(tip[2].real)
    valid = swings.valid and 0.0 < a2.real < 1e140 and 0.0 < b2.real < 1e140 and size2 < 1e140 and tip_size < 1e140
    for k in (9, 10, 22, 23, 24):
        valid = valid and abs(d[k].real) < 1e5
    branch2 = d[25].real
    valid = valid and branch2 * branch2 == 1.0 and unit < math.inf
    return Reduced(
        swings, o, radial, across, axis, c2 if hinged else 0.0 * c2, along, point,
        a2, b2, shaft2, centre, (ct * cb, ct * sb, -st), (-sb, cb, 0.0 * cb), np.cos(d[24]), np.sin(d[24]), branch2,
        size2, unit, valid,
    )  # fmt: skip


@inline
def _second_crank(r: Reduced, u: float, v: float) -> Path:
    """Ball of crank 2 from the common point Os of both axes, (2)."""
    u2, v2 = u * r.cos_offset - v * r.sin_offset, v * r.cos_offset + u * r.sin_offset
    radial = mix(r.a2 * u2, r.first, r.a2 * v2, r.second)
    tangential = mix(-r.a2 * v2, r.first, r.a2 * u2, r.second)
    back = (-tangential[0], -tangential[1], -tangential[2])
    return add(r.centre, radial), tangential, (-radial[0], -radial[1], -radial[2]), back


@inline
def _in_triad(r: Reduced, a: Vector, lift: float) -> Vector:
    """Components in the triad of the looper's axis, from a height along it."""
    return dot(a, r.radial), dot(a, r.across), dot(a, r.axis) - lift


@inline
def _seen_from_carrier(r: Reduced, carrier: Swung, path: Path) -> Path:
    """Driving ball in the looper's frame, which the carrier takes along, (3)."""
    # turned back by the carrier's angle: minus the sine and minus all derivatives
    m, m1, m2, m3 = rotated(carrier.cos, -carrier.sin, -carrier.first, -carrier.second, -carrier.third, path)
    return _in_triad(r, m, r.along), _in_triad(r, m1, 0.0), _in_triad(r, m2, 0.0), _in_triad(r, m3, 0.0)


@inline
def _carried(r: Reduced, carrier: Swung, looper: Swung, fixed: Vector) -> Path:
    """Return a point fixed to the looper, from Os in fixed axes, with its derivatives, (5)."""
    none = (0.0 * fixed[0], 0.0 * fixed[0], 0.0 * fixed[0])
    # the point rests in the looper: its derivatives there are zeros of the design's own type
    path = (fixed, none, none, none)
    m, m1, m2, m3 = rotated(looper.cos, looper.sin, looper.first, looper.second, looper.third, path)
    path = (
        turned(r.radial, r.across, r.axis, m),
        turned(r.radial, r.across, r.axis, m1),
        turned(r.radial, r.across, r.axis, m2),
        turned(r.radial, r.across, r.axis, m3),
    )
    return rotated(carrier.cos, carrier.sin, carrier.first, carrier.second, carrier.third, path)


# Blocks (k, n, m) of outputs, or None, which is not computed.
Outputs = namedtuple(
    "Outputs", "carrier carrier_loop looper looper_loop point velocity acceleration jerk magnitudes joints"
)


@kernel
def poses(designs: Numbers, cos_phi: Numbers, sin_phi: Numbers, status: Status, out: Outputs) -> None:
    """Compute the carrier, looper and working point with derivatives, of every design at its crank angles.

    Equations (1)-(6) of docs/spherical_looper.md.

    Parameters
    ----------
    designs : (n, 26) columns as `PARAMETERS` of sweep/families/spherical_looper.py
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, or that of the first loop that is not: NOT_ASSEMBLED, DEAD_POINT, SINGULAR (a driving ball
        on the axis it turns the link about, or the looper's ball on the looper's axis); INVALID_INPUT.  Where nothing
        but the carrier's outputs is wanted, the looper's loop does not count
    carrier, looper : (4, n, m) out, psi and chi [rad] and their three derivatives, or None
    carrier_loop, looper_loop : (2, n, m) out, discriminant [length^2] and pressure angle [rad], or None
    point, velocity, acceleration, jerk : (3, n, m) out [length], x y z of the working point and derivatives, or None
    magnitudes : (3, n, m) out [length], lengths of velocity, acceleration and jerk, or None
    joints : (12, n, m) out [length], x y z of crank pin 1, carrier's ball, crank pin 2, looper's ball, or None

    Notes
    -----
    Outputs of None are neither computed nor compiled.  Where a loop is not OK its angle is nan (but at a dead point
    only its derivatives are), and so are the outputs that depend on it.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            first, second = pin_path(r.swings, u, v), _second_crank(r, u, v)
            drive = r.swings
            one = swing(first, drive.size, drive.b, drive.c, drive.branch)
            two = swing(_seen_from_carrier(r, one, second), r.size2, r.b2, r.c2, r.branch2)
            code = one.status if r.valid else st.INVALID_INPUT
            if out.looper is not None or out.looper_loop is not None or has_point(out) or out.joints is not None:
                code = two.status if code == st.OK else code
            status[i, j] = code
            undefined = 0.0 if r.valid else math.nan
            put_angle(out.carrier, i, j, one, undefined)
            put_angle(out.looper, i, j, two, undefined)
            put_loop(out.carrier_loop, i, j, one.delta, magnitude(one.root), one.across, r.unit, undefined)
            put_loop(out.looper_loop, i, j, two.delta, magnitude(two.root), two.across, r.unit, undefined)
            centre = (drive.e, 0.0 * drive.e, r.o)
            scale = r.unit + undefined
            path = _carried(r, one, two, r.point)
            put_point(out, i, j, centre, path, scale)
            put_block(out.joints, i, j, _joints(r, second, one, two, u, v), scale)


@inline
def _joints(r: Reduced, second: Path, one: Swung, two: Swung, u: float, v: float) -> tuple[Any, ...]:
    """Coordinates x y z of crank pin 1, carrier's ball, crank pin 2 and looper's ball."""
    drive = r.swings
    centre = (drive.e, 0.0 * drive.e, r.o)
    ball, _, _, _ = _carried(r, one, two, (r.c2, 0.0 * r.c2, r.along))
    rocker = (drive.e + drive.c * one.cos, drive.c * one.sin, drive.g)
    # not from Os, which would cost a short crank its digits: the second derivative is the pin's place from its shaft
    pin2 = mix(1.0, r.shaft2, -1.0, second[2])
    return (*crank_pin(drive, u, v), *rocker, *pin2, *add(centre, ball))


@kernel
def links(designs: Array, cos_phi: Array, sin_phi: Array, motion: Array, out: tree.Links) -> None:
    """Fill the bodies, freedoms and closing lines of every pose; symbols are those of docs/spherical_looper.md.

    Parameters
    ----------
    designs : (n, 26);  cos_phi, sin_phi : (n, m) or (1, m)
    motion : (6, n, m), outputs psi, dpsi, d2psi, chi, dchi, d2chi of ``poses``
    out : crank 1, crank 2, carrier, looper, coupler 1, coupler 2; the axes of the looper are x, y, z at psi = chi = 0.
        Eight freedoms; six lines, of the carrier's and the looper's ball, whose forces act on them
    """
    for i in range(designs.shape[0]):
        d = designs[i]
        shaft1, k = tree.main_shaft(d[6], d[4]), (0.0, 0.0, 1.0)
        foot, os = (d[3], 0.0, d[5]), (d[3], 0.0, d[8])
        still = (math.sin(d[9]) * math.cos(d[10]), math.sin(d[9]) * math.sin(d[10]), math.cos(d[9]))
        st, ct, sb, cb = math.sin(d[22]), math.cos(d[22]), math.sin(d[23]), math.cos(d[23])
        u2, g1, g2 = (st * cb, st * sb, ct), (ct * cb, ct * sb, -st), (-sb, cb, 0.0)
        shaft2, co, so = tree.Shaft((d[19], d[20], d[21]), u2, g1, g2), math.cos(d[24]), math.sin(d[24])
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(motion.shape[2]):
            psi, dpsi, d2psi = motion[0, i, j], motion[1, i, j], motion[2, i, j]
            chi, dchi, d2chi = motion[3, i, j], motion[4, i, j], motion[5, i, j]
            bodies, axes, lines = out.bodies[i, j], out.axes[i, j], out.lines[i, j]
            u, v = cos_phi[row, j], sin_phi[row, j]
            w, x = u * co - v * so, v * co + u * so
            crank1, pin1 = tree.put_crank(bodies[0], axes[0], shaft1, d[0], u, v)
            crank2, pin2 = tree.put_crank(bodies[1], axes[1], shaft2, d[17], w, x)
            cp, sp = math.cos(psi), math.sin(psi)
            rho = (cp, sp, 0.0)
            carrier = tree.put_turning(bodies[2], foot, k, rho, dpsi, d2psi)
            tree.put(axes[2], k)
            n2 = tree.turned_about(k, cp, sp, still)
            cc, sc = math.cos(chi), math.sin(chi)
            gyro = scale(dpsi * dchi, cross(k, n2))
            eps = add(mix(d2psi, k, d2chi, n2), gyro)
            none = (0.0, 0.0, 0.0)
            looper = tree.Moving(os, none, none, mix(dpsi, k, dchi, n2), eps)
            bx = tree.turned_about(k, cp, sp, tree.turned_about(still, cc, sc, shaft1.first))
            by = tree.turned_about(k, cp, sp, tree.turned_about(still, cc, sc, (0.0, 1.0, 0.0)))
            tree.put_body(bodies[3], looper, bx, by, cross(bx, by), os)
            tree.put(axes[3], n2)
            ball1 = add(foot, scale(d[2], rho))
            ball2 = add(os, add(mix(d[11], bx, d[12], by), scale(d[13], cross(bx, by))))
            tree.put_rod(bodies[4], axes[4:], crank1, pin1, carrier, ball1)
            tree.put_rod(bodies[5], axes[6:], crank2, pin2, looper, ball2)
            tree.put_ball(lines, ball1)
            tree.put_ball(lines[3:], ball2)
