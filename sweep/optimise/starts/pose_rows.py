"""A problem with a linear part for compiled descents: rows at fixed poses, as functions of places and linear unknowns.

The search in all variables tracks the true extrema of one design.  Here 64 poses stand for the turn, and limits that
these curves do not give are left to that search (:mod:`kernels.descent`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple, TypeVar

import numpy as np

from kernels.curves.sampled_rows import EVERY, HIGHEST, LOWEST, RANGE, Limits
from kernels.descent.descents import BOX, LEAST, LOCKED, RADIUS, descend, initial_merits
from kernels.descent.program import reset_curvature
from kernels.descent.rows import (
    ACROSS,
    ALONG,
    ANGLE,
    FIRST_MARGIN,
    HIGH,
    LOW,
    POINT_X,
    POINT_Y,
    UNKNOWNS,
    Task,
)
from kernels.descent.unknowns import OBJECTIVE, OMITTED, REQUIRED, SOFT
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array
from sweep.families.capabilities import Assembly
from sweep.numerics.records import Indices
from sweep.optimise.starts.linear import POSES, TURN, Elimination
from sweep.quantities.measures import ROTATABLE_MARGIN, Measure, measure

T = TypeVar("T")

SHORT = 0.15  # shortest initial length of a guide, relative to the longest that its crank may have
MIDDLE = Accuracy(target=1e-3)
BLOCK = 256  # places that a thread evaluates together
UNIT = 4.0 / math.pi**2  # unit of the objective, in strokes: no reciprocating motion has less acceleration
PRICE = 6.0  # price of a limit violated by its own size, in such units
DEVIATION = 1.0 / 30.0  # price of the deviation as a share of PRICE: a straightness twice as coarse gains little
NARROW = 0.1  # factor on the size of the position's limits with margins, which its band may not hold
FREE = 1e3  # bound on a deviation without a limit, in strokes


class _CurveRow(NamedTuple):
    """Row ``sign * output <= bound`` in units of ``size``: at every pose, at an end of the output, or for its range."""

    output: str
    sign: float
    bound: float
    size: float
    at: int = EVERY


class PoseRows:
    """Rows of a problem at fixed poses, as functions of places between 0 and 1 and of five linear unknowns.

    Parameters
    ----------
    linear : the linear part of the problem
    signs : combinations of the parameters that are not varied
    """

    def __init__(self, linear: Elimination, signs: Sequence[dict[str, float]]) -> None:
        self.linear, problem = linear, linear.problem
        self.family, names = problem.family, problem.family.parameter_names
        self.driver = self.family.stages[0].family
        self.bases = np.array([problem.rows(problem.lower + 0.5 * problem.span, **choice)[0] for choice in signs])
        self.bases[:, names.index(linear.links[0])] = 1.0
        self.columns = [names.index(name) for name in linear.free]
        self._bounds()
        # Masks of the variables of stage 1 and of those with symmetric bounds; index of the angle between stages.
        self.driving = np.array([c < len(self.driver.parameters) for c in self.columns])
        self.mirrored = self.driving & (self.low == -self.high)
        offset = f"offset{linear.last}"
        self.offset = linear.free.index(offset) if offset in linear.free else -1
        self.limits = self._limits()
        self.task = self._task(self.limits)

    def _bounds(self) -> None:
        """Set ``low`` and ``high`` (n,), the ends of places, and ``log_width``, the logarithmic width of lengths.

        Lengths of the guide are relative to its crank, which is the unit.  They and positive lengths of stage 1 are on
        a logarithmic scale.
        """
        problem, links = self.linear.problem, self.linear.links
        indices = [problem.variables.index(name) for name in self.linear.free]
        self.low, self.high = problem.lower[indices].astype(np.float64), problem.upper[indices].astype(np.float64)
        self.log_width = np.zeros(len(indices))
        units, unit = {p.name: p.unit for p in self.family.parameters}, problem.variables.index(links[0])
        for k, name in enumerate(self.linear.free):
            if units[name] == "angle" and self.high[k] - self.low[k] >= 2.0 * math.pi:
                self.low[k], self.high[k] = -math.pi, math.pi
            # A frame of opposite sign is the same guide, rotated by half a turn.
            if name in links:
                shortest = max(self.low[k], problem.upper[unit] * SHORT)
                self.low[k] = shortest / problem.upper[unit]
                self.high[k] /= max(problem.lower[unit], problem.upper[unit] * SHORT)
            if name in links or (units[name] == "length" and self.low[k] > 0.0):
                self.log_width[k] = math.log(self.high[k] / self.low[k])

    def placed(self, places: Array, kinds: Indices) -> Array:
        """Return designs (k, P) at places (k, n), of kinds (k,), without the point, line and scale of the guide."""
        values: Array = self.low + places * (self.high - self.low)
        logarithmic = self.log_width != 0.0
        # numpy's exponential depends on the processor, the C library's does not
        scales = [math.exp(x) for x in (places[:, logarithmic] * self.log_width[logarithmic]).ravel().tolist()]
        values[:, logarithmic] = self.low[logarithmic] * np.reshape(scales, (len(places), int(logarithmic.sum())))
        designs = self.bases[kinds]
        designs[:, self.columns] = values
        return designs

    def input_range(self, places: Array, kinds: Indices) -> tuple[Array, Array]:
        """Return middle and range (k,) of the guide's input angles without offset; 0 if stage 1 does not turn."""
        upstream = np.ascontiguousarray(self.placed(places, kinds)[:, : len(self.driver.parameters)])
        outputs = design_outputs(self.driver, upstream, ("psi_ext", "swing"), MIDDLE)
        swing = np.asarray(outputs["swing"], np.float64)
        middle = np.asarray(outputs["psi_ext"], np.float64) + 0.5 * swing
        return np.nan_to_num(middle), np.nan_to_num(np.abs(swing))

    def _codes(self) -> dict[str, int]:
        """Return the kernels' codes of curves by their names."""
        linear = self.linear
        margins = [loop.discriminant for loop in self.family.every(Assembly)]
        codes = dict(zip(margins, (FIRST_MARGIN, FIRST_MARGIN + 1), strict=True))
        codes |= {linear.driver: ANGLE, f"x_m{linear.last}": POINT_X, f"y_m{linear.last}": POINT_Y}
        for order, (along, across) in enumerate(linear.guide.across.items()):
            codes |= {along: ALONG + 2 * order, across: ACROSS + 2 * order}
        return codes

    def _limits(self) -> list[_CurveRow]:
        """Return the rows: the objective with both signs, rotatability, then the limits that these curves give."""
        linear, codes = self.linear, self._codes()
        wanted = linear.guide.across[linear.wanted] if linear.straight else linear.wanted
        deviation = linear.guide.across[linear.position]
        curves = [_CurveRow(wanted, sign, 0.0, 1.0) for sign in (1.0, -1.0)]
        curves += [_CurveRow(name, -1.0, -ROTATABLE_MARGIN, 1.0) for name, code in codes.items() if code < ANGLE]
        for limit in linear.problem.limits:
            if not limit.output.startswith("rotatable"):
                quantity = measure(self.family, limit.output, linear.problem.window)
                for bound, upper in ((limit.minimum, False), (limit.maximum, True)):
                    if bound is not None:
                        curves += _rows_of(quantity, quantity.to_inner(float(bound)), upper, deviation)
        if linear.sigma is not None:
            curves = [c._replace(size=NARROW * c.size) if c.output == linear.position else c for c in curves]
        return [curve for curve in curves if curve.output in codes]

    def _task(self, curves: Sequence[_CurveRow]) -> Task:
        linear, problem, codes = self.linear, self.linear.problem, self._codes()
        curve_codes = [codes[curve.output] for curve in curves]
        if linear.sigma is not None:
            # Margins for tolerances widen the deviation on either side.
            for k in range(2, len(curves)):
                if curve_codes[k] == ACROSS and curves[k].at == EVERY:
                    curve_codes[k] = HIGH if curves[k].sign > 0.0 else LOW
        used = list(dict.fromkeys(curve_codes))
        ends = np.cumsum([POSES if curve.at == EVERY else 1 for curve in curves])
        firsts = ends - np.array([POSES if curve.at == EVERY else 1 for curve in curves])
        names = problem.family.parameter_names
        own = [problem.variables.index(name) for name in linear.links if name in problem.variables]
        lengths = [names.index(problem.variables[k]) for k in own]
        kinds = np.full(ends[-1] + 2 * len(lengths), SOFT, np.int64)
        for k, curve in enumerate(curves):
            rows, least = slice(firsts[k], ends[k]), curve.at == RANGE and curve.sign < 0.0
            straight = curve_codes[k] > ANGLE and curve.at in (EVERY, RANGE)
            kinds[rows] = OBJECTIVE if k < 2 else OMITTED if not straight else REQUIRED if least else SOFT
        strokes = [k for k in range(2, len(curves)) if curve_codes[k] == ALONG and curves[k].at == RANGE]
        unit = UNIT * linear.stroke
        return Task(
            np.ascontiguousarray(self.bases), np.array(self.columns), self.low, self.high, self.log_width,
            np.cos(TURN), np.sin(TURN), np.array(used),
            Limits(
                np.array([used.index(code) for code in curve_codes]), np.array([curve.at for curve in curves]),
                np.array([curve.sign for curve in curves]), np.array([curve.bound for curve in curves]),
                np.array([curve.size for curve in curves]),
            ),
            np.array(lengths, np.int64), problem.lower[own].astype(np.float64), problem.upper[own].astype(np.float64),
            np.array([np.arange(e - POSES, e) for e, curve in zip(ends, curves, strict=True) if curve.at == EVERY]),
            kinds, firsts[strokes], np.array([curves[k].size for k in strokes]),
            FREE * linear.stroke if linear.bound is None else linear.bound, linear.stroke, unit, PRICE * unit,
            np.empty(0) if linear.sigma is None else linear.level * linear.sigma,
        )  # fmt: skip

    def without_middle(self, places: Array, kinds: Indices, sign: float = -1.0) -> Array:
        """Return places with the offset between the stages in place of the middle of the guide's input angles."""
        out = places.copy()
        if self.offset >= 0:
            width = self.high[self.offset] - self.low[self.offset]
            out[:, self.offset] += sign * self.input_range(places, kinds)[0] / width
            out[:, self.offset] = self.wrapped(out)[:, self.offset]
        return out

    def wrapped(self, places: Array) -> Array:
        """Return places (..., n) between 0 and 1: an angle of a whole turn is wrapped, other variables are clipped."""
        out = np.clip(places, 0.0, 1.0)
        if self.offset >= 0 and self.high[self.offset] - self.low[self.offset] >= 2.0 * math.pi - 1e-9:
            out[..., self.offset] = places[..., self.offset] % 1.0
        return out

    def with_middle(self, places: Array, kinds: Indices) -> Array:
        """Return places with the middle of the guide's input angles in place of the offset between the stages."""
        return self.without_middle(places, kinds, 1.0)

    def finished(self, places: Array, kinds: Indices, x: Array) -> Array:
        """Return designs (k, P) at places (k, n) with the linear unknowns (k, 5)."""
        return self.linear.finished(self.placed(places, kinds), x)

    def initial(self, places: Array, kinds: Indices, jobs: int = 1) -> tuple[Array, Array]:
        """Return the best linear unknowns (k, 5) of some places, and the values of the designs (k,)."""
        x, merit = np.empty((len(places), UNKNOWNS)), np.empty(len(places))

        def evaluate(part: slice) -> None:
            initial_merits(self.task, kinds[part], places[part], x[part], merit[part])

        in_threads(evaluate, [slice(k, k + BLOCK) for k in range(0, len(places), BLOCK)], jobs)
        return x, merit


