"""Motion of the spatial crank-rocker for exactly the given doubles: the closure in twice the working precision.

In plain arithmetic (:mod:`kernels.families.rssr.motion`) the discriminant of a short coupler, and the constant of a
long one, are small differences of large numbers: their rounding error exceeds that of rounding the inputs once.  Here
everything between the given numbers and the results is a pair of numbers (:mod:`kernels.arithmetic.double_double`).
"""

from __future__ import annotations

import math
from collections import namedtuple

import numpy as np

from kernels import status as st
from kernels.arithmetic import double_double as two
from kernels.arithmetic.double_double import Twofold
from kernels.families.rssr.motion import Outputs
from kernels.jit import inline, kernel
from kernels.linkage.crank_closure import reduce_scaled, unit_scale
from kernels.linkage.outputs import write
from kernels.linkage.verdict import pose_status
from kernels.types import EPS, Array, Status

# Columns of the constants: high and low parts in units of the crank, mirrored to branch +1; then plain numbers.
E, Y0, CA, K0, K1, K2, RHO, Z0, SA = range(0, 18, 2)
MX, MY, MW, VALID, BRANCH = range(18, 23)
PRECISE_COLUMNS = 23
BAND = 4.0 * EPS  # effect of rounding the given numbers on Delta: a dead point rounded to float64 is still one
_ROW = 64  # designs side by side; the constant stride lets the loop over them become vector code


@inline
def _put(at: Array, column: int, k: int, x: Twofold) -> None:
    at[column * _ROW + k], at[(column + 1) * _ROW + k] = x


@inline
def _reduce(at: Array, k: int) -> None:
    """Compute the constants of one design of the block in place of its parameters, which are the first eight rows."""
    a, b, c, e = at[k], at[_ROW + k], at[2 * _ROW + k], at[3 * _ROW + k]
    f, g, alpha, branch = at[4 * _ROW + k], at[5 * _ROW + k], at[6 * _ROW + k], at[7 * _ROW + k]
    r = reduce_scaled(a, b, c, e, f, g, alpha, branch)
    at[MX * _ROW + k], at[MY * _ROW + k], at[MW * _ROW + k] = abs(r.e) + 1.0, abs(r.y0) + 1.0, r.w_size
    at[VALID * _ROW + k], at[BRANCH * _ROW + k] = 1.0 if r.valid else 0.0, branch
    sa, ca = two.sine_cosine(alpha)
    one = (1.0, 0.0)
    per_a, per_c = two.divide(one, (a, 0.0), 1.0 / a), two.divide(one, (c, 0.0), 1.0 / c)
    # f^2 + g^2 - 2 f g cos(alpha) without cancellation near alpha = 0, pi (K*): 1 - cos = sin^2/(1 + cos)
    sign = 1.0 if ca[0] >= 0.0 else -1.0
    gap = two.two_sum(f, -sign * g)
    whole = two.add(one, (sign * ca[0], sign * ca[1]))
    far = two.divide(two.multiply(sa, sa), whole, 1.0 / whole[0])
    far = two.multiply(two.two_product(2.0 * sign * f, g), far)
    square = two.multiply(two.two_sum(c, -b), two.two_sum(c, b))
    square = two.add(square, two.add(two.two_product(a, a), two.two_product(e, e)))
    square = two.add(square, two.add(two.multiply(gap, gap), far))
    _put(at, E, k, two.scale(per_a, e))
    _put(at, Y0, k, two.multiply(two.scale(sa, branch * f), per_a))
    _put(at, CA, k, (branch * ca[0], branch * ca[1]))
    _put(at, K0, k, two.multiply(two.multiply(square, (0.5 * per_c[0], 0.5 * per_c[1])), per_a))
    _put(at, K1, k, two.multiply(two.scale(sa, g), per_c))
    _put(at, K2, k, two.scale(per_c, e))
    _put(at, RHO, k, two.scale(per_a, c))
    _put(at, Z0, k, two.multiply(two.add(two.scale(ca, f), (-g, 0.0)), per_a))
    _put(at, SA, k, sa)


