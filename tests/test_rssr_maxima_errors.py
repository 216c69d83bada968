"""Error estimates of the true maxima hold where the maximum itself is small, and what does not turn changes nothing.

The reference is the motion in twice the working precision at the zero of the next derivative.
"""

import numpy as np
import pytest

from kernels import status as st
from kernels.families.rssr.careful import rounding
from studies.accuracy.regions import drawn, rotatable
from sweep.families import family
from sweep.families.base import Angles
from tests.rssr_designs import margins, maxima

ORDERS = ("dpsi", "d2psi", "d3psi")
PLAIN, PRECISE = family("rssr"), family("rssr").precise()


def next_derivative(designs, phi, order):
    """Of the transfer function of that order; of the jerk by the complex step."""
    if order < 3:
        return PRECISE.poses(designs, Angles.of(phi[:, None]), frozenset({ORDERS[order]}))[ORDERS[order]][:, 0]
    z = phi[:, None] + 1e-25j
    columns = PLAIN.poses(designs, Angles(z, np.cos(z), np.sin(z)), frozenset({"d3psi"}))
    return columns["d3psi"][:, 0].imag / 1e-25


def peaks(designs, found, order):
    """Height and place of the maximum next to the one found."""
    phi = found["phi"].copy()
    for _ in range(5):
        h = np.maximum(found["phi_error"], 1e-8)
        slope = (next_derivative(designs, phi + h, order) - next_derivative(designs, phi - h, order)) / (2.0 * h)
        phi += np.clip(-next_derivative(designs, phi, order) / slope, -3.0 * h, 3.0 * h)
    name = ORDERS[order - 1]
    return np.abs(PRECISE.poses(designs, Angles.of(phi[:, None]), frozenset({name}))[name][:, 0]), phi


@pytest.fixture(scope="module")
def designs():
    """Random ones, and those of 100 000 whose errors were above estimates that knew the error of Delta alone."""
    many = rotatable(100_000, 2024)
    return np.ascontiguousarray(np.concatenate([many[[68756, 22837, 47276, 46522, 57353, 30330, 95753]], many[:4000]]))


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("target", [1e-3, 1e-8, 1e-12])
def test_errors_of_height_and_place_hold_and_are_no_more_than_needed(designs, order, target):
    found = maxima(designs, order, target)
    height, place = peaks(designs, found, order)
    assert (found["status"] == st.OK).all()
    off = np.abs(found["max"] - height)
    assert (off <= found["error"]).all()
    assert (np.abs(np.angle(np.exp(1j * (found["phi"] - place)))) <= found["phi_error"]).all()
    if target == 1e-12:
        assert np.median(found["error"] / np.maximum(off, 2.0**-53 * height)) < 60.0
        assert np.median(found["error"] / height) < 2e-14


def test_rounding_of_a_small_maximum_is_not_relative_to_it():
    """Negative control: the same pose taken for a hundred times higher has an estimate that its error exceeds."""
    height = 1e-3
    pose = (-3.8, 1.9, -0.3, 0.4, -0.2, -0.8, 3.3, 0.6, 0.8)
    small, large = rounding(1, *pose, height), rounding(1, *pose, 100.0 * height)
    assert small > 5.0 * large
    assert rounding(3, *pose, height) > small


@pytest.mark.parametrize("order", [1, 2, 3])
def test_designs_that_do_not_turn_change_no_bit_of_those_that_do(order):
    mixed = drawn(3000, np.random.default_rng(3))
    found = maxima(mixed, order)
    turning = found["status"] == st.OK
    assert 0.2 < turning.mean() < 0.5
    np.testing.assert_array_equal(found["status"], margins(mixed)["status"])
    alone = maxima(np.ascontiguousarray(mixed[turning]), order)
    assert np.isfinite(alone["max"]).all()
    for name, column in alone.items():
        np.testing.assert_array_equal(found[name][turning], column, err_msg=name)
    for name in ("max", "phi", "error", "phi_error"):
        assert np.isnan(found[name][~turning]).all()


def test_margin_of_symmetric_mechanisms_with_two_equal_minima():
    """With f = g = 0 Delta is even in phi, so an inner minimum is there twice: the proof of the global one is a tie."""
    r = np.random.default_rng(8)
    n, phi = 1000, np.linspace(0.0, np.pi, 4001)
    a, b, c, e = r.uniform(0.1, 3.0, (4, n)) * np.array([[1.0], [1.0], [1.0], [0.1]])
    alpha = r.uniform(0.0, np.pi, n)
    designs = np.column_stack([a, b, c, e, np.zeros(n), np.zeros(n), alpha, np.ones(n)])
    found = margins(designs)
    inner = 0
    for (a1, b1, c1, e1, _, _, alpha1, _), margin, place in zip(
        designs, found["margin"], found["phi_min"], strict=True
    ):

        def values(t, a1=a1, b1=b1, c1=c1, e1=e1, alpha1=alpha1):
            x, y = e1 - a1 * np.cos(t), a1 * np.cos(alpha1) * np.sin(t)
            w = (a1 * a1 - b1 * b1 + c1 * c1 + e1 * e1 - 2.0 * a1 * e1 * np.cos(t)) / (2.0 * c1)
            return (x * x + y * y - w * w) / (b1 * b1)

        samples = values(phi)
        size = np.abs(samples).max() + (a1 + c1 + e1) ** 2 / b1**2
        assert samples.min() - 1e-5 * size <= margin <= samples.min() + 1e-14 * size
        assert abs(values(place) - margin) <= 1e-14 * size
        inner += abs(np.sin(place)) > 1e-3
    assert inner > 300
