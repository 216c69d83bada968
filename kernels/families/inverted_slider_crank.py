"""Inverted slider-crank: the crank pin slides along a slot of the rocker, which oscillates or turns (Whitworth).

Everything is computed in lengths divided by a power of two near the crank length.  Designs may be complex128 (exact
gradients by the complex step); decisions look at the real part.
"""

from __future__ import annotations

import math
from collections import namedtuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2, divisor, magnitude, unit_near
from kernels.jit import kernel
from kernels.linkage.outputs import put_block, write
from kernels.linkage.verdict import follower_status
from kernels.types import EPS, Numbers, Status

# Pose outputs, each (n, m), and joints (2, n, m); outputs of None are not computed.
Outputs = namedtuple("Outputs", "psi dpsi d2psi d3psi s ds d2s discriminant pressure_angle joints")


@kernel
def poses(designs: Numbers, cos_phi: Numbers, sin_phi: Numbers, status: Status, out: Outputs) -> None:
    """Rocker angle, place of the pin on the rocker and derivatives of every design at its crank angles; (1)-(6).

    Parameters
    ----------
    designs : (n, 4) columns as `PLANAR_PARAMETERS` of sweep/families/slotted.py
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR (the crank pin is on the rocker axis) or INVALID_INPUT
    psi ... pressure_angle : (n, m) out, or None: then it is neither computed nor compiled
    joints : (2, n, m) out, crank pin x y, or None

    Notes
    -----
    Where the status is not OK the values are nan, except that a dead point keeps its position and the discriminant is
    given wherever the crank pin is off the rocker axis.
    """
    for i in range(designs.shape[0]):
        unit, per_unit = unit_near(designs[i, 0])
        a, e, h = designs[i, 0] * per_unit, designs[i, 1] * per_unit, designs[i, 2] * per_unit
        branch = designs[i, 3].real
        valid = 0.0 < a.real < 1e140 and abs(e.real) < 1e140 and abs(h.real) < 1e140 and branch * branch == 1.0
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            x, y = a * u - e, a * v
            square = x * x + y * y
            delta = square - h * h
            # Rounding error of X^2 + Y^2 - h^2: 8 x 2^-53 times the magnitudes of its terms.
            x_size = a.real + abs(e.real)
            tolerance = 8.0 * EPS * (abs(x.real) * x_size + a.real * abs(y.real) + h.real * h.real)
            tolerance += 64.0 * EPS * EPS * x_size * x_size
            # with h = 0 the discriminant is r^2, which vanishes only on the rocker axis: there is no dead point
            code = follower_status(valid, square.real <= tolerance, delta.real, tolerance)
            status[i, j] = code
            root = np.sqrt(delta) if code == st.OK else 0.0 * delta
            assembled = code == st.OK or code == st.DEAD_POINT
            w = branch * root if assembled else math.nan * delta
            per_square = 1.0 / divisor(square)
            c, sine = (x * w + y * h) * per_square, (y * w - x * h) * per_square
            write(out.psi, i, j, arctan2(0.0 + sine, c))  # + 0.0: -0.0 would turn the angle pi into -pi
            write(out.s, i, j, w * unit)
            if out.discriminant is not None:
                known = code != st.INVALID_INPUT and code != st.SINGULAR
                write(out.discriminant, i, j, delta * per_square if known else math.nan * delta)
            # arctangent, not acos: acos loses half the digits near zero.
            write(out.pressure_angle, i, j, arctan2(magnitude(h), root) if assembled else math.nan * delta)
            put_block(out.joints, i, j, (u, v), designs[i, 0])
            # at a dead point (w = 0) the position stands and the derivatives, (4) and (5), do not exist
            per_w = 1.0 / w if code == st.OK else math.nan * w
            # the crank in the rocker's axes, along the slot and across it; written out, as of a short frame the one
            # across is the difference of large terms otherwise
            level, lift = a * (a - e * u) * per_square, a * e * v * per_square
            along, aside = w * level + h * lift, h * level - w * lift
            p = along * per_w
            slide, late = p * h - aside, 1.0 - p
            q = (aside * (2.0 * p - 1.0) - p * p * h) * per_w
            turned = e * x * per_square
            behind = -turned - h * lift * per_w
            if abs(behind.real) < 0.5:  # the rocker nearly turns with the crank: 1 - dpsi by itself, no difference
                apart = h * turned - w * lift
                slide, late = -apart - behind * h, behind
                q = (p * p * apart - late * late * aside) * per_w
            write(out.dpsi, i, j, p)
            write(out.ds, i, j, slide * unit)
            write(out.d2psi, i, j, q)
            write(out.d2s, i, j, (q * h - along * late) * unit)
            if out.d3psi is not None:
                turn = along * late * (2.0 * p - 1.0) - 2.0 * q * slide
                write(out.d3psi, i, j, (turn - q * slide) * per_w)
