"""Crank whose rod slides through a swivel block at a fixed point and carries a working point beyond it.

The planar form is the looper with a rod through a swinging block.

Everything is computed in lengths divided by a power of two near the crank length, so no scale of the drawing costs a
bit.  Designs may be complex128 (exact gradients by the complex step); decisions look at the real part.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import unit_near
from kernels.arithmetic.vectors import Vector, cross, dot, mix, scale
from kernels.jit import inline, kernel
from kernels.linkage import bodies as tree
from kernels.linkage.outputs import put_block
from kernels.types import EPS, Array, Numbers, Status


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``: B = (a u, y0 + ka v, lift - na v), Q = (e, 0, g); (5)."""

    a: float
    e: float
    y0: float
    ka: float
    lift: float
    na: float
    g: float
    sa: float
    ca: float
    side: float  # p2, of Q in the frame of the crank
    rise: float  # p3
    power: float  # D
    frame: float  # D + a^2
    length: float  # Lw
    size: float  # sum of the magnitudes whose rounding errors make up the vector from B to Q
    unit: float
    valid: bool


@inline
def reduce_design(designs: Numbers, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for a crank of no length and for numbers that are not finite."""
    unit, per_unit = unit_near(designs[i, 0])
    a, e, f, g = designs[i, 0] * per_unit, designs[i, 1] * per_unit, designs[i, 2] * per_unit, designs[i, 3] * per_unit
    alpha, length = designs[i, 4], designs[i, 5] * per_unit
    sa, ca = np.sin(alpha), np.cos(alpha)
    size = abs(e.real) + abs(f.real) + abs(g.real) + a.real
    valid = 0.0 < a.real <= 1.0 and size < 1e140 and abs(length.real) < 1e140
    valid = valid and abs(alpha.real) < 1e5 and unit < math.inf
    side, rise = -g * sa, g * ca - f
    across = side * side + rise * rise
    power, frame = (e - a) * (e + a) + across, e * e + across
    return Reduced(
        a, e, f * sa, a * ca, f * ca, a * sa, g, sa, ca, side, rise, power, frame, length, size, unit, valid
    )  # fmt: skip


@inline
def _along(r: Reduced, u: Any, v: Any) -> Any:
    """Distance e - a u from crank pin to block along x, in a form that keeps its digits near the block's centre."""
    if u.real > 0.0:
        return (r.e - r.a) + r.a * v * v / (1.0 + u)
    return (r.e + r.a) - r.a * v * v / (1.0 - u)


@inline
def _turning(
    r: Reduced, u: Any, v: Any, length: Any, per: Any, h1: Any
) -> tuple[tuple[Any, Any, Any, Any], Any, Vector, Vector, Vector]:
    """Length of the rod with its derivatives, w.w, and the angular velocity w of the rod with its derivatives; (5)-(7).

    No terms cancel but those that cancel in the design itself.
    """
    square, ahead = per * per, r.e * u + r.side * v
    m, lean, pull = h1 * per, r.a * square * r.rise, r.power * square
    # Three forms of one number: the first is the difference of large terms unless the pin is near the block's centre,
    # the others unless the crank or the frame is short.  The one with the smallest terms is taken.
    k, more = 0.5 * (pull - 1.0), 0.5 * (pull + 1.0)
    size = abs((r.e * u).real) + abs((r.side * v).real)
    terms = 0.5 * (1.0 + abs(pull.real)) / square.real
    of_crank, of_frame = r.a.real * (size + r.a.real), r.frame.real + r.a.real * size
    if of_crank < terms and of_crank <= of_frame:
        k = r.a * square * (ahead - r.a)
        more = 1.0 + k
    elif of_frame < terms:
        more = square * (r.frame - r.a * ahead)
        k = more - 1.0
    fast = lean * lean + k * k
    bend = lean * lean + k * more
    spoke, tangent, axis = (u, r.ca * v, -r.sa * v), (-v, r.ca * u, -r.sa * u), (0.0, r.sa, r.ca)
    w = mix(lean, spoke, -k, axis)
    w1 = mix(1.0, mix(-2.0 * m * lean, spoke, lean, tangent), m * pull, axis)
    w2 = mix(lean * (6.0 * m * m - 1.0 - 2.0 * bend), spoke, -4.0 * m * lean, tangent)
    w2 = mix(1.0, w2, pull * (bend - 3.0 * m * m), axis)
    return (length, h1, length * bend, -h1 * (1.0 + 3.0 * bend)), fast, w, w1, w2


# Blocks (k, n, m) of outputs, or None, which is not computed.
Outputs = namedtuple("Outputs", "rod point velocity acceleration jerk joints")


@kernel
def poses(designs: Numbers, cos_phi: Numbers, sin_phi: Numbers, status: Status, out: Outputs) -> None:
    """Rod between crank pin and block, and the working point, with derivatives, of every design and crank angle.

    Equations (1)-(7) of docs/swivel.md.

    Parameters
    ----------
    designs : (n, 6) columns as `SWIVEL_PARAMETERS` of sweep/families/slotted.py
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, SINGULAR (the crank pin lies in the block's centre) or INVALID_INPUT
    rod : (4, n, m) out [length], distance of crank pin and block and its three derivatives, or None
    point, velocity, acceleration, jerk : (3, n, m) out [length], x y z of the working point and of its derivatives, or
        None
    joints : (6, n, m) out, crank pin x y z and direction of the rod x y z, or None

    Notes
    -----
    Outputs of None are neither computed nor compiled.  Where the status is not OK the values are nan.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            pin = (r.a * u, r.y0 + r.ka * v, r.lift - r.na * v)
            reach = (_along(r, u, v), -pin[1], r.g - pin[2])
            reach1, reach2 = (r.a * v, -r.ka * u, r.na * u), (r.a * u, r.ka * v, -r.na * v)
            square = dot(reach, reach)
            tolerance = 4.0 * EPS * r.size
            code = st.OK
            if not r.valid or square.real != square.real:
                code = st.INVALID_INPUT
            elif square.real <= tolerance * tolerance:
                code = st.SINGULAR
            status[i, j] = code
            length = np.sqrt(square) if code == st.OK else square * math.nan
            per = 1.0 / length if code == st.OK else length
            n = scale(per, reach)
            # n . E' without the part of E that is the crank's own, which is square to E'
            rod, fast, w, w1, w2 = _turning(r, u, v, length, per, r.a * (r.e * v - r.side * u) * per)
            put_block(out.rod, i, j, rod, r.unit)
            n1 = cross(w, n)
            n2 = mix(1.0, cross(w1, n), -fast, n)
            n3 = mix(1.0, mix(1.0, cross(w2, n), -3.0 * dot(w, w1), n), -fast, n1)
            put_block(out.point, i, j, mix(1.0, pin, r.length, n), r.unit)
            put_block(out.velocity, i, j, mix(r.length, n1, -1.0, reach1), r.unit)
            put_block(out.acceleration, i, j, mix(r.length, n2, -1.0, reach2), r.unit)
            put_block(out.jerk, i, j, mix(r.length, n3, 1.0, reach1), r.unit)
            placed = scale(r.unit if code == st.OK else math.nan, pin)
            put_block(out.joints, i, j, placed + n, 1.0)


@kernel
def links(designs: Array, cos_phi: Array, sin_phi: Array, motion: Array, out: tree.Links) -> None:
    """Fill the bodies, freedoms and closing lines of every pose; equation numbers are of docs/swivel.md.

    Parameters
    ----------
    designs : (n, 6);  cos_phi, sin_phi : (n, m) or (1, m)
    motion : (5, n, m), outputs rho, drho and x y z of the rod's direction of ``poses``
    out : two bodies, three freedoms, two lines: the block's forces on the rod across it
    """
    for i in range(designs.shape[0]):
        d = designs[i]
        shaft, block = tree.main_shaft(d[4], d[2]), (d[1], 0.0, d[3])
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(motion.shape[2]):
            bodies, axes = out.bodies[i, j], out.axes[i, j]
            crank, pin = tree.put_crank(bodies[0], axes[0], shaft, d[0], cos_phi[row, j], sin_phi[row, j])
            rho, drho = motion[0, i, j], motion[1, i, j]
            n = (motion[2, i, j], motion[3, i, j], motion[4, i, j])
            v, a = tree.velocity_at(crank, pin), tree.acceleration_at(crank, pin)
            # n x n' and n x n'' of (3), with E' = -B'
            w = scale(-1.0 / rho, cross(n, v))
            rod = tree.Moving(pin, v, a, w, scale(-1.0 / rho, mix(1.0, cross(n, a), 2.0 * drho, w)))
            y = tree.across(n)
            z = cross(n, y)
            tree.put_body(bodies[1], rod, n, y, z, pin)
            tree.put(axes[1], y)
            tree.put(axes[2], z)
            tree.put_line(out.lines[i, j, 0], block, y)
            tree.put_line(out.lines[i, j, 1], block, z)
