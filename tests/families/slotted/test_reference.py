"""Slotted link against joint coordinates, plain Python, virtual power, exact gradients; synthesis of its crank."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import sweep
from kernels import status as st
from kernels.families import slotted
from sweep.families import family
from tests.reference import slotted as naive
from tests.support.family_checks import (
    assert_compiled_equals_plain,
    assert_gradients_are_those_of_the_reference,
    factors,
)

NAMES = family("slotted").parameter_names
FORK = (1.0, 2.6, 0.7, -0.4, 0.6, 0.5, 0.0, 1.0, 1.0)
BAR = (1.0, 2.6, 0.7, -0.4, 0.6, 0.5, 2.4, -1.0, -1.0)
ALL = [o.name for o in family("slotted").pose_outputs]


def evaluated(design, phi, want):
    return sweep.evaluate("slotted", dict(zip(NAMES, design, strict=True)), want, phi=np.atleast_1d(phi))


def random_designs(count, seed):
    """Mechanisms that reach at the crank angle given with them."""
    generator = np.random.default_rng(seed)
    while count:
        a, e, f, g = 1.0, *generator.uniform(-3.0, 3.0, 3)
        k = generator.choice([0.0, generator.uniform(1.0, 6.0)])
        design = (a, e, f, g, *generator.uniform((-3.0, -1.0), (3.0, 1.0)), k, *generator.choice([-1.0, 1.0], 2))
        phi = generator.uniform(0.0, 6.0)
        frame = evaluated(design, phi, ["discriminant"])
        if frame.status[0] == st.OK and frame.discriminant[0] > 1e-3:
            count -= 1
            yield design, phi


def test_slotted_equals_joint_geometry():
    # The inputs are rounded once and the closed form adds a few roundings of the same size: 16 is asked, 2 measured.
    for design, phi in random_designs(12, 1):
        expected = naive.outputs(design, phi)
        found = factors("slotted", design, phi, expected, evaluated(design, phi, ALL).iloc[0])
        assert max(found.values()) <= 16.0, (design, phi, found)


def test_slotted_keeps_its_digits_where_the_driven_axis_is_near_the_crank_axis():
    # The ball hardly slides there, so what rounding of its turning leaves would drown the sliding velocity: it was 1e3
    # units.  The closed form adds a few roundings to those of the inputs: 16 asked, 4 measured.
    generator = np.random.default_rng(3)
    for _ in range(40):
        e, s = 10.0 ** -generator.uniform(1.0, 4.0) * generator.choice([-1.0, 1.0]), generator.uniform(-0.9, 0.9)
        k, alpha = generator.choice([(0.0, 0.0), (0.0, 1e-3), (0.7, 0.0)])
        design = (1.0, e, 0.2, 0.1, alpha, 0.1 * s if k else s, k, *generator.choice([-1.0, 1.0], 2))
        phi = generator.uniform(-9.0, 9.0)
        expected = naive.outputs(design, phi)
        found = factors("slotted", design, phi, expected, evaluated(design, phi, ALL).iloc[0], positions=False)
        assert max(found.values()) <= 16.0, (design, phi, found)


@settings(deadline=None, max_examples=60)
@given(some.floats(0.0, 6.3), some.sampled_from([FORK, BAR]), some.floats(0.3, 3.0))
def test_slotted_pressure_angle_is_the_share_of_the_force_that_does_work(phi, design, size):
    """Virtual power: force times velocity of the link's point at the ball over the product of their magnitudes."""
    design = (*(x * size for x in design[:4]), design[4], *(x * size for x in design[5:7]), *design[7:])
    row = evaluated(design, phi, ALL).iloc[0]
    if row.status != st.OK:
        return
    ball, guide = (np.array([row[f"{x}_{j}"] for x in "xyz"]) for j in "bc")
    across = np.array([-row.sin_psi, row.cos_psi, 0.0])
    force = across if design[6] == 0.0 else (ball - guide) / design[6]
    arm = ball - [design[1], 0.0, 0.0]
    velocity = np.array([-arm[1], arm[0], 0.0])
    share = abs(force @ velocity) / math.hypot(*velocity)
    assert np.linalg.norm(force) == pytest.approx(1.0, rel=1e-12)
    assert math.cos(row.pressure_angle) == pytest.approx(share, abs=1e-12)
    assert row.discriminant == pytest.approx(share * share, abs=1e-12)
    if design[6] == 0.0:
        assert math.cos(row.pressure_angle) == pytest.approx(abs(row.rho) / math.hypot(*velocity), abs=1e-12)


