"""Thread tension: the numbers of the source, the limits of the law, plain references, and hard inputs."""

from __future__ import annotations

import warnings

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from mpmath import mp

import sweep
from kernels import status as st
from kernels.effects.thread import capstan, contour_of_least_tension, thread_contour, thread_speed
from tests.reference import thread as reference

RADII = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 7.5)
EULER = {"R": 1.0, "theta_deg": 90.0, "alpha": 0.0, "B": 0.0}


def tension(**columns):
    return sweep.thread.contour(columns)["T2"].to_numpy()


def test_tension_is_the_reported_55_gf_behind_a_quarter_turn_of_the_same_thread():
    # 20 e^(0.0112 90) = 54.80; the source measured 55 gf, and 40 gf with the improved finish.
    assert tension(T1=20.0, **EULER)[0] == pytest.approx(54.8023, abs=5e-5)
    assert tension(T1=20.0, **EULER, beta=7.70e-3)[0] == pytest.approx(40.0, abs=0.01)


def test_tension_of_the_full_law_over_the_same_thread_is_not_the_reported_one():
    # R = r, B and alpha as reported: 80.4 gf, so only Euler's limit reproduces the 55 gf.
    r = sweep.thread.contour({"T1": 1.0, "R": 1.0, "theta_deg": 1.0})["r_thread"][0]
    with pytest.warns(sweep.thread.MeasuredRangeWarning):
        assert tension(T1=20.0, R=r, theta_deg=90.0)[0] == pytest.approx(80.4, abs=0.2)


def test_wraps_at_the_needle_eye_are_those_that_reproduce_the_reported_tensions():
    # The source reports 275 and 50 gf behind the needle's eye but no wrap angle: these are plausible, no more.
    assert tension(T1=20.0, **(EULER | {"theta_deg": 234.0}))[0] == pytest.approx(275.0, rel=2e-3)
    assert tension(T1=20.0, **(EULER | {"theta_deg": 81.8}))[0] == pytest.approx(50.0, rel=2e-3)
    assert tension(T1=20.0, R=0.125, theta_deg=193.5)[0] == pytest.approx(275.0, rel=5e-3)
    assert tension(T1=20.0, R=0.125, theta_deg=57.8)[0] == pytest.approx(50.0, rel=5e-3)


def test_tension_over_the_series_of_radii_falls_to_a_minimum_and_rises():
    got = tension(T1=5.0, R=list(RADII), theta_deg=90.0)
    # The table of the sheet, to its three digits.
    np.testing.assert_allclose(got, [36.3, 23.5, 17.5, 15.7, 15.9, 17.6, 20.9], atol=0.06)
    best = sweep.thread.least_tension_radius({})["R_least"][0]
    assert best == pytest.approx(1.26, abs=5e-3)
    around = tension(T1=5.0, R=best * np.array([0.99, 1.0, 1.01]), theta_deg=90.0)
    assert around[1] < around[0] and around[1] < around[2]


def test_speed_ratio_passes_through_the_reported_points():
    slow, reference_speed, fast = sweep.thread.speed({"v": [0.08, 1.23, 7.4]})["ratio_to_ref"]
    assert reference_speed == 1.0
    assert 1.0 / slow == pytest.approx(1.19, rel=1e-14)
    assert fast == pytest.approx(1.16, rel=1e-14)


TAKE_UP = {"a": [20.0, 15.0, 24.0], "e": 30.0, "f": 10.0, "alpha": 0.5, "Z1": -30.0, "Z2": 40.0, "P_h": 60.0}
EVERY_SPEED = {"thread_speed_low": 0.0, "thread_speed_high": 1e9}


