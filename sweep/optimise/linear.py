"""What is linear, eliminated: coupler point, line and scale of a guide behind a crank-rocker, for given proportions.

With B the crank pin of the guide and d the direction of its coupler, both complex, and one length as unit,

    s + i dev = z1 B + z2 d - i h,      z1 = scale e^{-i lam},  z2 = scale (xi + i eta) e^{-i lam}

so displacement, deviation and all their derivatives are linear in five numbers.  The least largest acceleration, with a
straightness and a stroke prescribed, is a small linear program (kernels/minimax.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.minimax import minimax
from sweep.families.base import Accuracy, Angles, Array
from sweep.families.chain import Chain, driven_guide
from sweep.optimise.problem import Problem

if TYPE_CHECKING:
    from sweep.study import Limit

POSES = 64  # per turn on which the linear program sees the motion
ACCURACY = Accuracy(samples=POSES)  # of what is not linear: pressure angles, the box of the coupler point
# Pairs of outputs along and across the line, by what is limited or to be made small.
LINEAR = {"max_abs_ds": "ds", "max_abs_d2s": "d2s", "max_abs_d3s": "d3s", "max_abs_dev": "dev"}
ACROSS = {"s": "dev", "ds": "ddev", "d2s": "d2dev"}
SOLVED = ("xi", "eta", "lam", "h")
SCALED = ("a", "b", "c", "e")
EXCESS = 0.5  # price of a deviation twice as large as allowed, in strokes
WEIGHT = 3.0  # price of a limit missed by its own size, in strokes
DIRECTIONS = 3  # in which the least scale of a guide is asked for
STUCK = 1e6  # above every objective: does not turn
NEEDED = (
    "a chain of rssr and guide without a window, whose guide's crank, point and line vary ([fit]), with a lower limit "
    "of the stroke and max_abs_ds, max_abs_d2s, max_abs_d3s or max_abs_dev to be made small"
)


@dataclass(frozen=True)
class Elimination:
    """The linear part of a problem.

    ``wanted`` is the output along the line that is to be small (``dev`` across it), ``bound`` the largest deviation or
    None, ``stroke`` the least one.
    """

    problem: Problem
    wanted: str
    bound: float | None
    stroke: float
    last: str
    driver: str

    @cached_property
    def free(self) -> tuple[str, ...]:
        """Variables that remain: all but the point, the line and one length of the guide, which is its unit."""
        out = {f"{name}{self.last}" for name in (*SOLVED, "a")}
        return tuple(name for name in self.problem.variables if name not in out)

    def solve(self, designs: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Finish designs (n, P): their point, line and scale are replaced by the best ones.

        Returns
        -------
        designs (n, P), the objective with what a too large deviation costs (n,), and whether there is a solution (n,).
        """
        column = {name: k for k, name in enumerate(self.problem.family.parameter_names)}
        at = {name: column[f"{name}{self.last}"] for name in (*SOLVED, *SCALED)}
        base = designs.copy()
        base[:, [at[name] for name in SOLVED]] = 0.0
        beside = base.copy()
        # The guide's own length as the arm keeps the columns of one size.
        size: Array = base[:, at["b"]].astype(np.float64)
        beside[:, at["xi"]] = size
        turn: Array = np.arange(POSES, dtype=np.float64) * (2.0 * np.pi / POSES)
        along = {"dev": "s"}.get(self.wanted, self.wanted)
        names = frozenset({"s", "dev", along, ACROSS.get(along, "dev"), self.driver})
        found, moved = (self.problem.family.poses(x, Angles.of(turn[None, :]), names) for x in (base, beside))
        g = _rows(found, moved, along, self.wanted == "dev")
        d = _rows(found, moved, "s", True)[:, :: 1 if self.bound is not None else POSES]
        s = _rows(found, moved, "s", False)
        number = np.arange(len(designs))
        ends = s[number, np.argmax(found[self.driver], axis=1)] - s[number, np.argmin(found[self.driver], axis=1)]
        bound = 1e3 * self.stroke if self.bound is None else self.bound
        price = EXCESS * self.stroke / bound
        x, worth, known = self._minimised(g, d, ends, np.full(d.shape[:2], bound), self._least_scale(base), price)
        scale: Array = np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2)
        # numpy's arctan2 and complex products depend on the processor, the C library's arctan2 does not
        lam = np.array([math.atan2(-y, x) for x, y in x[:, :2]])
        xi = (x[:, 2] * x[:, 0] + x[:, 3] * x[:, 1]) * (size / scale)
        eta = (x[:, 3] * x[:, 0] - x[:, 2] * x[:, 1]) * (size / scale)
        out = designs.copy()
        for name in SCALED:
            out[:, at[name]] *= scale
        out[:, at["xi"]], out[:, at["eta"]], out[:, at["h"]] = xi, eta, x[:, 4]
        out[:, at["lam"]] = self._turned(lam)
        return out, worth, known

    def _minimised(
        self, g: Array, d: Array, ends: Array, bound: Array, least_scale: Array, price: float
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Unknowns (n, 5), objective with what is missed, and whether there is a solution.

        That the guide is at least so large is a bound on the modulus of z1 from below, which no linear program knows.
        It is asked for in the direction that z1 has without it, then in the one it has with it.
        """
        n = len(g)
        rows, need = np.zeros((n, 2, 5)), np.zeros((n, 2))
        rows[:, 0], need[:, 0] = ends, self.stroke
        x, worth, known = np.empty((n, 5)), np.empty(n), np.empty(n, np.bool_)
        own = np.arange(n)
        for _ in range(DIRECTIONS):
            some, t, v, status = (
                np.empty((len(own), 5)),
                np.empty(len(own)),
                np.empty(len(own)),
                np.empty(len(own), np.uint8),
            )
            minimax(g[own], d[own], rows[own], bound[own], need[own], price, some, t, v, status)
            x[own], worth[own], known[own] = some, t + price * v, status == st.OK
            scale = np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2)
            own = np.flatnonzero(known & (scale < (1.0 - 1e-6) * least_scale))
            if not len(own):
                break
            rows[own, 1, :2] = x[own, :2] / scale[own, None]
            need[own, 1] = least_scale[own]
        return x, worth, known

    def _least_scale(self, designs: Array) -> Array:
        """Scale (n,) at which the last of the guide's lengths reaches its lower bound."""
        names, problem = self.problem.family.parameter_names, self.problem
        least = np.zeros(len(designs))
        for name in (f"{name}{self.last}" for name in SCALED):
            if name in problem.variables:
                low = float(problem.lower[problem.variables.index(name)])
                least = np.maximum(least, max(low, 0.0) / np.abs(designs[:, names.index(name)]))
        return least

    def _turned(self, lam: Array) -> Array:
        """The direction as an angle within its bounds, if one of its turns is."""
        name = f"lam{self.last}"
        if name not in self.problem.variables:
            return lam
        k = self.problem.variables.index(name)
        middle = 0.5 * (self.problem.lower[k] + self.problem.upper[k])
        return np.asarray(lam - 2.0 * np.pi * np.round((lam - middle) / (2.0 * np.pi)), np.float64)

    def merit(self, designs: Array) -> tuple[Array, Array]:
        """Finished designs (n, P), and the objective plus what missed limits cost (n,), the smaller the better."""
        from sweep.chunks.cascade import compared
        from sweep.evaluation.summaries import design_outputs

        family = self.problem.family
        names = family.parameter_names
        done = ("stroke", "max_abs_dev")
        limits = [x for x in self.problem.limits if not x.output.startswith(("rotatable", *done))]
        margins = [f"margin{stage.number}" for stage in family.stages] if isinstance(family, Chain) else []
        first = [x for x in limits if x.output.rstrip("0123456789") in ("max_pressure_angle", "swing", "margin")]
        wanted = list(dict.fromkeys([*margins, *(x.output for x in first)]))
        columns = design_outputs(family, designs, wanted, ACCURACY, self.problem.window)
        margin = np.min([np.nan_to_num(columns[name], nan=-1e3) for name in margins], axis=0)
        merit = STUCK * (2.0 - margin)
        turns = np.flatnonzero(margin > 0.0)
        missed = np.zeros(len(designs))
        for limit in first:
            missed += _missed(limit, compared(limit.output, np.asarray(columns[limit.output], np.float64)))
        finished, least, solved = self.solve(designs[turns])
        own = missed[turns]
        rest = [x for x in limits if x not in first]
        columns = {n: finished[:, k] for k, n in enumerate(names)}
        if any(x.output not in names for x in rest):
            outputs = [x.output for x in rest if x.output not in names]
            columns |= design_outputs(family, finished, outputs, ACCURACY, self.problem.window)
        for limit in rest:
            own = own + _missed(limit, compared(limit.output, np.asarray(columns[limit.output], np.float64)))
        out = np.full(designs.shape, np.nan)
        out[turns] = finished
        own = own + self._outside(finished)
        merit[turns] = np.where(solved, least + WEIGHT * self.stroke * own, STUCK)
        return out, merit

    def _outside(self, designs: Array) -> Array:
        """How far lengths of the guide lie outside their bounds, relative to them (n,)."""
        missed = np.zeros(len(designs))
        names = self.problem.family.parameter_names
        for name in SCALED:
            full = f"{name}{self.last}"
            if full in self.problem.variables:
                k = self.problem.variables.index(full)
                values, high = designs[:, names.index(full)], self.problem.upper[k]
                missed += np.maximum(values - high, 0.0) / abs(high)
                missed += np.maximum(self.problem.lower[k] - values, 0.0) / max(abs(self.problem.lower[k]), 1e-9)
        return missed


def _rows(base: Any, beside: Any, name: str, across: bool) -> Array:
    """Coefficients (n, m, 5) of an output along the line, or of the deviation, of (z1, z2, h)."""
    other = ACROSS[name]
    bx, by = base[name], base[other]
    dx, dy = beside[name] - bx, beside[other] - by
    zero = np.zeros_like(bx)
    rows = [by, bx, dy, dx, zero - 1.0] if across else [bx, -by, dx, -dy, zero]
    return np.ascontiguousarray(np.stack(rows, axis=2))


def _missed(limit: Limit, value: Array) -> Array:
    size = max(abs(limit.minimum or 0.0), abs(limit.maximum or 0.0)) or 1.0
    low = -math.inf if limit.minimum is None else limit.minimum
    high = math.inf if limit.maximum is None else limit.maximum
    return np.nan_to_num(np.maximum(np.maximum(low - value, value - high), 0.0) / size, nan=1e3)


def elimination(problem: Problem) -> Elimination | None:
    """The linear part of a problem, or None where it has none."""
    family = problem.family
    stages = driven_guide(family)
    if stages is None or problem.window is not None:
        return None
    before, last = stages[0], str(stages[1].number)
    limits = {limit.output: limit for limit in problem.limits}
    stroke, deviation = limits.get("stroke"), limits.get("max_abs_dev")
    needed = {f"{name}{last}" for name in (*SOLVED, "a")}
    if problem.objective not in LINEAR or stroke is None or not stroke.minimum or problem.coordinates is not None:
        return None
    if not needed <= set(problem.variables):
        return None
    bound = None if deviation is None else deviation.maximum
    driver = f"{before.family.position}{before.number}"
    return Elimination(problem, LINEAR[problem.objective], bound, float(stroke.minimum), last, driver)