@settings(deadline=None, max_examples=60)
@given(some.floats(0.0, 6.3), some.sampled_from([FORK, BAR]))
def test_slotted_joints_lie_where_the_drawing_has_them(phi, design):
    row = evaluated(design, phi, ALL).iloc[0]
    if row.status != st.OK:
        return
    along, across = np.array([row.cos_psi, row.sin_psi, 0.0]), np.array([-row.sin_psi, row.cos_psi, 0.0])
    ball, guide = (np.array([row[f"{x}_{j}"] for x in "xyz"]) for j in "bc")
    offset = guide - [design[1], 0.0, guide[2]]
    assert offset @ along == pytest.approx(row.rho, abs=1e-13)
    assert offset @ across == pytest.approx(design[5], abs=1e-13)
    assert np.linalg.norm(ball - guide) == pytest.approx(design[6], abs=1e-13)
    assert np.sign(row.rho) == design[8]
    if design[6] > 0.0:
        assert guide[2] == design[3] and np.sign((ball - guide) @ across) == design[7]


def test_slotted_with_a_central_slot_points_at_the_ball():
    phi = np.linspace(0.0, 6.0, 13)
    frame = evaluated((1.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0), phi, ["psi", "rho", "discriminant"])
    np.testing.assert_allclose(frame.psi, np.arctan2(np.sin(phi) + 0.0, np.cos(phi) - 3.0), atol=1e-15)
    np.testing.assert_allclose(frame.rho, np.sqrt(10.0 - 6.0 * np.cos(phi)), rtol=1e-15)
    np.testing.assert_array_equal(frame.discriminant, 1.0)


def test_slotted_fork_does_not_depend_on_heights_of_the_driven_link():
    low, high = FORK, (*FORK[:3], 7.0, *FORK[4:])
    for name in ("psi", "rho", "x_b", "z_b", "d3psi", "pressure_angle"):
        np.testing.assert_array_equal(evaluated(low, 1.0, [name])[name], evaluated(high, 1.0, [name])[name])


def test_slotted_mirrors_in_the_plane_of_the_axes():
    """y -> -y: crank angle, offsets across and the angle change sign, and with f the slope of the axes."""
    for design in (FORK, BAR):
        a, e, f, g, alpha, s, k, tau, branch = design
        other = (a, e, f, g, -alpha, -s, k, -tau, branch)
        one, two = evaluated(design, 0.8, ALL), evaluated(other, -0.8, ALL)
        for name, sign in {"psi": -1.0, "dpsi": 1.0, "d2psi": -1.0, "rho": 1.0, "drho": -1.0, "d2rho": 1.0}.items():
            np.testing.assert_array_equal(one[name], sign * two[name], err_msg=name)


def test_slotted_crank_of_phi0_gives_that_angle_between_the_limits():
    generator = np.random.default_rng(4)
    phi0, e, f = generator.uniform(0.4, 2.9, 20), generator.uniform(-3.0, 3.0, 20), generator.uniform(-3.0, 3.0, 20)
    alpha = generator.uniform(-1.3, 1.3, 20)
    status, a = np.empty(20, np.uint8), np.empty(20)
    slotted.crank_of_phi0(phi0, e, f, alpha, status, a)
    assert (status == st.OK).all()
    table = {"a": a, "e": e, "f": f, "g": 0.0, "alpha": alpha}
    turn = sweep.summarise("slotted", table, ["phi0", "swing", "phi_ext", "margin"], accuracy=1e-10)
    assert (turn.status == st.OK).all()
    np.testing.assert_allclose(np.minimum(turn.phi0, 2.0 * np.pi - turn.phi0), phi0, rtol=1e-7)
    np.testing.assert_array_equal(turn.margin, 1.0)
    # the limits are where the condition of the page says
    u, v = np.cos(turn.phi_ext), np.sin(turn.phi_ext)
    np.testing.assert_allclose(e * np.cos(alpha) * u - f * np.sin(alpha) * v, a * np.cos(alpha), rtol=0, atol=1e-6)


@pytest.mark.parametrize(("phi0", "e", "f", "alpha"), [(0.0, 1, 1, 0.3), (3.2, 1, 1, 0.3), (1.0, 0, 1, 0.0),
                                                       (1.0, 1, 1, math.pi / 2), (math.nan, 1, 1, 0.3)])  # fmt: skip
def test_slotted_crank_of_phi0_refuses_what_has_none(phi0, e, f, alpha):
    status, a = np.empty(1, np.uint8), np.empty(1)
    slotted.crank_of_phi0(*(np.array([float(x)]) for x in (phi0, e, f, alpha)), status, a)
    assert status[0] == st.NOT_ADMISSIBLE and np.isnan(a[0])