@kernel
def precise_constants(designs: Array, out: Array) -> None:
    """Compute the numbers of :class:`kernels.linkage.crank_closure.Reduced` in twice the working precision.

    Parameters
    ----------
    designs : (n, 8) columns as `PARAMETERS` of sweep/families/rssr.py
    out : (n, PRECISE_COLUMNS) out
    """
    at = np.empty(PRECISE_COLUMNS * _ROW)
    for start in range(0, designs.shape[0], _ROW):
        count = min(_ROW, designs.shape[0] - start)
        for k in range(count):
            unit = unit_scale(designs[start + k, 2])
            for column in range(8):
                at[column * _ROW + k] = designs[start + k, column] * (unit if column < 6 else 1.0)
        for k in range(count):
            _reduce(at, k)
        for k in range(count):
            for column in range(PRECISE_COLUMNS):
                out[start + k, column] = at[column * _ROW + k]


@inline
def _get(constants: Array, row: int, i: int) -> Twofold:
    return constants[i, row], constants[i, row + 1]


@kernel
def precise_poses(
    constants: Array, designs: Array, cos_phi: Array, sin_phi: Array, status: Status, out: Outputs
) -> None:
    """Poses as of the module ``motion``, correct to a few roundings, for float64 designs only.

    Parameters
    ----------
    constants : (n, PRECISE_COLUMNS) by :func:`precise_constants`
    designs : (n, 8) columns as `PARAMETERS` of sweep/families/rssr.py
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out, as of ``poses``; the band of dead points is half as wide as in plain arithmetic
    psi ... z_c : as of :func:`kernels.families.rssr.motion.poses`

    Notes
    -----
    (cos phi, sin phi) give the direction of the crank, its length is the crank's.  The derivatives follow from
    d . d = b^2: with d' = p k' - B' and so on, d . d' = 0, d . d'' = -d' . d', d . d''' = -3 d' . d'', where no term is
    much larger than what it belongs to.
    """
    for i in range(designs.shape[0]):
        row = i if cos_phi.shape[0] > 1 else 0
        e, y0, ca = _get(constants, E, i), _get(constants, Y0, i), _get(constants, CA, i)
        k0, k1, k2 = _get(constants, K0, i), _get(constants, K1, i), _get(constants, K2, i)
        rho, z0, sa = _get(constants, RHO, i), _get(constants, Z0, i), _get(constants, SA, i)
        mx, my, mw = constants[i, MX], constants[i, MY], constants[i, MW]
        valid, branch = constants[i, VALID] != 0.0, constants[i, BRANCH]
        two_ac = 2.0 * designs[i, 0] * designs[i, 2]
        for j in range(cos_phi.shape[1]):
            u, v = two.unit_vector(cos_phi[row, j], sin_phi[row, j])
            x = two.subtract(e, u)
            y = two.add(y0, two.multiply(ca, v))
            w = two.add(k0, two.subtract(two.multiply(k1, v), two.multiply(k2, u)))
            rr = two.add(two.multiply(x, x), two.multiply(y, y))
            delta = two.subtract(rr, two.multiply(w, w))
            tolerance = BAND * (abs(x[0]) * mx + abs(y[0]) * my + abs(w[0]) * mw)
            tolerance += BAND * BAND * (mx * mx + my * my + mw * mw)
            code = pose_status(valid, delta[0], tolerance, rr[0])
            status[i, j] = code
            write(out.discriminant, i, j, (delta[0] * two_ac) * two_ac if valid else math.nan)
            has_angle = code == st.OK or code == st.DEAD_POINT
            per_rr = 1.0 / rr[0] if has_angle else math.nan
            t = two.root(delta) if code == st.OK else (0.0, 0.0)
            # minus cosine and minus sine of the mirrored rocker angle
            c = two.divide(two.add(two.multiply(x, w), two.multiply(y, t)), rr, per_rr)
            s = two.divide(two.subtract(two.multiply(x, t), two.multiply(y, w)), rr, per_rr)
            write(out.cos_psi, i, j, -c[0])
            sine = 0.0 - branch * s[0]  # never -0.0, which would turn the angle pi into -pi
            write(out.sin_psi, i, j, sine)
            write(out.psi, i, j, math.atan2(sine, -c[0]))
            z = two.subtract(z0, two.multiply(sa, v))
            write(out.x_b, i, j, designs[i, 0] * u[0] if valid else math.nan)
            write(out.y_b, i, j, branch * designs[i, 0] * y[0] if valid else math.nan)
            write(out.z_b, i, j, designs[i, 0] * z[0] + designs[i, 5] if valid else math.nan)
            write(out.x_c, i, j, designs[i, 3] - designs[i, 2] * c[0])
            write(out.y_c, i, j, -designs[i, 2] * (branch * s[0]))
            write(out.z_c, i, j, designs[i, 5] if has_angle else math.nan)
            if out.pressure_angle is not None:
                inward = two.subtract(rho, w)[0]
                across = math.sqrt(inward * inward + z[0] * z[0])  # of hypot the loop would not become vector code
                write(out.pressure_angle, i, j, math.atan2(across, t[0]) if has_angle else math.nan)
            if out.dpsi is not None or out.d2psi is not None or out.d3psi is not None:
                # d from the crank pin to the ball; dy and dz (which is z) are negative
                dx, dy = two.subtract(x, two.multiply(rho, c)), two.add(y, two.multiply(rho, s))
                at = Pose(u, v, ca, sa, rho, w, c, s, dx, dy, z, two.multiply(rho, t))
                _put_derivatives(out, i, j, at, code == st.OK, branch)


