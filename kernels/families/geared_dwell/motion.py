"""Motion of the geared dwell drive at given carrier angles: position, transfer functions, pin."""

from __future__ import annotations

import math

import numpy as np

from kernels import status as st
from kernels._jit import kernel
from kernels.complex_step import arctan2
from kernels.families.geared_dwell.closure import EPS, Numbers, Status, pin, reduce_design, velocity

TWO_PI = 2.0 * math.pi


@kernel
def poses(
    designs: Numbers,
    phi: Numbers,
    cos_phi: Numbers,
    sin_phi: Numbers,
    status: Status,
    psi: Numbers | None,
    dpsi: Numbers | None,
    d2psi: Numbers | None,
    d3psi: Numbers | None,
    sin_psi: Numbers | None,
    cos_psi: Numbers | None,
    x_b: Numbers | None,
    y_b: Numbers | None,
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

            if x_b is not None:
                x_b[i, j] = h.sign * x
            if y_b is not None:
                y_b[i, j] = h.sign * y
            if psi is not None:
                angle = arctan2(h.sign * y, h.sign * x)
                turn = r.psi0 + r.turns * phi[row, j].real - angle.real
                psi[i, j] = angle + TWO_PI * np.rint(turn / TWO_PI)
            if sin_psi is not None or cos_psi is not None:
                distance = np.sqrt(square)
                if sin_psi is not None:
                    sin_psi[i, j] = h.sign * y / distance
                if cos_psi is not None:
                    cos_psi[i, j] = h.sign * x / distance
            if dpsi is not None:
                dpsi[i, j] = velocity(h, r.ak4, t, square)
            if d2psi is not None or d3psi is not None:
                q = h.q0 + t * (h.q1 + r.ak4 * t)
                if d2psi is not None:
                    d2psi[i, j] = 2.0 * h.total * s / square * (q / square)
                if d3psi is not None:
                    q_t, d_t = h.q1 + 2.0 * r.ak4 * t, h.d1 - 2.0 * r.ak4 * t
                    bend = c * q + s * s * (q_t - 2.0 * q * (d_t / square))
                    d3psi[i, j] = 2.0 * h.total * bend / (square * square)
