"""A problem with a linear part as rows at fixed poses: values and exact gradients of many designs in one call.

The search in all variables follows the true extrema of one design.  Here 64 poses stand for the turn, and limits that
no pose output tells are left to that search, so that dozens of designs are looked at together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.curves.sampled_rows import EVERY, HIGHEST, LOWEST, RANGE, sampled_rows
from kernels.linear.minimax import minimax
from sweep.families.base import Angles, Array
from sweep.families.capabilities import Assembly
from sweep.optimise.extrema.points import STEP
from sweep.optimise.starts.linear import POSES, TURN, Elimination
from sweep.optimise.starts.proportions import Index, Proportions
from sweep.quantities.measures import ROTATABLE_MARGIN, Measure, measure

UNKNOWNS = 5  # the linear part: point, line and scale
UNIT = 4.0 / math.pi**2  # of the objective, in strokes: no motion there and back has less acceleration
PRICE = 6.0  # of a limit missed by its own size, in such units
DEVIATION = 1.0 / 30.0  # the same for the deviation, as a share: a straightness twice as coarse gains little
LOCKED = 1e6  # what a design is worth that does not turn
TOGETHER = 16  # designs whose gradients are computed in one go: their poses stay in the cache
COMPLEX_TURN = Angles.of(TURN[None, :].astype(np.complex128))
REAL_TURN = Angles.of(TURN[None, :])


class Rows(NamedTuple):
    """Rows of k designs, each to be at least zero: values (k, r), gradients (k, r, m) and what t is in them (k,).

    The first ones are those of the objective, minus its magnitude in its own unit: they hold once t is added.
    """

    values: Array
    slopes: Array
    t: Array


class _Curve(NamedTuple):
    """``sign * output <= bound`` in units of ``size``: at every pose, where the output ends, or for its whole range."""

    output: str
    sign: float
    bound: float
    size: float
    at: int = EVERY


class _Length(NamedTuple):
    """Bounds of a length, by its column."""

    column: int
    least: float
    most: float


class _Part:
    """Rows of some limits: the pose outputs they need, and which of the rows are curves around a turn."""

    def __init__(self, curves: Sequence[_Curve], lengths: Sequence[_Length], others: Sequence[str] = ()) -> None:
        self.lengths = lengths
        self.outputs = tuple(dict.fromkeys([*others, *(curve.output for curve in curves)]))
        self.which = np.array([self.outputs.index(curve.output) for curve in curves])
        self.at = np.array([curve.at for curve in curves])
        self.signs = np.array([curve.sign for curve in curves])
        self.bounds = np.array([curve.bound for curve in curves])
        self.sizes = np.array([curve.size for curve in curves])
        ends = np.cumsum(np.where(self.at == EVERY, POSES, 1))
        self.of_curves = int(ends[-1])
        self.count = self.of_curves + 2 * len(lengths)
        self.turns = np.array([np.arange(end - POSES, end) for end in ends[self.at == EVERY]])

    def values(self, found: Mapping[str, Array], designs: Array, moved: Array | None, slopes: Array | None) -> Array:
        """Rows (k, r) of designs (k, P) with these pose outputs; their gradients (k, r, m) where asked for."""
        out = np.empty((len(designs), self.count))
        curves = np.stack([found[name] for name in self.outputs])
        sampled_rows(curves, moved, self.which, self.at, self.signs, self.bounds, self.sizes, out, slopes)
        for k, length in enumerate(self.lengths):
            x, r = designs[:, length.column], self.of_curves + 2 * k
            out[:, r], out[:, r + 1] = x / length.least - 1.0, 1.0 - x / length.most
        return out


class PoseRows:
    """The rows of a problem at fixed poses, as functions of proportions and of the five linear unknowns.

    Proportions (k, P) are designs as :meth:`sweep.optimise.starts.proportions.Proportions.placed` makes them.

    Parameters
    ----------
    linear : the linear part of the problem
    signs : combinations of the parameters that are not varied
    """

    def __init__(self, linear: Elimination, signs: Sequence[dict[str, float]]) -> None:
        self.linear, self.own = linear, Proportions(linear, signs, grown=True)
        self.family, problem = linear.problem.family, linear.problem
        self.unit = UNIT * linear.stroke
        self.price = PRICE * self.unit
        self.scales: dict[str, Callable[[Array], Array]] = {
            loop.discriminant: loop.scale for loop in self.family.every(Assembly)
        }
        objective = linear.guide.across[linear.wanted] if linear.straight else linear.wanted
        off = linear.guide.across[linear.position]
        first = [_Curve(objective, sign, 0.0, 1.0) for sign in (1.0, -1.0)]
        curves: list[_Curve] = [_Curve(name, -1.0, -ROTATABLE_MARGIN, 1.0) for name in self.scales]
        for limit in problem.limits:
            if not limit.output.startswith("rotatable"):
                found = measure(self.family, limit.output, problem.window)
                for bound, upper in ((limit.minimum, False), (limit.maximum, True)):
                    if bound is not None:
                        curves += _rows_of(found, found.to_inner(float(bound)), upper, off)
        names = problem.family.parameter_names
        lengths = [
            _Length(names.index(name), float(problem.lower[k]), float(problem.upper[k]))
            for name in linear.links
            for k in [problem.variables.index(name)]
        ]
        self.whole = _Part([*first, *curves], lengths)
        self.turns = self.whole.turns
        self.links = [names.index(name) for name in linear.links]
        self.fitted = [linear.column(n) for n in (*linear.guide.arms, linear.guide.direction, linear.guide.offset)]
        # Places of stage 1, those of them that may change their side, and that of the angle between the stages.
        own = self.own
        self.driving = np.array([c < len(own.driver.parameters) for c in own.columns])
        self.mirrored = self.driving & (own.low == -own.high)
        self.turning = own.columns.index(own.offset) if own.offset >= 0 else -1
        # Rows whose size is a length grow with the linear unknowns: they belong into the linear program.
        units = {o.name: o.unit for o in self.family.pose_outputs}
        grow = [c for c in curves if units[c.output] == "length" and c.output not in self.scales]
        grow = [c for c in grow if c.at in (EVERY, RANGE)]
        self.mended = _Part([*first, *grow], lengths)
        self._sort_rows(grow)

    def _sort_rows(self, grow: Sequence[_Curve]) -> None:
        """Which rows of the linear part are bounds that may be missed, and which are needs."""
        soft: list[int] = []
        above: list[float] = []
        need: list[tuple[int, float]] = []
        r = 2 * POSES
        for curve in grow:
            count = POSES if curve.at == EVERY else 1
            if curve.at == RANGE and curve.sign < 0.0:
                need.append((r, -curve.bound / curve.size))
            else:
                soft += range(r, r + count)
                above += [curve.bound / curve.size] * count
            r += count
        for _ in self.mended.lengths:
            soft += [r, r + 1]
            above += [-1.0, 1.0]
            r += 2
        self.soft, self.above = np.array(soft, np.intp), np.array(above)
        self.needed = np.array([k for k, _ in need], np.intp)
        self.need = np.array([x for _, x in need])

    def without_middle(self, places: Array, kinds: Index, sign: float = -1.0) -> Array:
        """Places with the offset between the stages itself for those with the middle of the guide's input angles."""
        out = places.copy()
        if self.turning >= 0:
            wide = self.own.high[self.turning] - self.own.low[self.turning]
            out[:, self.turning] += sign * self.own.middles(self.own.placed(places, kinds)) / wide
            out[:, self.turning] = self.wrapped(out)[:, self.turning]
        return out

    def wrapped(self, places: Array) -> Array:
        """Places (k, n) brought back between 0 and 1: an angle that has a whole turn by turns, the others to an end."""
        out = np.clip(places, 0.0, 1.0)
        if self.turning >= 0 and self.own.high[self.turning] - self.own.low[self.turning] >= 2.0 * math.pi - 1e-9:
            out[:, self.turning] = places[:, self.turning] % 1.0
        return out

    def with_middle(self, places: Array, kinds: Index) -> Array:
        """Return the other way round."""
        return self.without_middle(places, kinds, 1.0)

    def tangents(self, ratios: Array, x: Array) -> Array:
        """Return derivatives (k, n + 5, P) of the designs by their places and linear unknowns."""
        own, n = self.own, len(self.own.columns)
        out = np.zeros((len(ratios), n + UNKNOWNS, ratios.shape[1]))
        scale = np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2)
        per = np.where(own.log, ratios[:, own.columns] * own.wide, own.high - own.low)
        # X + iY = conj(z1) z2 times the coupler's length over the scale is the point.
        along, aside, line, offset = self.fitted
        dot, cross = x[:, 2] * x[:, 0] + x[:, 3] * x[:, 1], x[:, 3] * x[:, 0] - x[:, 2] * x[:, 1]
        arm = ratios[:, self.links[1]] / scale
        for k, column in enumerate(own.columns):
            out[:, k, column] = per[:, k] * (scale if column in self.links else 1.0)
            if column == self.links[1]:
                out[:, k, along], out[:, k, aside] = dot * per[:, k] / scale, cross * per[:, k] / scale
        for k in (0, 1):
            grows = x[:, k] / scale
            out[:, n + k, self.links] = ratios[:, self.links] * grows[:, None]
            out[:, n + k, along] = (x[:, 2 + k] - dot * grows / scale) * arm
            out[:, n + k, aside] = ((x[:, 3] if k == 0 else -x[:, 2]) - cross * grows / scale) * arm
            out[:, n + k, line] = (x[:, 1] if k == 0 else -x[:, 0]) / (scale * scale)
            out[:, n + 2 + k, along] = x[:, k] * arm
            out[:, n + 2 + k, aside] = (-x[:, 1] if k == 0 else x[:, 0]) * arm
        out[:, n + 4, offset] = 1.0
        return out

    def rows(self, ratios: Array, x: Array) -> Rows:
        """Rows of proportions (k, P) with unknowns (k, 5), and their gradients by places and unknowns."""
        return self._rows(ratios, x, self.tangents(ratios, x), self.whole)

    def _rows(self, ratios: Array, x: Array, tangents: Array, part: _Part) -> Rows:
        """Rows of a part, and their gradients along ``tangents`` (k, m, P)."""
        k, m = tangents.shape[:2]
        real = self.linear.finished(ratios, x)
        values, slopes = np.empty((k, part.count)), np.empty((k, part.count, m))
        for begin in range(0, k, TOGETHER):
            some = slice(begin, begin + TOGETHER)
            values[some] = self._of_some(real[some], tangents[some], part, slopes[some])
        for j, length in enumerate(part.lengths):
            r, along = part.of_curves + 2 * j, tangents[:, :, length.column]
            slopes[:, r], slopes[:, r + 1] = along / length.least, -along / length.most
        return Rows(values, slopes, -values[:, : 2 * POSES].min(axis=1))

    def _of_some(self, real: Array, tangents: Array, part: _Part, slopes: Array) -> Array:
        """Rows (k, r) of designs (k, P), their gradients written into ``slopes`` (k, r, m), those of lengths aside."""
        k, m = tangents.shape[:2]
        designs: Any = np.repeat(real, m, axis=0).astype(np.complex128)
        designs.imag = STEP * tangents.reshape(k * m, -1)
        columns, moved = {}, np.empty((len(part.outputs), k, m, POSES))
        with np.errstate(all="ignore"):  # what does not turn has nan, and is worth nothing
            found: dict[str, Any] = self.family.poses(designs, COMPLEX_TURN, frozenset(part.outputs))
            for j, name in enumerate(part.outputs):
                if name in self.scales:
                    found[name] = found[name] / self.scales[name](designs)[:, None]
                columns[name] = found[name].real[::m]
                np.divide(found[name].imag.reshape(k, m, POSES), STEP, out=moved[j])
            return part.values(columns, real, moved, slopes)

    def solved(self, ratios: Array, x: Array) -> Array:
        """Return the best linear unknowns (k, 5) of some proportions,
        limits that bend taken for straight about ``x``.
        """
        own = self.tangents(ratios, x)[:, len(self.own.columns) :]
        slopes = self._rows(ratios, x, own, self.mended).slopes
        k = len(ratios)
        bound = np.repeat(np.stack([np.full(len(self.above), np.inf), self.above])[None], k, axis=0)
        found, t, v = np.empty((k, UNKNOWNS)), np.empty(k), np.empty(k)
        status = np.empty(k, np.uint8)
        wanted, others, needed = (
            np.ascontiguousarray(part) for part in (-slopes[:, :POSES], -slopes[:, self.soft], slopes[:, self.needed])
        )
        need = np.repeat(self.need[None], k, axis=0)
        minimax(wanted, others, needed, bound, need, self.price, found, t, v, status)
        return np.where((status == st.OK)[:, None], found, x)

    def begun(self, places: Array, kinds: Index) -> tuple[Array, Array]:
        """Return the best linear unknowns (k, 5) of some places, and what the designs are worth (k,)."""
        ratios = self.own.placed(places, kinds)
        x = self.linear.unknowns(ratios)
        known, worth = np.asarray(np.isfinite(x).all(axis=1), np.bool_), np.full(len(places), np.inf)
        x = np.where(known[:, None], x, 1.0)
        worth[known] = self.worth(ratios[known], x[known])
        return x, worth

    def worth(self, ratios: Array, x: Array) -> Array:
        """Objective plus what missed limits cost (k,), the smaller the better."""
        return self.judged(self.values(ratios, x))

    def values(self, ratios: Array, x: Array) -> Array:
        """Values of the rows (k, r), those of the objective for t = 0."""
        designs = self.linear.finished(ratios, x)
        with np.errstate(all="ignore"):
            found: dict[str, Any] = self.family.poses(designs, REAL_TURN, frozenset(self.whole.outputs))
            for name, scale in self.scales.items():
                found[name] = found[name] / scale(designs)[:, None]
            return self.whole.values(found, designs, None, None)

    def judged(self, values: Array) -> Array:
        """Return what designs with such values are worth (k,): see :meth:`worth`."""
        own, others = values[:, : 2 * POSES], values[:, 2 * POSES :]
        worth = self.price * np.maximum(-others.min(axis=1), 0.0) - own.min(axis=1)
        margins = others[:, : len(self.scales) * POSES].min(axis=1, initial=1.0)
        turns = np.isfinite(worth) & (margins > 0.0)
        return np.asarray(np.where(turns, worth, LOCKED * (2.0 - np.maximum(np.nan_to_num(margins, nan=-1e3), -1e3))))


def _rows_of(found: Measure, bound: float, upper: bool, deviation: str) -> list[_Curve]:
    """Rows for one side of a limit, in inner values; none where poses do not tell."""
    if found.kind not in ("max", "min", "max_abs", "range"):
        return []
    side = 1.0 if upper else -1.0
    size = 1.0 + bound if found.inner == "pressure" else max(abs(bound), ROTATABLE_MARGIN)
    curves = []
    for series in found.series:
        own = size / DEVIATION if series.output == deviation else size
        if found.kind == "range":
            curves.append(_Curve(series.output, side, side * bound, own, RANGE))
        elif found.kind == "max_abs":
            curves += [_Curve(series.output, sign, bound, own) for sign in (1.0, -1.0)] if upper else []
        else:
            every = (side * found.sign > 0.0) == (found.kind == "max")
            at = EVERY if every else HIGHEST if found.kind == "max" else LOWEST
            curves.append(_Curve(series.output, side * found.sign, side * bound, own, at))
    return curves
