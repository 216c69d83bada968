"""Climbing to tops of Fourier series, held to scipy's bounded minimisation of the same sums of cosines and sines."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from kernels.curves.periodic import climb

SAMPLES, CURVES = 32, 3
# A minimiser that compares values finds a place to the square root of their rounding, so the value to its rounding.
ROUNDING = 1e-13


def samples(seed: int) -> np.ndarray:
    """Three curves whose coefficients fall by half from order to order; all orders that 32 samples carry."""
    rng = np.random.default_rng(seed)
    orders = np.arange(SAMPLES // 2 + 1)
    series = (
        rng.standard_normal((CURVES, orders.size)) + 1j * rng.standard_normal((CURVES, orders.size))
    ) * 0.5**orders
    return np.fft.irfft(series, SAMPLES, norm="forward")


def curve(values: np.ndarray, mode: int, phi: float) -> float:
    """What is climbed, by the cardinal series of the samples: no Fourier coefficient enters."""
    x = phi - 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
    weights = np.sin(0.5 * SAMPLES * x) / (SAMPLES * np.tan(0.5 * x))
    at = values @ weights
    return float(at @ at if mode == 0 else mode * at[0])


@pytest.mark.parametrize("mode", [-1, 0, 1])
@pytest.mark.parametrize("seed", range(8))
def test_a_top_is_reached_from_the_best_of_64_places(mode: int, seed: int) -> None:
    values = samples(seed)
    spacing = np.pi / SAMPLES
    looks = spacing * (np.arange(2 * SAMPLES) + 0.3)  # beside the samples, where the cardinal series divides by 0
    start = looks[np.argmax([curve(values, mode, x) for x in looks])]
    used = values if mode == 0 else values[:1]
    series = np.fft.rfft(used, norm="forward")[None]
    phi, height, bend, still = np.array([start]), np.empty(1), np.empty(1), np.empty(1, np.bool_)
    climb(series, np.zeros(1, np.int64), mode, spacing, phi, height, bend, still)
    found = minimize_scalar(
        lambda x: -curve(values, mode, x), bounds=(start - spacing, start + spacing), method="bounded",
        options={"xatol": 1e-12},
    )  # fmt: skip
    assert still[0]
    assert abs(height[0] + found.fun) <= ROUNDING * np.square(values).sum()
    assert abs(phi[0] - found.x) <= 1e-6
    by_difference = sum(w * curve(values, mode, phi[0] + x) for w, x in ((1.0, 1e-3), (-2.0, 0.0), (1.0, -1e-3))) / 1e-6
    assert bend[0] == pytest.approx(by_difference, rel=1e-3)  # second order of a step of 1e-3 against a period of 0.4


def test_a_flat_curve_is_never_reached() -> None:
    series = np.zeros((1, 1, 17), np.complex128)
    phi, height, bend, still = np.array([1.0]), np.empty(1), np.empty(1), np.ones(1, np.bool_)
    climb(series, np.zeros(1, np.int64), 1, 0.1, phi, height, bend, still)
    assert not still[0] and height[0] == 0.0
