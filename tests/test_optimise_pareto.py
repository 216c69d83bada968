"""Fronts by bounds on a second output: a closed form, order, a bound that cannot be kept, the time budget."""

from __future__ import annotations

import numpy as np
import pytest

from kernels import status as st
from sweep.errors import InputError
from sweep.families import family
from sweep.optimise import Problem, pareto
from sweep.study import Limit, OptimiseSettings
from tests.optimise_family import FAMILY

ONCE = OptimiseSettings(starts=1)


def bowl(*limits: Limit) -> Problem:
    """Largest |bowl| = (p - 1)^2 + (q + 2)^2 + 1 against largest |swell| = |p|."""
    return Problem(FAMILY, ("p", "q"), np.full(2, -4.0), np.full(2, 4.0), {}, "max_abs_bowl", limits)


def test_front_of_two_known_outputs() -> None:
    problem = bowl()
    bounds = [0.25, 2.0, 0.5, 0.75]
    results = pareto(problem, "max_abs_swell", bounds, problem.rows(np.array([[3.0, 3.0]])), ONCE)
    # |p| <= bound costs (1 - bound)^2 below 1 and nothing above.
    expected = [1.0 + max(0.0, 1.0 - bound) ** 2 for bound in sorted(bounds, reverse=True)]
    assert [r.objective for r in results] == pytest.approx(expected, abs=1e-9)
    assert [r.design[0] for r in results] == pytest.approx([1.0, 0.75, 0.5, 0.25], abs=1e-5)
    assert all(r.status == st.OK for r in results)


def test_bound_replaces_the_upper_limit_and_keeps_the_lower() -> None:
    problem = bowl(Limit("max_abs_swell", 0.4, 0.5))
    results = pareto(problem, "max_abs_swell", [0.9, 0.3], problem.rows(np.array([[0.45, 3.0]])), ONCE)
    assert results[0].objective == pytest.approx(1.01, abs=1e-9)
    assert results[1].status == st.LIMIT_EXCEEDED


def test_linkage_pays_for_a_smaller_pressure_angle() -> None:
    held = Limit("swing", 0.8, 0.8)
    low, high = np.array([0.1, 0.5]), np.array([0.9, 2.0])
    fixed = {"c": 1.0, "e": 1.2, "f": 0.1, "g": 0.2, "alpha": 0.5, "branch": 1.0}
    problem = Problem(family("rssr"), ("a", "b"), low, high, fixed, "max_abs_d2psi", (held,))
    free, tight = pareto(problem, "max_pressure_angle", [1.2, 0.5], problem.rows(np.array([[0.4, 1.2]])), ONCE)
    assert free.status == st.OK and free.kkt_residual <= 1e-6
    assert tight.status == st.LIMIT_EXCEEDED or tight.objective > free.objective * (1.0 - 1e-9)


def test_budget_and_stop_leave_the_front_so_far() -> None:
    problem = bowl()
    starts = problem.rows(np.array([[3.0, 3.0]]))
    assert len(pareto(problem, "max_abs_swell", [1.0, 0.5], starts, ONCE, stop=lambda: True)) == 1
    assert len(pareto(problem, "max_abs_swell", [1.0, 0.5], starts, OptimiseSettings(1, 0, 1e-9))) == 1


def test_unknown_second_output_is_named() -> None:
    problem = bowl()
    with pytest.raises(InputError, match="max_abs_swel"):
        pareto(problem, "max_abs_swel", [1.0], problem.rows(np.array([[3.0, 3.0]])), ONCE)
