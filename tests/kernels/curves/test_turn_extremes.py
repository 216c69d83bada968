"""Extremes of a curve over a turn from its samples: of several tops the highest, wherever it lies between samples."""

from __future__ import annotations

import numpy as np
import pytest

from kernels.curves.periodic import turn_extremes

SAMPLES = 101
DENSE = np.arange(40_000) * (2.0 * np.pi / 40_000)


def extremes(curves):
    """Largest value, its place, least value, its place, of curves given as functions of the crank angle."""
    phi = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES)
    values = np.ascontiguousarray([curve(phi) for curve in curves])
    found = [np.empty(len(values)) for _ in range(6)]
    turn_extremes(values, *found)
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
        dense, size = curve(DENSE), np.abs(curve(DENSE)).max()
        assert largest[i] >= dense.max() - 1e-13 * size
        assert least[i] <= dense.min() + 1e-13 * size
        np.testing.assert_allclose(curve(np.array([phi_largest[i], phi_least[i]])), [largest[i], least[i]], atol=1e-12)


def test_a_level_curve_is_its_own_extremes():
    largest, _, least, _ = extremes([lambda phi: np.full(len(phi), 3.0)])
    np.testing.assert_allclose([largest[0], least[0]], 3.0, rtol=1e-15)
