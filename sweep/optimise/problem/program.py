"""The epigraph program of a problem, laid out as rows for any design (:mod:`sweep.optimise.problem.rows`)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from sweep.errors import InputError
from sweep.families.base import Array
from sweep.families.machines.machine import Machine
from sweep.optimise.extrema.points import Curves, Points
from sweep.optimise.extrema.scanned import first_passage
from sweep.optimise.problem.rows import Form, Label, Stay, Term, box_sums, number_sums
from sweep.optimise.problem.statement import PLACE, Problem
from sweep.quantities.measures import Measure, Series, margins, measure
from sweep.quantities.resolve import output

if TYPE_CHECKING:
    from sweep.optimise.manufacture.curve_margins import Allowance

SMALLEST = 1e-100  # a smaller limit counts as a limit at zero


BoundShift: TypeAlias = tuple[Mapping[str, float], float]
NO_SHIFT: BoundShift = ({}, 0.0)
DIFFERENCE = 1e-6  # relative step for the derivative of an inner value by its output
TIE = 1e-10  # relative difference of extrema of equal height, of which summaries report the place of the first


@dataclass(frozen=True)
class Requirement:
    """One limit in the optimiser's inner values (`Measure`); it is an equation if ``minimum == maximum``.

    ``lower_shift`` and ``upper_shift`` are the changes of its bounds with parameters: derivatives by name, and the sum
    of these times the values at which the bounds hold as given.  Tops and dips keep the distance ``at_edges`` from the
    edges of a window, a share of the window.
    """

    measure: Measure
    minimum: float | None
    maximum: float | None
    lower_shift: BoundShift = NO_SHIFT
    upper_shift: BoundShift = NO_SHIFT
    at_edges: float = 0.0

    @property
    def equal(self) -> bool:
        """Whether this is an equation."""
        return self.minimum is not None and self.minimum == self.maximum


def violation_scale(magnitude: float) -> float:
    """Return the divisor of violations of a limit of the given size; 1 if the quotient would overflow."""
    return magnitude if magnitude > SMALLEST else 1.0


class Program:
    """Objective and limits of a problem, ready to be laid out as rows for any design."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.objective = measure(problem.family, problem.objective, problem.window)
        if self.objective.inner == "rotatable":
            raise InputError("objective", problem.objective, "a quantity that changes steadily", PLACE)
        for name in (problem.objective, *(limit.output for limit in problem.limits)):
            measure(problem.family, name, problem.window)  # raises for unknown names
            if name not in problem.family.parameter_names and output(problem.family, name).jumps:
                raise InputError(name, "constant in pieces", "a quantity that changes steadily", PLACE)
        self.turning = Measure("rotatable", "min", margins(problem.family), "rotatable")
        rotatability = Requirement(self.turning, self.turning.to_inner(1.0), None)
        self.requirements = [rotatability] if self.turning.series else []
        for limit in problem.limits:
            quantity = measure(problem.family, limit.output, problem.window)
            if quantity.inner == "rotatable":
                if limit.maximum is not None or limit.minimum not in (1, 1.0, True):
                    raise InputError(limit.output, (limit.minimum, limit.maximum), "at least 1 (it turns)", PLACE)
                continue  # required of every design anyway
            if allowed := quantity.refused(limit.minimum, limit.maximum):
                raise InputError(limit.output, (limit.minimum, limit.maximum), allowed, PLACE)
            bounds = [None if b is None else quantity.to_inner(float(b)) for b in (limit.minimum, limit.maximum)]
            allowance = problem.allowances.get(limit.output)
            lower = _bound_shift(quantity, limit.minimum, allowance, 1.0)
            upper = _bound_shift(quantity, limit.maximum, allowance, -1.0)
            at_edges = 0.0 if allowance is None else allowance.at_edges
            self.requirements.append(Requirement(quantity, bounds[0], bounds[1], lower, upper, at_edges))
        measures = [self.objective, *(r.measure for r in self.requirements)]
        self.series = tuple(dict.fromkeys(s for m in measures for s in m.series))
        names = [name for r in self.requirements for side in (r.lower_shift, r.upper_shift) for name in side[0]]
        self.scalars = tuple(dict.fromkeys([*(name for m in measures for name in m.numbers), *names]))
        self.pieces = {name: piece for m in measures for name, piece in zip(m.numbers, m.pieces, strict=False)}
        self.with_angles = any(m.follows_angles for m in measures)
        readings = (m.parts[0] if m.kind == "minus" else m for m in measures)
        self.readings = {m.name: m for m in readings if m.kind == "scalar" and m.parts}

    def lay_out(self, curves: Curves, design: Array, points: Points, turns: bool, scale: float) -> Form:
        """Return the rows for a design; ``points`` are its extrema, ``scale`` divides the objective."""
        layout = _Layout(curves, points, design, self.scalars)
        complete = turns
        for requirement in self.requirements:
            complete = layout.require(requirement) and complete
        layout.keep_sides(self.objective, None, True, "minimum")
        sums = layout.upper(self.objective)
        for term, shift in sums:
            layout.add(term, shift, -1.0 / scale, 0.0, 1.0, False, Label(self.objective.name, "objective"))
        has_margins = all(curves.series.index(s) in points.series for s in self.turning.series)
        return layout.form(complete and bool(sums), has_margins)

    def reading_point(self, name: str, curves: Curves, design: Array, points: Points) -> int:
        """Return the number of the point at which one of the ``readings`` is taken; -1 if the design has none."""
        terms = _Layout(curves, points, design, self.scalars).upper(self.readings[name].parts[0])
        return next(iter(terms[0][0])) - len(points) if terms else -1

    def value(self, quantity: Measure, form: Form, curves: Curves, design: Array, atoms: Array) -> float:
        """Return the value of a measure in its own unit; nan if it does not exist."""
        layout = _Layout(curves, form.points, design, self.scalars)
        inner = [sum(w * atoms[k] for k, w in term.items()) + shift for term, shift in layout.upper(quantity)]
        return quantity.from_inner(float(max(inner))) if inner else math.nan


