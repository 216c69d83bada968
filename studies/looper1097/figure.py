"""Find the least acceleration of the study's five-links for given distances h of the two revolutes.

``python studies/looper1097/figure.py FOLDER`` starts from the optimum in FOLDER and follows it to other values of h.
It writes FOLDER/joint.parquet and FOLDER/figures/joint.svg.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from studies.figure import folder_asked, print_table, save_chart
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.optimise import minimise
from sweep.optimise.starts.posing import problem_of
from sweep.report.figures import OPTIMUM, REFERENCE, WIDTH, new_figure
from sweep.study import OptimiseSettings, load_study, study_from_data

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLDER = Path(__file__).parent
OUTPUTS = ["max_abs_d2psi", "max_abs_beta", "max_pressure_angle", "swing", "stroke_ratio"]
LINKS = ["a", "b", "c", "e", "f", "g", "h", "branch"]


def along_h(optimum: pd.Series, lengths: list[float]) -> pd.DataFrame:
    """Return the best five-link for every h [mm], each search started from its neighbour's, from the optimum's h on."""
    data = load_study(FOLDER).data
    rows = []
    start = pd.DataFrame([optimum])
    for h in sorted(lengths, key=lambda x: abs(x - float(optimum["h"]))):
        study = study_from_data(data | {"design": data["design"] | {"h": f"{h!r} mm"}}, FOLDER)
        names = study.family.parameter_names
        designs, _ = design_matrix(study.family, {name: start[name] for name in names} | {"h": np.array([h])})
        best = minimise(problem_of(study, designs), designs, OptimiseSettings(starts=1))[0]
        found = design_outputs(study.family, best.design[None, :], OUTPUTS, study.accuracy)
        start = pd.DataFrame([dict(zip(names, best.design.tolist(), strict=True))])
        rows.append(
            start.iloc[0][LINKS].to_dict() | {name: found[name][0] for name in OUTPUTS} | {"status": best.status}
        )
    return pd.DataFrame(rows).sort_values("h", ignore_index=True)


def chart(joint: pd.DataFrame) -> Figure:
    """Draw acceleration and tilt of the coupler against h."""
    figure = new_figure(WIDTH, 4.6)
    left, right = figure.subplots(1, 2)
    rows = joint[joint["status"] == 0]
    left.plot(rows["h"], rows["max_abs_d2psi"], "o-", color=OPTIMUM)
    left.set_ylabel("least max |ψ″| [1/rad]")
    right.plot(rows["h"], np.degrees(rows["max_abs_beta"]), "o-", color=REFERENCE)
    right.set_ylabel("largest tilt of the coupler [°]")
    for axes in (left, right):
        axes.set_xlabel("distance h of the revolutes [mm]")
    return figure


def main() -> None:
    """Read the optimum of a run, follow it along h, write table and chart."""
    folder = folder_asked(__doc__)
    best = pd.read_parquet(folder / "_optimum.parquet").iloc[0]
    small = best["status"] != 0  # smoke
    joint = along_h(best, [0.0, 5.0] if small else [0.0, 1.0, 2.0, 4.0, 6.0, 8.0, 10.0])
    joint.to_parquet(folder / "joint.parquet", index=False)
    print_table(joint, "{:.5g}")
    save_chart(folder, "joint", lambda: chart(joint))


if __name__ == "__main__":
    main()
