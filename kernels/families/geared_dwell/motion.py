"""Motion of the geared dwell drive at given carrier angles, (1)-(4), and its largest transfer functions over a grid."""

from __future__ import annotations

import math
from collections import namedtuple
from typing import NamedTuple, TypeAlias

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2, magnitude
from kernels.arithmetic.intrinsics import largest, smallest
from kernels.jit import inline, inline_fused, kernel, kernel_fused
from kernels.linkage.outputs import write, write_number
from kernels.types import EPS, TWO_PI, Array, Numbers, Status

TOO_NEAR = 1e-50  # a pin that passes the axis nearer than this has derivatives outside float64
Most: TypeAlias = tuple[float, float, float, float]
FLOOR = 1e-150  # least squared distance on a grid, whose square float64 still holds


class Half(NamedTuple):
    """Constants of the half turn around phi = 0 (sign +1) or pi (sign -1, with -k and -a) in t = 1 -+ cos(phi)."""

    sign: float
    k: float
    below: float  # 1 - k
    total: float  # a + k
    e: float  # a - k + 2, the pin's coordinate x at t = 0
    v0: float  # psi' D = v0 + v1 t - ak4 t^2
    v1: float
    q0: float  # Q = q0 + q1 t + ak4 t^2
    q1: float
    d1: float  # D = e^2 + d1 t - ak4 t^2


class Reduced(NamedTuple):
    """Constants of both halves of the turn, 4 a k, output turns per carrier turn, and the output angle at phi = 0."""

    front: Half
    back: Half
    ak4: float
    turns: float
    psi0: float
    regular: bool  # the pin never passes through the output axis
    valid: bool


@inline
def reduce_half(sign: float, k: float, a: float, ak4: float) -> Half:
    """Constants of one half turn."""
    below = 1.0 - k
    rough = a - k
    back = rough - a
    e = (rough + 2.0) + ((a - (rough - back)) - (k + back))  # with the rounding error of a - k, so exact near e = 0
    if magnitude(e).real < 0.5:
        # The same three numbers with a = k - 2 + e inserted: no cancellation near k = 1, a = -1.
        v1 = (4.0 * k - 2.0) * (k - 1.0) + (4.0 * k - 1.0) * e
        q = 4.0 * (k - 1.0) * (k - 1.0) + (4.0 * k - 1.0) * e
        d1 = 2.0 * (k - 1.0) * (k - 1.0) + (2.0 * k - 1.0) * e
    else:
        v1 = ak4 - a + 3.0 * k
        q = ak4 - a + k + 2.0
        d1 = 0.5 * ak4 + k - a
    return Half(sign, k, below, a + k, e, 2.0 * below * e, 2.0 * v1, e * q, -ak4 * e, 4.0 * d1)


@inline
def reduce_design(designs: Numbers, i: int) -> Reduced:
    """Constants of one design; ``valid`` is false for k <= 0 and for numbers that are not finite or above 1e30."""
    k, a = designs[i, 0], designs[i, 1]
    ak4 = 4.0 * (a * k)
    front, back = reduce_half(1.0, k, a, ak4), reduce_half(-1.0, -k, -a, ak4)
    e0, e1, total = front.e.real, back.e.real, front.total.real
    if e0 >= 0.0 and e1 >= 0.0:
        turns, psi0 = 1.0, 0.0
    elif e1 < 0.0:
        turns, psi0 = 0.0, 0.0
    elif k.real > 1.0 and total > 0.0:
        turns, psi0 = 2.0, math.pi
    elif k.real > 1.0 and total == 0.0:
        turns, psi0 = (
            1.0,
            0.5 * math.pi,
        )  # psi = phi + pi while the pin is on the far side, phi outside: both within pi/2
    else:
        turns, psi0 = 0.0, math.pi
    regular = abs(e0) > TOO_NEAR and abs(e1) > TOO_NEAR and not (total == 0.0 and k.real >= 1.0)
    valid = k.real > 0.0 and k.real < 1e30 and abs(a.real) < 1e30
    return Reduced(front, back, ak4, turns, psi0, regular, valid)


