"""Reductions over samples against numpy, and the machine code against the same function in plain Python."""

from __future__ import annotations

import numpy as np
import pytest

from kernels import status as st
from kernels.curves import samples as scan


@pytest.fixture
def values():
    r = np.random.default_rng(3)
    phi = np.arange(64) * (2.0 * np.pi / 64)
    waves = r.normal(size=(20, 5, 1)) * np.cos(np.arange(5)[:, None] * phi + r.uniform(0.0, 6.0, (20, 5, 1)))
    return waves.sum(axis=1)


def measured(values, mode):
    return np.abs(values) if mode == 0 else mode * values


@pytest.mark.parametrize("mode", [0, 1, -1])
def test_best_sample_is_that_of_numpy(values, mode):
    best, column = np.empty(20), np.empty(20, np.int64)
    scan.best_sample(values, mode, None, best, column)
    np.testing.assert_array_equal(best, measured(values, mode).max(axis=1))
    np.testing.assert_array_equal(column, measured(values, mode).argmax(axis=1))
    allowed = values > 0.1
    allowed[0] = False
    scan.best_sample(values, mode, allowed, best, column)
    masked = np.where(allowed, measured(values, mode), -np.inf)
    np.testing.assert_array_equal(column[1:], masked.argmax(axis=1)[1:])
    assert column[0] == -1
    assert np.isnan(best[0])


