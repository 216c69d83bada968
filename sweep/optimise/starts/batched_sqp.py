"""Many descents abreast: sequential quadratic programs at fixed poses, the linear part solved anew after every step."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.linear.nearest import nearest_of_many
from sweep.families.base import Array
from sweep.optimise.local.least_squares import BEND, FLAT
from sweep.optimise.starts.linear import POSES
from sweep.optimise.starts.pose_rows import LOCKED, UNKNOWNS, PoseRows
from sweep.optimise.starts.proportions import Index

RADIUS, LARGEST, LEAST = 0.1, 0.3, 1e-6  # of the first box about a place, of any, of one that has come to rest
SPENT = 1e-6  # gain promised, as a share of the objective, at which a descent has come to rest
RENEWED = 1e-5  # gain since it came to rest before, as a share of the objective, after which it begins anew
EXACT = 1e-11  # distance by which the point nearest to the centre may miss a row
NEAR = 0.15  # rows further from their bound join the quadratic program only where its step would miss them
JOINED, MISSED = 6, 1e-6  # times that they may, and what is no miss
CORRECTIONS = 3  # of a step that rows bend away from: without them a valley of 0.015 mm is crossed in steps of 1e-3
SOFT, LINEAR = 1.0, 1e-2  # curvature to begin with, of the places and of the linear unknowns
TRUSTED, GOOD = 0.1, 0.6  # share of the promised gain below which the box shrinks, and above which it grows
REACH = 10.0  # of the linear unknowns in one step, in units of their size and of the radius
OBJECTIVE = 2 * POSES  # rows, the first ones
DAMPED = 0.2  # least curvature along a step, as a share of what was believed (Powell 1978)


class _Program(NamedTuple):
    """A quadratic program in the step, in t and in the violation, but for the values of its rows.

    ``linear`` (n, r) are its rows, ``back`` leads from the axes of the curvature, where its objective is the distance
    from ``centre``, to the step.  ``low`` and ``high`` are the ends of the box; ``per`` are the units of the rows,
    ``size`` those of the step.
    """

    linear: Array
    back: Array
    centre: Array
    low: Array
    high: Array
    per: Array
    size: Array


class _Known(NamedTuple):
    """Rows of one design, for t = 0, their gradients, the t they need, and its place and linear unknowns."""

    values: Array
    slopes: Array
    t: float
    varied: Array


class _Trial(NamedTuple):
    """A design that a descent may go on from: its worth, place and linear unknowns, and the values of its rows."""

    worth: float
    place: Array
    x: Array
    values: Array


@dataclass
class _Step:
    """A step of a descent on its way: what it promises, the best design so far, and how often it may be corrected."""

    program: _Program
    step: Array
    weights: Array
    promised: float
    best: _Trial | None = None
    corrections: int = CORRECTIONS


class BatchedSqp:
    """Descents from many places; ``worth`` (k,) is what each has reached, ``looks`` counts designs with gradients.

    They advance together, whatever each of them does at the moment, so that their designs are looked at in one call.

    Parameters
    ----------
    rows : the problem
    places : (k, n) where they begin, between 0 and 1
    kinds : (k,) the signs of each
    """

    def __init__(self, rows: PoseRows, places: Array, kinds: Index) -> None:
        self.rows, self.places, self.kinds = rows, places.copy(), kinds
        self.x, self.worth = rows.begun(self.places, kinds)
        k, n = places.shape
        self.radius: Array = np.where(self.worth < LOCKED, RADIUS, 0.0)
        self.rested: Array = np.full(k, np.inf)
        self.soft = np.diag([SOFT] * n + [LINEAR] * UNKNOWNS)
        self.curvature = np.repeat(self.soft[None], k, axis=0)
        self.known: list[_Known | None] = [None] * k
        self.memory: list[tuple[_Known, Array] | None] = [None] * k
        self.programs: list[_Program | None] = [None] * k
        self.looks = 0

    def keep(self, numbers: NDArray[np.intp]) -> None:
        """Go on with some of the descents only."""
        for name in ("places", "kinds", "x", "worth", "radius", "rested", "curvature"):
            setattr(self, name, getattr(self, name)[numbers])
        self.memory = [self.memory[k] for k in numbers]
        self.known = [self.known[k] for k in numbers]
        self.programs = [self.programs[k] for k in numbers]

    def advance(self, steps: int, stop: Callable[[], bool] = lambda: False) -> None:
        """So many steps of all descents that have not come to rest."""
        left = np.where(self.radius > LEAST, steps, 0)
        under: dict[int, _Step] = {}
        while left.any() and not stop():
            moving = np.flatnonzero(left).tolist()
            self._look([k for k in moving if self.known[k] is None])
            under |= {k: self._begun(k) for k in moving if k not in under and self.radius[k] > LEAST}
            for k, trial in self._tried({k: step.step for k, step in under.items()}).items():
                if not self._corrected(k, under[k], trial):
                    self._taken(k, under.pop(k))
                    left[k] -= 1
            left[self.radius <= LEAST] = 0

    def _look(self, new: list[int]) -> None:
        """Rows and gradients where a descent has moved, and what its curvature learns from them."""
        if not new:
            return
        found = self.rows.rows(self._ratios(new, self.places[new]), self.x[new])
        self.looks += len(new)
        for j, k in enumerate(new):
            if not np.isfinite(found.slopes[j]).all():
                self.radius[k] = 0.0
                continue
            here = _Known(found.values[j], found.slopes[j], float(found.t[j]), self._varied(k))
            self.known[k] = here
            memory = self.memory[k]
            if memory is not None:
                before, weights = memory
                held = np.flatnonzero(weights)
                size = _size(before.varied)
                change = weights[held] @ (before.slopes[held] - here.slopes[held]) * size
                self.curvature[k] = _learnt(self.curvature[k], (here.varied - before.varied) / size, change)
                self.memory[k] = None
            self.programs[k] = None

    def _ratios(self, own: list[int], places: Array) -> Array:
        return self.rows.own.placed(places, self.kinds[own])

    def _varied(self, k: int) -> Array:
        return np.concatenate([self.places[k], self.x[k]])

    def _begun(self, k: int) -> _Step:
        """Begin a step of a descent where it stands."""
        program = self._prepared(k)
        return _Step(program, *self._solved(k, program, self._here(k).values))

    def _corrected(self, k: int, under: _Step, trial: _Trial) -> bool:
        """Look at the design that a step leads to; whether its rows bend away and the step is to be tried anew."""
        if under.best is not None and not trial.worth < under.best.worth:
            return False
        under.best = trial
        enough = not self.worth[k] - trial.worth < GOOD * under.promised
        if enough or not trial.worth < LOCKED or not under.corrections:
            return False
        here = self._here(k)
        moved = np.concatenate([trial.place, trial.x]) - here.varied
        under.step = self._solved(k, under.program, trial.values - here.slopes @ moved)[0]
        under.corrections -= 1
        return True

    def _here(self, k: int) -> _Known:
        here = self.known[k]
        assert here is not None
        return here

    def _tried(self, steps: dict[int, Array]) -> dict[int, _Trial]:
        """Designs that steps lead to, with their own linear unknowns or the best ones of their proportions."""
        if not steps:
            return {}
        own, n = list(steps), self.places.shape[1]
        step = np.array(list(steps.values()))
        places = np.clip(self.places[own] + step[:, :n], 0.0, 1.0)
        ratios, x = self._ratios(own, places), self.x[own] + step[:, n:]
        solved = self.rows.solved(ratios, x)
        both = [self.rows.values(ratios, u) for u in (solved, x)]
        worth = [self.rows.judged(values) for values in both]
        found = {}
        for j, k in enumerate(own):
            w = 0 if worth[0][j] <= worth[1][j] else 1
            found[k] = _Trial(float(worth[w][j]), places[j], (solved, x)[w][j], both[w][j])
        return found

    def _taken(self, k: int, under: _Step) -> None:
        """Go to a design that gains; the box grows or shrinks with what has become of the promise."""
        trial, promised, weights = under.best, under.promised, under.weights
        if trial is None:
            self.radius[k] = 0.0
            return
        gain, length = float(self.worth[k]) - trial.worth, float(np.abs(trial.place - self.places[k]).max())
        if gain > 0.0:
            self.memory[k] = (self._here(k), weights)
            self.places[k], self.x[k], self.worth[k], self.known[k] = trial.place, trial.x, trial.worth, None
        if gain < TRUSTED * promised:
            self.radius[k] = 0.5 * (self.radius[k] if gain > 0.0 else min(self.radius[k], length))
        elif gain > GOOD * promised:
            self.radius[k] = min(2.0 * self.radius[k], LARGEST)
        if promised <= SPENT * abs(self.worth[k]):
            self.radius[k] = 0.0
        if self.radius[k] <= LEAST and self.rested[k] - self.worth[k] > RENEWED * abs(self.worth[k]):
            self._renew(k)

    def _renew(self, k: int) -> None:
        """Begin anew where a descent has come to rest: curvature once learnt may promise less than there is."""
        self.rested[k], self.radius[k], self.memory[k] = self.worth[k], RADIUS, None
        self.curvature[k], self.programs[k] = self.soft, None

    def _prepared(self, k: int) -> _Program:
        """Return the quadratic program of a descent's next step, but for the values of its rows."""
        here, program = self._here(k), self.programs[k]
        if program is None:
            program = self.programs[k] = self._without_box(k)
        reach = np.full(UNKNOWNS, REACH * self.radius[k])
        ends = [-here.t / self.rows.unit, 0.0]
        low = np.concatenate([np.maximum(-self.radius[k], -self.places[k]), -reach, ends])
        high = np.concatenate([np.minimum(self.radius[k], 1.0 - self.places[k]), reach])
        return program._replace(low=low, high=high)

    def _without_box(self, k: int) -> _Program:
        """Return what stays of the program while a descent stands where it is: all but the ends of its box."""
        here, unit = self._here(k), self.rows.unit
        size, of_t = _size(here.varied), np.zeros(len(here.values))
        of_t[:OBJECTIVE] = 1.0
        per = np.where(of_t > 0.0, unit, 1.0)
        slopes = np.ascontiguousarray((here.slopes * size).T) / per
        linear = np.concatenate([slopes, [of_t, 1.0 - of_t]])
        values, axes = np.linalg.eigh(self.curvature[k])
        stiffness = np.concatenate([np.maximum(values, 0.5 * FLAT), [BEND, BEND]])
        back = np.eye(len(linear))
        back[: len(values), : len(values)] = axes
        back /= np.array([math.sqrt(v) for v in stiffness])
        centre = -(back.T @ np.concatenate([np.zeros(len(values)), [1.0, self.rows.price / unit]]))
        none = np.empty(0)
        return _Program(linear, back, centre, none, none, per, size)

    def _solved(self, k: int, program: _Program, values: Array) -> tuple[Array, Array, float]:
        """Step (n + 5,), the multipliers of the rows (r,), and the gain it promises.

        ``values`` are those of the rows for t = 0 and no step.
        """
        here, unit = self._here(k), self.rows.unit
        rows = values / program.per
        rows[:OBJECTIVE] += here.t / unit
        step, there, weights = np.empty(len(program.centre)), np.empty(len(rows)), np.empty(len(rows))
        nearest_of_many(
            rows, program.linear, program.back, program.centre, program.low, program.high, self.rows.turns,
            NEAR, MISSED, JOINED, EXACT, step, there, weights,
        )  # fmt: skip
        missed = -float((there[OBJECTIVE:] - step[-1]).min())
        after = here.t + unit * float(step[-2]) + self.rows.price * max(0.0, missed)
        return step[:-2] * program.size, weights / program.per, float(self.worth[k]) - after


def _size(varied: Array) -> Array:
    """Units of what is varied: 1 for places, their own size for the linear unknowns."""
    x = np.abs(varied[-UNKNOWNS:])
    ones = np.ones(len(varied) - UNKNOWNS)
    return np.concatenate([ones, [max(x[0], x[1])] * 2, [max(x[2], x[3])] * 2, [max(x[4], 1.0)]])


def _learnt(curvature: Array, moved: Array, change: Array) -> Array:
    """BFGS update, damped so that the curvature stays positive."""
    along = curvature @ moved
    known, seen = float(moved @ along), float(moved @ change)
    if not known > 1e-300:
        return curvature
    if seen < DAMPED * known:
        share = (1.0 - DAMPED) * known / (known - seen)
        change = share * change + (1.0 - share) * along
        seen = DAMPED * known
    update = curvature + np.outer(change, change) / seen - np.outer(along, along) / known
    return np.asarray(0.5 * (update + update.T), np.float64)
