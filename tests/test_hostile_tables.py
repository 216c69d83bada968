"""Thousands of hostile tables: an answer, a status or an InputError, and nothing else."""

from __future__ import annotations

import pytest

from tests.hostile_tables import FAMILIES, case, faults

FEW, MANY = 200, 2500


def test_hostile_tables_have_an_answer_a_status_or_an_error_of_ours() -> None:
    wrong = {seed: found for seed in range(FEW) if (found := faults(seed))}
    assert not wrong


@pytest.mark.long
def test_many_hostile_tables_have_an_answer_a_status_or_an_error_of_ours() -> None:
    wrong = {seed: found for seed in range(FEW, FEW + MANY) if (found := faults(seed))}
    assert not wrong


def test_the_tables_are_hostile_and_of_every_family() -> None:
    cases = [case(seed) for seed in range(FEW)]
    assert {str(one[0]) for one in cases} == {str(name) for name in FAMILIES}
    assert 10 < sum(one[4] for one in cases) < 60