@inline
def pin(h: Half, t: float, s: float) -> tuple[float, float, float]:
    """Pin coordinates in the half's own frame, and the rounding error of the two together."""
    m = h.below + h.k * t
    y = 2.0 * (s * m)
    c = 1.0 - t
    if t.real < 0.5:
        x = h.e - 2.0 * t + 2.0 * h.k * (s * s)
        x_size = abs(h.e.real) + 2.0 * t.real + 2.0 * abs(h.k.real) * (s.real * s.real)
    else:
        x = h.total + 2.0 * (c * m)
        x_size = abs(h.total.real) + 2.0 * abs(c.real) * (abs(h.below.real) + abs(h.k.real) * t.real)
    y_size = 2.0 * abs(s.real) * (abs(h.below.real) + abs(h.k.real) * t.real)
    return x, y, 4.0 * EPS * (x_size + y_size)


@inline
def velocity(h: Half, ak4: float, t: float, square: float) -> float:
    """Velocity analogue from the squared distance D of the pin, (4), in the form that does not cancel at this place."""
    ratio = h.total * (h.e - 2.0 * t) / square
    if abs(ratio.real - 1.0) > 0.5:
        return 1.0 - ratio
    return (h.v0 + t * (h.v1 - ak4 * t)) / square


# Pose outputs, each (n, m), or None, which is not computed.
Outputs = namedtuple("Outputs", "psi dpsi d2psi d3psi sin_psi cos_psi x_b y_b")


