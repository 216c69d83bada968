"""Extrema over the turn: found on a grid, refined, and tracked while the design changes.

Slopes by the crank angle come from the complex step through the family's own poses, so any pose output can be tracked,
with or without an output that is its derivative.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kernels.types import TWO_PI
from sweep.families.base import Angles, Array
from sweep.families.poses import differentiable
from sweep.numerics.records import Indices
from sweep.optimise.extrema import scanned
from sweep.optimise.problem.statement import Problem
from sweep.quantities.measures import Series, curve, measure
from sweep.reductions.sampling import on_closed_turn

STEP = 1e-30  # imaginary step: the error is of order STEP^2, without cancellation
NEIGHBOUR = 3e-5  # distance of the slopes whose difference gives the curvature, used only in Newton's steps [rad]
CONVERGED_STEP = 3e-6  # a Newton step of this length leaves an error of its square [rad]
STRIDE = 0.1  # longest single move of a tracked point [rad]


@dataclass(frozen=True)
class Points:
    """K points of a design's curves; every array is (K,).

    ``series`` is the number of the curve, ``phi`` the crank angle, ``sense`` +1 for a maximum and -1 for a minimum.
    ``kind`` is the condition that defines the point: stationary (in a window ``level`` is the edge that an extremum of
    the position faces), the crossing of the window's edge at the fraction ``level`` of the stroke, a fixed angle, an
    edge of the curve (``level`` gives its number and side), or the angle at which the curve passes ``level``, upwards
    for ``sense`` +1.  ``value`` is the curve there, ``slope`` and ``curvature`` are its derivatives by phi;
    ``position_slope`` is the slope of the position.
    """

    series: Indices
    phi: Array
    sense: Array
    kind: Indices
    level: Array
    value: Array
    slope: Array
    curvature: Array
    position_slope: Array

    def __len__(self) -> int:
        return len(self.phi)

    def take(self, which: Any) -> Points:
        """Return the points selected by an index or a mask."""
        return Points(*(getattr(self, name)[which] for name in self.__dataclass_fields__))

    def shifted(self, offset: float) -> Points:
        """Return the same points at crank angles increased by ``offset``."""
        return replace(self, phi=self.phi + offset)

    @classmethod
    def of(cls, rows: Iterable[scanned.PointRow]) -> Points:
        """Return points from rows (series, phi, sense, how, level, value)."""
        table = np.array(list(rows), dtype=np.float64).reshape(-1, 6)
        zeros = np.zeros(len(table))
        number, phi, sense, kind, level, value = table.T
        return cls(number.astype(np.intp), phi, sense, kind.astype(np.intp), level, value, zeros, zeros, zeros)

    @classmethod
    def joined(cls, first: Points, second: Points) -> Points:
        """Return both sets of points, the second after the first."""
        pairs = ((getattr(first, name), getattr(second, name)) for name in first.__dataclass_fields__)
        return cls(*(np.concatenate(arrays) for arrays in pairs))


class Curves:
    """The curves that a problem needs, for one design or for many at the same crank angles.

    With ``with_angles`` the angles of extrema are needed as well, which requires the curvature there.
    """

    def __init__(self, problem: Problem, series: tuple[Series, ...], with_angles: bool = False) -> None:
        self.problem = problem
        self.family = on_closed_turn(differentiable(problem.family))
        followers = [curve(self.family, self.family.follower(s.output)) for s in series if s.window is not None]
        self.series = series = (*series, *(s for s in dict.fromkeys(followers) if s not in series))
        # For each series the number of the position that defines its window; -1 without a window.
        numbers = {s: n for n, s in enumerate(series) if s in followers}
        numbers |= {s: numbers[p] for s, p in zip((s for s in series if s.window is not None), followers, strict=True)}
        self.position: Indices = np.array([numbers.get(s, -1) for s in series], np.intp)
        names = [problem.objective, *(limit.output for limit in problem.limits if limit.maximum is not None)]
        measures = [measure(problem.family, name, problem.window) for name in names]
        self.kept_out = [m.series[0] for m in measures if m.kind == "stay"]
        self.wanted = frozenset(s.output for s in series)
        self.with_angles = with_angles
        self.plain = tuple(s.output for s in series if _is_plain(s))
        self.may_bend = scanned.may_bend(problem.family, self.plain)
        self.calls = 0

    def poses(self, designs: Any, phi: Any, wanted: frozenset[str] | None = None) -> dict[str, Any]:
        """Return pose outputs at angles phi (m,) shared by all designs (n, P); complex if either is."""
        self.calls += 1
        angles = np.asarray(phi)[None, :]
        if np.iscomplexobj(angles) or np.iscomplexobj(designs):
            angles, designs = angles.astype(np.complex128), np.asarray(designs).astype(np.complex128)
        # A trial design may leave the domain of its kernel; the search reacts to the resulting nan with a shorter step.
        with np.errstate(all="ignore"):
            return self.family.poses(np.ascontiguousarray(designs), Angles.of(angles), wanted or self.wanted)

    def scan(self, design: Array, samples: int) -> tuple[Points, bool]:
        """Return all relevant extrema of all curves, refined, and whether every pose exists.

        Only maxima in the upper half of a curve's range and minima in the lower half are kept.  A curve that is
        undefined at some angle has none.
        """
        samples = max(samples, scanned.poses_needed(self.problem.family, design, self.wanted))
        phi: Array = np.arange(samples, dtype=np.float64) * (2.0 * math.pi / samples)
        columns = self.poses(design[None, :], phi)
        turns = not columns["status"].any()
        rows: list[scanned.PointRow] = []
        windowed = [n for n, s in enumerate(self.series) if s.window is not None]
        for n, s in enumerate(self.series):
            if s.passes is not None:
                rows += scanned.passages(n, phi, columns[s.output][0], *s.passes)
            elif n not in windowed:
                x = self.curve(s, design[None, :], columns)[0]
                margin = self._margin(n, design[None, :], phi)[0]
                for sense in (1.0, -1.0):
                    rows += scanned.extrema(n, phi, x + sense * margin, s.wrapped, sense)
        initial = Points.of(rows)
        points = self.follow(design, initial, stride=2.0 * math.pi / samples)
        if self.may_bend and turns:
            points = self._with_edges(design, columns, initial, points, 2.0 * math.pi / samples)
        if windowed and turns:
            edge_rows: list[scanned.PointRow] = []
            for n in windowed:
                edge_rows += self._in_window(n, design, phi, columns, points)
            points = self.follow(design, Points.joined(points, Points.of(edge_rows)), stride=2.0 * math.pi / samples)
        return _without_duplicates(points), turns

    def _with_edges(
        self, design: Array, columns: dict[str, Any], initial: Points, points: Points, stride: float
    ) -> Points:
        """Add the points at curve edges; ``initial`` are the unrefined points, on samples ``stride`` apart."""
        names = scanned.bending(self.problem.family, design, self.plain)
        if not names:
            return points
        bent = [n for n, s in enumerate(self.series) if _is_plain(s) and s.output in {self.plain[k] for k in names}]
        sides, numbers = scanned.edges(self.problem.family, design, self.plain)
        edge_columns = self.poses(design[None, :], sides.ravel())
        rows = []
        for n in bent:
            output = self.series[n].output
            values = edge_columns[output][0].reshape(sides.shape)
            rows += scanned.edge_extrema(n, sides, numbers, values, columns[output][0])
        at_edges = Points.of(rows)
        at_edges = replace(at_edges, value=self.values(design[None, :], at_edges)[0])
        # An extremum beside an edge is the edge itself; elsewhere a point that ends lower than it began is put back.
        on_bent = np.isin(points.series, bent)
        descended = on_bent & (points.sense * (initial.value - points.value) > 0.0)
        phi = np.where(descended, initial.phi, points.phi)
        reach = np.where(descended | scanned.overtopped(points, at_edges, stride), stride, NEIGHBOUR)
        near_edge = on_bent & (scanned.distances(sides.mean(axis=0), phi) <= reach)
        restored = replace(initial, kind=np.full(len(initial), scanned.STATIC)).take(descended & ~near_edge)
        return Points.joined(Points.joined(points.take(~descended & ~near_edge), restored), at_edges)

    def curve(self, series: Series, designs: Any, columns: dict[str, Any]) -> Any:
        """Return the values (n, m) of a series from pose outputs of designs (n, P)."""
        x = columns[series.output]
        with np.errstate(all="ignore"):  # a design outside the domain of its kernel has no curve
            return x if series.scale is None else x / series.scale(designs)[:, None]

    def _margin(self, n: int, designs: Any, phi: Any) -> Any:
        """Return the tolerance margin added to the maxima of series n and subtracted from its minima, (n, m)."""
        margin = self.problem.curve_margins.get(self.series[n].output)
        return np.zeros((len(designs), len(phi))) if margin is None else margin.at(designs, phi)

    def stroke(self, points: Points, n: int) -> tuple[int, int]:
        """Return the points of smallest and largest position of the follower that defines the window of series n.

        If the angle in the window is limited, they are those of the last scan, marked as fractions 0 and 1 of the
        stroke: rows of every other top say what happens once that is the highest.
        """
        limit_points = np.flatnonzero(
            (points.series == self.position[n]) & np.isin(points.kind, (scanned.STATIONARY, scanned.EDGE))
        )
        low, high = limit_points[points.sense[limit_points] < 0], limit_points[points.sense[limit_points] > 0]
        if not len(low) or not len(high):
            return -1, -1
        ends = limit_points[points.kind[limit_points] == scanned.STATIONARY]
        fixed = ends[np.isin(points.level[ends], (0.0, 1.0))]
        if len(fixed):
            return int(fixed[points.level[fixed] == 0.0][0]), int(fixed[points.level[fixed] == 1.0][0])
        return int(low[np.argmin(points.value[low])]), int(high[np.argmax(points.value[high])])

    def follow(self, design: Array, points: Points, stride: float = STRIDE) -> Points:
        """Move the points to their places on this design, and update their values.

        A stationary point climbs (or descends) to its extremum by Newton's method on the slope, at most ``stride`` per
        step.  The curve's value at any angle bounds the maximum from below.  Slopes and curvatures are updated
        if an edge or the angles of extrema need them.
        """
        if not len(points):
            return points
        stationary, passing, at_edge = (
            points.kind == scanned.STATIONARY,
            points.kind == scanned.PASSING,
            points.kind == scanned.EDGE,
        )
        phi = points.phi.copy()
        if at_edge.any():
            edge_data = design[None, :], phi[at_edge], points.level[at_edge]
            phi[at_edge] = scanned.moved_edges(self.problem.family, *edge_data, self.plain)[0]
        by_series = [(s, k) for n, s in enumerate(self.series) if len(k := np.flatnonzero(points.series == n))]
        longest, previous = np.full(len(phi), stride), np.zeros(len(phi))
        for _ in range(12):
            slope, curvature, position_slope, position, value = self._derivatives(design, phi, points, by_series)
            move = np.zeros(len(phi))
            move[passing] = (points.level[passing] - value[passing]) / slope[passing]
            peak = stationary & (points.sense * curvature < 0.0)
            move[peak] = -slope[peak] / curvature[peak]
            climb = stationary & ~peak
            move[climb] = np.copysign(stride, points.sense * slope)[climb]
            self._approach_edges(points, position, position_slope, move)
            # A step that changes sign has passed the extremum: halve the longest step of that point.
            longest[previous * move < 0.0] *= 0.5
            previous = move
            move = np.minimum(np.maximum(move, -longest), longest)
            move[np.isnan(move)] = 0.0
            phi += move
            if np.abs(move).max() < CONVERGED_STEP:
                break
        if self.with_angles or (points.kind == scanned.CROSSING).any():
            slope, curvature, position_slope, _, value = self._derivatives(design, phi, points, by_series)
            # The angle of a passage is itself an atom, so its error is of first order: take one more Newton step.
            with np.errstate(divide="ignore", invalid="ignore"):  # other points may have slope zero
                phi[passing] += np.clip((points.level - value) / slope, -CONVERGED_STEP, CONVERGED_STEP)[passing]
        moved = replace(points, phi=phi, slope=slope, curvature=curvature, position_slope=position_slope)
        return replace(moved, value=self.values(design[None, :], moved)[0])

    def values(self, designs: Any, points: Points) -> Any:
        """Return the curves' values (n, K) for designs (n, P) at the points' crank angles."""
        if not self.wanted:  # an output computed by a step alone needs no curve
            return np.empty((len(designs), len(points)), dtype=np.result_type(designs))
        columns = self.poses(designs, points.phi)
        out = np.empty((len(designs), len(points)), dtype=columns[next(iter(self.wanted))].dtype)
        for n, s in enumerate(self.series):
            mask = points.series == n
            if not mask.any():
                continue
            out[:, mask] = self.curve(s, designs, columns)[:, mask]
            if s.output in self.problem.curve_margins:
                out[:, mask] += points.sense[mask] * self._margin(n, designs, points.phi[mask])
            if s.wrapped:
                # Choose the turn nearest to the previous value: a step of the optimiser never moves an angle by half a
                # turn.
                turns = np.round((points.value[mask] - out[:, mask].real) / (2.0 * math.pi))
                out[:, mask] += 2.0 * math.pi * np.nan_to_num(turns)
        return out

    def positions(self, designs: Any, points: Points) -> Any:
        """Return the position of the follower that defines each point's window, (n, K), at the points' crank angles."""
        return self.values(designs, replace(points, series=self.position[points.series], value=np.zeros(len(points))))

    def _derivatives(
        self, design: Array, phi: Array, points: Points, by_series: list[tuple[Series, Indices]]
    ) -> tuple[Array, Array, Array, Array, Array]:
        """Return slope and curvature of each output, slope and value of its position, and its value, (K,) each."""
        angles = np.concatenate([phi - NEIGHBOUR, phi, phi + NEIGHBOUR])
        columns = self.poses(design[None, :], angles + 1j * STEP)
        k = len(phi)
        slopes, value = np.empty((3, k)), np.empty(k)
        for s, indices in by_series:
            curve = columns[s.output][0].reshape(3, k)[:, indices]
            slopes[:, indices], value[indices] = curve.imag / STEP, curve[1].real
            if s.output in self.problem.curve_margins:
                margin_slope = self.problem.curve_margins[s.output].slope(design, angles).reshape(3, k)
                slopes[:, indices] += points.sense[indices] * margin_slope[:, indices]
        curvature = (slopes[2] - slopes[0]) / (2.0 * NEIGHBOUR)
        position = np.zeros(k, np.complex128)
        for n in np.unique(self.position[self.position >= 0]):
            mask = self.position[points.series] == n
            position[mask] = columns[self.series[n].output][0, k : 2 * k][mask]
        return slopes[1], curvature, position.imag / STEP, position.real, value

    def _approach_edges(self, points: Points, position: Array, position_slope: Array, move: Array) -> None:
        for n in np.unique(points.series[points.kind == scanned.CROSSING]):
            crossing = (points.kind == scanned.CROSSING) & (points.series == n)
            low, high = self.stroke(points, n)
            if low >= 0:
                wrapped, stroke = self.series[self.position[n]].wrapped, position[high] - position[low]
                if wrapped:  # both ends of the stroke count whole turns, as at the last design
                    stroke += TWO_PI * np.round((points.value[high] - points.value[low] - stroke) / TWO_PI)
                beyond = position[crossing] - (position[low] + points.level[crossing] * stroke)
                beyond = np.remainder(beyond + math.pi, TWO_PI) - math.pi if wrapped else beyond
                move[crossing] = -beyond / position_slope[crossing]

    def _in_window(
        self, n: int, design: Array, phi: Array, columns: dict[str, Any], points: Points
    ) -> list[scanned.PointRow]:
        """Return the extrema inside the window of series n, and both senses at every crossing of the window's edges."""
        series = self.series[n]
        low, high = self.stroke(points, n)
        if series.window is None or low < 0:
            return []
        position = self.series[self.position[n]]
        if series.output == position.output:
            points.level[[low, high]] = 0.0, 1.0
        s, x = (np.unwrap(columns[c.output][0]) if c.wrapped else columns[c.output][0] for c in (position, series))
        share = (s - points.value[low]) / (points.value[high] - points.value[low])
        own = series.output == position.output
        if own:
            # A dip of one sample has two edges too close for Newton's method; its own row keeps it on its side.
            inside = (share >= series.window[0]) & (share <= series.window[1])
            gap = (inside != np.roll(inside, 1)) & (inside != np.roll(inside, -1))
            gap &= ~inside | (series in self.kept_out)
            gap &= scanned.distances(points.phi[[low, high]], phi) > phi[1] - phi[0]
            share[gap] = 0.5 * (np.roll(share, 1) + np.roll(share, -1))[gap]
        rows = []
        for edge in series.window:
            if edge in (0.0, 1.0):
                continue
            side = share - edge
            for j in np.flatnonzero(np.sign(side) != np.sign(np.roll(side, -1))):
                weight = side[j] / (side[j] - side[(j + 1) % len(side)])
                start = phi[j] + weight * (phi[1] - phi[0])
                rows += [(n, start, sense, scanned.CROSSING, edge, x[j]) for sense in (1.0, -1.0)]
        inside = (share >= series.window[0] - 1e-12) & (share <= series.window[1] + 1e-12)
        margin = self._margin(n, design[None, :], phi)[0]
        for sense in (1.0, -1.0):
            opposite, edge = series.window if sense > 0.0 else series.window[::-1]
            rows += scanned.extrema(n, phi, x + sense * margin, False, sense, inside, edge)
            if own:
                outside = ~inside & (sense * (opposite - share) > 0.0)
                rows += scanned.extrema(n, phi, x, False, sense, outside, opposite)
        return rows


def _is_plain(series: Series) -> bool:
    return not (series.scale or series.wrapped or series.passes) and series.window is None


def _without_duplicates(points: Points) -> Points:
    """Keep one of several grid maxima that refinement has moved to the same crank angle."""
    key = np.stack([points.series, points.sense, points.kind, np.round(np.mod(points.phi, 2.0 * math.pi), 5)])
    _, first = np.unique(key, axis=1, return_index=True)
    return points.take(np.sort(first))
