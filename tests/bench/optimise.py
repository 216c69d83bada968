"""Random specifications of a spatial crank-rocker against a search fifty times larger: gap, residual, CPU time."""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise import Problem, minimise
from sweep.optimise.certificate import AGREE, Result
from sweep.optimise.descent import KKT
from sweep.optimise.starts import from_sample
from sweep.study import Limit, OptimiseSettings
from sweep.summaries import design_outputs

STARTS, LARGER = 6, 50
CPU = 1.5  # seconds per specification
RSSR = family("rssr")
NAMES = ("a", "b", "e", "f", "g", "alpha")  # in units of c
LOW, HIGH = np.array([0.1, 0.5, 0.0, -1.5, -1.5, 0.0]), np.array([0.9, 4.0, 2.5, 1.5, 1.5, math.pi / 2])


@dataclass(frozen=True)
class Outcome:
    """One specification: the search, the larger one, CPU time of the first [s]."""

    problem: Problem
    ours: Result
    best: Result
    cpu: float

    @property
    def gap(self) -> float:
        """By how much the larger search is better, relative; infinite where ours is not feasible and it is."""
        if self.ours.violation > 1e-9:
            return math.inf if self.best.violation <= 1e-9 else 0.0
        return max(0.0, self.ours.objective / self.best.objective - 1.0)


def specifications(seed: int) -> Iterator[Problem]:
    """Swing and phi0 of a random mechanism that turns, a limit of the pressure angle at or above its own, a random box.

    The mechanism itself is not told to the search; it makes sure that there is a solution.
    """
    rng = np.random.default_rng(seed)
    while True:
        middle = LOW + rng.random(len(NAMES)) * (HIGH - LOW)
        lower, upper = LOW + 0.7 * rng.random() * (middle - LOW), HIGH - 0.7 * rng.random() * (HIGH - middle)
        names = ["swing", "phi0", "max_pressure_angle", "margin"]
        design = [*middle[:2], 1.0, *middle[2:], rng.choice([-1.0, 1.0])]
        found = design_outputs(RSSR, np.array([design]), names, Accuracy(target=1e-9))
        swing, phi0, pressure, margin = (float(found[name][0]) for name in names)
        if not margin > 0.1 or not 0.35 < abs(swing) < 2.0 or not pressure < math.radians(60):
            continue
        limit = min(pressure + rng.random() * math.radians(15), math.radians(65))
        limits = (
            Limit("swing", abs(swing), abs(swing)),
            Limit("phi0", phi0, phi0),
            Limit("max_pressure_angle", None, limit),
        )
        yield Problem(RSSR, NAMES, lower, upper, {"c": 1.0}, "max_abs_d2psi", limits)


def solve(problem: Problem, starts: int, seed: int, jobs: int = 1) -> Result:
    """Best result of a search from so many diverse designs of a sample; both branches."""
    designs = from_sample(problem, [{"branch": 1.0}, {"branch": -1.0}], starts, seed)
    return minimise(problem, designs, OptimiseSettings(starts=starts, seed=seed), jobs=jobs)[0]


def measure(
    count: int, larger: int = LARGER, starts: int = STARTS, jobs: int = 2, seed: int = 1971
) -> Iterator[Outcome]:
    """Outcomes of the first specifications, one after the other."""
    problems = specifications(seed)
    solve(next(specifications(seed + 1)), 1, 0)  # compiles
    for number in range(count):
        problem = next(problems)
        begin = time.process_time()
        ours = solve(problem, starts, number)
        cpu = time.process_time() - begin
        # The larger search begins from other designs, and counts only where it is better.
        other = solve(problem, starts * larger, number + 1000, jobs)
        feasible = other.violation <= 1e-9
        better = feasible and (ours.violation > 1e-9 or other.objective < ours.objective)
        yield Outcome(problem, ours, other if better else ours, cpu)


def main() -> None:
    """Print the table and which marks are met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--larger", type=int, default=LARGER)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    outcomes = []
    print("swing  phi0   pressure <=   max |d2psi|     gap      KKT      CPU [s]  ended")
    for outcome in measure(options.count, options.larger, jobs=options.jobs):
        outcomes.append(outcome)
        swing, phi0, pressure = outcome.problem.limits
        angles = [math.degrees(x or 0.0) for x in (swing.maximum, phi0.maximum, pressure.maximum)]
        ours = outcome.ours
        print(
            "{:5.1f}  {:5.1f}  {:8.1f}     ".format(*angles),
            f"{ours.objective:12.9f}  {outcome.gap:8.1e}  {ours.kkt_residual:8.1e}  {outcome.cpu:6.2f}  {ours.ended}",
            flush=True,
        )
    n = len(outcomes)
    print(f"within {AGREE:g} of a search {options.larger} times larger: {sum(o.gap <= AGREE for o in outcomes)} of {n}")
    print(f"KKT residual <= {KKT:g}: {sum(o.ours.kkt_residual <= KKT for o in outcomes)} of {n}")
    print(f"CPU time <= {CPU:g} s: {sum(o.cpu <= CPU for o in outcomes)} of {n}")


if __name__ == "__main__":
    main()
