"""Every status has a number and a meaning of its own: two of them share no number in stored data."""

from __future__ import annotations

from kernels import status


def test_numbers_are_distinct_and_all_explained():
    numbers = {name: value for name, value in vars(status).items() if name.isupper() and isinstance(value, int)}
    assert len(set(numbers.values())) == len(numbers)
    assert set(status.MEANING) == set(numbers.values())
    assert max(numbers.values()) < 256