# One pose as a vector d from the crank pin to the rocker ball, all in units of the crank.
# ``u``: cosine and sine of the crank angle; ``rho``: length of the rocker; ``w``: of the closure; ``c``: minus cosine
# and minus sine of the mirrored rocker angle; ``dy``: negative; ``z``: negative; ``rise``: rho T: half the derivative
# of d . d by the rocker angle.
Pose = namedtuple("Pose", "u v ca sa rho w c s dx dy z rise")


@inline
def _put_derivatives(out: Outputs, i: int, j: int, at: Pose, regular: bool, branch: float) -> None:
    """Write the wanted transfer functions up to the highest of them.

    With B' = (-v, hu, -su), B'' = (-u, -hv, sv), k = -(c, s) and k' = (s, -c) of the mirrored mechanism.
    """
    u, v, c, s, z, rise = at.u, at.v, at.c, at.s, at.z, at.rise
    hu, su = two.multiply(at.ca, u), two.multiply(at.sa, u)
    per_rise = 1.0 / rise[0] if regular else math.nan
    p = two.subtract(two.multiply(z, su), two.add(two.multiply(at.dy, hu), two.multiply(at.dx, v)))
    p = two.divide(p, rise, per_rise)
    write(out.dpsi, i, j, branch * p[0])
    if out.d2psi is not None or out.d3psi is not None:
        hv, sv = two.multiply(at.ca, v), two.multiply(at.sa, v)
        inward, turn = two.subtract(at.rho, at.w), two.multiply(p, at.rho)
        centre = two.multiply(p, turn)
        d1x, d1y = two.add(two.multiply(turn, s), v), two.add(two.multiply(turn, c), hu)  # d1y negative
        square = two.add(two.add(two.multiply(d1x, d1x), two.multiply(d1y, d1y)), two.multiply(su, su))
        along = two.subtract(two.multiply(at.dx, u), two.multiply(centre, inward))
        along = two.add(along, two.subtract(two.multiply(z, sv), two.multiply(at.dy, hv)))
        q = two.divide(two.add(square, along), rise, per_rise)  # negative
        write(out.d2psi, i, j, -branch * q[0])
        if out.d3psi is not None:
            swing = two.multiply(q, at.rho)
            d2x = two.subtract(two.add(two.multiply(centre, c), u), two.multiply(swing, s))
            d2y = two.add(two.add(two.multiply(centre, s), two.multiply(swing, c)), hv)
            both = two.subtract(two.multiply(d1x, d2x), two.multiply(d1y, d2y))
            both = two.subtract(both, two.multiply(su, sv))
            both = two.add(both, two.multiply(two.multiply(turn, q), inward))
            cube = two.multiply(p, two.add(two.multiply(p, p), (-1.0, 0.0)))
            both = two.divide(both, rise, per_rise)
            write(out.d3psi, i, j, branch * two.subtract(cube, two.scale(both, 3.0))[0])
