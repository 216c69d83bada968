"""Heddle drive at kernel level: the 25-digit table, points and circles in 50 digits, symmetries, limits."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from mpmath import mp, mpf

import sweep
from kernels import status as st
from kernels.families import heddle
from sweep.families import family
from tests.reference import heddle as naive

ROWS = json.loads((Path(__file__).parents[2] / "oracle" / "heddle_open.json").read_text())["rows"]
CHAIN = [row for row in ROWS if row["kind"] == "chain"]
FIELDS = family("heddle").parameter_names
NAMES = ("chi", "dchi", "d2chi", "d3chi", "y", "dy", "d2y", "d3y")
TABLED = ("chi", "dchi", "d2chi", "y", "dy", "d2y")
# 8 roundings of each input: the closure adds a handful of roundings of the size of one in an input.
FACTOR = 8.0


def design(**given_values):
    values = dict.fromkeys(FIELDS, 0.0) | {"side_F": 1.0, "side_C": 1.0}
    return tuple((values | given_values)[name] for name in FIELDS)


def moved(designs, theta, dtype=np.float64, plain=False):
    """Outputs by name, places, and status of designs (n, 14) at angles (n, m)."""
    matrix, theta = np.atleast_2d(np.asarray(designs, dtype)), np.atleast_2d(theta)
    shape = (len(matrix), theta.shape[1])
    status = np.empty(shape, np.uint8)
    outs = [np.empty(shape, dtype) for _ in range(9)] + [np.empty((7, *shape), dtype)]
    function = heddle.poses.py_func if plain else heddle.poses
    with np.errstate(all="ignore"):
        function(matrix, np.cos(theta), np.sin(theta), status, heddle.Outputs(*outs))
    return dict(zip((*NAMES, "discriminant", "places"), outs, strict=True)) | {"status": status}


def of_row(row):
    given_values = {k: v for k, v in row["in"].items() if k in FIELDS}
    return design(**given_values), row["in"]["theta"]


@pytest.mark.parametrize("name", TABLED)
def test_heddle_matches_oracle_on_every_chain_row(name):
    worst = 0.0
    for row in CHAIN:
        one, theta = of_row(row)
        got = moved([one], [[theta]])
        assert got["status"][0, 0] == st.OK
        size = max(abs(mpf(row["out"][name])), naive.condition(one, theta, name))
        worst = max(worst, float(abs(mpf(float(got[name][0, 0])) - mpf(row["out"][name])) / (size * mpf(2) ** -53)))
    assert worst <= FACTOR


def test_heddle_transmission_angle_matches_oracle():
    for row in CHAIN:
        one, theta = of_row(row)
        got = moved([one], [[theta]])
        # the sine is a root of the discriminant: its error grows with its inverse
        error = abs(float(got["places"][0, 0, 0]) - float(row["out"]["sin_transmission"]))
        assert error <= 16.0 * 2.0**-53 * max(1.0, 1.0 / abs(float(row["out"]["sin_transmission"])))


LINKED = some.builds(
    design,
    O2B=some.floats(60.0, 110.0),
    BC=some.floats(180.0, 260.0),
    O3C=some.floats(110.0, 160.0),
    O2O3=some.floats(150.0, 250.0),
    O4E=some.floats(80.0, 160.0),
    chi_mid=some.floats(0.9, 1.5),
    O3D=some.floats(60.0, 150.0),
    O4F=some.floats(90.0, 160.0),
    O3O4=some.floats(500.0, 900.0),
    DF=some.just(700.0),
    EG=some.floats(300.0, 600.0),
    x_s=some.floats(-20.0, 100.0),
    side_F=some.sampled_from([-1.0, 1.0]),
    side_C=some.sampled_from([-1.0, 1.0]),
)


@settings(deadline=None, max_examples=15)
@given(LINKED, some.floats(-3.0, 3.0))
def test_heddle_with_a_general_link_and_a_short_rod_equals_points_and_circles(one, theta):
    got = moved([one], [[theta]])
    if got["status"][0, 0] != st.OK:
        return
    expected = naive.outputs(one, theta)
    near = min(abs(float(expected["sin_transmission"])), 1.0)
    for name in NAMES:
        order = NAMES.index(name) % 4
        # Each derivative loses two more powers of the distance from the toggle than the one before.
        size = max(1.0, abs(float(expected[name])), 100.0 if name.endswith("y") else 1.0)
        error = abs(float(got[name][0, 0]) - float(expected[name]))
        assert error <= 1e-11 * size / near ** (2 * order + 1) * _link_room(one, theta) ** -(2 * order + 1), name


def _link_room(one, theta):
    """Sine of the angle between the link DF and the shaft lever, at least 1e-3: the second toggle."""
    p = dict(zip(naive.NAMES, one, strict=True))
    at = naive.positions(one, theta)
    chi = float(at["chi"]) - p["chi_mid"]
    d = p["O3D"] * p["side_F"] * 1j * complex(math.cos(chi), math.sin(chi))
    reach = abs(p["O3O4"] - d)
    cos = (reach**2 - p["DF"] ** 2 - p["O4F"] ** 2) / (2.0 * p["DF"] * p["O4F"])
    slide = p["EG"] ** 2 - (float(mp.re(p["O4E"] * mp.expj(at["lam"]))) - p["x_s"]) ** 2
    return max(1e-3, min(math.sqrt(max(1.0 - cos * cos, 0.0)), math.sqrt(max(slide, 0.0)) / p["EG"]))


SOURCE = design(O2B=192.5, BC=225.0, O3C=138.5, O2O3=160.0, O4E=138.5, chi_mid=math.radians(65.0))


def test_heddle_equal_arms_and_link_as_long_as_the_frame_turn_the_levers_alike():
    theta = np.linspace(1.4, 1.7, 7)[None, :]
    parallel = moved([SOURCE], theta)
    lengths = dict(zip(FIELDS, SOURCE, strict=True)) | {"O3D": 138.5, "O4F": 138.5, "O3O4": 900.0}
    # links too long and too short by more than rounding, which would make a parallelogram: their mean is the parallel
    longer, shorter = (moved([design(**lengths | {"DF": 900.0 * (1.0 + k * 2.0**-48)})], theta) for k in (1, -1))
    for name in NAMES:
        np.testing.assert_allclose(0.5 * (longer[name] + shorter[name]), parallel[name], rtol=1e-12, atol=1e-12)
    chi = parallel["chi"]
    np.testing.assert_allclose(parallel["y"], 138.5 * np.sin(chi - SOURCE[5]), rtol=0, atol=1e-13)


def test_heddle_long_rods_lift_like_none():
    theta = np.linspace(1.4, 1.7, 7)[None, :]
    plain = moved([SOURCE], theta)
    long = moved([design(**(dict(zip(FIELDS, SOURCE, strict=True)) | {"EG": 1e9}))], theta)
    # the rod's tilt changes the lift by E's path across it, below 138.5^2/1e9 mm
    np.testing.assert_allclose(long["dy"], plain["dy"], rtol=0, atol=1e-4)


def test_heddle_mirrors_in_the_line_of_axes():
    p = dict(zip(FIELDS, SOURCE, strict=True))
    other = design(**(p | {"chi_mid": -p["chi_mid"], "side_C": -p["side_C"]}))
    one, two = moved([SOURCE], [[1.5]]), moved([other], [[-1.5]])
    for k, name in enumerate(NAMES):
        sign = 1.0 if k % 2 else -1.0
        assert two[name][0, 0] == sign * one[name][0, 0]


@pytest.mark.parametrize("exponent", [-330, -40, 40, 330])
def test_heddle_scaled_by_a_power_of_two_keeps_every_bit(exponent):
    lengths = [k for k, name in enumerate(FIELDS) if name not in ("chi_mid", "side_F", "side_C")]
    one = design(O2B=80.0, BC=220.0, O3C=130.0, O2O3=200.0, O4E=120.0, chi_mid=1.1, O3D=90.0, O4F=110.0,
                 O3O4=700.0, DF=701.0, EG=400.0, x_s=30.0)  # fmt: skip
    scaled = np.array(one)
    scaled[lengths] = np.ldexp(scaled[lengths], exponent)
    plain, large = moved([one], [[0.4]]), moved([scaled], [[0.4]])
    assert plain["status"][0, 0] == st.OK
    for name in NAMES:
        factor = exponent if name.endswith("y") else 0
        assert math.ldexp(plain[name][0, 0], factor) == large[name][0, 0]


def test_heddle_toggles_are_named_and_never_invented():
    # B on the line through O3 at the distance BC + O3C, BC - O3C, and half a unit beyond
    base = {"O2B": 100.0, "O3C": 60.0, "O2O3": 300.0, "O4E": 100.0, "chi_mid": 0.0}
    codes = {}
    for name, rod in (("stretched", 140.0), ("beyond", 139.5), ("folded", 260.0), ("free", 200.0)):
        got = moved([design(BC=rod, **base)], [[0.0]])
        codes[name] = got["status"][0, 0]
        if name in ("stretched", "folded"):
            assert np.isfinite(got["chi"][0, 0]) and np.isnan(got["dchi"][0, 0])
        if name == "beyond":
            assert np.isnan(got["chi"][0, 0]) and np.isnan(got["y"][0, 0])
    assert codes == {"stretched": st.DEAD_POINT, "beyond": st.NOT_ASSEMBLED, "folded": st.DEAD_POINT, "free": st.OK}
    on_pivot = moved([design(O2B=300.0, BC=60.0, O3C=60.0, O2O3=300.0, O4E=1.0, chi_mid=0.0)], [[0.0]])
    assert on_pivot["status"][0, 0] == st.SINGULAR
    short_rod = moved([design(**(dict(zip(FIELDS, SOURCE, strict=True)) | {"EG": 5.0}))], [[1.5]])
    assert short_rod["status"][0, 0] == st.NOT_ASSEMBLED
    assert moved([design(**(base | {"O3C": -60.0, "BC": 200.0}))], [[0.0]])["status"][0, 0] == st.INVALID_INPUT


def test_heddle_jitted_equals_plain():
    rng = np.random.default_rng(5)
    designs = np.array([of_row(row)[0] for row in CHAIN[:8]])
    designs[4:, 6:12] = [90.0, 110.0, 700.0, 701.0, 400.0, 30.0]
    theta = np.array([of_row(row)[1] for row in CHAIN[:8]])[:, None] + np.array([[0.0, 0.05, 2.0]])
    for dtype in (np.float64, np.complex128):
        matrix = designs.astype(dtype)
        if dtype is np.complex128:
            matrix[:, :6] += 1e-30j * rng.normal(size=(8, 6))
        one, two = moved(matrix, theta, dtype), moved(matrix, theta, dtype, plain=True)
        for name, values in one.items():
            np.testing.assert_array_equal(values, two[name])
    assert {st.OK, st.NOT_ASSEMBLED} <= set(one["status"].ravel())


def test_heddle_complex_step_gives_exact_gradients():
    one = design(O2B=80.0, BC=220.0, O3C=130.0, O2O3=200.0, O4E=120.0, chi_mid=1.1, O3D=90.0, O4F=110.0,
                 O3O4=700.0, DF=701.0, EG=400.0, x_s=30.0)  # fmt: skip
    for k in range(12):
        matrix = np.array([one], complex)
        matrix[0, k] += 1e-100j
        got = moved(matrix, [[0.4]], np.complex128)
        for name in ("chi", "dchi", "y", "d2y"):

            def output(x, k=k, name=name):
                values = [mpf(v) for v in one]
                values[k] = x
                order, letter = {"chi": (0, "chi"), "dchi": (1, "chi"), "y": (0, "y"), "d2y": (2, "y")}[name]
                return mp.diff(lambda t: naive.positions(tuple(values), t)[letter], mpf("0.4"), order)

            with mp.workdps(50):
                slope = float(mp.diff(output, mpf(one[k]), h=mpf(10) ** -12))
            assert got[name][0, 0].imag * 1e100 == pytest.approx(slope, rel=1e-9, abs=1e-12), (k, name)


def test_negative_control_other_side_fails_the_oracle():
    row = CHAIN[0]
    one, theta = of_row(row)
    got = moved([(*one[:-1], -one[-1])], [[theta]])
    assert abs(float(got["chi"][0, 0]) - float(row["out"]["chi"])) > 1e-3


@pytest.mark.parametrize("lacking", ["O3C", "BC", "O4F", "O3D", "DF", "O2B"])
def test_heddle_with_a_link_of_no_length_is_invalid_with_complex_numbers_too(lacking):
    values = {"O2B": 90.0, "BC": 225.0, "O3C": 138.5, "O2O3": 160.0, "O4E": 138.5, "chi_mid": 1.13,
              "O3D": 120.0, "O4F": 138.5, "O3O4": 900.0, "DF": 900.2}  # fmt: skip
    for dtype in (np.float64, np.complex128):
        got = moved([design(**values | {lacking: 0.0})], [[1.5]], dtype)
        assert got["status"][0, 0] == st.INVALID_INPUT
        assert np.isnan(got["y"][0, 0].real)


@pytest.mark.parametrize("arm", [1e2, 1e4, 4.5e5])
def test_heddle_of_long_arms_keeps_its_discriminant_and_its_speed(arm):
    """Bell crank and frame of 10^2 to 10^4 cam levers, alike but for 85: the difference of their squares lost 9 digits.

    The product loses none but those of its factors, a handful of roundings; the speed those of a c - e c/a as well.
    """
    long = design(O2B=30.0, BC=160.0, O3C=arm, O2O3=arm + 85.0, O4E=140.0, chi_mid=1.9)
    theta = np.linspace(0.1, 6.2, 25)
    got = moved(long, theta)
    assert (got["status"] == st.OK).all()
    with mp.workdps(50):
        a, b, c, e = (mpf(long[k]) for k in range(4))
        for k, angle in enumerate(theta):
            u, v = mpf(math.cos(angle)), mpf(math.sin(angle))
            x, y, w = e - a * u, -a * v, ((c - b) * (c + b) + a * a + e * e) / (2 * c) - a * e * u / c
            delta = x * x + y * y - w * w
            assert abs(got["discriminant"][0, k] - delta) <= 16.0 * 2.0**-53 * delta * float(b / mp.sqrt(delta)) ** 2
            root = mp.sqrt(delta)
            cos, sin = -(x * w + y * root) / (x * x + y * y), (x * root - y * w) / (x * x + y * y)
            rate = (a * (v * cos - u * sin) + a * e * v / c) / root
            assert abs(got["dchi"][0, k] - rate) <= 64.0 * 2.0**-53 * a / root


@pytest.mark.parametrize("accuracy", [{"accuracy": 1e-9}, {"samples": 360}])
def test_heddle_whose_bell_crank_turns_fully_keeps_its_other_outputs(accuracy):
    """An angle without extrema took those of all outputs that were searched with it."""
    drag = {"O2B": 0.97, "BC": 1.79, "O3C": 2.04, "O2O3": 0.61, "O4E": 0.94, "chi_mid": 0.0, "side_C": -1.0}
    others = ["max_dchi", "min_x_c", "rms_d2chi", "rms_y"]
    alone = sweep.summarise("heddle", drag, others, **accuracy)
    both = sweep.summarise("heddle", drag, ["max_chi", "rms_chi", "range_lam", *others], **accuracy)
    assert alone.status[0] == st.OK
    assert both.status[0] == st.NOT_OSCILLATING
    assert both[["max_chi", "rms_chi", "range_lam"]].isna().all(axis=None)
    # the same search for each; means of a grid are sums of the same samples
    np.testing.assert_array_equal(both[others], alone[others])


def test_heddle_lift_of_a_long_shaft_lever_is_that_of_its_angle():
    """A direction of another length than 1 lifted by 60 units too much; a sine near 1 forgives its angle's rounding."""
    long = {"O2B": 2.423058346717621, "BC": 2.855187349212298, "O3C": 0.6650897510175262, "O2O3": 1.3834714473222205}
    long |= {"O4E": 0.6104000708191432, "chi_mid": -0.9318545725884384, "O3D": 1.0, "O4F": 2000.0, "O3O4": 0.3}
    got = sweep.evaluate("heddle", long | {"DF": 1999.6701431976626}, ["y", "lam"], phi=[-1.2544152755692288]).iloc[0]
    assert got.status == st.OK
    assert abs(got.lam) > 1.5
    # sine, product and the addition theorem round once each
    assert got.y == pytest.approx(long["O4E"] * math.sin(got.lam), rel=4.0 * 2.0**-53)