class Descents:
    """Descents from many places; ``merit`` (k,) are their present values.

    Parameters
    ----------
    rows : rows of the problem
    places : (k, n) starts of the descents, between 0 and 1
    kinds : (k,) number of each start's combination of signs
    jobs : number of threads; the descents are independent
    """

    def __init__(self, rows: PoseRows, places: Array, kinds: Indices, jobs: int = 1) -> None:
        self.rows, self.places, self.kinds, self.jobs = rows, places.copy(), kinds, jobs
        self.x, merit = rows.initial(self.places, kinds, jobs)
        k, n = places.shape
        self.states = np.stack([merit, np.where(merit < LOCKED, RADIUS, 0.0), np.full(k, np.inf), np.zeros(k)], axis=1)
        self.curvature = np.empty((k, n + UNKNOWNS, n + UNKNOWNS))
        for matrix in self.curvature:
            reset_curvature(matrix)

    @property
    def merit(self) -> Array:
        """Present value of each descent."""
        return self.states[:, 0]

    def keep(self, numbers: Indices) -> None:
        """Continue only the descents with these numbers."""
        for name in ("places", "kinds", "x", "states", "curvature"):
            setattr(self, name, getattr(self, name)[numbers])

    def advance(self, steps: int, stop: Callable[[], bool] = lambda: False) -> None:
        """Take ``steps`` steps of all descents that have not converged."""

        def descend_one(k: int) -> None:
            if not stop():
                arrays = self.places[k], self.x[k], self.states[k], self.curvature[k]
                descend(self.rows.task, self.kinds[k], *arrays, steps)

        in_threads(descend_one, np.flatnonzero(self.states[:, BOX] > LEAST).tolist(), self.jobs)


