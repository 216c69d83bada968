"""The bench of random specifications at reduced size: what it draws can be solved, and what is found is optimal."""

from __future__ import annotations

from itertools import islice

import pytest

from tests.bench.optimise import measure, solve, specifications


def test_three_specifications_are_solved_to_a_local_optimum() -> None:
    for outcome in measure(3, larger=1, starts=2, jobs=1):
        assert outcome.ours.violation <= 1e-9 and outcome.ours.kkt_residual <= 1e-6
        assert outcome.gap >= 0.0 and outcome.best.objective <= outcome.ours.objective
        swing, phi0, pressure = outcome.problem.limits
        assert outcome.ours.values["swing"] == pytest.approx(swing.maximum, rel=1e-8)
        assert outcome.ours.values["phi0"] == pytest.approx(phi0.maximum, rel=1e-8)
        assert outcome.ours.values["max_pressure_angle"] <= (pressure.maximum or 0.0) * (1.0 + 1e-8)


def test_specifications_are_those_of_their_seed() -> None:
    first, again = (list(islice(specifications(5), 2)) for _ in range(2))
    assert [p.limits for p in first] == [p.limits for p in again] and first[0].limits != first[1].limits
    assert solve(first[0], 1, 2).objective == solve(again[0], 1, 2).objective
