"""Fronts by bounds on a second output: closed forms, a linkage, order, spreading, going on half way, budget."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from kernels import status as st
from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise import Problem, minimise, pareto
from sweep.optimise.front.pareto import FrontSearch, advance, bounded, gaps, steps
from sweep.study import Limit, OptimiseSettings, ParetoSettings
from tests.support.optimise_family import FAMILY


def settings(
    output: str, *bounds: float, at_least: bool = False, time_budget: float | None = None, points: int | None = None
) -> ParetoSettings:
    return ParetoSettings(output, bounds, at_least, 1, time_budget, points)


def bowl(*limits: Limit) -> Problem:
    """Largest |bowl| = (p - 1)^2 + (q + 2)^2 + 1 against largest |swell| = |p|."""
    return Problem(FAMILY, ("p", "q"), np.full(2, -4.0), np.full(2, 4.0), {}, "max_abs_bowl", limits)


BOWL_START = bowl().rows(np.array([[3.0, 3.0]]))


def linkage() -> tuple[Problem, np.ndarray]:
    """Crank-rockers of one swing, acceleration against pressure angle, and two designs to start from."""
    low, high = np.array([0.1, 0.5, 0.5]), np.array([0.9, 2.0, 2.0])
    fixed = {"e": 1.2, "f": 0.1, "g": 0.2, "alpha": 0.5, "branch": 1.0}
    held = Limit("swing", 0.8, 0.8)
    problem = Problem(family("rssr"), ("a", "b", "c"), low, high, fixed, "max_abs_d2psi", (held,))
    return problem, problem.rows(np.array([[0.4, 1.2, 1.0], [0.3, 0.9, 0.8]]))


def angle_of(problem: Problem, design: np.ndarray) -> float:
    columns = design_outputs(problem.family, design[None, :], ["max_pressure_angle"], Accuracy(target=1e-12))
    return float(columns["max_pressure_angle"][0])


def test_front_of_two_known_outputs() -> None:
    results = pareto(bowl(), settings("max_abs_swell", 0.25, 2.0, 0.5, 0.75), BOWL_START)
    # |p| <= bound costs (1 - bound)^2 below 1 and nothing above.
    assert [r.objective for r in results] == pytest.approx([1.0, 1.0625, 1.25, 1.5625], abs=1e-9)
    assert [r.design[0] for r in results] == pytest.approx([1.0, 0.75, 0.5, 0.25], abs=1e-5)
    assert all(r.status == st.OK for r in results)


def test_lower_bounds_begin_with_the_smallest() -> None:
    results = pareto(bowl(), settings("max_abs_swell", 2.0, 0.5, 1.5, at_least=True), BOWL_START)
    assert [r.objective for r in results] == pytest.approx([1.0, 1.25, 2.0], abs=1e-9)
    assert [r.design[0] for r in results] == pytest.approx([1.0, 1.5, 2.0], abs=1e-5)


def test_bound_takes_the_place_of_the_limit_on_its_side_only() -> None:
    problem = bowl(Limit("max_abs_swell", 0.4, 0.5))
    loose, tight = pareto(problem, settings("max_abs_swell", 0.9, 0.3), problem.rows(np.array([[0.45, 3.0]])))
    assert loose.objective == pytest.approx(1.01, abs=1e-9)
    assert tight.status == st.LIMIT_EXCEEDED
    assert tight.relaxation["max_abs_swell"] > 0.0
    (least,) = pareto(problem, settings("max_abs_swell", 0.45, at_least=True), problem.rows(np.array([[0.45, 3.0]])))
    assert least.design[0] == pytest.approx(0.5, abs=1e-6)


def test_linkage_pays_for_a_smaller_pressure_angle() -> None:
    problem, starts = linkage()
    free = minimise(problem, starts, OptimiseSettings())[0]
    widest = angle_of(problem, free.design)
    bounds = [widest + 0.1, widest - 0.05, widest - 0.1, widest - 0.15]
    results = pareto(problem, settings("max_pressure_angle", *bounds), starts)
    assert [r.status for r in results] == [st.OK] * 4
    # The loosest bound makes no difference; every tighter one is used up and costs something.
    assert results[0].objective == pytest.approx(free.objective, rel=1e-9)
    assert all(tight.objective > loose.objective * (1.0 + 1e-4) for loose, tight in itertools.pairwise(results))
    for bound, result in zip(bounds[1:], results[1:], strict=True):
        assert angle_of(problem, result.design) == pytest.approx(bound, abs=1e-8)
        assert "max_pressure_angle at its maximum" in result.active
        alone = minimise(bounded(problem, settings("max_pressure_angle", bound), bound), starts, OptimiseSettings())[0]
        assert result.objective <= alone.objective * (1.0 + 1e-9)


def test_no_start_of_a_bound_looks_at_more_designs_than_the_optimum_may() -> None:
    problem, starts = linkage()
    (long,) = pareto(problem, settings("max_pressure_angle", 0.9), starts)
    (short,) = pareto(problem, replace(settings("max_pressure_angle", 0.9), looks=5), starts)
    assert short.ended == "looks" and short.looks <= 5 < long.looks


def test_no_linkage_with_a_pressure_angle_near_zero() -> None:
    problem, starts = linkage()
    (result,) = pareto(problem, settings("max_pressure_angle", 0.02), starts)
    assert result.status == st.LIMIT_EXCEEDED and result.ended == "infeasible"
    assert result.relaxation["max_pressure_angle"] > 0.1


def test_a_tighter_bound_lends_its_better_design_to_a_looser_one() -> None:
    problem, starts = linkage()
    asked = settings("max_pressure_angle", 1.2, 0.9)
    good = minimise(problem, starts, OptimiseSettings())[0]
    bad = replace(good, design=starts[1], objective=good.objective * 2.0)
    begun = replace(FrontSearch.of(asked), results=(bad, good), found=(0, 1), taken=2)
    *_, front = advance(problem, asked, begun, starts[:1])
    loose, tight = (result for _, result in front.known())
    assert front.complete and front.found[0] == 2
    assert loose.objective == pytest.approx(good.objective, rel=1e-9)
    assert tight.objective == pytest.approx(good.objective, rel=1e-9)


def test_going_on_half_way_gives_the_same_front() -> None:
    problem, starts = linkage()
    asked = settings("max_pressure_angle", 0.9, 0.8, 0.7)
    states = list(advance(problem, asked, FrontSearch.of(asked), starts))
    assert len(states) == len(steps(3)) and states[-1].complete
    for state in states[1:4]:
        *_, again = advance(problem, asked, state, starts)
        assert again.found == states[-1].found
        for (_, one), (_, other) in zip(again.known(), states[-1].known(), strict=True):
            np.testing.assert_array_equal(one.design, other.design)
            assert one.objective == other.objective and one.kkt_residual == other.kkt_residual


def test_budget_and_stop_leave_the_front_so_far() -> None:
    asked = settings("max_abs_swell", 1.0, 0.5)
    assert len(pareto(bowl(), asked, BOWL_START, stop=lambda: True)) == 1
    assert len(pareto(bowl(), replace(asked, time_budget=1e-9), BOWL_START)) == 1
    *_, last = advance(bowl(), asked, FrontSearch.of(asked), BOWL_START, stop=lambda: True)
    assert last.taken == 0 and not last.complete


@pytest.mark.parametrize(("output", "message"), [("max_abs_swel", "max_abs_swel"), ("max_abs_bowl", "objective")])
def test_second_output_that_cannot_be_is_named(output: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        pareto(bowl(), settings(output, 1.0), BOWL_START)


def test_step_cut_short_by_the_brake_is_taken_again() -> None:
    problem, starts = linkage()
    asked = settings("max_pressure_angle", 0.9, 0.8)
    *_, whole = advance(problem, asked, FrontSearch.of(asked), starts)
    *_, cut = advance(problem, replace(asked, time_budget=1e-9), FrontSearch.of(asked), starts)
    assert cut.taken == 0 and cut.known()[0][1].ended == "time"
    *_, again = advance(problem, asked, replace(cut, results=(None, None), found=(-1, -1)), starts)
    assert [r.objective for _, r in again.known()] == [r.objective for _, r in whole.known()]


def between(front: FrontSearch, bends: Callable[[np.ndarray], np.ndarray]) -> float:
    """Largest error of the front drawn as a polygon, over all bounds from the tightest to the loosest."""
    bounds, values = (np.array(x) for x in zip(*[(b, r.objective) for b, r in front.known()], strict=True))
    dense = np.linspace(min(bounds), max(bounds), 2000)
    order = np.argsort(bounds)
    return float(np.abs(np.interp(dense, bounds[order], values[order]) - bends(dense)).max())


def last(problem: Problem, asked: ParetoSettings, starts: np.ndarray) -> FrontSearch:
    *_, front = advance(problem, asked, FrontSearch.of(asked), starts)
    return front


def test_bounds_are_placed_where_the_front_bends() -> None:
    """1 + (1 - bound)^2 below a bound of 1, flat above: nothing is worth knowing between 1 and 4."""
    placed = last(bowl(), settings("max_abs_swell", 4.0, 0.05, points=9), BOWL_START)
    assert len(placed.bounds) == 9 and placed.complete and not placed.filled
    assert placed.bounds == tuple(sorted(placed.bounds, reverse=True))
    assert sum(bound > 1.0 for bound in placed.bounds) == 1
    evenly = last(bowl(), settings("max_abs_swell", *np.linspace(4.0, 0.05, 9)), BOWL_START)

    def truth(bounds: np.ndarray) -> np.ndarray:
        return 1.0 + np.maximum(1.0 - bounds, 0.0) ** 2

    assert [r.objective for _, r in placed.known()] == pytest.approx(truth(np.array(placed.bounds)), abs=1e-8)
    # The flat part is known by what the loosest result reaches of the second output.
    known = replace(placed, bounds=(1.0, *placed.bounds[1:]))
    assert between(known, truth) < 0.02 < 0.05 < between(evenly, truth)


def test_placed_bounds_go_on_half_way_to_the_same_bits() -> None:
    problem, starts = linkage()
    asked = settings("max_pressure_angle", 0.9, 0.6, points=5)
    states = list(advance(problem, asked, FrontSearch.of(asked), starts))
    assert [state.taken for state in states] == list(range(1, len(steps(2)) + 4))
    assert states[-1].complete and len(states[-1].bounds) == 5
    for state in (states[0], states[-3], states[-2]):
        *_, again = advance(problem, asked, state, starts)
        assert again.bounds == states[-1].bounds and again.found == states[-1].found
        for (_, one), (_, other) in zip(again.known(), states[-1].known(), strict=True):
            np.testing.assert_array_equal(one.design, other.design)
    objectives = [result.objective for _, result in states[-1].known()]
    assert objectives == sorted(objectives)  # a tighter bound never has the better design


def test_end_of_a_front_is_looked_for() -> None:
    """With |p| at least 0.4 no design keeps a bound below it: points close in on 0.4."""
    problem = bowl(Limit("max_abs_swell", 0.4, None))
    front = last(problem, settings("max_abs_swell", 0.9, 0.1, points=8), problem.rows(np.array([[0.6, 0.0]])))
    kept = [bound for bound, result in front.known() if result.status != st.LIMIT_EXCEEDED]
    missed = [bound for bound, result in front.known() if result.status == st.LIMIT_EXCEEDED]
    assert min(kept) >= 0.4 - 1e-14 > max(missed)  # bounds are sums of steps, a few roundings
    assert min(kept) - max(missed) < 0.15


def test_flat_front_gets_no_further_points() -> None:
    front = last(bowl(), settings("max_abs_swell", 4.0, 2.0, points=9), BOWL_START)
    assert front.filled and front.complete and len(front.bounds) == 2


def test_placing_stops_when_asked_and_keeps_what_is_finished() -> None:
    asked, calls = settings("max_abs_swell", 4.0, 0.05, points=9), itertools.count()
    states = list(advance(bowl(), asked, FrontSearch.of(asked), BOWL_START, lambda: next(calls) > 60))
    assert not states[-1].complete
    kept = max((state for state in states if state.taken < 12), key=lambda state: state.taken)
    *_, again = advance(bowl(), asked, kept, BOWL_START)
    assert again.bounds == last(bowl(), asked, BOWL_START).bounds


@pytest.mark.parametrize(
    ("bounds", "values", "number", "area"),
    [
        ([4.0, 2.0, 0.0], [1.0, 1.0, 3.0], 1, 0.25),
        ([0.0, 2.0, 4.0], [1.0, 2.0, 2.0], 0, 0.25),
        ([4.0, 3.0, 0.0], [1.0, 2.0, math.nan], 1, 0.375),  # no end is known: any height
    ],
)
def test_largest_gap_is_that_of_the_largest_triangle(
    bounds: list[float], values: list[float], number: int, area: float
) -> None:
    found = gaps(np.array(bounds), np.array(bounds), np.array(values))
    assert (found[0].number, found[0].area) == (number, pytest.approx(area))
    assert found[0].middle == pytest.approx(0.5 * (bounds[number] + bounds[number + 1]))


def test_gap_begins_where_the_looser_point_ends() -> None:
    """At a bound of 4 the design reaches 1: nothing happens between."""
    (gap,) = gaps(np.array([4.0, 0.0]), np.array([1.0, 0.0]), np.array([1.0, 2.0]))
    assert (gap.area, gap.middle) == (0.5, 0.5)
    assert gaps(np.array([4.0, 2.0]), np.array([1.0, 1.0]), np.array([1.0, 1.0])) == []


def test_jump_is_no_gap_that_a_point_could_fill() -> None:
    bounds = np.array([1.0, 0.5001, 0.5, 0.0])
    assert gaps(bounds, bounds, np.array([0.0, 0.0, 1.0, 1.0])) == []
    assert gaps(np.empty(0), np.empty(0), np.empty(0)) == []
