"""Crank-rocker against slow references: joints and root finding at 50 digits, the house's kernels run as plain Python.

Tolerances: 1e-11 relative for random designs, whose conditions are of order 1 to 1000.
"""

from itertools import pairwise

import mpmath as mp
import numpy as np
import pytest

import sweep
from kernels import status as st
from kernels.families import rssr
from sweep.families import family
from tests.reference.rssr import DIGITS, Linkage, golden_section
from tests.support.rssr_designs import JOINT_NAMES, POSE_NAMES, dense, limits, margins, maxima, poses, random_designs


@pytest.fixture(autouse=True)
def digits():
    with mp.workdps(DIGITS):
        yield


def test_motion_is_that_of_the_joints():
    designs = random_designs(12, 1)
    phi = np.linspace(0.1, 6.1, 12)[:, None]
    found = poses(designs, phi)
    assembled = 0
    for i, design in enumerate(designs):
        linkage, angle = Linkage(*design), mp.mpf(phi[i, 0])
        if linkage.psi(angle) is None:
            assert found["status"][i, 0] == st.NOT_ASSEMBLED
            continue
        assembled += 1
        taylor, psi = linkage.derivatives(angle, 3)
        assert abs(mp.expj(found["psi"][i, 0]) - mp.expj(psi)) < 1e-12
        for order, name in enumerate(("dpsi", "d2psi", "d3psi"), start=1):
            assert found[name][i, 0] == pytest.approx(float(taylor[order] * mp.factorial(order)), rel=1e-10)
        assert mp.cos(found["pressure_angle"][i, 0]) == pytest.approx(
            float(linkage.cosine_of_pressure_angle(angle, psi)), abs=1e-13
        )
        assert found["discriminant"][i, 0] == pytest.approx(float(linkage.discriminant(angle)), rel=1e-11)
        joints = [*linkage.pin(angle), *linkage.ball(psi)]
        np.testing.assert_allclose([found[name][i, 0] for name in JOINT_NAMES], [float(x) for x in joints], atol=1e-11)
    assert assembled >= 6


def test_margin_is_the_least_discriminant():
    designs = random_designs(12, 2)
    found = margins(designs)
    assert set(found["status"]) == {st.OK, st.NOT_ROTATABLE}
    for i, design in enumerate(designs):
        exact = Linkage(*design).margin()
        assert abs(found["margin"][i] - float(exact)) <= found["error"][i]
        assert found["error"][i] < 1e-12
        assert found["rotatable"][i] == (exact > 0)


def change_points(n, seed):
    """Designs with the least coupler that lets the crank turn: the largest distance of pin and rocker circle."""
    designs = random_designs(n, seed, rotatable=True)
    for design in designs:
        linkage = Linkage(*design)

        def needed(phi, linkage=linkage):
            pin = linkage.pin(phi)
            radius = mp.hypot(pin[0] - linkage.e, pin[1])
            return (pin[2] - linkage.g) ** 2 + (radius - linkage.c) ** 2

        best = max(range(200), key=lambda k, needed=needed: needed(2 * mp.pi * k / 200))
        lo, hi = 2 * mp.pi * (best - 1) / 200, 2 * mp.pi * (best + 1) / 200
        design[1] = float(mp.sqrt(-golden_section(lambda phi, needed=needed: -needed(phi), lo, hi)))
    return designs


def test_verdict_near_a_change_point_is_never_wrong():
    steps = [sign * 10.0**-k for k in (6, 9, 12, 13, 14, 15) for sign in (-1.0, 1.0)]
    decided = set()
    for design in change_points(3, 5):
        change = design[1]
        for step in [0.0, *steps]:
            design[1] = change * (1.0 + step)
            found, exact = margins(design[None]), Linkage(*design).margin()
            code = found["status"][0]
            decided.add(int(code))
            assert abs(found["margin"][0] - float(exact)) <= found["error"][0]
            if code == st.UNDECIDABLE:
                assert abs(exact) < 1e-12
                assert np.isnan(found["rotatable"][0]) and np.isnan(found["max_pressure_angle"][0])
            else:
                assert (code == st.OK) == (exact > 0)
    assert decided == {st.OK, st.NOT_ROTATABLE, st.UNDECIDABLE}


def test_largest_pressure_angle_is_that_of_a_fine_grid():
    designs = random_designs(200, 3, rotatable=True)
    found = margins(designs)
    grid = np.linspace(0.0, 2.0 * np.pi, 4001)[None]
    sampled = poses(designs, grid)["pressure_angle"].max(axis=1)
    assert np.all(found["max_pressure_angle"] >= sampled - 1e-13)
    np.testing.assert_allclose(found["max_pressure_angle"], sampled, rtol=1e-5)
    at = poses(designs, found["phi_min"][:, None])["pressure_angle"][:, 0]
    np.testing.assert_allclose(found["max_pressure_angle"], at, rtol=1e-11)


