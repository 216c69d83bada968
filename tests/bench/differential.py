"""Differential evolution on the locus of limit positions: a global search that shares no step with the optimiser's.

It has no samples, no starts, no gradients: populations of designs, pose by pose, that know nothing of each other.  Only
the best of each is searched to its end by the optimiser, since 64 poses tell an extremum to a part in a thousand.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array
from sweep.optimise import Problem, minimise
from sweep.optimise.local.kkt import Result
from sweep.study import OptimiseSettings

POPULATIONS, MEMBERS, GENERATIONS = 12, 60, 400
ACCURACY = Accuracy(samples=64)
CLOSE = 0.02  # violation, relative to the bounds, below which the objective counts
DEAR = 20.0  # price of a unit of violation there
REJECTED, STUCK, NOWHERE = 1e2, 1e4, 1e6  # above every objective: misses its limits, does not turn, does not exist
GREEDY = 0.1  # share of a population that is called its best
SETTLED = 1e-7  # relative spread of a population that has nothing more to find


def differential(problem: Problem, seed: int) -> list[Result]:
    """Results of local searches from the best of every population, both branches in turn, the best first.

    Parameters
    ----------
    problem : on the locus, a crank-rocker's objective under bounds of its links and a largest pressure angle
    seed : of the populations
    """
    turn = problem.variables.index("phi_ext")
    lower, upper = problem.lower.copy(), problem.upper.copy()
    lower[turn], upper[turn] = 0.0, 2.0 * math.pi
    once = replace(problem, lower=lower, upper=upper)
    ends = []
    for number in range(POPULATIONS):
        base = once.rows(once.lower + 0.5 * once.span, branch=(1.0, -1.0)[number % 2])[0]
        place, value = _evolved(once, base, np.random.default_rng([seed, number]))
        if value < REJECTED:
            ends.append(once.placed(base, place))
    if not ends:
        return []
    return minimise(problem, np.array(ends), OptimiseSettings(starts=len(ends), unseen=0.0))


def _evolved(problem: Problem, base: Array, rng: np.random.Generator) -> tuple[Array, float]:
    """Best of one population: current-to-best mutation, binomial crossover, places beyond a bound half-way back."""
    n = len(problem.variables)
    place = rng.random((MEMBERS, n))
    value = _worth(problem, problem.placed(base, place))
    for _ in range(GENERATIONS):
        best = rng.choice(np.argsort(value)[: int(GREEDY * MEMBERS)], MEMBERS)
        one, other = rng.integers(0, MEMBERS, (2, MEMBERS))
        pull = np.clip(0.55 + 0.1 * rng.standard_cauchy(MEMBERS), 0.1, 1.0)[:, None]
        trial = place + pull * (place[best] - place) + pull * (place[one] - place[other])
        trial = np.where(trial < 0.0, 0.5 * place, np.where(trial > 1.0, 0.5 * (1.0 + place), trial))
        mixed = rng.random((MEMBERS, n)) < np.clip(rng.normal(0.8, 0.2, MEMBERS), 0.0, 1.0)[:, None]
        mixed[np.arange(MEMBERS), rng.integers(0, n, MEMBERS)] = True
        trial = np.where(mixed, trial, place)
        found = _worth(problem, problem.placed(base, trial))
        better = found <= value
        place[better], value[better] = trial[better], found[better]
        if np.ptp(value) <= SETTLED * abs(value.min()):
            break
    k = int(np.argmin(value))
    return place[k], float(value[k])


def _worth(problem: Problem, designs: Array) -> Array:
    """Objective and price of small violations (n,); far above it what misses its limits, does not turn or exist."""
    names = problem.family.parameter_names
    worth, missed = np.full(len(designs), NOWHERE), np.zeros(len(designs))
    there: NDArray[np.intp] = np.flatnonzero(np.isfinite(designs).all(axis=1))
    steepest = math.inf
    for limit in problem.limits:
        if limit.output == "max_pressure_angle":
            steepest = limit.maximum or math.inf
        else:
            low, high = limit.minimum or 0.0, limit.maximum or math.inf
            length = designs[there, names.index(limit.output)]
            missed[there] += np.maximum(0.0, np.maximum(low - length, length - high)) / high
    seen = design_outputs(problem.family, designs[there], ["margin", "max_pressure_angle"], ACCURACY)
    angle = np.nan_to_num(seen["max_pressure_angle"], nan=0.5 * math.pi)
    missed[there] += np.maximum(0.0, np.sin(angle) - math.sin(steepest))
    turns = seen["margin"] > 0.0
    worth[there] = np.where(turns, REJECTED * (1.0 + missed[there]), STUCK * (2.0 - np.tanh(seen["margin"])))
    near = there[turns & (missed[there] < CLOSE)]
    found = design_outputs(problem.family, designs[near], [problem.objective], ACCURACY)[problem.objective]
    worth[near] = np.nan_to_num(np.minimum(found + DEAR * missed[near], REJECTED), nan=REJECTED)
    return worth
