"""Crank-rocker: symmetries, limits and invariances that hold for every design.

Scaling and mirroring change no bit; turning the frame by pi and shifting phi by a turn only round.
"""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as hs

from kernels import status as st
from kernels.families import rssr
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy
from tests.support.rssr_designs import JOINT_NAMES, POSE_NAMES, limits, margins, maxima, poses, random_designs

DESIGNS = random_designs(300, 30)
TURNING = random_designs(300, 31, rotatable=True)
PHI = np.linspace(0.0, 6.0, 11)[None]


def scaled(designs, factor):
    return np.column_stack([designs[:, :6] * factor, designs[:, 6:]])


@pytest.mark.parametrize("exponent", [-300, -77, -20, -3, 1, 17, 60, 250])
def test_scaling_by_a_power_of_two_changes_no_bit(exponent):
    factor = math.ldexp(1.0, exponent)
    here, there = poses(DESIGNS, PHI), poses(scaled(DESIGNS, factor), PHI)
    for name in ("status", "psi", "dpsi", "d2psi", "d3psi", "sin_psi", "cos_psi", "pressure_angle"):
        np.testing.assert_array_equal(there[name], here[name], err_msg=name)
    for name in JOINT_NAMES:
        np.testing.assert_array_equal(there[name], here[name] * factor, err_msg=name)
    for function, designs in ((margins, DESIGNS), (limits, TURNING), (lambda d: maxima(d, 2), TURNING)):
        here, there = function(designs), function(scaled(designs, factor))
        for name, column in here.items():
            np.testing.assert_array_equal(there[name], column, err_msg=name)


def test_mirroring_across_the_plane_of_the_perpendicular_swaps_the_branch_and_changes_no_bit():
    # y -> -y: alpha, phi, psi change their signs, the coupler comes from the other side.
    mirrored = DESIGNS * np.array([1, 1, 1, 1, 1, 1, -1, -1])
    here, there = poses(DESIGNS, PHI), poses(mirrored, -PHI)
    for name, sign in (("psi", -1), ("dpsi", 1), ("d2psi", -1), ("d3psi", 1), ("cos_psi", 1), ("discriminant", 1)):
        np.testing.assert_array_equal(there[name], sign * here[name], err_msg=name)
    np.testing.assert_array_equal(there["status"], here["status"])


def test_turning_the_frame_by_pi_about_the_rocker_axis_adds_pi_to_both_angles():
    turned = DESIGNS * np.array([1, 1, 1, -1, 1, 1, -1, 1])
    here, there = poses(DESIGNS, PHI), poses(turned, PHI + np.pi)
    ok = (here["status"] == st.OK) & (here["pressure_angle"] < 1.5)
    np.testing.assert_array_equal(there["status"], here["status"])
    np.testing.assert_allclose(there["sin_psi"][ok], -here["sin_psi"][ok], atol=1e-11)
    np.testing.assert_allclose(there["cos_psi"][ok], -here["cos_psi"][ok], atol=1e-11)
    for name in ("dpsi", "d2psi", "d3psi"):
        np.testing.assert_allclose(there[name][ok], here[name][ok], rtol=1e-6, atol=1e-8)


def test_a_full_turn_of_the_crank_only_rounds():
    here, there = poses(TURNING, PHI), poses(TURNING, PHI + 2.0 * np.pi)
    mild = here["pressure_angle"] < 1.4
    np.testing.assert_allclose(there["d2psi"][mild], here["d2psi"][mild], rtol=1e-9, atol=1e-10)


def test_derivatives_converge_to_difference_quotients_at_second_order():
    designs = TURNING[margins(TURNING)["margin"] > 0.1]
    phi, errors = np.array([[0.4]]), []
    exact = poses(designs, phi)
    for h in (4e-3, 2e-3):
        after, before = poses(designs, phi + h), poses(designs, phi - h)
        error = []
        for name, following in pairwise(POSE_NAMES[:4]):
            change = after[name] - before[name]
            if name == "psi":
                change = np.angle(np.exp(1j * change))
            error.append(np.abs(change / (2.0 * h) - exact[following]).max())
        errors.append(error)
    np.testing.assert_allclose(np.divide(*errors), 4.0, rtol=0.1)


def test_both_branches_are_the_two_intersections():
    other = DESIGNS * np.array([1, 1, 1, 1, 1, 1, 1, -1])
    here, there = poses(DESIGNS, PHI), poses(other, PHI)
    ok = here["status"] == st.OK
    np.testing.assert_array_equal(ok, there["status"] == st.OK)
    # The two positions are mirror images about the line from the rocker axis to the crank pin's projection.
    direction = np.arctan2(here["y_b"], here["x_b"] - DESIGNS[:, 3:4])
    total = here["psi"] + there["psi"] - 2.0 * direction
    assert np.abs(np.exp(1j * total) - 1.0)[ok].max() < 1e-11
    np.testing.assert_array_equal(here["pressure_angle"][ok], there["pressure_angle"][ok])


