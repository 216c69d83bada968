"""What is linear, eliminated: coupler point, line and scale of a guide behind a crank-rocker, for given proportions.

With B the crank pin of the guide and d the direction of its coupler, both complex, and one length as unit,

    s + i dev = z1 B + z2 d - i h,      z1 = scale e^{-i lam},  z2 = scale (xi + i eta) e^{-i lam}

so displacement, deviation and all their derivatives are linear in five numbers.  The least largest acceleration, with a
straightness and a stroke prescribed, is a small linear program (kernels/linear/minimax.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from statistics import NormalDist
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.linear.minimax import minimax
from sweep.families.base import Angles, Array
from sweep.families.capabilities import GuidedPoint
from sweep.families.chain import driven_guide
from sweep.optimise.manufacture.curve_margins import curve_derivatives
from sweep.optimise.manufacture.tolerance import SIGMAS, touched
from sweep.optimise.problem.statement import Problem

if TYPE_CHECKING:
    from sweep.study import Tolerance

POSES = 64  # per turn on which the linear program sees the motion
SPREAD_AT = 2  # every second pose tells what tolerances do: that changes slowly along the turn
PASSES = 2  # of solving with the room that the tolerances of the solution before need
EXCESS = 0.5  # price of a deviation twice as large as allowed, in strokes
SMALLEST = 1e-9  # scale of a guide that has any
DIRECTIONS = 3  # in which the least scale of a guide is asked for
BOTH = 4.0  # a deviation misses its limit on either side, and in two places that know little of each other
TURN: Array = np.arange(POSES, dtype=np.float64) * (2.0 * np.pi / POSES)
NEEDED = (
    "a chain of rssr and guide without a window, whose guide's crank, point and line vary ([fit]), with a lower limit "
    "of the stroke and max_abs_ds, max_abs_d2s or max_abs_dev to be made small"
)


@dataclass(frozen=True)
class Elimination:
    """The linear part of a problem.

    ``wanted`` is the output along the line that is to be small (that across it where ``straight``), ``bound`` the
    largest deviation or None, ``stroke`` the least one, ``driver`` the output of the crank-rocker.  ``sigma``, (P,),
    are standard deviations of what is made, and the limits on deviation and stroke shall hold ``level`` of them away.
    """

    problem: Problem
    guide: GuidedPoint
    last: str
    driver: str
    wanted: str
    straight: bool
    bound: float | None
    stroke: float
    sigma: Array | None = None
    level: float = 0.0

    @cached_property
    def free(self) -> tuple[str, ...]:
        """Variables that remain: all but the point, the line and one length of the guide, which is its unit."""
        out = {f"{name}{self.last}" for name in (*self.guide.fitted, self.guide.links[0])}
        return tuple(name for name in self.problem.variables if name not in out)

    @cached_property
    def links(self) -> tuple[str, ...]:
        """Lengths of the guide that grow with its scale."""
        return tuple(f"{name}{self.last}" for name in self.guide.links)

    @cached_property
    def position(self) -> str:
        """The output along the line."""
        return next(iter(self.guide.across))

    def column(self, name: str) -> int:
        """Column of a parameter of the guide."""
        return self.problem.family.parameter_names.index(f"{name}{self.last}")

    def solve(self, designs: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Finish designs (n, P): their point, line and scale are replaced by the best ones.

        Returns
        -------
        designs (n, P), the objective with what a too large deviation costs (n,), and whether there is a solution (n,).
        """
        motion, bounds, need, least, price = self._posed(designs)
        bound = float(bounds.max(initial=0.0))
        x, t, v = _minimised(motion, bounds, need, least, price)
        out = self.finished(designs, x)
        if self.sigma is not None and self.bound is not None:
            for _ in range(PASSES):
                across, along = self._margins(out, motion)
                x, t, v = _minimised(motion, bounds - across, need + along, least, price)
                out = self.finished(designs, x)
            # What counts is the room that this solution needs, not the one before.
            across, along = self._margins(out, motion)
            off = np.abs((motion.across * x[:, None, :]).sum(axis=2)) + across - bound
            v = np.maximum(off.max(axis=1), 0.0)
            t = t * (1.0 + np.maximum(need + along - (motion.ends * x).sum(axis=1), 0.0) / self.stroke)
        return out, t + price * v, np.isfinite(t + v) & np.isfinite(out).all(axis=1)

    def unknowns(self, designs: Array) -> Array:
        """Return the best z1, z2 and h (n, 5) of designs as they are drawn, nan where there is no solution."""
        x, t, _ = _minimised(*self._posed(designs))
        return np.asarray(np.where(np.isfinite(t)[:, None], x, np.nan), np.float64)

    def _posed(self, designs: Array) -> tuple[_Motion, Array, Array, Array, float]:
        """Return the linear programs of designs: motion, bounds, needs,
        least scales and the price of a missed bound.
        """
        base = designs.copy()
        base[:, [self.column(name) for name in self.guide.fitted]] = 0.0
        motion = self._motion(base)
        bound = 1e3 * self.stroke if self.bound is None else self.bound
        bounds, need = np.full(motion.across.shape[:2], bound), np.full(len(designs), self.stroke)
        return motion, bounds, need, self._least_scale(base), EXCESS * self.stroke / bound

    def _motion(self, base: Array) -> _Motion:
        """Return what is linear in the unknowns, of designs without point and line."""
        beside = base.copy()
        # The coupler's length as the arm keeps the columns of one size.
        beside[:, self.column(self.guide.arms[0])] = base[:, self.column(self.guide.links[1])]
        s, names = self.position, self.guide.across
        wanted = frozenset({s, names[s], self.wanted, names[self.wanted], self.driver})
        found, moved = (self.problem.family.poses(x, Angles.of(TURN[None, :]), wanted) for x in (base, beside))
        rows = [self._rows(found, moved, *which) for which in ((self.wanted, self.straight), (s, True), (s, False))]
        number = np.arange(len(base))
        high, low = np.argmax(found[self.driver], axis=1), np.argmin(found[self.driver], axis=1)
        across = rows[1][:, :: 1 if self.bound is not None else POSES]
        return _Motion(rows[0], np.ascontiguousarray(across), rows[2][number, high] - rows[2][number, low], high, low)

    def _rows(self, base: Any, beside: Any, name: str, across: bool) -> Array:
        """Coefficients (n, m, 5) of an output along the line, or of the one across it, of (z1, z2, h)."""
        other = self.guide.across[name]
        bx, by = base[name], base[other]
        dx, dy = beside[name] - bx, beside[other] - by
        zero = np.zeros_like(bx)
        offset = zero - 1.0 if name == self.position else zero
        rows = [by, bx, dy, dx, offset] if across else [bx, -by, dx, -dy, zero]
        return np.ascontiguousarray(np.stack(rows, axis=2))

    def finished(self, designs: Array, x: Array) -> Array:
        """Return designs (n, P) with the point, line and scale that belong to the unknowns (n, 5)."""
        scale: Array = np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2)
        scale[scale < SMALLEST] = np.nan  # a guide without size is no solution, and its poses are undefined
        along, aside, line, offset = (
            self.column(n) for n in (*self.guide.arms, self.guide.direction, self.guide.offset)
        )
        grown = designs[:, self.column(self.guide.links[1])] / scale
        out = designs.copy()
        for name in self.guide.links:
            out[:, self.column(name)] *= scale
        # numpy's arctan2 depends on the processor, that of the C library does not
        lam = np.array([math.atan2(-y, x) for x, y in x[:, :2].tolist()])
        out[:, along] = (x[:, 2] * x[:, 0] + x[:, 3] * x[:, 1]) * grown
        out[:, aside] = (x[:, 3] * x[:, 0] - x[:, 2] * x[:, 1]) * grown
        out[:, offset], out[:, line] = x[:, 4], self.turned(lam)
        return out

    def turned(self, lam: Array) -> Array:
        """Return the direction as an angle within its bounds, if one of its turns is."""
        name = f"{self.guide.direction}{self.last}"
        if name not in self.problem.variables:
            return lam
        k = self.problem.variables.index(name)
        middle = 0.5 * (self.problem.lower[k] + self.problem.upper[k])
        return np.asarray(lam - 2.0 * np.pi * np.round((lam - middle) / (2.0 * np.pi)), np.float64)

    def _least_scale(self, designs: Array) -> Array:
        """Scale (n,) at which the last of the guide's lengths reaches its lower bound."""
        problem = self.problem
        least = np.zeros(len(designs))
        for name in self.links:
            if name in problem.variables:
                low = float(problem.lower[problem.variables.index(name)])
                length = np.abs(designs[:, problem.family.parameter_names.index(name)])
                least = np.maximum(least, max(low, 0.0) / length)
        return least

    def _margins(self, designs: Array, motion: _Motion) -> tuple[Array, Array]:
        """CurveMargin that the tolerances need: of the deviation at every pose (n, m), of the stroke (n,)."""
        if self.sigma is None:
            return np.zeros(motion.across.shape[:2]), np.zeros(len(designs))
        off, s = self.guide.across[self.position], self.position
        found = curve_derivatives(self.problem.family, designs, self.sigma, (off, s), TURN[::SPREAD_AT])
        seen = np.sqrt((found[off] ** 2).sum(axis=1))
        between = 0.5 * (seen + np.roll(seen, -1, axis=1))
        across = np.stack([seen, between], axis=2).reshape(len(designs), -1)
        number, high, low = np.arange(len(designs)), motion.high // SPREAD_AT, motion.low // SPREAD_AT
        ends = found[s][number, :, high] - found[s][number, :, low]
        return self.level * across, self.level * np.sqrt((ends**2).sum(axis=1))


