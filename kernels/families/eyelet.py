"""Thread take-up by an eyelet that turns on a crank or, behind another linkage, on its rocker.

Polukhin 1971, section 7, as worked out in docs/takeup.md; the equation numbers are of that page.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import divisor, unit_near
from kernels.arithmetic.vectors import Vector, cross, dot, norm, scale, sub
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write
from kernels.linkage.thread_path import length, wrap_angle
from kernels.types import Array, Status


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``: guides, crank circle centre + a (cos t, ca sin t, -sa sin t)."""

    a: float
    cos_alpha: float
    sin_alpha: float
    cos_h: float
    sin_h: float
    centre: Vector
    n1: Vector
    n2: Vector
    store: float
    unit: float
    valid: bool


@inline
def reduce_design(designs: Array, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for a radius of 0 or less and for numbers that are not finite."""
    size = abs(designs[i, 0].real) + abs(designs[i, 1].real) + abs(designs[i, 2].real)
    size += abs(designs[i, 4].real) + abs(designs[i, 5].real) + abs(designs[i, 7].real)
    offsets = abs(designs[i, 8].real) + abs(designs[i, 9].real) + abs(designs[i, 10].real) + abs(designs[i, 11].real)
    turned = abs(designs[i, 3].real) + abs(designs[i, 6].real)
    valid = size + offsets < 1e140 and size > 1e-140 and turned < 1e5 and designs[i, 0].real > 1e-140 * size
    unit, per_unit = unit_near(size if valid else 0.5)
    a, e, f = designs[i, 0] * per_unit, designs[i, 1] * per_unit, designs[i, 2] * per_unit
    ca, sa = np.cos(designs[i, 3]), np.sin(designs[i, 3])
    n1 = (e + designs[i, 8] * per_unit, designs[i, 9] * per_unit, designs[i, 4] * per_unit)
    n2 = (e + designs[i, 10] * per_unit, designs[i, 11] * per_unit, designs[i, 5] * per_unit)
    return Reduced(
        a, ca, sa, np.cos(designs[i, 6]), np.sin(designs[i, 6]), (0.0 * f, f * sa, f * ca), n1, n2,
        designs[i, 7] * per_unit, unit, valid,
    )  # fmt: skip


@inline
def on_circle(r: Reduced, c: float, s: float) -> Vector:
    """Vector from the axis to the eyelet for cosine and sine of its crank angle."""
    return r.a * c, r.a * r.cos_alpha * s, -r.a * r.sin_alpha * s


@inline
def eyelet(r: Reduced, u: float, v: float) -> tuple[Vector, Vector, Vector]:
    """Eyelet, its first and second derivative, for u = cos(phi), v = sin(phi); (5)."""
    # the angle phi_h + phi by the addition theorem: cosine and sine of phi_h are taken once per design
    c, s = r.cos_h * u - r.sin_h * v, r.sin_h * u + r.cos_h * v
    x, y, z = on_circle(r, c, s)
    place = (r.centre[0] + x, r.centre[1] + y, r.centre[2] + z)
    return place, on_circle(r, -s, c), (-x, -y, -z)


@inline
def _branch(place: Vector, first: Vector, second: Vector, guide: Vector) -> tuple[float, float]:
    """First and second derivative of the distance of eyelet and guide; (6 a).

    Of the two forms of the second derivative the one with the smaller terms is taken: one loses digits where the guide
    is near the crank's axis, the other where the eyelet is near the guide.
    """
    d = sub(place, guide)
    square, across, along = dot(d, d), cross(d, first), -dot(guide, first)
    per_square = 1.0 / divisor(square)
    inward, turning = dot(d, second), dot(across, across) * per_square
    pull, sliding = -dot(guide, second), along * along * per_square
    bend = inward + turning
    if abs(pull.real) + abs(sliding.real) < abs(inward.real) + abs(turning.real):
        bend = pull - sliding
    per = 1.0 / divisor(np.sqrt(square))
    return along * per, bend * per


# Pose outputs, each (n, m), or None, which is not computed.
Outputs = namedtuple("Outputs", "P dP d2P L wrap X_E Y_E Z_E")


@kernel
def poses(designs: Array, cos_phi: Array, sin_phi: Array, status: Status, out: Outputs) -> None:
    """Thread taken up, its derivatives, wrap angle and place of the eyelet; (1) to (6 a) of docs/takeup.md.

    Parameters
    ----------
    designs : (n, 12) columns as `PARAMETERS` of sweep/families/eyelet.py; complex128 for gradients by the complex step
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, SINGULAR (the eyelet meets a guide) or INVALID_INPUT
    P, dP, d2P : (n, m) out or None; L - P_h and its derivatives with respect to phi [length]
    L, wrap, X_E, Y_E, Z_E : (n, m) out or None; thread length, wrap angle [rad], eyelet

    Notes
    -----
    Measured on the oracle table: errors below 8 * 2^-53 * max(cond, |y|).
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            place, first, second = eyelet(r, cos_phi[row, j], sin_phi[row, j])
            d1, d2 = sub(place, r.n1), sub(place, r.n2)
            # On a guide the direction of a branch is undefined, and so is every derivative.
            near, far = dot(d1, d1).real, dot(d2, d2).real
            code = st.OK if near > 0.0 and far > 0.0 else st.SINGULAR
            if not r.valid or not math.isfinite(near + far):
                code = st.INVALID_INPUT
            status[i, j] = code
            # a factor, not a branch for each output: nan times anything is nan
            good = 1.0 if code == st.OK else math.nan
            write(out.P, i, j, good * (length(place, r.n1, r.n2) - r.store) * r.unit)
            write(out.L, i, j, good * length(place, r.n1, r.n2) * r.unit)
            slope1, bend1 = _branch(place, first, second, r.n1)
            slope2, bend2 = _branch(place, first, second, r.n2)
            write(out.dP, i, j, good * (slope1 + slope2) * r.unit)
            write(out.d2P, i, j, good * (bend1 + bend2) * r.unit)
            write(out.wrap, i, j, good * wrap_angle(place, r.n1, r.n2))
            write(out.X_E, i, j, good * place[0] * r.unit)
            write(out.Y_E, i, j, good * place[1] * r.unit)
            write(out.Z_E, i, j, good * place[2] * r.unit)


@kernel
def weighted_difference(
    designs: Array, cos_phi: Array, sin_phi: Array, wanted: Array, difference: Array, weight: Array, status: Status
) -> None:
    """Compute the weighted difference (27) and its weight; docs/takeup.md (7), (8).

    Parameters
    ----------
    designs : (n, 12) columns as `PARAMETERS` of sweep/families/eyelet.py, guides on the line x = e, y = 0
    cos_phi, sin_phi : (n, m) or (1, m);  wanted : (n, m) or (1, m), wanted P [length]
    difference : (n, m) out, Dq [length^2];  weight : (n, m) out, dDq/dP at the design's own length [length]
    status : (n, m) out, as of :func:`kernels.families.eyelet.poses`; INVALID_INPUT also where P_h + P <= 0 or a
        guide is off the line x = e, y = 0, for which (27) does not hold
    """
    poses(designs, cos_phi, sin_phi, status, Outputs(None, None, None, None, None, None, None, None))
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row, target = i if cos_phi.shape[0] > 1 else 0, i if wanted.shape[0] > 1 else 0
        on_line = designs[i, 8] == 0.0 and designs[i, 9] == 0.0 and designs[i, 10] == 0.0 and designs[i, 11] == 0.0
        for j in range(cos_phi.shape[1]):
            place = eyelet(r, cos_phi[row, j], sin_phi[row, j])[0]
            d1, d2 = sub(place, r.n1), sub(place, r.n2)
            whole = r.store + wanted[target, j] / r.unit
            if status[i, j] == st.OK and not (whole > 0.0 and on_line):
                status[i, j] = st.INVALID_INPUT
            good = 1.0 if status[i, j] == st.OK else math.nan
            r1, r2 = norm(d1), norm(d2)
            # (27) as a product: zero to rounding exactly where the thread has the wanted length.
            # r1^2 - ((r2^2 - r1^2 - L^2)/(2L))^2 = -((L - r1)^2 - r2^2)((L + r1)^2 - r2^2)/(4 L^2)
            first = (whole - r1 - r2) * (whole - r1 + r2)
            second = (whole + r1 - r2) * (whole + r1 + r2)
            difference[i, j] = -good * first * second / (4.0 * whole * whole) * r.unit * r.unit
            weight[i, j] = -good * 2.0 * r1 * r2 / length(place, r.n1, r.n2) * r.unit


@kernel
def length_sensitivities(designs: Array, cos_phi: Array, sin_phi: Array, jacobian: Array, status: Status) -> None:
    """Compute partial derivatives of L with respect to a, e, f, alpha, Z1, Z2, phi_h; docs/takeup.md (9).

    Parameters
    ----------
    designs : (n, 12) columns as `PARAMETERS` of sweep/families/eyelet.py
    cos_phi, sin_phi : (n, m) or (1, m)
    jacobian : (7, n, m) out [1 or length/rad]; nan where the status is not OK
    status : (n, m) out, as of :func:`kernels.families.eyelet.poses`
    """
    poses(designs, cos_phi, sin_phi, status, Outputs(None, None, None, None, None, None, None, None))
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            place, turning, _ = eyelet(r, cos_phi[row, j], sin_phi[row, j])
            d1, d2 = sub(place, r.n1), sub(place, r.n2)
            good = 1.0 if status[i, j] == st.OK else math.nan
            u1, u2 = scale(good / norm(d1), d1), scale(good / norm(d2), d2)
            g = (u1[0] + u2[0], u1[1] + u2[1], u1[2] + u2[2])
            jacobian[0, i, j] = dot(g, sub(place, r.centre)) / r.a
            jacobian[1, i, j] = -g[0]
            jacobian[2, i, j] = g[1] * r.sin_alpha + g[2] * r.cos_alpha
            # Turning by alpha about x: E_alpha = (0, E_z, -E_y); f turns the same way.
            jacobian[3, i, j] = (g[1] * place[2] - g[2] * place[1]) * r.unit
            jacobian[4, i, j] = -u1[2]
            jacobian[5, i, j] = -u2[2]
            jacobian[6, i, j] = dot(g, turning) * r.unit
