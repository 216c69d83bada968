"""Random specifications of a spatial crank-rocker against a search fifty times larger: gap, residual, CPU time."""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from studies.accuracy.machine import description
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise import Problem, on_locus, optimum
from sweep.optimise.candidates import BLOCK, ranking
from sweep.optimise.certificate import AGREE, Result
from sweep.optimise.descent import KKT
from sweep.study import Limit, OptimiseSettings

STARTS, LARGER, SEED = 6, 50, 1971
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
    """Best result of a search from so many starts, both branches."""
    settings = OptimiseSettings(starts=starts, seed=seed)
    return optimum(problem, [{"branch": 1.0}, {"branch": -1.0}], settings, jobs=jobs)[0]


def measure(
    count: int, larger: int = LARGER, starts: int = STARTS, jobs: int = 1, seed: int = SEED
) -> Iterator[Outcome]:
    """Outcomes of the first specifications, one after the other."""
    problems = specifications(seed)
    solve(next(specifications(seed + 1)), 1, 0)  # compiles
    for number in range(count):
        problem = next(problems)
        begin = time.process_time()
        ours = solve(problem, starts, number)
        cpu = time.process_time() - begin
        # The larger search has another sample, of so many times the size, and counts only where it is better.
        other = solve(problem, starts * larger, number + 1000, jobs)
        feasible = other.violation <= 1e-9
        better = feasible and (ours.violation > 1e-9 or other.objective < ours.objective)
        yield Outcome(problem, ours, other if better else ours, cpu)


def candidate_cost(count: int = 1 << 20) -> dict[str, float]:
    """Time [us] per candidate on one core: the sample, mechanisms on the locus, and all with limits and objective."""
    problem = on_locus(next(specifications(SEED)))
    base = problem.rows(problem.lower + 0.5 * problem.span, branch=-1.0)[0]
    sobol = qmc.Sobol(len(problem.variables), seed=1)
    costs = dict.fromkeys(("sample", "locus", "all"), math.inf)
    for _ in range(5):
        spent = dict.fromkeys(costs, 0.0)
        for _ in range(max(1, count // BLOCK // 5)):
            times = [time.process_time()]
            fractions = sobol.random(BLOCK)
            times.append(time.process_time())
            designs = problem.placed(base, fractions)
            times.append(time.process_time())
            ranking(problem, designs)
            times.append(time.process_time())
            for name, begin, end in (("sample", 0, 1), ("locus", 1, 2), ("all", 0, 3)):
                spent[name] += times[end] - times[begin]
        size = BLOCK * max(1, count // BLOCK // 5)
        costs = {name: min(best, spent[name] / size * 1e6) for name, best in costs.items()}
    return costs


def page(outcomes: list[Outcome], larger: int, seed: int) -> str:
    """The table and which marks are met, as markdown."""
    n, cost = len(outcomes), candidate_cost()
    command = "make bench-optimise" if larger == LARGER else f"python -m tests.bench.optimise --larger {larger}"
    met = {
        f"within {AGREE:g} of the best value of a search {larger} times larger": (
            sum(o.gap <= AGREE for o in outcomes), n
        ),
        f"KKT residual at most {KKT:g}": (sum(o.ours.kkt_residual <= KKT for o in outcomes), 18 * n // 20),
        f"at most {CPU:g} s CPU": (sum(o.cpu <= CPU for o in outcomes), n),
    }  # fmt: skip
    lines = [
        "# The optimiser on random specifications",
        "",
        f"Written by `{command}`; do not edit. What is measured: [optimiser.md](optimiser.md), Marks.",
        "",
        f"Measured on {description()}. Specifications of seed {seed}.",
        "",
        "| mark | asked | found | met |",
        "|---|---|---|---|",
        *(
            f"| {name} | {asked} of {n} | {found} of {n} | {'yes' if found >= asked else '**no**'} |"
            for name, (found, asked) in met.items()
        ),
        f"| candidate, per core: sample, mechanism, limits, objective [us] | 0.3 | {cost['all']:.2f} (sample "
        f"{cost['sample']:.2f}, mechanism {cost['locus']:.2f}) | {'yes' if cost['all'] <= 0.3 else '**no**'} |",
        "",
        "| swing [deg] | phi0 [deg] | pressure angle <= [deg] | max abs d2psi | larger search better by | KKT residual "
        "| CPU [s] | active |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for o in outcomes:
        swing, phi0, pressure = (math.degrees(limit.maximum or 0.0) for limit in o.problem.limits)
        lines.append(
            f"| {swing:.1f} | {phi0:.1f} | {pressure:.1f} | {o.ours.objective:.9f} | {o.gap:.1e} "
            f"| {o.ours.kkt_residual:.0e} | {o.cpu:.2f} | {', '.join(o.ours.active)} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print the page, or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--larger", type=int, default=LARGER)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--out", type=Path, help="file to write, such as docs/optimise-marks.md")
    options = parser.parse_args()
    outcomes = []
    for outcome in measure(options.count, options.larger, jobs=options.jobs, seed=options.seed):
        outcomes.append(outcome)
        print(f"{len(outcomes)} of {options.count}: gap {outcome.gap:.1e}, CPU {outcome.cpu:.2f} s", flush=True)
    text = page(outcomes, options.larger, options.seed)
    if options.out is None:
        print(text)
    else:
        options.out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