def test_heddle_rounded_parallelogram_stays_one_beyond_its_dead_points():
    """The levers pass the frame's line: rounded arms left the other lever behind, so errors were those of a jump."""
    lengths = {"O2B": 36.2, "BC": 150.97, "O3C": 60.03, "O2O3": 162.85, "O4E": 154.71, "chi_mid": 2.1, "side_C": -1.0}
    same = {"O3D": 53.96, "O4F": 53.96, "O3O4": 411.44, "DF": 411.44}
    names = ["max_y", "min_y", "max_abs_d2y"]
    got = sweep.summarise("heddle", lengths | same, names, accuracy=1e-8).iloc[0]
    plain = sweep.summarise("heddle", lengths, names, accuracy=1e-8).iloc[0]
    assert got.max_y == pytest.approx(lengths["O4E"], rel=1e-14)  # the shaft lever stands upright there
    for name in names:
        assert got[name] == plain[name]
        assert got[f"err_{name}"] <= 1e-7 * (plain.max_y - plain.min_y)


@pytest.mark.parametrize("name", ["O3D", "O4F", "O3O4", "DF"])
def test_gradient_of_a_parallelogram_by_one_length_is_that_of_the_linkage(name):
    """A complex step in one length of a parallelogram was lost where the linkage counted as one all the same."""
    arms = dict.fromkeys(("O3D", "O4F"), 90.0) | dict.fromkeys(("O3O4", "DF"), 260.0)
    lengths = {"O2B": 40.0, "BC": 150.0, "O3C": 60.0, "O2O3": 160.0, "O4E": 85.0, "chi_mid": 1.5} | arms
    angles, k, step = np.linspace(0.9, 1.5, 5), FIELDS.index(name), 1e-4
    shifted = np.tile(design(**lengths), (3, 1)).astype(np.complex128)
    shifted[:, k] += np.array([step, -step, 1e-20j])
    got = moved(shifted, np.tile(angles, (3, 1)), np.complex128)["y"]
    by_differences = (got[0] - got[1]).real / (2.0 * step)
    assert np.abs(by_differences).min() > 1e-3
    # central differences of a smooth function: the square of step/length, and rounding over the step
    np.testing.assert_allclose(got[2].imag / 1e-20, by_differences, rtol=1e-7, atol=1e-8)


