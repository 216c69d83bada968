"""Tops that even samples hide: one of two that stand closer than samples, and what begins where a curve switches.

Samples that resolve a curve to a tenth of its size may show two tops as one.  Then the quartic through them is off at
the top by more than a top of that width explains, and a closer look tells.  Beside an angle at which a curve switches,
as a phase of a cam begins, a force may fall to nothing and rise again within a hundredth of a sample: places that crowd
about it show a top at any distance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from kernels.types import TWO_PI
from sweep.families.base import Array
from sweep.quantities.kinds import Request
from sweep.reductions.refine import Candidates, Peaks, Sampler
from sweep.reductions.sampling import Index, Mask, joined, only

# Error of the first guess against the fall to the next samples, from which on a top is looked at closely: 0.04 and 0.1
# where two tops showed as one; few tops of smooth curves have more.
NARROW = 0.02
RUNGS = np.exp2(np.arange(-12.0, 1.0))
CROWDED = np.concatenate([-RUNGS[::-1], RUNGS])  # places about a switch, in samples
CLOSER = np.linspace(-2.25, 2.25, CROWDED.size)  # places about a top


class Sampled(NamedTuple):
    """Samples of a turn: numbers of the designs (n,), pose outputs (n, m) by name, and how many samples there are."""

    rows: Index
    columns: dict[str, Array]
    samples: int

    def around(self, requests: Sequence[Request], candidates: Candidates, near: Index) -> Array:
        """Return the samples about candidates, (k, q); ``near`` (q,) says which, counted from the one of each."""
        number, row, column, _ = candidates
        found = np.empty((row.size, near.size))
        for k, request in enumerate(requests):
            mine = number == k
            found[mine] = self.columns[request.pose][row[mine, None], (column[mine, None] + near) % self.samples]
        return found


def doubtful(candidates: Candidates, peaks: Peaks, around: Array, tolerance: Array) -> Index:
    """Return the refined peaks beside which samples may hide a higher one.

    Parameters
    ----------
    candidates, peaks, tolerance : k peaks, and the error allowed in each height
    around : (k, 7) measured samples about each
    """
    off = np.abs(peaks.guess - peaks.height)
    # A magnitude that nearly vanishes has no lower value beside.
    off = np.where((candidates.sign < 0.0) & (around <= 0.0).all(axis=1), np.minimum(off, np.abs(peaks.height)), off)
    fall = around[:, 3] - 0.5 * (around[:, 2] + around[:, 4])
    curve = _curve(candidates, 1 + candidates.request.max(initial=0))
    best = np.full(curve.max(initial=0) + 1, -np.inf)
    np.maximum.at(best, curve, peaks.height)
    found: Index = np.flatnonzero((off > np.maximum(tolerance, NARROW * fall)) & (peaks.height + off >= best[curve]))
    return found


def dips(requests: Sequence[Request], columns: Mapping[str, Array], resolved: Mask) -> Candidates:
    """Return the curves that may fall to nothing beside a switch: magnitudes whose least value is wanted.

    Parameters
    ----------
    requests, columns : (r,) and the samples of the pose outputs, (n, m) each
    resolved : (r, n) which requests are answered by these samples
    """
    wanted = resolved.copy()
    for k, request in enumerate(requests):
        wanted[k] &= request.mode == -1 and columns[request.pose].min(axis=1) >= 0.0
    number, row = np.nonzero(wanted)
    return Candidates(number, row, np.zeros(row.size, np.int64), np.full(row.size, -1.0))


def closer_looks(tops: Candidates, beside: Candidates, angles: Array, samples: int) -> tuple[Candidates, Array]:
    """Return what is to be looked at closely, about tops and about switches: candidates and their rising angles (q, m).

    Parameters
    ----------
    tops : beside which a higher one may be hidden
    beside : curves to be looked at beside switches
    angles : (n, k) at which the curves of each design switch [rad]
    samples : of the turn
    """
    at, spacing = angles[beside.row], TWO_PI / samples
    every = only(beside, np.repeat(np.arange(len(at)), at.shape[1]))._replace(column=_column(at.ravel(), samples))
    phi = np.concatenate([tops.column[:, None] + CLOSER, at.reshape(-1, 1) / spacing + CROWDED])
    return joined(tops, every), spacing * phi


def tops_of(sample: Sampler, looks: Candidates, phi: Array, samples: int, guess: Array) -> tuple[Candidates, Peaks]:
    """Return the places of closer looks that are higher than both of their neighbours, as peaks to be refined.

    ``guess`` are the heights that samples showed where the first looks are.
    """
    values = sample(np.arange(len(phi)), phi)
    look, column = np.nonzero((values[:, 1:-1] > values[:, :-2]) & (values[:, 1:-1] >= values[:, 2:]))
    at, height = phi[look, column + 1], values[look, column + 1]
    gap = np.maximum(at - phi[look, column], phi[look, column + 2] - at)
    shown = np.where(look < guess.size, np.append(guess, 0.0)[np.minimum(look, guess.size)], height)
    found = only(looks, look)._replace(column=_column(at, samples))
    return found, Peaks(at, height, gap, np.full(look.size, np.inf), shown, gap, 0.5 * gap)


def apart(known: tuple[Candidates, Peaks], found: tuple[Candidates, Peaks]) -> Index:
    """Return which of the peaks found are none of those known of the same curve: these are farther away than the gap.

    One top listed twice, with different errors, would make a tie of which rounding chooses the place.
    """
    requests = 1 + max(which.request.max(initial=0) for which, _ in (known, found))
    low, high = (2.0 * TWO_PI * _curve(which, requests) + np.mod(peaks.phi, TWO_PI) for which, peaks in (known, found))
    low = np.concatenate([[-np.inf], np.sort(low), [np.inf]])
    above = np.searchsorted(low, high)
    new: Index = np.flatnonzero(np.minimum(high - low[above - 1], low[above] - high) > found[1].spacing)
    return new


def _curve(candidates: Candidates, requests: int) -> Index:
    """Return the number of the curve that each candidate belongs to."""
    numbers: Index = candidates.row * requests + candidates.request
    return numbers


def _column(phi: Array, samples: int) -> Index:
    """Return the nearest samples."""
    nearest: Index = np.rint(phi * (samples / TWO_PI)).astype(np.int64) % samples
    return nearest
