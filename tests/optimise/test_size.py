"""The size of a mechanism: as an output, as an objective, as a limit, as the second output of a front."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.errors import InputError
from sweep.families import family
from sweep.families.base import Angles, Family, Output, Parameter
from sweep.optimise import Problem, minimise, pareto
from sweep.quantities.dimensions import lengths
from sweep.study import Limit, OptimiseSettings, ParetoSettings

FIXED = {"f": -0.3, "g": 0.2, "alpha": 0.5, "branch": 1.0}
LOW, HIGH = np.array([0.1, 0.5, 0.5, 0.5]), np.array([0.9, 3.0, 3.0, 3.0])
TURNS = Limit("swing", 0.8, 0.8)


def linkage(objective: str, *limits: Limit, **fixed: float) -> tuple[Problem, np.ndarray]:
    problem = Problem(family("rssr"), ("a", "b", "c", "e"), LOW, HIGH, FIXED | fixed, objective, (TURNS, *limits))
    return problem, problem.rows(np.array([[0.4, 1.2, 1.0, 1.2], [0.3, 0.9, 0.8, 1.5]]))


def size_of(design: np.ndarray) -> float:
    return float(np.abs(design[:6]).max())


def test_size_is_the_largest_length_by_magnitude() -> None:
    table = {
        "a": [1.0, 1.0],
        "b": [4.0, 4.0],
        "c": [3.0, 3.0],
        "e": [4.5, 3.5],
        "f": [0.0, -7.0],
        "g": 0.0,
        "alpha": 0.9,
    }
    found = sweep.summarise("rssr", table, ["size"])
    assert found["size"].tolist() == [4.5, 7.0] and found["err_size"].tolist() == [0.0, 0.0]
    assert lengths(family(["rssr", "rssp"])) == ("a1", "b1", "c1", "e1", "f1", "g1", "a2", "b2", "e2", "f2")


def test_inputs_of_effects_are_no_lengths_of_the_mechanism() -> None:
    from sweep.effects import extended

    loaded = extended(family("rssr"), ["max_force_c"])
    assert len(loaded.parameters) > 8 and lengths(loaded) == ("a", "b", "c", "e", "f", "g")


@pytest.mark.parametrize("ratio", [1, 2, -3])
def test_size_of_a_member_does_not_depend_on_its_gear(ratio: int) -> None:
    """A drive on a geared shaft, of a given swing, is as small as the same drive alone."""
    machine = sweep.machine({"needle": "slider_crank", "looper": {"family": "rssr", "ratio": ratio}})
    alone, starts = linkage("size")
    fixed = {"needle.a": 5.0, "needle.b": 30.0, "looper.f": -0.3, "looper.g": 0.2, "looper.alpha": 0.5}
    variables = tuple(f"looper.{name}" for name in alone.variables)
    limit = Limit("looper.swing", 0.8, 0.8)
    problem = Problem(family(machine), variables, LOW, HIGH, fixed, "looper.size", (limit,))
    rows = problem.rows(starts[:, [0, 1, 2, 3]], **{"needle.branch": 1.0, "looper.branch": 1.0})
    best = minimise(problem, rows, OptimiseSettings())[0]
    assert (best.ended, best.status) == ("converged", st.OK)
    assert best.objective == pytest.approx(minimise(alone, starts, OptimiseSettings())[0].objective, rel=1e-9)


def test_ratios_have_no_size() -> None:
    with pytest.raises(InputError, match="size"):
        sweep.summarise("geared_dwell", {"k": [1.2], "a": [1.0]}, ["size"])


def test_smallest_mechanism_for_a_swing_and_a_pressure_angle() -> None:
    problem, starts = linkage("size", Limit("max_pressure_angle", None, 1.0))
    best = minimise(problem, starts, OptimiseSettings())[0]
    assert best.status == st.OK and best.kkt_residual <= 1e-6
    assert best.objective == pytest.approx(size_of(best.design), rel=1e-12)
    # The other way round: in a box of that size the least pressure angle is the limit.
    box = Problem(
        problem.family, problem.variables, LOW, np.minimum(HIGH, best.objective), FIXED, "max_pressure_angle", (TURNS,)
    )
    boxed = minimise(box, np.concatenate([starts, best.design[None, :]]), OptimiseSettings())[0]
    assert boxed.objective == pytest.approx(1.0, abs=1e-7)


def test_lengths_that_share_the_size_are_found_at_their_corner() -> None:
    """Two lengths whose sum is asked for, one of them negative: neither may be the longer one."""

    def poses(designs: Any, angles: Angles, wanted: frozenset[str]) -> dict[str, Any]:
        s = (designs[:, [0]] - designs[:, [1]]) * angles.cos
        return {"s": s, "status": np.zeros(s.shape, np.uint8)}

    two = tuple(Parameter(name, "length", name) for name in "pq")
    made_up = Family("two", "two lengths", two, "s", (Output("s", "length", "(p - q) cos phi"),), poses)
    box = np.array([-5.0, -5.0]), np.array([5.0, 5.0])
    problem = Problem(made_up, ("p", "q"), *box, {}, "size", (Limit("max_s", 4.0, None),))
    best = minimise(problem, problem.rows(np.array([[4.5, 1.0]])), OptimiseSettings())[0]
    np.testing.assert_allclose(best.design, [2.0, -2.0], atol=1e-9)
    assert best.objective == pytest.approx(2.0, abs=1e-9) and best.kkt_residual <= 1e-9


def test_front_of_acceleration_against_size() -> None:
    problem, starts = linkage("max_abs_d2psi")
    free = minimise(problem, starts, OptimiseSettings())[0]
    bounds = tuple(size_of(free.design) * share for share in (1.2, 0.9, 0.8))
    results = pareto(problem, ParetoSettings("size", bounds), starts)
    assert [r.status for r in results] == [st.OK] * 3
    assert results[0].objective == pytest.approx(free.objective, rel=1e-9)
    assert results[0].objective < results[1].objective < results[2].objective
    for bound, result in zip(bounds[1:], results[1:], strict=True):
        assert size_of(result.design) == pytest.approx(bound, rel=1e-9)
        assert "size at its maximum" in result.active
        # The same bound as a box gives the same optimum.
        box = Problem(problem.family, problem.variables, LOW, np.minimum(HIGH, bound), FIXED, "max_abs_d2psi", (TURNS,))
        boxed = minimise(box, np.concatenate([starts, result.design[None, :]]), OptimiseSettings())[0]
        assert result.objective == pytest.approx(boxed.objective, rel=1e-8)


def test_a_fixed_length_can_make_a_bound_infeasible() -> None:
    problem, starts = linkage("max_abs_d2psi", f=-2.5)
    (result,) = pareto(problem, ParetoSettings("size", (2.0,)), starts)
    assert result.status == st.LIMIT_EXCEEDED
    assert result.relaxation["size"] >= 0.5 - 1e-9


def test_at_least_a_size_is_kept_by_the_largest_length() -> None:
    problem, starts = linkage("max_abs_d2psi", Limit("size", 2.9, None))
    best = minimise(problem, starts, OptimiseSettings())[0]
    assert best.status != st.LIMIT_EXCEEDED
    assert size_of(best.design) >= 2.9 - 1e-8
