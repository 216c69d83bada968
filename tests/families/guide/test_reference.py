"""Guided four-bar against joint geometry, plain Python, symmetries and exact gradients."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import sweep
from kernels import status as st
from kernels.families import guide
from kernels.families.guide import motion
from sweep.families import family
from sweep.families.base import Angles
from tests.reference import guide as naive
from tests.support.guided_sensitivities import dev_sensitivities

WANT = ["s", "ds", "d2s", "d3s", "dev", "ddev", "d2dev"]
NAMES = family("guide").parameter_names
PHI = 0.7


def by_construction(a, c, e, psi, point, lam, h):
    """Links measured on joints placed first, so that the mechanism assembles; the branch follows from the places."""
    dx, dy = e + c * math.cos(psi) - a * math.cos(PHI), c * math.sin(psi) - a * math.sin(PHI)
    branch = math.copysign(1.0, dy * math.cos(psi) - dx * math.sin(psi))
    return a, math.hypot(dx, dy), c, e, *point, lam, h, branch


MECHANISMS = some.builds(
    by_construction,
    a=some.floats(0.1, 1.0),
    c=some.floats(1.0, 3.0),
    e=some.floats(-3.0, 3.0),
    psi=some.floats(-3.0, 3.0),
    point=some.tuples(some.floats(-3.0, 3.0), some.floats(-3.0, 3.0)),
    lam=some.floats(-3.0, 3.0),
    h=some.floats(-3.0, 3.0),
)


def evaluated(design, phi, want):
    return sweep.evaluate("guide", dict(zip(NAMES, design, strict=True)), want, phi=[phi]).iloc[0]


def away_from_dead_points(design):
    """Transmission angle at least 17 deg and no vanishing coupler: the condition numbers stay below 1e6."""
    row = evaluated(design, PHI, ["pressure_angle"])
    return design[1] > 0.2 and row.status == st.OK and math.cos(row.pressure_angle) > 0.3


@settings(deadline=None, max_examples=25)
@given(MECHANISMS.filter(away_from_dead_points))
def test_guide_equals_joint_geometry(design):
    row, expected = evaluated(design, PHI, WANT), naive.outputs(design, PHI)
    for name in WANT:
        assert float(abs(row[name] - expected[name])) < 1e6 * 2.0**-52, name


@settings(deadline=None, max_examples=25)
@given(MECHANISMS.filter(away_from_dead_points))
def test_guide_joints_close_the_loop(design):
    a, b, c, e, xi, eta, lam, h, branch = design
    j = evaluated(design, PHI, ["x_b", "y_b", "x_c", "y_c", "x_m", "y_m", "s", "dev", "pressure_angle"])
    coupler, rocker = np.array([j.x_c - j.x_b, j.y_c - j.y_b]), np.array([j.x_c - e, j.y_c])
    assert np.hypot(j.x_b, j.y_b) == pytest.approx(a, rel=1e-15)
    assert np.linalg.norm(coupler) == pytest.approx(b, rel=1e-12)
    assert np.linalg.norm(rocker) == pytest.approx(c, rel=1e-12)
    across = (coupler[1] * rocker[0] - coupler[0] * rocker[1]) / c  # of the force on the rocker
    assert across == pytest.approx(branch * b * math.cos(j.pressure_angle), rel=1e-11)
    assert np.hypot(j.x_m - j.x_b, j.y_m - j.y_b) == pytest.approx(math.hypot(xi, eta), rel=1e-12, abs=1e-13)
    assert j.x_m * math.cos(lam) + j.y_m * math.sin(lam) == pytest.approx(j.s, abs=1e-12)
    assert j.y_m * math.cos(lam) - j.x_m * math.sin(lam) - h == pytest.approx(j.dev, abs=1e-12)


@settings(deadline=None, max_examples=25)
@given(MECHANISMS.filter(away_from_dead_points))
def test_guide_mirrors_about_the_frame(design):
    a, b, c, e, xi, eta, lam, h, branch = design
    one = evaluated(design, PHI, WANT)
    other = evaluated((a, b, c, e, xi, -eta, -lam, -h, -branch), -PHI, WANT)
    for name in WANT:
        sign = (-1.0 if "dev" in name else 1.0) * (-1.0 if name in ("ds", "d3s", "ddev") else 1.0)
        assert one[name] == sign * other[name], name


def test_guide_coupler_point_on_a_pin_moves_like_the_pin():
    phi = np.linspace(0.0, 6.0, 25)
    table = {"a": 1.0, "b": 3.0, "c": 2.5, "e": 3.0, "xi": [0.0, 3.0], "eta": 0.0, "lam": 0.0, "h": 0.0}
    frame = sweep.evaluate("guide", table, [*WANT, "x_c", "y_c"], phi)
    crank, rocker = frame[frame.design == 0], frame[frame.design == 1]
    np.testing.assert_allclose(crank.s, np.cos(phi), atol=4e-16)
    np.testing.assert_allclose(crank.d3s, np.sin(phi), atol=4e-16)
    np.testing.assert_allclose(crank.d2dev, -np.sin(phi), atol=4e-16)
    np.testing.assert_allclose(rocker.s, rocker.x_c, atol=2e-15)
    np.testing.assert_allclose(rocker.dev, rocker.y_c, atol=2e-15)


def test_guide_four_bar_is_the_planar_crank_rocker():
    phi = np.linspace(0.0, 6.0, 25)
    links = {"a": 1.0, "b": 3.0, "c": 2.5, "e": -3.0, "branch": [1.0, -1.0]}
    planar = sweep.evaluate(
        "guide",
        links | {"xi": 3.0, "eta": 0.0, "lam": 0.0, "h": 0.0},
        ["s", "ds", "discriminant", "pressure_angle"],
        phi,
    )
    spatial = sweep.evaluate(
        "rssr", links | {"f": 0.0, "g": 0.0, "alpha": 0.0}, ["psi", "dpsi", "discriminant", "pressure_angle"], phi
    )
    np.testing.assert_allclose(planar.s, -3.0 + 2.5 * np.cos(spatial.psi), atol=4e-15)
    np.testing.assert_allclose(planar.ds, -2.5 * np.sin(spatial.psi) * spatial.dpsi, atol=4e-15)
    np.testing.assert_allclose(planar.discriminant, spatial.discriminant, rtol=1e-14)
    np.testing.assert_allclose(planar.pressure_angle, spatial.pressure_angle, atol=4e-15)


def random_designs(count, seed):
    rng = np.random.default_rng(seed)
    links = rng.uniform(0.5, 2.0, (count, 4))
    return np.column_stack([links, rng.uniform(-2.0, 2.0, (count, 4)), rng.choice([-1.0, 1.0], count)])


def test_guide_jitted_equals_plain():
    designs, phi = random_designs(12, 5), np.random.default_rng(6).uniform(-4.0, 4.0, (12, 5))

    def run(function, dtype):
        status = np.empty((12, 5), np.uint8)
        out = [np.empty((12, 5), dtype) for _ in range(9)] + [np.empty((6, 12, 5), dtype)]
        function(designs.astype(dtype), np.cos(phi), np.sin(phi), status, motion.Outputs(*out))
        return [status, *out]

    for dtype in (np.float64, np.complex128):
        for jitted, plain in zip(run(guide.poses, dtype), run(guide.poses.py_func, dtype), strict=True):
            np.testing.assert_array_equal(jitted, plain)
    assert {st.OK, st.NOT_ASSEMBLED} <= set(run(guide.poses, np.float64)[0].ravel())


def test_guide_computing_less_changes_no_bit():
    designs, angles = random_designs(20, 7), Angles.of(np.linspace(0.0, 6.0, 9)[None, :])
    everything = family("guide").poses(designs, angles, frozenset(family("guide").pose_names))
    for name in family("guide").pose_names:
        alone = family("guide").poses(designs, angles, frozenset({name}))
        assert set(alone) == {name, "status"}
        np.testing.assert_array_equal(alone[name], everything[name])


def test_guide_complex_step_and_sensitivities_give_exact_gradients_of_dev():
    design, phi = (1.1, 3.2, 2.7, 3.1, 4.0, -0.7, 0.4, 0.9, -1.0), 2.3
    sensitivities, _ = dev_sensitivities(design, phi)
    assert sensitivities[0] == pytest.approx(evaluated(design, phi, ["ddev"]).ddev, rel=1e-14)
    for k in range(8):
        step = np.array([design], dtype=complex)
        step[0, k] += 1e-100j
        columns = family("guide").poses(step, Angles.of(np.array([[phi]])), frozenset({"dev", "d3s", "pressure_angle"}))
        expected = float(naive.dev_slope(design, phi, k))
        assert columns["dev"][0, 0].imag / 1e-100 == pytest.approx(expected, rel=1e-13, abs=1e-14)
        assert sensitivities[1 + k] == pytest.approx(expected, rel=1e-13, abs=1e-14)
        h = 1e-5
        shifted = [[x + d * (i == k) for i, x in enumerate(design)] for d in (-h, h)]
        lower, upper = (evaluated(x, phi, ["d3s", "pressure_angle"]) for x in shifted)
        for name in ("d3s", "pressure_angle"):
            difference = (upper[name] - lower[name]) / (2.0 * h)
            assert columns[name][0, 0].imag / 1e-100 == pytest.approx(difference, rel=1e-7, abs=1e-8), name


@pytest.mark.parametrize(
    ("change", "status"),
    [
        ({}, st.OK),
        ({"e": 6.0}, st.DEAD_POINT),
        ({"e": 7.0}, st.NOT_ASSEMBLED),
        ({"e": 1.0, "b": 3.0}, st.SINGULAR),
        ({"e": 1.0, "b": 2.5}, st.NOT_ASSEMBLED),
        ({"c": 1e-310}, st.INVALID_INPUT),
        ({"xi": 1e300, "b": 1e-10}, st.INVALID_INPUT),
    ],
)
def test_guide_status_explains_every_nan(change, status):
    table = {"a": 1.0, "b": 2.0, "c": 3.0, "e": 3.0, "xi": 1.0, "eta": 2.0, "lam": 0.3, "h": 0.1} | change
    names = [o.name for o in family("guide").pose_outputs]
    row = sweep.evaluate("guide", table, names, phi=[0.0]).iloc[0]
    assert row.status == status
    if status == st.OK:
        assert np.isfinite(row[names]).all()
    elif status == st.DEAD_POINT:  # the coupler and the rocker in line between x = 1 and x = 6
        assert (row.x_c, row.y_c, row.x_m, row.y_m) == (3.0, 0.0, 2.0, 2.0)
        assert row[["s", "dev", "pressure_angle"]].notna().all()
        assert row[["ds", "d2s", "d3s", "ddev", "d2dev"]].isna().all()
    else:
        assert row[[*WANT, "pressure_angle", "x_c", "x_m"]].isna().all()


def test_guide_kernel_calls_a_nonsense_design_invalid():
    good = [1.0, 2.0, 3.0, 3.0, 1.0, 2.0, 0.3, 0.1, 1.0]
    changes = [(k, bad) for k in range(9) for bad in (math.nan, math.inf)] + [(0, 0.0), (1, -2.0), (2, 0.0), (8, 0.5)]
    for k, bad in changes:
        design = np.array([good])
        design[0, k] = bad
        columns = family("guide").poses(design, Angles.of(np.array([[0.4]])), frozenset({"s", "discriminant"}))
        assert columns["status"][0, 0] == st.INVALID_INPUT, (k, bad)
        assert np.isnan(columns["s"][0, 0])
        assert np.isnan(columns["discriminant"][0, 0])


def test_negative_control_clipped_cosine_assembles_what_does_not_reach():
    # rocker angle by the law of cosines with a clipped arccosine, as often seen: a plausible place for no mechanism
    a, b, c, e = 1.0, 2.0, 3.0, 7.0
    diagonal = e - a
    clipped = math.acos(max(-1.0, min(1.0, (diagonal**2 + c**2 - b**2) / (2.0 * diagonal * c))))
    assert math.isfinite(clipped)
    table = {"a": a, "b": b, "c": c, "e": e, "xi": 1.0, "eta": 2.0, "lam": 0.3, "h": 0.1}
    row = sweep.evaluate("guide", table, ["s"], phi=[0.0]).iloc[0]
    assert (row.status, math.isnan(row.s)) == (st.NOT_ASSEMBLED, True)