@pytest.mark.parametrize("target", [1e-3, 1e-9])
def test_largest_speed_ratio_over_the_turn_is_that_of_the_fastest_thread_and_the_least_is_not_claimed(target):
    table = TAKE_UP | EVERY_SPEED | {"speed": 520.0}
    names = ["max_speed_ratio", "min_speed_ratio", "max_abs_thread_speed"]
    found = sweep.summarise("eyelet", table, names[:1], accuracy=target)
    assert (found.status == st.OK).all()
    fastest = sweep.summarise("eyelet", table, names[2:], accuracy=1e-12).max_abs_thread_speed
    share, exponent = sweep.effects.effect("thread_speed").inputs[-4:-2]
    exact = 1.0 + share.default * ((fastest / 1230.0) ** exponent.default - 1.0)
    # the fastest thread is known to 1e-12
    assert (np.abs(found.max_speed_ratio - exact) <= found.err_max_speed_ratio + 1e-12).all()
    least = sweep.summarise("eyelet", table, names[1:2], accuracy=target)
    # a thread at rest: a cusp that no pose reaches, so the number is not sure and its error says by how much
    assert (least.status == st.NOT_CONVERGED).all()
    assert (least.min_speed_ratio - (1.0 - share.default) <= least.err_min_speed_ratio).all()


def test_speed_ratio_ends_with_the_measured_speeds():
    """The thread is slower than 0.08 m/s where it reverses, and at most as fast as 10, 6.5 and 13 m/s."""
    phi = np.linspace(0.0, 6.28, 315)
    for speed in (520.0, -520.0, 0.1):
        table = TAKE_UP | {"speed": speed}
        poses = sweep.evaluate("eyelet", table, ["thread_speed", "speed_ratio"], phi=phi)
        law = sweep.thread.speed({"v": np.clip(np.abs(poses.thread_speed) / 1e3, 0.08, 7.4)}).ratio_to_ref
        # Both are the law; the speeds differ by the rounding of a division.
        np.testing.assert_allclose(poses.speed_ratio, law, rtol=4e-16)
    found = sweep.summarise("eyelet", TAKE_UP | {"speed": 300.0}, ["max_speed_ratio", "min_speed_ratio"], accuracy=1e-9)
    assert (found.status == st.OK).all()
    assert (np.abs(found.min_speed_ratio - 1.0 / 1.19) <= found.err_min_speed_ratio + 1e-15).all()
    fastest = sweep.summarise("eyelet", TAKE_UP | {"speed": 300.0}, ["max_abs_thread_speed"], accuracy=1e-12)
    most = sweep.thread.speed({"v": np.minimum(fastest.max_abs_thread_speed / 1e3, 7.4)}).ratio_to_ref
    assert (np.abs(found.max_speed_ratio - most) <= found.err_max_speed_ratio + 1e-12).all()


def test_speed_ratio_of_a_thread_at_rest_is_what_does_not_depend_on_speed():
    with pytest.warns(sweep.thread.MeasuredRangeWarning):
        got = sweep.thread.speed({"v": [0.0, -1.23]})["ratio_to_ref"]
    assert got[0] == pytest.approx(1.0 - 0.39494858849527207, rel=1e-15)
    assert got[1] == 1.0


@settings(deadline=None, max_examples=40)
@given(
    t1=some.floats(0.0, 100.0), radius=some.floats(0.0, 10.0), theta=some.floats(0.0, 720.0),
    alpha=some.floats(0.0, 0.05), beta=some.floats(0.0, 0.05), b=some.floats(0.0, 5.0),
)  # fmt: skip
def test_tension_solves_the_differential_equation_of_the_law(t1, radius, theta, alpha, beta, b):
    row = {"T1": t1, "R": radius, "theta_deg": theta, "alpha": alpha, "beta": beta, "B": b, "N": 30.0, "gamma": 0.8}
    got = sweep.thread.contour(row)
    expected = reference.tension_behind(t1, radius, theta, alpha, beta, b, got["r_thread"][0])
    # Eight roundings of the kernel; e^x adds the rounding of x = beta theta, at most 36 of them.
    assert abs(got["T2"][0] - expected) <= (8.0 + 2.0 * beta * theta) * 2.0**-53 * float(expected) + 1e-300


