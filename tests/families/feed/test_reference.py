"""Feed mechanism: the 25-digit table through the public functions, points and circles, events."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as some
from mpmath import mp, mpf

import sweep
from kernels import status as st
from kernels.families import feed
from sweep.families import family
from sweep.families.base import Angles
from sweep.families.feed import FEEDING_OUTPUTS, POSE_OUTPUTS
from tests.reference import feed as naive
from tests.support.family_checks import factors

ROWS = [r for r in json.loads((Path(__file__).parents[2] / "oracle" / "feed_open.json").read_text())["rows"]
        if r["kind"] == "rack"]  # fmt: skip
FIELDS = family("feed").parameter_names
OUTPUTS = [o.name for o in POSE_OUTPUTS]
RACK = {
    "h_a": 0.4, "h_b": 3.4, "h_c": 1.6, "h_e": 3.5, "h_f": 0.0, "h_g": 0.0, "h_alpha": 0.0, "rh": 1.2, "dh": -0.3,
    "xE": 5.6, "yE": 0.7, "rE": 0.18, "dE": 0.8, "q": 2.6, "fx": -1.7, "fy": 0.6, "tx": -0.3, "ty": 0.9, "tooth": 0.0,
    "pitch": 0.0, "y_plate": 0.0, "h_sigma": -1.0, "bar_branch": -1.0,
}  # fmt: skip


def exact(p):
    return {name: mpf(p.get(name, 0.0)) for name in FIELDS}


def pair(frame, letter, prefix=""):
    return [frame[f"{prefix}x_{letter}"], frame[f"{prefix}y_{letter}"]]


def conditions(p, phi):
    """Sum of |input d(output)/d(input)| for every point and angle: what one rounding of each input can do."""
    values = exact(p) | {"phi": mpf(phi)}
    step = mpf(10) ** -18
    base = naive.points(values, values["phi"])
    sums = dict.fromkeys(base, mpf(0))
    for k, v in values.items():
        if v != 0 and k not in ("h_sigma", "bar_branch"):
            moved = values | {k: v * (1 + step)}
            moved = naive.points(moved, moved["phi"])
            sums = {name: total + abs(moved[name] - base[name]) / step for name, total in sums.items()}
    return sums


def test_feed_matches_oracle_on_every_rack_row():
    for row in ROWS:
        p, expected = row["inputs"], row["expected"]
        got = sweep.evaluate("feed", p, OUTPUTS).iloc[0]
        assert got.status == st.OK
        with mp.workdps(40):
            sizes = conditions(p, p["phi"])
            for letter in "HEFT":
                for value, y in zip(pair(got, letter.lower()), expected[letter], strict=True):
                    # 8 roundings of each input
                    assert abs(mpf(float(value)) - mpf(y)) <= 8 * mpf(2) ** -53 * sizes[letter]
            for name in ("psi_plus_dh", "chi"):
                error = (mpf(float(got[name])) - mpf(expected[name]) + mp.pi) % (2 * mp.pi) - mp.pi
                assert abs(error) <= 8 * mpf(2) ** -53 * max(sizes[name], abs(mpf(expected[name])))
        for prefix, name in (("d", "dT"), ("d2", "d2T")):
            for value, y in zip(pair(got, "t", prefix), expected[name], strict=True):
                # derivatives lose the sines of both triangles, at least 0.05 in the table, once and twice
                assert abs(float(value) - float(y)) <= 1e-13


def test_feed_weighted_difference_matches_oracle():
    for row in ROWS:
        p = row["inputs"]
        phi = np.array([[p["phi"]]])
        chi = sweep.evaluate("feed", p, "chi").chi.to_numpy()[:, None] + 2.0**-10
        status, rows = np.empty((1, 1), np.uint8), np.empty((5, 1, 1))
        matrix = np.array([[p.get(name, 0.0) for name in FIELDS]])
        feed.lift_rows(matrix, np.cos(phi), np.sin(phi), chi, status, rows)
        dq = float(rows[:3, 0, 0] @ (p["fx"], p["fy"], 1.0)) - (p["q"] ** 2 - p["fx"] ** 2 - p["fy"] ** 2)
        expected = float(row["expected"]["dq_at_chi_plus_2m10"])
        # a difference of squares of lengths up to 10, known to the rounding of chi
        assert status[0, 0] == st.OK
        assert abs(dq - expected) <= 64.0 * 2.0**-53 * p["q"] * (p["q"] + abs(p["fx"]) + abs(p["fy"]))


@settings(deadline=None, max_examples=15)
@given(
    some.fixed_dictionaries({
        "h_a": some.floats(0.2, 0.6), "h_f": some.floats(-0.5, 0.5), "h_g": some.floats(-0.5, 0.5),
        "h_alpha": some.floats(-0.6, 0.6), "h_sigma": some.sampled_from([-1.0, 1.0]),
        "bar_branch": some.sampled_from([-1.0, 1.0]), "tooth": some.integers(0, 5).map(float),
        "pitch": some.floats(0.0, 0.4), "rE": some.floats(0.0, 0.4),
    }),
    some.floats(-3.0, 9.0),
)  # fmt: skip
def test_feed_equals_points_and_circles_with_a_spatial_chain_too(changes, phi):
    p = RACK | changes
    got = sweep.evaluate("feed", p | {"phi": phi}, OUTPUTS).iloc[0]
    assume(got.status == st.OK)
    with mp.workdps(40):
        values = exact(p)
        place = naive.points(values, mpf(phi))
        triangle = abs(mp.sin(mp.arg((place["F"] - place["E"]) / (place["F"] - place["H"]))))
        assume(triangle > 0.05)
        for letter in "HEFT":
            assert abs(complex(*pair(got, letter.lower())) - complex(place[letter])) < 1e-12
        slopes = mp.taylor(lambda x: naive.tooth(values, x), mpf(phi), 2)
        for order, prefix in ((1, "d"), (2, "d2")):
            expected = complex(slopes[order] * mp.factorial(order))
            assert abs(complex(*pair(got, "t", prefix)) - expected) < 1e-10 * max(1.0, abs(expected))


def test_feed_with_a_long_rocker_on_a_far_axis_keeps_its_digits():
    # The horizontal chain is a crank-rocker, whose poses keep their digits by twice as many: the difference of the
    # squares of rocker and frame had lost 200 units.  Both add a few roundings to those of the inputs: 16 asked.
    generator, checked = np.random.default_rng(7), 0
    for _ in range(12):
        c, phi = 10.0 ** generator.uniform(1.5, 3.0), generator.uniform(-9.0, 9.0)
        chain = {"a": 0.7, "b": 2.5, "c": c, "e": generator.uniform(-1.5, 1.5) - c, "branch": generator.choice([-1, 1])}
        given = chain | {"f": 0.0, "g": 0.0, "alpha": 0.0}
        rocker = sweep.evaluate("rssr", given, ["psi", "dpsi", "d2psi"], phi=[phi]).iloc[0]
        own = {f"h_{name}": x for name, x in chain.items() if name != "branch"} | {"h_sigma": chain["branch"]}
        p = RACK | own | {"dh": 0.0, "xE": chain["e"] + 3.2, "yE": 0.0, "q": 1.7}
        got = sweep.evaluate("feed", p, ["psi_plus_dh", "dpsi", "d2psi"], phi=[phi]).iloc[0]
        if rocker.status != st.OK or got.status != st.OK:
            continue
        expected = {"psi_plus_dh": mpf(rocker.psi), "dpsi": mpf(rocker.dpsi), "d2psi": mpf(rocker.d2psi)}
        found = factors("feed", [p[name] for name in FIELDS], phi, expected, got, positions=False)
        assert max(found.values()) <= 16.0, (p, phi, found)
        checked += 1
    assert checked >= 4


def test_feed_events_equal_plain_root_finding_and_quadrature():
    path = sweep.evaluate("feed", RACK, ["y_t"], phi=np.linspace(0.0, 6.28, 200)).y_t
    p = RACK | {"y_plate": float(path.min() + 0.6 * (path.max() - path.min()))}
    names = ["phi_entry", "phi_leave", "feed_angle", "entry_speed", "leave_speed", "stitch_length", "rise", "flatness"]
    got = sweep.summarise("feed", p, names, accuracy=1e-9).iloc[0]
    assert got.status == st.OK
    expected = naive.feeding(exact(p), got.phi_entry, got.phi_leave)
    for name in names:
        assert abs(float(got[name]) - float(expected[name])) <= got[f"err_{name}"], name


def test_flatness_of_a_path_with_a_sharp_bend_is_within_its_error():
    """Near a dead point 16 panels of Gauss's rule are 9e-5 off."""
    p = RACK | {
        "h_a": 0.388, "h_b": 4.266, "h_c": 1.604, "h_e": 3.873, "h_g": 0.782, "h_alpha": 0.116, "rh": 0.486,
        "dh": -0.357, "xE": 4.067, "yE": 0.287, "rE": 0.168, "dE": 0.848, "q": 1.946, "fx": -1.713, "fy": 0.869,
        "tx": -0.503, "ty": 1.026, "y_plate": -0.555, "bar_branch": 1.0,
    }  # fmt: skip
    names = ["phi_entry", "feed_angle", "rise", "stitch_length", "flatness"]
    got = sweep.summarise("feed", p, names, accuracy=1e-9).iloc[0]
    nodes, weights = np.polynomial.legendre.leggauss(8)
    half = 0.5 * got.feed_angle / 1024
    phi = (got.phi_entry + half * (2.0 * np.arange(1024)[:, None] + 1.0 + nodes)).ravel()
    path = sweep.evaluate("feed", p, ["y_t", "dx_t"], phi=phi)
    area = half * np.tile(weights, 1024) @ ((path.y_t - p["y_plate"]) * path.dx_t)
    assert abs(got.flatness - area / (got.rise * got.stitch_length)) <= got.err_flatness <= 1e-9


