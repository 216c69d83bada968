"""Zeros of functions of one number that kernels pass to the searches, to the last bit."""

from __future__ import annotations

import math

import pytest

from kernels.curves.root_search import bisected, false_position, least_value, newton_root
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


@inline
def cube_and_slope(x: float, level: float) -> tuple[float, float]:
    return cube(x, level), 3.0 * x * x


@inline
def kinked(x: float, level: float) -> float:
    return abs(x - level) + 0.25 * (x - level)


@kernel
def newton(low: float, high: float, start: float, finest: float, level: float) -> float:
    return newton_root(cube_and_slope, low, high, cube(low, level), start, finest, level)


@kernel
def dip(low: float, high: float, level: float) -> tuple[float, float]:
    return least_value(kinked, low, high, level)


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


@pytest.mark.parametrize("level", [2.0, 1e-9, 1e-60, -5e3])
def test_newton_s_steps_stay_in_the_bracket(level: float) -> None:
    """From 0, where the slope vanishes, the first step is infinite; a last step of 2^-51 leaves far less than that."""
    exact = math.cbrt(level)
    for low, high in ((-20.0, 21.0), (21.0, -20.0), (0.0, math.copysign(20.0, level))):
        for start in (low, high, 0.0):
            assert newton(low, high, start, 0.0, level) == pytest.approx(exact, rel=4.0 * 2.0**-53)


def test_a_place_next_to_0_is_found_to_what_is_asked() -> None:
    """Newton's steps to the cube's triple zero shrink by a third each: a last one of 2^-60 leaves twice as much."""
    assert math.isnan(newton(-1.0, 3.0, 1.0, 0.0, 0.0))
    assert abs(newton(-1.0, 3.0, 1.0, 2.0**-60, 0.0)) <= 2.01 * 2.0**-60


def test_golden_sections_find_a_kink() -> None:
    """45 sections leave 4e-10 of the interval; beside the kink the value rises by at most 1.25 times that."""
    for low, high in ((-1.0, 2.0), (2.0, -1.0)):
        place, value = dip(low, high, 0.3)
        assert place == pytest.approx(0.3, abs=3.0 * 4e-10)
        assert 0.0 <= value <= 1.25 * 3.0 * 4e-10