def four_bar(a, b, c, e, branch, phi):
    """Rocker angle of the planar four-bar by the intersection of two circles."""
    pin = a * np.exp(1j * phi)
    chord = pin - e
    r = np.abs(chord)
    # Angle at the rocker pivot between the ground-to-pin chord and the rocker.
    corner = np.arccos((c * c + r * r - b * b) / (2.0 * c * r))
    return np.angle(chord) + branch * corner


@pytest.mark.parametrize("alpha", [0.0, 1e-12, 1e-9, 1e-6, 1e-4])
def test_alpha_to_zero_is_the_planar_four_bar(alpha):
    r = np.random.default_rng(5)
    a, b, c, e = r.uniform(0.5, 1.0, 50), r.uniform(3.0, 4.0, 50), r.uniform(2.0, 3.0, 50), r.uniform(3.0, 4.0, 50)
    g = r.uniform(-2.0, 2.0, 50)
    designs = np.column_stack([a, b, c, e, g, g, np.full(50, alpha), r.choice([-1.0, 1.0], 50)])
    turning = margins(designs)["rotatable"] == 1.0
    assert turning.sum() > 20
    found = poses(designs[turning], PHI)["psi"]
    expected = four_bar(*(x[turning, None] for x in (a, b, c, e, designs[:, 7])), PHI)
    assert np.abs(np.exp(1j * found) - np.exp(1j * expected)).max() < 1e-12 + 20.0 * alpha


def test_planar_mechanism_knows_only_the_difference_of_the_offsets():
    designs = np.round(DESIGNS * 4.0) / 4.0
    designs[:, 6], designs[:, 7] = 0.0, DESIGNS[:, 7]
    shifted = designs + np.array([0, 0, 0, 0, 64.0, 64.0, 0, 0])
    here, there = poses(designs, PHI), poses(shifted, PHI)
    for name in ("status", "psi", "dpsi", "d2psi", "d3psi", "discriminant", "pressure_angle"):
        np.testing.assert_array_equal(there[name], here[name], err_msg=name)


def test_order_of_designs_and_size_of_the_table_do_not_matter():
    order = np.random.default_rng(1).permutation(len(TURNING))
    for function in (margins, limits, lambda d: maxima(d, 1), lambda d: maxima(d, 2), lambda d: maxima(d, 3)):
        whole, shuffled = function(TURNING), function(TURNING[order])
        alone = function(TURNING[17:18])
        for name, column in whole.items():
            np.testing.assert_array_equal(shuffled[name], column[order], err_msg=name)
            np.testing.assert_array_equal(alone[name], column[17:18], err_msg=name)


def test_maxima_and_their_places_have_the_bits_alone_that_they_have_together():
    names = [f"{kind}_abs_d{order}psi" for kind in ("max", "phi_max") for order in ("", "2", "3")]
    together = design_outputs(family("rssr"), DESIGNS, names, Accuracy(target=1e-8))
    assert 0 < np.count_nonzero(together["status"] == st.OK) < len(DESIGNS)
    for wanted in ([name] for name in names):
        alone = design_outputs(family("rssr"), DESIGNS, wanted, Accuracy(target=1e-8))
        for name, column in alone.items():
            np.testing.assert_array_equal(column, together[name], err_msg=f"{name} of {wanted}")


def test_dense_kernel_agrees_with_poses():
    phi = np.arange(360) * (2.0 * np.pi / 360)
    most, least = [np.empty(300) for _ in range(3)], np.empty(300)
    rssr.dense_maxima(TURNING, np.cos(phi), np.sin(phi), least, *most)
    motion = poses(TURNING, phi[None])
    for name, values in zip(POSE_NAMES[1:4], most, strict=True):
        np.testing.assert_allclose(values, np.abs(motion[name]).max(axis=1), rtol=1e-9)
    assert np.all(least >= margins(TURNING)["margin"] - 1e-14)


lengths = hs.floats(0.01, 100.0)
offsets = hs.floats(-100.0, 100.0)


@settings(max_examples=150, deadline=None)
@given(
    lengths,
    lengths,
    lengths,
    offsets,
    offsets,
    offsets,
    hs.floats(-7.0, 7.0),
    hs.sampled_from([-1.0, 1.0]),
    hs.floats(-10.0, 10.0),
)
def test_loop_closes_or_a_status_says_why_it_does_not(a, b, c, e, f, g, alpha, branch, phi):
    design = np.array([[a, b, c, e, f, g, alpha, branch]])
    found = {name: column[0, 0] for name, column in poses(design, np.array([[phi]])).items()}
    size = a + b + c + abs(e) + abs(f) + abs(g)
    if found["status"] in (st.OK, st.DEAD_POINT):
        distance = math.dist(*([found[f"{k}_{joint}"] for k in "xyz"] for joint in "bc"))
        # An error eps of the angle moves the ball by eps c; near R = 0 the angle itself is poorly known.
        assert abs(distance - b) <= 1e-7 * size
        assert abs(math.hypot(found["sin_psi"], found["cos_psi"]) - 1.0) < 1e-6
    else:
        assert math.isnan(found["psi"]) and math.isnan(found["d2psi"])
    margin = margins(design)
    if margin["status"][0] == st.OK:
        assert found["status"] == st.OK
        assert found["pressure_angle"] <= margin["max_pressure_angle"][0] + 1e-7
