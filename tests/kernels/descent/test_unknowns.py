"""Least largest magnitudes in five unknowns against scipy's linear programs, which share no code."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from kernels.descent.unknowns import OBJECTIVE, OMITTED, REQUIRED, SOFT, best_unknowns

BOUND, NEED, PRICE = 0.015, np.array([24.5, 3.0]), 100.0


def problems(count: int, poses: int = 32, seed: int = 0) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Smooth periodic rows; as for a guide, the offset moves the deviation alone."""
    rng = np.random.default_rng(seed)
    phi = np.arange(poses) * 2.0 * np.pi / poses
    waves = np.array([wave(k * phi) / (1 + k * k) for wave in (np.cos, np.sin) for k in range(1, 5)])
    found = []
    for _ in range(count):
        g, d, e = (rng.standard_normal((5, 8)) @ waves for _ in range(3))
        g[4], d[4], e[4] = 0.0, -1.0, 0.0
        found.append((g, d, e[:, :2].copy()))
    return found


def bounds_of(bound: float | np.ndarray, poses: int = 32) -> np.ndarray:
    """How far the deviation may go below zero and above it, (2, m)."""
    return np.broadcast_to(np.asarray(bound, np.float64), (2, poses)).copy()


def solved(
    g: np.ndarray, d: np.ndarray, e: np.ndarray, bound: np.ndarray, size: float = 10.0
) -> tuple[np.ndarray, float]:
    values = np.concatenate([np.zeros(2 * g.shape[1]), bound[1], bound[0], -NEED])
    slopes = np.concatenate([-g, g, -d, d, e], axis=1)
    kinds = np.repeat([OBJECTIVE, SOFT, REQUIRED], [2 * g.shape[1], 2 * d.shape[1], 2])
    kinds[~np.isfinite(values)], values[~np.isfinite(values)] = OMITTED, 0.0
    x = np.zeros(5)
    assert best_unknowns(values, np.ascontiguousarray(slopes), kinds, np.full(5, size), 3.0, PRICE, x)
    missed = max(0.0, (d.T @ x - bound[1]).max(), (-d.T @ x - bound[0]).max())
    assert (e.T @ x >= NEED * (1.0 - 1e-9)).all()
    return x, float(np.abs(g.T @ x).max() + PRICE * missed)


def theirs(g: np.ndarray, d: np.ndarray, e: np.ndarray, bound: np.ndarray) -> float:
    one, none = np.ones((g.shape[1], 1)), np.zeros((g.shape[1], 1))
    a = np.vstack(
        [
            np.hstack([g.T, -one, none]), np.hstack([-g.T, -one, none]),
            np.hstack([d.T, none, -one]), np.hstack([-d.T, none, -one]), np.hstack([-e.T, np.zeros((2, 2))]),
        ]
    )  # fmt: skip
    below, above = np.minimum(bound, 1e6)  # HiGHS refuses infinite ones
    b = np.concatenate([np.zeros(2 * g.shape[1]), above, below, -NEED])
    free = [(None, None)] * 5 + [(0, None)] * 2
    return float(linprog(np.array([0, 0, 0, 0, 0, 1, PRICE]), A_ub=a, b_ub=b, bounds=free).fun)


ONE_SIDED = np.stack([np.linspace(0.0, 2.0, 32), np.linspace(1.0, 0.01, 32)])
ONE_SIDED[0, 3:9], ONE_SIDED[1, 20:] = np.inf, np.inf


@pytest.mark.parametrize(
    "bound",
    [0.015, 5.0, np.linspace(-0.01, 0.05, 32), ONE_SIDED],
    ids=["narrow", "wide", "missed at the price where it is negative", "further to one side, or anywhere"],
)
def test_least_largest_magnitude_equals_scipys(bound: float | np.ndarray) -> None:
    for g, d, e in problems(8):
        # HiGHS keeps its rows to 1e-7.
        own = solved(g, d, e, bounds_of(bound))[1]
        assert own == pytest.approx(theirs(g, d, e, bounds_of(bound)), rel=1e-6)
        # Whatever the unknowns are measured in.
        assert solved(g, d, e, bounds_of(bound), 1.0)[1] == pytest.approx(own, rel=1e-6)


def test_missing_numbers_and_impossible_needs_are_told_and_leave_the_unknowns() -> None:
    (g, _, e), x = problems(1)[0], np.ones(5)
    kinds, size = np.array([OBJECTIVE, OBJECTIVE, REQUIRED, REQUIRED]), np.ones(5)
    for row, value in ((e[:, :1], np.nan), (np.zeros((5, 1)), -1.0), (np.full((5, 1), np.nan), -1.0)):
        slopes = np.concatenate([g[:, :1], -g[:, :1], row, e[:, 1:]], axis=1)
        assert not best_unknowns(np.array([0.0, 0.0, value, -1.0]), slopes, kinds, size, 1.0, PRICE, x)
        assert (x == 1.0).all()
