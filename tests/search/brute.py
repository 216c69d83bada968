"""Extrema by brute force: the highest of 20 000 poses, climbed by ever narrower rows of poses.

Everything it returns is a value at a pose, so no maximum is lower; whether one is higher it cannot prove.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kernels import status as st
from sweep.families.base import Angles, Array, Family

DENSE = 20_000
TOPS = 4  # local maxima of the dense grid that are climbed
ROW = 17
EPS = 2.0**-53
TWO_PI = 2.0 * np.pi
PHI = TWO_PI * (np.arange(DENSE) + 0.37) / DENSE


class Best(NamedTuple):
    """Highest measured pose of each design, its place [rad], and what rounding the inputs moves it by; each (n,)."""

    value: Array
    phi: Array
    blur: Array


def poses(full: Family, designs: Array, phi: Array, names: tuple[str, ...]) -> tuple[dict[str, Array], Array]:
    """Return pose outputs (n, m) and the status."""
    with np.errstate(all="ignore"):
        columns = full.poses(designs, Angles.of(np.ascontiguousarray(phi)), frozenset(names))
    return {name: np.asarray(columns[name], np.float64) for name in names}, np.asarray(columns["status"])


def dense(full: Family, designs: Array, names: tuple[str, ...]) -> tuple[dict[str, Array], Array]:
    """Return pose outputs over the turn, angles made continuous, and whether all poses exist (n,)."""
    columns, status = poses(full, designs, np.tile(PHI, (len(designs), 1)), names)
    for name in names:
        if full.pose_output[name].wraps:
            columns[name] = np.unwrap(columns[name], axis=1)
    return columns, (status == st.OK).all(axis=1)


def climbed(full: Family, designs: Array, name: str, mode: int, values: Array) -> Best:
    """Return the highest pose near the highest local maxima of the dense ``values`` (n, DENSE)."""
    measured = np.abs(values) if mode == 0 else mode * values
    n = len(designs)
    local = (measured >= np.roll(measured, 1, axis=1)) & (measured >= np.roll(measured, -1, axis=1))
    ranked = np.where(local, measured, -np.inf)
    columns = np.argsort(-ranked, axis=1, kind="stable")[:, :TOPS]
    row = np.repeat(np.arange(n), TOPS)
    column = columns.ravel()
    phi, best, middle = PHI[column], measured[row, column], values[row, column]
    every, width = np.arange(row.size), TWO_PI / DENSE
    wraps = full.pose_output[name].wraps
    while width > 1e-13:
        at = phi[:, None] + width * np.linspace(-1.0, 1.0, ROW)
        found, status = poses(full, designs[row], at, (name,))
        y = found[name]
        if wraps:
            y = y + TWO_PI * np.rint((middle[:, None] - y) / TWO_PI)
        y = np.where(status == st.OK, np.abs(y) if mode == 0 else mode * y, -np.inf)
        top = y.argmax(axis=1)
        better = y[every, top] > best
        best, phi = np.where(better, y[every, top], best), np.where(better, at[every, top], phi)
        width *= 0.25
    highest = best.reshape(n, TOPS).argmax(axis=1) + TOPS * np.arange(n)
    value, phi = best[highest], phi[highest]
    return Best(value, phi, blurred(full, designs, name, phi))


def blurred(full: Family, designs: Array, name: str, phi: Array) -> Array:
    """Return by how much a value changes when each input is rounded otherwise: the largest of eight tries."""
    random = np.random.default_rng(1)
    one, _ = poses(full, designs, phi[:, None], (name,))
    exact, off = one[name][:, 0], np.zeros(len(designs))
    free = np.array([p.choices is None and p.unit != "count" for p in full.parameters])  # no sign, no number of teeth
    for _ in range(8):
        changed = designs * (1.0 + 2.0 * EPS * free * random.choice([-1.0, 0.0, 1.0], designs.shape))
        now, status = poses(
            full, changed, (phi * (1.0 + 2.0 * EPS * random.uniform(-1.0, 1.0, phi.size)))[:, None], (name,)
        )
        moved = now[name][:, 0] - exact
        if full.pose_output[name].wraps:
            moved -= TWO_PI * np.rint(moved / TWO_PI)
        off = np.fmax(off, np.where(status[:, 0] == st.OK, np.abs(moved), 0.0))
    return off
