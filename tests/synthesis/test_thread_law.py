"""The smoothest law of a take-up within the slack, and the cam's edge for it, against brute force."""

from __future__ import annotations

import numpy as np
import pytest

from sweep.errors import InputError
from sweep.synthesis.thread_law import ThreadLaw, cam_edge, smoothest_law

PHI = np.arange(240) * (2.0 * np.pi / 240)
GUIDES = np.array([[60.0, -25.0, -20.0], [60.0, 20.0, 30.0]])
LAW = ThreadLaw(np.array([3.0, 0.4]), np.array([-1.0, 0.2]), 0.0, 0.0, 0.0)


def test_demand_that_is_a_law_itself_is_followed_exactly():
    found = smoothest_law(PHI, 50.0 - LAW(PHI), 0.0, harmonics=3)
    np.testing.assert_allclose(found.cos, [3.0, 0.4, 0.0], atol=1e-7)  # the program's own tolerance
    np.testing.assert_allclose(found.sin, [-1.0, 0.2, 0.0], atol=1e-7)
    assert found.stock == pytest.approx(50.0, abs=1e-7) and found.coefficients["B2"] == found.sin[1]


def test_law_of_a_demand_with_corners_is_smoother_the_more_slack_it_has():
    demand = np.abs(PHI - np.pi)
    laws = [smoothest_law(PHI, demand, slack, harmonics=8) for slack in (0.4, 0.8, 1.6)]
    for law, slack in zip(laws, (0.4, 0.8, 1.6), strict=True):
        surplus = law.stock - law(PHI) - demand
        assert surplus.min() > -1e-8 and surplus.max() < slack + 1e-8
        assert np.abs(law(PHI, 2)).max() == pytest.approx(law.largest, rel=1e-6)
    assert laws[0].largest > laws[1].largest > laws[2].largest
    # With no slack a corner of P' has no finite P'': no number of harmonics follows it.
    with pytest.raises(InputError, match="more, or more than 8 harmonics"):
        smoothest_law(PHI, demand, 0.01, harmonics=8)


@pytest.mark.parametrize("unit", [2.0**-27, 1e-5, 2.0**20])
def test_law_is_the_same_in_any_unit_of_length(unit):
    """At 1e-5 the program's tolerance of 1e-7 let the surplus leave its slack by half a percent of that."""
    demand = np.abs(PHI - np.pi)
    law = smoothest_law(PHI, demand, 0.4, harmonics=8)
    other = smoothest_law(PHI, unit * demand, unit * 0.4, harmonics=8)
    assert other.largest == pytest.approx(unit * law.largest, rel=1e-9)
    assert other.spare >= -1e-12 * unit
    with pytest.raises(InputError, match="more, or more than 8 harmonics"):
        smoothest_law(PHI, unit * demand, unit * 0.01, harmonics=8)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"allowed": [1.0, 2.0]}, "allowed = '2 values'; allowed: as many as phi, 240"),
        ({"demand": np.full(240, np.nan)}, "demand = .*; allowed: finite numbers"),
        ({"phi": [], "demand": []}, "phi = .*; allowed: finite numbers"),
        ({"harmonics": -1}, "harmonics = -1; allowed: a whole number above 0"),
    ],
)
def test_what_is_no_demand_is_named(changes, words):
    with pytest.raises(InputError, match=words):
        smoothest_law(**{"phi": PHI, "demand": LAW(PHI), "allowed": 1.0} | changes)


def test_derivatives_of_a_law_are_those_of_its_differences():
    h = 1e-5
    for order in (0, 1):
        differences = (LAW(PHI + h, order) - LAW(PHI - h, order)) / (2.0 * h)
        np.testing.assert_allclose(LAW(PHI, order + 1), differences, atol=1e-8)


@pytest.fixture(scope="module")
def edge():
    return cam_edge(LAW, GUIDES, 92.0, count=2880)


def shortest(edge, phi):
    """Return the shortest way between the guides over any point of the edge turned by phi, by brute force."""
    x, y = edge["x"].to_numpy(), edge["y"].to_numpy()
    points = np.stack([x * np.cos(phi) - y * np.sin(phi), x * np.sin(phi) + y * np.cos(phi), 0.0 * x], axis=1)
    return sum(np.linalg.norm(points - guide, axis=1) for guide in GUIDES).min()


def test_thread_over_the_edge_is_as_long_as_the_law_says(edge):
    for phi in np.linspace(0.0, 2.0 * np.pi, 41):  # between the points the way is longer by (step/2)^2 of curvature
        assert shortest(edge, phi) == pytest.approx(92.0 + LAW(phi), abs=2e-4)
    assert (edge["clear"] > 0.0).all()


def test_normals_and_curvature_are_those_of_the_points(edge):
    x, y = edge["x"].to_numpy(), edge["y"].to_numpy()
    step = 2.0 * np.pi / len(edge)
    dx, dy = ((np.roll(v, -1) - np.roll(v, 1)) / (2.0 * step) for v in (x, y))
    ddx, ddy = ((np.roll(v, -1) - 2.0 * v + np.roll(v, 1)) / step**2 for v in (x, y))
    np.testing.assert_allclose(edge["nx"] * dx + edge["ny"] * dy, 0.0, atol=1e-3)
    # the contact goes around against the turn of the cam
    np.testing.assert_allclose(edge["curvature"], -(dx * ddy - dy * ddx) / np.hypot(dx, dy) ** 3, rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize(
    ("law", "guides", "length", "words"),
    [
        (LAW, GUIDES, 60.0, "longer than a straight one"),
        (LAW, GUIDES * [1.0, 1.0, -1.0] * [[1.0, 1.0, -1.0], [1.0, 1.0, 1.0]], 92.0, "either side"),
        (ThreadLaw(np.array([0.0] * 7 + [4.0]), np.zeros(8), 0.0, 0.0, 0.0), GUIDES, 92.0, "cut into itself"),
    ],
)
def test_what_no_edge_gives_is_refused(law, guides, length, words):
    with pytest.raises(InputError, match=words):
        cam_edge(law, guides, length)
