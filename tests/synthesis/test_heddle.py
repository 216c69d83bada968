"""Synthesis of the heddle drive: the table, the printed example, and closures in 60 digits."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

from kernels import status as st
from kernels.synthesis import heddle as kernels
from sweep.errors import InputError
from sweep.synthesis import heddle
from tests.reference import heddle as naive

ROWS = json.loads((Path(__file__).parents[1] / "oracle" / "heddle_open.json").read_text())["rows"]
SOURCE = {"stroke": 75.0, "O4E": 138.5, "O1O2": 151.0, "O1O3": 311.0, "O3C": 138.5, "kappa": math.radians(155.0)}
OUTPUTS = ("mu", "xi_1", "xi_2", "O2C_1", "O2C_2", "vertical_travel")


def table(row):
    given = {k: v for k, v in row["in"].items() if k not in ("mode", "rigid_CO3D_deg")}
    return given | {"kappa": math.radians(row["in"]["rigid_CO3D_deg"])}


def relative(got, expected):
    return float(abs(mpf(float(got)) / mpf(expected) - 1)) / 2.0**-53


def test_heddle_extremes_match_oracle_on_every_row():
    worst = 0.0
    for row in (r for r in ROWS if r["kind"] == "synthesis"):
        found = heddle.extremes(table(row), row["in"]["mode"]).iloc[0]
        worst = max(worst, *(relative(found[name], row["out"][name]) for name in OUTPUTS))
    # kappa is rounded from degrees and xi near 0 is a difference of angles of the size of pi; 8 roundings of pi/0.44
    assert worst <= 64.0


def test_heddle_lever_angles_match_oracle_and_say_what_does_not_reach():
    seen = set()
    for row in (r for r in ROWS if r["kind"] == "synthesis" and "BC" in r["in"]):
        found = heddle.extremes(table(row), row["in"]["mode"]).iloc[0]
        seen.add(row["out"]["assembly"])
        if not row["out"]["assembly"]:
            assert found.status == st.NOT_ASSEMBLED
            assert math.isnan(found.lever_swing)
            continue
        assert found.status == st.OK
        for name in ("lever_angle_1", "lever_angle_2", "lever_swing"):
            # angles near 1 rad behind triangles that are nowhere flat: a hundred roundings of 1 rad
            assert float(abs(mpf(float(found[name])) - mpf(row["out"][name]))) <= 100.0 * 2.0**-53
    assert seen == {True, False}


def test_heddle_printed_numbers_are_reproduced_and_corrected():
    printed, exact = heddle.extremes(SOURCE, "printed").iloc[0], heddle.extremes(SOURCE, "exact").iloc[0]
    assert [round(math.degrees(printed[k]), 5) for k in ("mu", "xi_1", "xi_2")] == [15.15005, 130.15005, 99.84995]
    assert [round(printed[k], 5) for k in ("O2C_1", "O2C_2")] == [270.84943, 228.83182]
    assert round(printed.vertical_travel, 3) == 72.393
    assert [round(math.degrees(exact[k]), 5) for k in ("mu", "xi_1", "xi_2")] == [15.70938, 130.70938, 99.29062]
    assert [round(exact[k], 5) for k in ("O2C_1", "O2C_2")] == [271.45673, 227.89771]
    assert exact.vertical_travel == 75.0


def test_heddle_rods_contain_every_rod_of_the_table_and_only_rods_that_swing_as_wanted():
    more = 0
    for row in (r for r in ROWS if r["kind"] == "rod_from_swing"):
        found = heddle.rods(table(row))
        expected = row["out"]["BC"]
        assert (found.status == (st.OK if len(found.dropna()) else st.NOT_ADMISSIBLE)).all()
        for rod in expected:
            # a root of swing(BC) = target: flat where two rods nearly coincide, at most 1e4 roundings here
            assert min(relative(x, rod) for x in found.BC) <= 1e4
        given = table(row)
        place = naive.extremes(given["stroke"], given["O4E"], given["kappa"], mpf(given["O1O3"]) - given["O1O2"],
                               given["O3C"], False)  # fmt: skip
        for rod in found.BC.dropna():
            swing = naive.swing(place["C"], given["O2B"], rod, given["side_B"])
            assert swing.imag == 0
            assert abs(abs(float(swing)) - given["swing"]) <= 1e-12
        more += len(found.BC.dropna()) - len(expected)
    # The table's search lost one rod, 74.1357 mm, next to the shortest rod that reaches at all.
    assert more == 1


def test_heddle_rods_agree_with_a_dense_search():
    lever, side = 192.5, 1.0
    place = naive.extremes(54.0, 138.5, math.radians(155.0), 160.0, 138.5, False)
    reach = [float(abs(c)) for c in place["C"]]
    low, high = max(abs(r - lever) for r in reach), min(r + lever for r in reach)
    rods = low + (high - low) * 0.5 * (1.0 - np.cos(np.linspace(1e-3, math.pi - 1e-3, 400)))
    with mp.workdps(20):
        swings = np.array([abs(float(naive.swing(place["C"], lever, rod, side))) for rod in rods])
    for target in (0.375, 0.4375, 0.39):
        crossed = int((np.diff(np.sign(swings - target)) != 0).sum())
        given = SOURCE | {"stroke": 54.0, "O2B": lever, "swing": target}
        assert len(heddle.rods(given).BC.dropna()) == crossed


def test_heddle_second_hand_lever_gives_the_swings_of_the_page():
    for stroke_mode, arm, swing in (("printed", 138.5, 22.459), ("printed", 143.5, 23.042), ("exact", 138.5, 23.286)):
        found = heddle.extremes(SOURCE | {"O3C": arm, "O2B": 192.5, "BC": 225.0}, stroke_mode).iloc[0]
        assert abs(math.degrees(found.lever_swing)) == pytest.approx(swing, abs=5e-4)
    other = heddle.extremes(SOURCE | {"O2B": 192.5, "BC": 225.0, "side_B": -1}, "printed").iloc[0]
    assert abs(math.degrees(other.lever_swing)) == pytest.approx(4.7, abs=0.1)


def test_heddle_strokes_open_a_clear_shed():
    strokes = heddle.shed({"shaft": [1, 2, 4, 6], "d1": 120.0, "t": 12.0, "stroke": 75.0}).stroke
    np.testing.assert_allclose(strokes / (120.0 + 12.0 * np.array([0, 1, 3, 5])), 75.0 / 156.0, rtol=4e-16)
    assert strokes[2] == 75.0


def test_heddle_arms_give_each_shaft_its_stroke():
    common = {"O4E": 138.5, "O4F": 138.5, "O3O4": 900.0, "mu_3": math.asin(75.0 / 277.0)}
    found = heddle.arms({"stroke": [50.0, 75.0, 90.0, 276.0]} | common)
    assert found.status.tolist() == [st.OK, st.OK, st.OK, st.NOT_ADMISSIBLE]
    np.testing.assert_allclose((found.y_high - found.y_low)[:3], [50.0, 75.0, 90.0], rtol=1e-13)
    # the shaft with the parallel linkage keeps its arm and a shed symmetric to rounding
    assert found.O3D[1] == pytest.approx(138.5, rel=1e-12)
    assert abs(found.asymmetry[1]) < 1e-9
    # to first order O3D sin(mu_3) = O4F sin(mu): the others are within half a percent of it
    np.testing.assert_allclose(found.O3D[:3], 138.5 * np.array([50.0, 75.0, 90.0]) / 75.0, rtol=5e-3)
    for row in (0, 2):
        numbers = (192.5, 225.0, 138.5, 160.0, 138.5, 0.0, found.O3D[row], 138.5, 900.0, found.DF[row], 0, 0, 1, 1)
        y = []
        for half in (common["mu_3"], -common["mu_3"]):
            with mp.workdps(30):
                d = mpf(numbers[6]) * mp.mpc(0, 1) * mp.expj(half)
                f = naive.circles(d, mpf(numbers[9]), mp.mpc(900), mpf(138.5), 1)
                y.append(float(138.5 * ((f - 900) / mp.mpc(0, 138.5)).imag))
        assert y[0] - y[1] == pytest.approx(found.y_high[row] - found.y_low[row], rel=1e-12)


def test_heddle_synthesis_names_what_is_wrong():
    with pytest.raises(InputError, match="O1O3"):
        heddle.extremes(SOURCE | {"O1O3": 100.0})
    with pytest.raises(InputError, match="mode"):
        heddle.extremes(SOURCE, "about")
    with pytest.raises(InputError, match="swing"):
        heddle.rods(SOURCE | {"O2B": 192.5, "swing": 3.5})
    with pytest.raises(InputError, match="mu_3"):
        heddle.arms({"stroke": 75.0, "O4E": 138.5, "O4F": 138.5, "O3O4": 900.0, "mu_3": 1.6})
    long = heddle.extremes(SOURCE | {"stroke": 280.0}).iloc[0]
    assert long.status == st.NOT_ASSEMBLED and math.isnan(long.xi_1)
    # C does not move if it stands on O2 in both extremes turned into each other: no stroke, no rod to choose
    assert heddle.rods(SOURCE | {"stroke": 280.0, "O2B": 192.5, "swing": 0.4}).status.tolist() == [st.NOT_ASSEMBLED]


def test_heddle_synthesis_jitted_equals_plain():
    requirements = np.array([[s, 138.5, 151.0, 311.0, 138.5, 2.7] for s in (1e-6, 54.0, 75.0, 276.9, 300.0, -1.0)])

    def run(plain):
        def call(function):
            return function.py_func if plain else function

        status = [np.empty(6, np.uint8) for _ in range(4)]
        both, angles, rods = np.zeros((6, 12)), np.zeros((6, 3)), np.zeros((6, 4))
        count, arms = np.zeros(6, np.uint8), np.zeros((6, 4))
        call(kernels.heddle_extremes)(requirements, both, status[0])
        lever = np.column_stack([np.full((6, 1), 160.0), np.full((6, 1), 138.5), both[:, 1:3]])
        call(kernels.heddle_lever_angles)(
            np.column_stack([lever, np.full((6, 3), [192.5, 225.0, 1.0])]), angles, status[1]
        )
        call(kernels.heddle_rods)(np.column_stack([lever, np.full((6, 3), [192.5, 0.4, 1.0])]), rods, count, status[2])
        shafts = np.column_stack([requirements[:, :2], np.full((6, 3), [138.5, 900.0, 0.27])])
        call(kernels.heddle_shaft_arms)(shafts, arms, status[3])
        return [both, angles, rods, count, arms, *status]

    for one, two in zip(run(False), run(True), strict=True):
        np.testing.assert_array_equal(one, two)


def followed(given, rod):
    """Turn of a cam lever with this rod from its second position to the first, in steps too small to lose a turn."""
    frame, mu = given["O1O3"] - given["O1O2"], math.asin(0.5 * given["stroke"] / given["O4E"])
    xi = 1.5 * math.pi - given["kappa"] + np.linspace(-mu, mu, 1001)
    place = frame - given["O3C"] * np.exp(-1j * xi)
    towards, reach = np.unwrap(np.angle(place))[[0, -1]], np.abs(place)[[0, -1]]
    aside = np.arccos((given["O2B"] ** 2 + reach**2 - rod**2) / (2.0 * given["O2B"] * reach))
    return float(np.diff(towards + given["side_B"] * aside)[0])


def test_heddle_lever_follows_a_bell_crank_that_passes_behind_its_pivot():
    """A turn too many was in 2 % of random swings, and such rods passed for rods of the wanted swing."""
    rng, n = np.random.default_rng(6), 800
    table = {name: rng.uniform(20.0, 250.0, n) for name in ("O1O2", "O3C", "O2B", "BC")}
    table |= {"stroke": rng.uniform(50.0, 200.0, n), "O4E": np.full(n, 110.0), "side_B": rng.choice([-1.0, 1.0], n)}
    table |= {"kappa": rng.uniform(-7.0, 7.0, n), "O1O3": table["O1O2"] + rng.uniform(10.0, 250.0, n)}
    asked = {name: x for name, x in table.items() if name != "BC"} | {"swing": rng.uniform(0.05, 3.0, n)}
    for found, rods in ((heddle.extremes(table), table["BC"]), (heddle.rods(asked), None)):
        good = found[found.status == st.OK]
        assert len(good) > 100
        for i, row in good.iterrows():
            rod = row.BC if rods is None else rods[i]
            # the arc cosine loses half of the digits where rod and lever are nearly in line
            assert row.lever_swing == pytest.approx(followed({k: x[i] for k, x in asked.items()}, rod), abs=1e-6)
            assert rods is not None or abs(row.lever_swing) == pytest.approx(asked["swing"][i], abs=1e-6)


@pytest.mark.parametrize(
    ("stroke", "O4E", "O4F", "O3O4", "mu_3"),
    [
        (195.8558374601882, 100.8, 190.7, 206.5, 1.4224),
        (90.86, 205.64, 119.53, 189.96, 0.04625),
        (127.55, 216.8, 30.36, 131.5, 0.02829),
        (1.4405089845898476, 1.314383750210716, 0.6084082489872538, 0.14068444785474463, 0.5121599932594944),
        (0.29378800235658026, 0.17414458699114305, 1.915588158303959, 1.242528750781707, 1.2556930590407975),
    ],
)
def test_heddle_arm_is_found_where_the_first_guess_is_next_to_a_dead_point_or_beyond(stroke, O4E, O4F, O3O4, mu_3):
    """Places of E by two circles; of 1167 random shafts with an arm 29 were NOT_ADMISSIBLE.

    The last two have theirs between two dead points, longer than where a first one lets go of the link.
    """
    found = heddle.arms({"stroke": stroke, "O4E": O4E, "O4F": O4F, "O3O4": O3O4, "mu_3": mu_3}).iloc[0]
    assert found.status == st.OK
    places = []
    for turn in (mu_3, -mu_3):
        way = 1j * found.O3D * np.exp(1j * turn) - O3O4  # from O4 to D
        aside = math.acos((O4F**2 + abs(way) ** 2 - found.DF**2) / (2.0 * O4F * abs(way)))
        places.append(O4E * math.sin(np.angle(way) - aside - 0.5 * math.pi))  # F to the right of O4-D, as at mid-stroke
    assert abs(places[0] - places[1]) == pytest.approx(stroke, rel=1e-7)
