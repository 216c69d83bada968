"""Extrema over the turn: found on a grid, refined, and tracked while the design changes.

Slopes by the crank angle come from the complex step through the family's own poses, so any pose output can be tracked,
with or without an output that is its derivative.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sweep.families.base import Angles, Array
from sweep.families.poses import differentiable
from sweep.optimise.extrema.scanned import (
    CROSSING,
    EDGE,
    PASSING,
    STATIC,
    STATIONARY,
    Row,
    bending,
    discriminant_scale,
    distances,
    edges,
    extrema,
    followed,
    may_bend,
    overtopped,
    passages,
    poses_needed,
    tops,
)
from sweep.optimise.problem.statement import Problem
from sweep.quantities.measures import Series, curve
from sweep.reductions.sampling import on_closed_turn

Index: TypeAlias = NDArray[np.intp]

STEP = 1e-30  # imaginary step: the error is of order STEP^2, without cancellation
NEIGHBOUR = 3e-5  # distance of the slopes whose difference gives the curvature, used only in Newton's steps [rad]
SETTLED = 3e-6  # a Newton step of this length leaves an error of its square [rad]
STRIDE = 0.1  # longest single move of a tracked point [rad]


@dataclass(frozen=True)
class Points:
    """K points of a design's curves; every array is (K,).

    ``series`` is the number of the curve, ``phi`` the crank angle, ``sense`` +1 for a maximum and -1 for a minimum.
    ``how`` is the condition that defines the point: stationary, the crossing of the window's edge at the fraction
    ``level`` of the stroke, a fixed angle, an edge of the curve (``level`` gives its number and side), or the angle at
    which the curve passes ``level``, upwards for ``sense`` +1.  ``value`` is the curve there, ``slope`` and
    ``curvature`` are its derivatives by phi; ``pace`` is the slope of the position.
    """

    series: Index
    phi: Array
    sense: Array
    how: Index
    level: Array
    value: Array
    slope: Array
    curvature: Array
    pace: Array

    def __len__(self) -> int:
        return len(self.phi)

    def take(self, which: Any) -> Points:
        """Return the points selected by an index or a mask."""
        return Points(*(getattr(self, name)[which] for name in self.__dataclass_fields__))

    def shifted(self, offset: float) -> Points:
        """Return the same points at crank angles increased by ``offset``."""
        return replace(self, phi=self.phi + offset)

    @classmethod
    def of(cls, rows: Iterable[Row]) -> Points:
        """Return points from rows (series, phi, sense, how, level, value)."""
        table = np.array(list(rows), dtype=np.float64).reshape(-1, 6)
        nothing = np.zeros(len(table))
        number, phi, sense, how, level, value = table.T
        return cls(number.astype(np.intp), phi, sense, how.astype(np.intp), level, value, nothing, nothing, nothing)

    @classmethod
    def joined(cls, first: Points, second: Points) -> Points:
        """Return both sets of points, the second after the first."""
        pairs = ((getattr(first, name), getattr(second, name)) for name in first.__dataclass_fields__)
        return cls(*(np.concatenate(pair) for pair in pairs))


class Curves:
    """The curves that a problem needs, for one design or for many at the same crank angles.

    With ``places`` the angles of extrema are needed as well, which requires the curvature there.
    """

    def __init__(self, problem: Problem, series: tuple[Series, ...], places: bool = False) -> None:
        self.problem = problem
        self.family = on_closed_turn(differentiable(problem.family))
        followers = [curve(self.family, self.family.follower(s.output)) for s in series if s.window is not None]
        self.series = series = (*series, *(s for s in dict.fromkeys(followers) if s not in series))
        # For each series the number of the position that defines its window; -1 without a window.
        known = {s: n for n, s in enumerate(series) if s in followers}
        known |= {s: known[p] for s, p in zip((s for s in series if s.window is not None), followers, strict=True)}
        self.position: Index = np.array([known.get(s, -1) for s in series], np.intp)
        names = {s.output for s in series} | {s.pressure for s in series if s.pressure}
        self.wanted = frozenset(names)
        self.places = places
        self.plain = tuple(s.output for s in series if _is_plain(s))
        self.may_bend = may_bend(problem.family, self.plain)
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
        samples = max(samples, poses_needed(self.problem.family, design, self.wanted))
        phi: Array = np.arange(samples, dtype=np.float64) * (2.0 * math.pi / samples)
        columns = self.poses(design[None, :], phi)
        turns = not columns["status"].any()
        rows: list[Row] = []
        windowed = [n for n, s in enumerate(self.series) if s.window is not None]
        for n, s in enumerate(self.series):
            if s.passes is not None:
                rows += passages(n, phi, self.curve(s, columns)[0], *s.passes)
            elif n not in windowed:
                x, room = self.curve(s, columns)[0], self._margin(n, design[None, :], phi)[0]
                for sense in (1.0, -1.0):
                    rows += extrema(n, phi, x + sense * room, s.wrapped, sense)
        found = Points.of(rows)
        points = self.follow(design, found, stride=2.0 * math.pi / samples)
        if self.may_bend and turns:
            points = self._with_edges(design, columns, found, points, 2.0 * math.pi / samples)
        if windowed and turns:
            edge_rows: list[Row] = []
            for n in windowed:
                edge_rows += self._inside(n, design, phi, columns, points)
            points = self.follow(design, Points.joined(points, Points.of(edge_rows)), stride=2.0 * math.pi / samples)
        return _without_repetition(points), turns

    def _with_edges(
        self, design: Array, columns: dict[str, Any], found: Points, points: Points, stride: float
    ) -> Points:
        """Add the points at curve edges; ``found`` are the initial points, on samples ``stride`` apart."""
        names = bending(self.problem.family, design, self.plain)
        if not names:
            return points
        bent = [n for n, s in enumerate(self.series) if _is_plain(s) and s.output in {self.plain[k] for k in names}]
        sides, which = edges(self.problem.family, design, self.plain)
        there = self.poses(design[None, :], sides.ravel())
        rows = []
        for n in bent:
            values = self.curve(self.series[n], there)[0].reshape(sides.shape)
            rows += tops(n, sides, which, values, self.curve(self.series[n], columns)[0])
        at_edges = Points.of(rows)
        at_edges = replace(at_edges, value=self.values(design[None, :], at_edges)[0])
        # An extremum beside an edge is the edge itself; elsewhere a point that ends lower than it began is put back.
        own = np.isin(points.series, bent)
        fell = own & (points.sense * (found.value - points.value) > 0.0)
        phi = np.where(fell, found.phi, points.phi)
        reach = np.where(fell | overtopped(points, at_edges, stride), stride, NEIGHBOUR)
        beside = own & (distances(sides.mean(axis=0), phi) <= reach)
        held = replace(found, how=np.full(len(found), STATIC)).take(fell & ~beside)
        return Points.joined(Points.joined(points.take(~fell & ~beside), held), at_edges)

    def curve(self, series: Series, columns: dict[str, Any]) -> Any:
        """Return the values (n, m) of a series from pose outputs."""
        x = columns[series.output]
        if series.pressure:
            with np.errstate(invalid="ignore"):
                x = x / discriminant_scale(x, columns[series.pressure])
        return x

    def _margin(self, n: int, designs: Any, phi: Any) -> Any:
        """Return the tolerance margin added to the maxima of series n and subtracted from its minima, (n, m)."""
        room = self.problem.curve_margins.get(self.series[n].output)
        return np.zeros((len(designs), len(phi))) if room is None else room.at(designs, phi)

    def stroke(self, points: Points, n: int) -> tuple[int, int]:
        """Return the points of smallest and largest position of the follower that defines the window of series n."""
        own = np.flatnonzero((points.series == self.position[n]) & np.isin(points.how, (STATIONARY, EDGE)))
        low, high = own[points.sense[own] < 0], own[points.sense[own] > 0]
        if not len(low) or not len(high):
            return -1, -1
        return int(low[np.argmin(points.value[low])]), int(high[np.argmax(points.value[high])])

    def follow(self, design: Array, points: Points, stride: float = STRIDE) -> Points:
        """Move the points to their places on this design, and update their values.

        A stationary point climbs (or descends) to its extremum by Newton's method on the slope, at most ``stride`` per
        step.  The curve's value at any angle bounds the maximum from below.  Slopes, curvatures and paces are updated
        if an edge or the angles of extrema need them.
        """
        if not len(points):
            return points
        held, passing, edge = points.how == STATIONARY, points.how == PASSING, points.how == EDGE
        phi = points.phi.copy()
        if edge.any():
            given = design[None, :], phi[edge], points.level[edge]
            phi[edge] = followed(self.problem.family, *given, self.plain)[0]
        own = self._by_series(points)
        reach, uphill = np.full(len(phi), stride), np.zeros(len(phi))
        for _ in range(12):
            slope, curvature, pace, place, value = self._local(design, phi, points, own)
            move = np.zeros(len(phi))
            move[passing] = (points.level[passing] - value[passing]) / slope[passing]
            peak = held & (points.sense * curvature < 0.0)
            move[peak] = -slope[peak] / curvature[peak]
            climb = held & ~peak
            move[climb] = np.copysign(stride, points.sense * slope)[climb]
            self._approach_edges(points, phi, place, pace, move)
            # A step that changes sign has passed the extremum: halve the longest step of that point.
            reach[uphill * move < 0.0] *= 0.5
            uphill = move
            move = np.minimum(np.maximum(move, -reach), reach)
            move[np.isnan(move)] = 0.0
            phi += move
            if np.abs(move).max() < SETTLED:
                break
        if self.places or (points.how == CROSSING).any():
            slope, curvature, pace, _, value = self._local(design, phi, points, own)
            # The angle of a passage is itself an atom, so its error is of first order: take one more Newton step.
            with np.errstate(divide="ignore", invalid="ignore"):  # other points may have slope zero
                phi[passing] += np.clip((points.level - value) / slope, -SETTLED, SETTLED)[passing]
        moved = replace(points, phi=phi, slope=slope, curvature=curvature, pace=pace)
        return replace(moved, value=self.values(design[None, :], moved)[0])

    def values(self, designs: Any, points: Points) -> Any:
        """Return the curves' values (n, K) for designs (n, P) at the points' crank angles."""
        if not self.wanted:  # an output computed by a step alone needs no curve
            return np.empty((len(designs), len(points)), dtype=np.result_type(designs))
        columns = self.poses(designs, self._angles(points))
        out = np.empty((len(designs), len(points)), dtype=columns[next(iter(self.wanted))].dtype)
        for n, s in enumerate(self.series):
            own = points.series == n
            if not own.any():
                continue
            out[:, own] = self.curve(s, columns)[:, : len(points)][:, own]
            if s.output in self.problem.curve_margins:
                out[:, own] += points.sense[own] * self._margin(n, designs, points.phi[own])
            if s.wrapped:
                # Choose the turn nearest to the previous value: a step of the optimiser never moves an angle by half a
                # turn.
                turns = np.round((points.value[own] - out[:, own].real) / (2.0 * math.pi))
                out[:, own] += 2.0 * math.pi * np.nan_to_num(turns)
        return out

    def positions(self, designs: Any, points: Points) -> Any:
        """Return the position of the follower that defines each point's window, (n, K), at the points' crank angles."""
        return self.values(designs, replace(points, series=self.position[points.series], value=np.zeros(len(points))))

    def _angles(self, points: Points) -> Array:
        """Return the points' angles, followed by 16 angles that give the scale of a discriminant."""
        if any(s.pressure for s in self.series):
            return np.concatenate([points.phi, np.arange(16) * (math.pi / 8.0)])
        return points.phi

    def _by_series(self, points: Points) -> list[tuple[Series, Index]]:
        """Return the series that have points, with the indices of these points."""
        found = ((s, np.flatnonzero(points.series == n)) for n, s in enumerate(self.series))
        return [(s, own) for s, own in found if len(own)]

    def _local(
        self, design: Array, phi: Array, points: Points, owners: list[tuple[Series, Index]]
    ) -> tuple[Array, Array, Array, Array, Array]:
        """Return slope and curvature of each output, slope and value of its position, and its value, (K,) each."""
        three = np.concatenate([phi - NEIGHBOUR, phi, phi + NEIGHBOUR])
        columns = self.poses(design[None, :], three + 1j * STEP)
        k = len(phi)
        slopes, value = np.empty((3, k)), np.empty(k)
        for s, own in owners:
            curve = columns[s.output][0].reshape(3, k)[:, own]
            slopes[:, own], value[own] = curve.imag / STEP, curve[1].real
            if s.output in self.problem.curve_margins:
                room = self.problem.curve_margins[s.output].slope(design, three).reshape(3, k)
                slopes[:, own] += points.sense[own] * room[:, own]
        curvature = (slopes[2] - slopes[0]) / (2.0 * NEIGHBOUR)
        place = np.zeros(k, np.complex128)
        for n in np.unique(self.position[self.position >= 0]):
            cut = self.position[points.series] == n
            place[cut] = columns[self.series[n].output][0, k : 2 * k][cut]
        return slopes[1], curvature, place.imag / STEP, place.real, value

    def _approach_edges(self, points: Points, phi: Array, place: Array, pace: Array, move: Array) -> None:
        for n in np.unique(points.series[points.how == CROSSING]):
            edges = (points.how == CROSSING) & (points.series == n)
            low, high = self.stroke(points, n)
            if low >= 0:
                target = place[low] + points.level[edges] * (place[high] - place[low])
                move[edges] = -(place[edges] - target) / pace[edges]

    def _inside(self, n: int, design: Array, phi: Array, columns: dict[str, Any], points: Points) -> list[Row]:
        """Return the extrema inside the window of series n, and both senses at every crossing of the window's edges."""
        series = self.series[n]
        low, high = self.stroke(points, n)
        if series.window is None or low < 0:
            return []
        s = self.curve(self.series[self.position[n]], columns)[0]
        share = (s - points.value[low]) / (points.value[high] - points.value[low])
        x = self.curve(series, columns)[0]
        rows = []
        for edge in series.window:
            if edge in (0.0, 1.0):
                continue
            side = share - edge
            for j in np.flatnonzero(np.sign(side) != np.sign(np.roll(side, -1))):
                part = side[j] / (side[j] - side[(j + 1) % len(side)])
                start = phi[j] + part * (phi[1] - phi[0])
                rows += [(n, start, sense, CROSSING, edge, x[j]) for sense in (1.0, -1.0)]
        inside = (share >= series.window[0] - 1e-12) & (share <= series.window[1] + 1e-12)
        for sense in (1.0, -1.0):
            rows += extrema(n, phi, x + sense * self._margin(n, design[None, :], phi)[0], False, sense, inside)
        return rows


def _is_plain(series: Series) -> bool:
    return not (series.pressure or series.wrapped or series.passes) and series.window is None


def _without_repetition(points: Points) -> Points:
    """Keep one of several grid maxima that refinement has moved to the same crank angle."""
    key = np.stack([points.series, points.sense, points.how, np.round(np.mod(points.phi, 2.0 * math.pi), 5)])
    _, first = np.unique(key, axis=1, return_index=True)
    return points.take(np.sort(first))
