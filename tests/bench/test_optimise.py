"""The bench of random specifications at reduced size: what it draws can be solved, and what is found is optimal."""

from __future__ import annotations

from itertools import islice

import pytest

from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy
from tests.bench.optimise import RSSR, measure, page, solve, specifications


@pytest.mark.long
def test_three_specifications_are_solved_to_a_local_optimum() -> None:
    outcomes = list(measure(3, starts=8, seeds=1))
    for outcome in outcomes:
        assert outcome.ours.violation <= 1e-9 and outcome.ours.kkt_residual <= 1e-6
        assert 0.0 <= outcome.gap <= 1e-4
        # Differential evolution shares neither samples nor starts with the search, and ends at the same value.
        assert outcome.evolved[0].objective == pytest.approx(outcome.ours.objective, rel=1e-4)
        swing, phi0, pressure = outcome.problem.limits
        design, names = outcome.ours.design, ["swing", "phi0", "max_pressure_angle", "max_abs_d2psi"]
        seen = {k: float(x[0]) for k, x in design_outputs(RSSR, design[None, :], names, Accuracy(target=1e-9)).items()}
        assert abs(seen["swing"]) == pytest.approx(swing.maximum, rel=1e-10)
        assert seen["phi0"] == pytest.approx(phi0.maximum, rel=1e-10)
        assert seen["max_pressure_angle"] <= (pressure.maximum or 0.0) * (1.0 + 1e-8)
        assert seen["max_abs_d2psi"] == pytest.approx(outcome.ours.objective, rel=1e-8)
        place = design[[RSSR.parameter_names.index(name) for name in outcome.problem.variables]]
        assert (place >= outcome.problem.lower - 1e-8).all() and (place <= outcome.problem.upper + 1e-8).all()
    assert "3 of 3" in page([outcome.row for outcome in outcomes], 1971)


def test_specifications_are_those_of_their_seed() -> None:
    first, again = (list(islice(specifications(5), 2)) for _ in range(2))
    assert [p.limits for p in first] == [p.limits for p in again] and first[0].limits != first[1].limits
    assert solve(first[0], 1, 2)[0].objective == solve(again[0], 1, 2)[0].objective
