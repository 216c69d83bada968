"""The nearest point under linear rows against scipy's non-negative least squares, which share no code."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from kernels import status as st
from kernels.nearest import nearest


def solved(rows: np.ndarray, needs: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    y, weights = np.empty(len(centre)), np.empty(len(needs))
    status = nearest(np.ascontiguousarray(rows), needs, centre, 1e-13, y, weights)
    return y, weights, status


def theirs(rows: np.ndarray, needs: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Lawson and Hanson's least-distance program."""
    target = np.zeros(len(centre) + 1)
    target[-1] = 1.0
    matrix = np.vstack([rows, needs - rows.T @ centre])
    left = matrix @ nnls(matrix, target)[0] - target
    return np.asarray(centre - left[:-1] / left[-1])


@pytest.mark.parametrize("seed", range(40))
def test_nearest_point_equals_that_of_least_squares(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(2, 14)), int(rng.integers(1, 60))
    rows, centre = rng.standard_normal((n, m)), rng.standard_normal(n)
    needs = rows.T @ rng.standard_normal(n) - 0.3 * rng.random(m)  # some point keeps them
    y, weights, status = solved(rows, needs, centre)
    assert status == st.OK
    # The rows that hold are as many as unknowns at most; their condition is below 1e4 in these samples.
    np.testing.assert_allclose(y, theirs(rows, needs, centre), atol=1e-9)
    np.testing.assert_allclose(rows @ weights, y - centre, atol=1e-9)
    assert (weights >= 0.0).all() and (rows.T @ y >= needs - 1e-9).all()
    # A row with a multiplier holds.
    assert np.abs((rows.T @ y - needs)[weights > 0.0]).max(initial=0.0) < 1e-9


def test_centre_that_keeps_all_rows_stays() -> None:
    y, weights, status = solved(np.eye(3), np.full(3, -1.0), np.zeros(3))
    assert status == st.OK and (y == 0.0).all() and (weights == 0.0).all()


def test_rows_that_come_twice_and_depend_on_others_do_no_harm() -> None:
    rows = np.array([[1.0, 1.0, 0.0, 1.0, 2.0], [0.0, 0.0, 1.0, 1.0, 2.0]])
    y, weights, status = solved(rows, np.array([1.0, 1.0, 1.0, 2.0, 4.0]), np.zeros(2))
    assert status == st.OK
    np.testing.assert_allclose(y, [1.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(rows @ weights, y, atol=1e-12)


def test_rows_that_no_point_keeps_are_told() -> None:
    assert solved(np.array([[1.0, -1.0]]), np.array([1.0, 0.0]), np.zeros(1))[2] == st.LIMIT_EXCEEDED


def test_plain_python_gives_the_same_bits() -> None:
    rng = np.random.default_rng(1)
    rows, centre = rng.standard_normal((5, 20)), rng.standard_normal(5)
    needs = rows.T @ rng.standard_normal(5) - 0.1
    ours = solved(rows, needs, centre)
    y, weights = np.empty(5), np.empty(20)
    status = nearest.py_func(rows, needs, centre, 1e-13, y, weights)
    np.testing.assert_array_equal(ours[0], y)
    np.testing.assert_array_equal(ours[1], weights)
    assert status == ours[2]
