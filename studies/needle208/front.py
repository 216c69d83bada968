"""Search the least acceleration of the needle drive for other limits of its deviation; this takes minutes.

``python studies/needle208/front.py FOLDER`` starts from the optimum and the price.csv in FOLDER.  It writes
FOLDER/front.csv (deviation that 95 % of the drives made keep, and least acceleration) and FOLDER/figures/front.svg.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from sweep.jobs.progress import Phases, Say, unsaid
from sweep.jobs.signals import stop_on_signal
from sweep.optimise.manufacture.robust import Robust, robust
from sweep.optimise.multistart.parallel import spread_over
from sweep.optimise.starts.posing import problem_of
from sweep.report.figures import OPTIMUM, REFERENCE, WIDTH, house_style, new_figure, save
from sweep.study import Limit, OptimiseSettings, Study, Tolerance, load_study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sweep.families.base import Array
    from sweep.optimise.problem.statement import Problem

FOLDER = Path(__file__).parent
ROUNDS = ((0.04, 0.07), (0.035, 0.1))  # deviations of 95 % of the mechanisms [mm], on either side of the study's limit


@dataclass(frozen=True)
class Bound:
    """Robust search for one of some deviations, from its neighbour's design: a task for processes."""

    problem: Problem
    tolerance: Tolerance
    deviations: tuple[float, ...]
    designs: tuple[Array, ...]

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> Robust:
        """Return the drive of least acceleration within a deviation."""
        limits = tuple(
            Limit(x.output, x.minimum, self.deviations[number]) if x.output == "max_abs_dev" else x
            for x in self.problem.limits
        )
        settings = OptimiseSettings(starts=1)
        problem, start = replace(self.problem, limits=limits), self.designs[number][None, :]
        found = robust(problem, [], self.tolerance, settings, should_stop, 1, start)
        assert found is not None  # there is a start
        return found


def front(study: Study, optimum: pd.Series, jobs: int, say: Say = unsaid) -> pd.DataFrame:
    """Return the least acceleration for limits on the deviation of 95 % of mechanisms, from neighbouring designs."""
    if study.tolerance is None:
        raise ValueError("the study has no tolerances")
    design = optimum[list(study.family.parameter_names)].to_numpy(np.float64)
    problem = problem_of(study, np.array([0.7 * design, 1.3 * design]))
    own = next(x.maximum for x in problem.limits if x.output == "max_abs_dev")
    share = study.tolerance.robust or 0.0
    rows = [{"deviation": own, "acceleration": optimum["max_abs_d2s"], "share": optimum["yield"], "kept": True}]
    near, counted, total = (design,) * len(ROUNDS[0]), count(1), sum(map(len, ROUNDS))
    say("front", 0, total, "searches")
    with stop_on_signal() as stop:
        for deviations in ROUNDS:
            task, numbers = Bound(problem, study.tolerance, deviations, near), list(range(len(deviations)))
            found = spread_over(
                task, numbers, lambda: bool(stop), jobs, lambda _, __: say("front", next(counted), total, "searches")
            )
            if stop:
                raise KeyboardInterrupt
            near = tuple(x.result.design for x in found)
            rows += [
                {"deviation": bound, "acceleration": x.result.objective, "share": x.share, "kept": x.share >= share}
                for bound, x in zip(deviations, found, strict=True)
            ]
    return pd.DataFrame(rows).sort_values("deviation", ignore_index=True)


def chart(table: pd.DataFrame, mechanisms: pd.DataFrame) -> Figure:
    """Draw the front, with the manufactured mechanisms."""
    figure = new_figure(WIDTH, 3.8)
    axes = figure.subplots()
    held = table[table["kept"]]
    front_of = "least where 95 % of what is made keep this and all other limits"
    axes.plot(held["deviation"], held["acceleration"], "o-", color=OPTIMUM, label=front_of)
    for name, made, value in mechanisms[["mechanism", "deviation of 95 % made", "acceleration"]].itertuples(
        index=False
    ):
        if name != "reference":
            axes.plot(made, value, "s", color=REFERENCE)
            words = {"optimum": "to be built", "nominal": "best drawing"}.get(name, name)
            axes.annotate(words, (made, value), xytext=(0, -16), textcoords="offset points", ha="center")
    axes.margins(0.15)
    axes.set_xlabel("deviation [mm]: limit of the front; of a mechanism what 95 % of those made keep")
    axes.set_ylabel("max |s″| [mm/rad²]")
    axes.legend()
    return figure


def main() -> None:
    """Read the optimum of a run, search the front, write table and chart."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="results of the study, with its designs/ and price.csv")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    given = parser.parse_args()
    folder: Path = given.folder
    optimum = pd.read_parquet(folder / "_optimum.parquet").iloc[0]
    with Phases(show=True, quiet=False) as phases:
        points = front(load_study(FOLDER), optimum, given.jobs, phases.say)
    points.to_csv(folder / "front.csv", index=False)
    print(points.to_string(index=False, float_format="{:.5g}".format))  # noqa: T201
    with house_style():
        picture = chart(points, pd.read_csv(folder / "price.csv"))
        print(save(picture, folder / "figures" / "front.svg"))  # noqa: T201


if __name__ == "__main__":
    main()
