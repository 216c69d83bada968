"""The epigraph program of one design: rows ``c = constant + matrix @ atoms + slack * t``, to be >= 0 or = 0.

Atoms are the quantities with known gradients: the curves at K points, the points' crank angles, and plain numbers.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np

from sweep.families.base import Array
from sweep.numerics.records import Mask
from sweep.optimise.extrema.points import Points
from sweep.optimise.extrema.scanned import CROSSING, STATIONARY
from sweep.quantities.measures import Measure

NEAR_BOUND = 0.6  # scaled distance from its bound beyond which a row is left out at first
FAR = 1e3  # value of a row that cannot be computed at a trial design: far outside, but finite


@dataclass(frozen=True)
class Label:
    """Meaning of a row: an output and its side, "objective", "minimum", "maximum" or "equal".

    ``bound_ratio``, bound over the row's scale, makes the row's multiplier one per relative change of the bound.
    """

    name: str
    side: str
    bound_ratio: float = 1.0


@dataclass(frozen=True)
class Form:
    """Rows of the program and the points whose curves they use.

    ``complete`` says that the design turns and every limit exists for it, ``has_margins`` that every stage has a
    margin, which measures its distance from turning; a stage behind one that does not turn has none.
    """

    points: Points
    scalars: tuple[str, ...]
    matrix: Array
    constant: Array
    slack: Array
    equal: Mask
    labels: tuple[Label, ...]
    complete: bool
    has_margins: bool

    def rows(self, atoms: Array, t: float) -> Array:
        """Return the rows' values; a row that is nan counts as far outside."""
        if np.isfinite(atoms).all():
            return np.asarray(self.constant + self.matrix @ atoms + self.slack * t)
        base = self.matrix @ np.nan_to_num(atoms, nan=1e30)
        return np.nan_to_num(self.constant + base + self.slack * t, nan=-FAR)

    def objective(self, atoms: Array) -> float:
        """Return the largest of the objective's rows: the smallest t they allow."""
        mask = np.array([label.side == "objective" for label in self.labels], dtype=np.bool_)
        if not mask.any():
            return math.inf
        return float(-(self.constant + self.matrix @ atoms)[mask].min())

    def violation(self, atoms: Array) -> float:
        """Return the largest scaled violation of the limits; infinite if a limit does not exist for the design."""
        if not self.complete:
            return math.inf
        return self.defined_violation(atoms)

    def defined_violation(self, atoms: Array) -> float:
        """Return the largest scaled violation of the limits that exist for this design.

        It is infinite if some stage has no margin.
        """
        if not self.has_margins:
            return math.inf
        values = self.constant + self.matrix @ atoms
        limits = np.array([label.side != "objective" for label in self.labels], dtype=np.bool_)
        if np.isnan(values[limits]).any():
            return math.inf
        return float(np.maximum(np.where(self.equal, np.abs(values), -values)[limits], 0.0).max(initial=0.0))

    def near(self, atoms: Array, t: float) -> Form:
        """Return the form without the rows far from their bounds, which no short step reaches."""
        close = (self.rows(atoms, t) < NEAR_BOUND) | self.equal
        labels = tuple(label for label, chosen in zip(self.labels, close, strict=True) if chosen)
        return replace(
            self, matrix=self.matrix[close], constant=self.constant[close], slack=self.slack[close],
            equal=self.equal[close], labels=labels,
        )  # fmt: skip

    def relaxed(self, hard: set[str]) -> Form:
        """Return the elastic program: t is the smallest relaxation of all limits but the ``hard`` ones."""
        limits = np.array([label.side != "objective" for label in self.labels], dtype=np.bool_)
        relaxation = np.array([label.name not in hard for label in self.labels], dtype=np.float64)[limits]
        equations = self.equal[limits]
        matrix, constant = self.matrix[limits], self.constant[limits]
        labels = tuple(label for label, chosen in zip(self.labels, limits, strict=True) if chosen)
        return replace(
            self,
            matrix=np.concatenate([matrix, -matrix[equations]]),
            constant=np.concatenate([constant, -constant[equations]]),
            slack=np.concatenate([relaxation, relaxation[equations]]),
            equal=np.zeros(len(labels) + int(equations.sum()), dtype=np.bool_),
            labels=labels + tuple(label for label, is_equation in zip(labels, equations, strict=True) if is_equation),
        )


