"""Random specifications of a spatial crank-rocker, three seeds each, against a larger search."""

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

STARTS, LARGER, SEED = 24, 8, 1971
COUNT, SEEDS = 60, 3
CPU = 8.0  # seconds per specification and seed
RSSR = family("rssr")
NAMES = ("a", "b", "c", "e", "f", "g", "alpha")  # all seven dimensions in boxes
LOW = np.array([0.1, 0.5, 0.5, 0.0, -1.5, -1.5, 0.0])
HIGH = np.array([0.9, 4.0, 1.5, 2.5, 1.5, 1.5, math.pi / 2])
PHI0, STEEP = (
    math.radians(30.0),
    (math.radians(35.0), math.radians(60.0)),
)  # 180 -+ 30 deg; limits of the pressure angle


@dataclass(frozen=True)
class Outcome:
    """One specification: the worst of the searches of all seeds, the best of all and the larger one, CPU time [s]."""

    problem: Problem
    ours: Result
    best: Result
    cpu: float
    missed: int

    @property
    def gap(self) -> float:
        """By how much the best is better than the worst seed, relative; infinite where that one is not feasible."""
        return behind(self.ours, self.best)


def behind(ours: Result, best: Result) -> float:
    """By how much another result is better, relative; infinite where ours is not feasible and it is."""
    if ours.violation > 1e-9:
        return math.inf if best.violation <= 1e-9 else 0.0
    return max(0.0, ours.objective / best.objective - 1.0)


def specifications(seed: int) -> Iterator[Problem]:
    """Swing and phi0 of a random mechanism that turns, a limit of the pressure angle at or above its own, a random box.

    The mechanism itself is not told to the search; it makes sure that there is a solution.
    """
    rng = np.random.default_rng(seed)
    while True:
        middle = LOW + rng.random(len(NAMES)) * (HIGH - LOW)
        lower, upper = LOW + 0.7 * rng.random() * (middle - LOW), HIGH - 0.7 * rng.random() * (HIGH - middle)
        names = ["swing", "phi0", "max_pressure_angle", "margin"]
        design = [*middle, rng.choice([-1.0, 1.0])]
        found = design_outputs(RSSR, np.array([design]), names, Accuracy(target=1e-9))
        swing, phi0, pressure, margin = (float(found[name][0]) for name in names)
        hard = abs(phi0 - math.pi) < PHI0 and pressure < STEEP[1]
        if not margin > 0.1 or not 0.35 < abs(swing) < 2.0 or not hard:
            continue
        limit = max(pressure, STEEP[0]) + rng.random() * (STEEP[1] - max(pressure, STEEP[0]))
        limits = (
            Limit("swing", abs(swing), abs(swing)),
            Limit("phi0", phi0, phi0),
            Limit("max_pressure_angle", None, limit),
        )
        yield Problem(RSSR, NAMES, lower, upper, {}, "max_abs_d2psi", limits)


def solve(problem: Problem, starts: int, seed: int, jobs: int = 1, unseen: float = 0.02) -> Result:
    """Best result of a search from at most so many starts, both branches."""
    settings = OptimiseSettings(starts=starts, seed=seed, unseen=unseen)
    return optimum(problem, [{"branch": 1.0}, {"branch": -1.0}], settings, jobs=jobs)[0]


def measure(
    count: int, larger: int = LARGER, starts: int = STARTS, jobs: int = 1, seed: int = SEED, seeds: int = SEEDS
) -> Iterator[Outcome]:
    """Outcomes of the first specifications, one after the other."""
    problems = specifications(seed)
    solve(next(specifications(seed + 1)), 1, 0)  # compiles
    for number in range(count):
        problem = next(problems)
        begin = time.process_time()
        ours = [solve(problem, starts, number + 10_000 * k) for k in range(seeds)]
        cpu = (time.process_time() - begin) / seeds
        # The larger search has another sample, of so many times the size, and ends when its starts do.
        other = solve(problem, starts * larger, number + 1000, jobs, unseen=0.0)
        best = min([*ours, other], key=_order)
        worst = max(ours, key=_order)
        yield Outcome(problem, worst, best, cpu, sum(behind(result, best) > AGREE for result in ours))


def _order(result: Result) -> tuple[bool, float]:
    infeasible = result.violation > 1e-9
    return infeasible, result.violation if infeasible else result.objective


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
        f"every seed within {AGREE:g} of the best value of all and of a search {larger} times larger": (
            sum(o.missed == 0 for o in outcomes), n
        ),
        f"KKT residual at most {KKT:g}": (sum(o.ours.kkt_residual <= KKT for o in outcomes), 18 * n // 20),
        f"at most {CPU:g} s CPU per seed": (sum(o.cpu <= CPU for o in outcomes), n),
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
        "| swing [deg] | phi0 [deg] | pressure angle <= [deg] | max abs d2psi of the worst seed | best better by "
        "| seeds that missed | KKT residual | CPU [s] | active |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for o in outcomes:
        swing, phi0, pressure = (math.degrees(limit.maximum or 0.0) for limit in o.problem.limits)
        lines.append(
            f"| {swing:.1f} | {phi0:.1f} | {pressure:.1f} | {o.ours.objective:.9f} | {o.gap:.1e} "
            f"| {o.missed} | {o.ours.kkt_residual:.0e} | {o.cpu:.2f} | {', '.join(o.ours.active)} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print the page, or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--larger", type=int, default=LARGER)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--out", type=Path, help="file to write, such as docs/optimise-marks.md")
    options = parser.parse_args()
    outcomes = []
    for outcome in measure(options.count, options.larger, jobs=options.jobs, seed=options.seed):
        outcomes.append(outcome)
        text = f"gap {outcome.gap:.1e}, {outcome.missed} seeds missed, CPU {outcome.cpu:.2f} s"
        print(f"{len(outcomes)} of {options.count}: {text}", flush=True)
    text = page(outcomes, options.larger, options.seed)
    if options.out is None:
        print(text)
    else:
        options.out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
