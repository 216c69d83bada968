"""Random specifications of a spatial crank-rocker, three seeds each, against differential evolution."""

from __future__ import annotations

import argparse
import json
import math
import statistics
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import islice, pairwise
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from studies.accuracy.machine import description
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise import Problem, on_locus, optimum
from sweep.optimise.local.descent import KKT
from sweep.optimise.local.kkt import AGREE, Result
from sweep.optimise.starts.ranked import BLOCK, ranking
from sweep.study import Limit, OptimiseSettings
from tests.bench.differential import differential

STARTS, SEED = 24, 1971
COUNT, SEEDS = 60, 3
CPU = 6.0  # seconds of processor time of the slowest seed of a specification
RSSR = family("rssr")
NAMES = ("a", "b", "c", "e", "f", "g", "alpha")  # all seven dimensions in boxes
LOW = np.array([0.1, 0.5, 0.5, 0.0, -1.5, -1.5, 0.0])
HIGH = np.array([0.9, 4.0, 1.5, 2.5, 1.5, 1.5, math.pi / 2])
PHI0, STEEP = (
    math.radians(30.0),
    (math.radians(35.0), math.radians(60.0)),
)  # 180 -+ 30 deg; limits of the pressure angle


@dataclass(frozen=True)
class Row:
    """What the page says of one specification: angles [deg], processor times [s] of each seed and of all searches.

    ``searches`` are the starts of the three seeds, ``optima`` those that ended at a local optimum, ``relaxed`` those
    that ended outside of the limits where these are missed by the least around.
    """

    swing: float
    phi0: float
    pressure: float
    objective: float
    gap: float
    missed: int
    residual: float
    cpu: tuple[float, ...]
    whole: float
    searches: int
    optima: int
    active: tuple[str, ...]
    relaxed: int = 0


@dataclass(frozen=True)
class Outcome:
    """One specification: results of every seed, and from differential evolution; CPU time of each seed, of all [s]."""

    problem: Problem
    found: tuple[list[Result], ...]
    evolved: list[Result]
    cpu: tuple[float, ...]
    whole: float

    @property
    def ours(self) -> Result:
        """The answer of the worst seed."""
        return max((results[0] for results in self.found), key=_order)

    @property
    def best(self) -> Result:
        """The best answer of all."""
        return min((*(results[0] for results in self.found), *self.evolved[:1]), key=_order)

    @property
    def gap(self) -> float:
        """By how much the best is better than the worst seed, relative; infinite where that one is not feasible."""
        return behind(self.ours, self.best)

    @property
    def row(self) -> Row:
        """What the page says of it."""
        swing, phi0, pressure = (math.degrees(limit.maximum or 0.0) for limit in self.problem.limits)
        missed = sum(behind(results[0], self.best) > AGREE for results in self.found)
        ends = [r.ended for results in self.found for r in results]
        relaxed = sum(r.ended == "infeasible" and r.kkt_residual <= KKT for results in self.found for r in results)
        return Row(
            swing, phi0, pressure, self.ours.objective, self.gap, missed, self.ours.kkt_residual, self.cpu, self.whole,
            len(ends), ends.count("converged"), self.ours.active, relaxed,
        )  # fmt: skip


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


def solve(problem: Problem, starts: int, seed: int) -> list[Result]:
    """Results of a search from at most so many starts, both branches, the best first."""
    settings = OptimiseSettings(starts=starts, seed=seed)
    return optimum(problem, [{"branch": 1.0}, {"branch": -1.0}], settings)


def measure(
    count: int, starts: int = STARTS, seed: int = SEED, seeds: int = SEEDS, first: int = 0
) -> Iterator[Outcome]:
    """Outcomes of ``count`` specifications from number ``first`` on, one after the other."""
    solve(next(specifications(seed + 1)), 1, 0)  # compiles
    for number, problem in islice(enumerate(specifications(seed)), first, first + count):
        times, found = [time.process_time()], []
        for k in range(seeds):
            found.append(solve(problem, starts, number + 10_000 * k))
            times.append(time.process_time())
        evolved = differential(on_locus(problem), number)
        spent = tuple(end - begin for begin, end in pairwise(times))
        yield Outcome(problem, tuple(found), evolved, spent, time.process_time() - times[0])


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