@kernel
def poses(designs: Numbers, phi: Numbers, cos_phi: Numbers, sin_phi: Numbers, status: Status, out: Outputs) -> None:
    """Compute the position, transfer functions and pin coordinates of every design at its carrier angles; (2)-(6).

    Parameters
    ----------
    designs : (n, 2) columns as `PARAMETERS` of sweep/families/geared_dwell.py; complex128 for gradients by
        the complex step
    phi, cos_phi, sin_phi : (n, m), or (1, m) shared by all designs; phi only tells the turn, so that psi is continuous
    status : (n, m) out; OK, SINGULAR (on the output axis within the rounding of phi) or INVALID_INPUT
    psi ... y_b : (n, m) out, or None: then it is neither computed nor compiled

    Notes
    -----
    psi is continuous in phi with psi(0) = 0 where the pin starts at x > 0 (a > k - 2) and pi otherwise, for every
    number of output turns.  Where the status is not OK the values are nan.  Near a = -k at cos(phi) = 1/k the angle phi
    itself does not fix the pin better than its distance from the axis allows: relative error EPS k / |z|.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            h = r.front if u.real > 0.0 else r.back
            s, c = h.sign * v, h.sign * u
            t = v * v / (1.0 + c)  # 1 - c without its cancellation
            x, y, tolerance = pin(h, t, s)
            square = x * x + y * y
            code = st.OK
            if not r.valid or square.real != square.real:
                code = st.INVALID_INPUT
            else:
                # one rounding of phi moves the pin by as much again
                tolerance += 4.0 * EPS * abs(phi[row, j].real) * 2.0 * (1.0 + abs(h.k.real))
                code = st.SINGULAR if square.real <= tolerance * tolerance else st.OK
            status[i, j] = code
            if code != st.OK:
                square = square * math.nan  # every output below is a quotient by it, or is made nan like x and y
                x, y = x * math.nan, y * math.nan

            write(out.x_b, i, j, h.sign * x)
            write(out.y_b, i, j, h.sign * y)
            if out.psi is not None:
                angle = arctan2(h.sign * y, h.sign * x)
                turn = r.psi0 + r.turns * phi[row, j].real - angle.real
                write(out.psi, i, j, angle + TWO_PI * np.rint(turn / TWO_PI))
            if out.sin_psi is not None or out.cos_psi is not None:
                distance = np.sqrt(square)
                write(out.sin_psi, i, j, h.sign * y / distance)
                write(out.cos_psi, i, j, h.sign * x / distance)
            write(out.dpsi, i, j, velocity(h, r.ak4, t, square))
            if out.d2psi is not None or out.d3psi is not None:
                q = h.q0 + t * (h.q1 + r.ak4 * t)
                write(out.d2psi, i, j, 2.0 * h.total * s / square * (q / square))
                if out.d3psi is not None:
                    q_t, d_t = h.q1 + 2.0 * r.ak4 * t, h.d1 - 2.0 * r.ak4 * t
                    bend = c * q + s * s * (q_t - 2.0 * q * (d_t / square))
                    write(out.d3psi, i, j, 2.0 * h.total * bend / (square * square))


@inline_fused
def _reduced(
    h: Half, ak4: float, polynomial: bool, grid: Array, j: int, wanted: tuple[Array | None, ...], most: Most
) -> Most:
    """Update the least D and the wanted largest derivatives by one place of the grid."""
    dpsi, d2psi, d3psi = wanted
    least, m1, m2, m3 = most
    t, s, ss = grid[0, j], grid[1, j], grid[2, j]
    if polynomial:
        square = (h.e * h.e + FLOOR) + t * (h.d1 - ak4 * t)
    else:
        # As in `pin` near phi = 0, without the branch.
        twice = 2.0 * h.k
        x, y = h.e - (t + t) + twice * ss, s * (2.0 * h.below + twice * t)
        square = (x * x + FLOOR) + y * y
        least = smallest(least, square)
    per = 1.0 / square
    if dpsi is not None:
        m1 = largest(m1, abs(1.0 - h.total * (h.e - 2.0 * t) * per))
    if d2psi is not None or d3psi is not None:
        q = h.q0 + t * (h.q1 + ak4 * t)
        if d2psi is not None:
            # One division, not three products with a reciprocal: mostly this is asked for alone.
            m2 = largest(m2, abs(s * q) / (square * square))
        if d3psi is not None:
            q_t, d_t = h.q1 + 2.0 * ak4 * t, h.d1 - 2.0 * ak4 * t
            q = q * per
            bend = (1.0 - t) * q + ss * (q_t - 2.0 * q * d_t) * per
            m3 = largest(m3, abs(bend) * per)
    return least, m1, m2, m3


@kernel_fused
def dense_maxima(
    designs: Array,
    front: Array,
    back: Array,
    status: Status,
    max_abs_dpsi: Array | None,
    max_abs_d2psi: Array | None,
    max_abs_d3psi: Array | None,
) -> None:
    """Compute the largest |psi'|, |psi''|, |psi'''| over a grid of carrier angles; the sweep's hot loop.

    Parameters
    ----------
    designs : (n, 2) columns as `PARAMETERS` of sweep/families/geared_dwell.py
    front, back : (3, m) rows t = 1 - cos(phi), sin(phi) and its square of the grid in [0, pi/2], and so with
        t = 1 + cos(phi) in (pi/2, pi]; the other half of the turn is its mirror image and adds nothing
    status : (n,) out; OK, SINGULAR or INVALID_INPUT
    max_abs_dpsi, max_abs_d2psi, max_abs_d3psi : (n,) out, or None: not computed, not compiled

    Notes
    -----
    D has a floor before the division, so the loops have no branch and vectorise; a design whose pin passes through the
    axis, on the grid or between its points, is nan with status SINGULAR.

    For a >= 0 D is taken from its polynomial, which takes half the work of the pin's coordinates and loses no digits
    there: D = (1 - t) e^2 + t (4 + (a + k)^2) + 4 a k t (1 - t) is a sum of what is not negative.  It vanishes at the
    ends alone, so nothing has to be looked for in between.
    """
    wanted = max_abs_dpsi, max_abs_d2psi, max_abs_d3psi
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        most = (1e300, 0.0, 0.0, 0.0)
        # A loop to each case and half: where one loop chooses, it is compiled with all constants of both.
        if r.ak4 >= 0.0:
            for j in range(front.shape[1]):
                most = _reduced(r.front, r.ak4, True, front, j, wanted, most)
            for j in range(back.shape[1]):
                most = _reduced(r.back, r.ak4, True, back, j, wanted, most)
        else:
            for j in range(front.shape[1]):
                most = _reduced(r.front, r.ak4, False, front, j, wanted, most)
            for j in range(back.shape[1]):
                most = _reduced(r.back, r.ak4, False, back, j, wanted, most)
        least, m1, m2, m3 = most
        code = st.OK
        if not r.valid:
            code = st.INVALID_INPUT
        elif not r.regular or least <= TOO_NEAR**2:
            code = st.SINGULAR
        status[i] = code
        scale = 2.0 * abs(r.front.total) if code == st.OK else math.nan
        write_number(max_abs_dpsi, i, m1 if code == st.OK else math.nan)
        write_number(max_abs_d2psi, i, scale * m2)
        write_number(max_abs_d3psi, i, scale * m3)
