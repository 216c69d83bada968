"""Starts without a dataset: the best of a large sample, improved by ever smaller samples around them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweep.chunks.cascade import compared
from sweep.families.base import Accuracy, Array
from sweep.optimise.form import measured_in
from sweep.optimise.problem import Problem
from sweep.optimise.starts import spread
from sweep.quantities.names import is_flag, stem
from sweep.reductions.measures import ROTATABLE_MARGIN, margins

SAMPLED = 1 << 15  # designs per start: on a locus they cost a third of a microsecond each
BLOCK = 1 << 15  # designs ranked together
KEPT = 512  # best of the sample per start
PARENTS, CHILDREN, ROUNDS = 8, 24, 12  # improved per start; samples around each and round
FARTHEST = 1e100
RADIUS = 0.06  # of the first of these samples, in variables scaled to their bounds
ACCURACY = Accuracy(samples=64)  # misses a peak by less than what the local search gains ...
VERIFIED, HIDDEN = Accuracy(target=1e-3), 2.0  # ... but near a pole, told by a true extremum so many times larger
NEARLY = 0.03  # a search mends so small a violation in passing: the objective tells more
PRICE = 3.0  # of such a violation, in objectives
ABSENT = 100.0  # violation of a limit on what a design does not have, as the swing of a rocker that turns
OUTSIDE, STUCK = 1e100, 1e200  # above every objective: misses its limits, does not turn


def from_sample(problem: Problem, signs: Sequence[dict[str, float]], count: int, seed: int) -> Array:
    """Return the diverse good designs, best first:
    a Sobol sample between the bounds, and what is found around the best of it.

    Ranked by :func:`ranking`.  Same arguments, same designs.

    Parameters
    ----------
    problem : what is to be minimised
    signs : combinations of the parameters that are not varied (branches); the sample is shared out among them
    count : how many at most
    seed : of the sample
    """
    from scipy.stats import qmc

    centre = problem.lower + 0.5 * problem.span
    bases = [problem.rows(centre, **choice)[0] for choice in signs]
    low, high = _one_turn(problem)
    sobol = qmc.Sobol(len(problem.variables), seed=seed)
    place, kind, merit = np.empty((0, len(low))), np.empty(0, np.intp), np.empty(0)
    blocks = int(np.ceil(SAMPLED * count / BLOCK))
    for number in range(max(blocks, len(bases))):
        fractions = low + sobol.random(BLOCK) * (high - low)
        own = number % len(bases)
        found = ranking(problem, problem.placed(bases[own], fractions))
        place = np.concatenate([place, fractions])
        kind = np.concatenate([kind, np.full(BLOCK, own)])
        merit = np.concatenate([merit, found])
        best = np.sort(np.argsort(merit, kind="stable")[: KEPT * count])
        place, kind, merit = place[best], kind[best], merit[best]
    merit = _verified(problem, bases, place, kind, merit)
    order = np.argsort(merit, kind="stable")
    order = order[np.isfinite(merit[order])]
    order = order[spread(place[order], kind[order], PARENTS * count)]
    place, merit = _improved(problem, bases, place[order], kind[order], merit[order], np.random.default_rng(seed))
    ranked = np.argsort(merit, kind="stable")
    place, kind = place[ranked], kind[order][ranked]
    return np.array([problem.placed(bases[kind[k]], place[k]) for k in spread(place, kind, count)])


def _one_turn(problem: Problem) -> tuple[Array, Array]:
    """Return the bounds in which samples are drawn:
    what repeats itself after a turn only in the middle turn of its bounds.
    """
    periodic = () if problem.coordinates is None else problem.coordinates.periodic
    share = np.array(
        [
            min(1.0, 2.0 * np.pi / width) if name in periodic else 1.0
            for name, width in zip(problem.variables, problem.span, strict=True)
        ]
    )
    return 0.5 - 0.5 * share, 0.5 + 0.5 * share


def _verified(problem: Problem, bases: list[Array], place: Array, kind: NDArray[np.intp], merit: Array) -> Array:
    """Return ranks of designs that the poses found good;
    where these hid most of a peak, the rank by the true extrema.
    """
    out = merit.copy()
    for own, base in enumerate(bases):
        rows = np.flatnonzero((kind == own) & np.isfinite(merit))
        found = ranking(problem, problem.placed(base, place[rows]), VERIFIED)
        hidden = found > HIDDEN * merit[rows]
        out[rows[hidden]] = found[hidden]
    return out


def _improved(
    problem: Problem, bases: list[Array], place: Array, kind: NDArray[np.intp], merit: Array, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Replace every design by the best of a sample around it, again and again; no better one halves the radius."""
    place, merit = place.copy(), merit.copy()
    radius = np.full(len(place), RADIUS)
    for _ in range(ROUNDS):
        steps = radius[:, None, None] * rng.standard_normal((len(place), CHILDREN, place.shape[1]))
        children = np.clip(place[:, None, :] + steps, 0.0, 1.0)
        values = np.empty((len(place), CHILDREN))
        for own, base in enumerate(bases):
            rows = np.flatnonzero(kind == own)
            designs = problem.placed(base, children[rows].reshape(-1, place.shape[1]))
            values[rows] = ranking(problem, designs).reshape(-1, CHILDREN)
        chosen = np.arange(len(place)), np.argmin(values, axis=1)
        best = children[chosen]
        found = _verified(problem, bases, best, kind, values[chosen])
        better = found < merit
        place[better], merit[better] = best[better], found[better]
        radius[~better] *= 0.5
    return place, merit


