"""Thousands of hostile tables: an answer, a status or an InputError, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels.status import INVALID_INPUT, NOT_CONVERGED, OK
from sweep.evaluation.statuses import explained
from tests.support.hostile_tables import FAMILIES, case, faults

FEW, MANY = 200, 2500


@pytest.mark.long
def test_many_hostile_tables_have_an_answer_a_status_or_an_error_of_ours() -> None:
    wrong = {seed: found for seed in range(FEW, FEW + MANY) if (found := faults(seed))}
    assert not wrong


@pytest.mark.parametrize(("seed", "requests"), [(609, None), (1845, None), (1561, None), (114, 150)])
def test_outputs_of_a_table_without_a_turning_design_are_missing_with_a_status(seed: int, requests: int | None) -> None:
    """Each of these tables once ended in a KeyError, IndexError or ValueError: no design was left to solve."""
    assert not faults(seed, requests)


def test_the_tables_are_hostile_and_of_every_family() -> None:
    cases = [case(seed) for seed in range(FEW)]
    assert {str(one[0]) for one in cases} == {str(name) for name in FAMILIES}
    assert 10 < sum(one[4] for one in cases) < 60


def test_what_leaves_float64_is_missing_with_a_status() -> None:
    """A length to the fourth power at a scale of 1e90; the angle beside it is as right as ever."""
    table = {"a": 1e90, "b": 4e90, "c": 2e90, "e": 3e90, "f": 0.5e90, "g": 0.2e90, "alpha": 0.3}
    poses = sweep.evaluate("rssr", table, ["psi", "discriminant"], phi=[0.3])
    assert poses["status"][0] == INVALID_INPUT and np.isnan(poses["discriminant"][0]) and np.isfinite(poses["psi"][0])
    turn = sweep.summarise("rssr", table, ["rms_discriminant", "max_abs_dpsi"])
    assert turn["status"][0] == INVALID_INPUT and np.isnan(turn["rms_discriminant"][0])
    assert np.isnan(turn["err_rms_discriminant"][0]) and np.isfinite(turn["max_abs_dpsi"][0])


def test_a_missing_value_has_no_error_and_a_status_of_its_own_goes_first() -> None:
    columns = {
        "x": np.array([1.0, np.inf, np.nan, 2.0]), "err_x": np.full(4, 0.1), "on": np.array([True, False, True, True]),
        "status": np.array([OK, OK, NOT_CONVERGED, NOT_CONVERGED], np.uint8),
    }  # fmt: skip
    found = explained(columns, ["x", "on"])
    assert list(found["status"]) == [OK, INVALID_INPUT, NOT_CONVERGED, NOT_CONVERGED]
    np.testing.assert_array_equal(found["x"], [1.0, np.nan, np.nan, 2.0])
    np.testing.assert_array_equal(found["err_x"], [0.1, np.nan, np.nan, 0.1])
