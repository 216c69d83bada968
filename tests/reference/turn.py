"""Extrema over one turn the slow way, 100 000 samples and Brent's method; imports nothing of the project."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

SAMPLES = 100_000


def largest(curve: Callable[[Any], Any]) -> tuple[float, float]:
    """Largest value of a periodic curve and its angle; ``curve`` takes an array of angles."""
    phi = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES)
    y = curve(phi)
    k, step = int(np.argmax(y)), 2.0 * np.pi / SAMPLES
    found = minimize_scalar(
        lambda x: -float(curve(np.array([x]))[0]),
        bounds=(phi[k] - step, phi[k] + step),
        method="bounded",
        options={"xatol": 1e-12},
    )
    if -found.fun >= y[k]:
        return -float(found.fun), float(found.x) % (2.0 * np.pi)
    return float(y[k]), float(phi[k])


def least(curve: Callable[[Any], Any]) -> tuple[float, float]:
    """Smallest value of a periodic curve and its angle."""
    value, phi = largest(lambda x: -curve(x))
    return -value, phi
