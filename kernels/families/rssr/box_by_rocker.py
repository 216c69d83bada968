"""Boxes of crank-rockers on the locus whose rocker is given: its length and its angle at the extended position.

In both limit positions the ball lies in the plane of crank axis and crank (docs/synthesis.md, section 1):

    v1 (e + X1) = u1 (ca Y1 - h),   v2 (e + X2) = u2 (ca Y2 - h),   h = g sa                                         (1)

Solved for e and h the determinant is -sin(phi0), so no place of this locus is singular but phi0 = 180 degrees.
"""

from __future__ import annotations

from kernels.families.rssr.box_turn import INPUTS, Formulas, Linkage, constant_of_closure, formulas, sense, turn, within
from kernels.proof.tape import Tape

SWING, PHI0, PHI1, PSI_EXT, C, F, ALPHA = range(7)


def recorded() -> Formulas:
    """Return the formulas; the limited lengths are crank, e, g, coupler. The angle alpha must not be 0."""
    tape = Tape(INPUTS)
    one = tape.one()
    c, f = tape.input(C), tape.input(F)
    sin_half, cos_half = tape.input(SWING).sine_cosine(of_half=True)
    s0, c0 = tape.input(PHI0).sine_cosine()
    v1, u1 = tape.input(PHI1).sine_cosine()
    sin1, cos1 = tape.input(PSI_EXT).sine_cosine()
    sa, ca = tape.input(ALPHA).sine_cosine()
    u2, v2 = u1 * c0 - v1 * s0, v1 * c0 + u1 * s0
    mid_cos, mid_sin = cos1 * cos_half - sin1 * sin_half, sin1 * cos_half + cos1 * sin_half
    cos2, sin2 = mid_cos * cos_half - mid_sin * sin_half, mid_sin * cos_half + mid_cos * sin_half
    # (1) in units of the rocker
    per_s0 = s0.inverse()
    first, second = ca * (u1 * sin1) - v1 * cos1, ca * (u2 * sin2) - v2 * cos2
    e, h = (second * u1 - first * u2) * per_s0 * c, (first * v2 - second * v1) * per_s0 * c
    x1, y1, x2, y2 = c * cos1, c * sin1, c * cos2, c * sin2
    rho1 = u1 * (e + x1) + v1 * (ca * y1 - h)
    rho2 = -(u2 * (e + x2) + v2 * (ca * y2 - h))
    fs, total = f * sa, rho1 + rho2
    crank = sin_half.times(2.0) * c * (e * mid_sin + fs * mid_cos)
    g = h * sa.inverse()
    acceptance = (
        rho1, rho2, crank,
        sense(tape, total, crank, e, fs, ca, u1, v1, x1, y1), sense(tape, total, crank, e, fs, ca, u2, v2, x2, y2),
    )  # fmt: skip
    limits = [within(tape, 0, crank, total), within(tape, 1, e, one), within(tape, 2, g, one)]
    tape.end()
    a = crank * total.inverse()
    b2 = (rho1 - a).square() + (y1 * sa + g * ca - f).square()
    share = a * c.inverse()
    at = Linkage(one, a, e, fs, a * ca, one, share * h, share * e, b2, u1, v1)
    at = at._replace(k0=constant_of_closure(at, cos1, sin1))
    limits.append(within(tape, 3, b2, one, 2))
    tape.end()
    return formulas(tape, at, turn(tape, at), acceptance, limits, 3)
