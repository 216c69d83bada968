"""A problem with a linear part as rows at fixed poses: values and exact gradients of many designs in one call.

The search in all variables follows the true extrema of one design.  Here 64 poses stand for the turn, and limits that
no pose output tells are left to that search, so that dozens of designs are looked at together.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.linear.minimax import minimax
from sweep.families.base import Angles, Array
from sweep.families.capabilities import Assembly
from sweep.optimise.extrema.points import STEP
from sweep.optimise.starts.linear import POSES, TURN, Elimination
from sweep.optimise.starts.parabolas import End, Turns
from sweep.optimise.starts.proportions import Proportions
from sweep.quantities.measures import ROTATABLE_MARGIN, Measure, measure

UNKNOWNS = 5  # the linear part: point, line and scale
UNIT = 4.0 / math.pi**2  # of the objective, in strokes: no motion there and back has less acceleration
PRICE = 6.0  # of a limit missed by its own size, in such units
DEVIATION = 1.0 / 30.0  # the same for the deviation, as a share: a straightness twice as coarse gains little
LOCKED = 1e6  # what a design is worth that does not turn
COMPLEX_TURN = Angles.of(TURN[None, :].astype(np.complex128))
REAL_TURN = Angles.of(TURN[None, :])


class Rows(NamedTuple):
    """Rows of k designs, each to be at least zero: values (k, r), gradients (k, r, m) and what t is in them (k,).

    The first ones are those of the objective, minus its magnitude in its own unit: they hold once t is added.
    """

    values: Array
    slopes: Array
    t: Array


@dataclass(frozen=True)
class _Curve:
    """``sign * output <= bound`` in units of ``size``: at every pose, where the output ends, or for its whole range.

    ``at`` is "every", "highest", "lowest" or "range".
    """

    output: str
    sign: float
    bound: float
    size: float
    at: str = "every"


@dataclass(frozen=True)
class _Part:
    """Rows of some curves: the pose outputs they need, and which of them go around a turn."""

    curves: tuple[_Curve, ...]
    outputs: frozenset[str]
    turns: Turns

    @classmethod
    def of(cls, curves: tuple[_Curve, ...], others: frozenset[str]) -> _Part:
        """Return the part of these curves; ``others`` are outputs that are needed beside theirs."""
        turns, r = [np.arange(POSES), np.arange(POSES, 2 * POSES)], 2 * POSES
        for curve in curves:
            count = POSES if curve.at == "every" else 1
            turns += [np.arange(r, r + count)] if count == POSES else []
            r += count
        return cls(curves, others | {curve.output for curve in curves}, Turns.of(np.array(turns)))


class PoseRows:
    """The rows of a problem at fixed poses, as functions of places between 0 and 1 and of the five linear unknowns.

    Parameters
    ----------
    linear : the linear part of the problem
    signs : values of the parameters that are not varied
    """

    def __init__(self, linear: Elimination, signs: dict[str, float]) -> None:
        self.linear, self.own = linear, Proportions(linear, signs, grown=True)
        self.family, problem = linear.problem.family, linear.problem
        self.unit = UNIT * linear.stroke
        self.price = PRICE * self.unit
        self.loops = {loop.discriminant: loop for loop in self.family.every(Assembly)}
        self.objective = linear.guide.across[linear.wanted] if linear.straight else linear.wanted
        off = linear.guide.across[linear.position]
        curves: list[_Curve] = [_Curve(name, -1.0, -ROTATABLE_MARGIN, 1.0) for name in self.loops]
        for limit in problem.limits:
            if not limit.output.startswith("rotatable"):
                found = measure(self.family, limit.output, problem.window)
                for bound, upper in ((limit.minimum, False), (limit.maximum, True)):
                    if bound is not None:
                        curves += _rows_of(found, found.to_inner(float(bound)), upper, off)
        basic = frozenset({self.objective, linear.position})
        self.whole = _Part.of(tuple(curves), basic)
        self.turns = self.whole.turns
        names = problem.family.parameter_names
        self.links = [names.index(name) for name in linear.links]
        self.fitted = [linear.column(n) for n in (*linear.guide.arms, linear.guide.direction, linear.guide.offset)]
        self.lengths = [
            (names.index(name), float(problem.lower[k]), float(problem.upper[k]))
            for name in linear.links
            for k in [problem.variables.index(name)]
        ]
        # Places of stage 1, those of them that may change their side, and that of the angle between the stages.
        self.driving = np.array([c < len(self.own.driver.parameters) for c in self.own.columns])
        own = self.own
        self.mirrored = self.driving & (own.low == -own.high)
        self.turning = own.columns.index(own.offset) if own.offset >= 0 else -1
        # Rows whose size is a length grow with the linear unknowns: they belong into the linear program.
        units = {o.name: o.unit for o in self.family.pose_outputs}
        grow = [c for c in curves if units[c.output] == "length" and c.output not in self.loops]
        self.mended = _Part.of(tuple(c for c in grow if c.at in ("every", "range")), basic)
        self._sort_rows()

    def _sort_rows(self) -> None:
        """Which rows of the linear part are bounds that may be missed, and which are needs."""
        soft: list[int] = []
        above: list[float] = []
        need: list[tuple[int, float]] = []
        r = 2 * POSES
        for curve in self.mended.curves:
            count = POSES if curve.at == "every" else 1
            if curve.at == "range" and curve.sign < 0.0:
                need.append((r, -curve.bound / curve.size))
            else:
                soft += range(r, r + count)
                above += [curve.bound / curve.size] * count
            r += count
        for _ in self.lengths:
            soft += [r, r + 1]
            above += [-1.0, 1.0]
            r += 2
        self.soft, self.above = np.array(soft, np.intp), np.array(above)
        self.needed = np.array([k for k, _ in need], np.intp)
        self.need = np.array([x for _, x in need])

    def without_middle(self, places: Array, sign: float = -1.0) -> Array:
        """Places with the offset between the stages itself for those with the middle of the guide's input angles."""
        out = places.copy()
        if self.turning >= 0:
            wide = self.own.high[self.turning] - self.own.low[self.turning]
            out[:, self.turning] += sign * self.own.middles(self.own.placed(places)) / wide
            out[:, self.turning] = self.wrapped(out)[:, self.turning]
        return out

    def wrapped(self, places: Array) -> Array:
        """Places (k, n) brought back between 0 and 1: an angle that has a whole turn by turns, the others to an end."""
        out = np.clip(places, 0.0, 1.0)
        if self.turning >= 0 and self.own.high[self.turning] - self.own.low[self.turning] >= 2.0 * math.pi - 1e-9:
            out[:, self.turning] = places[:, self.turning] % 1.0
        return out

    def with_middle(self, places: Array) -> Array:
        """Return the other way round."""
        return self.without_middle(places, 1.0)

    def designs(self, places: Array, x: Array) -> Array:
        """Designs (k, P) at places (k, n) with linear unknowns (k, 5)."""
        return self.linear.finished(self.own.placed(places), x)

    def tangents(self, places: Array, x: Array) -> Array:
        """Return derivatives (k, n + 5, P) of the designs by their places and linear unknowns."""
        own, ratios, n = self.own, self.own.placed(places), places.shape[1]
        out = np.zeros((len(places), n + UNKNOWNS, ratios.shape[1]))
        scale = np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2)
        wide = np.array([math.log(v / u) if w else 0.0 for u, v, w in zip(own.low, own.high, own.log, strict=True)])
        per = np.where(own.log, ratios[:, own.columns] * wide, own.high - own.low)
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

    def unknowns(self, places: Array) -> Array:
        """Return the linear unknowns (k, 5) that are best for some proportions, nan where nothing is."""
        return self.linear.unknowns(self.own.placed(places))

    def rows(self, places: Array, x: Array) -> Rows:
        """Rows of designs at places (k, n) with unknowns (k, 5), and their gradients by both."""
        return self._rows(places, x, self.tangents(places, x), self.whole)

    def _rows(self, places: Array, x: Array, tangents: Array, part: _Part) -> Rows:
        """Rows of a part, and their gradients along ``tangents`` (k, m, P)."""
        k, m = tangents.shape[:2]
        real = self.designs(places, x)
        designs = np.repeat(real, m, axis=0).astype(np.complex128)
        designs.imag = STEP * tangents.reshape(k * m, -1)
        with np.errstate(all="ignore"):  # what does not turn has nan, and is worth nothing
            found = self.family.poses(np.ascontiguousarray(designs), COMPLEX_TURN, part.outputs)
            columns = {name: found[name].real[::m] for name in part.outputs}
            moved = {name: found[name].imag.reshape(k, m, -1) / STEP for name in part.outputs}
            for name in part.outputs.intersection(self.loops):
                # Products of numpy's complex numbers depend on the processor, those of Python's do not.
                scale = self.loops[name].scale(designs.astype(object)).astype(np.complex128).reshape(k, m, 1)
                columns[name] = columns[name] / scale.real[:, 0]
                moved[name] = (moved[name] - columns[name][:, None] * (scale.imag / STEP)) / scale.real
            ends = self._ends(columns, part)
            values = np.concatenate(self._pieces(columns, real, ends, 1.0, part), axis=1)
            turned = {name: moved[name].reshape(k * m, -1) for name in part.outputs}
            every = {name: (high.repeated(m), low.repeated(m)) for name, (high, low) in ends.items()}
            pieces = self._pieces(turned, tangents.reshape(k * m, -1), every, 0.0, part)
        slopes = np.ascontiguousarray(np.concatenate(pieces, axis=1).reshape(k, m, -1).transpose(0, 2, 1))
        sharp = part.turns.sharpened(values, slopes)
        return Rows(sharp, slopes, -sharp[:, : 2 * POSES].min(axis=1))

    def solved(self, places: Array, x: Array) -> Array:
        """Return the best linear unknowns (k, 5) of some proportions,
        limits that bend taken for straight about ``x``.
        """
        own = self.tangents(places, x)[:, places.shape[1] :]
        slopes = self._rows(places, x, own, self.mended).slopes
        k = len(places)
        bound = np.repeat(np.stack([np.full(len(self.above), np.inf), self.above])[None], k, axis=0)
        found, t, v = np.empty((k, UNKNOWNS)), np.empty(k), np.empty(k)
        status = np.empty(k, np.uint8)
        wanted, others, needed = (
            np.ascontiguousarray(part) for part in (-slopes[:, :POSES], -slopes[:, self.soft], slopes[:, self.needed])
        )
        need = np.repeat(self.need[None], k, axis=0)
        minimax(wanted, others, needed, bound, need, self.price, found, t, v, status)
        return np.where((status == st.OK)[:, None], found, x)

    def worth(self, places: Array, x: Array) -> Array:
        """Objective plus what missed limits cost (k,), the smaller the better."""
        return self.judged(self.values(places, x))

    def begun(self, places: Array) -> tuple[Array, Array]:
        """Return the best linear unknowns (k, 5) of some proportions, and what the designs are worth (k,)."""
        x = self.unknowns(places)
        known, worth = np.asarray(np.isfinite(x).all(axis=1), np.bool_), np.full(len(places), np.inf)
        x = np.where(known[:, None], x, 1.0)
        worth[known] = self.worth(places[known], x[known])
        return x, worth

    def values(self, places: Array, x: Array) -> Array:
        """Values of the rows (k, r), those of the objective for t = 0."""
        designs = self.designs(places, x)
        with np.errstate(all="ignore"):
            found = self.family.poses(np.ascontiguousarray(designs), REAL_TURN, self.whole.outputs)
            columns = {name: np.asarray(found[name], np.float64) for name in self.whole.outputs}
            for name, loop in self.loops.items():
                columns[name] = columns[name] / loop.scale(designs)[:, None]
            return self.turns.sharpened(
                np.concatenate(self._pieces(columns, designs, self._ends(columns, self.whole), 1.0, self.whole), axis=1)
            )

    def judged(self, values: Array) -> Array:
        """Return what designs with such values are worth (k,): see :meth:`worth`."""
        own, others = values[:, : 2 * POSES], values[:, 2 * POSES :]
        worth = self.price * np.maximum(-others.min(axis=1), 0.0) - own.min(axis=1)
        margins = others[:, : len(self.loops) * POSES].min(axis=1, initial=1.0)
        turns = np.isfinite(worth) & (margins > 0.0)
        return np.asarray(np.where(turns, worth, LOCKED * (2.0 - np.maximum(np.nan_to_num(margins, nan=-1e3), -1e3))))

    def _ends(self, columns: Mapping[str, Array], part: _Part) -> dict[str, tuple[End, End]]:
        """Where outputs are highest and lowest, of those whose ends are limited."""
        limited = {curve.output for curve in part.curves if curve.at != "every"}
        return {name: (End.of(-columns[name]), End.of(columns[name])) for name in limited}

    def _pieces(
        self,
        columns: Mapping[str, Array],
        designs: Array,
        ends: Mapping[str, tuple[End, End]],
        one: float,
        part: _Part,
    ) -> list[Array]:
        """Return the rows (k, .) one limit after the other, those of the objective first, of outputs and designs.

        They are linear: with ``one`` zero, derivatives of outputs and designs give those of the rows.
        """
        own = columns[self.objective]
        out = [-own, own]
        for curve in part.curves:
            y = columns[curve.output]
            if curve.at != "every":
                high, low = (end.value(y) for end in ends[curve.output])
                y = {"highest": high, "lowest": low, "range": high - low}[curve.at][:, None]
            out.append((one * curve.bound - curve.sign * y) / curve.size)
        for column, least, most in self.lengths:
            out.append((designs[:, column] / least - one)[:, None])
            out.append((one - designs[:, column] / most)[:, None])
        return out


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
            curves.append(_Curve(series.output, side, side * bound, own, "range"))
        elif found.kind == "max_abs":
            curves += [_Curve(series.output, sign, bound, own) for sign in (1.0, -1.0)] if upper else []
        else:
            every = (side * found.sign > 0.0) == (found.kind == "max")
            at = "every" if every else "highest" if found.kind == "max" else "lowest"
            curves.append(_Curve(series.output, side * found.sign, side * bound, own, at))
    return curves
