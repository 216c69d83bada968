"""One design of the five-link brought to its constants, its closure, and designs with the limits of a crank-rocker.

The equation numbers are of docs/five_link.md.

Polukhin 1971, section 5.5, in the forms of docs/five_link.md; the equation numbers are of that page.  Lengths are in
units of the crank and mirrored to the assembly mode +1, as in :mod:`kernels.linkage.crank_closure`, whose numbers it
shares.

In its limit positions the five-link lies in the plane of crank axis and crank, as the crank-rocker does, so that the
same rocker and the same axes serve: only crank and coupler change with h.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import divisor
from kernels.arithmetic.sincos import sincos
from kernels.jit import inline, kernel
from kernels.linkage.crank_closure import Reduced, axial_terms, reduce_scaled, unit_scale
from kernels.types import EPS, Array, Numbers, Status


class Joint(NamedTuple):
    """What the two revolutes in place of the driving ball add to the closure, in units of the crank.

    G5 = X C - Y S + W - shift - share rho(psi) with rho^2 = b^2 - z^2 and z = sweep S + axial, (1).
    """

    coupler: Any  # b
    sweep: Any  # c sin(alpha), mirrored
    axial: Any  # g cos(alpha) - f
    shift: Any  # (h^2 + s2^2)/(2 c)
    share: Any  # h/c
    h: Any
    s2: Any
    plain: bool  # rho does not depend on psi, or does not matter: the closure is that of a crank-rocker
    size: float  # magnitude of the terms this joint adds, for their rounding errors
    mode: int
    valid: bool


class Slope(NamedTuple):
    """G5 and rho with their derivatives with respect to psi."""

    value: Any
    first: Any
    second: Any
    rho: Any
    rho1: Any
    rho2: Any
    z: Any


@inline
def reduce_design(designs: Numbers, i: int) -> tuple[Reduced, Joint]:
    """Constants of one design; ``valid`` is false for zero or negative lengths and for what is not finite."""
    unit = unit_scale(designs[i, 2].real)
    a, b, c = designs[i, 0] * unit, designs[i, 1] * unit, designs[i, 2] * unit
    e, f, g = designs[i, 3] * unit, designs[i, 4] * unit, designs[i, 5] * unit
    alpha, branch, mode = designs[i, 6], designs[i, 9].real, designs[i, 10].real
    r = reduce_scaled(a, b, c, e, f, g, alpha, branch)
    h, s2, per_a, per_c = designs[i, 7] * unit, designs[i, 8] * unit, 1.0 / a, 1.0 / c
    _, ca = sincos(alpha)
    _, _, rise = axial_terms(g, f, alpha, ca)
    sweep, axial, coupler = branch * (r.sa * r.rocker), rise * per_a, r.coupler
    shift, share = 0.5 * (h * h + s2 * s2) * per_c * per_a, h * per_c
    plain = (share == 0.0) | (sweep == 0.0)
    size = abs(shift.real) + abs((share * coupler).real)
    whole = mode == 1.0 or mode == 2.0 or mode == 3.0
    valid = r.valid and whole and size < 1e140 and (s2 * per_a).real == (s2 * per_a).real
    number = 1
    if valid:
        number = int(mode)
    return r, Joint(
        coupler, sweep, axial, shift, share, h * per_a, s2 * per_a, plain, size, number, valid
    )  # fmt: skip


@inline
def axial_reach(joint: Joint, s: Any) -> tuple[Any, Any]:
    """Axial distance z and rho^2 = b^2 - z^2, from the sine of the rocker angle."""
    z = joint.sweep * s + joint.axial
    return z, (joint.coupler - z) * (joint.coupler + z)


@inline
def slope(joint: Joint, x: Any, y: Any, w: Any, c: Any, s: Any) -> Slope:
    """G5, its first two derivatives and rho at the rocker angle of cosine c and sine s, where rho^2 > 0; (1), (2)."""
    z, square = axial_reach(joint, s)
    rho = np.sqrt(square)
    per_rho = 1.0 / divisor(rho)  # 0 at the very end of an arc
    z1, z2 = joint.sweep * c, -joint.sweep * s
    rho1 = -z * z1 * per_rho
    rho2 = -(z1 * z1 + z * z2 + rho1 * rho1) * per_rho
    along = x * c - y * s
    value = along + (w - joint.shift) - joint.share * rho
    first = -(x * s + y * c) - joint.share * rho1
    return Slope(value, first, -along - joint.share * rho2, rho, rho1, rho2, z)


@inline
def residual_size(r: Reduced, joint: Joint, x: Any, y: Any) -> float:
    """Return the rounding error of G5: what its terms are made of, times 8 x 2^-53."""
    terms = abs(x.real) + abs(y.real) + abs(r.e.real) + 2.0 + abs(r.y0.real) + r.w_size + joint.size
    return float(8.0 * EPS * terms)


@kernel
def with_limits_of(
    designs: Array, psi_ext: Array, psi_fold: Array, h: Array, status: Status, a: Array, b: Array
) -> None:
    """Crank and coupler of the five-links with s2 = 0 that have the limit positions of given crank-rockers.

    Parameters
    ----------
    designs : (n, 8) crank-rockers: a, b, c, e, f, g, alpha, branch
    psi_ext, psi_fold : (n,) their rocker angles in the extended and the folded limit position [rad]
    h : (n,) common perpendicular of the two revolutes
    status : (n,) out; OK, INVALID_INPUT, or NOT_ADMISSIBLE where no crank of positive length, or no coupler that
        reaches beyond the second revolute, has these limit positions
    a, b : (n,) out [length]; nan where the status is not OK
    """
    for i in range(designs.shape[0]):
        crank, c, e, f, g, alpha = (
            designs[i, 0],
            designs[i, 2],
            designs[i, 3],
            designs[i, 4],
            designs[i, 5],
            designs[i, 6],
        )
        sa, ca = math.sin(alpha), math.cos(alpha)
        # distance of the ball from the crank axis in both positions, and its height over the crank plane in the first
        y1, y2 = c * math.sin(psi_ext[i]), c * math.sin(psi_fold[i])
        rho1 = math.hypot(c * math.cos(psi_ext[i]) + e, y1 * ca - g * sa)
        rho2 = math.hypot(c * math.cos(psi_fold[i]) + e, y2 * ca - g * sa)
        between = rho1 + rho2 - 2.0 * h[i]
        found = (crank * (rho1 + rho2) - h[i] * (rho1 - rho2)) / between
        across = rho1 - found - h[i]
        admissible = found > 0.0 and across > 0.0 and rho2 + found > h[i]
        status[i] = st.OK if admissible else st.NOT_ADMISSIBLE
        if found - found != 0.0:  # infinite or no number
            status[i] = st.INVALID_INPUT
        a[i] = found if status[i] == st.OK else math.nan
        b[i] = np.hypot(across, y1 * sa + g * ca - f) if status[i] == st.OK else math.nan
