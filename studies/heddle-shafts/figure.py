"""Compare the shafts of one loom: changed dimensions, symmetry of the shed and acceleration of each shaft.

``python studies/heddle-shafts/figure.py FOLDER`` writes FOLDER/shafts.parquet and FOLDER/figures/shafts.svg.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

import sweep
from studies.figure import folder_asked, print_table, save_chart
from sweep.report.figures import OPTIMUM, REFERENCE, WIDTH, new_figure
from sweep.synthesis.heddle import arms, extremes, shed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHAFTS = 8
FELL, PITCH = 130.0, 12.0  # mm, from the fell to shaft 1, and between shafts; of our own choice
SPEED = 300.0 * math.pi / 30.0 / 2.0  # rad/s of the cam, which turns once for two picks, at 300 picks a minute
# Lever chain of docs/heddle.md, mm and rad: the stroke of shaft 4, levers, bell crank; rod and roller lever.
PAGE = {"stroke": 75.0, "O4E": 138.5, "O1O2": 151.0, "O1O3": 311.0, "O3C": 138.5, "kappa": math.radians(155.0)}
LEVER = {"O2B": 192.5, "side_B": 1.0}
ROD, ROLLER_LEVER, BASE = 225.0, 69.47, 124.5
LINK = {"O4F": 138.5, "O3O4": 900.0}
CAM = {"rise": math.radians(120.0), "dwell": math.radians(60.0), "fall": math.radians(120.0), "law": 2.0}


def table() -> pd.DataFrame:
    """Return the stroke of a clear shed for every shaft, the two varying dimensions, and the resulting motion."""
    number = np.arange(1, SHAFTS + 1)
    strokes = shed({"shaft": number, "d1": FELL, "t": PITCH, "stroke": PAGE["stroke"]})["stroke"].to_numpy()
    ends = extremes(PAGE | LEVER | {"BC": ROD}).iloc[0]
    made = arms({"stroke": strokes, "O4E": PAGE["O4E"], "mu_3": float(ends["mu"])} | LINK)
    drive = _drive(ends)
    moved = sweep.summarise(
        ["cam_lever", "heddle"],
        pd.DataFrame(drive | {"O3D2": made["O3D"], "DF2": made["DF"]}),
        ["stroke", "max_y", "min_y", "max_abs_dy", "max_abs_d2y", "max_pressure_angle2"],
        accuracy=1e-8,
    )
    rows = pd.DataFrame({"shaft": number, "stroke": strokes, "O3D": made["O3D"], "DF": made["DF"]})
    rows = rows.assign(y_high=moved["max_y"], y_low=moved["min_y"], asymmetry=moved["max_y"] + moved["min_y"])
    rows = rows.assign(max_abs_d2y=moved["max_abs_d2y"], acceleration=moved["max_abs_d2y"] * SPEED**2 / 1000.0)
    return rows.assign(made=moved["stroke"], status=moved["status"])


def _drive(ends: pd.Series) -> dict[str, float]:
    """Return the chain from the cam to the bell crank, common to all shafts; stage 1 is the cam with roller lever."""
    first, second = float(ends["lever_angle_1"]), float(ends["lever_angle_2"])
    rest = math.pi - math.acos((151.0**2 + ROLLER_LEVER**2 - BASE**2) / (2.0 * 151.0 * ROLLER_LEVER))
    cam = {f"{name}1": value for name, value in CAM.items()}
    cam |= {"lift1": abs(first - second), "r01": BASE, "c1": ROLLER_LEVER, "e1": 151.0, "branch1": 1.0}
    # the lever is at its second extreme while the roller rests, and turns towards the first as psi falls
    sense = 1.0 if first < second else -1.0
    levers = {"O2B": 192.5, "BC": ROD, "O3C": 138.5, "O2O3": 160.0, "O4E": 138.5} | LINK
    heddle = {f"{name}2": value for name, value in levers.items()}
    middle = math.pi - 0.5 * (float(ends["xi_1"]) + float(ends["xi_2"]))
    return cam | heddle | {"chi_mid2": middle, "kappa2": sense, "offset2": second - sense * rest}


def chart(rows: pd.DataFrame) -> Figure:
    """Draw acceleration and asymmetry by shaft."""
    figure = new_figure(WIDTH, 4.6)
    left, right = figure.subplots(1, 2)
    left.bar(rows["shaft"], rows["acceleration"], color=OPTIMUM)
    left.set_ylabel("greatest acceleration [m/s²]")
    right.bar(rows["shaft"], rows["asymmetry"], color=REFERENCE)
    right.set_ylabel("upper plus lower place [mm]")
    for axes in (left, right):
        axes.set_xlabel("shaft, 1 next to the fell")
    return figure


def main() -> None:
    """Write table and chart."""
    folder = folder_asked(__doc__)
    rows = table()
    rows.to_parquet(folder / "shafts.parquet", index=False)
    print_table(rows, "{:.5g}")
    save_chart(folder, "shafts", lambda: chart(rows))


if __name__ == "__main__":
    main()