Term = dict[int, float]
JOINTS = 4  # foremost and rearmost joints that are tracked: a step rarely makes another one the end


def number_sums(
    m: Measure, design: Array, parameters: tuple[str, ...], scalars: tuple[str, ...], offset: int, above: bool
) -> list[tuple[Term, float]]:
    """Return sums of atoms for a plain number, for every piece of a size, or for every length with both signs.

    If a single sum on its side of the bound suffices, it is the one that determines the output.

    Parameters
    ----------
    m : the measure;  design : (P,);  parameters : names of its columns
    scalars : names of all plain numbers; ``offset`` is the place of the first among the atoms
    above : whether all sums must be below a bound for the inner value to be below it
    """
    if m.kind == "scalar":
        return [({offset + scalars.index(m.name): m.sign}, 0.0)]
    if m.kind in ("least", "most"):
        values = [float(piece(design[None, :])[0]) for piece in m.pieces]
        order = sorted(range(len(values)), key=values.__getitem__, reverse=m.kind == "most")
        selected = order if above == (m.kind == "most") else order[:1]
        return [({offset + scalars.index(m.numbers[k]): 1.0}, 0.0) for k in selected]
    lengths = {name: float(design[parameters.index(name)]) for name in m.numbers}
    if above:
        return [({offset + scalars.index(name): sign}, 0.0) for name in lengths for sign in (1.0, -1.0)]
    name = max(lengths, key=lambda name: abs(lengths[name]))
    return [({offset + scalars.index(name): math.copysign(1.0, lengths[name])}, 0.0)]


def box_sums(
    m: Measure,
    maxima: list[tuple[float, int]],
    minima: list[tuple[float, int]],
    design: Array,
    scalars: tuple[str, ...],
    offset: int,
    above: bool,
) -> list[tuple[Term, float]]:
    """Return the largest coordinates of the joints minus the smallest ones, fixed joints included.

    ``maxima`` and ``minima`` are the extreme values of the joints' coordinates, with their places among the atoms; the
    result is empty if the design has none.
    """
    if not maxima or not minima:
        return []
    fixed = [
        (float(piece(design[None, :])[0]), offset + scalars.index(name))
        for name, piece in zip(m.numbers, m.pieces, strict=True)
    ]
    foremost, rearmost = sorted([*maxima, *fixed], reverse=True)[:JOINTS], sorted([*minima, *fixed])[:JOINTS]
    pairs = [(i, j) for _, i in foremost for _, j in rearmost if i != j]
    return [({i: 1.0, j: -1.0}, 0.0) for i, j in (pairs if above else pairs[:1])]


INSIDE = 1e-6  # share of a window by which a top or dip at its edge stays on its side: decidable from samples
LIMIT_POSITIONS = 4  # highest and lowest limit positions that may come to define the stroke