def test_largest_pressure_angle_of_long_offsets_along_nearly_parallel_axes_is_within_its_error():
    designs = random_designs(2000, 15)
    scale = 10.0 ** np.random.default_rng(15).uniform(3.0, 8.0, 2000)
    designs[:, 4], designs[:, 6] = scale * designs[:, 2], designs[:, 6] / scale
    designs[:, 5] += designs[:, 4]
    names = family("rssr").parameter_names
    frame = sweep.summarise("rssr", dict(zip(names, designs.T, strict=True)), ["max_pressure_angle"])
    turning = np.flatnonzero(frame["status"] == st.OK)[:6]
    assert len(turning) == 6
    for i in turning:
        exact = mp.acos(mp.sqrt(Linkage(*designs[i]).margin()))
        assert abs(frame["max_pressure_angle"][i] - exact) <= frame["err_max_pressure_angle"][i]


def test_limit_positions_are_where_the_rocker_reverses():
    designs = random_designs(2000, 4, rotatable=True)
    found = limits(designs)
    assert set(found["status"]) == {st.OK, st.NOT_OSCILLATING}
    swings = found["status"] == st.OK
    for name in ("ext", "fold"):
        at = poses(designs[swings], found[f"phi_{name}"][swings, None])
        np.testing.assert_allclose(
            np.exp(1j * at["psi"][:, 0]), np.exp(1j * found[f"psi_{name}"][swings]), atol=1e-9, rtol=0
        )
        # The crank angle is a double: what it leaves of dpsi is d2psi times its spacing, and rounding.
        assert np.all(np.abs(at["dpsi"][:, 0]) <= 1e-13 * (1.0 + np.abs(at["d2psi"][:, 0])) * 100.0)
    # Over a fine grid the unwrapped angle covers the swing, with the sign of -branch, and comes back.
    grid = np.arange(1441) * (2.0 * np.pi / 1440)
    psi = np.unwrap(poses(designs, grid[None])["psi"], axis=1)
    returns = np.abs(psi[:, -1] - psi[:, 0]) < 1.0
    np.testing.assert_array_equal(returns, swings)
    np.testing.assert_allclose(np.abs(found["swing"][swings]), np.ptp(psi[swings], axis=1), rtol=2e-3)
    np.testing.assert_array_equal(np.sign(found["swing"][swings]), -designs[swings, 7])


def test_unevenness_of_a_tiny_crank_keeps_its_digits_at_any_pressure_angle():
    """phi0 - pi = swing times the turning of the ball's direction per psi, to first order in the crank."""
    designs = random_designs(3000, 14)
    designs[:, 0], designs[:, 1] = 1e-9, designs[:, 1] * np.random.default_rng(14).uniform(0.9, 1.1, 3000)
    found = limits(designs)
    ok = found["status"] == st.OK
    _, _, c, e, _, g, alpha, _ = designs[ok].T
    m = found["psi_ext"][ok] + 0.5 * found["swing"][ok]
    sa, ca = np.sin(alpha), np.cos(alpha)
    x, y = e + c * np.cos(m), c * ca * np.sin(m) - g * sa
    beyond = found["swing"][ok] * c * (x * ca * np.cos(m) + y * np.sin(m)) / (x * x + y * y)
    assert ok.sum() > 1000
    assert np.abs(found["phi0"][ok] - (np.pi + beyond)).max() <= 4.0 * 2.0**-53 * np.pi
    assert np.abs(found["stroke_ratio"][ok] - (np.pi + beyond) / (np.pi - beyond)).max() <= 8.0 * 2.0**-53


def test_no_limit_position_is_lost_among_100_000_designs():
    designs = random_designs(100_000, 9)
    found = limits(designs)
    assert set(found["status"]) <= {st.OK, st.NOT_ROTATABLE, st.UNDECIDABLE, st.NOT_OSCILLATING}


