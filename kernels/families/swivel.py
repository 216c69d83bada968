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
from kernels.arithmetic.vectors import Vector, cross, dot, mix, scale, turned
from kernels.jit import inline, kernel
from kernels.linkage import bodies as tree
from kernels.linkage.outputs import put_block
from kernels.types import EPS, Array, Numbers, Status


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``: B = (a u, y0 + ka v, lift - na v), Q = (e, 0, g)."""

    a: float
    e: float
    y0: float
    ka: float
    lift: float
    na: float
    g: float
    sa: float
    ca: float
    side: float  # of Q in the frame of the crank, square to x and to the crank's axis
    rise: float  # along the crank's axis
    power: float  # D
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
    power = (e - a) * (e + a) + (side * side + rise * rise)
    return Reduced(a, e, f * sa, a * ca, f * ca, a * sa, g, sa, ca, side, rise, power, length, size, unit, valid)


class Turning(NamedTuple):
    """Length of the rod with its derivatives, and the derivatives of its direction."""

    rod: tuple[Any, Any, Any, Any]
    first: Vector
    second: Vector
    third: Vector


@inline
def _along(r: Reduced, u: Any, v: Any) -> Any:
    """Distance e - a u from crank pin to block along x, in a form that keeps its digits near the block's centre."""
    if u.real > 0.0:
        return (r.e - r.a) + r.a * v * v / (1.0 + u)
    return (r.e + r.a) - r.a * v * v / (1.0 - u)


@inline
def _near_the_block(r: Reduced, u: Any, v: Any, n: Vector, length: Any, per: Any) -> Turning:
    """Rod and its direction from the angular velocity of the rod, for a pin near the block; (5)-(7).

    No terms cancel but those that cancel in the design itself.
    """
    h1, square = r.a * (r.e * v - r.side * u) * per, per * per
    m, lean, pull = h1 * per, r.a * square * r.rise, r.power * square
    k, more = 0.5 * (pull - 1.0), 0.5 * (pull + 1.0)
    fast = lean * lean + k * k
    bend = lean * lean + k * more
    spoke, tangent, axis = (u, r.ca * v, -r.sa * v), (-v, r.ca * u, -r.sa * u), (0.0, r.sa, r.ca)
    w = mix(lean, spoke, -k, axis)
    w1 = mix(1.0, mix(-2.0 * m * lean, spoke, lean, tangent), m * pull, axis)
    w2 = mix(lean * (6.0 * m * m - 1.0 - 2.0 * bend), spoke, -4.0 * m * lean, tangent)
    w2 = mix(1.0, w2, pull * (bend - 3.0 * m * m), axis)
    n1 = cross(w, n)
    n3 = mix(1.0, mix(1.0, cross(w2, n), -3.0 * dot(w, w1), n), -fast, n1)
    rod = (length, h1, length * bend, -h1 * (1.0 + 3.0 * bend))
    return Turning(rod, n1, mix(1.0, cross(w1, n), -fast, n), n3)


@inline
def _far_from_the_block(r: Reduced, u: Any, v: Any, length: Any, per: Any) -> Turning:
    """Rod and its direction in the crank's own directions, where E' has one component only; (8), (9)."""
    ahead, y, z, square = r.e * u + r.side * v, r.side * u - r.e * v, r.rise, per * per
    x = ahead - r.a
    reach, m, p = x * x + z * z, -(r.a * y) * square, r.a * square * per
    m1, turn = r.a * ahead * square - 2.0 * m * m, y * y - x * ahead
    # Two forms of rho''/rho; the one with the smaller terms is taken.
    bend, across = r.a * square * ahead - m * m, r.a * reach * square
    if abs(x.real) + across.real < abs(ahead.real) + (r.a * y * y * square).real:
        bend = r.a * square * (x + across)
    a, b, c = y * y + z * z - r.a * x - 3.0 * m * (x * y), x * y - 3.0 * m * reach, ahead + 3.0 * m * y
    a1 = -y * (2.0 * ahead + r.a) - 3.0 * (m1 * x * y + m * (turn + a))
    b1 = turn - 3.0 * (m1 * reach + m * (2.0 * x * y + b))
    c1 = y + 3.0 * (m1 * y - m * (ahead + c))
    spoke, tangent, axis = (u, r.ca * v, -r.sa * v), (-v, r.ca * u, -r.sa * u), (0.0, r.sa, r.ca)
    h1 = m * length
    return Turning(
        (length, h1, length * bend, -h1 * (1.0 + 3.0 * bend)),
        scale(p, turned(spoke, tangent, axis, (x * y, -reach, y * z))),
        scale(p, turned(spoke, tangent, axis, (a, -b, -(z * c)))),
        scale(p, turned(spoke, tangent, axis, (a1 + b, a - b1, -(z * c1)))),
    )


# Blocks (k, n, m) of outputs, or None, which is not computed.
Outputs = namedtuple("Outputs", "rod point velocity acceleration jerk joints")


@kernel
def poses(designs: Numbers, cos_phi: Numbers, sin_phi: Numbers, status: Status, out: Outputs) -> None:
    """Rod between crank pin and block, and the working point, with derivatives, of every design and crank angle.

    Equations (1)-(9) of docs/swivel.md.

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
            if 4.0 * square.real < (r.a * r.a).real:
                at = _near_the_block(r, u, v, n, length, per)
            else:
                at = _far_from_the_block(r, u, v, length, per)
            put_block(out.rod, i, j, at.rod, r.unit)
            put_block(out.point, i, j, mix(1.0, pin, r.length, n), r.unit)
            put_block(out.velocity, i, j, mix(r.length, at.first, -1.0, reach1), r.unit)
            put_block(out.acceleration, i, j, mix(r.length, at.second, -1.0, reach2), r.unit)
            put_block(out.jerk, i, j, mix(r.length, at.third, 1.0, reach1), r.unit)
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
