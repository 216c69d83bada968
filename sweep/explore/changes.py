"""Changes of the design in hand: a joint of a planar mechanism is dragged, or one local search improves the design."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from sweep.errors import InputError, MissingInput
from sweep.evaluation.joints import Part, parts
from sweep.exchange.scene import is_spatial, shown_name
from sweep.explore.hand import STEADY, Hand
from sweep.families.base import Array, Turn
from sweep.optimise.local.start import search
from sweep.optimise.problem.statement import Problem
from sweep.quantities.limits import Limit, tightest

STEP = 1e-6  # step of differences: a share of the mechanism's size, or rad
ROUNDS = 8
LEAST = 1e-3  # share of its length that a positive dimension keeps
STAY = 0.05  # weight of the joints that should stay, relative to the dragged one
LITTLE = 1e-4  # weight of a change of a dimension by the mechanism's size
LOOKS = 20_000  # evaluations of designs, as for one start of a study


def dragged(
    hand: Hand, design: Mapping[str, float], phi: float, place: tuple[str, str], to: Sequence[float]
) -> tuple[dict[str, float], float]:
    """Return the design and crank angle that bring a joint to a point and move the others as little as possible.

    Parameters
    ----------
    phi : crank angle of the picture [rad]
    place : label of the part, and name of the joint on the page
    to : x and y of the point in the frame of the part [mm]

    Raises
    ------
    InputError
        for a spatial mechanism, one that does not turn, or an unknown joint.
    """
    ranges = [r for r in hand.ranges if not r.choices]
    free, positive = [r.name for r in ranges], np.array([*(r.positive for r in ranges), False])

    def joints(x: Array) -> list[Part]:
        return parts(hand.family, {**design, **dict(zip(free, x[:-1].tolist(), strict=True))}, float(x[-1]))

    x = np.array([*(design[name] for name in free), phi])
    stages = joints(x)
    if is_spatial(stages) or not isinstance(hand.family.domain, Turn):
        raise InputError("mechanism", hand.family.name, "a plane one that turns: its joints can be dragged", "explore")
    names = [
        (part.label if part.member or part.stage else "", f"{shown_name(name)}{part.stage}")
        for part in stages
        for name in part.joints
    ]
    if place not in names:
        raise InputError("joint", place[1], ", ".join(name for _, name in names), "explore")
    flat = _flat(stages)
    size = float(np.ptp(flat, axis=0).max())
    scale = np.array([*(size if r.unit == "mm" else 1.0 for r in ranges), 1.0])
    weight = np.full(len(names), STAY)
    weight[names.index(place)] = 1.0
    goal = flat.copy()
    goal[names.index(place)] = to

    steps = np.diag(scale)
    # A dimension keeps its value if a small step makes the mechanism fall apart, as for a second four-bar without
    # lengths.
    steady = [bool(np.isfinite(_flat(joints(x + STEP * step))).all()) for step in steps]
    steps = steps[steady]

    def residuals(changes: Array) -> Array:
        apart = weight[:, None] * (_flat(joints(x + changes @ steps)) - goal) / size
        return np.append(np.nan_to_num(apart.ravel(), nan=1.0), LITTLE * changes)  # large if it falls apart

    low = np.where(positive, -(1.0 - LEAST) * x / scale, -np.inf)[steady]
    changes = least_squares(
        residuals, np.zeros(len(steps)), bounds=(low, np.inf), diff_step=np.full(len(steps), STEP), max_nfev=ROUNDS
    ).x
    x = x + changes @ steps
    return dict(zip(free, x[:-1].tolist(), strict=True)), float(x[-1])


def _flat(stages: Sequence[Part]) -> Array:
    return np.array([path[0, :2] for part in stages for path in part.joints.values()])


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
        "missed": list(result.relaxation),
        "looks": result.looks,
    }
