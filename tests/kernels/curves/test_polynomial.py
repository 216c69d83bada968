"""Real roots in an interval against roots put in by hand; tolerance 2^-48, a few roundings of a well-parted root."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from kernels.curves.polynomials import roots_up_to


def roots(coefficients, end):
    p = np.asarray(coefficients, dtype=float)
    degree = p.size - 1
    found = np.empty(degree)
    count = roots_up_to(end, p, degree, np.empty((degree, degree + 1)), found)
    return found[:count]


def expanded(places, others=()):
    return np.polynomial.polynomial.polyfromroots([*places, *others]).real


@settings(deadline=None, max_examples=60)
@given(some.sets(some.integers(1, 31), min_size=1, max_size=5), some.lists(some.integers(-9, -1), max_size=2))
def test_all_roots_inside_are_found_in_order_and_no_other(inside, outside):
    places = sorted(inside)
    got = roots(expanded(places, [*outside, 40.0]), 32.0)
    assert got.size == len(places)
    np.testing.assert_allclose(got, places, rtol=1e-6)  # 30 roots-differences to the fifth power amplify 2^-53


def test_roots_many_orders_of_magnitude_apart_keep_their_relative_accuracy():
    places = [3e-18, 5e-9, 2e-4, 0.7]
    np.testing.assert_allclose(roots(expanded(places, [-1e-12, 1j, -1j]), 1.0), places, rtol=2.0**-46)


@pytest.mark.parametrize(("coefficients", "expected"), [
    ([1.0, 0.0, 1.0], []),
    ([-0.25, 1.0, 0.0, 0.0], [0.25]),
    ([1.0, 0.0, 0.0], []),
    ([0.25, -1.0, 1.0], []),  # touches zero at 0.5 without changing sign
    ([-0.125, 0.75, -1.5, 1.0], [0.5]),  # triple root
])  # fmt: skip
def test_special_polynomials(coefficients, expected):
    np.testing.assert_allclose(roots(coefficients, 1.0), expected, atol=1e-5 if len(coefficients) == 4 else 1e-15)
