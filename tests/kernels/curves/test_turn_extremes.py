"""Extremes of a curve over a turn from its samples: of several tops the highest, wherever it lies between samples."""

from __future__ import annotations

import numpy as np
import pytest

from kernels.cache_folder import CACHE_DIR
from kernels.curves.periodic import turn_extremes

SAMPLES = 101
PHI = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES)
DENSE = 40_000


def extremes(curves, known=1e-14):
    """Largest value, its place, least value, its place, of curves given as functions of the crank angle."""
    values = np.ascontiguousarray([curve(PHI) for curve in curves])
    found = [np.empty(len(values)) for _ in range(6)]
    turn_extremes(values, np.full(len(values), known), *found)
    return found[:4]


def random_curve(random, order):
    """A trigonometric polynomial."""
    k = np.arange(1, order + 1)
    c, s = random.normal(size=(2, order))
    return lambda phi: np.cos(np.outer(phi, k)) @ c + np.sin(np.outer(phi, k)) @ s


@pytest.mark.parametrize("order", [1, 3, 12, 40])
def test_no_dense_pose_is_beyond_the_extremes(order):
    random = np.random.default_rng(order)
    curves = [random_curve(random, order) for _ in range(400)]
    largest, phi_largest, least, phi_least = extremes(curves)
    for i, curve in enumerate(curves):
        dense = np.fft.irfft(np.fft.rfft(curve(PHI)), DENSE) * (DENSE / SAMPLES)
        size = np.abs(dense).max()
        assert largest[i] >= dense.max() - 1e-13 * size
        assert least[i] <= dense.min() + 1e-13 * size
        np.testing.assert_allclose(curve(np.array([phi_largest[i], phi_least[i]])), [largest[i], least[i]], atol=1e-12)


def test_a_level_curve_is_its_own_extremes():
    largest, _, least, _ = extremes([lambda phi: np.full(len(phi), 3.0)])
    np.testing.assert_allclose([largest[0], least[0]], 3.0, rtol=1e-15)


@pytest.mark.parametrize("known", [1e-14, 1e-9])
def test_of_tops_of_equal_height_the_first_of_the_turn_is_the_place(known):
    """The top next to the highest sample was taken: of curves of period pi that of the second half in every second one.

    Tops beside the angle 0 within the place's error, the square root of the value's, count as its first.
    """
    random = np.random.default_rng(5)
    parts = [random_curve(random, 8) for _ in range(400)]
    _, phi_largest, _, phi_least = extremes([lambda phi, f=f: f(2.0 * phi) for f in parts], known)
    turn = np.sqrt(known)
    assert (np.mod(phi_largest + turn, 2.0 * np.pi) <= np.pi + 2.0 * turn).all()
    assert (np.mod(phi_least + turn, 2.0 * np.pi) <= np.pi + 2.0 * turn).all()


def test_a_top_lower_by_more_than_the_errors_is_not_the_place_though_it_comes_first():
    """The second top is higher by 2e-6 of the size: equal for values known to 2e-6, not for values known to 5e-7."""
    curve = [lambda phi: np.cos(2.0 * (phi - 1.0)) - 1e-6 * np.cos(phi - 1.0)]
    # the places move by 1e-6/4 sin(0) = 0: the tops stay at 1 and 1 + pi
    largest, near, _, _ = extremes(curve, 2e-6)
    np.testing.assert_allclose([largest[0], near[0]], [1.0 + 1e-6, 1.0], rtol=1e-7)
    largest, far, _, _ = extremes(curve, 5e-7)
    np.testing.assert_allclose([largest[0], far[0]], [1.0 + 1e-6, 1.0 + np.pi], rtol=1e-7)


def test_machine_code_is_kept_on_disk():
    """A kernel that hands a function on to others that are not folded in is refused by the cache, without a word."""
    extremes([np.sin])
    assert list((CACHE_DIR / "curves" / "periodic").glob("periodic.turn_extremes-*.nbi"))
