"""One problem of each of the tasks 1 to 8, its best solution, and its evaluation by the families."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.synthesis.tasks import (
    Position,
    Setting,
    SlotPosition,
    Task1,
    Task2,
    Task3,
    Task4,
    Task5,
    Task6,
    Task7,
    Task8,
    solve,
)

RSSR = ("a", "b", "c", "e", "f", "g", "alpha", "branch")
SPACE = {"e": 1.0, "g": 1.0, "alpha": 1.3}
DRIVE = {"a": 0.4, "b": 1.8, "c": 1.2, "e": 1.5, "f": 1.2, "g": 1.0, "alpha": 1.3, "branch": -1.0}
BOUNDS = {"b": (0.3, 8.0), "c": (0.3, 5.0)}
STAGE_BOUNDS = {"b1": (0.3, 8.0), "c1": (0.3, 5.0)}


@cache
def best(problem):
    """Return the best solution; problems are frozen, so each is solved once."""
    solutions = solve(problem.build(), candidates=2048, starts=2, samples=1)
    assert solutions
    assert solutions[0].feasible, str(solutions[0])
    return solutions[0]


class Case:
    """A problem by name, hashable."""

    def __init__(self, kind, **numbers):
        self.kind, self.numbers = kind, numbers

    def build(self):
        return self.kind(**self.numbers)


TASK1 = Case(
    Task1, swing=0.9, phi0=3.3, **SPACE, positions=(Position(1.0, 0.25),), bounds=BOUNDS, max_pressure_angle=1.2
)
TASK2 = Case(Task2, swing_range=(0.5, 1.2), phi0_range=(2.9, 3.5), **SPACE, max_pressure_angle=1.2, bounds=BOUNDS,
             positions=(Position(1.0, 0.2), Position(2.0, 0.6)))  # fmt: skip
TASK3 = Case(Task3, swing=0.8, phi0=3.2, settings=(Setting(0.6, 3.2),), adjusted="f", adjusted_range=(-4.0, 4.0),
             **SPACE, f_range=(-3.0, 3.0), max_pressure_angle=1.3, bounds=BOUNDS)  # fmt: skip
TASK3_THREE = Case(Task3, swing=0.8, phi0=3.2, settings=(Setting(0.7, 3.2), Setting(0.6)), adjusted="g",
                   adjusted_range=(-4.0, 4.0), **SPACE, f_range=(-3.0, 3.0), g_range=(0.2, 2.0), max_pressure_angle=1.3,
                   bounds=BOUNDS)  # fmt: skip
TASK4 = Case(Task4, swing=np.radians(45.0), phi0=np.radians(165.0), e=1.0, objective="pressure_angle")
TASK5 = Case(Task5, swing=0.8, phi0=3.2, **SPACE, f_range=(-3.0, 3.0), rho0=0.5, bounds=STAGE_BOUNDS,
             max_pressure_angle=1.2, positions=(SlotPosition(1.0, 0.1), SlotPosition(2.0, 0.38)))  # fmt: skip
TASK6 = Case(Task6, drive=DRIVE, start=(0.0, 0.0), end=(1.0, 0.2), start_direction=0.5, end_direction=-0.1)
TASK6_SLIDER = Case(Task6, **TASK6.numbers, second="slider_crank")
TASK6_SLOTTED = Case(Task6, **TASK6.numbers, second="swivel")
TASK7 = Case(Task7, drive=DRIVE, stroke=1.0, start_acceleration=0.6, end_acceleration=-0.5)
TASK8 = Case(Task8, swing=0.8, phi0=3.2, **SPACE, f_range=(-3.0, 3.0), stroke=1.0, dwell=1.0, tolerance=0.004,
             limit="folded", bounds=STAGE_BOUNDS)  # fmt: skip


def chain_columns(solution, second):
    names = sweep.families.family(["rssr", second]).parameter_names
    return {name: [solution.mechanism[name]] for name in names if name in solution.mechanism}


def rocker(solution):
    return {name: [solution.mechanism[name]] for name in RSSR}


def check_limits(table, swing, phi0, largest_pressure):
    wanted = ["swing", "phi0", "max_pressure_angle", "phi_ext", "psi_ext"]
    turn = sweep.summarise("rssr", table, wanted, accuracy=1e-12).iloc[0]
    assert turn["status"] == st.OK
    assert turn["swing"] == pytest.approx(swing, abs=1e-9)
    assert turn["phi0"] == pytest.approx(phi0, abs=1e-9)
    assert turn["max_pressure_angle"] <= largest_pressure + 1e-7
    return turn


def check_position(table, turn, position):
    psi = sweep.evaluate("rssr", table, "psi", phi=[turn["phi_ext"] + position.dphi])["psi"][0]
    error = psi - turn["psi_ext"] - position.dpsi
    assert abs(error - 2.0 * np.pi * np.round(error / (2.0 * np.pi))) < 1e-9
