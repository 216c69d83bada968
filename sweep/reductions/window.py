"""Window of a follower's position: the parts of a turn in which it lies between two limits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kernels.curves import samples as scan
from kernels.types import EPS, TWO_PI
from sweep.families.base import Array, Family
from sweep.numerics.events import beyond, zeros
from sweep.numerics.records import Indices, Mask, joined, only
from sweep.quantities.kinds import Request
from sweep.reductions.refine import Peaks
from sweep.reductions.resolution import denser
from sweep.reductions.sampling import blocks, pose_columns, sample_turn

BESIDE = 1e-5  # [rad] step of the difference quotient of a value over the position


class Window(NamedTuple):
    """Limits of the positions whose poses count, each (n,), their error, and the name of the position's output."""

    low: Array
    high: Array
    err: Array
    position: str

    @classmethod
    def of_stroke(cls, position: str, least: Array, most: Array, err: Array, part: tuple[float, float]) -> Window:
        """Window between fractions ``part`` of the stroke, measured from the smallest position."""
        # A fraction 0 or 1 is open: rounding of the extreme position must not cut off the pose that reaches it.
        low = least + part[0] * (most - least) if part[0] > 0.0 else np.full(least.size, -np.inf)
        high = least + part[1] * (most - least) if part[1] < 1.0 else np.full(least.size, np.inf)
        return cls(low, high, err, position)

    def only(self, rows: Indices | Mask) -> Window:
        """Select designs by index or mask."""
        return Window(self.low[rows], self.high[rows], self.err[rows], self.position)

    def holds(self, rows: Indices, positions: Array) -> Mask:
        """Whether the positions (k, m) of the designs ``rows`` (k,) lie in the window."""
        return (positions >= self.low[rows, None]) & (positions <= self.high[rows, None])

    def nears(self, rows: Indices, positions: Array) -> Mask:
        """Whether the motion is in the window at samples (k, m) of a turn, or between a sample and its neighbour."""
        after = np.roll(positions, -1, axis=1)
        low, high = np.minimum(positions, after), np.maximum(positions, after)
        passed = (high >= self.low[rows, None]) & (low <= self.high[rows, None])
        return passed | np.roll(passed, 1, axis=1)

    def grazed(self, rows: Indices, positions: Array) -> Mask:
        """Whether the motion may pass a limit of the window twice between two samples.

        It does where no sample is near the window, as every window of the stroke is passed.
        """
        doubtful: Mask = np.logical_not(np.any(self.nears(rows, positions), axis=1))
        for level in (self.low[rows], self.high[rows]):
            scan.grazes(positions, level, doubtful)
        return doubtful


class Edges(NamedTuple):
    """Poses at which a window begins or ends, each (k,): row of the block, angle, values there and their errors.

    ``side`` is 0 at the lower limit of the window, 1 at the upper one.
    """

    row: Indices
    phi: Array
    values: Array
    err: Array
    side: Indices


def edges(family: Family, designs: Array, rows: Indices, window: Window, columns: dict[str, Array], pose: str) -> Edges:
    """Find where the follower enters or leaves the window, and a pose output there.

    Parameters
    ----------
    family, designs : the whole (n, P) design matrix
    rows : (r,) designs of the block
    columns : (r, m) position and the pose output over one turn
    pose : name of the pose output that is wanted at the edges

    Notes
    -----
    The error is the residual of the position plus the error of the window's limits, multiplied by the slope.
    """
    positions, samples = columns[window.position], columns[pose].shape[1]
    spacing, wraps = TWO_PI / samples, family.pose_output[window.position].wraps
    row, column, side = _brackets(rows, window, positions)
    level = np.where(side == 0, window.low[rows[row]], window.high[rows[row]])
    size = np.abs(positions).max(axis=1)[row]

    def at(which: Indices, phi: Array, of: Family = family) -> tuple[Array, Array]:
        poses, _ = pose_columns(of, designs[rows[row[which]]], phi, (window.position, pose))
        return poses[pose], beyond(poses[window.position], level[which, None], wraps)

    every = np.arange(row.size)
    phi = zeros(lambda which, place: at(which, place[:, None])[1][:, 0], column * spacing, (column + 1) * spacing)
    near, off = at(every, phi[:, None] + BESIDE * np.array([-1.0, 0.0, 1.0]))
    slope = np.abs((near[:, 2] - near[:, 0]) / (off[:, 2] - off[:, 0]))
    values, (exact, f) = near[:, 1], (x[:, 0] for x in at(every, phi[:, None], family.precise()))
    err = (
        slope * (np.abs(f) + window.err[rows[row]] + 4.0 * EPS * size)
        + np.abs(values - exact)
        + 4.0 * EPS * np.abs(exact)
    )
    return Edges(row, phi, exact, err, side)


