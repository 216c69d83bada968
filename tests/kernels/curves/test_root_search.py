"""Zeros of functions of one number that kernels pass to the searches, to the last bit."""

from __future__ import annotations

import math

import pytest

from kernels.curves.root_search import bisected, false_position
from kernels.jit import inline, kernel


@inline
def cube(x: float, level: float) -> float:
    return x * x * x - level


@inline
def is_low(x: float, level: float) -> bool:
    return cube(x, level) < 0.0


@kernel
def root(low: float, high: float, level: float) -> float:
    return false_position(cube, low, high, cube(low, level), cube(high, level), level)


@kernel
def bracket(low: float, high: float, level: float) -> tuple[float, float]:
    return bisected(is_low, low, high, level)


@pytest.mark.parametrize("level", [2.0, 1e-9, 5e3])
def test_root_of_a_cube_from_both_sides(level: float) -> None:
    exact = math.cbrt(level)
    for low, high in ((0.0, 20.0), (20.0, 0.0)):
        assert root(low, high, level) == pytest.approx(exact, rel=4.0 * 2.0**-53)
    low, high = bracket(0.0, 20.0, level)
    assert high == math.nextafter(low, math.inf)
    assert low == pytest.approx(exact, rel=4.0 * 2.0**-53)


def test_a_value_that_is_zero_ends_the_search() -> None:
    assert root(-1.0, 3.0, 1.0) == 1.0