class _Motion(NamedTuple):
    """Coefficients of the unknowns: of what is to be small and of the deviation (n, m, 5), of the stroke (n, 5).

    ``high`` and ``low``, (n,), are the poses at the ends of the stroke.
    """

    wanted: Array
    across: Array
    ends: Array
    high: NDArray[np.intp]
    low: NDArray[np.intp]


def _minimised(motion: _Motion, bounds: Array, need: Array, least: Array, price: float) -> tuple[Array, Array, Array]:
    """Unknowns (n, 5), largest of what is wanted and by how much the bounds are missed, nan where there is no solution.

    That the guide is at least so large is a bound on the modulus of z1 from below, which no linear program knows.  It
    is asked for in the direction that z1 has without it, then in the one it has with it.
    """
    n = len(need)
    rows, needs = np.zeros((n, 2, 5)), np.zeros((n, 2))
    rows[:, 0], needs[:, 0] = motion.ends, need
    x, t, v = np.empty((n, 5)), np.empty(n), np.empty(n)
    own, both = np.arange(n), np.repeat(bounds[:, None, :], 2, axis=1)
    for _ in range(DIRECTIONS):
        some, value, missed = np.empty((len(own), 5)), np.empty(len(own)), np.empty(len(own))
        status = np.empty(len(own), np.uint8)
        minimax(motion.wanted[own], motion.across[own], rows[own], both[own], needs[own], price,
                some, value, missed, status)  # fmt: skip
        x[own], t[own], v[own] = some, np.where(status == st.OK, value, np.nan), missed
        scale = np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2)
        # nan is not less; a guide without any size has no direction
        own = np.flatnonzero((scale < (1.0 - 1e-6) * least) & (scale > 0.0))
        if not len(own):
            break
        rows[own, 1, :2] = x[own, :2] / scale[own, None]
        needs[own, 1] = least[own]
    return x, t, v


