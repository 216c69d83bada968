"""Eyelets whose guides are near the crank axis, and a cam without a radius, against 60 and 40 digits."""

from __future__ import annotations

import numpy as np
from mpmath import mp, mpf

import sweep
from sweep.families import family
from tests.families.takeup.test_reference import eyelet_length
from tests.support.family_checks import conditions


def test_eyelet_keeps_its_digits_where_the_guides_are_near_the_crank_axis():
    # The thread hardly changes its length there, so what rounding of the eyelet's own circle leaves would drown its
    # derivatives: it was 1e3 units.  They are now sums of a few rounded products: 16 are asked, 3 measured.
    generator, names = np.random.default_rng(4), family("eyelet").parameter_names
    for _ in range(40):
        size = 10.0 ** -generator.uniform(0.0, 4.0)
        near = dict(zip(["e", "Z1", "Z2", "dX1", "dY1", "dX2", "dY2"], size * generator.uniform(-1, 1, 7), strict=True))
        f, alpha, phi = generator.uniform(-3.0, 3.0), generator.choice([0.0, 1.1]), generator.uniform(-9.0, 9.0)
        design = {"a": 1.0, "f": f, "alpha": alpha, "phi_h": 0.4, "P_h": 1.0} | near
        cond = conditions("eyelet", [design[name] for name in names], phi, ["dP", "d2P"])
        got = sweep.evaluate("eyelet", design, ["dP", "d2P"], phi=[phi]).iloc[0]
        with mp.workdps(60):
            length = mp.taylor(lambda x, d=design: eyelet_length(d, x), mp.mpf(phi), 2, h=mp.mpf(10) ** -15)
        large = 0.0
        for name, expected in (("dP", length[1]), ("d2P", 2 * length[2])):
            large = max(large, cond[name], float(abs(expected)))
            assert float(abs(got[name] - expected)) <= 16.0 * 2.0**-53 * large, (design, phi, name)


def test_cam_without_a_radius_keeps_its_digits_near_the_least_displacement():
    # Its radius is S less its least value.  P is rounded some 8 times and makes T/(4 S) of that; S itself, two hundred
    # times as large as P, was rounded before: some 100 units.
    design = {"P_h": 60.0, "X1": 3.0, "Z1": 12.0, "e": 5.0, "R0": 0.0, "A1": 0.125, "B2": 0.03125}
    with mp.workdps(40):

        def law(x):
            return mpf(0.125) * mp.cos(x) + mpf(0.03125) * mp.sin(2 * x)

        def displacement(x):
            return mp.sqrt((60 + law(x)) ** 2 / 4 - 144 - 4)

        least = mp.findroot(lambda x: -0.125 * mp.sin(x) + 0.0625 * mp.cos(2 * x), 3.0)
        assert law(least) < min(law(mpf(k) / 10) for k in range(63))
        for step in (1e-3, -1e-2, 0.1, -0.5):
            phi = float(least) + step
            got = sweep.evaluate("guided_cam", design, ["pressure_angle"], phi=[phi])["pressure_angle"][0]
            slope, radius = abs(mp.diff(displacement, mpf(phi))), displacement(mpf(phi)) - displacement(least)
            rounded = 8.0 * 2.0**-53 * 0.15625 * float((60 + law(least)) / (4 * displacement(least)))
            off = float(abs(got - mp.atan2(slope, radius)))
            assert off <= rounded * float(slope / (slope**2 + radius**2)) + 4.0 * 2.0**-53, step