@pytest.mark.parametrize("y_plate", [0.07953929571289062, 0.07954400037170409])
def test_error_of_flatness_grows_with_it_as_the_stitch_vanishes(y_plate):
    """A plate at which the tooth leaves where it entered: err_ was relative, 1e4 times too small at a flatness of 1e6.

    The reference is exact to 1e-20 of the path; of the flatness less than 1e-10 is lost to a stitch of 1e-7.
    """
    nearly = RACK | {"tx": 1.0, "ty": -0.5, "dE": 2.0, "y_plate": y_plate}
    found = sweep.summarise("feed", nearly, ["flatness", "phi_entry", "phi_leave"], accuracy=1e-8).iloc[0]
    slow = naive.feeding(exact(nearly), found.phi_entry, found.phi_leave)
    assert found.status == st.OK and abs(found.flatness) > 1e3
    assert abs(found.flatness - float(slow["flatness"])) <= found.err_flatness <= 1e-2 * abs(found.flatness)


def test_flatness_of_a_tooth_that_comes_back_the_way_it_went_is_none():
    """Without eccentricity the rocker moves the rack to and fro: the status of this mechanism was INVALID_INPUT."""
    swung = {"h_a": 0.1, "h_b": 1.0, "h_c": 1.0, "h_e": 1.0, "rh": 1.0, "dh": 0.5 * math.pi, "xE": 0.0, "yE": 0.0,
             "rE": 0.0, "dE": 0.0, "q": 2.0, "fx": -1.0, "fy": 0.0, "tx": 0.0, "ty": 0.2}  # fmt: skip
    ends = sweep.summarise("feed", swung, ["max_y_t", "min_y_t"], accuracy=1e-8).iloc[0]
    low, high = ends.min_y_t, ends.max_y_t
    plates = pd.DataFrame([swung | {"y_plate": low + share * (high - low)} for share in (0.25, 0.4, 0.5, 0.6, 0.75)])
    found = sweep.summarise("feed", plates, ["flatness", "stitch_length"], accuracy=1e-8)
    retraced = found[found.stitch_length == 0.0]  # others are off by a rounding, and so says the error
    assert len(retraced) > 0 and (retraced.status == st.NO_EVENT).all() and retraced.flatness.isna().all()
    assert (sweep.summarise("feed", plates, ["stitch_length", "rise"], accuracy=1e-8).status == st.OK).all()