def elimination(problem: Problem, tolerance: Tolerance | None = None) -> Elimination | None:
    """Return the linear part of a problem, or None where it has none.

    With a ``tolerance`` that has a share, the limits on deviation and stroke are to hold for what is made.
    """
    stages = driven_guide(problem.family)
    if stages is None or problem.window is not None or problem.coordinates is not None:
        return None
    before, last = stages[0], str(stages[1].number)
    guide = stages[1].family.find(GuidedPoint)
    if guide is None or not {f"{name}{last}" for name in (*guide.fitted, guide.links[0])} <= set(problem.variables):
        return None
    off = next(iter(guide.across.values()))
    small = {f"max_abs_{name}": name for name in list(guide.across)[1:]} | {f"max_abs_{off}": next(iter(guide.across))}
    limits = {limit.output: limit for limit in problem.limits}
    stroke, deviation = limits.get("stroke"), limits.get(f"max_abs_{off}")
    if problem.objective not in small or stroke is None or not stroke.minimum:
        return None
    bound = None if deviation is None else deviation.maximum
    share = None if tolerance is None else tolerance.robust
    sigma, level = None, 0.0
    if tolerance is not None and share is not None:
        sigma, level = touched(problem.family, tolerance) / SIGMAS, NormalDist().inv_cdf(1.0 - (1.0 - share) / BOTH)
    driver = f"{before.family.position}{before.number}"
    return Elimination(
        problem, guide, last, driver, small[problem.objective], problem.objective == f"max_abs_{off}", bound,
        float(stroke.minimum), sigma, level,
    )  # fmt: skip
