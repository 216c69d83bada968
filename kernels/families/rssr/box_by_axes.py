"""Boxes of crank-rockers on the locus whose axes are given, by e, f, g, alpha and phi_ext.

docs/synthesis.md, (1)-(7).  Factors that vanish where a design ceases to exist stand in numerators, so a box across
such a place can still be proven to hold no mechanism: rho1 = n1/det, X1 = nx/det, Y1 = ny/det, a = crank/total.
"""

from __future__ import annotations

from kernels.boxes.tape import Number, Tape
from kernels.families.rssr import box_turn as bt

SWING, PHI0, PHI1, E, F, G, ALPHA = range(7)


def recorded() -> bt.Formulas:
    """Record the formulas of the locus; the limited lengths are crank, rocker, coupler."""
    tape = Tape(bt.INPUTS)
    one = tape.one()
    e, f, g = tape.input(E), tape.input(F), tape.input(G)
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