SHORT_OF = {"O2B": 1.0, "BC": 4.0, "O3C": 2.5, "O2O3": 4.4, "O4E": 3.0, "chi_mid": 1.4, "side_F": 1.0, "side_C": 1.0}
LINKED_ARMS = {"O3D": 1.2, "O4F": 2.2, "O3O4": 4.0}


def _reaches(values):
    """Lengths that link and heddle rod need over the turn, from points and circles (the rod with x_s = 0.3)."""
    b = values["O2B"] * np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 100_001))
    ray = values["O2O3"] - b
    along = (values["BC"] ** 2 - values["O3C"] ** 2 + np.abs(ray) ** 2) / (2.0 * np.abs(ray))
    c = b + (along + 1j * np.sqrt(values["BC"] ** 2 - along**2)) * ray / np.abs(ray)
    turned = (c - values["O2O3"]) * np.exp(-1j * values["chi_mid"]) / values["O3C"]
    link = np.abs(LINKED_ARMS["O3O4"] - LINKED_ARMS["O3D"] * 1j * turned)
    return float(link.max()) - LINKED_ARMS["O4F"], float(np.abs(values["O4E"] * turned.real - 0.3).max())


# The ends of the reach are smooth extremes: 100 000 angles find them to 1e-9 of a length, far below these parts.
@pytest.mark.parametrize("part", [1e-1, 1e-3, 1e-6])
@pytest.mark.parametrize("chain", ["heddle", ["rssr", "heddle"]])
def test_a_heddle_whose_link_or_rod_does_not_reach_within_the_turn_is_not_rotatable(chain, part):
    link, rod = _reaches(SHORT_OF)
    table = [
        SHORT_OF | lengths | {"x_s": 0.3}
        for sign in (1.0, -1.0)
        for lengths in (LINKED_ARMS | {"DF": link * (1.0 + sign * part)}, {"EG": rod * (1.0 + sign * part)})
    ]
    table = {name: [one.get(name, 0.0) for one in table] for name in FIELDS}
    if chain != "heddle":  # behind a double crank, which turns the cam lever fully
        first = {"a": 4.0, "b": 4.0, "c": 4.2, "e": 1.0, "f": 0.0, "g": 0.0, "alpha": 0.0}
        table = {f"{k}2": v for k, v in table.items()} | {f"{k}1": [v] * 4 for k, v in first.items()}
    for settings_of in ({"accuracy": 1e-9}, {"samples": 64}):
        got = sweep.summarise(chain, table, ["rotatable", "margin", "max_pressure_angle"], **settings_of)
        assert got["rotatable"].tolist() == [True, True, False, False]
        assert got["status"].tolist() == [st.OK, st.OK, st.NOT_ROTATABLE, st.NOT_ROTATABLE]
        # the rod of the cam lever reaches: its discriminant is positive and would be no margin of what jams
        assert np.isfinite(got["margin"]).tolist() == [True, True, False, False]
        assert np.isfinite(got["max_pressure_angle"]).tolist() == [True, True, False, False]
