"""Small dense systems: against numpy and scipy, which share no code; rank, order and hard columns."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls as theirs

from kernels import status as st
from kernels.dense import least_squares, product, symmetric_axes, triangle
from kernels.nnls import nnls

EPS = 2.0**-53


def matrices(seed: int = 0) -> list[np.ndarray]:
    """Square, tall, flat, dependent and badly scaled ones."""
    rng = np.random.default_rng(seed)
    dependent = rng.standard_normal((12, 12))
    dependent[:, 3] = dependent[:, 5] + dependent[:, 1]
    scaled = rng.standard_normal((9, 6)) * 10.0 ** np.arange(-6.0, 6.0, 2.0)
    return [rng.standard_normal(shape) for shape in ((1, 1), (5, 5), (9, 4), (4, 9), (40, 40))] + [dependent, scaled]


@pytest.mark.parametrize("case", range(7))
def test_triangle_gives_the_matrix_back_and_its_q_is_orthogonal(case: int) -> None:
    a = matrices()[case]
    m, n = a.shape
    r, order, q = a.copy(), np.empty(n, np.int64), np.empty((m, m))
    rank = triangle(r, order, q, 1e-12)
    assert rank == np.linalg.matrix_rank(a) and sorted(order) == list(range(n))
    # A handful of roundings per reflection and row: 10 n eps of the largest column.
    size = 10.0 * max(m, n) * EPS
    np.testing.assert_allclose(q @ r, a[:, order], rtol=0.0, atol=size * np.abs(a).max() * np.sqrt(m))
    np.testing.assert_allclose(q.T @ q, np.eye(m), rtol=0.0, atol=size)
    assert np.all(np.tril(r[:, : min(m, n)], -1)[:, :rank] == 0.0)


@pytest.mark.parametrize("case", range(7))
def test_least_squares_is_the_shortest_best_solution(case: int) -> None:
    a = matrices()[case]
    b = np.random.default_rng(1).standard_normal(len(a))
    x = np.empty(a.shape[1])
    rank = least_squares(a, b, 1e-12, x)
    known, _, their_rank, sizes = np.linalg.lstsq(a, b, rcond=1e-12)
    assert rank == their_rank
    # Both solve a problem with the same singular values; errors grow with their ratio.
    tolerance = 100.0 * EPS * sizes[0] / sizes[rank - 1] * max(1.0, np.abs(known).max())
    np.testing.assert_allclose(x, known, rtol=0.0, atol=tolerance)


def test_least_squares_of_zeros_is_zero() -> None:
    x = np.ones(3)
    assert least_squares(np.zeros((2, 3)), np.ones(2), 1e-12, x) == 0
    np.testing.assert_array_equal(x, 0.0)


def test_axes_turn_symmetric_matrices_into_their_eigenvalues() -> None:
    rng = np.random.default_rng(2)
    stack = rng.standard_normal((6, 15, 15))
    stack = stack + stack.transpose(0, 2, 1)
    stack[1] = np.diag(np.arange(15.0))
    stack[2] = 0.0
    stack[3] = np.outer(stack[4, 0], stack[4, 0])
    scale = 10.0 ** np.arange(-7.0, 8.0)
    stack[5] *= scale[:, None] * scale
    values, axes = np.empty((6, 15)), np.empty((6, 15, 15))
    symmetric_axes(stack, values, axes)
    for a, own, turned in zip(stack, values, axes, strict=True):
        # Some eight sweeps of 105 rotations, each good to eps of the largest eigenvalue in the worst case.
        size = 100.0 * EPS * max(float(np.abs(own).max()), 1e-300)
        np.testing.assert_allclose(own, np.linalg.eigvalsh(a), rtol=0.0, atol=size)
        np.testing.assert_allclose(turned.T @ turned, np.eye(15), rtol=0.0, atol=100.0 * EPS)
        np.testing.assert_allclose((turned * own) @ turned.T, a, rtol=0.0, atol=10.0 * size)


def test_product_sums_in_the_order_of_the_index() -> None:
    rng = np.random.default_rng(3)
    a, b = rng.standard_normal((4, 7)), rng.standard_normal((7, 3))
    out = np.empty((4, 3))
    product(a, b, out)
    expected = np.zeros((4, 3))
    for k in range(7):
        expected = expected + a[:, [k]] * b[[k]]
    np.testing.assert_array_equal(out, expected)


def test_non_negative_least_squares_reach_the_same_distance_and_keep_the_conditions() -> None:
    rng = np.random.default_rng(4)
    for trial in range(200):
        m, n = int(rng.integers(1, 20)), int(rng.integers(1, 60))
        a, b = rng.standard_normal((m, n)), rng.standard_normal(m)
        if trial % 3 == 0:
            b = a @ np.maximum(rng.standard_normal(n), 0.0)
        if trial % 5 == 0 and n > 1:
            a[:, 0] = a[:, 1]
        if trial % 7 == 0:
            a[:, -1] = 0.0
        x = np.empty(n)
        assert nnls(a, b, x) == st.OK and (x >= 0.0).all()
        distance = np.linalg.norm(a @ x - b)
        # Scipy's own rounding, with columns as dependent as they come out of twenty rows.
        assert distance == pytest.approx(theirs(a, b)[1], abs=1e-11)
        slope = a.T @ (b - a @ x)
        assert slope.max() <= 1e-10 and np.abs(slope[x > 0.0]).max(initial=0.0) <= 1e-10
