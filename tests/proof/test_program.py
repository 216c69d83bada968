"""The small linear program of a box against HiGHS, and what the combined rows prove."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from kernels import status as st
from kernels.boxes.branching import combined, multipliers
from kernels.boxes.taylor import width


def solved(rows, objective, half):
    """Outcome and multipliers."""
    out = np.zeros(len(rows))
    return multipliers(rows, len(rows), objective, half, out), out


def least(rows, factors, half):
    """Least value over the box of the combination of linear rows."""
    total = factors @ rows
    return total[0] - np.abs(total[1:]) @ half


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_multipliers_reach_the_optimum_of_another_solver(n):
    rng = np.random.default_rng(n)
    compared = 0
    for _ in range(100):
        m = int(rng.integers(2, 14))
        rows, half = rng.normal(size=(m, n + 1)), rng.uniform(0.1, 2.0, n)
        objective = (rng.uniform(size=m) < 0.6).astype(np.uint8)
        objective[0] = 1
        outcome, factors = solved(rows, objective, half)
        cost = np.r_[np.zeros(n), 1.0]
        left = np.where(objective[:, None], np.c_[rows[:, 1:], -np.ones(m)], np.c_[-rows[:, 1:], np.zeros(m)])
        right = np.where(objective, -rows[:, 0], rows[:, 0])
        other = linprog(cost, left, right, bounds=[*((-h, h) for h in half), (0, None)])
        if other.status == 2:
            assert outcome == st.LIMIT_EXCEEDED
            assert least(rows, np.where(objective, 0.0, -factors), half) > 0.0
            continue
        assert outcome == st.OK
        # what the lent curvature adds to their sum, 1e-8 of the bound, the caller divides by
        assert (factors >= 0.0).all() and factors[objective == 1].sum() <= 1.0 + 1e-6
        # both solvers end where no row is missed by more than their tolerance, 1e-7 of HiGHS
        assert least(rows, np.where(objective, factors, -factors), half) == pytest.approx(other.fun, abs=1e-6)
        compared += 1
    assert compared >= 20


def test_combination_is_bounded_from_below_with_the_rounding_of_its_terms():
    forms = np.zeros((2, width(1)))
    forms[0] = [1.0, 0.5, 0.25, 0.125]
    forms[1] = [0.5, 0.25, -1.0, 0.0]
    bound = combined(forms, np.array([1.0, -1.0]), 2, 1, np.zeros(width(1)))
    # 0.5 + 0.25 xi + 1.25 xi^2 +- 0.125, lowest at xi = -0.1
    assert 0.3625 - 1e-12 < bound < 0.3625
