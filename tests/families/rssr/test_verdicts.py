"""Verdicts on full rotation near change points against the sign of the least discriminant in 50 digits."""

from __future__ import annotations

import numpy as np
from mpmath import mp, mpc, mpf

from kernels import status as st
from kernels.families import rssr
from studies.accuracy.regions import rotatable, shortest_couplers

DESIGNS = 300


def least_discriminant(design):
    """Least value of Delta over the turn with its right sign: at the zeros of its slope, in 50 digits."""
    with mp.workdps(50):
        a, b, c, e, f, g, alpha = (mpf(float(x)) for x in design[:7])
        sa, ca = mp.sin(alpha), mp.cos(alpha)
        k0 = (a * a - b * b + c * c + e * e + f * f + g * g - 2 * f * g * ca) / (2 * c)
        k1, k2 = a * g * sa / c, a * e / c
        c1, s1 = 2 * (k0 * k2 - a * e), 2 * (a * f * sa * ca - k0 * k1)
        d3, d4, d5 = a * a - k2 * k2, 2 * k1 * k2, a * a * ca * ca - k1 * k1
        c0, c2, s2 = e * e + (f * sa) ** 2 - k0 * k0 + (d3 + d5) / 2, (d3 - d5) / 2, d4 / 2
        # With z = exp(i t) the slope times z^2 is a quartic, whose zeros hold those of the slope.
        first, second = mpc(s1, c1) / 2, mpc(s2, c2)
        zeros = mp.polyroots([mp.conj(second), mp.conj(first), 0, first, second], maxsteps=500, extraprec=200, asc=True)
        values = [
            c0 + c1 * mp.cos(t) + s1 * mp.sin(t) + c2 * mp.cos(2 * t) + s2 * mp.sin(2 * t) for t in map(mp.arg, zeros)
        ]
        return float(min(values))


def test_no_verdict_within_a_hair_of_a_change_point_is_wrong():
    generator = np.random.default_rng(5)
    designs = rotatable(DESIGNS, 77)
    designs[:, 1] = shortest_couplers(designs)
    designs[:, 1] *= 1.0 + generator.choice([-1.0, 1.0], DESIGNS) * 10.0 ** generator.uniform(-15.5, -8.0, DESIGNS)
    status, turns = np.empty(DESIGNS, np.uint8), np.empty(DESIGNS)
    rssr.margin(designs, status, None, turns, None, None, None)
    decided = status != st.UNDECIDABLE
    assert 0.8 < decided.mean() < 1.0
    truth = np.array([least_discriminant(design) > 0.0 for design in designs[decided]])
    assert 0.3 < truth.mean() < 0.7
    np.testing.assert_array_equal(turns[decided] == 1.0, truth)
