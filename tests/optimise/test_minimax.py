"""The optimiser on made-up curves whose best designs are known in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kernels import status as st
from sweep.errors import InputError
from sweep.families.base import Accuracy
from sweep.optimise import Problem, minimise
from sweep.study import Limit, OptimiseSettings
from tests.support.optimise_family import FAMILY

ONCE = OptimiseSettings(starts=1)


def problem(objective, limits=(), variables=("p", "q"), low=-4.0, high=4.0, rest=0.0, **kwargs):
    n = len(variables)
    fixed = {name: rest for name in ("p", "q", "r") if name not in variables}
    return Problem(FAMILY, variables, np.full(n, low), np.full(n, high), fixed, objective, limits, **kwargs)


def solve(p, *starts):
    return minimise(p, p.rows(np.array(starts)), ONCE)


def test_chebyshev_polynomial_is_found_with_four_equal_peaks():
    # Of all cubics with leading coefficient 4, T3 has the smallest maximum, 1: four alternating peaks, a corner.
    p = problem("max_abs_wave", variables=("p", "q", "r"))
    for result in solve(p, [1.0, -2.0, 0.5], [-3.0, 3.0, 2.0]):
        assert result.status == st.OK
        assert result.objective == pytest.approx(1.0, abs=1e-9)
        assert np.abs(result.design[:3]).max() < 1e-8
        assert result.kkt_residual <= 1e-6 and result.gap <= 1e-9 and result.agree == 2


def test_smooth_interior_optimum_has_no_active_limit():
    (result,) = solve(problem("max_bowl"), [-3.0, 3.0])
    assert result.ended == "converged"
    assert result.objective == pytest.approx(1.0, abs=1e-12)
    assert result.design[:2] == pytest.approx([1.0, -2.0], abs=1e-6)
    assert result.active == ()


@pytest.mark.parametrize(
    ("limit", "active"),
    [
        (Limit("range_swell", 4.0, None), "range_swell at its minimum"),
        (Limit("range_swell", 4.0, 4.0), "range_swell held by its equation"),
        (Limit("max_abs_swell", 2.0, None), "max_abs_swell at its minimum"),
        (Limit("min_swell", None, -2.0), "min_swell at its maximum"),
    ],
)
def test_limit_holds_the_optimum_back(limit, active):
    (result,) = solve(problem("max_bowl", (limit,)), [3.0, 3.0])
    assert result.objective == pytest.approx(2.0, abs=1e-9)
    assert result.design[:2] == pytest.approx([2.0, -2.0], abs=1e-6)
    assert result.active == (active,)
    assert result.violation <= 1e-9
    # dJ/dp = 2 at p = 2, J = 2: twice the relative change of the bound, whatever the start was worth
    assert abs(result.multipliers[active]) == pytest.approx(2.0, rel=1e-6)


def test_bound_holds_the_optimum_back():
    (result,) = solve(problem("max_bowl", low=-1.0, high=0.5), [0.0, 0.0])
    assert result.objective == pytest.approx(0.25 + 1.0 + 1.0, abs=1e-12)
    assert set(result.active) == {"p at its upper bound", "q at its lower bound"}


def test_window_edge_counts_in_the_straightest_curve():
    # Best line through s^2 for s in [-1, 0], the lower half of the stroke: s^2 + s + 1/8, error 1/8 at both ends.
    p = problem("max_abs_dev", window=(0.0, 0.5))
    (result,) = solve(p, [-2.0, 1.0])
    assert result.objective == pytest.approx(0.125, abs=1e-10)
    assert result.design[:2] == pytest.approx([1.0, 0.125], abs=1e-8)
    # Negative control: over the whole stroke the answer is another one, 1/2 at p = 0.
    (whole,) = solve(problem("max_abs_dev"), [-2.0, 1.0])
    assert whole.objective == pytest.approx(0.5, abs=1e-10)


def test_output_of_a_step_serves_as_objective_and_as_limit():
    (result,) = solve(problem("bill", (Limit("max_bowl", None, 2.0),), low=-2.0, high=2.0), [1.5, -1.5])
    # min exp(p) + q^2 with (p-1)^2 + (q+2)^2 <= 1: stationarity along the circle, checked by brute force.
    angle = np.linspace(0.0, 2.0 * math.pi, 2_000_001)
    brute = (np.exp(1.0 + np.cos(angle)) + (np.sin(angle) - 2.0) ** 2).min()
    assert result.objective == pytest.approx(brute, abs=1e-9)
    assert result.kkt_residual <= 1e-6


def test_infeasible_specification_gets_the_smallest_relaxation():
    p = problem("max_bowl", (Limit("range_swell", 4.0, None),), low=-1.5, high=1.5)
    for result in solve(p, [0.5, 0.0], [-0.5, 1.0]):
        assert result.status == st.LIMIT_EXCEEDED and result.ended == "infeasible"
        assert result.relaxation == {"range_swell": pytest.approx(1.0, abs=1e-9)}
        assert result.violation == pytest.approx(0.25, abs=1e-9)


def test_two_limits_that_contradict_are_relaxed_evenly():
    limits = (Limit("max_swell", None, 1.0), Limit("range_swell", 4.0, None))
    (result,) = solve(problem("max_bowl", limits, low=0.1), [0.5, 0.0])
    # violations p - 1 and (4 - 2p)/4 are equal at p = 4/3
    assert result.design[0] == pytest.approx(4.0 / 3.0, abs=1e-7)
    assert result.relaxation == {
        "max_swell": pytest.approx(1 / 3, abs=1e-7),
        "range_swell": pytest.approx(4 / 3, abs=1e-7),
    }


def test_same_starts_give_the_same_bits():
    p = problem("max_abs_wave", (Limit("range_swell", 1.0, None),), variables=("p", "q", "r"))
    first, second = (solve(p, [1.0, -2.0, 0.5], [-3.0, 3.0, 2.0]) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        assert a.design.tobytes() == b.design.tobytes() and a.kkt_residual == b.kkt_residual


def test_time_budget_leaves_the_best_so_far_of_the_first_start():
    p = problem("max_abs_wave", variables=("p", "q", "r"))
    results = minimise(p, p.rows(np.array([[1.0, -2.0, 0.5]] * 5)), OptimiseSettings(time_budget=0.0))
    assert len(results) == 1
    assert results[0].ended == "time"
    assert math.isfinite(results[0].objective) and results[0].objective > 1.0


def test_stop_between_starts_keeps_what_was_found():
    p = problem("max_bowl")
    asked = iter(range(10_000))
    results = minimise(p, p.rows(np.array([[3.0, 3.0]] * 50)), ONCE, stop=lambda: next(asked) > 200)
    assert 1 <= len(results) < 50
    assert results[0].ended == "converged" and results[-1].ended in ("time", "converged")


def test_few_samples_do_not_hide_a_peak():
    # Eight poses per turn cannot see cos 3phi's peaks; the verification on more poses finds them.
    p = problem("max_abs_wave", variables=("p", "q", "r"), accuracy=Accuracy(samples=8))
    (result,) = solve(p, [1.0, -2.0, 0.5])
    assert result.objective == pytest.approx(1.0, abs=1e-8)


@pytest.mark.parametrize(
    ("kwargs", "words"),
    [
        ({"variables": ("p", "z")}, "z"),
        ({"variables": ("p", "branch")}, "branch"),
        ({"variables": ("p", "p")}, "each once"),
        ({"low": 5.0}, "lower below upper"),
        ({"limits": (Limit("max_bowl", None, math.inf),)}, "max_bowl = .*finite bounds, None for a side without one"),
        ({"limits": (Limit("max_bowl", math.nan, 2.0),)}, "max_bowl = .*finite bounds"),
        ({"rest": math.nan}, "r = nan; allowed: a finite number"),
        ({"window": (0.6, 0.2)}, "window"),
    ],
)
def test_faulty_problem_is_refused_with_the_name(kwargs, words):
    with pytest.raises(InputError, match=words):
        problem("max_bowl", **kwargs)


@pytest.mark.parametrize("name", ["max_abs_wvae", "margin", "max_pressure_angle", "swing", "phi_ext2"])
def test_unknown_output_is_refused(name):
    p = problem(name)
    with pytest.raises(InputError, match=name):
        solve(p, [0.0, 0.0])
