"""Spatial slider-crank against joint geometry, plain Python, exact gradients, and a published benchmark."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from mpmath import mp

import sweep
from kernels import status as st
from kernels.families import rssp
from kernels.families.rssp import motion
from sweep.families import family
from sweep.families.base import Angles
from tests.reference import rssp as naive

WANT = ["s", "ds", "d2s", "d3s", "pressure_angle"]
NAMES = family("rssp").parameter_names


def by_construction(a, e, f, alpha, phi, reach, branch):
    """Links measured on joints placed first, so that the mechanism assembles; ``reach`` = sqrt(Q)."""
    m, n = e - a * math.cos(phi), f * math.cos(alpha) - a * math.sin(alpha) * math.sin(phi)
    return a, math.sqrt(m * m + n * n + reach * reach), e, f, alpha, branch


MECHANISMS = some.builds(
    by_construction,
    a=some.floats(0.1, 2.0),
    e=some.floats(-3.0, 3.0),
    f=some.floats(-3.0, 3.0),
    alpha=some.floats(-3.1, 3.1),
    phi=some.just(0.7),
    reach=some.floats(1.0, 5.0),
    branch=some.sampled_from([-1.0, 1.0]),
)


def evaluated(design, phi, want):
    return sweep.evaluate("rssp", dict(zip(NAMES, design, strict=True)), want, phi=[phi]).iloc[0]


@settings(deadline=None, max_examples=25)
@given(MECHANISMS)
def test_rssp_equals_joint_geometry(design):
    frame, expected = evaluated(design, 0.7, WANT), naive.outputs(design, 0.7)
    for name in WANT:
        # links are at most 8 long and sqrt(Q) at least 1: condition numbers below 1e4
        assert float(abs(frame[name] - expected[name])) < 1e4 * 2.0**-52, name


@settings(deadline=None, max_examples=25)
@given(MECHANISMS)
def test_rssp_joints_close_the_loop(design):
    j = evaluated(design, 0.7, ["x_b", "y_b", "z_b", "x_c", "y_c", "z_c", "s", "pressure_angle"])
    coupler = np.array([j.x_c - j.x_b, j.y_c - j.y_b, j.z_c - j.z_b])
    assert np.linalg.norm(coupler) == pytest.approx(design[1], rel=1e-13)
    assert (j.y_c, j.z_c) == (j.s, 0.0)
    assert j.x_c == pytest.approx(design[2], rel=0, abs=1e-300)  # a denormal offset loses bits to the scaling
    assert np.sign(coupler[1]) == design[5]
    assert abs(coupler[1]) == pytest.approx(design[1] * math.cos(j.pressure_angle), rel=1e-13)


@settings(deadline=None, max_examples=25)
@given(MECHANISMS)
def test_rssp_mirrors_when_branch_and_offset_flip(design):
    a, b, e, f, alpha, branch = design
    one, other = evaluated(design, 0.7, WANT), evaluated((a, b, e, -f, alpha, -branch), -0.7, WANT)
    signs = {"s": -1.0, "ds": 1.0, "d2s": -1.0, "d3s": 1.0, "pressure_angle": 1.0}
    for name in WANT:
        assert one[name] == signs[name] * other[name]


def test_rssp_planar_is_the_slider_crank_of_the_books():
    phi = np.linspace(0.0, 6.0, 13)
    frame = sweep.evaluate("rssp", {"a": 1.0, "b": 3.0, "e": 0.0, "f": 0.0, "alpha": 0.0}, ["s", "ds"], phi)
    rod = np.sqrt(9.0 - np.cos(phi) ** 2)
    np.testing.assert_allclose(frame.s, np.sin(phi) + rod, rtol=4e-16)
    np.testing.assert_allclose(frame.ds, np.cos(phi) + np.sin(phi) * np.cos(phi) / rod, rtol=0, atol=1e-15)


def test_rssp_published_benchmark_of_a_spatial_slider_crank():
    # IFToMM multibody benchmark (after Haug): s = 0.2 m and 0.24 m/s at 6 rad/s are printed as exact.
    table = {"a": 0.08, "b": 0.3, "e": math.hypot(0.1, 0.12), "f": 0.0, "alpha": math.pi / 2}
    phi = [math.atan2(-0.1, -0.12), 0.0, math.pi]
    frame = sweep.evaluate("rssp", table, ["s", "ds"], phi)
    assert phi[0] == pytest.approx(math.radians(-140.19443), abs=1e-7)
    assert frame.s[0] == pytest.approx(0.2, rel=1e-15)
    assert 6.0 * frame.ds[0] == pytest.approx(0.24, rel=1e-14)
    np.testing.assert_allclose(frame.s[1:], [0.2901599541, 0.1849518884], rtol=0, atol=5e-11)


def test_rssp_jitted_equals_plain():
    rng = np.random.default_rng(3)
    designs = np.column_stack([rng.uniform(-2.0, 2.0, (12, 5)), rng.choice([-1.0, 1.0], 12)])
    designs[:, 0], designs[:, 1] = abs(designs[:, 0]), abs(designs[:, 1]) + 1.0
    phi = rng.uniform(-4.0, 4.0, (12, 5))

    def run(function, dtype):
        status = np.empty((12, 5), np.uint8)
        out = [np.empty((12, 5), dtype) for _ in range(6)] + [np.empty((6, 12, 5), dtype)]
        function(designs.astype(dtype), np.cos(phi), np.sin(phi), status, motion.Outputs(*out))
        return [status, *out]

    for dtype in (np.float64, np.complex128):
        for jitted, plain in zip(run(rssp.poses, dtype), run(rssp.poses.py_func, dtype), strict=True):
            np.testing.assert_array_equal(jitted, plain)
    assert {st.OK, st.NOT_ASSEMBLED} <= set(run(rssp.poses, np.float64)[0].ravel())
    precise = run(rssp.precise_poses, np.float64)
    for jitted, plain in zip(precise, run(rssp.precise_poses.py_func, np.float64), strict=True):
        np.testing.assert_allclose(jitted, plain, rtol=2.0**-50)
    for twice, once in zip(precise, run(rssp.poses, np.float64), strict=True):
        np.testing.assert_allclose(twice, once, rtol=1e-11)


def test_rssp_complex_step_gives_exact_gradients():
    design, phi = (1.1, 3.7, 0.8, -0.6, 0.9, -1.0), 2.3
    for k in range(5):
        step = np.array([design], dtype=complex)
        step[0, k] += 1e-100j
        columns = family("rssp").poses(step, Angles.of(np.array([[phi]])), frozenset(WANT))
        for name in ("s", "ds", "d2s", "d3s"):
            with mp.workdps(50):

                def output(x, k=k, name=name):
                    numbers = [mp.mpf(v) for v in design]
                    numbers[k] = x
                    order = ("s", "ds", "d2s", "d3s").index(name)
                    return mp.diff(lambda p: naive.joints(*numbers, p)[1][1], mp.mpf(phi), order)

                expected = float(mp.diff(output, mp.mpf(design[k]), h=mp.mpf(10) ** -8))
            assert columns[name][0, 0].imag / 1e-100 == pytest.approx(expected, rel=1e-12, abs=1e-13)
        # the pressure angle along the same step, against a central difference
        h = 1e-5
        lower, upper = (
            evaluated([x + d * (i == k) for i, x in enumerate(design)], phi, "pressure_angle") for d in (-h, h)
        )
        difference = (upper.pressure_angle - lower.pressure_angle) / (2 * h)
        assert columns["pressure_angle"][0, 0].imag / 1e-100 == pytest.approx(difference, abs=1e-8)


@pytest.mark.parametrize(
    ("change", "status"),
    [
        ({"a": 3.0}, st.OK),
        ({"a": 5.0, "e": 0.0}, st.DEAD_POINT),
        ({"a": 6.0}, st.NOT_ASSEMBLED),
        ({"b": 1e-310}, st.INVALID_INPUT),
        ({"e": 1e200}, st.INVALID_INPUT),
    ],
)
def test_rssp_status_explains_every_nan(change, status):
    table = {"a": 1.0, "b": 5.0, "e": 0.0, "f": 0.0, "alpha": 0.0} | change
    names = [o.name for o in family("rssp").pose_outputs]
    row = sweep.evaluate("rssp", table, names, phi=[0.0]).iloc[0]
    assert row.status == status
    if status == st.OK:
        assert np.isfinite(row[names]).all()
    if status == st.DEAD_POINT:
        assert (row.s, row.discriminant, row.pressure_angle) == (0.0, 0.0, math.pi / 2)
        assert row[["ds", "d2s", "d3s"]].isna().all()
    if status in (st.NOT_ASSEMBLED, st.INVALID_INPUT):
        assert row[["s", "ds", "d2s", "d3s", "pressure_angle", "x_c", "y_c", "z_c"]].isna().all()


def test_rssp_kernel_calls_a_nonsense_design_invalid():
    good = [1.0, 5.0, 0.0, 0.0, 0.3, 1.0]
    for k, bad in [(0, 0.0), (0, -1.0), (1, 0.0), (1, math.nan), (2, math.inf), (3, math.nan), (4, math.inf), (5, 0.5)]:
        design = np.array([good])
        design[0, k] = bad
        columns = family("rssp").poses(design, Angles.of(np.array([[0.4]])), frozenset({"s", "discriminant"}))
        assert columns["status"][0, 0] == st.INVALID_INPUT
        assert np.isnan(columns["s"][0, 0])
        assert np.isnan(columns["discriminant"][0, 0])


@pytest.mark.parametrize("off", [-0.0088, 1e-3, 1e-6, 0.0])
def test_derivatives_keep_their_digits_where_the_axis_of_the_crank_is_square_to_the_slide(off):
    """alpha near 90 deg and e near 0: the halves of Q' nearly cancel; the links themselves are known to 2^-53."""
    phi, reach = 4.436, 0.15
    design = by_construction(1.0, 0.00179, 0.9027, 0.5 * math.pi + off, phi, reach, 1.0)
    got = evaluated(design, phi, WANT[:4])
    with mp.workdps(40):
        a, b, e, f, alpha, _ = (mp.mpf(x) for x in design)
        u, v, sa, ca = mp.cos(phi), mp.sin(phi), mp.sin(alpha), mp.cos(alpha)
        m, n, y = e - a * u, f * ca - a * sa * v, f * sa + a * ca * v
        w = mp.sqrt(b * b - m * m - n * n)
        w1 = (a * ca * u * y - a * e * v) / w
        # a rounding of b moves w by b/w times as much, and w1 with it
        allowed = 2.0**-53 * float(8 * (abs(a * ca * u) + abs(a * e * v / w)) * (1 + b * b / (w * w)))
        assert abs(got["ds"] - float(a * ca * u + w1)) <= allowed + 4.0 * 2.0**-53 * float(abs(a * ca * u * y / w))


