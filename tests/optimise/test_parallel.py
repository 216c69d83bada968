"""Starts in processes: the results of one process, stop and deadline, a killed worker."""

from __future__ import annotations

import math
import os
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweep.optimise.multistart.multistart
from sweep.errors import WorkerDied
from sweep.families import family
from sweep.families.base import Angles
from sweep.optimise import Problem, explore, minimise
from sweep.optimise.local.start import search
from sweep.optimise.multistart.parallel import SearchTask, spread_over
from sweep.optimise.multistart.survey import in_groups
from sweep.study import Limit, OptimiseSettings
from tests.support.optimise_family import FAMILY, poses

ONCE = OptimiseSettings(starts=1)
LOW, HIGH = np.array([0.2, 1, 0.8, 0, -2, -2, 0]), np.array([1.5, 5, 3, 3, 2, 2, 1.5])
STARTS = LOW + np.array([[0.3, 0.5, 0.4, 0.3, 0.6, 0.5, 0.3], [0.4, 0.6, 0.5, 0.5, 0.5, 0.4, 0.6]] * 2) * (HIGH - LOW)


@pytest.fixture
def problem() -> Problem:
    limits = (Limit("swing", 0.8, 0.9), Limit("max_pressure_angle", None, 0.8))
    names = ("a", "b", "c", "e", "f", "g", "alpha")
    return Problem(family("rssr"), names, LOW, HIGH, {"branch": 1.0}, "max_abs_d2psi", limits)


def test_processes_find_the_bits_of_one_process(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    starts = problem.rows(STARTS[:3] + np.array([[0.0], [0.0], [0.05]]))
    alone = minimise(problem, starts, ONCE)
    monkeypatch.setattr(sweep.optimise.multistart.multistart, "SERIAL_EVALUATIONS", 0)
    together = minimise(problem, starts, ONCE, jobs=2)
    assert [r.start for r in together] == [r.start for r in alone]
    for ours, theirs in zip(together, alone, strict=True):
        np.testing.assert_array_equal(ours.design, theirs.design)
        assert (ours.objective, ours.kkt_residual, ours.active) == (
            theirs.objective,
            theirs.kkt_residual,
            theirs.active,
        )


def test_stop_at_once_keeps_an_answer(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep.optimise.multistart.multistart, "SERIAL_EVALUATIONS", 0)
    results = minimise(problem, problem.rows(np.repeat(STARTS, 50, axis=0)), ONCE, stop=lambda: True, jobs=2)
    assert len(results) == 1 and results[0].ended == "time" and np.isfinite(results[0].design).all()


def test_start_that_is_to_stop_at_once_still_has_its_first_design(problem: Problem) -> None:
    start = problem.rows(STARTS[:1])[0]
    result = search(7, problem, start, lambda: True)
    assert result.start == 7 and result.ended == "time"
    np.testing.assert_allclose(result.design, start, rtol=1e-14)


def test_work_left_to_the_processes_may_be_left_at_any_time(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        sweep.optimise.multistart.multistart, "SERIAL_EVALUATIONS", 150
    )  # in the middle of the first or second start
    alone = minimise(problem, problem.rows(STARTS), ONCE)
    assert [r.looks for r in alone if r.looks > 150]
    together = minimise(problem, problem.rows(STARTS), ONCE, jobs=2)
    assert [(r.start, r.objective, r.looks) for r in together] == [(r.start, r.objective, r.looks) for r in alone]


def test_brake_leaves_only_whole_or_marked_starts_and_says_so(problem: Problem) -> None:
    starts = problem.rows(np.repeat(STARTS, 20, axis=0))
    found = explore(problem, in_groups(starts), OptimiseSettings(starts=80, time_budget=1e-9)).survey
    assert found.ended == "time" and found.warnings[0].startswith("time ran out: 0 of 80 starts")


@pytest.mark.parametrize("allowed", [100, 300])
def test_looks_are_a_budget_that_no_clock_changes(problem: Problem, allowed: int) -> None:
    starts = problem.rows(STARTS[:2])
    few = OptimiseSettings(starts=2, looks=allowed)
    alone, together = minimise(problem, starts, few), minimise(problem, starts, few, jobs=2)
    assert all(r.looks <= allowed for r in alone)
    assert [(r.objective, r.ended, r.looks) for r in alone] == [(r.objective, r.ended, r.looks) for r in together]
    whole = minimise(problem, starts, ONCE)
    assert {r.ended for r in alone if r.looks == allowed} <= {"looks"}
    assert min(r.objective for r in whole) <= min(r.objective for r in alone)


def test_deadline_ends_workers_within_a_second(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep.optimise.multistart.multistart, "SERIAL_EVALUATIONS", 0)
    starts = problem.rows(np.repeat(STARTS, 500, axis=0))
    minimise(problem, starts[:4], ONCE, jobs=2)  # the workers are up and have read their kernels
    begin = time.monotonic()
    results = minimise(problem, starts, OptimiseSettings(starts=1, time_budget=1.0), jobs=2)
    assert 0 < len(results) < len(starts)
    assert time.monotonic() - begin < 5.0  # the machine may be busy


def test_killed_worker_is_reported() -> None:
    fatal = replace(FAMILY, poses=partial(_die_outside, os.getpid()))
    problem = Problem(fatal, ("p", "q"), -4 * np.ones(2), 4 * np.ones(2), {}, "max_abs_wave")
    with pytest.raises(WorkerDied, match="optimiser"):
        spread_over(SearchTask(problem, problem.rows(np.ones((2, 2))), math.inf), [0, 1], lambda: False, 2)


def _die_outside(parent: int, designs: Any, angles: Angles, wanted: frozenset[str]) -> dict[str, Any]:
    if os.getpid() != parent:
        os._exit(9)
    return poses(designs, angles, wanted)


def test_no_flag_file_is_left(problem: Problem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    found = spread_over(SearchTask(problem, problem.rows(STARTS), math.inf), [1, 2], lambda: True, 2)
    assert found == [] or all(r.ended == "time" for r in found)
    assert not list(tmp_path.glob("linksweep-*"))
