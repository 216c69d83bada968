"""Partial derivatives of the deviation of a guided point, by the complex step."""

from __future__ import annotations

import numpy as np

from sweep.families import family
from sweep.families.base import Angles

STEP = 1e-100


def dev_sensitivities(design, phi):
    """Return the derivatives of dev by phi, a, b, c, e, xi, eta, lam, h, and the status of each."""
    designs, angles = np.tile(np.array([design], complex), (9, 1)), np.full((9, 1), phi, complex)
    angles[0] += 1j * STEP
    for k in range(8):
        designs[1 + k, k] += 1j * STEP
    found = family("guide").poses(designs, Angles.of(angles), frozenset({"dev"}))
    return found["dev"].imag[:, 0] / STEP, found["status"]