def in_threads(task: Callable[[T], None], parts: Iterable[T], jobs: int) -> None:
    """Call compiled work, which releases Python's lock, for each part in threads."""
    with ThreadPoolExecutor(jobs) as threads:
        for _ in threads.map(task, parts):
            pass


def _rows_of(quantity: Measure, bound: float, upper: bool, deviation: str) -> list[_CurveRow]:
    """Return the rows for one side of a limit, in inner values; none if poses do not give them."""
    if quantity.kind not in ("max", "min", "max_abs", "range"):
        return []
    side = 1.0 if upper else -1.0
    size = 1.0 + bound if quantity.inner == "pressure" else max(abs(bound), ROTATABLE_MARGIN)
    curves = []
    for series in quantity.series:
        curve_size = size / DEVIATION if series.output == deviation else size
        if quantity.kind == "range":
            curves.append(_CurveRow(series.output, side, side * bound, curve_size, RANGE))
        elif quantity.kind == "max_abs":
            curves += [_CurveRow(series.output, sign, bound, curve_size) for sign in (1.0, -1.0)] if upper else []
        else:
            everywhere = (side * quantity.sign > 0.0) == (quantity.kind == "max")
            at = EVERY if everywhere else HIGHEST if quantity.kind == "max" else LOWEST
            curves.append(_CurveRow(series.output, side * quantity.sign, side * bound, curve_size, at))
    return curves
