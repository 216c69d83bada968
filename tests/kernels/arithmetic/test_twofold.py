"""Pairs of float64 against 60 digits: every operation within a few 2^-104 of the exact result."""

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as hs
from mpmath import mp, mpf

from kernels.arithmetic import double_double as two
from kernels.arithmetic.sincos import sincos

ULP = 2.0**-104


@numba.njit
def apply(which, a, b):
    one = 1.0 / b[0]
    if which == 0:
        return two.add(a, b)
    if which == 1:
        return two.subtract(a, b)
    if which == 2:
        return two.multiply(a, b)
    if which == 3:
        return two.scale(a, b[0])
    if which == 4:
        return two.divide(a, b, one)
    return two.root(a)


@numba.njit
def trigonometric(x):
    sine, cosine = two.sine_cosine(x)
    plain = sincos(x)
    return sine, cosine, plain


def exact(x):
    return mpf(x[0]) + mpf(x[1])


@pytest.fixture(autouse=True)
def digits():
    with mp.workdps(60):
        yield


def pairs(seed, n=300):
    r = np.random.default_rng(seed)
    high = r.choice([-1.0, 1.0], n) * 10.0 ** r.uniform(-8, 8, n)
    return [(h, h * t) for h, t in zip(high, r.uniform(-1.0, 1.0, n) * 2.0**-54, strict=True)]


@pytest.mark.parametrize("which", range(6))
def test_operations_keep_twice_the_precision(which):
    operations = (
        lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, lambda a, b: a * b, lambda a, b: a / b,
        lambda a, b: mp.sqrt(a),
    )  # fmt: skip
    for a, b in zip(pairs(1), pairs(2), strict=True):
        if which == 5:
            a = (abs(a[0]), a[1])
        got, x, y = apply(which, a, b), exact(a), exact(b) if which != 3 else mpf(b[0])
        right = operations[which](x, y)
        size = abs(x) + abs(y) if which < 2 else abs(right)
        assert abs(exact(got) - right) <= 16 * ULP * size
        assert got[0] == float(right) or abs(got[0] - right) <= 2.0**-53 * abs(right) * 1.0001
        # the plain operation is not that good
        assert which in (0, 1) or got[1] != 0.0 or right == got[0]


def test_sum_of_opposites_leaves_the_low_parts():
    assert apply(1, (1.0, 2.0**-60), (1.0, 2.0**-80)) == (2.0**-60 - 2.0**-80, 0.0)


@settings(max_examples=300, deadline=None)
@given(hs.floats(-1e5, 1e5))
def test_sine_and_cosine_of_any_angle(x):
    sine, cosine, plain = trigonometric(x)
    with mp.workdps(60):
        for got, right, single in zip((sine, cosine), (mp.sin(mpf(x)), mp.cos(mpf(x))), plain, strict=True):
            # near a multiple of pi/2 the reduction leaves 2^-100 of the angle
            assert abs(exact(got) - right) <= 2.0**-84 * abs(right) + 2.0**-100 * abs(x) + 1e-320
            assert abs(got[0] - single) <= 2.0**-52 * abs(got[0]) + 1e-320


def test_sine_and_cosine_at_the_ends_of_the_reduction():
    for k in range(-8, 9):
        for off in (-1e-9, 0.0, 1e-9):
            x = k * np.pi / 4 + off
            sine, cosine, _ = trigonometric(x)
            assert abs(exact(sine) - mp.sin(mpf(x))) <= 2.0**-84 * abs(mp.sin(mpf(x))) + 2.0**-100
            assert abs(exact(cosine) - mp.cos(mpf(x))) <= 2.0**-84 * abs(mp.cos(mpf(x))) + 2.0**-100


def test_nan_and_infinity_give_nan():
    for x in (np.nan, np.inf, -np.inf):
        sine, cosine, _ = trigonometric(x)
        assert np.isnan(sine[0])
        assert np.isnan(cosine[0])