@pytest.mark.parametrize("order", [1, 2, 3])
def test_true_maxima_are_those_of_65536_refined_samples(order):
    designs = random_designs(400, 20 + order, rotatable=True)
    sampled, phi, _ = dense(designs, order, 65536)
    name = POSE_NAMES[order]
    # Golden section around the best sample, in the poses alone.
    ratio, width = 0.5 * (np.sqrt(5.0) - 1.0), 2.0 * np.pi / 65536
    lo, hi = phi - width, phi + width
    for _ in range(40):
        x, y = hi - ratio * (hi - lo), lo + ratio * (hi - lo)
        left = np.abs(poses(designs, x[:, None])[name]) > np.abs(poses(designs, y[:, None])[name])
        lo, hi = np.where(left[:, 0], lo, x), np.where(left[:, 0], y, hi)
    best = np.maximum(np.abs(poses(designs, (0.5 * (lo + hi))[:, None])[name][:, 0]), sampled)
    for target, allowed in ((1e-3, 1e-5), (1e-8, 1e-9), (1e-12, 1e-10)):
        found = maxima(designs, order, target)
        assert np.all(found["status"] == st.OK)
        difference = np.abs(found["max"] - best)
        assert np.all(difference <= allowed * best)
        assert np.mean(difference <= found["error"] + 1e-13 * best) >= 0.995
        place = np.abs(np.mod(found["phi"] - 0.5 * (lo + hi) + np.pi, 2.0 * np.pi) - np.pi)
        # Two peaks of one height may exchange their places; golden section itself stops at the root of a rounding.
        assert np.mean(place <= found["phi_error"] + 1e-6) >= 0.99
        assert np.all((found["phi"] >= 0.0) & (found["phi"] < 2.0 * np.pi))


def test_maxima_right_at_a_change_point_are_found_or_refused():
    designs = np.repeat(change_points(2, 6), 9, axis=0)
    designs[:, 1] *= 1.0 + np.tile(10.0 ** -np.arange(3.0, 12.0), 2)
    found = maxima(designs, 2)
    assert np.count_nonzero(found["status"] == st.OK) >= 14
    for design, most, error, status in zip(designs, found["max"], found["error"], found["status"], strict=True):
        if status != st.OK:
            assert status in (st.NOT_ROTATABLE, st.UNDECIDABLE, st.NOT_CONVERGED) and np.isnan(most)
            continue
        # All of the peak lies within a few widths of the place of least Delta.
        margin = margins(design[None])
        width = np.sqrt(margin["margin"][0]) * design[1] / design[0]
        phi = margin["phi_min"][0] + width * np.sinh(np.linspace(-6.0, 6.0, 20001))
        sampled = np.abs(poses(design[None], phi[None])["d2psi"]).max()
        assert most >= sampled - error
        assert most <= sampled * (1.0 + 1e-4) + error


def test_compiled_kernels_equal_plain_python_bit_for_bit():
    designs, phi = random_designs(40, 7, rotatable=True), np.linspace(0.0, 6.0, 7)[None]
    for found, plain in (
        (poses(designs, phi), poses(designs, phi, function=rssr.poses.py_func)),
        (margins(designs), margins(designs, function=rssr.margin.py_func)),
        (limits(designs), limits(designs, function=rssr.limits.py_func)),
        (maxima(designs, 2), maxima(designs, 2, function=rssr.true_maxima.py_func)),
    ):
        for name, column in found.items():
            if name in ("pressure_angle", "swing", "err_swing"):  # Python's own hypot rounds differently from libm's
                np.testing.assert_array_max_ulp(column, plain[name], 4)
            else:
                np.testing.assert_array_equal(column, plain[name], err_msg=name)


def test_complex_step_gives_the_gradient():
    designs, phi = random_designs(60, 8, rotatable=True), np.array([[0.7]])
    h = 1e-30
    for column in range(7):
        shifted = designs.astype(complex)
        shifted[:, column] += 1j * h
        step = 1e-6 * np.maximum(np.abs(designs[:, column]), 1.0)
        up, down = designs.copy(), designs.copy()
        up[:, column] += step
        down[:, column] -= step
        exact = poses(shifted, phi)
        after, before, here = poses(up, phi), poses(down, phi), poses(designs, phi)
        for name in (*POSE_NAMES, *JOINT_NAMES):
            np.testing.assert_allclose(exact[name].real, here[name], rtol=1e-9, atol=1e-12)
            quotient = (after[name] - before[name])[:, 0] / (2.0 * step)
            np.testing.assert_allclose(
                exact[name].imag[:, 0] / h, quotient, rtol=1e-4, atol=1e-6 * (1.0 + np.abs(quotient).max())
            )


def test_complex_angle_gives_the_next_derivative():
    designs = random_designs(60, 9, rotatable=True)
    found = poses(designs, np.array([[0.7 + 1e-30j]]))
    for name, following in pairwise(POSE_NAMES[:4]):
        np.testing.assert_allclose(found[name].imag * 1e30, found[following].real, rtol=1e-10)
