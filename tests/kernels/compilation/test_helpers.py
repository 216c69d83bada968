"""Helpers of kernels: one machine code for all numbers they are called with."""

from __future__ import annotations

from kernels.jit import inline, kernel


@inline
def scaled(x: float, by: int, rounds: int) -> float:
    for _ in range(rounds):
        x *= by
    return x


@kernel
def several(x: float, n: int) -> float:
    rounds = 0
    while rounds < n:
        x, rounds = scaled(x, 3, rounds), rounds + 1
    return scaled(x, n, 1) + scaled(x, 2, 2)


def test_a_helper_is_compiled_once_whatever_numbers_are_written_in_its_calls() -> None:
    assert several(1.0, 2) == several.py_func(1.0, 2) == 18.0
    assert len(scaled.for_kernels.signatures) == 1
