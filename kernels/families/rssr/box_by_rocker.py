"""Boxes of crank-rockers on the locus whose rocker is given: its length and its angle at the extended position.

In both limit positions the ball lies in the plane of crank axis and crank (docs/synthesis.md, section 1), at the
distances rho1 on the crank's side and rho2 on the other:

    e + X1 =  rho1 u1,   ca Y1 - h =  rho1 v1,   e + X2 = -rho2 u2,   ca Y2 - h = -rho2 v2,   h = g sa               (1)

The differences of these equations hold rho1 and rho2 alone, their sums e and h.  With the middle m of the rocker's and
p of the crank's limit angles, and k = 2 c sin(swing/2)/sin(phi0),

    rho1 = k (sin(m) v2 + ca cos(m) u2),   rho2 = -k (sin(m) v1 + ca cos(m) u1)                                      (2)
    e = k/2 (sin(m) sin(2p) + ca cos(m) (cos(2p) + cos(phi0))) - c cos(swing/2) cos(m)                               (3)
    h = k/2 (sin(m) (cos(2p) - cos(phi0)) - ca cos(m) sin(2p)) + c cos(swing/2) ca sin(m)                            (4)

No place of this locus is singular but phi0 = 180 degrees.
"""

from __future__ import annotations

from kernels.boxes.tape import Tape
from kernels.families.rssr import box_turn as bt

SWING, PHI0, PHI1, PSI_EXT, C, F, ALPHA = range(7)


def recorded() -> bt.Formulas:
    """Record the formulas of the locus, alpha not being 0; the limited lengths are crank, e, g, coupler."""
    tape = Tape(bt.INPUTS)
    one = tape.one()
    c, f, phi1, psi1 = tape.input(C), tape.input(F), tape.input(PHI1), tape.input(PSI_EXT)
    swing, phi0 = tape.input(SWING), tape.input(PHI0)
    sin_half, cos_half = swing.sine_cosine(of_half=True)
    s0, c0 = phi0.sine_cosine()
    v1, u1 = phi1.sine_cosine()
    v2, u2 = (phi1 + phi0).sine_cosine()
    sin_p, cos_p = (phi1 + phi0.times(0.5)).sine_cosine()
    sin_2p, cos_2p = (phi1.times(2.0) + phi0).sine_cosine()
    sin1, cos1 = psi1.sine_cosine()
    sin2, cos2 = (psi1 + swing).sine_cosine()
    sin_m, cos_m = (psi1 + swing.times(0.5)).sine_cosine()
    sa, ca = tape.input(ALPHA).sine_cosine()
    chord, ca_m = (sin_half * c).times(2.0), ca * cos_m
    k = chord * s0.inverse()
    rho1, rho2 = k * (sin_m * v2 + ca_m * u2), -(k * (sin_m * v1 + ca_m * u1))
    # rho1 + rho2 by (2), without the division by a small sin(phi0)
    _, cos_half0 = phi0.sine_cosine(of_half=True)
    total = chord * cos_half0.inverse() * (sin_m * cos_p - ca_m * sin_p)
    e = (k * (sin_m * sin_2p + ca_m * (cos_2p + c0))).times(0.5) - c * cos_half * cos_m
    x1, y1, x2, y2 = c * cos1, c * sin1, c * cos2, c * sin2
    h = (k * (sin_m * (cos_2p - c0) - ca_m * sin_2p)).times(0.5) + c * cos_half * (ca * sin_m)
    fs, per_sa = f * sa, sa.inverse()
    crank, g = chord * (e * sin_m + fs * cos_m), h * per_sa
    acceptance = (
        rho1, rho2, crank,
        bt.sense(tape, total, crank, e, fs, ca, u1, v1, x1, y1),
        bt.sense(tape, total, crank, e, fs, ca, u2, v2, x2, y2),
    )  # fmt: skip
    limits = [bt.within(tape, 0, crank, total), bt.within(tape, 1, e, one), bt.within(tape, 2, g, one)]
    tape.end()
    start = bt.LimitPositions(total, crank, rho1, x1, y1, e, fs, ca, u1, v1)
    found = {bt.PASSED: bt.arrival(tape, start)}
    tape.end()
    any_crank = tape.input(bt.ANY_CRANK)
    found[bt.FREE_PASSED] = bt.arrival(tape, start._replace(total=one, crank=any_crank))
    found[bt.FREE_CRANK] = any_crank * total - crank
    tape.end()
    a = crank * total.inverse()
    b2 = (rho1 - a).square() + ((y1 - ca * (rho1 * v1)) * per_sa - f).square()
    share = a * c.inverse()
    at = bt.Linkage(one, a, e, fs, a * ca, one, share * h, share * e, b2, u1, v1)
    at = at._replace(k0=bt.constant_of_closure(at, cos1, sin1))
    limits.append(bt.within(tape, 3, b2, one, 2))
    tape.end()
    return bt.formulas(tape, at, found | bt.turn(tape, at), acceptance, limits, 3, start)