def test_tension_without_friction_grows_with_the_length_of_contact_only():
    got = tension(T1=3.0, R=2.0, theta_deg=50.0, beta=0.0, alpha=0.01)
    assert got[0] == pytest.approx(3.0 + 0.01 * 2.0 * 50.0, rel=1e-15)
    nearly = tension(T1=3.0, R=2.0, theta_deg=50.0, beta=1e-12, alpha=0.01)
    assert nearly[0] == pytest.approx(got[0], rel=1e-9)


def test_tension_of_a_sharp_edge_is_finite_and_that_of_a_straight_thread_unchanged():
    row = {"T1": 5.0, "R": 0.0, "theta_deg": 90.0, "B": 0.714}
    got = sweep.thread.contour(row)
    e = np.exp(0.0112 * 90.0)
    assert got["T2"][0] == pytest.approx(5.0 * e + 0.714 / got["r_thread"][0] ** 2 * (e - 1.0), rel=1e-14)
    assert tension(T1=5.0, R=1.0, theta_deg=0.0)[0] == 5.0


def test_path_leads_the_tension_behind_one_contour_to_the_next():
    contours = pd.DataFrame({"R": [1.0, 0.5, 2.0], "theta_deg": [90.0, 30.0, 180.0]})
    got = sweep.thread.path([5.0, 8.0], contours)
    assert list(got.columns) == ["T1", "T2", "T3", "T4", "status"]
    for k in range(3):
        step = tension(T1=got[f"T{k + 1}"], R=contours.R[k], theta_deg=contours.theta_deg[k])
        np.testing.assert_array_equal(got[f"T{k + 2}"], step)


def test_path_over_a_turn_takes_wrap_angles_that_change():
    angles = np.array([[90.0, 45.0, 0.0], [10.0, 20.0, 30.0]])
    got = sweep.thread.path(5.0, {"R": [1.0, 2.0]}, angles)
    for j in range(3):
        alone = sweep.thread.path(5.0, {"R": [1.0, 2.0], "theta_deg": angles[:, j]})
        assert got["T3"][j] == alone["T3"][0]


def test_equal_contours_in_sequence_are_one_contour_of_the_sum_of_the_wraps():
    # Of one radius: the law is a differential equation along the wrap.
    once = tension(T1=4.0, R=1.5, theta_deg=120.0)[0]
    parts = sweep.thread.path(4.0, {"R": [1.5] * 3, "theta_deg": [20.0, 70.0, 30.0]})["T4"][0]
    assert parts == pytest.approx(once, rel=4e-15)


@pytest.mark.parametrize("angles", [np.zeros(3), np.zeros((3, 2))])
def test_path_refuses_wrap_angles_that_do_not_fit_the_contours(angles):
    with pytest.raises(sweep.InputError, match="one row for each of the 2 contours"):
        sweep.thread.path(5.0, {"R": [1.0, 2.0]}, angles)


def test_path_refuses_tensions_that_do_not_fit_the_poses():
    with pytest.raises(sweep.InputError, match="one per pose of theta_deg, 3"):
        sweep.thread.path([5.0, 6.0], {"R": [1.0, 2.0]}, np.zeros((2, 3)))


@pytest.mark.parametrize("start, angles", [(-5.0, [[20.0]]), (np.nan, [[20.0]]), (5.0, [[-20.0]]), (5.0, [[np.inf]])])
def test_path_refuses_tensions_and_wrap_angles_that_are_negative_or_no_numbers(start, angles):
    with pytest.raises(sweep.InputError, match="a finite number that is not negative"):
        sweep.thread.path(start, {"R": [1.0]}, angles)


def test_radius_outside_the_measured_range_warns_only_for_reported_constants():
    with pytest.warns(
        sweep.thread.MeasuredRangeWarning, match=r"R = 0\.1 to 8 mm: 2 of 3 values outside 0\.125 to 7\.5 mm"
    ):
        sweep.thread.contour({"T1": 5.0, "R": [0.1, 1.0, 8.0], "theta_deg": 90.0})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sweep.thread.contour({"T1": 5.0, "R": [0.1, 8.0], "theta_deg": 90.0, "beta": 1.0e-2})
        sweep.thread.contour({"T1": 5.0, "R": [0.125, 7.5], "theta_deg": 90.0})
        sweep.thread.speed({"v": [0.01], "K": 0.3})


