"""Add needle bar, piercing and friction, load by load, to the drive of needle208 and to the design of least torque.

``python studies/needle208-loads/figure.py FOLDER`` reads the optimum in FOLDER.  It writes FOLDER/loads.parquet (one
row per design and case) and FOLDER/figures/loads.svg.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

import sweep
from studies.figure import folder_asked, print_table, save_chart
from sweep.families.base import Array
from sweep.report.figures import OPTIMUM, REFERENCE, WIDTH, new_figure
from sweep.study import Study, load_study, study_from_data

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PHI = np.linspace(0.0, 2.0 * np.pi, 721)
BELOW = 11.0  # mm, height of the fabric above the needle's lowest position
PIERCE = 6.0  # N
CASES = ("links alone", "needle bar 25 g", "and piercing 6 N", "and friction")
FORCES = ("force_c1", "force_d1", "force_c2", "force_d2")
PLAIN = (*FORCES, "drive_torque1")
RUBBING = ("force_c_friction1", "force_d_friction1", "force_c_friction2", "force_d_friction2", "drive_torque_friction1")
SHORT = ("rocker pin 1", "rocker shaft 1", "rocker pin 2", "rocker shaft 2")


def inputs(study: Study) -> dict[str, float]:
    """Return bodies, oil and motor of the study, including those that no wanted output takes."""
    want = [*study.want, "max_abs_drive_torque_friction1", "unevenness_friction1"]
    scene = {**study.data["scene"], "want": want}
    full = study_from_data({**study.data, "scene": scene}, study.path)
    own = study.bare.parameter_names
    return {name: x for name, x in full.space.fixed.items() if name not in own}


def cases(study: Study, designs: dict[str, dict[str, float]]) -> tuple[pd.DataFrame, dict[str, Array]]:
    """Return the largest loads and unevenness per design and case.

    The drive torque of the first design over the turn is returned as well, per case.
    """
    rows, torques, given = [], {}, inputs(study)
    for label, design in designs.items():
        low = sweep.evaluate(study.bare, design, ["s"], phi=PHI)["s"].min()
        for k, case in enumerate(CASES):
            table = given | design | {"m_tool2": given["m_tool2"] if k > 0 else 0.0}
            if k > 1:
                table |= {"pierce_force2": PIERCE, "pierce_at2": low + BELOW, "pierce_sense2": -1.0}
            rubs = case == CASES[-1]
            found = sweep.evaluate(study.bare, table, list(RUBBING if rubs else PLAIN), phi=PHI)
            found = found.rename(columns=dict(zip(RUBBING, PLAIN, strict=True)))
            uneven = "unevenness_friction1" if rubs else "unevenness1"
            constant, line = (
                sweep.summarise(study.bare, table | motor, [uneven], accuracy=1e-6)[uneven][0]
                for motor in ({"motor_slope1": 0.0}, {})
            )
            torque = found["drive_torque1"].to_numpy()
            rows.append(
                {"design": label, "case": case}
                | {name: found[name].abs().max() for name in FORCES}
                | {"largest_torque": np.abs(torque).max(), "mean_torque": torque[:-1].mean()}
                | {"unevenness": constant, "unevenness_motor": line}
            )
            if label == next(iter(designs)):
                torques[case] = torque
    return pd.DataFrame(rows), torques


def chart(table: pd.DataFrame, torques: dict[str, Array]) -> Figure:
    """Draw the driving torque over the turn, and the largest joint forces load by load."""
    figure = new_figure(WIDTH, 8.4)
    above, below = figure.subplots(2, 1)
    for case, torque in torques.items():
        above.plot(np.degrees(PHI), torque / 1000.0, label=case)
    above.set_xlabel("crank [°]")
    above.set_ylabel("driving torque [N m]")
    above.set_xticks(np.arange(0, 361, 60))
    above.set_title("drive of needle208 at 7000 per minute")
    above.legend(fontsize="small")
    designs, width = list(table["design"].unique()), 0.38
    for d, (design, colour) in enumerate(zip(designs, (REFERENCE, OPTIMUM), strict=False)):
        rows = table[table["design"] == design]
        for k in range(len(CASES)):
            place = np.arange(len(FORCES)) + (d - 0.5) * width + 0.18 * (k / len(CASES) - 0.375) * 2.0
            heights = rows.iloc[k][list(FORCES)].to_numpy(float)
            shade = 0.35 + 0.65 * k / (len(CASES) - 1)
            words = design if k == len(CASES) - 1 else None
            below.bar(place, heights, 0.085, color=colour, alpha=shade, label=words)
    below.set_xticks(range(len(SHORT)), SHORT)
    below.set_ylabel("largest force [N]")
    below.set_title("from left to right, darker: links alone, needle bar, piercing, friction")
    below.legend(fontsize="small")
    return figure


def main() -> None:
    """Read the optimum of a run, add load by load, write table and chart."""
    folder = folder_asked(__doc__)
    study = load_study(Path(__file__).parent)
    assert study.reference is not None
    best = pd.read_parquet(folder / "_optimum.parquet").iloc[0]
    own = study.bare.parameter_names
    designs = {
        "drive of needle208": {name: study.reference[name] for name in own},
        "least torque": {name: float(best[name]) for name in own},
    }
    table, torques = cases(study, designs)
    table.to_parquet(folder / "loads.parquet", index=False)
    print_table(table, "{:.4g}")
    save_chart(folder, "loads", lambda: chart(table, torques))


if __name__ == "__main__":
    main()
