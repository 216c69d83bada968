"""Compare slotted links with crank-rockers: least acceleration for the same swing and the same times.

``python studies/looper-slotted/figure.py FOLDER`` reads the front of the slotted links from FOLDER and searches the
best crank-rocker for each of its stroke ratios.  It writes FOLDER/drives.parquet and FOLDER/figures/drives.svg.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from kernels.status import LIMIT_EXCEEDED
from studies.figure import folder_asked, print_table, save_chart
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.jobs.progress import Phases, Say, unsaid
from sweep.optimise.multistart.multistart import optimum
from sweep.optimise.starts.dataset import random_designs
from sweep.optimise.starts.posing import problem_of
from sweep.report.figures import OPTIMUM, REFERENCE, WIDTH, new_figure
from sweep.study import OptimiseSettings, study_from_data

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sweep.optimise.local.kkt import Result

# The compared crank-rockers: bounds and pressure angle as in study.toml, the swing of its lower limit.
CRANK_ROCKER: dict[str, Any] = {
    "study": {"name": "crank-rocker"},
    "mechanism": {"family": "rssr"},
    "scene": {"want": ["swing", "stroke_ratio", "max_abs_d2psi", "max_pressure_angle"]},
    "locus": {"swing": "50 deg", "phi_ext": {"from": 0, "to": 360, "unit": "deg"}},
    "design": {
        "sample": {"kind": "sobol", "n": 4096, "seed": 56},
        "e": {"from": 0, "to": 40, "unit": "mm"},
        "f": {"from": -40, "to": 40, "unit": "mm"},
        "g": {"from": -20, "to": 20, "unit": "mm"},
        "alpha": {"from": 0, "to": 180, "unit": "deg"},
    },
    "limits": {
        "rotatable": True,
        "max_pressure_angle": {"max": 45, "unit": "deg"},
        "a": {"max": 15, "unit": "mm"},
        "b": {"max": 60, "unit": "mm"},
        "c": {"min": 8, "max": 45, "unit": "mm"},
    },
    "objective": {"minimise": "max_abs_d2psi"},
    "accuracy": {"target": 1e-6},
}
SIGNS = [{"branch": 1.0}, {"branch": -1.0}]
SEED, KNOWN = 56, 16  # designs whose links determine the bounds
STARTS, LOOKS = 12, 1000  # of each stroke ratio, counted, so that a busy machine finds the same
JOBS = 2
OUTPUTS = ["max_abs_d2psi", "max_pressure_angle", "swing", "stroke_ratio"]


def crank_rocker(ratio: float, starts: int) -> Result:
    """Return the crank-rocker of least acceleration for a stroke ratio, or the least infeasible one."""
    locus = CRANK_ROCKER["locus"] | {"phi0": f"{360.0 * ratio / (1.0 + ratio)!r} deg"}
    study = study_from_data(CRANK_ROCKER | {"locus": locus}, Path("crank-rocker"))
    problem = problem_of(study, random_designs(study, KNOWN, SEED), on_locus=False)
    return optimum(problem, SIGNS, OptimiseSettings(starts=starts, seed=SEED, looks=LOOKS), jobs=JOBS)[0]


def crank_rockers(ratios: list[float], starts: int, say: Say = unsaid) -> pd.DataFrame:
    """Return one row per stroke ratio."""
    best: list[Result] = []
    for ratio in ratios:
        say("figure", len(best), len(ratios), "stroke ratios")
        best.append(crank_rocker(ratio, starts))
    say("figure", len(best), len(ratios), "stroke ratios")
    designs = np.array([result.design for result in best])
    found = design_outputs(family("rssr"), designs, OUTPUTS, Accuracy(target=1e-6))
    links = dict(zip(family("rssr").parameter_names, designs.T, strict=True))
    status = [result.status for result in best]
    return pd.DataFrame(links | {name: found[name] for name in OUTPUTS} | {"status": status, "ratio": ratios})


def table(front: pd.DataFrame, starts: int, say: Say = unsaid) -> pd.DataFrame:
    """Return one row per stroke ratio and mechanism; one that misses a limit has status LIMIT_EXCEEDED."""
    slotted = front.sort_values("bound").assign(mechanism="slotted link", ratio=lambda rows: rows["bound"])
    others = crank_rockers(slotted["ratio"].tolist(), starts, say).assign(mechanism="crank-rocker")
    both = pd.concat([slotted, others], ignore_index=True)
    return both[["mechanism", "ratio", *OUTPUTS, "status", "a", "b", "c", "e", "f", "g", "alpha", "s", "branch"]]


def chart(drives: pd.DataFrame) -> Figure:
    """Draw acceleration against the stroke ratio."""
    figure = new_figure(WIDTH, 4.6)
    axes = figure.subplots()
    for name, colour in (("slotted link", OPTIMUM), ("crank-rocker", REFERENCE)):
        rows = drives[(drives["mechanism"] == name) & (drives["status"] != LIMIT_EXCEEDED)]
        axes.plot(rows["ratio"], rows["max_abs_d2psi"], "o-", color=colour, label=name)
    axes.axhline(np.radians(25.0), color="#8a8f98", linewidth=1.0, linestyle="--", label="sine of 50° swing")
    axes.set_xlabel("time forward / time back")
    axes.set_ylabel("least max |ψ″| for 50° of swing [1/rad]")
    axes.legend()
    return figure


def main() -> None:
    """Read the front of a run, search the crank-rockers, write table and chart."""
    folder = folder_asked(__doc__)
    front = pd.read_parquet(folder / "_pareto.parquet")
    small = len(front) < 4  # smoke
    with Phases(show=True, quiet=False) as phases:
        drives = table(front, 2 if small else STARTS, phases.say)
    drives.to_parquet(folder / "drives.parquet", index=False)
    print_table(drives, "{:.4g}")
    save_chart(folder, "drives", lambda: chart(drives))


if __name__ == "__main__":
    main()