def test_feed_speed_at_entry_and_way_between_agree_with_poses():
    p = RACK | {"y_plate": 1.7}
    path = sweep.evaluate("feed", RACK, ["y_t"], phi=np.linspace(0.0, 6.28, 200)).y_t
    p["y_plate"] = float(path.mean())
    got = sweep.summarise("feed", p, ["phi_entry", "phi_leave", "entry_speed", "stitch_length"], samples=64).iloc[0]
    at = sweep.evaluate("feed", p, ["x_t", "y_t", "dy_t"], phi=[got.phi_entry, got.phi_leave])
    np.testing.assert_allclose(at.y_t, p["y_plate"], rtol=0, atol=1e-14)
    assert at.dy_t[0] == pytest.approx(got.entry_speed, rel=1e-12) and at.dy_t[0] > 0.0 > at.dy_t[1]
    assert at.x_t[1] - at.x_t[0] == pytest.approx(got.stitch_length, rel=1e-12)


def test_feed_without_entry_says_so():
    for plate in (-10.0, 10.0):
        got = sweep.summarise("feed", RACK | {"y_plate": plate}, ["phi_entry", "rise"], samples=64).iloc[0]
        assert got.status == st.NO_EVENT and math.isnan(got.phi_entry)
    none = sweep.summarise("feed", RACK | {"y_plate": 10.0}, ["crossings"], accuracy=1e-8).iloc[0]
    assert (none.crossings, none.err_crossings) == (0.0, 0.0)
    long = sweep.summarise("feed", RACK | {"h_a": 3.0}, ["phi_entry"], samples=64).iloc[0]
    assert long.status == st.NOT_ASSEMBLED


