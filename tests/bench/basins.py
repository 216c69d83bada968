"""Which basins the search over proportions finds: the record of needle208, five seeds of each of its requirements."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from studies.accuracy.machine import description
from sweep.optimise.local.kkt import AGREE
from sweep.optimise.local.start import search
from sweep.optimise.starts.dataset import kinds, random_designs
from sweep.optimise.starts.linear import elimination
from sweep.optimise.starts.populations import population
from sweep.optimise.starts.posing import problem_of
from sweep.optimise.starts.proportions import Proportions, enclosing
from sweep.study import Study
from tests.support.needle208_record import FOLDER, record
from tests.support.starts import populations_ended_at

SEEDS = 5
LEAST = {"record": None, "record_8mm": 8.0}  # shortest link of stage 2 [mm], by the name of the design in expected.json
WORDS = {"record": "links of any length", "record_8mm": "links of stage 2 of at least 8 mm"}


@dataclass(frozen=True)
class Row:
    """One population of a seed: the value its best end leads to [mm/rad^2], nan where that is not feasible.

    ``worth`` is what the poses made of that end, ``cpu`` [s] is the processor time of the population,
    ``searched`` [s] that of the local search.
    """

    problem: str
    seed: int
    number: int
    value: float
    residual: float
    worth: float
    cpu: float
    searched: float


def best_known(problem: str) -> float:
    """The least acceleration known of a problem [mm/rad^2]."""
    expected = json.loads((FOLDER / "expected.json").read_text(encoding="utf-8"))
    return float(expected[problem]["outputs"]["max_abs_d2s"])


def most(study: Study) -> int:
    """Populations at most."""
    assert study.optimise is not None
    return study.optimise.populations


def told(study: Study, rows: Sequence[Row]) -> bool:
    """Whether the populations of a seed are enough, by the study's own rule."""
    assert study.optimise is not None
    known = [[row.value for row in rows[:n]] for n in range(1, len(rows) + 1)]
    return len(rows) >= most(study) or any(populations_ended_at(some, study.optimise).enough for some in known)


def fewest(study: Study) -> int:
    """Populations that the rule asks for at least, whatever they end at: those that all end at one value."""
    assert study.optimise is not None
    each = ([1.0] * n for n in range(1, most(study)))
    return next((len(some) for some in each if populations_ended_at(some, study.optimise).enough), most(study))


def hit(row: Row) -> bool:
    """Whether a population has found the best basin known, or a better one."""
    return row.value <= best_known(row.problem) * (1.0 + AGREE)


def populations(problem: str, seed: int, rows: Sequence[Row]) -> Iterator[Row]:
    """Populations of a seed after those that are there, until they tell enough.

    The sweep's own starts are left out, so that the populations have to find the basin.
    """
    study = record(LEAST[problem], seed=seed)
    assert study.optimise is not None
    known = random_designs(study, study.optimise.starts, study.optimise.seed)
    own = problem_of(study, known)
    linear = elimination(own)
    assert linear is not None
    landscape = Proportions(linear, kinds(study, own, known[:0]))
    found = list(rows)
    while not told(study, found):
        times = [time.process_time()]
        bred = population(landscape, (seed, len(found)))
        times.append(time.process_time())
        end = search(0, enclosing(study, own, bred.designs[:1]), bred.designs[0], lambda: False, study.optimise.looks)
        times.append(time.process_time())
        found.append(
            Row(
                problem, seed, len(found), end.objective if end.feasible else float("nan"), end.kkt_residual,
                float(bred.merit[0]), times[1] - times[0], times[2] - times[1],
            )
        )  # fmt: skip
        yield found[-1]


def kept(path: Path) -> list[Row]:
    """Rows of earlier runs, one JSON object a line."""
    return [Row(**json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()] if path.exists() else []


def page(rows: Sequence[Row]) -> str:
    """The table of all seeds, as markdown."""
    lines = [
        "# Basins that the search over proportions finds", "",
        "Written by `make bench-basins`; do not edit. What is measured: "
        "[how the optimiser searches](optimiser.md), Proportions.", "",
        f"Measured on {description()}. Needle drive of a class-208 machine, 0.015 mm of the drawing alone and a stroke "
        "of at least 24.495 mm; the sweep's own starts are left out. The study makes at least "
        f"{fewest(record())} populations of every seed, whatever they end at, and at most {most(record())}; "
        "what one of the first of them finds is found.", "",
        "| requirement | best known [mm/rad^2] | seed | populations made | first that ends at the best "
        "| found by the study | processor time of a population [s] |",
        "|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for problem in LEAST:
        for seed in sorted({row.seed for row in rows if row.problem == problem}):
            own = [row for row in rows if (row.problem, row.seed) == (problem, seed)]
            hits = [row.number + 1 for row in own if hit(row)]
            study = record(LEAST[problem], seed=seed)
            over = told(study, own)
            found = "yes" if hits and (hits[0] <= fewest(study) or over) else "**no**" if over else "not yet"
            cpu = sum(row.cpu + row.searched for row in own) / len(own)
            first = str(hits[0]) if hits else "none"
            best = f"{best_known(problem):.6f}"
            cells = (WORDS[problem], best, seed, len(own), first, found, f"{cpu:.0f}")
            lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Search what is left to search, then print the table or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path, required=True, help="file of the populations so far; a run goes on there")
    parser.add_argument("--problems", nargs="+", choices=list(LEAST), default=list(LEAST))
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(1, SEEDS + 1)))
    parser.add_argument("--until-met", action="store_true", help="leave a seed as soon as it has met the best known")
    parser.add_argument("--out", type=Path, help="page to write, such as docs/internals/basins.md")
    options = parser.parse_args()
    rows = kept(options.keep)
    for problem in options.problems:
        for seed in options.seeds:
            own = [r for r in rows if (r.problem, r.seed) == (problem, seed)]
            if options.until_met and any(hit(row) for row in own):
                continue
            for row in populations(problem, seed, own):
                rows.append(row)
                with options.keep.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(asdict(row)) + "\n")
                where = f"{problem} seed {seed} population {row.number}"
                print(f"{where}: {row.value:.6f}, CPU {row.cpu:.1f} s", flush=True)
                if options.until_met and hit(row):
                    break
    if options.out is None:
        print(page(rows))
    else:
        options.out.write_text(page(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