def test_dead_points_made_in_float64_are_dead_points():
    """A coupler computed for the dead point is off by a few roundings; what is off by more is decided, and rightly."""
    r = np.random.default_rng(3)
    n = 1000
    a, (e, f) = r.uniform(0.1, 2.0, n), r.uniform(-3.0, 3.0, (2, n))
    alpha, phi = r.uniform(-3.0, 3.0, n), r.uniform(0.0, 6.0, n)
    across = np.hypot(e - a * np.cos(phi), f * np.cos(alpha) - a * np.sin(alpha) * np.sin(phi))
    for factor, wanted, share in ((1.0, st.DEAD_POINT, 0.99), (1.0 - 1e-13, st.NOT_ASSEMBLED, 0.9)):
        designs = np.column_stack([a, across * factor, e, f, alpha, np.ones(n)])
        poses = family("rssp").precise().poses(designs, Angles.of(phi[:, None]), frozenset({"s"}))
        assert (poses["status"] == wanted).mean() > share


def test_poses_a_rounding_of_the_links_can_tell_from_a_dead_point_have_derivatives():
    """Twice the working precision decides where plain arithmetic could not; its band is that of the links alone."""
    r = np.random.default_rng(4)
    n = 300
    a, (e, f) = r.uniform(5.0, 20.0, n), r.uniform(-60.0, 60.0, (2, n))
    alpha, phi = r.uniform(-3.0, 3.0, n), r.uniform(0.0, 6.0, n)
    m, height = e - a * np.cos(phi), f * np.cos(alpha) - a * np.sin(alpha) * np.sin(phi)
    size = np.abs(m) * (np.abs(e) + a) + np.abs(height) * (np.abs(f) + a)
    designs = np.column_stack([a, np.sqrt(m * m + height * height + 7.0 * 2.0**-53 * size), e, f, alpha, np.ones(n)])
    angles = Angles.of(phi[:, None])
    plain, exact = (f.poses(designs, angles, frozenset(WANT)) for f in (family("rssp"), family("rssp").precise()))
    decided = exact["status"] == st.OK
    assert (plain["status"] == st.DEAD_POINT).mean() > 0.6
    assert decided.mean() > 0.8
    for i in np.flatnonzero(decided)[:40]:
        true = naive.outputs(tuple(designs[i]), phi[i])
        # s moves with the square root of Q, of which a rounding of phi's cosine and sine is left
        assert abs(exact["ds"][i, 0] - float(true["ds"])) < 0.2 * abs(float(true["ds"]))
