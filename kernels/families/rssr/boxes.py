"""A box of crank-rockers on the locus of limit positions: the formulas whose enclosures tell what all of them have.

Swing and phi0 hold exactly in every design (docs/synthesis.md, (1)-(7)); the coordinates are the first seven inputs.
What vanishes where a design ceases to exist stands in numerators, so a box across such a place can still be told to
hold no mechanism.  The motion is that of docs/rssr.md, (1)-(4), in the given unit of length, at crank angles counted
from the extended position.  Position 1 is extended, position 2 folded.
"""

from __future__ import annotations

from typing import NamedTuple

from kernels.proof.tape import Number, Tape

# Inputs: swing with its sign, phi0, crank angle of the extended position, e, f, g, alpha; cosine and sine of the crank
# angle after it; branch; least cos^2 of the pressure angle; squares of the links' limits.
SWING, PHI0, PHI1, E, F, G, ALPHA, COS_THETA, SIN_THETA, BRANCH, COS2 = range(11)
LEAST_A2, MOST_A2, LEAST_B2, MOST_B2, LEAST_C2, MOST_C2 = range(11, 17)
INPUTS = 17


class Place(NamedTuple):
    """The locus without its divisions: rho1 = n1/det, X1 = nx/det, a = crank/total."""

    det: Number
    n1: Number
    n2: Number
    nx: Number
    ny: Number
    total: Number
    crank: Number


_tape = Tape(INPUTS)
_one = _tape.one()
_e, _f, _g, _branch = (_tape.input(k) for k in (E, F, G, BRANCH))
_sin_half, _cos_half = _tape.input(SWING).sine_cosine(of_half=True)
_s0, _c0 = _tape.input(PHI0).sine_cosine()
_v1, _u1 = _tape.input(PHI1).sine_cosine()
_sa, _ca = _tape.input(ALPHA).sine_cosine()
_u2, _v2 = _u1 * _c0 - _v1 * _s0, _v1 * _c0 + _u1 * _s0
_h, _fs = _g * _sa, _f * _sa


def _locus() -> Place:
    """Equations (1), (2), (6) of docs/synthesis.md, times det or the sum of the two distances."""
    swing_sine, versed = (_sin_half * _cos_half).times(2.0), _sin_half.square().times(2.0)
    cu1, cu2, ec = _ca * _u1, _ca * _u2, _e * _ca
    det = _ca * (_one - versed) * _s0 - swing_sine * (_v1 * _v2 + cu1 * cu2)
    across, along = swing_sine * _v2 - versed * cu2, versed * _v2 + swing_sine * cu2
    n1 = _h * across - ec * along
    n2 = -(_h * (swing_sine * _v1 + versed * cu1)) - ec * (versed * _v1 - swing_sine * cu1)
    nx = _e * (swing_sine * (_v1 * _v2) - _ca * (_s0 + versed * _v1 * _u2)) + _h * _u1 * across
    ny = _h * (_s0 - _u1 * along) - _e * _v1 * along
    mid_x, mid_y = nx * _cos_half - ny * _sin_half, ny * _cos_half + nx * _sin_half
    return Place(det, n1, n2, nx, ny, n1 + n2, _sin_half.times(2.0) * (_e * mid_y + _fs * mid_x))


def _sense(at: Place, u: Number, v: Number, x: Number, y: Number) -> Number:
    """T of a limit position times the branch, det and total: positive where the limit lies on the branch."""
    along = _e * at.total - at.crank * u
    across = _fs * at.total + at.crank * _ca * v
    return -(_branch * (along * y + across * x))


_at = _locus()
_mid_x, _mid_y = _at.nx * _cos_half - _at.ny * _sin_half, _at.ny * _cos_half + _at.nx * _sin_half
_x2, _y2 = _mid_x * _cos_half - _mid_y * _sin_half, _mid_y * _cos_half + _mid_x * _sin_half
_crank2, _total2 = _at.crank.square(), _at.total.square()
_rocker2, _det2 = _at.nx.square() + _at.ny.square(), _at.det.square()

