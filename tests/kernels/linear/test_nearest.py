"""The nearest point under linear rows against scipy's non-negative least squares, which share no code."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from kernels import status as st
from kernels.linear.nearest import nearest
from kernels.linear.nearest_of_many import CurveRows, Nearest, nearest_of_many


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


def curves(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows of three smooth curves around a turn of 32 poses and four that belong to none; values and slopes."""
    phi = np.arange(32) * (2.0 * np.pi / 32)
    waves = np.array([np.ones(32), np.cos(phi), np.sin(phi), np.cos(2.0 * phi), np.sin(2.0 * phi)])
    values = np.concatenate([rng.standard_normal((3, 5)) @ waves + 1.0, np.full((1, 32), np.nan)])[:3].ravel()
    slopes = np.concatenate([rng.standard_normal((n, 5)) @ waves for _ in range(3)], axis=1)
    turns = np.arange(96).reshape(3, 32)
    values = np.concatenate([values, rng.standard_normal(4)])
    return values, np.concatenate([slopes, rng.standard_normal((n, 4))], axis=1), turns


def stepped(
    seed: int, function: object = nearest_of_many, near: float = 0.2, begin: np.ndarray | None = None
) -> tuple[np.ndarray, ...]:
    """The step among few of the rows, that among all of them, the rows after it, their weights, and what holds."""
    rng = np.random.default_rng(seed)
    held = np.zeros(6, np.int64) if begin is None else begin.copy()
    n = 5
    values, slopes, turns = curves(rng, n)
    slopes[-1] = 1.0  # one unknown mends them all, so that some step keeps every row
    back = np.linalg.qr(rng.standard_normal((n, n)))[0] * (1.0 + rng.random(n))
    centre, low, high = rng.standard_normal(n), np.full(n, -3.0), np.full(n - 1, 3.0)
    step, there, weights = np.empty(n), np.empty(len(values)), np.empty(len(values))
    found = Nearest(step, there, weights, held)
    of = CurveRows(values, slopes, turns)
    status = function(of, back, centre, low, high, (near, 1e-9), 20, 1e-13, found)  # type: ignore[operator]
    box = np.concatenate([back, -back[: n - 1]])
    rows = np.concatenate([back.T @ slopes, box.T], axis=1)
    whole, _, told = solved(rows, np.concatenate([-values, low, -high]), centre)
    assert status == told == st.OK
    return step, back @ whole, there, weights, values + step @ slopes, held


@pytest.mark.parametrize("seed", range(20))
def test_step_among_the_rows_that_matter_is_that_among_all_rows(seed: int) -> None:
    step, whole, there, weights, after, held = stepped(seed)
    rows = held[1 : 1 + held[0]]
    assert set(np.flatnonzero(weights)) <= set(rows[rows >= 0].tolist())
    # What is missed joins until nothing is missed by more than 1e-9.
    np.testing.assert_allclose(step, whole, atol=1e-7)
    np.testing.assert_allclose(there, after, atol=1e-12)
    assert (there >= -1e-8).all() and (weights >= 0.0).all() and np.abs(there[weights > 0.0]).max(initial=0.0) < 1e-8


def test_rows_that_join_later_go_on_from_the_point_reached() -> None:
    """With all rows near or none at first the step is the same; plain Python gives the same bits."""
    for seed in range(5):
        first, later = stepped(seed, near=1e3), stepped(seed, near=-1e3)
        np.testing.assert_allclose(first[0], later[0], atol=1e-7)
    for ours, plain in zip(stepped(3), stepped(3, nearest_of_many.py_func), strict=True):
        np.testing.assert_array_equal(ours, plain)


@pytest.mark.parametrize("seed", range(20))
def test_rows_that_held_elsewhere_lead_to_the_same_step(seed: int) -> None:
    """Those of the same program, of another one, and any five: box ends, dependent rows, rows that are far away."""
    first = stepped(seed)
    others = [np.concatenate([[5], np.random.default_rng(k).integers(-9, 100, 5)]) for k in range(5)]
    for begin in (first[5], stepped(seed + 1)[5], *others):
        again = stepped(seed, begin=begin)
        np.testing.assert_allclose(again[0], first[0], atol=1e-7)
        np.testing.assert_allclose(again[3], first[3], atol=1e-5 * (1.0 + np.abs(first[3]).max()))
        assert set(again[5][1 : 1 + again[5][0]]) == set(first[5][1 : 1 + first[5][0]])
