"""The solver of the tasks on problems with known answers, and what it says where there is none."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

import sweep
from sweep.errors import InputError
from sweep.synthesis.tasks import (
    EngineeringMethod,
    Position,
    Setting,
    Task1,
    Task2,
    Task3,
    Task4,
    Task5,
    Task6,
    Task7,
    Task8,
    solve,
)
from sweep.synthesis.tasks.problem import Candidates, Unknown
from tests.support.task_cases import TASK3

DRIVE = {"a": 0.4, "b": 1.8, "c": 1.2, "e": 1.5, "f": 1.2, "g": 1.0, "alpha": 1.3, "branch": -1.0}
FRAME = {"phi0": 3.2, "e": 1.0, "g": 1.0, "alpha": 1.3, "f_range": (-3.0, 3.0)}


LOOPER = {"e": 35.0,
          "alpha": 0.5 * np.pi, "swing_range": (np.pi / 6, np.pi / 3), "max_pressure_angle": np.radians(50.0),
          "positions": (Position(*np.radians([40.0, 5.0])), Position(*np.radians([120.0, 31.0]))),
          "phi0_range": tuple(np.radians([160.0, 200.0])),
          "bounds": {"a": (4.0, 20.0), "b": (20.0, 90.0), "c": (10.0, 60.0)}}  # fmt: skip


@dataclass(frozen=True)
class Chebyshev:
    """The cubic x^3 + p x + q that is least in magnitude on [-1, 1]: p = -3/4, q = 0, largest value 1/4."""

    objective: str = "largest value"
    unknowns: tuple[Unknown, ...] = (Unknown("p", -2.0, 2.0), Unknown("q", -1.0, 1.0))

    def evaluate(self, x):
        t = np.cos(np.linspace(0.0, np.pi, 721))[None, :]  # holds -1, -1/2, 1/2, 1
        curve = t**3 + x[:, [0]] * t + x[:, [1]]
        return Candidates({}, {}, curve, {"p": x[:, 0]})


@dataclass(frozen=True)
class OnACircle(Chebyshev):
    """The point of the unit circle, in the half plane y >= 1/2, nearest to (0.1, 0) by the larger coordinate."""

    unknowns: tuple[Unknown, ...] = field(default=(Unknown("x", -2.0, 2.0), Unknown("y", -2.0, 2.0)))
    lowest: float = 0.5

    def evaluate(self, x):
        circle, above = (x**2).sum(axis=1) - 1.0, x[:, 1] - self.lowest
        return Candidates({"circle": circle}, {"half plane": above}, x - [0.1, 0.0], {"x": x[:, 0], "y": x[:, 1]})


def test_minimax_with_kinks_is_found_to_rounding():
    solution = solve(Chebyshev())[0]
    assert solution.feasible
    assert solution.objective == pytest.approx(0.25, abs=1e-9)
    assert solution.unknowns["p"] == pytest.approx(-0.75, abs=1e-8)


def test_equations_and_limits_are_met():
    # On the circle with x - 0.1 = y: 2 y^2 + 0.2 y - 0.99 = 0
    y = (-0.2 + np.sqrt(0.04 + 8.0 * 0.99)) / 4.0
    solution = solve(OnACircle())[0]
    assert solution.feasible
    assert solution.objective == pytest.approx(y, abs=1e-9)
    assert abs(solution.equations["circle"]) < 1e-12


def test_what_cannot_be_met_is_infeasible_with_the_smallest_miss():
    solution = solve(OnACircle(lowest=1.5))[0]
    assert not solution.feasible
    assert solution.limits["half plane"] < -0.1
    assert solve(EngineeringMethod(0.9, 3.3, 1.0, 1.0, 1.3, (-3.0, 3.0), max_pressure_angle=0.3))[0].feasible is False


@pytest.mark.parametrize("second", ["guide", "slider_crank"])
def test_a_sample_that_ends_nowhere_is_not_the_last(second):
    directions = {"start_direction": -0.5, "end_direction": 0.1}
    task = Task6(drive=DRIVE, start=(0.0, 0.0), end=(1.0, 0.2), **directions, second=second)
    found = solve(task, candidates=256, starts=2)  # those of the first sample end at no mechanism
    assert found[0].feasible
    assert len(found) <= 2


def test_an_objective_that_one_sample_met_is_not_the_least():
    least = [solve(TASK3.build(), samples=1, seed=seed)[0].objective for seed in range(8)]
    assert max(least) > 1.005 * min(least)  # a neighbouring basin
    assert solve(TASK3.build())[0].objective == pytest.approx(min(least), rel=1e-6)


def test_same_seed_same_answer():
    one, two = (solve(Task4(0.7, 3.0, 1.0), candidates=256, starts=3, samples=2) for _ in range(2))
    assert [s.unknowns for s in one] == [s.unknowns for s in two]


def test_no_candidate_gives_no_solution():
    class Nowhere(Chebyshev):
        def evaluate(self, x):
            return super().evaluate(np.full_like(x, np.nan))

    assert solve(Nowhere(), candidates=64) == []


def test_solution_reads_as_text():
    text = str(solve(Task4(0.7, 3.0, 1.0), candidates=256, starts=3, samples=2)[0])
    assert text.startswith("feasible, objective ")
    assert "pressure angle" in text


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: Task1(0.9, 3.3, 1.0, 0.0, 0.0, (Position(1, 0.2), Position(2, 0.6))),
            "positions = 2; allowed: 1 to 1",
        ),
        (lambda: Task1(0.9, 3.3, 1.0, 0.0, 1.0, ()), "positions"),
        # Every mechanism of the task stands there: the offset was that of rounding.
        (lambda: Task1(0.9, 3.3, 1.0, 0.0, 1.0, (Position(3.3, 0.9),)), r"other than at the limits, \(0.0, 3.3\)"),
        (
            lambda: Task2((0.5, 1.0), (3.0, 3.5), 1.0, 0.0, 1.0, (Position(1, 0.2), Position(2 * np.pi, 0.6))),
            "other than at the limits",
        ),
        (lambda: Task2((0.5, 1.0), (3.0, 3.5), 1.0, 0.0, 0.0, (Position(1, 0.2), Position(2, 0.6))), "alpha"),
        (lambda: Task3(0.8, 3.2, (Setting(0.8),), "f", (-1, 1), 1.0, 1.0, 1.3, (-1, 1)), "another swing"),
        (lambda: Task3(0.8, 3.2, (Setting(None),), "f", (-1, 1), 1.0, 1.0, 1.3, (-1, 1)), "another swing"),
        (lambda: Task3(0.8, 3.2, ({"swing": 0.7},), "f", (-1, 1), 1.0, 1.0, 1.3, (-1, 1)), r"Setting\(swing, phi0\)"),
        (lambda: Task3(0.8, 3.2, (), "f", (-1, 1), 1.0, 1.0, 1.3, (-1, 1)), "at least one"),
        (
            lambda: Task3(0.8, 3.2, tuple(Setting(x, 3.2) for x in (0.7, 0.6, 0.5)), "f", (-1, 1), 1, 1, 1.3, (-1, 1)),
            "at most 5",
        ),
        (lambda: Task7(DRIVE, 1.0, -0.6, -0.5), "start_acceleration"),
        (lambda: EngineeringMethod(np.nan, **FRAME), "swing = nan"),
        (lambda: EngineeringMethod(7.0, **FRAME), "between 0 and 2 pi, or its negative"),
        (lambda: EngineeringMethod(0.8, **FRAME, max_pressure_angle=45.0), "max_pressure_angle = 45.0; .* 0 and pi/2"),
        (lambda: EngineeringMethod(0.8, **FRAME, objective="speed"), "acceleration or pressure_angle"),
        (lambda: EngineeringMethod(0.8, **FRAME, bounds={"b": (3.0, 1.0)}), "bounds"),
        (lambda: solve(EngineeringMethod(0.8, **FRAME, bounds={"bb": (1.0, 3.0)})), "did you mean 'b'"),
        (lambda: Task2((0.5, -1.0), (3.0, 3.5), 1.0, 0.0, 1.0, (Position(1, 0.2), Position(2, 0.6))), "swing_range"),
        (lambda: Task5(3.5, **FRAME, rho0=0.5), "below pi"),
        (lambda: Task5(0.8, **FRAME, rho0=0.5, ratio_range=(0.5, 2.0)), "one side of 1"),
        (lambda: Task6(DRIVE, (0.0, 0.0), (0.0, 0.0), 0.5, -0.1), "another place"),
        (lambda: Task6(DRIVE, (0.0, 0.0), (1.0, 0.0), 0.5, -0.1, second="cam"), "guide, slider_crank or swivel"),
        (lambda: Task8(0.8, **FRAME, stroke=-1.0, dwell=1.0, tolerance=0.1), "stroke = -1.0"),
        (lambda: Task8(0.8, **FRAME, stroke=1.0, dwell=1.0, tolerance=0.1, limit="middle"), "extended or folded"),
        (lambda: Task7(DRIVE | {"a": 5.0}, 1.0, 0.6, -0.5), "drive"),
    ],
)
def test_ill_posed_tasks_are_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()


def test_equations_are_met_along_a_limit_that_is_only_just_kept():
    """Least squares take up to 120 steps along the kink at which the pressure angle becomes active."""
    solutions = solve(Task2(g=6.0, **LOOPER), samples=1)
    assert solutions and all(one.feasible for one in solutions)


def test_right_angled_axes_that_meet_have_no_crank_rocker_but_those_of_half_a_turn():
    assert solve(Task2(g=0.0, **LOOPER), samples=1) == []
    random = np.random.default_rng(0).uniform([2.0, 20.0, 10.0, -40.0], [20.0, 90.0, 60.0, 40.0], (2000, 4))
    table = dict(zip("abcf", random.T, strict=True)) | {
        name: np.full(2000, LOOPER.get(name, 0.0)) for name in ("e", "g", "alpha")
    }
    found = sweep.summarise("rssr", table, ["phi0"], accuracy=1e-8)
    turns = found["status"] == 0
    assert turns.sum() > 1000
    np.testing.assert_allclose(found["phi0"][turns], np.pi, rtol=0.0, atol=1e-12)
