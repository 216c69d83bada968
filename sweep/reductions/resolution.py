"""Resolution of a turn: least number of samples that a curve needs, and edges of its panels.

Families describe their curves by capabilities (`sweep.families.curve_features`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.curves import samples as scan
from kernels.curves.periodic import climb
from kernels.types import EPS, TWO_PI, Status
from sweep.families import curve_features as features
from sweep.families.base import Angles, Array, Family
from sweep.families.curve_features import Bends, SingularCurve
from sweep.numerics.events import near_zeros, sign_changes, with_events
from sweep.numerics.records import Indices, Mask, joined, only, put
from sweep.numerics.singularities import (
    FAR,
    SAMPLES,
    SHORTEST,
    Singularities,
    crowded,
    dips,
    side_by_side,
    singularities,
)
from sweep.quantities.kinds import Request
from sweep.reductions.sampling import DESIGN_STATUS, Extremum, blocks, pose_columns, sample_turn

PER_WAVE = 2.0  # waves per turn that the least number of samples resolves
SHARES = 16.0  # the least number of samples is enough for switches at a distance of a turn over this
PER_SINGULARITY = 12.0  # samples per distance of the nearest complex singularity
FEWEST = 32.0  # least number of samples of any curve
MOST = 1024.0  # largest factor of the least number of samples
# Distance of a singularity [rad] below which it is refined: twice the distance below which it determines the samples.
MATTERS = 2.0 * PER_SINGULARITY / FEWEST


def denser(family: Family, designs: Array, outputs: Collection[str], near: Singularities | None = None) -> Array:
    """Return the power of two by which the least number of samples over a turn is multiplied, (n,).

    ``near`` are the nearest singularities if they are known.

    The samples resolve the distance between two switches, the waves of a curve, and with 12 samples the distance of a
    singularity that even samples would not see.
    """
    factor = np.maximum(features.waves(family, designs, outputs) / PER_WAVE, 1.0)
    angles = np.sort(features.switches(family, designs, outputs), axis=1)
    if angles.shape[1] > 1:
        gaps = np.concatenate([np.diff(angles, axis=1), angles[:, :1] + TWO_PI - angles[:, -1:]], axis=1)
        # Coinciding switches count as one.
        shortest = np.where(gaps > 1e-9, gaps, TWO_PI).min(axis=1)
        factor = np.maximum(factor, TWO_PI / (SHARES * shortest))
    if features.about(family, features.Singular, outputs):
        near = nearest(family, designs, outputs, MATTERS) if near is None else near
        rho = near.rho.min(axis=1)
        factor = np.where(rho < FAR, np.maximum(factor, PER_SINGULARITY / (FEWEST * rho)), factor)
    return np.exp2(np.ceil(np.log2(np.minimum(factor, MOST))))


def nearest(family: Family, designs: Array, outputs: Collection[str], within: float = FAR) -> Singularities:
    """Find the nearest singularities of pose outputs of a family's designs, from its most accurate poses.

    Singularities farther away than ``within`` [rad] are not refined beyond even samples.  Those of the last designs are
    kept: outputs have most of their curves in common.
    """
    curves = features.singular_curves(family.precise(), outputs)
    if not curves or not len(designs):
        return singularities((), len(designs))
    known: dict[object, tuple[Array, Singularities]] = family.derived.setdefault(nearest, {})

    def of_curve(number: int, curve: SingularCurve, some: Array) -> Singularities:
        kept = known.get((curve, number, within))
        if kept is None or not np.array_equal(kept[0], some):
            found = dips(lambda rows, phi: curve(some[rows], Angles.of(phi)), len(some), number, within)
            kept = known[curve, number, within] = some, found
        return kept[1]

    every = [designs[some] for some in blocks(np.arange(len(designs)), SAMPLES, len(curves))]
    parts = [side_by_side([of_curve(*one, some) for one in enumerate(curves)]) for some in every]
    return joined(*parts)


def broken(family: Family, designs: Array, near: Singularities, status: Status) -> None:
    """Set the status of designs that have no pose next to a singularity, within the resolution of angles.

    The gap may be narrower than any spacing of samples.
    """
    close = np.flatnonzero((near.rho <= SHORTEST).any(axis=1))
    for rows in blocks(close, near.phi.shape[1]):
        _, each = pose_columns(family, designs[rows], near.phi[rows], [family.pose_names[0]])
        each = np.where(near.rho[rows] <= SHORTEST, each, st.OK)
        gap = (each != st.OK).any(axis=1)
        status[rows[gap]] = DESIGN_STATUS[each[gap, (each[gap] != st.OK).argmax(axis=1)]]


CLOSE = 0.1  # distance of a singularity [rad] below which panels crowd about it
BENDING = 128  # even samples on which roots of effects' functions are bracketed
LOOK = 0.25  # spacing of further samples relative to the distance of a singularity
PER_PANEL = 0.25  # waves per first panel, at most


def ends(family: Family, designs: Array, even: int, looks: int, output: str) -> Array:
    """Compute the panel edges of a turn for curves of a pose output, in rising order, (n, p + 1).

    There are ``even`` panels, and more about singularities.  They are cut at angles known beforehand, and where one of
    ``looks`` samples or the next shows that a pose output passes its level, that a follower reverses, or that a
    function at whose zeros curves of the output have kinks passes zero.
    """
    n = len(designs)
    edges = np.tile(np.linspace(0.0, TWO_PI, even + 1), (n, 1))
    known = features.switches(family, designs, (output,))
    edges = with_events(edges, np.repeat(np.arange(n), known.shape[1]), known.ravel())
    fast = np.ceil(features.waves(family, designs, (output,)) / PER_PANEL).astype(np.int64)  # even panels for waves
    more = np.repeat(np.arange(n), np.where(fast > even, fast, 0))
    place = np.arange(more.size) - np.searchsorted(more, more)
    edges = with_events(edges, more, TWO_PI * place / fast[more])
    near = nearest(family, designs, (output,))
    close = np.flatnonzero(near.rho.min(axis=1, initial=FAR) < CLOSE)
    about = crowded(only(near, close), 1.0)
    edges = with_events(edges, np.repeat(close, about.shape[1]), about.ravel())
    angles = crowded(only(near, close), LOOK)
    edges = with_events(edges, *_passed(family, designs, (output,), _looked(n, looks, close, angles)))
    for bent in features.about(family, Bends, (output,)):
        edges = with_events(edges, *_bent(bent, designs, _looked(n, BENDING, close, angles), known))
    return edges


def events(family: Family, designs: Array, looks: int, outputs: Collection[str]) -> tuple[Indices, Array]:
    """Find designs (k,) and angles (k,) where a pose output passes its level, a follower reverses, or a curve bends.

    The roots are searched between ``looks`` even samples of the turn, as far as ``outputs`` depend on them.
    """
    looked = np.tile(np.arange(looks) * (TWO_PI / looks), (len(designs), 1))
    found = [_passed(family, designs, outputs, looked)]
    # Near the minimum of a squared function a curve is steep, but has no kink.
    about = (bent for output in outputs for bent in features.about(family, Bends, (output,)))
    known = dict.fromkeys(bent for bent in about if not bent.squares)
    found += [_bent(bent, designs, looked) for bent in known]
    rows, phi = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return rows, phi


def zeros(family: Family, designs: Array, output: str) -> tuple[Indices, Array]:
    """Find designs (k,) and angles (k,) where a non-negative pose output is known to vanish, or jumps."""
    looked = _looked(len(designs), BENDING, np.zeros(0, np.intp), np.zeros((0, 0)))
    found = [_bent(bent, designs, looked) for bent in features.about(family, Bends, (output,)) if bent.zero]
    return found[0] if found else (np.zeros(0, np.intp), np.zeros(0))


def _bent(bent: Bends, designs: Array, looked: Array, known: Array | None = None) -> tuple[Indices, Array]:
    """Find where functions pass zero at which curves bend, between angles ``looked``, without jumps at ``known``."""

    def bending(rows: Indices, phi: Array) -> Array:
        return np.nan_to_num(bent.curves(designs[rows], Angles.of(phi)))

    return near_zeros(bending, looked, CLOSE) if bent.squares else sign_changes(bending, looked, known)


def _passed(family: Family, designs: Array, outputs: Collection[str], looked: Array) -> tuple[Indices, Array]:
    """Find designs and angles where an output passes its level or a speed passes zero, bracketed by ``looked``."""
    passed_levels = features.about(family, features.Crossing, outputs)
    # Reversals affect friction and loads, which belong to effects; a family knows its own kinks.
    speeds = () if family.dear.keys().isdisjoint(outputs) else reversing(family)
    if not speeds and not passed_levels:
        return np.zeros(0, np.intp), np.zeros(0)
    names = list(dict.fromkeys([*speeds, *(crossing.passing for crossing in passed_levels)]))

    def functions(rows: Indices, phi: Array) -> Array:
        columns, _ = pose_columns(family, designs[rows], phi, names)
        passed = [columns[crossing.passing] - crossing.level(designs[rows])[:, None] for crossing in passed_levels]
        return np.nan_to_num(np.stack([*(columns[name] for name in speeds), *passed], axis=2))

    return sign_changes(functions, looked)


def _looked(n: int, even: int, close: Indices, angles: Array) -> Array:
    """Even angles of a turn, (n, m), with further angles of the designs ``close``."""
    looked = np.tile(np.arange(even) * (TWO_PI / even), (n, 1))
    return with_events(looked, np.repeat(close, angles.shape[1]), angles.ravel())


def reversing(family: Family) -> tuple[str, ...]:
    """Pose outputs whose zeros cut the turn: the velocities of all positions of the family."""
    speeds = set(family.derivative_of.values())
    dear = set(family.dear)
    return tuple(rate for of, rate in family.derivative_of.items() if of not in speeds and rate not in dear)


FIRST, LAST = 48, 384  # first and largest number of samples of a series: other curves are searched between poses
FIRST_OF_MEAN = 32  # first number for a mean, whose error is quadratic in the truncated coefficients
FINER = 2  # ratio of the points on which maxima of a series are bracketed to its samples
RIVALS = 0.2  # share of a curve's range by which a maximum may exceed the points beside it
DOUBT = 3.0  # factor on the truncation error that the decay of the coefficients predicts


class Turns(NamedTuple):
    """Designs whose samples resolve a curve: indices (r,), values (r, q, N), coefficients, error and size, (r,)."""

    rows: Indices
    values: Array
    series: NDArray[np.complex128]
    err: Array
    size: Array


@dataclass(frozen=True)
class FourierCurve:
    """Fourier series of the samples of a smooth curve of expensive poses.

    Coefficients of a smooth periodic curve decay geometrically.  Their decay predicts the sum of those beyond the
    samples, which is the error, with a safety factor.
    """

    family: Family
    request: Request
    parts: tuple[str, ...]  # components of the vector whose length is the curve

    def extremum(self, designs: Array, target: float) -> tuple[Extremum, Status, Mask]:
        """Compute the requested extremum of every design, its status, and where a slower search is needed."""
        found, status = Extremum.unknown(len(designs)), np.zeros(len(designs), np.uint8)
        undecided: Mask = np.ones(len(designs), np.bool_)
        for turns in self._resolved(designs, target, status, False):
            value, phi, err_phi, good = self._top(turns)
            put(found, turns.rows, (value, phi, turns.err, err_phi))
            undecided[turns.rows] = ~good
        return found, status, undecided & (status == st.OK)

    def mean(self, designs: Array, target: float) -> tuple[Array, Array, Status, Mask]:
        """Compute root mean squares over the turn, their errors, status and undecided designs, as in `extremum`."""
        mean, err = np.full((2, len(designs)), np.nan)
        status = np.zeros(len(designs), np.uint8)
        for turns in self._resolved(designs, target, status, True):
            mean[turns.rows], err[turns.rows] = _root_mean_square(turns.values), turns.err
        return mean, err, status, np.isnan(mean) & (status == st.OK)

    def _resolved(self, designs: Array, target: float, status: Status, mean: bool) -> Iterator[Turns]:
        """Yield designs as soon as their samples resolve the curve; write the status."""
        fewest = (FIRST_OF_MEAN if mean else FIRST) * denser(self.family, designs, self.parts)
        for first in np.unique(fewest):
            yield from self._doubled(np.flatnonzero(fewest == first), int(first), designs, target, status, mean)

    def _doubled(
        self, rows: Indices, samples: int, designs: Array, target: float, status: Status, mean: bool
    ) -> Iterator[Turns]:
        """Yield resolved designs, beginning with ``samples`` samples and doubling them for the others."""
        known = np.empty((rows.size, len(self.parts), 0))
        while rows.size and samples <= LAST:
            left, between = [], known.shape[2] > 0
            for at in blocks(np.arange(rows.size), samples, 2 * len(self.parts)):
                part = rows[at]
                columns, worst, _ = sample_turn(self.family, designs[part], samples, self.parts, between)
                status[part] = DESIGN_STATUS[worst]
                values = np.stack([columns[name] for name in self.parts], axis=1)
                if between:
                    values = np.stack([known[at], values], axis=3).reshape(part.size, -1, samples)
                series = np.fft.rfft(values, norm="forward")
                size = np.sqrt(_lengths(values).max(axis=1))
                err = (_beyond_mean if mean else _beyond)(np.sqrt(_lengths(series.real) + _lengths(series.imag)))
                err += 16.0 * EPS * size
                allowed = target * (_root_mean_square(values) if mean else size)
                done = (err <= allowed) & (status[part] == st.OK)
                yield Turns(part[done], values[done], series[done], err[done], size[done])
                again = ~done & (status[part] == st.OK)
                left.append((part[again], values[again]))
            (rows, known), samples = (np.concatenate(both) for both in zip(*left, strict=True)), 2 * samples

    def _top(self, turns: Turns) -> tuple[Array, Array, Array, Mask]:
        """Find the maximum of each series: value, place, its error, and whether the search has converged."""
        mode, (count, parts, orders) = self.request.mode, turns.series.shape
        size = FINER * 2 * (orders - 1)
        fine = np.fft.irfft(turns.series, size, norm="forward")
        square = parts > 1 or mode == 0
        heights = _lengths(fine) if square else mode * fine[:, 0]
        (scale, rough), (rows, columns) = np.empty((2, count)), np.empty((2, count * (size // 2 + 1)), np.int64)
        listed = scan.peaks(heights, 1, 1.0 - RIVALS, None, scale, rough, rows, columns)
        row, column = rows[:listed], columns[:listed]
        before, here, after = (heights[row, (column + k) % size] for k in (-1, 0, 1))
        spacing, bent = TWO_PI / size, before - 2.0 * here + after
        apart = np.divide(0.5 * (before - after), bent, out=np.zeros_like(bent), where=bent < 0.0)
        phi = spacing * (column + apart)
        height, bend = np.empty((2, listed))
        still = np.empty(listed, np.bool_)
        climb(turns.series, row, 0 if square else mode, spacing, phi, height, bend, still)
        best = np.full(count, -1)
        scan.best_candidate(row, height, np.full(count, -np.inf), best)
        good: Mask = (best >= 0) & (np.bincount(row[~still], minlength=count) == 0)
        value = np.sqrt(np.maximum(height[best], 0.0)) if square else mode * height[best]
        # error of the curve, or of its square, at its flat maximum
        off = 2.0 * (turns.size if square else 1.0) * turns.err
        err_phi = np.sqrt(2.0 * off / np.maximum(-bend[best], 1e-300))
        return value, np.mod(phi[best], TWO_PI), err_phi, good


def _lengths(vectors: Array) -> Array:
    """Squared lengths (n, m) of vectors (n, q, m)."""
    found: Array = np.einsum("nqm,nqm->nm", vectors, vectors)
    return found


def _root_mean_square(values: Array) -> Array:
    found: Array = np.sqrt(np.square(values).sum(axis=1).sum(axis=1) / values.shape[2])
    return found


BANDS = (12, 16)  # number of samples over the width of the bands of orders that measure the decay of coefficients


def _beyond(coefficients: Array) -> Array:
    """Bound the sum of the orders beyond the samples, (n,), from the coefficients (n, K + 1).

    Three bands of the highest orders measure the decay, as the slower of their two steps.  Where rounding or a kink
    stops the decay, the orders beyond count as if they were as large as the last ones, as many as there are samples.
    """
    half, found = coefficients.shape[1] - 1, np.zeros(len(coefficients))
    for share in BANDS:
        wide = 2 * half // share
        first, second, last = (coefficients[:, half - k * wide : half - (k - 1) * wide].max(axis=1) for k in (3, 2, 1))
        steps = [np.divide(b, a, out=np.zeros_like(b), where=a > 0.0) for a, b in ((first, second), (second, last))]
        fall = np.minimum(np.maximum(*steps), 1.0)
        per_order = np.minimum(fall ** (1.0 / wide), 1.0 - 0.5 / half)
        found = np.maximum(found, DOUBT * 2.0 * last * np.minimum(fall / (1.0 - per_order), 2.0 * half))
    return found


def _beyond_mean(coefficients: Array) -> Array:
    """Bound the error of a root mean square, (n,): products of two orders with sum N alias to the mean.

    If coefficients decay evenly, all these products are as large as that of the two middle orders.
    """
    half = coefficients.shape[1] - 1
    last = coefficients[:, half - half // 8 : half].max(axis=1)
    square, whole = DOUBT * 2.0 * half * last * last, np.sqrt(np.square(coefficients).sum(axis=1))
    found: Array = 0.5 * np.divide(square, whole, out=np.sqrt(square), where=whole > 0.0)
    return found


def series_of(family: Family, request: Request) -> FourierCurve | None:
    """Fourier series of a request; None unless the curve is known to be smooth and expensive."""
    known = next((smooth for smooth in family.every(features.Smooth) if smooth.of == request.pose), None)
    if known is None or request.place or request.windowed or features.about(family, features.Switches, known.parts):
        return None
    return FourierCurve(family, request, known.parts) if len(known.parts) == 1 or request.mode >= 0 else None
