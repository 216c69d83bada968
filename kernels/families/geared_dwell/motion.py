"""Motion of the geared dwell drive at given carrier angles, and its largest transfer functions over a grid of them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2
from kernels.arithmetic.max_min import largest, smallest
from kernels.families.geared_dwell.closure import pin, reduce_design, velocity
from kernels.jit import kernel, kernel_fused
from kernels.linkage.outputs import write
from kernels.types import EPS, TWO_PI, Array, Numbers, Status


class Outputs(NamedTuple):
    """Pose outputs, each (n, m), or None: what is None is not computed."""

    psi: Numbers | None
    dpsi: Numbers | None
    d2psi: Numbers | None
    d3psi: Numbers | None
    sin_psi: Numbers | None
    cos_psi: Numbers | None
    x_b: Numbers | None
    y_b: Numbers | None


@kernel
def poses(
    designs: Numbers,
    phi: Numbers,
    cos_phi: Numbers,
    sin_phi: Numbers,
    status: Status,
    out: Outputs,
) -> None:
    """Compute the position, transfer functions and pin coordinates of every design at its carrier angles; (2)-(6).

    Parameters
    ----------
    designs : (n, 2) columns of :class:`Design`; complex128 for gradients by the complex step
    phi, cos_phi, sin_phi : (n, m), or (1, m) shared by all designs; phi only tells the turn, so that psi is continuous
    status : (n, m) out; OK, SINGULAR (on the output axis within the rounding of phi) or INVALID_INPUT
    psi ... y_b : (n, m) out, or None: what is None is neither computed nor compiled

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
    designs : (n, 2) columns of :class:`Design`
    front, back : (2, m) rows t = 1 - cos(phi), sin(phi) of the grid in [0, pi/2], and t = 1 + cos(phi), sin(phi) in
        (pi/2, pi]; the other half of the turn is its mirror image and adds nothing
    status : (n,) out; OK, SINGULAR or INVALID_INPUT
    max_abs_dpsi, max_abs_d2psi, max_abs_d3psi : (n,) out, or None: not computed, not compiled

    Notes
    -----
    D is clamped before the division, so the loop has no branch and vectorises; a design whose pin passes through the
    axis, on the grid or between its points, is nan with status SINGULAR.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        least, m1, m2, m3 = 1e300, 0.0, 0.0, 0.0
        for side in range(2):
            h = r.front if side == 0 else r.back
            grid = front if side == 0 else back
            for j in range(grid.shape[1]):
                t, s = grid[0, j], grid[1, j]
                # The pin as in closure.pin near phi = 0, written out without that one's branch, so that it vectorises.
                ss = s * s
                x, y = h.e - 2.0 * t + 2.0 * h.k * ss, 2.0 * s * (h.below + h.k * t)
                square = x * x + y * y
                least = smallest(least, square)
                # A clamp instead of a branch; ``least`` tells that it was used.
                per = 1.0 / largest(square, 1e-100)
                if max_abs_dpsi is not None:
                    m1 = largest(m1, abs(1.0 - h.total * (h.e - 2.0 * t) * per))
                if max_abs_d2psi is not None or max_abs_d3psi is not None:
                    q = (h.q0 + t * (h.q1 + r.ak4 * t)) * per
                    if max_abs_d2psi is not None:
                        m2 = largest(m2, abs(s * q) * per)
                    if max_abs_d3psi is not None:
                        q_t, d_t = h.q1 + 2.0 * r.ak4 * t, h.d1 - 2.0 * r.ak4 * t
                        bend = (1.0 - t) * q + ss * (q_t - 2.0 * q * d_t) * per
                        m3 = largest(m3, abs(bend) * per)
        code = st.OK
        if not r.valid:
            code = st.INVALID_INPUT
        elif not r.regular or least <= 1e-100:
            code = st.SINGULAR
        status[i] = code
        scale = 2.0 * abs(r.front.total) if code == st.OK else math.nan
        if max_abs_dpsi is not None:
            max_abs_dpsi[i] = m1 if code == st.OK else math.nan
        if max_abs_d2psi is not None:
            max_abs_d2psi[i] = scale * m2
        if max_abs_d3psi is not None:
            max_abs_d3psi[i] = scale * m3