def test_feed_teeth_stand_in_a_row_on_the_rack():
    teeth = sweep.evaluate(
        "feed", RACK | {"tooth": [0.0, 1.0, 5.0], "pitch": 0.2}, ["x_t", "y_t", "chi"], phi=[0.0, 2.0]
    )
    first = teeth[teeth.design == 0].reset_index()
    for number, row in ((1.0, 1), (5.0, 2)):
        other = teeth[teeth.design == row].reset_index()
        np.testing.assert_allclose(other.x_t - first.x_t, 0.2 * number * np.cos(first.chi), rtol=0, atol=1e-15)
        np.testing.assert_allclose(other.y_t - first.y_t, 0.2 * number * np.sin(first.chi), rtol=0, atol=1e-15)


def test_feed_without_eccentricity_turns_the_rack_on_a_fixed_pivot():
    at = sweep.evaluate("feed", RACK | {"rE": 0.0}, ["x_e", "y_e", "x_f", "y_f"], phi=np.linspace(0.0, 6.0, 7))
    np.testing.assert_array_equal(at.x_e, RACK["xE"])
    np.testing.assert_allclose(np.hypot(at.x_f - at.x_e, at.y_f - at.y_e), RACK["q"], rtol=1e-14)


@pytest.mark.parametrize("exponent", [-100, -20, 20, 100])
def test_feed_scaled_by_a_power_of_two_keeps_every_bit(exponent):
    lengths = [q.name for q in family("feed").parameters if q.unit == "length"]
    scaled = RACK | {k: math.ldexp(RACK[k], exponent) for k in lengths}
    plain, large = (sweep.evaluate("feed", p, ["chi", "x_t", "d2y_t"], phi=[0.3, 2.0]) for p in (RACK, scaled))
    np.testing.assert_array_equal(plain.chi, large.chi)
    for name in ("x_t", "d2y_t"):
        np.testing.assert_array_equal(np.ldexp(plain[name], exponent), large[name])


def test_feed_toggles_are_named():
    base = RACK | {"rE": 0.0, "phi": 0.7}
    at = sweep.evaluate("feed", base, ["x_h", "y_h", "x_e", "y_e"]).iloc[0]
    w = math.hypot(at.x_h - at.x_e, at.y_h - at.y_e)
    f = math.hypot(RACK["fx"], RACK["fy"])
    codes = [
        sweep.evaluate("feed", base | {"q": q}, ["chi", "dchi"]).iloc[0] for q in (w + f, (w + f) * 1.001, abs(w - f))
    ]
    assert [c.status for c in codes] == [st.DEAD_POINT, st.NOT_ASSEMBLED, st.DEAD_POINT]
    assert math.isfinite(codes[0].chi) and math.isnan(codes[0].dchi) and math.isnan(codes[1].chi)
    assert sweep.evaluate("feed", base | {"fx": 0.0, "fy": 0.0}, "chi").status[0] == st.SINGULAR


def test_feed_jitted_equals_plain():
    rng = np.random.default_rng(1)
    matrix = np.array([[r["inputs"].get(name, 0.0) for name in FIELDS] for r in ROWS[:3]])
    phi = rng.uniform(-3.0, 3.0, (3, 4))

    def run(function, dtype):
        designs = matrix.astype(dtype)
        if dtype is np.complex128:
            designs[:, :21] += 1e-100j
        status, out = np.empty((3, 4), np.uint8), np.empty((18, 3, 4), dtype)
        with np.errstate(all="ignore"):
            function(designs, np.cos(phi), np.sin(phi), status, out)
        return [status, out]

    for dtype in (np.float64, np.complex128):
        for one, two in zip(run(feed.poses, dtype), run(feed.poses.py_func, dtype), strict=True):
            np.testing.assert_array_equal(one, two)
    heights = matrix.copy()
    heights[:, FIELDS.index("y_plate")] = run(feed.poses, np.float64)[1][13, :, 0]
    results = []
    for function in (feed.feeding, feed.feeding.py_func):
        status, out = np.empty(3, np.uint8), np.empty((len(FEEDING_OUTPUTS) + 1, 3))
        function(heights, status, out)
        results.append((status, out))
    np.testing.assert_array_equal(results[0][0], results[1][0])
    np.testing.assert_allclose(results[0][1], results[1][1], rtol=1e-12, atol=1e-12)  # errors are rounding themselves