@pytest.mark.parametrize("function", [scan.peaks, scan.peaks.py_func], ids=["compiled", "plain"])
@pytest.mark.parametrize("mode", [0, 1, -1])
def test_peaks_are_all_local_maxima_above_the_share(values, mode, function):
    n, m = values.shape
    scale, rough = np.empty(n), np.empty(n)
    row, column = np.empty(n * (m // 2 + 1), np.int64), np.empty(n * (m // 2 + 1), np.int64)
    count = function(values, mode, 0.6, None, scale, rough, row, column)
    z = measured(values, mode)
    best, least = z.max(axis=1), z.min(axis=1)
    size = best if mode == 0 else best - least
    np.testing.assert_array_equal(scale, size)
    local = (z > np.roll(z, 1, axis=1)) & (z >= np.roll(z, -1, axis=1)) & (z >= (best - 0.4 * size)[:, None])
    local[np.arange(n), z.argmax(axis=1)] = True
    assert set(zip(row[:count], column[:count], strict=True)) == set(zip(*np.nonzero(local), strict=True))
    fourth = sum(c * np.roll(values, k, axis=1) for k, c in zip(range(-2, 3), (1, -4, 6, -4, 1), strict=True))
    np.testing.assert_allclose(rough, np.abs(fourth).max(axis=1) / size, rtol=1e-12)


@pytest.mark.parametrize("function", [scan.unwrap, scan.unwrap.py_func], ids=["compiled", "plain"])
def test_unwrap_is_numpy_unwrap_and_counts_turns(function):
    phi = np.arange(100) * (2.0 * np.pi / 100)
    angles = np.stack([k * phi + 0.5 * np.sin(phi) + 1.0 for k in (-2, 0, 1, 3)])
    wrapped = np.angle(np.exp(1j * angles))
    winding = np.empty(4, np.int64)
    expected = np.unwrap(wrapped, axis=1)
    function(wrapped, winding)
    np.testing.assert_allclose(wrapped, expected, atol=1e-12)
    assert winding.tolist() == [-2, 0, 1, 3]


@pytest.mark.parametrize("function", [scan.quartic_peak, scan.quartic_peak.py_func], ids=["compiled", "plain"])
def test_quartic_peak_is_exact_for_quartics(function):
    t = np.arange(-2.0, 3.0)
    peak_at, c3, c4 = np.array([0.3, -0.7, 1.2]), np.array([0.05, -0.02, 0.01]), np.array([-0.01, 0.004, -0.02])
    x = t - peak_at[:, None]
    z = 5.0 - x**2 + c3[:, None] * x**3 + c4[:, None] * x**4
    place, height, ripple, blur = (np.empty(3) for _ in range(4))
    function(z, place, height, ripple, blur)
    np.testing.assert_allclose(place, peak_at, atol=1e-12)
    np.testing.assert_allclose(height, 5.0, rtol=1e-14)
    np.testing.assert_allclose(ripple, 24.0 * np.abs(c4), rtol=1e-9)
    function(np.array([[5.0, 4.0, 3.0, 2.0, 1.0]]), place, height, ripple, blur)
    assert (place[0], height[0], blur[0]) == (-2.0, 5.0, 2.0) or place[0] == -2.0


@pytest.mark.parametrize(
    "function", [scan.nearest_singularity, scan.nearest_singularity.py_func], ids=["compiled", "plain"]
)
def test_nearest_singularity_is_that_of_a_shifted_cosine(function):
    phi = np.arange(256) * (2.0 * np.pi / 256)
    rho = np.array([0.3, 0.1, 0.03])
    curve = np.cosh(rho)[:, None] - np.cos(phi + 0.01)
    distance = np.empty(3)
    function(curve, distance)
    np.testing.assert_allclose(distance, rho, rtol=0.01)
    function(np.cos(0.1) - np.cos(phi)[None, :], distance[:1])
    assert distance[0] == 0.0


@pytest.mark.parametrize("function", [scan.crossings, scan.crossings.py_func], ids=["compiled", "plain"])
def test_crossings_are_the_sign_changes(values, function):
    level = np.linspace(-1.0, 1.0, 20)
    row, column = np.empty(values.size, np.int64), np.empty(values.size, np.int64)
    count = function(values, level, row, column)
    above = values >= level[:, None]
    assert set(zip(row[:count], column[:count], strict=True)) == set(
        zip(*np.nonzero(above != np.roll(above, -1, axis=1)), strict=True)
    )


@pytest.mark.parametrize("function", [scan.grazes, scan.grazes.py_func], ids=["compiled", "plain"])
def test_grazes_sees_a_crest_between_samples(function):
    phi = np.arange(32) * (2.0 * np.pi / 32)
    curve = np.cos(phi - np.pi / 32)[None, :]  # the crest is between two samples
    top = curve.max()
    for level, expected in ((0.5 * (1.0 + top), True), (1.01, False), (0.9, False)):
        doubtful = np.zeros(1, np.bool_)
        function(curve, np.array([level]), doubtful)
        assert doubtful[0] == expected


@pytest.mark.parametrize("function", [scan.grazes, scan.grazes.py_func], ids=["compiled", "plain"])
def test_grazes_tells_a_touch_at_a_sample_from_two_passages_beside_it(function):
    """The skew of a touch raised the parabola above the level; beside a sample on it no passage was looked for."""
    phi = np.arange(256) * (2.0 * np.pi / 256)
    x = phi - phi[100]
    for sign in (1.0, -1.0):
        touch = sign * (np.cos(x) - 1.0) * (1.0 + 0.5 * np.sin(x))
        # The second passage is a tenth of the spacing after the sample: a slope of 1/20 of the bend.
        twice = sign * (np.cos(x - np.pi / 2560.0) - np.cos(np.pi / 2560.0))
        twice[100] = 0.0
        for curve, expected in ((touch, False), (twice, True)):
            doubtful = np.zeros(1, np.bool_)
            function(curve[None, :], np.zeros(1), doubtful)
            assert doubtful[0] == expected


@pytest.mark.parametrize("function", [scan.worst_status, scan.worst_status.py_func], ids=["compiled", "plain"])
def test_worst_status_prefers_the_first_cause(function):
    rows = [
        [st.OK, st.OK, st.OK],
        [st.DEAD_POINT, st.OK, st.NOT_ASSEMBLED],
        [st.SINGULAR, st.DEAD_POINT, st.OK],
        [st.NOT_ASSEMBLED, st.INVALID_INPUT, st.OK],
    ]
    worst = np.empty(4, np.uint8)
    function(np.array(rows, np.uint8), worst)
    assert worst.tolist() == [st.OK, st.NOT_ASSEMBLED, st.SINGULAR, st.INVALID_INPUT]


def test_best_candidate_ignores_nan():
    best, which = np.full(2, -np.inf), np.full(2, -1)
    scan.best_candidate(np.array([0, 1, 0, 1]), np.array([1.0, np.nan, 3.0, 2.0]), best, which)
    assert best.tolist() == [3.0, 2.0]
    assert which.tolist() == [2, 3]
