"""Minimum of a trigonometric polynomial of degree 2: against its quartic's roots, dense samples, degenerate cases."""

import math

import mpmath as mp
import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as hs

from kernels.arithmetic.sincos import sincos
from kernels.curves.polynomials import lowest_of_16, minimum, rotate, shortfall


@numba.njit
def minima(coefficients, out):
    for i in range(len(coefficients)):
        m = minimum(coefficients[i, 0], coefficients[i, 1], coefficients[i, 2], coefficients[i, 3])
        out[i] = m.cos, m.sin, m.value, m.curvature


def least(coefficients):
    out = np.empty((len(coefficients), 4))
    minima(np.asarray(coefficients, dtype=float), out)
    return out


def value(coefficients, t):
    c1, s1, c2, s2 = (np.asarray(coefficients, dtype=float)[:, [k]] for k in range(4))
    return c1 * np.cos(t) + s1 * np.sin(t) + c2 * np.cos(2.0 * t) + s2 * np.sin(2.0 * t)


def from_roots(c1, s1, c2, s2):
    """Least value over the stationary points, the unit roots of the self-inversive quartic, at 40 digits."""
    with mp.workdps(40):
        g1, g2 = mp.mpc(c1, -s1) / 2, mp.mpc(c2, -s2) / 2
        # p'/(2i) z^2 = 2 g2 z^4 + g1 z^3 - conj(g1) z - 2 conj(g2)
        ascending = [-2 * mp.conj(g2), -mp.conj(g1), 0, g1, 2 * g2]
        roots = mp.polyroots(ascending, maxsteps=500, extraprec=400, asc=True)
        angles = [mp.arg(z) for z in roots if abs(abs(z) - 1) < mp.mpf(10) ** -12]
        terms = [c1 * mp.cos(t) + s1 * mp.sin(t) + c2 * mp.cos(2 * t) + s2 * mp.sin(2 * t) for t in angles]
        return float(min(terms))


def test_minimum_is_the_least_stationary_value():
    r = np.random.default_rng(1)
    coefficients = r.normal(size=(150, 4)) * 10.0 ** r.uniform(-2.0, 2.0, (150, 4))
    found = least(coefficients)
    for row, (u, v, low, _) in zip(coefficients, found, strict=True):
        assert low == pytest.approx(from_roots(*row), abs=2e-15 * np.abs(row).sum())
        assert math.hypot(u, v) == pytest.approx(1.0, abs=4e-16)


