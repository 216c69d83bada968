"""The straightest coupler point as a linear programme: scipy's solver, the plain formulation, one design at a time."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog


def straightest(pin, pin2, lam):
    """Smallest possible largest |Im((B + l d) e^{-i lam}) - h| over xi, eta, h; complex arrays B, C of one design."""
    d = (pin2 - pin) / abs(pin2 - pin) * np.exp(-1j * lam)
    target = (pin * np.exp(-1j * lam)).imag
    rows = np.column_stack([d.imag, d.real, -np.ones(d.size)])
    above, below = np.c_[rows, -np.ones(d.size)], np.c_[-rows, -np.ones(d.size)]
    bounds = [(None, None)] * 3 + [(0, None)]
    solution = linprog([0, 0, 0, 1], A_ub=np.vstack([above, below]), b_ub=np.r_[-target, target], bounds=bounds)
    return solution.fun


def fourbar(a, b, c, e, branch, angles):
    """Pins B, C of a planar four-bar as the intersection of two circles; nan where they do not meet."""
    crank = a * np.exp(1j * angles)
    to_ground = e - crank
    distance = abs(to_ground)
    along = (distance**2 + b**2 - c**2) / (2 * distance)
    with np.errstate(invalid="ignore"):
        across = np.sqrt(b**2 - along**2)
    return crank, crank + to_ground / distance * (along - branch * 1j * across)