@dataclass(frozen=True)
class Stay:
    """Window of a follower's position, at one design.

    ``ends`` are the limit positions between which the tracked edges of the window lie; ``bottoms`` and ``tops`` are all
    of them, lowest and highest first, as numbers of points.
    """

    points: Points
    series: int
    window: tuple[float, float]
    ends: tuple[int, int]
    bottoms: list[int]
    tops: list[int]

    def sums(self, above: bool) -> list[tuple[Term, float]]:
        """Return sums of atoms for the crank angle in the window: of leaving poses less that of entering ones.

        The angle is below (or else above) a bound if all sums are, of which the first is that of the tracked ends.
        The others count from a further top or bottom, if the angle shrinks (or else grows) once that is the end.  An
        edge of other ends is extrapolated linearly, which is exact where they are as high as the tracked ones: there
        the row is active.
        """
        points, signs = self.points, self._signs()
        if not signs:
            return []
        turns = -math.tau * math.floor(sum(sign * points.phi[k] for k, sign in signs.items()) / math.tau)
        shares = {k: float(points.level[k]) for k in signs}
        rates = {k: sign / float(points.position_slope[k]) for k, sign in signs.items()}
        widens = sum(rates[k] * shares[k] for k in signs) > 0.0
        falls = sum(rates[k] * (1.0 - shares[k]) for k in signs) < 0.0
        bottoms, tops = self._others(0) if falls == above else [], self._others(1) if widens == above else []
        sums = []
        for stroke in itertools.product([self.ends[0], *bottoms], [self.ends[1], *tops]):
            term: Term = {len(points) + k: sign for k, sign in signs.items()}
            for k, rate in rates.items():
                _add_level(term, shares[k], stroke, rate)
                _add_level(term, shares[k], self.ends, -rate)
            sums.append((term, turns))
        return sums

    def sides(self, bound: float | None, above: bool, margin: float) -> list[tuple[Term, float]]:
        """Return sums that are positive while tops and dips stay on their sides of the window's edges.

        Those inside may not leave it if the angle has a least value, those outside may not enter it if it has a
        largest one (``above``); they keep a ``margin``, a share of the window.  If one crosses the edge by d, the angle
        changes by 2 (2 d / |curvature|)^(1/2), with an infinite slope at d = 0.  Its distance e from its ``bound`` may
        be used up: d <= |curvature| e^2 / 8, here linear in e.
        """
        points, rows, atoms = self.points, [], np.concatenate([self.points.value, self.points.phi])
        width = self.window[1] - self.window[0]
        size = min(width, 1.0 - width) * float(points.value[self.ends[1]] - points.value[self.ends[0]])
        angles, away = [] if bound is None else self.sums(above)[:1], -1.0 if above else 1.0
        own = (points.series == self.series) & (points.kind == STATIONARY)
        for k in np.flatnonzero(own).tolist():
            sense, share = float(points.sense[k]), float(points.level[k])
            upper, outside = share == self.window[1], (share == self.window[0]) == (sense > 0.0)
            if not 0.0 < share < 1.0 or outside != above:
                continue
            # Other ends count that move the edge towards the point.
            tops, bottoms = ([], self._others(0)) if upper != above else (self._others(1), [])
            strokes = [self.ends, *((self.ends[0], j) for j in tops), *((j, self.ends[1]) for j in bottoms)]
            for stroke in strokes:
                term, shift = {k: -sense / size}, -INSIDE - margin
                _add_level(term, share, stroke, sense / size)
                for angle, turns in angles:
                    rest = turns - (bound or 0.0)
                    excess = max(away * (sum(w * float(atoms[j]) for j, w in angle.items()) + rest), 0.0)
                    rate = abs(float(points.curvature[k])) * excess / (4.0 * size)
                    for j, w in angle.items():
                        term[j] = term.get(j, 0.0) + away * rate * w
                    shift += rate * (away * rest - 0.5 * excess)
                rows.append((term, shift))
        return rows

    def _signs(self) -> dict[int, float]:
        """Return +1 for every pose that leaves the window and -1 for every pose that enters it."""
        points = self.points
        edges = np.flatnonzero((points.series == self.series) & (points.kind == CROSSING) & (points.sense > 0.0))
        outward = np.where(points.level[edges] == self.window[0], -1.0, 1.0) * points.position_slope[edges]
        return dict(zip(edges.tolist(), np.sign(outward).tolist(), strict=True))

    def _others(self, end: int) -> list[int]:
        """Return the lowest bottoms (end 0) or the highest tops (end 1) besides the end of the stroke itself."""
        candidates = (self.bottoms, self.tops)[end][:LIMIT_POSITIONS]
        return [k for k in candidates if k != self.ends[end]]


def _add_level(term: Term, share: float, stroke: tuple[int, int], weight: float) -> None:
    """Add the position at a share of the stroke between two limit positions, multiplied by a weight."""
    for end, part in zip(stroke, (1.0 - share, share), strict=True):
        term[end] = term.get(end, 0.0) + weight * part