def _brackets(rows: Indices, window: Window, positions: Array) -> tuple[Indices, Indices, Indices]:
    """Find row, sample before it and side of each crossing."""
    row, column = np.empty(positions.size, np.int64), np.empty(positions.size, np.int64)
    found = []
    for side, level in enumerate((window.low[rows], window.high[rows])):
        count = scan.crossings(positions, level, row, column)
        found.append((row[:count].copy(), column[:count].copy(), np.full(count, side)))
    first, second, sides = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return first, second, sides


def peaks_within(
    family: Family, designs: Array, rows: Indices, window: Window, columns: dict[str, Array], request: Request,
    row: Indices, peaks: Peaks, resolved: Mask,
) -> tuple[Indices, Peaks]:  # fmt: skip
    """Drop the peaks of a block outside the window, and add its edges as candidates.

    Parameters
    ----------
    family, designs, rows, window, columns : as of `edges`
    request : the extremum of a pose output
    row, peaks : (k,) designs of the peaks in the block, and the peaks
    resolved : (r,) designs whose edges count
    """
    poses, _ = pose_columns(family, designs[rows[row]], peaks.phi[:, None], list(columns))
    inside = window.holds(rows[row], poses[window.position])[:, 0]
    edge = edges(family, designs, rows, window, columns, request.pose)
    edge = only(edge, resolved[edge.row])
    height = np.abs(edge.values) if request.mode == 0 else request.mode * edge.values
    none = np.zeros(edge.row.size)
    added = Peaks(edge.phi, height, none + 8.0 * EPS, edge.err, height, none, none)
    return np.concatenate([row[inside], edge.row]), joined(only(peaks, inside), added)


SAMPLES, MOST = 512, 16384  # first number of samples, and the largest one where a level may be passed twice between two


def window_angle(family: Family, designs: Array, window: Window) -> tuple[Array, Array]:
    """Compute the crank angle over which the position lies in the window, and its error, each (n,) [rad].

    Parameters
    ----------
    family, designs : the (n, P) design matrix of any family whose crank turns fully
    window : limits of every design; nan gives nan

    Notes
    -----
    The angle above a level is the sum of the angles where the follower passes it downwards, less those where it passes
    it upwards, plus a turn if it starts above.  Between two levels it is the angle above the lower one less that above
    the upper one.  Every crossing is refined to rounding.  Samples are doubled where a parabola through three of them
    allows two crossings between; two spacings of the last samples are then part of the error.
    """
    angle, err = np.full(len(designs), np.nan), np.full(len(designs), np.nan)
    names = (window.position, family.derivative_of[window.position])
    samples, pending = SAMPLES * denser(family, designs, names), np.isfinite(window.err)
    while pending.any():
        count = int(samples[pending].min())
        for rows in blocks(np.flatnonzero(pending & (samples == count)), count):
            columns, _, _ = sample_turn(family, designs[rows], count, names)
            touching = window.grazed(rows, columns[window.position])
            found = edges(family, designs, rows, window, columns, names[1])
            levels = np.stack([window.low[rows], window.high[rows]])
            above = TWO_PI * (columns[window.position][:, 0] >= levels)
            own = np.where(touching, 2.0 * TWO_PI / count, 0.0)
            np.subtract.at(above, (found.side, found.row), np.sign(found.values) * found.phi)
            size = window.err[rows[found.row]] + 8.0 * EPS * np.abs(levels[found.side, found.row])
            np.add.at(own, found.row, size / np.abs(found.values) + 4.0 * EPS * TWO_PI)
            # In the window all the turn, or never: rounding passes the levels any number of times.
            still = np.ptp(columns[window.position], axis=1) <= window.err[rows]
            angle[rows], err[rows] = np.where(still, TWO_PI, [above[0] - above[1], own])
            samples[rows], pending[rows] = 2 * count, touching & (count < MOST)
    return angle, err
