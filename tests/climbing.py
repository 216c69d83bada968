"""Exact heights and places of extrema next to those found: by poses in twice the working precision alone."""

from __future__ import annotations

import numpy as np

from sweep.families.base import Angles

OFFSETS = np.arange(-4.0, 5.0) / 4.0
HALVINGS = 60


def values(family, designs, pose, phi):
    """A pose output at angles (n, m)."""
    return family.precise().poses(designs, Angles.of(phi), frozenset([pose]))[pose]


def climbed(family, designs, pose, mode, phi, width=1e-3):
    """Highest measured value (n,) within about ``width`` of ``phi`` (n,): the best of nine poses ever closer together.

    It is a value at a pose, so never above the maximum, and no fit is made through values that carry rounding.
    """
    at, best = phi.copy(), np.full(phi.size, -np.inf)
    rows = np.arange(phi.size)
    while width > 1e-11:
        angles = at[:, None] + width * OFFSETS
        found = values(family, designs, pose, angles)
        found = np.abs(found) if mode == 0 else mode * found
        which = found.argmax(axis=1)
        better = found[rows, which] >= best
        best, at = np.where(better, found[rows, which], best), np.where(better, angles[rows, which], at)
        width *= 0.5
    return best if mode >= 0 else -best


def turning_points(family, designs, slope, phi, width=1e-5):
    """Zeros (n,) of a derivative within ``width`` of ``phi`` (n,) by bisection; nan where its sign does not change."""
    low, high = phi - width, phi + width
    at_low, at_high = (np.sign(values(family, designs, slope, x[:, None])[:, 0]) for x in (low, high))
    bracketed = at_low * at_high < 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        left = np.sign(values(family, designs, slope, middle[:, None])[:, 0]) == at_low
        low, high = np.where(left, middle, low), np.where(left, high, middle)
    return np.where(bracketed, 0.5 * (low + high), np.nan)
