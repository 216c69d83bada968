"""What it costs to build the needle drive: record on paper, drawing, robust optimum and reference, and a front.

``python studies/needle208/figure.py FOLDER`` reads the optimum in FOLDER and writes FOLDER/price.csv (the mechanisms
side by side), FOLDER/front.csv (least acceleration for other deviations of what is made) and FOLDER/figures/front.svg.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.optimise.manufacture.margins import bounded
from sweep.optimise.manufacture.robust import robust
from sweep.optimise.manufacture.tolerance import deviating
from sweep.optimise.starts.posing import problem_of
from sweep.report.figures import OPTIMUM, REFERENCE, WIDTH, house_style, new_figure, save
from sweep.study import Limit, OptimiseSettings, Study, load_study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLDER = Path(__file__).parent
DEVIATIONS = (0.035, 0.04, 0.05, 0.07, 0.1)  # of 95 % of what is made [mm]
SAMPLES = 8192
LOOKS = 2000  # of each search of the front
FEW = 3  # starts of a smoke version are fewer
OUTPUTS = ["max_abs_d2s", "max_abs_dev", "stroke"]
LINKS = ["a2", "b2", "c2", "e2"]


def price(study: Study, mechanisms: dict[str, np.ndarray]) -> pd.DataFrame:
    """Acceleration, deviation as drawn and as made, shortest link, arm and size of mechanisms side by side."""
    if study.tolerance is None:
        raise ValueError("the study has no tolerances")
    names = study.family.parameter_names
    rows = []
    for name, design in mechanisms.items():
        drawn = design_outputs(study.family, design[None, :], OUTPUTS, study.accuracy)
        made = deviating(study.family, design, study.tolerance, 1, SAMPLES)
        columns = design_outputs(study.family, made, ["max_abs_dev"], study.accuracy)
        found = np.asarray(columns["max_abs_dev"], np.float64)
        value = dict(zip(names, design.tolist(), strict=True))
        rows.append(
            {
                "mechanism": name,
                "acceleration": float(drawn["max_abs_d2s"][0]),
                "deviation drawn": float(drawn["max_abs_dev"][0]),
                "deviation of 95 % made": float(np.quantile(np.nan_to_num(found, nan=np.inf), 0.95)),
                "made within 0.05 mm [%]": 100.0 * float((found <= 0.05).mean()),
                "shortest link of stage 2": min(abs(value[link]) for link in LINKS),
                "coupler point from crank pin": float(np.hypot(value["xi2"], value["eta2"])),
                "size": max(
                    abs(x) for k, x in value.items() if study.family.parameters[names.index(k)].unit == "length"
                ),
            }
        )
    return pd.DataFrame(rows)


def front(study: Study, optimum: np.ndarray, deviations: tuple[float, ...], looks: int, jobs: int) -> pd.DataFrame:
    """Least acceleration where 95 % of what is made deviate by at most so much, each from its neighbour's mechanism."""
    if study.tolerance is None:
        raise ValueError("the study has no tolerances")
    problem = problem_of(study, np.array([0.7 * optimum, 1.3 * optimum]))
    own = next(x for x in bounded(problem) if x.output == "max_abs_dev")
    settings = OptimiseSettings(starts=1, looks=looks)
    start: dict[float, np.ndarray] = {own.maximum or 0.05: optimum}
    rows = []
    for bound in sorted(deviations, key=lambda x: abs(x - (own.maximum or 0.05))):
        near = start[min(start, key=lambda x: abs(x - bound))]
        limits = tuple(Limit(x.output, x.minimum, bound) if x.output == own.output else x for x in problem.limits)
        found = robust(replace(problem, limits=limits), [], study.tolerance, settings, None, jobs, near[None, :])
        if found is None:
            continue
        start[bound] = found.result.design
        kept = found.share >= (study.tolerance.robust or 0.0)
        rows.append({"deviation": bound, "acceleration": found.result.objective, "share": found.share, "kept": kept})
    return pd.DataFrame(rows).sort_values("deviation", ignore_index=True)


def alone(mechanisms: pd.DataFrame) -> pd.DataFrame:
    """Front of a smoke version, whose optimum is too rough to begin others with: the optimum alone."""
    own = mechanisms[mechanisms["mechanism"] == "optimum"]
    found = {"deviation": own["deviation of 95 % made"], "acceleration": own["acceleration"]}
    return pd.DataFrame({**found, "share": own["made within 0.05 mm [%]"] / 100.0, "kept": True})


def chart(table: pd.DataFrame, mechanisms: pd.DataFrame) -> Figure:
    """Front, with the mechanisms as they are made."""
    figure = new_figure(WIDTH, 3.8)
    axes = figure.subplots()
    kept = table[table["kept"]]
    front_of = "least where 95 % of what is made keep this and all other limits"
    axes.plot(kept["deviation"], kept["acceleration"], "o-", color=OPTIMUM, label=front_of)
    for row in mechanisms[mechanisms["mechanism"] != "reference"].itertuples():
        axes.plot(row[4], row[2], "s", color=REFERENCE)
        words = {"optimum": "to be built", "nominal": "best drawing"}.get(str(row.mechanism), str(row.mechanism))
        axes.annotate(words, (row[4], row[2]), xytext=(0, -16), textcoords="offset points", ha="center")
    axes.margins(0.15)
    axes.set_xlabel("deviation [mm]: limit of the front; of a mechanism what 95 % of those made keep")
    axes.set_ylabel("max |s″| [mm/rad²]")
    axes.legend()
    return figure


def main() -> None:
    """Read the optimum of a run, write both tables and the chart."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="results of the study, with its designs/")
    folder: Path = parser.parse_args().folder
    study = load_study(FOLDER)
    names = study.family.parameter_names
    found = pd.read_parquet(folder / "_optimum.parquet")
    by_role = {role: found[found["role"] == role].iloc[0] for role in ("optimum", "nominal", "reference")
               if (found["role"] == role).any()}  # fmt: skip
    mechanisms = {role: row[list(names)].to_numpy(np.float64) for role, row in by_role.items()}
    record = json.loads((FOLDER / "expected.json").read_text())["record"]["design"]
    mechanisms["record on paper"] = design_matrix(study.family, record)[0][0]
    table = price(study, mechanisms)
    table.to_csv(folder / "price.csv", index=False)
    small = int((found["role"] == "start").sum()) < FEW
    points = alone(table) if small else front(study, mechanisms["optimum"], DEVIATIONS, LOOKS, 1)
    points.to_csv(folder / "front.csv", index=False)
    print(table.to_string(index=False, float_format="{:.5g}".format))  # noqa: T201
    print(points.to_string(index=False, float_format="{:.5g}".format))  # noqa: T201
    with house_style():
        print(save(chart(points, table), folder / "figures" / "front.svg").path)  # noqa: T201


if __name__ == "__main__":
    main()
