"""Boxes of crank-rockers on the locus of limit positions, with given axes or with a given rocker.

With given axes the formulas are (1)-(7) of docs/synthesis.md.  With a given rocker, c and psi_ext:

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

from functools import cache

from kernels.boxes.tape import Number, Tape
from kernels.families.rssr import box_turn as bt

SWING, PHI0, PHI1, ALPHA = 0, 1, 2, 6  # inputs of both; between them stand e, f, g or psi_ext, c, f


@cache
def by_axes() -> bt.Formulas:
    """Record the formulas for given axes: e, f, g; the limited lengths are crank, rocker, coupler.

    Factors that vanish where a design ceases to exist stand in numerators, so a box across such a place can still be
    proven to hold no mechanism: rho1 = n1/det, X1 = nx/det, Y1 = ny/det, a = crank/total.
    """
    tape = Tape(bt.INPUTS)
    one = tape.one()
    e, f, g = tape.input(3), tape.input(4), tape.input(5)
    sin_half, cos_half = tape.input(SWING).sine_cosine(of_half=True)
    s0, c0 = tape.input(PHI0).sine_cosine()
    v1, u1 = tape.input(PHI1).sine_cosine()
    sa, ca = tape.input(ALPHA).sine_cosine()
    u2, v2 = u1 * c0 - v1 * s0, v1 * c0 + u1 * s0
    h, fs = g * sa, f * sa
    # (1), (2), (6)
    swing_sine, versed = (sin_half * cos_half).times(2.0), sin_half.square().times(2.0)
    cu1, cu2, ec = ca * u1, ca * u2, e * ca
    det = ca * (one - versed) * s0 - swing_sine * (v1 * v2 + cu1 * cu2)
    across, along = swing_sine * v2 - versed * cu2, versed * v2 + swing_sine * cu2
    n1 = h * across - ec * along
    n2 = -(h * (swing_sine * v1 + versed * cu1)) - ec * (versed * v1 - swing_sine * cu1)
    nx = e * (swing_sine * (v1 * v2) - ca * (s0 + versed * v1 * u2)) + h * u1 * across
    ny = h * (s0 - u1 * along) - e * v1 * along
    mid_x, mid_y = nx * cos_half - ny * sin_half, ny * cos_half + nx * sin_half
    x2, y2 = mid_x * cos_half - mid_y * sin_half, mid_y * cos_half + mid_x * sin_half
    total, crank = n1 + n2, sin_half.times(2.0) * (e * mid_y + fs * mid_x)
    total2, det2, rocker2 = total.square(), det.square(), nx.square() + ny.square()
    acceptance = (
        n1 * n2, total * det, crank * total,
        bt.sense(tape, total, crank, e, fs, ca, u1, v1, nx, ny),
        bt.sense(tape, total, crank, e, fs, ca, u2, v2, x2, y2),
    )  # fmt: skip
    limits = [bt.within(tape, 0, crank.square(), total2, 2), bt.within(tape, 1, rocker2, det2, 2)]
    tape.end()
    start = bt.LimitPositions(total, crank, n1, nx, ny, e, fs, ca, u1, v1)
    found = {bt.PASSED: bt.arrival(tape, start)}
    tape.end()
    tape.end()  # FREE: empty, as with given axes the crank's length is never a variable
    sign = tape.new()
    rocker, per_det = rocker2.root(), det.inverse()
    per_rocker = rocker.inverse()
    c, a = sign * rocker * per_det, crank * total.inverse()
    b2 = (n1 * per_det - a).square() + (ny * per_det * sa + g * ca - f).square()  # (7)
    share = a * c.inverse()
    at = bt.Linkage(one, a, e, fs, a * ca, one, share * h, share * e, b2, u1, v1)
    at = at._replace(k0=bt.constant_of_closure(at, _signed(sign, nx, per_rocker), _signed(sign, ny, per_rocker)))
    limits.append(bt.within(tape, 2, b2, one, 2))
    tape.end()
    return bt.formulas(tape, at, found | bt.turn(tape, at), acceptance, limits, 2, start, (det, sign))


def _signed(sign: Number, x: Number, per_size: Number) -> Number:
    return sign * x * per_size


@cache
def by_rocker() -> bt.Formulas:
    """Record the formulas for a given rocker, alpha not being 0; the limited lengths are crank, e, g, coupler."""
    tape = Tape(bt.INPUTS)
    one = tape.one()
    c, f, phi1, psi1 = tape.input(4), tape.input(5), tape.input(PHI1), tape.input(3)
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
