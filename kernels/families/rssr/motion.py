"""Motion of the spatial crank-rocker at given crank angles: position, transfer functions, joints, pressure angle."""

from __future__ import annotations

import math

import numpy as np

from kernels import status as st
from kernels._jit import kernel
from kernels.complex_step import arctan2, hypotenuse
from kernels.families.rssr.closure import Numbers, Status, discriminant_tolerance, reduce_design


@kernel
def poses(
    designs: Numbers,
    cos_phi: Numbers,
    sin_phi: Numbers,
    status: Status,
    psi: Numbers | None,
    dpsi: Numbers | None,
    d2psi: Numbers | None,
    d3psi: Numbers | None,
    sin_psi: Numbers | None,
    cos_psi: Numbers | None,
    discriminant: Numbers | None,
    pressure_angle: Numbers | None,
    x_b: Numbers | None,
    y_b: Numbers | None,
    z_b: Numbers | None,
    x_c: Numbers | None,
    y_c: Numbers | None,
    z_c: Numbers | None,
) -> None:
    """Position, transfer functions, discriminant, pressure angle and joints of every design at its crank angles.

    Equations (2*), (3)-(5) and (13) of docs/rssr.md; joints in the fixed frame of its section 1.

    Parameters
    ----------
    designs : (n, 8) columns of :class:`Design`; complex128 for gradients by the complex step
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs; complex128 where they depend on the designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR or INVALID_INPUT
    psi ... z_c : (n, m) out, or None: what is None is neither computed nor compiled; complex128 if an input is

    Notes
    -----
    Where the status is not OK the values are nan, except that a dead point keeps its angle (Delta = 0).
    The dead-point band is the rounding error of Delta itself; outside it the sign of Delta is right for the given
    doubles up to the rounding of K.  ``discriminant`` is a length to the fourth power and leaves float64 at scales
    beyond 1e+-77, as inf or 0; the status is decided on Delta in units of the crank.
    Largest error over the 422 oracle rows, hard ones included: 2.1 x 2^-53 x max(cond, |y|); 134 was found by search,
    where the coupler is short.  :mod:`kernels.families.rssr.precise` has neither.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        two_ac = 2.0 * designs[i, 0] * designs[i, 2]
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            hu, hv = r.ca * u, r.ca * v
            x, y, w1 = r.e - u, r.y0 + hv, r.k2 * u - r.k1 * v
            w = r.k0 - w1
            rr = x * x + y * y
            delta = rr - w * w
            tolerance = discriminant_tolerance(r, x, y, w)
            code = st.OK
            if not r.valid or delta.real != delta.real:
                code = st.INVALID_INPUT
            elif delta.real < -tolerance:
                code = st.NOT_ASSEMBLED
            elif delta.real <= tolerance:
                # B on the rocker axis has every angle as a solution; a dead point has one.
                code = st.DEAD_POINT if rr.real > tolerance else st.SINGULAR
            status[i, j] = code

            if discriminant is not None:
                discriminant[i, j] = (delta * two_ac) * two_ac if r.valid else math.nan
            t = np.sqrt(delta) if code == st.OK else 0.0
            has_angle = code == st.OK or code == st.DEAD_POINT
            c = (x * w + y * t) / rr if has_angle else math.nan  # -cos psi
            s = (x * t - y * w) / rr if has_angle else math.nan  # -sin psi of the mirrored mechanism
            if cos_psi is not None:
                cos_psi[i, j] = -c
            sine = 0.0 - r.branch * s  # never -0.0, which would turn the angle pi into -pi
            if sin_psi is not None:
                sin_psi[i, j] = sine
            if psi is not None:
                psi[i, j] = arctan2(sine, -c)
            if pressure_angle is not None:
                # arctangent, not acos: acos loses half the digits near zero.
                across = hypotenuse(r.rocker - w, r.z0 - r.sa * v)
                pressure_angle[i, j] = arctan2(across, t) if has_angle else math.nan
            if x_b is not None:
                x_b[i, j] = designs[i, 0] * u if r.valid else math.nan
            if y_b is not None:
                along, across_axis = designs[i, 4] * r.sa, designs[i, 0] * r.branch * hv
                y_b[i, j] = along + across_axis if r.valid else math.nan
            if z_b is not None:
                lift = designs[i, 4] * (r.branch * r.ca) - designs[i, 0] * (r.sa * v)
                z_b[i, j] = lift if r.valid else math.nan
            if x_c is not None:
                x_c[i, j] = designs[i, 3] - designs[i, 2] * c
            if y_c is not None:
                y_c[i, j] = -r.branch * designs[i, 2] * s
            if z_c is not None:
                z_c[i, j] = designs[i, 5] if has_angle else math.nan
            if dpsi is not None or d2psi is not None or d3psi is not None:
                per_t = 1.0 / t if code == st.OK else math.nan
                w_ph = r.k1 * u + r.k2 * v
                g_ph = w_ph - (v * c - hu * s)
                p = -g_ph * per_t
                if dpsi is not None:
                    dpsi[i, j] = r.branch * p
                if d2psi is not None or d3psi is not None:
                    g_phph = w1 - (u * c + hv * s)
                    g_phps = v * s + hu * c
                    q = -(g_phph + p * (2.0 * g_phps + w * p)) * per_t
                    if d2psi is not None:
                        d2psi[i, j] = r.branch * q
                    if d3psi is not None:
                        g_phphps = u * s - hv * c
                        g_phpsps = w_ph - g_ph
                        jerk = (
                            g_ph - p * (3.0 * g_phphps + p * (3.0 * g_phpsps - t * p)) - 3.0 * q * (g_phps + w * p)
                        ) * per_t
                        d3psi[i, j] = r.branch * jerk