# Rows that a mechanism keeps, without a division: both distances on one side of the crank axis, the limits in their
# order, a positive crank, both limits on the branch; crank and rocker within their limits.
ACCEPTANCE = tuple(
    number.form
    for number in (
        _at.n1 * _at.n2, _at.total * _at.det, _at.crank * _at.total,
        _sense(_at, _u1, _v1, _at.nx, _at.ny), _sense(_at, _u2, _v2, _x2, _y2),
    )
)  # fmt: skip
LIMITS_A = (_crank2 - _tape.input(LEAST_A2) * _total2).form, (_tape.input(MOST_A2) * _total2 - _crank2).form
LIMITS_C = (_rocker2 - _tape.input(LEAST_C2) * _det2).form, (_tape.input(MOST_C2) * _det2 - _rocker2).form
PLACE = _tape.end()

# Lengths and the constants of the closure X C - Y S + W = 0, W = k0 + k1 v - k2 u.  Before this part runs, the sign of
# det must be known; it stands in SIGN.
_sign = _tape.new()
SIGN = _sign.form
_rocker = _rocker2.root()
_per_det, _per_rocker = _at.det.inverse(), _rocker.inverse()
_cos1, _sin1 = _sign * _at.nx * _per_rocker, _sign * _at.ny * _per_rocker
_c = _sign * _rocker * _per_det
_a = _at.crank * _at.total.inverse()
_b2 = (_at.n1 * _per_det - _a).square() + (_at.ny * _per_det * _sa + _g * _ca - _f).square()
_ac = _a * _ca
_share = _a * _c.inverse()
_k1, _k2 = _share * _h, _share * _e
_w1 = (_fs + _ac * _v1) * _sin1 - (_e - _a * _u1) * _cos1
_k0 = _w1 - (_k1 * _v1 - _k2 * _u1)
LIMITS_B = (_b2 - _tape.input(LEAST_B2)).form, (_tape.input(MOST_B2) - _b2).form
LENGTHS = _tape.end()

# The discriminant at one crank angle, and what it is above its limit.
_cos, _sin = _tape.input(COS_THETA), _tape.input(SIN_THETA)
_u, _v = _u1 * _cos - _v1 * _sin, _v1 * _cos + _u1 * _sin
_x, _y, _w = _e - _a * _u, _fs + _ac * _v, _k0 + (_k1 * _v - _k2 * _u)
_r = _x.square() + _y.square()
_delta = _r - _w.square()
PRESSURE = (_delta - _tape.input(COS2) * _b2).form
CLOSURE = _tape.end()

# sin^2 of the pressure angle.
SIN2 = (_one - _delta * _b2.inverse()).form
ANGLE = _tape.end()

# psi' and psi''; (2*), (3), (4) of docs/rssr.md.
_t, _per_r = _branch * _delta.root(), _r.inverse()
_per_t = _t.inverse()
_cos_psi, _sin_psi = -((_x * _w + _y * _t) * _per_r), (_y * _w - _x * _t) * _per_r
_au, _av, _acu, _acv = _a * _u, _a * _v, _ac * _u, _ac * _v
_first = -((_av * _cos_psi - _acu * _sin_psi + (_k1 * _u + _k2 * _v)) * _per_t)
_mixed = (_av * _sin_psi + _acu * _cos_psi).times(-2.0)
_straight = _au * _cos_psi + _acv * _sin_psi + (_k2 * _u - _k1 * _v)
_second = -((_straight + _first * (_mixed + _w * _first)) * _per_t)
PSI1, PSI2 = _first.form, _second.form
MOTION = _tape.end()

# Numbers of the design at the centre of a box, for the choice of crank angles.
CENTRES = tuple(number.form for number in (_a, _e, _fs, _ac, _k0, _k1, _k2, _b2, _u1, _v1))
DETERMINANT, CRANK_ABOVE_ZERO = _at.det.form, _a.form

OPERATIONS, FACTORS, ENDS = _tape.recorded()
FORMS = _tape.forms
