"""Solver of tasks: candidates from low-discrepancy sequences, equations by least squares, epigraph of the objective.

The objective, a largest magnitude over many poses, has kinks; minimising t under -t <= curve <= t has none.  Gradients
are central differences, all rows in one call of the problem, whose kernels are vectorised.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.families.base import Array
from sweep.synthesis.tasks.problem import Candidates, Solution, SynthesisTask

BLOCK = 1024
STEP = 3e-6  # step of central differences, in units of the box
SHARE = 0.8  # share of the largest magnitude below which poses do not bound t
ROUNDS = 24
WIDEST = 0.15  # initial radius of a step, in units of the box
LOOKS = 240  # of least squares: along the kink at which a limit becomes active, steps are short
MET = 1e-9  # largest residual and violation of a feasible solution
ENOUGH, ALIKE = 4, 1e-4  # number of samples that have to end at the best objective, to this relative difference
APART = 1e-2  # share of the box: closer solutions count as the same


class _Rows(NamedTuple):
    """Equations (n, p), limits (n, q) and curve (n, m) of candidates side by side, or of one candidate."""

    equations: Array
    limits: Array
    curve: Array


def _rows(value: Candidates) -> _Rows:
    none = np.empty((len(value.curve), 0))
    equations, limits = (np.column_stack([none, *group.values()]) for group in (value.equations, value.limits))
    return _Rows(equations, limits, value.curve)


class _Scaled:
    """A problem scaled to the unit box."""

    def __init__(self, problem: SynthesisTask) -> None:
        self.problem = problem
        self.low = np.array([u.low for u in problem.unknowns])
        self.span = np.array([u.high for u in problem.unknowns]) - self.low
        self.periodic = np.array([u.periodic for u in problem.unknowns])

    def real(self, z: Array) -> Array:
        """Return the unknowns at points of the unit box."""
        x: Array = self.low + self.span * np.where(self.periodic, z % 1.0, z)
        return x

    def rows(self, z: Array) -> _Rows:
        """Return equations, limits and curves at points (n, k)."""
        return _rows(self.problem.evaluate(self.real(np.atleast_2d(z))))

    def with_gradient(self, z: Array) -> tuple[_Rows, _Rows]:
        """Return the values at z and their derivatives, (k, ...) each; one-sided if a neighbour has no mechanism."""
        k = z.size
        steps = STEP * np.eye(k)

        def slope(values: Array) -> Array:
            centre, ahead, behind = values[0], values[1 : k + 1], values[k + 1 :]
            difference = (ahead - behind) / (2.0 * STEP)
            difference = np.where(np.isnan(difference), (ahead - centre) / STEP, difference)
            return np.nan_to_num(np.where(np.isnan(difference), (centre - behind) / STEP, difference))

        at, limits, curve = self.rows(np.vstack([z[None, :], z + steps, z - steps]))
        return _Rows(at[0], limits[0], curve[0]), _Rows(slope(at), slope(limits), slope(curve))


def solve(
    problem: SynthesisTask, *, candidates: int = 4096, starts: int = 6, samples: int = 12, seed: int = 0
) -> list[Solution]:
    """Return mechanisms that solve a task, the best first.

    Parameters
    ----------
    problem : one of the tasks
    candidates : points of each sample of the box
    starts : number of points of each sample that are refined, at a distance from each other
    samples : largest number of independent samples; sampling ends when four have reached the best objective
    seed : seed of the samples; the same seed gives the same answer

    Returns
    -------
    list of Solution
        different local solutions, at most ``starts``, feasible ones first, each group by its objective.  Empty if no
        candidate gave a mechanism at all.

    Notes
    -----
    These are local solutions from many starts, without proof that the best one is the global optimum.
    """
    scaled = _Scaled(problem)
    solutions: list[Solution] = []
    best: list[float] = []
    while len(best) < samples and not _met(best):
        ends = [_refined(scaled, z) for z in _starts(scaled, candidates, starts, (seed, len(best)))]
        refined = [_solution(problem, scaled.real(z)) for z in ends]
        best.append(min((s.objective for s in refined if s.feasible), default=np.inf))
        solutions += refined
    solutions.sort(key=lambda s: (not s.feasible, s.objective if s.feasible else _miss(s)))
    places = [(np.array([*s.unknowns.values()]) - scaled.low) / scaled.span for s in solutions]
    return [solutions[n] for n in _apart(scaled, places, APART, starts)]


def _met(best: list[float]) -> bool:
    """Tell whether enough samples ended at the best objective."""
    least = min(best, default=np.inf) * (1.0 + ALIKE)
    return sum(height <= least < np.inf for height in best) >= ENOUGH


def _miss(solution: Solution) -> float:
    worst = max((abs(r) for r in solution.equations.values()), default=0.0)
    return max(worst, max((-s for s in solution.limits.values()), default=0.0))


def _starts(scaled: _Scaled, candidates: int, starts: int, seed: tuple[int, int]) -> list[Array]:
    from scipy.stats import qmc

    k = scaled.low.size
    power = int(np.ceil(np.log2(candidates)))
    points = qmc.Sobol(k, seed=np.random.default_rng(seed)).random_base2(power)
    miss, height = np.empty(len(points)), np.empty(len(points))
    for start in range(0, len(points), BLOCK):
        rows = slice(start, start + BLOCK)
        value = scaled.rows(points[rows])
        miss[rows] = _violation(value)
        height[rows] = np.abs(value.curve).max(axis=1)
    alive = np.isfinite(miss) & np.isfinite(height)
    if not alive.any():
        return []
    points, miss, height = points[alive], miss[alive], height[alive]
    # Candidates violate equations anyway: rank them by violation, then by objective.
    rank = np.log(np.maximum(miss, 1e-3)) + np.log(height / np.median(height) + 1e-12)
    ranked = points[np.argsort(rank, kind="stable")]
    return [ranked[n] for n in _apart(scaled, ranked, 0.5 * starts ** (-1.0 / k) * 0.5, starts)]


def _apart(scaled: _Scaled, places: Sequence[Array] | Array, least: float, most: int) -> list[int]:
    """Return the indices of the first places that are farther than ``least`` from those before them."""
    chosen: list[int] = []
    for n, z in enumerate(places):
        if len(chosen) < most and all(_distance(scaled, z, places[other]) > least for other in chosen):
            chosen.append(n)
    return chosen


def _distance(scaled: _Scaled, one: Array, other: Array) -> float:
    gap = np.abs(one - other)
    return float(np.where(scaled.periodic, np.minimum(gap % 1.0, 1.0 - gap % 1.0), gap).max())


def _violation(value: _Rows) -> Array:
    rows = [np.abs(value.equations), np.maximum(-value.limits, 0.0)]
    worst: Array = np.concatenate(rows, axis=1).max(axis=1, initial=0.0)
    return worst


def _feasible(value: _Rows) -> bool:
    """Tell whether one point is a mechanism that satisfies equations and limits."""
    return bool(np.isfinite(value.curve).all() and _violation(value)[0] <= MET)


def _bounds(scaled: _Scaled, z: Array) -> tuple[Array, Array]:
    return np.where(scaled.periodic, z - 0.5, 0.0), np.where(scaled.periodic, z + 0.5, 1.0)


def _refined(scaled: _Scaled, z: Array) -> Array:
    z = _restored(scaled, z)
    value = scaled.rows(z)
    if not _feasible(value):
        return z
    best = float(np.abs(value.curve).max())
    # Poses that were once near the largest magnitude stay in the program, so no step overlooks them twice.
    used, radius = np.zeros(value.curve.shape[1], np.bool_), WIDEST
    for _ in range(ROUNDS):
        used |= np.abs(value.curve[0]) >= SHARE * np.abs(value.curve[0]).max()
        following = _restored(scaled, _descended(scaled, z, best, used, radius))
        value = scaled.rows(following)
        height = float(np.abs(value.curve).max())
        gain = best - height if _feasible(value) else -np.inf
        if gain > 0.0:
            z, best = following, height
        else:
            radius *= 0.25
            value = value if np.isfinite(height) else scaled.rows(z)
        if abs(gain) <= 1e-10 * best:
            break
    return z


def _restored(scaled: _Scaled, z: Array) -> Array:
    """Reduce equations and violated limits to zero: by least squares, then by Gauss-Newton steps of least length."""
    from scipy.optimize import least_squares

    if _violation(scaled.rows(z))[0] <= 0.0:
        return z
    low, high = _bounds(scaled, z)
    inside = np.clip(z, low + 1e-12, high - 1e-12)

    def residuals(point: Array) -> Array:
        value = scaled.rows(point)
        residual = np.concatenate([value.equations[0], np.minimum(value.limits[0] - 1e-10, 0.0)])
        return np.where(np.isfinite(residual), residual, 1e3)

    def jacobian(point: Array) -> Array:
        value, slope = scaled.with_gradient(point)
        active = value.limits < 1e-10
        return np.concatenate([slope.equations, np.where(active, slope.limits, 0.0)], axis=1).T

    if not np.isfinite(scaled.rows(inside).equations).all():
        return z
    result = least_squares(
        residuals, inside, jac=jacobian, bounds=(low, high), xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=LOOKS
    )
    point: Array = result.x
    for _ in range(4):
        step = np.linalg.lstsq(jacobian(point), -residuals(point), rcond=1e-12)[0]
        following = np.clip(point + step, low, high)
        if not np.linalg.norm(residuals(following)) < np.linalg.norm(residuals(point)):
            break
        point = following
    return point


def _descended(scaled: _Scaled, z: Array, top: float, used: NDArray[np.bool_], radius: float) -> Array:
    """Run SLSQP on the epigraph: t bounds the ``used`` poses, and the unknowns change by at most ``radius``."""
    from scipy.optimize import minimize

    if not top > 0.0:
        return z
    cache: dict[bytes, tuple[Array, Array, Array, Array]] = {}

    def parts(point: Array) -> tuple[Array, Array, Array, Array]:
        key = point.tobytes()
        if key not in cache:
            cache.clear()
            value, slope = scaled.with_gradient(point[:-1])
            curve = value.curve[used] / top
            below = np.concatenate([point[-1] - curve, point[-1] + curve, value.limits])
            rows = np.concatenate([-slope.curve[:, used] / top, slope.curve[:, used] / top, slope.limits], axis=1).T
            last = np.concatenate([np.ones(2 * curve.size), np.zeros(value.limits.size)])
            # Where no mechanism exists: a value that makes the line search step back.
            inequalities = np.where(np.isfinite(below), below, -1e3)
            equal = np.where(np.isfinite(value.equations), value.equations, 1e3)
            cache[key] = (inequalities, np.column_stack([rows, last]), equal,
                           np.column_stack([slope.equations.T, np.zeros(equal.size)]))  # fmt: skip
        return cache[key]

    start, gradient = np.append(z, 1.0), np.append(np.zeros(z.size), 1.0)
    constraints = [{"type": "ineq", "fun": lambda p: parts(p)[0], "jac": lambda p: parts(p)[1]}]
    if parts(start)[2].size:
        constraints.append({"type": "eq", "fun": lambda p: parts(p)[2], "jac": lambda p: parts(p)[3]})
    low, high = _bounds(scaled, z)
    bounds = [*zip(np.maximum(low, z - radius), np.minimum(high, z + radius), strict=True), (0.0, None)]
    run: Any = minimize
    result = run(
        lambda p: p[-1], start, jac=lambda p: gradient, method="SLSQP", bounds=bounds,
        constraints=constraints, options={"maxiter": 60, "ftol": 1e-12},
    )  # fmt: skip
    point: Array = np.clip(result.x[:-1], low, high)
    return point if np.isfinite(point).all() else z


def _solution(problem: SynthesisTask, x: Array) -> Solution:
    candidate = problem.evaluate(x[None, :])
    return Solution(
        _feasible(_rows(candidate)),
        float(np.abs(candidate.curve).max()),
        {u.name: float(value) for u, value in zip(problem.unknowns, x, strict=True)},
        _first(candidate.results),
        _first(candidate.equations),
        _first(candidate.limits),
    )


def _first(columns: Mapping[str, Array]) -> dict[str, float]:
    return {name: float(column[0]) for name, column in columns.items()}
