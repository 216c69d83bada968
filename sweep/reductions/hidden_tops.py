"""Maxima that even samples hide: a second one closer than a sample, or one next to an angle where a curve switches.

Samples that resolve a curve to a tenth of its size may show two maxima as one.  Then the error of the quartic at the
maximum exceeds that of a single maximum of this width, or the samples beside it do not fall as those of a single one
do, and a closer look decides.  Beside an angle at which a curve switches, as at the beginning of a cam's phase, a force
may fall to zero and rise again within a hundredth of a sample:
places that crowd about the angle show a maximum at any distance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from kernels.types import TWO_PI
from sweep.families.base import Array
from sweep.numerics.records import Indices, Mask, joined, only
from sweep.quantities.kinds import Request
from sweep.reductions.refine import PeakCandidates, Peaks, Sampler

# Error of the first guess relative to the fall to the next samples above which a maximum is looked at closely: it was
# 0.04 and 0.1 where two maxima appeared as one; few maxima of smooth curves exceed it.
NARROW = 0.02
RUNGS = np.exp2(np.arange(-12.0, 1.0))
CROWDED = np.concatenate([-RUNGS[::-1], RUNGS])  # places about a switch, in sample spacings
CLOSER = np.linspace(-2.25, 2.25, CROWDED.size)  # places about a maximum, in sample spacings


class Sampled(NamedTuple):
    """Samples of a turn: indices of the designs (n,), pose outputs (n, m) by name, and number of samples."""

    rows: Indices
    columns: dict[str, Array]
    samples: int

    def around(self, requests: Sequence[Request], candidates: PeakCandidates, near: Indices) -> Array:
        """Return the samples around candidates, (k, q), at offsets ``near`` (q,) from each candidate's own sample."""
        number, row, column, _ = candidates
        found = np.empty((row.size, near.size))
        for k, request in enumerate(requests):
            mine = number == k
            found[mine] = self.columns[request.pose][row[mine, None], (column[mine, None] + near) % self.samples]
        return found


def doubtful(candidates: PeakCandidates, peaks: Peaks, around: Array, tolerance: Array) -> Indices:
    """Select the refined peaks beside which samples may hide a higher one.

    Parameters
    ----------
    candidates, peaks, tolerance : k peaks, and the allowed error of each height
    around : (k, 7) samples around each, times the candidate's sign
    """
    off = np.abs(peaks.guess - peaks.height)
    # A minimum of a magnitude cannot be below zero, so it cannot be missed by more than its own height.
    off = np.where((candidates.sign < 0.0) & (around <= 0.0).all(axis=1), np.minimum(off, np.abs(peaks.height)), off)
    fall = around[:, 3] - 0.5 * (around[:, 2] + around[:, 4])
    curve = _curve(candidates, 1 + candidates.request.max(initial=0))
    best = np.full(curve.max(initial=0) + 1, -np.inf)
    np.maximum.at(best, curve, peaks.height)
    found = (off > np.maximum(tolerance, NARROW * fall)) & (peaks.height + off >= best[curve])
    # A parabola falls to the sample after the next by twice its mean fall to the next, or more: a shoulder is no such.
    shoulder = (around[:, 3] - np.maximum(around[:, 1], around[:, 5]) < fall) & (fall > tolerance)
    return np.flatnonzero(found | (shoulder & (peaks.height + fall >= best[curve])))


def dips(requests: Sequence[Request], columns: Mapping[str, Array], resolved: Mask) -> PeakCandidates:
    """List the curves that may fall to zero beside a switch: magnitudes whose smallest value is wanted.

    Parameters
    ----------
    requests, columns : (r,) and the samples of the pose outputs, (n, m) each
    resolved : (r, n) requests that these samples resolve
    """
    wanted = resolved.copy()
    for k, request in enumerate(requests):
        wanted[k] &= request.mode == -1 and columns[request.pose].min(axis=1) >= 0.0
    number, row = np.nonzero(wanted)
    return PeakCandidates(number, row, np.zeros(row.size, np.int64), np.full(row.size, -1.0))


def closer_looks(
    tops: PeakCandidates, beside: PeakCandidates, angles: Array, samples: int
) -> tuple[PeakCandidates, Array]:
    """List candidates for a closer look, at maxima and at switches, with their rising angles (q, m).

    Parameters
    ----------
    tops : candidates beside which a higher maximum may be hidden
    beside : curves to be looked at beside switches
    angles : (n, k) at which the curves of each design switch [rad]
    samples : number of samples of the turn
    """
    at, spacing = angles[beside.row], TWO_PI / samples
    every = only(beside, np.repeat(np.arange(len(at)), at.shape[1]))._replace(column=_column(at.ravel(), samples))
    phi = np.concatenate([tops.column[:, None] + CLOSER, at.reshape(-1, 1) / spacing + CROWDED])
    return joined(tops, every), spacing * phi


def tops_of(
    sample: Sampler, looks: PeakCandidates, phi: Array, samples: int, guess: Array
) -> tuple[PeakCandidates, Peaks]:
    """Find the places of closer looks that are higher than both neighbours, as peaks to be refined.

    ``guess`` are the heights by the even samples of the first looks.
    """
    values = sample(np.arange(len(phi)), phi)
    look, column = np.nonzero((values[:, 1:-1] > values[:, :-2]) & (values[:, 1:-1] >= values[:, 2:]))
    at, height = phi[look, column + 1], values[look, column + 1]
    gap = np.maximum(at - phi[look, column], phi[look, column + 2] - at)
    shown = np.where(look < guess.size, np.append(guess, 0.0)[np.minimum(look, guess.size)], height)
    found = only(looks, look)._replace(column=_column(at, samples))
    return found, Peaks(at, height, gap, np.full(look.size, np.inf), shown, gap, 0.5 * gap)


def apart(known: tuple[PeakCandidates, Peaks], found: tuple[PeakCandidates, Peaks]) -> Indices:
    """Select the found peaks that differ from all known ones of the same curve: they are farther away than the gap.

    One maximum listed twice, with different errors, would make a tie whose place is chosen by rounding.
    """
    requests = 1 + max(which.request.max(initial=0) for which, _ in (known, found))
    low, high = (2.0 * TWO_PI * _curve(which, requests) + np.mod(peaks.phi, TWO_PI) for which, peaks in (known, found))
    low = np.concatenate([[-np.inf], np.sort(low), [np.inf]])
    above = np.searchsorted(low, high)
    return np.flatnonzero(np.minimum(high - low[above - 1], low[above] - high) > found[1].spacing)


def _curve(candidates: PeakCandidates, requests: int) -> Indices:
    """Index of each candidate's curve."""
    return candidates.row * requests + candidates.request


def _column(phi: Array, samples: int) -> Indices:
    """Index of the nearest sample."""
    return np.rint(phi * (samples / TWO_PI)).astype(np.int64) % samples