def test_feed_complex_step_gives_exact_gradients():
    matrix = np.array([[RACK[name] for name in FIELDS]], complex)
    phi = np.array([[1.3]])
    for name in ("h_a", "h_b", "rh", "dh", "rE", "dE", "q", "fx", "ty"):
        turned = matrix.copy()
        turned[0, FIELDS.index(name)] += 1e-100j
        got = family("feed").poses(turned, Angles.of(phi), frozenset({"x_t", "y_t", "chi"}))

        def place(x, name=name):
            return naive.tooth(exact(RACK) | {name: x}, mpf("1.3"))

        with mp.workdps(40):
            slope = complex(mp.diff(place, mpf(RACK[name])))
        assert abs(complex(got["x_t"][0, 0].imag, got["y_t"][0, 0].imag) * 1e100 - slope) < 1e-11, name


def test_rise_is_that_of_the_stay_that_feeds_where_a_shorter_one_reaches_higher():
    rack = {"h_a": 0.522, "h_b": 3.368, "h_c": 2.079, "h_e": 2.497, "h_sigma": -1.0, "rh": 0.5644, "dh": -0.4279}
    rack |= {"xE": 2.862, "yE": 0.7761, "rE": 0.2249, "dE": 1.0429, "q": 2.0262, "fx": -1.9517, "fy": 0.3416}
    rack |= {"tx": -0.4583, "ty": 1.5281, "y_plate": 1.4528, "bar_branch": -1.0}
    names = ["phi_entry", "feed_angle", "rise", "crossings", "max_y_t"]
    got = sweep.summarise("feed", rack, names, accuracy=1e-9).iloc[0]
    phi = got.phi_entry + got.feed_angle * np.linspace(0.0, 1.0, 4001)
    heights = sweep.evaluate("feed", rack, ["y_t"], phi=phi).y_t - rack["y_plate"]
    # a step misses (feed_angle/8000)^2/2 of the bend at most
    assert got.rise == pytest.approx(heights.max(), abs=1e-6)
    assert got.crossings == 4.0 and got.max_y_t - rack["y_plate"] > got.rise + 0.05


@pytest.mark.parametrize("y_plate", [-0.0168, -0.0166, -0.0165])
def test_of_two_nearly_equal_stays_above_the_plate_the_longer_one_counts(y_plate):
    """The stays differ by less than a sample of the turn, and the samples show them as equally long."""
    design = {
        "h_a": 0.51216, "h_b": 3.74699, "h_c": 1.39102, "h_e": 4.5279, "rh": 0.83457, "dh": 2.27514, "xE": 6.36349,
        "yE": 0.75936, "rE": 0.1762, "dE": 1.28248, "q": 2.78387, "fx": -1.53956, "fy": 0.59574, "tx": -0.34673,
        "ty": 0.69334, "h_sigma": -1.0, "bar_branch": -1.0, "y_plate": y_plate,
    }  # fmt: skip
    phi = np.linspace(0.0, 2.0 * np.pi, 100_001)
    height = sweep.evaluate("feed", design, ["y_t"], phi=phi).y_t.to_numpy() - y_plate
    assert height[0] < 0.0
    before, after = height[:-1], height[1:]
    passes = np.flatnonzero((before > 0.0) != (after > 0.0))
    angles = phi[passes] + phi[1] * before[passes] / (before[passes] - after[passes])
    stays = angles[1::2] - angles[::2]
    assert len(stays) == 2 and 5e-4 < abs(stays[1] - stays[0]) < 2.0 * np.pi / 256
    longer = stays.argmax()
    found = sweep.summarise("feed", design, ["phi_entry", "feed_angle", "phi_leave"]).iloc[0]
    # a secant over 6e-5 rad misses a passage by its square
    assert found.phi_entry == pytest.approx(angles[2 * longer], abs=1e-7)
    assert found.phi_leave == pytest.approx(angles[2 * longer + 1], abs=1e-7)
    assert found.feed_angle == pytest.approx(stays[longer], abs=1e-7)
