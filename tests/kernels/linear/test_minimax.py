"""Least largest magnitudes in five unknowns against scipy's linear programs, which share no code."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from kernels import status as st
from kernels.linear.minimax import minimax

BOUND, NEED, PRICE = 0.015, np.array([24.5, 3.0]), 100.0


def problems(count: int, poses: int = 32, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Smooth periodic rows; as for a guide, the offset moves the deviation alone."""
    rng = np.random.default_rng(seed)
    phi = np.arange(poses) * 2.0 * np.pi / poses

    def rows() -> np.ndarray:
        waves = [np.cos(k * phi) / (1 + k * k) for k in range(1, 5)] + [
            np.sin(k * phi) / (1 + k * k) for k in range(1, 5)
        ]
        return np.einsum("wm,nwu->nmu", waves, rng.standard_normal((count, 8, 5)))

    g, d, e = rows(), rows(), rng.standard_normal((count, 2, 5))
    g[:, :, 4], d[:, :, 4], e[:, :, 4] = 0.0, -1.0, 0.0
    return g, d, e


def solved(g: np.ndarray, d: np.ndarray, e: np.ndarray, bound: float | np.ndarray = BOUND) -> tuple[np.ndarray, ...]:
    n = len(g)
    bounds, needs = np.broadcast_to(bound, (n, 2, d.shape[1])).copy(), np.broadcast_to(NEED, (n, 2)).copy()
    x, t, v, status = np.empty((n, 5)), np.empty(n), np.empty(n), np.empty(n, np.uint8)
    minimax(g, d, e, bounds, needs, PRICE, x, t, v, status)
    return x, t, v, status


def theirs(g: np.ndarray, d: np.ndarray, e: np.ndarray, bound: float | np.ndarray = BOUND) -> float:
    one, none = np.ones((len(g), 1)), np.zeros((len(g), 1))
    own, nil = np.ones((len(d), 1)), np.zeros((len(d), 1))
    a = np.vstack(
        [
            np.hstack([g, -one, none]), np.hstack([-g, -one, none]),
            np.hstack([d, nil, -own]), np.hstack([-d, nil, -own]), np.hstack([-e, np.zeros((2, 2))]),
        ]
    )  # fmt: skip
    below, above = np.minimum(np.broadcast_to(bound, (2, len(d))), 1e6)  # HiGHS refuses infinite ones
    b = np.concatenate([np.zeros(2 * len(g)), above, below, -NEED])
    free = [(None, None)] * 5 + [(0, None)] * 2
    return float(linprog(np.array([0, 0, 0, 0, 0, 1, PRICE]), A_ub=a, b_ub=b, bounds=free).fun)


@pytest.mark.parametrize("bound", [0.015, 5.0])
def test_least_largest_magnitude_equals_scipys(bound: float) -> None:
    g, d, e = problems(12)
    x, t, v, status = solved(g, d, e, bound)
    assert (status == st.OK).all()
    for i in range(len(g)):
        # HiGHS keeps its rows to 1e-7.
        assert t[i] + PRICE * v[i] == pytest.approx(theirs(g[i], d[i], e[i], bound), rel=1e-6)
        assert np.abs(g[i] @ x[i]).max() == pytest.approx(t[i], rel=1e-9)
        assert np.abs(d[i] @ x[i]).max() <= bound + v[i] + 1e-9 and (e[i] @ x[i] >= NEED * (1.0 - 1e-9)).all()


def test_every_row_may_have_a_bound_of_its_own_and_a_negative_one_is_missed_at_the_price() -> None:
    g, d, e = problems(6)
    bound = np.linspace(-0.01, 0.05, d.shape[1])
    _, t, v, status = solved(g, d, e, bound)
    assert (status == st.OK).all() and (v >= 0.01).all()
    for i in range(len(g)):
        assert t[i] + PRICE * v[i] == pytest.approx(theirs(g[i], d[i], e[i], bound), rel=1e-6)


def test_rows_may_go_further_to_one_side_than_to_the_other_or_anywhere() -> None:
    g, d, e = problems(6)
    bound = np.stack([np.linspace(0.0, 2.0, d.shape[1]), np.linspace(1.0, 0.01, d.shape[1])])
    bound[0, 3:9], bound[1, 20:] = np.inf, np.inf
    x, t, v, status = solved(g, d, e, bound)
    assert (status == st.OK).all()
    for i in range(len(g)):
        assert t[i] + PRICE * v[i] == pytest.approx(theirs(g[i], d[i], e[i], bound), rel=1e-6)
        value = d[i] @ x[i]
        assert (value <= bound[1] + v[i] + 1e-9).all() and (value >= -bound[0] - v[i] - 1e-9).all()


def test_rows_of_the_deviation_may_be_none() -> None:
    g, d, e = problems(3)
    _, t, v, status = solved(g, d[:, :0], e)
    assert (status == st.OK).all() and (v == 0.0).all()
    for i in range(3):
        assert t[i] == pytest.approx(theirs(g[i], d[i, :0], e[i]), rel=1e-6)


def test_other_designs_beside_change_no_bit() -> None:
    g, d, e = problems(8)
    x, t, *_ = solved(g, d, e)
    again, least, *_ = solved(g[[5, 2]], d[[5, 2]], e[[5, 2]])
    np.testing.assert_array_equal(again, x[[5, 2]])
    np.testing.assert_array_equal(least, t[[5, 2]])


def test_missing_numbers_and_impossible_needs_are_told() -> None:
    g, d, e = problems(3)
    g[0, 3, 1] = np.nan
    e[1] = 0.0
    x, t, _, status = solved(g, d, e)
    assert status.tolist() == [st.NOT_ASSEMBLED, st.NOT_CONVERGED, st.OK]
    assert np.isnan(x[:2]).all() and np.isnan(t[:2]).all() and np.isfinite(x[2]).all()