def ranking(problem: Problem, designs: Array, accuracy: Accuracy = ACCURACY) -> Array:
    """Return the objective where all limits are nearly kept; far above it the largest violation;
    then what does not turn.

    Cheap limits first: parameters, then margins and pressure angles, then the others; only designs that nearly keep
    them go on.  Infinite where there is no design or no objective.

    Parameters
    ----------
    problem : whose objective and limits count
    designs : (n, P)
    accuracy : of their extrema over the turn
    """
    limits = [limit for limit in problem.limits if not is_flag(limit.output)]
    names = problem.family.parameter_names
    turning = ["margin"] if margins(problem.family) else []
    groups: list[list[Any]] = [[], [], []]
    for limit in limits:
        groups[
            0 if limit.output in names else 1 if stem(limit.output) in ("margin", "max_pressure_angle") else 2
        ].append(limit)
    merit = np.full(len(designs), np.inf)
    alive = np.flatnonzero(np.isfinite(designs).all(axis=1))
    violation = np.zeros(len(designs))
    for left, group in zip((3.0, 2.0, 1.0), groups, strict=True):
        wanted = list(dict.fromkeys(limit.output for limit in group)) + (turning if left == 2.0 else [])
        columns = _values(problem, designs[alive], wanted, accuracy)
        for limit in group:
            violation[alive] = np.maximum(violation[alive], _missed(limit, columns[limit.output]))
        bad = violation[alive] > NEARLY
        merit[alive[bad]] = OUTSIDE * (left + violation[alive[bad]])
        if left == 2.0 and turning:
            stuck = ~(columns["margin"] >= ROTATABLE_MARGIN)
            # How far a crank is from turning is a rank only; numbers beyond this are all alike, and would overflow.
            margin = np.maximum(np.nan_to_num(columns["margin"][stuck]), -FARTHEST)
            merit[alive[stuck]] = STUCK * (1.0 - margin)
            bad |= stuck
        alive = alive[~bad]
    values = _values(problem, designs[alive], [problem.objective], accuracy)[problem.objective]
    objective = compared(problem.objective, values)
    merit[alive] = np.nan_to_num(objective + PRICE * np.abs(objective) * violation[alive], nan=np.inf, posinf=np.inf)
    return merit


def _values(problem: Problem, designs: Array, wanted: list[str], accuracy: Accuracy) -> dict[str, Array]:
    """Return outputs and parameters (n,) of designs."""
    from sweep.evaluation.summaries import design_outputs

    names = problem.family.parameter_names
    columns: dict[str, Any] = {name: designs[:, names.index(name)] for name in wanted if name in names}
    outputs = [name for name in wanted if name not in names]
    if outputs and len(designs):
        columns |= design_outputs(problem.family, designs, outputs, accuracy, problem.window)
    return {name: np.asarray(columns.get(name, np.empty(0)), np.float64) for name in wanted}


def _missed(limit: Any, value: Array) -> Array:
    """Return the violation relative to the bound (n,);
    an output that a design does not have misses its limit by far.
    """
    value = compared(limit.output, value)
    out = np.zeros(len(value))
    for bound, sense in ((limit.minimum, 1.0), (limit.maximum, -1.0)):
        if bound is not None:
            size = measured_in(max(abs(limit.minimum or 0.0), abs(limit.maximum or 0.0)))
            out = np.maximum(out, sense * (bound - value) / size)
    return np.nan_to_num(out, nan=ABSENT)
