"""Points of the searches against those of scipy.stats.qmc, which they stand for: every bit, optima follow from them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from sweep.optimise.samples import Sobol, sobol
from sweep.study.sobol import DIMENSIONS


@pytest.mark.parametrize("dimensions", [1, 2, 16, DIMENSIONS, DIMENSIONS + 1])
@pytest.mark.parametrize("seed", [0, 7, 2**40])
def test_points_are_those_of_scipy_for_a_seed(dimensions: int, seed: int) -> None:
    ours, theirs = sobol(dimensions, seed), qmc.Sobol(dimensions, seed=seed)
    for count in (1, 1, 2, 4, 8192, 1024):  # one block after the other
        assert np.array_equal(ours.random(count), theirs.random(count))


def test_points_and_later_draws_are_those_of_scipy_for_a_generator() -> None:
    ours, theirs = (np.random.default_rng((3, 4)) for _ in range(2))
    for _ in range(2):  # each sequence takes a generator of its own from the given one, which goes on as it was
        assert np.array_equal(sobol(12, ours).random(4096), qmc.Sobol(12, seed=theirs).random(4096))
        assert ours.random() == theirs.random()


def test_no_points_have_the_shape_of_some() -> None:
    assert Sobol(3, 0).random(0).shape == (0, 3)
