"""Improvement of a design by one local search between the ends of the ticked sliders."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from sweep.errors import InputError, MissingInput
from sweep.explore.hand import STEADY, Hand
from sweep.optimise.local.start import search
from sweep.optimise.problem.statement import Problem
from sweep.quantities.limits import Limit, tightest

LOOKS = 20_000  # evaluations of designs, as for one start of a study


def problem_in_hand(hand: Hand, design: Mapping[str, float], free: Mapping[str, Sequence[float]]) -> Problem:
    """Return the study's problem with ``free`` dimensions between two ends as variables, and the others fixed.

    Raises
    ------
    InputError
        if the study has no objective, or nothing may change.
    """
    study = hand.study
    if study.objective is None:
        raise MissingInput("objective", "a study that says what to minimise: [objective]", "explore")
    bounds = {}
    for p in study.family.parameters:
        if p.name not in free or p.choices is not None:
            continue
        low, high = tightest([Limit(p.name, *sorted(map(float, free[p.name]))), *study.parameter_limits], p.name)
        bounds[p.name] = (min(low, design[p.name]), max(high, design[p.name]))
    if not bounds:
        raise InputError("dimensions", "none", STEADY, "explore")
    ends = np.array(list(bounds.values()))
    fixed = {name: value for name, value in design.items() if name not in bounds}
    return Problem(
        study.family, tuple(bounds), ends[:, 0], ends[:, 1], fixed, study.objective.output, study.output_limits,
        study.window, study.accuracy,
    )  # fmt: skip


def improve(problem: Problem, design: Mapping[str, float], should_stop: Callable[[], bool]) -> dict[str, Any]:
    """Search from a design until it converges or ``should_stop`` returns true, and return the best result so far."""
    start = np.array([design[name] for name in problem.family.parameter_names])
    result = search(0, problem, start, should_stop, LOOKS)
    return {
        "design": dict(zip(problem.family.parameter_names, result.design.tolist(), strict=True)),
        "ended": result.ended,
        "feasible": result.feasible,
        "active": list(result.active),
        "looks": result.looks,
    }