def _bound_shift(quantity: Measure, bound: float | None, allowance: Allowance | None, sense: float) -> BoundShift:
    """Return the change of a bound, in inner values, with its allowance; ``sense`` is +1 for a lower bound."""
    if bound is None or allowance is None:
        return NO_SHIFT
    step = DIFFERENCE * max(abs(bound), DIFFERENCE)
    rate = sense * (quantity.to_inner(bound + step) - quantity.to_inner(bound - step)) / (2.0 * step)
    slopes = {name: rate * float(s) for name, s in zip(allowance.names, allowance.slopes, strict=True) if s != 0.0}
    reference = dict(zip(allowance.names, allowance.reference.tolist(), strict=True))
    return slopes, sum(slope * reference[name] for name, slope in slopes.items())


def _label(r: Requirement, side: str, bound: float, size: float) -> Label:
    """Return the label of a limit's row; violations of pressure angles and margins are not divided by the bound."""
    angle_or_margin = r.measure.inner != "transmission" and any(s.scale for s in r.measure.series)
    return Label(r.measure.name, side, 1.0 if angle_or_margin else abs(bound) / size / r.measure.relative_slope(bound))


class _Layout:
    def __init__(self, curves: Curves, points: Points, design: Array, scalars: tuple[str, ...]) -> None:
        self.curves, self.points, self.scalars = curves, points, scalars
        self.design = design
        self.terms: list[Term] = []
        self.rows: list[tuple[float, float, bool, Label]] = []

    def add(
        self, term: Term, shift: float, weight: float, bound: float, slack: float, equal: bool, label: Label
    ) -> None:
        self.terms.append({k: weight * w for k, w in term.items()})
        self.rows.append((weight * shift + bound, slack, equal, label))

    def require(self, r: Requirement) -> bool:
        """Add the rows of one limit; return False if the design has no extremum of the limited output."""
        exists = True
        self._exclude_earlier_passages(r, "minimum" if r.maximum is None else "maximum")
        for bound, above in ((r.minimum, False), (r.maximum, True)):
            if bound is not None:
                side = "equal" if r.equal else "maximum" if above else "minimum"
                self.keep_sides(r.measure, bound, above, side, r.at_edges)
        sides = [("minimum", r.minimum, 1.0, r.lower_shift), ("maximum", r.maximum, -1.0, r.upper_shift)]
        for side, bound, sense, change in [("equal", r.minimum, 1.0, NO_SHIFT)] if r.equal else sides:
            if bound is None:
                continue
            sums, size = (self.lower if sense > 0.0 else self.upper)(r.measure), self._violation_scale(r, bound)
            exists = exists and bool(sums)
            for term, shift in sums[:1] if r.equal else self._shifted(sums, change):
                label = _label(r, side, bound, size)
                self.add(term, shift, sense / size, -sense * bound / size, 0.0, r.equal, label)
        return exists

    def _shifted(self, terms: list[tuple[Term, float]], change: BoundShift) -> list[tuple[Term, float]]:
        """Return the sums minus the shift of their bound."""
        offset = 2 * len(self.points)
        more = {offset + self.scalars.index(name): -slope for name, slope in change[0].items()}
        return [
            ({k: term.get(k, 0.0) + more.get(k, 0.0) for k in term | more}, shift + change[1]) for term, shift in terms
        ]

    def upper(self, m: Measure) -> list[tuple[Term, float]]:
        """Return sums of atoms such that the inner value is below a bound if and only if all sums are."""
        return self._sums(m, above=m.sign > 0.0)

    def lower(self, m: Measure) -> list[tuple[Term, float]]:
        """Return sums of atoms such that the inner value is above a bound if and only if all sums are."""
        return self._sums(m, above=m.sign < 0.0)

    def _sums(self, m: Measure, above: bool) -> list[tuple[Term, float]]:
        if m.kind == "minus":
            part = m.parts[0]
            return [({k: -w for k, w in t.items()}, -shift) for t, shift in (self.lower if above else self.upper)(part)]
        if m.numbers:
            return self._numbers(m, above)
        if m.kind == "difference":
            return self._difference(m, above)
        if m.kind == "phi_event":
            first, _ = self._passage(m.series[0])
            return [] if first is None else [({len(self.points) + first: 1.0}, self._turn_shift(first))]
        if m.kind == "stay":
            stay = self._stay(m)
            return [] if stay is None else stay.sums(above)
        maxima, minima = self._extrema(m.series)
        if m.kind in ("max", "min"):
            every = above == (m.kind == "max")
            extrema = maxima if m.kind == "max" else minima
            return [({k: m.sign}, 0.0) for k in (extrema if every else extrema[:1])]
        if m.kind in ("phi_max", "phi_min"):
            extrema = maxima if m.kind == "phi_max" else minima
            return [({len(self.points) + k: 1.0}, self._turn_shift(k)) for k in self._first_tie(extrema)]
        if m.kind in ("max_abs", "phi_max_abs"):
            value = self.points.value
            extrema = sorted([*maxima, *minima], key=lambda k: -self.points.sense[k] * value[k])
            if m.kind == "phi_max_abs":
                return [({len(self.points) + k: 1.0}, self._turn_shift(k)) for k in self._first_tie(extrema)]
            return [({k: float(self.points.sense[k])}, 0.0) for k in (extrema if above else extrema[:1])]
        if not maxima or not minima:
            return []
        if m.kind == "range":
            pairs = [(i, j) for i in maxima[:4] for j in minima[:4]]
            return [({i: 1.0, j: -1.0}, 0.0) for i, j in (pairs if above else pairs[:1])]
        sign = self._extension_sign(m.series[0].output)
        highest, lowest = self._first_tie(maxima)[0], self._first_tie(minima)[0]
        ext, fold = (highest, lowest) if sign > 0.0 else (lowest, highest)
        count, limit_points = len(self.points), {"ext": ext, "fold": fold}
        if m.kind in ("ext", "fold"):
            end = limit_points[m.kind]
            turns = math.ceil((float(self.points.value[end]) - math.pi) / math.tau) if m.series[0].wrapped else 0
            return [({end: 1.0}, -math.tau * turns)]
        if m.kind in ("phi_ext", "phi_fold"):
            end = limit_points[m.kind.removeprefix("phi_")]
            return [({count + end: 1.0}, self._turn_shift(end))]
        difference = self.points.phi[fold] - self.points.phi[ext]
        return [({count + fold: 1.0, count + ext: -1.0}, -m.cycle * math.floor(difference / m.cycle))]

    def _first_tie(self, extrema: list[int]) -> list[int]:
        """Return, as a list of one, the first of the equally high ends in the turn, which defines the place."""
        heights = np.abs(self.points.value)
        ties = [k for k in extrema if abs(heights[k] - heights[extrema[0]]) <= TIE * heights[extrema[0]]]
        start = self._turn_start(self.curves.series[self.points.series[extrema[0]]].output) if extrema else 0.0
        return sorted(ties, key=lambda k: float(self.points.phi[k] - start) % (2.0 * math.pi))[:1]

    def _turn_start(self, output: str) -> float:
        """Return the crank angle at which the turn of an output begins; a member on the shaft has its own phase."""
        family = self.curves.family
        member = family.split(output) if isinstance(family, Machine) else None
        if member is None or not member[0].alone or member[1] not in member[0].family.pose_output:
            return 0.0
        return -float(member[0].phase(self.design[None, :])[0])

    def _numbers(self, m: Measure, above: bool) -> list[tuple[Term, float]]:
        """Return sums of plain numbers, combined for a box with the ends of curves."""
        offset = 2 * len(self.points)
        if m.kind == "box":
            maxima, minima = ([(float(self.points.value[k]), k) for k in side] for side in self._extrema(m.series))
            return box_sums(m, maxima, minima, self.design, self.scalars, offset, above)
        return number_sums(m, self.design, self.curves.family.parameter_names, self.scalars, offset, above)

    def _difference(self, m: Measure, above: bool) -> list[tuple[Term, float]]:
        """Return the second angle minus the first, with whole turns that put it in (-pi, pi] at the present points."""
        angles = [self._sums(part, above)[:1] for part in m.parts]
        if not all(angles):
            return []
        (first, first_shift), (second, second_shift) = (end[0] for end in angles)
        count = len(self.points)
        difference = sum(w * self.points.phi[k - count] for k, w in second.items()) + second_shift
        difference -= sum(w * self.points.phi[k - count] for k, w in first.items()) + first_shift
        turns = 2.0 * math.pi * math.ceil((difference - math.pi) / (2.0 * math.pi))
        return [(second | {k: -w for k, w in first.items()}, second_shift - first_shift - turns)]

    def _passage(self, series: Series) -> tuple[int | None, list[int]]:
        indices = np.flatnonzero(self.points.series == self.curves.series.index(series)).tolist()
        return first_passage(self.points.phi, self.points.kind, indices)

    def _exclude_earlier_passages(self, r: Requirement, side: str) -> None:
        """Add rows that prevent earlier passages where an event is limited, since the event would jump to them."""
        for series in r.measure.series:
            if series.passes is None:
                continue
            level, sense = series.passes
            for k in self._passage(series)[1]:
                size = violation_scale(max(abs(level), 1e-3 * abs(self.points.value[k])))
                self.add({k: -sense}, 0.0, 1.0 / size, sense * level / size, 0.0, False, Label(r.measure.name, side))

    def _stay(self, m: Measure) -> Stay | None:
        """Return what a follower does in its window; None if it has no limit positions."""
        n = self.curves.series.index(m.series[0])
        low, high = self.curves.stroke(self.points, n)
        tops, bottoms = self._extrema([self.curves.series[self.curves.position[n]]])
        return None if low < 0 else Stay(self.points, n, m.series[0].window or (0.0, 1.0), (low, high), bottoms, tops)

    def keep_sides(self, m: Measure, bound: float | None, above: bool, side: str, margin: float = 0.0) -> None:
        """Keep tops and dips on their sides of a window's edges, as far as a bound of its angle, or the least, asks."""
        if m.kind == "minus":
            m, bound, above = m.parts[0], None if bound is None else -bound, not above
        stay = self._stay(m) if m.kind == "stay" else None
        for term, shift in [] if stay is None else stay.sides(bound, above, margin):
            self.add(term, shift, 1.0, 0.0, 0.0, False, Label(m.name, side, 0.0))

    def _extension_sign(self, position: str) -> float:
        """Return +1 if the extended position of the follower is the largest, -1 if it is the smallest."""
        family = self.curves.family
        sign = family.outward_sign(position)
        return float(self.design[family.parameter_names.index(sign)]) if sign else 1.0

    def _turn_shift(self, k: int) -> float:
        return -2.0 * math.pi * math.floor(float(self.points.phi[k]) / (2.0 * math.pi))

    def _extrema(self, series: Sequence[Series]) -> tuple[list[int], list[int]]:
        """Return the maxima of some series, highest first, and their minima, lowest first, as numbers of points."""
        series_numbers = [self.curves.series.index(s) for s in series]
        mask = np.isin(self.points.series, series_numbers)
        value, sense = self.points.value, self.points.sense
        maxima = sorted(np.flatnonzero(mask & (sense > 0)).tolist(), key=lambda k: -value[k])
        minima = sorted(np.flatnonzero(mask & (sense < 0)).tolist(), key=lambda k: value[k])
        return maxima, minima

    def _violation_scale(self, r: Requirement, bound: float) -> float:
        """Return the divisor of a limit's violations: its bound, unless that is tiny against the curve; 1 for margins.

        For a plain number, which has no curve, it is the larger of both bounds.
        """
        if r.measure.inner == "pressure":
            return 1.0 + bound  # sin^2 of the limit: a few degrees are as hard a limit as forty
        if any(s.scale for s in r.measure.series):
            return 1.0
        if r.measure.numbers:
            return violation_scale(max(abs(r.minimum or 0.0), abs(r.maximum or 0.0)))
        extrema = [k for side in self._extrema(r.measure.series) for k in side]
        amplitude = 1.0 if r.measure.is_angle else max((abs(self.points.value[k]) for k in extrema), default=0.0)
        return violation_scale(max(abs(bound), 1e-3 * amplitude))

    def form(self, complete: bool, has_margins: bool) -> Form:
        matrix = np.zeros((len(self.terms), 2 * len(self.points) + len(self.scalars)))
        for row, term in enumerate(self.terms):
            for k, weight in term.items():
                matrix[row, k] += weight
        constant, slack, equal, labels = (list(c) for c in zip(*self.rows, strict=True)) if self.rows else ([],) * 4
        return Form(
            self.points, self.scalars, matrix, np.array(constant, np.float64), np.array(slack, np.float64),
            np.array(equal, np.bool_), tuple(labels), complete, has_margins,
        )  # fmt: skip
