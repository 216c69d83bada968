"""Outputs of effects as objectives and limits of the optimiser."""

from __future__ import annotations

import numpy as np
import pytest

from studies.accuracy.ordinary import CENTRE, INPUTS
from sweep.effects import extended
from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise import Problem, minimise
from sweep.study import Limit, OptimiseSettings

VARIABLES = ("b", "f")
ONCE = OptimiseSettings(starts=1, seed=1, time_budget=None)
PRESSURE = Limit("max_pressure_angle", None, 1.15)


def effect_problem(objective, limits=(PRESSURE,)):
    full = extended(family("rssr"), [objective, *(limit.output for limit in limits)])
    values = {p.name: INPUTS.get(p.name, CENTRE.get(p.name, p.default)) for p in full.parameters}
    fixed = {name: x for name, x in values.items() if name not in (*VARIABLES, "branch")}
    return Problem(full, VARIABLES, np.array([85.0, 4.0]), np.array([105.0, 20.0]), fixed, objective, limits)


def grid_best(problem, objective, limits):
    """Smallest objective of a lattice round the optimum that keeps the limits."""
    pairs = [(b, f) for b in np.linspace(85.0, 105.0, 9) for f in np.linspace(4.0, 20.0, 9)]
    matrix = problem.rows(np.array(pairs), branch=1.0)
    columns = design_outputs(problem.family, matrix, [objective, *(x.output for x in limits)], Accuracy(target=1e-8))
    # Where the best of the objective is the best of the limit too, a limit between both is theirs to rounding.
    kept = np.logical_and.reduce([columns[x.output] <= x.maximum * (1.0 + 1e-12) for x in limits])
    assert kept.any()
    return np.min(columns[objective][kept])


@pytest.mark.parametrize(
    "objective",
    [
        "rms_drive_torque",
        "max_abs_drive_torque_friction",
        "unevenness",
        "max_abs_lag_dynamic",
        "max_sliding_utilisation",
    ],
)
def test_outputs_of_effects_are_objectives(objective):
    """Pointwise reductions, means, whole-turn numbers: no design of a lattice is better."""
    problem = effect_problem(objective)
    best = minimise(problem, problem.rows(np.array([[92.0, 14.0]]), branch=1.0), ONCE)[0]
    assert best.ended == "converged" and best.violation <= 1e-9
    assert best.objective <= grid_best(problem, objective, [PRESSURE]) * (1.0 + 1e-9)


@pytest.mark.parametrize("output", ["rms_drive_torque", "unevenness", "max_friction_contraction"])
def test_outputs_of_effects_are_limits(output):
    """A limit halfway between what the best design has and what is possible is kept, and nothing is given away."""
    free, start = effect_problem("max_abs_d2psi", (PRESSURE, Limit(output, None, 1e9))), np.array([[92.0, 14.0]])
    loose = minimise(free, free.rows(start, branch=1.0), ONCE)[0]
    had = design_outputs(free.family, loose.design[None, :], [output], Accuracy(target=1e-8))[output][0]
    limits = (PRESSURE, Limit(output, None, 0.5 * (had + grid_best(free, output, [PRESSURE]))))
    problem = effect_problem("max_abs_d2psi", limits)
    best = minimise(problem, problem.rows(start, branch=1.0), ONCE)[0]
    assert best.ended == "converged" and best.violation <= 1e-9
    assert best.objective >= loose.objective * (1.0 - 1e-12)
    assert best.objective <= grid_best(problem, "max_abs_d2psi", limits) * (1.0 + 1e-9)


@pytest.mark.parametrize("name", ["pressure_extrema", "max_friction_passes"])
def test_outputs_constant_in_pieces_are_refused(name):
    """Their slope is zero almost everywhere, so every design would look optimal."""
    for problem in (effect_problem(name), effect_problem("max_abs_d2psi", (PRESSURE, Limit(name, None, 3.0)))):
        with pytest.raises(InputError, match=f"{name}.*changes steadily"):
            minimise(problem, problem.rows(np.array([[92.0, 14.0]]), branch=1.0), ONCE)
