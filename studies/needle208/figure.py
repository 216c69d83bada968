"""Compare the needle drive to be built with the record on paper, the best drawing and the reference.

``python studies/needle208/figure.py FOLDER`` reads study and optimum in FOLDER and writes FOLDER/price.csv and
FOLDER/figures/price.svg.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from studies.figure import folder_asked, print_table, save_chart
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.jobs.progress import Phases, Say, unsaid
from sweep.optimise.manufacture.margins import inequalities
from sweep.optimise.manufacture.sample import Sampler, keeping
from sweep.optimise.starts.posing import problem_of
from sweep.report.dataset import read_dataset
from sweep.report.figures import LIMIT, OPTIMUM, QUIET, REFERENCE, WIDTH, new_figure
from sweep.study import Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sweep.families.base import Array

FOLDER = Path(__file__).parent
RECORD = "record on paper"
WORDS = {"optimum": "to be built", "nominal": "best drawing"}
SAMPLES = 8192
LINKS = ["a2", "b2", "c2", "e2"]


def mechanisms(study: Study, folder: Path) -> dict[str, Array]:
    """Return reference, record on paper, best drawing and drive to be built, if the run has them."""
    found = pd.read_parquet(folder / "_optimum.parquet").drop_duplicates("role").set_index("role")
    record = json.loads((FOLDER / "expected.json").read_text())["record"]["design"]
    names = list(study.family.parameter_names)
    known = {role: found.loc[role, names].to_numpy(np.float64) for role in found.index}
    known[RECORD] = design_matrix(study.family, record)[0][0]
    return {role: known[role] for role in ("reference", RECORD, "nominal", "optimum") if role in known}


def price(study: Study, designs: dict[str, Array], say: Say = unsaid) -> pd.DataFrame:
    """Return acceleration, nominal and manufactured deviation, yields, shortest link, arm and size of mechanisms."""
    if study.tolerance is None:
        raise ValueError("the study has no tolerances")
    names, rows = study.family.parameter_names, list[dict[str, str | float]]()
    lengths = [k for k, p in enumerate(study.family.parameters) if p.unit == "length"]
    problem = problem_of(study, np.array(list(designs.values())))
    most = next(x.maximum for x in study.output_limits if x.output == "max_abs_dev")
    assert most is not None
    for name, design in designs.items():
        say("figure", len(rows), len(designs), "mechanisms")
        drawn = design_outputs(study.family, design[None, :], ["max_abs_d2s", "max_abs_dev"], study.accuracy)
        sampler = Sampler(problem, replace(study.tolerance, samples=SAMPLES), 1)
        made = sampler.outputs(design, [limit.output for limit in inequalities(problem)])
        good = keeping(inequalities(problem), made)
        deviation = np.nan_to_num(made["max_abs_dev"].astype(np.float64), nan=np.inf)
        value = dict(zip(names, design.tolist(), strict=True))
        rows.append(
            {
                "mechanism": name,
                "acceleration": float(drawn["max_abs_d2s"][0]),
                "deviation drawn": float(drawn["max_abs_dev"][0]),
                "deviation of 95 % made": float(np.quantile(deviation, 0.95)),
                f"made within {most:g} mm [%]": 100.0 * float((deviation <= most).mean()),
                "made within every limit [%]": 100.0 * float(good.mean()),
                "shortest link of stage 2": min(abs(value[link]) for link in LINKS),
                "coupler point from crank pin": float(np.hypot(value["xi2"], value["eta2"])),
                "size": float(np.abs(design[lengths]).max()),
            }
        )
    say("figure", len(rows), len(designs), "mechanisms")
    return pd.DataFrame(rows)


def chart(table: pd.DataFrame, most: float) -> Figure:
    """Draw acceleration, nominal and manufactured deviation, and yield of the mechanisms, side by side."""
    figure = new_figure(WIDTH, 2.4)
    panels = figure.subplots(1, 3, sharey=True)
    place = np.arange(len(table))[::-1]
    colours = [{"optimum": OPTIMUM, "reference": REFERENCE}.get(name, QUIET) for name in table["mechanism"]]
    for axes, name, title, digits, clear in (
        (panels[0], "acceleration", "max |s″| [mm/rad²]", 2, 0.0),
        (panels[1], "deviation of 95 % made", "deviation of 95 % made [mm]", 3, most),
        (panels[2], "made within every limit [%]", "made within every limit [%]", 0, 0.0),
    ):
        axes.barh(place, table[name], color=colours, alpha=0.5 if clear else 1.0)
        for at, value in zip(place, table[name], strict=True):
            words = f"{value:.{digits}f}"
            axes.annotate(words, (max(value, clear), at), (3, 0), textcoords="offset points", va="center")
        axes.set_title(title)
        axes.grid(axis="y", visible=False)
        axes.set_xlim(0.0, 1.25 * table[name].max())
    panels[1].barh(place, table["deviation drawn"], color=colours, height=0.3)
    panels[1].axvline(most, color=LIMIT, linewidth=1.0, linestyle="--")
    panels[0].set_yticks(place, [WORDS.get(name, name) for name in table["mechanism"]])
    return figure


def main() -> None:
    """Read the optimum of a run, write table and chart."""
    folder = folder_asked(__doc__)
    study = read_dataset(folder / "designs").study
    with Phases(show=True, quiet=False) as phases:
        table = price(study, mechanisms(study, folder), phases.say)
    table.to_csv(folder / "price.csv", index=False)
    print_table(table, "{:.5g}")
    most = next(x.maximum for x in study.output_limits if x.output == "max_abs_dev")
    save_chart(folder, "price", lambda: chart(table, most or 0.0))


if __name__ == "__main__":
    main()