def test_no_minimum_is_missed_among_half_a_million():
    r = np.random.default_rng(2)
    n = 500_000
    coefficients = r.normal(size=(n, 4))
    # Half of them with two minima of nearly the same height: the second harmonic dominates.
    coefficients[: n // 2, :2] *= 10.0 ** r.uniform(-12.0, 0.0, (n // 2, 1))
    found = least(coefficients)
    size = np.abs(coefficients).sum(axis=1)
    for block in range(0, n, 50_000):
        part = slice(block, block + 50_000)
        sampled = value(coefficients[part], np.arange(64)[None] * (2.0 * np.pi / 64)).min(axis=1)
        assert np.all(found[part, 2] <= sampled + 1e-14 * size[part])
    at = value(coefficients, np.arctan2(found[:, 1], found[:, 0])[:, None])[:, 0]
    np.testing.assert_allclose(found[:, 2], at, atol=3e-15 * size.max())
    assert np.all(found[:, 3] >= -1e-12 * size)


def test_of_two_minima_almost_of_one_height_the_lower_one_is_found():
    """The proof of a global minimum errs by what is left of the way to a stationary point, more than minima differ."""
    r = np.random.default_rng(5)
    n = 20_000
    c2, odd = r.uniform(0.3, 2.0, n), 10.0 ** r.uniform(-15.0, -5.0, n) * r.choice([-1.0, 1.0], n)
    # Two minima where cos t = -c1/(4 c2); towards |c1| = 4 c2 they merge and are flat.
    c1 = 4.0 * c2 * (1.0 - 10.0 ** r.uniform(-6.0, 0.0, n)) * r.choice([-1.0, 1.0], n)
    coefficients = np.column_stack([c1, odd, c2, np.zeros(n)])
    start = np.arccos(-c1 / (4.0 * c2))
    lowest = np.full(n, np.inf)
    for t in (start, -start):
        for _ in range(3):
            slope = odd * np.cos(t) - c1 * np.sin(t) - 2.0 * c2 * np.sin(2.0 * t)
            t = t + slope / (odd * np.sin(t) + c1 * np.cos(t) + 4.0 * c2 * np.cos(2.0 * t))
        lowest = np.minimum(lowest, value(coefficients, t[:, None])[:, 0])
    found = least(coefficients)
    at = value(coefficients, np.arctan2(found[:, 1], found[:, 0])[:, None])[:, 0]
    assert (at <= lowest + 4.0 * 2.0**-53 * np.abs(coefficients).sum(axis=1)).all()


def test_two_minima_of_one_height_and_flat_ones_are_no_trouble():
    cases = {
        (0.0, 0.0, 1.0, 0.0): -1.0,  # two equal minima
        (1.0, 0.0, 0.0, 0.0): -1.0,  # one harmonic only
        (0.0, 0.0, 0.0, 0.0): 0.0,  # constant
        (4.0, 0.0, 1.0, 0.0): -3.0,  # fourth-order flat minimum at pi
        (4.0 + 1e-9, 0.0, 1.0, 0.0): -3.0 - 1e-9,
        (1e-200, 0.0, 0.0, 1.0): -1.0,
        (1e150, 1e150, 0.0, 0.0): -math.sqrt(2.0) * 1e150,
        (3.0, 0.0, 0.0, 1e-18): -3.0,
    }
    for row, expected in cases.items():
        assert least([row])[0, 2] == pytest.approx(expected, rel=1e-14), row


def test_nan_stays_nan():
    assert np.isnan(least([[math.nan, 0.0, 1.0, 0.0]])[0, 2])


def test_proof_rejects_the_higher_of_two_minima():
    # cos 2t with a little cos t: minima near +-pi/2; with sin t one of them is higher.
    c1, s1, c2, s2 = 0.0, 0.3, 1.0, 0.0
    assert shortfall(c1, s1, c2, s2, 0.0, -1.0) <= 0.0
    assert shortfall(c1, s1, c2, s2, 0.0, 1.0) > 0.0


def test_the_lowest_sample_alone_would_miss_minima():
    # Negative control of the proof: the lowest sample leads to the wrong minimum now and then.
    r = np.random.default_rng(3)
    wrong = 0
    for c1, s1, c2, s2 in r.normal(size=(4000, 4)) * [0.02, 0.02, 1.0, 1.0]:
        u, v = lowest_of_16(c1, s1, c2, s2)
        m = minimum(c1, s1, c2, s2)
        wrong += u * m.cos + v * m.sin < 0.0
    assert wrong > 0


@settings(max_examples=200, deadline=None)
@given(hs.floats(-10, 10), hs.floats(-10, 10), hs.floats(-10, 10), hs.floats(-10, 10), hs.floats(-4, 4))
def test_nothing_lies_below_the_minimum(c1, s1, c2, s2, t):
    row = [[c1, s1, c2, s2]]
    assert least(row)[0, 2] <= value(row, np.array([[t]]))[0, 0] + 1e-13


def test_rotation_keeps_angle_and_length():
    for angle in np.linspace(-0.4, 0.4, 41):
        u, v = rotate(*rotate(0.6, 0.8, angle), 0.05)
        exact = math.atan2(0.8, 0.6) + angle + 0.05
        assert abs(math.atan2(v, u) - exact) <= 4e-16 * 4 + 1e-5 * abs(angle) ** 9
        assert math.hypot(u, v) == pytest.approx(1.0, abs=1e-14 + 1e-5 * abs(angle) ** 9)


def test_sine_and_cosine_are_right_to_one_unit_in_the_last_place():
    r = np.random.default_rng(4)
    multiples = np.arange(-400, 401) * (0.25 * math.pi)
    far = np.round(r.uniform(-6e4, 6e4, 300)) * (0.5 * math.pi)
    for x in [*r.uniform(-7.0, 7.0, 1500), *r.uniform(-1e5, 1e5, 500), *multiples, *far, 0.0, 5e-324, 1e-300]:
        with mp.workdps(60):
            exact = mp.sin(mp.mpf(x)), mp.cos(mp.mpf(x))
        for got, want in zip(sincos(float(x)), exact, strict=True):
            assert abs(mp.mpf(got) - want) <= np.spacing(abs(float(want))), x


@pytest.mark.parametrize("x", [math.nan, math.inf, -math.inf])
def test_sine_of_no_number_is_nan(x):
    assert np.isnan(sincos(x)).all()


def test_a_sample_on_top_of_a_maximum_between_two_minima_is_left():
    """Even polynomials with two minima about 0: the lowest of 16 points is the maximum between them."""
    c2 = np.linspace(0.2501, 0.27, 50)
    coefficients = np.column_stack([np.full(50, -1.0), np.zeros(50), c2, np.zeros(50)])
    found = least(coefficients)
    np.testing.assert_allclose(found[:, 0], 0.25 / c2, atol=1e-12)
    np.testing.assert_allclose(found[:, 2], -c2 - 0.125 / c2, rtol=1e-15)
    mirrored = least(coefficients * np.array([-1.0, 1.0, 1.0, 1.0]))
    np.testing.assert_allclose(mirrored[:, 0], -0.25 / c2, atol=1e-12)