@pytest.mark.parametrize(
    ("column", "value"), [("T1", -1.0), ("R", -0.1), ("beta", -1e-3), ("N", 0.0), ("theta_deg", float("nan"))]
)
def test_impossible_input_is_refused_with_its_column(column, value):
    with pytest.raises(sweep.InputError, match=column):
        sweep.thread.contour({"T1": 5.0, "R": 1.0, "theta_deg": 90.0} | {column: value})


def test_tension_beyond_float64_says_so():
    got = sweep.thread.contour({"T1": [5.0, 5.0], "R": 1.0, "theta_deg": [90.0, 1e6], "beta": 0.01})
    assert list(got.status) == [st.OK, st.INVALID_INPUT]
    assert np.isnan(got["T2"][1]) and np.isfinite(got["T2"][0])


def test_least_tension_radius_has_its_limits():
    got = sweep.thread.least_tension_radius({"alpha": [0.0, 6e-3, 0.0], "B": [0.7, 1e-9, 0.0]})
    assert got.R_least[0] == np.inf and got.status[0] == st.OK
    assert got.R_least[1] == 0.0 and got.status[1] == st.OK
    assert np.isnan(got.R_least[2]) and got.status[2] == st.SINGULAR


def test_force_on_the_eyelet_is_the_sum_of_the_pulls():
    wrap, mu = np.array([1e-9, 0.3, 1.5, 3.1]), 0.2
    got = sweep.thread.capstan({"T1": 2.0, "wrap": wrap, "mu": mu})
    t2 = 2.0 * np.exp(mu * wrap)
    with mp.workdps(40):
        for k, angle in enumerate(wrap):
            ratio = mp.exp(mp.mpf(mu) * mp.mpf(angle))
            x, y = 2 * ratio * mp.cos(mp.mpf(angle)) - 2, 2 * ratio * mp.sin(mp.mpf(angle))
            # A nearly straight thread puts hardly any force on the eyelet; its digits are there all the same.
            assert float(abs(got["force"][k] / mp.sqrt(x**2 + y**2) - 1)) <= 8.0 * 2.0**-53
    np.testing.assert_allclose(got["T2"], t2, rtol=1e-15)


def test_compiled_tension_equals_plain_python_bit_for_bit():
    rng = np.random.default_rng(3)
    before, theta = rng.uniform(0.0, 50.0, (6, 5)), rng.uniform(0.0, 700.0, (6, 5))
    data = rng.uniform(0.0, 1.0, (6, 6)) * [8.0, 0.02, 0.02, 2.0, 50.0, 1.5]
    data[0, 2], data[1, 0], data[2, 4] = 0.0, 0.0, -1.0
    results = []
    for kernel in (thread_contour, thread_contour.py_func):
        out, status = [np.empty((6, 5)) for _ in range(5)], np.zeros((6, 5), np.uint8)
        kernel(before, theta, data, status, *out)
        results.append([status, *out])
    for kernel in (thread_speed, thread_speed.py_func):
        ratio, status = np.empty((6, 5)), np.zeros((6, 5), np.uint8)
        kernel(before - 20.0, np.tile([1.23, 0.4, 0.2], (6, 1)), status, ratio)
        results[kernel is not thread_speed] += [status, ratio]
    for kernel in (capstan, capstan.py_func):
        out, status = [np.empty((6, 5)) for _ in range(2)], np.zeros((6, 5), np.uint8)
        kernel(before, theta, data[:, 1], status, *out)
        results[kernel is not capstan] += [status, *out]
    radius = [np.empty(6), np.empty(6)]
    for kernel, out in zip((contour_of_least_tension, contour_of_least_tension.py_func), radius, strict=True):
        kernel(np.abs(data), out)
    for compiled, plain in zip([*results[0], radius[0]], [*results[1], radius[1]], strict=True):
        # exp, expm1, log and pow of numba and of Python may differ in the last bit.
        np.testing.assert_allclose(compiled, plain, rtol=4e-16)