def page(rows: Sequence[Row], seed: int) -> str:
    """Which marks are met, and the specifications that miss one, as markdown."""
    n, cost = len(rows), candidate_cost()
    command = "make bench-optimise" if seed == SEED else "python -m tests.bench.optimise"
    times = sorted(cpu for row in rows for cpu in row.cpu)
    searches, optima = sum(row.searches for row in rows), sum(row.optima for row in rows)
    met = {
        f"every seed within {AGREE:g} of the best value of all and of differential evolution": (
            sum(row.missed == 0 for row in rows), n
        ),
        f"KKT residual at most {KKT:g}": (sum(row.residual <= KKT for row in rows), n),
        f"at most {CPU:g} s of processor time for the slowest seed": (sum(max(row.cpu) <= CPU for row in rows), n),
    }  # fmt: skip
    lines = [
        "# The optimiser on random specifications",
        "",
        f"Written by `{command}`; do not edit. What is measured: [the optimiser](../optimiser.md), Marks.",
        "",
        f"Measured on {description()}. Specifications of seed {seed}, {len(rows[0].cpu)} seeds of the search. "
        f"The whole took {sum(row.whole for row in rows) / 60.0:.0f} minutes of processor time.",
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
        f"Processor time per specification and seed: {times[0]:.1f} to {times[-1]:.1f} s, median "
        f"{statistics.median(times):.1f} s, nine of ten below {times[int(0.9 * (len(times) - 1))]:.1f} s. Of the "
        f"{searches} starts of these searches {optima} ended at a local optimum (KKT residual at most {KKT:g}), "
        f"{sum(row.relaxed for row in rows)} at the smallest relaxation of limits that they could not keep.",
        "",
        f"The worst seed is at most {max(row.gap for row in rows):.1e} above the best value, its KKT residual at most "
        f"{max(row.residual for row in rows):.0e}, its processor time at most {times[-1]:.1f} s.",
    ]
    missed = [row for row in rows if row.missed or row.residual > KKT or max(row.cpu) > CPU]
    if missed:
        lines += [
            "",
            "| swing [deg] | phi0 [deg] | pressure angle <= [deg] | max abs d2psi of the worst seed | best better by "
            "| seeds that missed | KKT residual | CPU of the slowest seed [s] | active |",
            "|---|---|---|---|---|---|---|---|---|",
        ]
    lines += [
        f"| {row.swing:.1f} | {row.phi0:.1f} | {row.pressure:.1f} | {row.objective:.9f} | {row.gap:.1e} "
        f"| {row.missed} | {row.residual:.0e} | {max(row.cpu):.2f} | {', '.join(row.active)} |"
        for row in missed
    ]
    return "\n".join(lines) + "\n"


def kept(path: Path | None) -> list[Row]:
    """Rows that an earlier run has left in a file, one JSON object a line."""
    if path is None or not path.exists():
        return []
    read = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    return [Row(**content | {name: tuple(content[name]) for name in ("cpu", "active")}) for content in read]


def main() -> None:
    """Print the page, or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--out", type=Path, help="file to write, such as docs/internals/optimise-marks.md")
    parser.add_argument("--keep", type=Path, help="file of the rows so far: a run with the same options goes on there")
    options = parser.parse_args()
    rows = kept(options.keep)
    for outcome in measure(options.count - len(rows), seed=options.seed, first=len(rows)):
        rows.append(outcome.row)
        if options.keep is not None:
            with options.keep.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(rows[-1])) + "\n")
        row = rows[-1]
        settled = row.optima + row.relaxed
        text = f"best better by {row.gap:.1e}, {row.missed} seeds missed, {settled} of {row.searches} starts settled"
        print(f"{len(rows)} of {options.count}: {text}, CPU {row.whole:.1f} s", flush=True)
    text = page(rows, options.seed)
    if options.out is None:
        print(text)
    else:
        options.out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
