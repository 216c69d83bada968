"""The threads of a machine over the turn: P(phi) of each and their sum, what is left over, how fast they run."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from sweep.errors import MeasuredRangeWarning
from sweep.evaluation.thread.diagram import diagram
from sweep.families.thread_balance import MEASURED_SPEED, MM_PER_M, ThreadBalance
from sweep.report.figures import LIMIT, WIDTH, new_figure

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from sweep.report.dataset import Dataset


def diagram_of_dataset(data: Dataset) -> pd.DataFrame | None:
    """Return the threads of the optimum over the turn; None where the study has none."""
    row, family = data.result, data.study.family
    if row is None or not any(isinstance(r, ThreadBalance) for r in getattr(family, "relations", ())):
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MeasuredRangeWarning)  # the picture shows how far the law of speed was measured
        return diagram(family, {name: row[name] for name in family.parameter_names}, angles="rad")


def threads_figure(turn: pd.DataFrame) -> Figure:
    """Draw demand, surplus and speed of every thread over one turn of the main shaft."""
    degrees = np.degrees(turn["phi"])
    names = [name.removesuffix("_demand") for name in turn.columns if name.endswith("_demand")]
    figure = new_figure(WIDTH, 7.5)
    needs, left, pace = figure.subplots(3, 1, sharex=True)
    for name in names:
        needs.plot(degrees, turn[f"{name}_demand"] - turn[f"{name}_demand"].mean(), label=name)
        left.plot(degrees, turn[f"{name}_surplus"], label=name)
        if f"{name}_velocity" in turn:
            pace.plot(degrees, turn[f"{name}_velocity"] / MM_PER_M, label=name)
    needs.plot(degrees, turn["demand"] - turn["demand"].mean(), color="#14181f", linestyle="--", label="sum")
    left.axhline(0.0, color="#14181f", linewidth=1.0)
    for way in (-1.0, 1.0):
        pace.axhline(way * MEASURED_SPEED.high, color=LIMIT, linewidth=1.0, linestyle="--")
    for axes, words in ((needs, "P, from its mean [mm]"), (left, "surplus [mm]"), (pace, "speed [m/s]")):
        axes.set_ylabel(words)
        axes.legend(fontsize="small", loc="upper right")
    pace.set_xlabel("angle of the main shaft [°]")
    pace.set_xticks(range(0, 361, 60))
    return figure
