"""Link lengths of crank-rockers (RSSR) from the swing and the crank angle between the limit positions.

Equations (1)-(8a) of docs/synthesis.md, in the frame of the family (docs/rssr.md).  Position 1 is the extended one,
position 2 the folded one.  X, Y are the coordinates of the rocker ball measured from the rocker axis, and h = g sin
alpha.  In both positions the ball lies in the plane of crank axis and crank.  These are two linear equations for X1, Y1
once the crank angles phi1 and phi2 = phi1 + phi0 are given.  Differences that vanish with the swing are written with
sin(swing/2), so a swing of 1e-9 rad costs no digit.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels.arithmetic.complex_step import arctan2, divisor
from kernels.arithmetic.sincos import sine_cosine
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write_number
from kernels.synthesis.acceptance import design_status, first_failure
from kernels.types import EPS, TWO_PI, Array, Status

WITHIN = 16.0 * EPS  # of sums of products of sines: what the rounding of right angles may make of 0


class _Requirement(NamedTuple):
    """One row of the requirements with the sines and cosines that the equations need."""

    e: float
    f: float
    g: float
    alpha: float
    h: float
    sa: float
    ca: float
    sin_half: float  # of the swing
    cos_half: float
    sin_swing: float
    versed: float  # 1 - cos(swing)
    sin_phi0: float
    cos_phi0: float
    branch: float
    valid: bool


@inline
def _read(requirements: Array, i: int) -> _Requirement:
    return _requirement(requirements, i, requirements[i, 3], requirements[i, 4], requirements[i, 5])


@inline
def _requirement(requirements: Array, i: int, e: float, f: float, g: float) -> _Requirement:
    swing, phi0, alpha = requirements[i, 0], requirements[i, 1], requirements[i, 6]
    sh, ch = sine_cosine(0.5 * swing)
    s0, c0 = sine_cosine(phi0)
    sa, ca = sine_cosine(alpha)
    valid = 0.0 < abs(swing.real) < TWO_PI and 0.0 < phi0.real < TWO_PI and abs(alpha.real) < 1e5
    valid = valid and abs(requirements[i, 2].real) < 1e5 and abs(e.real) + abs(f.real) + abs(g.real) < 1e150
    branch = -1.0 if swing.real > 0.0 else 1.0  # (3) of docs/synthesis.md and its sign
    return _Requirement(e, f, g, alpha, g * sa, sa, ca, sh, ch, 2.0 * sh * ch, 2.0 * sh * sh, s0, c0, branch, valid)


class _Point(NamedTuple):
    """A point of the locus: the extended ball's x and y, and the ball's projections on the crank at both limits."""

    x: float
    y: float
    ahead: float
    back: float
    exists: bool


@inline
def _point(r: _Requirement, u1: float, v1: float) -> _Point:
    """Solve the two linear equations (1)-(3) in a form without cancellation for small swings."""
    # Differences of both positions are written with sin(swing) and 1 - cos(swing), which vanish with the swing.
    u2, v2 = u1 * r.cos_phi0 - v1 * r.sin_phi0, v1 * r.cos_phi0 + u1 * r.sin_phi0
    ss, q, ca = r.sin_swing, r.versed, r.ca
    along = ca * (1.0 - q) * r.sin_phi0
    det = along - ss * (v1 * v2 + ca * ca * u1 * u2)
    exists = abs(det.real) > WITHIN
    per_det = 1.0 / det if exists else math.nan
    x = (r.e * (ss * v1 * v2 - ca * (r.sin_phi0 + q * v1 * u2)) + r.h * u1 * (ss * v2 - q * ca * u2)) * per_det
    y = (r.h * (r.sin_phi0 - q * u1 * v2 - ss * ca * u1 * u2) - r.e * v1 * (q * v2 + ss * ca * u2)) * per_det
    ahead = (r.h * (ss * v2 - q * ca * u2) - r.e * ca * (q * v2 + ss * ca * u2)) * per_det
    back = (r.h * (ss * v1 + q * ca * u1) + r.e * ca * (q * v1 - ss * ca * u1)) * per_det
    return _Point(x, y, ahead, back, exists)


@inline
def _finish(
    r: _Requirement, p: _Point, u1: float, v1: float, i: int, status: Status, failed: Status, designs: Array
) -> None:
    """Compute crank and coupler by (6), (7), make the tests (i)-(iii), and write the row of the design matrix."""
    x1, y1, ahead, back = p.x, p.y, p.ahead, p.back
    c = np.sqrt(x1 * x1 + y1 * y1)
    x_mid, y_mid = x1 * r.cos_half - y1 * r.sin_half, y1 * r.cos_half + x1 * r.sin_half
    a = 2.0 * r.sin_half * (r.e * y_mid + r.f * r.sa * x_mid) / divisor(ahead - back)
    axial, radial = r.g * r.ca + y1 * r.sa - r.f, ahead - a
    b = np.sqrt(axial * axial + radial * radial)
    # t1, t2 have the sign of dF/dpsi, the assembly mode: c dF/dpsi/(2 c) = -X sin psi - Y cos psi at both limits
    x2, y2 = x_mid * r.cos_half - y_mid * r.sin_half, y_mid * r.cos_half + x_mid * r.sin_half
    u2, v2 = u1 * r.cos_phi0 - v1 * r.sin_phi0, v1 * r.cos_phi0 + u1 * r.sin_phi0
    t1 = -(r.e - a * u1) * y1 - (r.f * r.sa + a * r.ca * v1) * x1
    t2 = -(r.e - a * u2) * y2 - (r.f * r.sa + a * r.ca * v2) * x2
    apart = abs(r.e.real) + abs(r.h.real)  # of the axes: 0 but for rounding where they are in line
    nearest = min(c.real, abs(ahead.real), abs(back.real))  # of the ball to an axis
    exists = p.exists and apart > 8.0 * EPS * abs(r.g.real) and nearest > 8.0 * EPS * apart
    finite = exists and c.real < math.inf and 0.0 < b.real < math.inf
    test = first_failure(finite, ahead.real, back.real, a.real, t1.real, t2.real, r.branch)
    failed[i] = test
    status[i] = design_status(r.valid, test)
    good = r.valid and test == 0
    designs[i, 0] = a if good else math.nan
    designs[i, 1] = b if good else math.nan
    designs[i, 2] = c if good else math.nan
    designs[i, 3], designs[i, 4], designs[i, 5] = r.e, r.f, r.g
    designs[i, 6], designs[i, 7] = r.alpha, r.branch


@kernel
def rssr_on_locus(requirements: Array, status: Status, failed: Status, designs: Array, psi1: Array | None) -> None:
    """Find the crank-rockers whose extended position is at given crank angles, from linear equations.

    Equations (1)-(7) of docs/synthesis.md.

    Parameters
    ----------
    requirements : (n, 7) swing, phi0, phi1 [rad], e, f, g [length], alpha [rad]; swing signed, extended to folded,
        0 < |swing| < 2 pi, 0 < phi0 < 2 pi
    status : (n,) out; OK, NOT_ADMISSIBLE (``failed`` says why) or INVALID_INPUT
    failed : (n,) out, number of the first acceptance test failed, see :mod:`kernels.synthesis.acceptance`
    designs : (n, 8) out, columns a, b, c, e, f, g, alpha, branch; lengths nan where the status is not OK
    psi1 : (n,) out [rad], rocker angle of the extended position in (-pi, pi], or None

    Notes
    -----
    Requirements may be complex128, with designs and psi1 of that type: exact gradients by the complex step.
    Only the tests (i)-(iii) are made here; rotatability and pressure angles are the family's own exact margin.
    """
    for i in range(requirements.shape[0]):
        r = _read(requirements, i)
        v1, u1 = sine_cosine(requirements[i, 2])
        p = _point(r, u1, v1)
        _finish(r, p, u1, v1, i, status, failed, designs)
        write_number(psi1, i, arctan2(p.y, p.x) if status[i] == 0 else math.nan)


@kernel
def rssr_of_size(requirements: Array, status: Status, failed: Status, designs: Array, psi1: Array | None) -> None:
    """Find the crank-rockers of given rocker length; e and g are computed from their ratio.

    The rocker's length is proportional to both at a given ratio, and does not depend on f.

    Equations (1)-(7) of docs/synthesis.md at e = cos(direction), g = sin(direction), then scaled.

    Parameters
    ----------
    requirements : (n, 7) swing, phi0, phi1 [rad], c, f [length], direction = atan2(g, e), alpha [rad]; otherwise as
        :func:`rssr_on_locus`, c > 0
    status, failed, designs, psi1 : as :func:`rssr_on_locus`; e and g are nan too where the status is not OK

    Notes
    -----
    Requirements may be complex128, with designs and psi1 of that type: exact gradients by the complex step.
    """
    for i in range(requirements.shape[0]):
        v1, u1 = sine_cosine(requirements[i, 2])
        g, e = sine_cosine(requirements[i, 5])
        one = _requirement(requirements, i, e, requirements[i, 4], g)
        p = _point(one, u1, v1)
        apart = p.x * p.x + p.y * p.y
        exists = p.exists and apart.real > 0.0
        size = requirements[i, 3] / np.sqrt(apart) if exists else 0.0 * e
        r = _Requirement(
            e * size, one.f, g * size, one.alpha, one.h * size, one.sa, one.ca, one.sin_half, one.cos_half,
            one.sin_swing, one.versed, one.sin_phi0, one.cos_phi0, one.branch, one.valid,
        )  # fmt: skip
        ball = _Point(p.x * size, p.y * size, p.ahead * size, p.back * size, exists)
        _finish(r, ball, u1, v1, i, status, failed, designs)
        if status[i] != 0:
            designs[i, 3], designs[i, 5] = math.nan, math.nan
        write_number(psi1, i, arctan2(ball.y, ball.x) if status[i] == 0 else math.nan)


@kernel
def rssr_points(requirements: Array, points: Array) -> None:
    """Compute points of the locus alone, before links are chosen; they do not depend on f.

    Parameters
    ----------
    requirements : (n, 7) columns of :func:`rssr_on_locus`; f is not used
    points : (n, 4) out [length]: X1, Y1 of the rocker ball about the rocker axis at the extended position, and its
        distances from the crank axis at the extended and at the folded position, negative where the side condition
        fails; all nan where the requirement is invalid or the point lies at infinity
    """
    for i in range(requirements.shape[0]):
        r = _read(requirements, i)
        v1, u1 = sine_cosine(requirements[i, 2])
        p = _point(r, u1, v1)
        points[i, 0] = p.x if r.valid else math.nan
        points[i, 1] = p.y if r.valid else math.nan
        points[i, 2] = p.ahead if r.valid else math.nan
        points[i, 3] = -p.back if r.valid else math.nan


@kernel
def rssr_at_direction(
    requirements: Array, root: Array, status: Status, failed: Status, designs: Array, phi1: Array | None
) -> None:
    """Find the crank-rockers whose extended position is at given rocker angles, by a quadratic for the rocker length.

    Equations (5)-(8a) of docs/synthesis.md.

    Parameters
    ----------
    requirements : (n, 7) swing, phi0, psi1 [rad], e, f, g [length], alpha [rad], otherwise as :func:`rssr_on_locus`
    root : (n,) +1 for the root of larger, -1 for the one of smaller magnitude
    status, failed, designs : as :func:`rssr_on_locus`
    phi1 : (n,) out [rad], crank angle of the extended position in (-pi, pi], or None

    Notes
    -----
    Measured: the errors of a, b, c and phi1 over the RSSR rows of the oracle table are in docs/synthesis.md.
    """
    for i in range(requirements.shape[0]):
        r = _read(requirements, i)
        s1, c1 = sine_cosine(requirements[i, 2])
        cm, sm = c1 * r.cos_half - s1 * r.sin_half, s1 * r.cos_half + c1 * r.sin_half
        c2, s2 = cm * r.cos_half - sm * r.sin_half, sm * r.cos_half + cm * r.sin_half
        ca, s0, c0 = r.ca, r.sin_phi0, r.cos_phi0
        p2 = ca * r.sin_swing * c0 - (c1 * c2 + ca * ca * s1 * s2) * s0
        turn = 2.0 * r.sin_half * (r.e * ca * cm - r.h * sm) * c0
        p1 = turn - 2.0 * r.cos_half * (r.e * cm - r.h * ca * sm) * s0
        p0 = -(r.e * r.e + r.h * r.h) * s0
        # (8a): A cos(2 phi1 + phi0) - B sin(2 phi1 + phi0) = D, and p1^2 - 4 p2 p0 = 4 (A^2 + B^2 - D^2)
        big_a, big_b = r.sin_half * (r.e * sm - ca * r.h * cm), r.sin_half * (ca * r.e * cm + r.h * sm)
        big_d = r.sin_half * c0 * (r.e * sm + ca * r.h * cm) - s0 * r.cos_half * (ca * r.e * sm + r.h * cm)
        reach = math.sqrt(big_a * big_a + big_b * big_b)
        inner = (reach - big_d) * (reach + big_d)
        far = math.copysign(math.sqrt(max(inner, 0.0)), p1)
        large = -(0.5 * p1 + far)
        c = large / p2 if root[i] > 0.0 else p0 / large
        x1, y1 = c * c1, c * s1
        qx1, qy1, qx2, qy2 = x1 + r.e, ca * y1 - r.h, c * c2 + r.e, ca * (c * s2) - r.h
        rho1, rho2 = math.sqrt(qx1 * qx1 + qy1 * qy1), math.sqrt(qx2 * qx2 + qy2 * qy2)
        u1, v1 = qx1 / rho1, qy1 / rho1
        if rho1 < 0.5 * (abs(r.e) + abs(r.h)):
            # Near the crank axis the ball's direction has few digits. There (8a) gives phi1 up to half a turn,
            # and the ball decides about that.
            apart = -root[i] * far
            twice = math.atan2(big_a * apart - big_b * big_d, big_a * big_d + big_b * apart)
            sine, cosine = sine_cosine(0.5 * (twice - requirements[i, 1]))
            way = math.copysign(1.0, u1 * cosine + v1 * sine)
            u1, v1 = way * cosine, way * sine
        side = (qx1 * qx2 + qy1 * qy2) * c0 + (qx1 * qy2 - qy1 * qx2) * s0
        exists = abs(p2 if root[i] > 0.0 else s0) > WITHIN  # else at infinity, or on the rocker axis
        point = exists and inner >= 0.0 and c > 0.0 and rho1 > 0.0
        back = -rho2 if side < 0.0 else rho2
        _finish(r, _Point(x1, y1, rho1, back, point), u1, v1, i, status, failed, designs)
        write_number(phi1, i, math.atan2(v1, u1) if status[i] == 0 else math.nan)