def test_synthesise_gives_central_slots_with_the_wanted_crank_angle():
    table = {"phi0": [2.0, 2.9, 1.0], "e": [1.0, -3.0, 0.0], "f": [0.5, 1.0, 1.0], "alpha": [0.4, -1.2, 0.0]}
    found = sweep.synthesise("slotted", table)
    assert list(found.status) == [st.OK, st.OK, st.NOT_ADMISSIBLE] and np.isnan(found.a[2])
    shorter = np.minimum(found.phi0, 2.0 * np.pi - found.phi0)[:2]
    np.testing.assert_allclose(shorter, table["phi0"][:2], rtol=1e-7)
    # the swing is the angle between the tangents from the pivot to the ellipse of the ball, on a fine grid of it
    phi = np.linspace(0.0, 2.0 * np.pi, 200_000)
    for k in range(2):
        x = found.a[k] * np.cos(phi) - found.e[k]
        y = found.f[k] * np.sin(found.alpha[k]) + found.a[k] * np.cos(found.alpha[k]) * np.sin(phi)
        angle = np.unwrap(np.arctan2(y, x))
        assert abs(found.swing[k]) == pytest.approx(np.ptp(angle), rel=1e-8)
    with pytest.raises(sweep.InputError, match="between 0 and pi"):
        sweep.synthesise("slotted", {"phi0": [4.0], "e": [1.0]})


def test_slotted_margin_is_the_least_squared_cosine_of_the_turn():
    phi = np.linspace(0.0, 2.0 * np.pi, 3601)
    for design in (FORK, (*BAR[:5], 0.2, 2.4, 1.0, 1.0)):
        turn = sweep.summarise("slotted", dict(zip(NAMES, design, strict=True)), ["margin", "rotatable"], accuracy=1e-9)
        dense = evaluated(design, phi, ["discriminant"]).discriminant
        assert turn.margin[0] == pytest.approx(dense.min(), abs=1e-5)
        assert bool(turn.rotatable[0]) == bool(dense.min() > 0.0)


def test_slotted_jitted_equals_plain():
    designs = np.array([FORK, BAR, (1.0, 2.0, 0.0, 0.0, 0.0, 5.0, 0.0, 1.0, 1.0), (*BAR[:6], 0.3, 1.0, 1.0)])
    phi = np.random.default_rng(3).uniform(-4.0, 4.0, (4, 5))
    assert_compiled_equals_plain(slotted.poses, designs, phi, [()] * 12 + [(6,)])


@pytest.mark.parametrize("design", [FORK, BAR])
def test_slotted_complex_step_gives_exact_gradients(design):
    outputs = ["psi", "rho", "dpsi"]
    frame = evaluated(design, 2.3, ["psi", "rho"]).iloc[0]

    def reference(numbers, phi):
        numbers[6] = numbers[6] if design[6] else 0  # the fork slot has no arm that could change
        near = {"psi": naive.mp.mpf(frame.psi)}
        pose = naive.position(numbers, phi, near)
        h = naive.mp.mpf(10) ** -25
        ahead, behind = naive.position(numbers, phi + h, near), naive.position(numbers, phi - h, near)
        return pose | {"dpsi": (ahead["psi"] - behind["psi"]) / (2 * h)}

    assert_gradients_are_those_of_the_reference("slotted", design, 2.3, reference, outputs)


@pytest.mark.parametrize(
    ("change", "status"),
    [
        ({}, st.OK),
        ({"s": 5.0}, st.NOT_ASSEMBLED),
        ({"e": 1.0}, st.SINGULAR),  # the ball on the driven axis
        ({"e": 1.0, "s": 0.2, "alpha": 0.0}, st.SINGULAR),  # there with an offset of the slot too: it was out of reach
        ({"e": 2.0, "s": 1.0, "alpha": 0.0}, st.DEAD_POINT),
        ({"k": 1.0, "g": 3.0}, st.NOT_ASSEMBLED),  # the arm does not reach the ball's height
        ({"k": 3.0, "g": 3.0}, st.SINGULAR),  # the arm along the driven axis
        ({"a": 1e-310, "e": 1e200}, st.INVALID_INPUT),
    ],
)
def test_slotted_status_explains_every_nan(change, status):
    table = {"a": 1.0, "e": 2.6, "f": 0.0, "g": 0.0, "alpha": 0.0, "s": 0.0} | change
    row = sweep.evaluate("slotted", table, ALL, phi=[0.0]).iloc[0]
    assert row.status == status
    if status == st.OK:
        assert np.isfinite(row[ALL]).all()
    if status == st.DEAD_POINT:
        assert row.rho == 0.0 and row.pressure_angle == math.pi / 2 and abs(row.psi) == math.pi / 2
        assert row[["dpsi", "d2psi", "drho"]].isna().all()
    if status in (st.NOT_ASSEMBLED, st.INVALID_INPUT, st.SINGULAR):
        assert row[["psi", "dpsi", "d2psi", "d3psi", "rho", "pressure_angle", "x_c"]].isna().all()
