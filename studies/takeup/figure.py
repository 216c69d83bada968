"""Thread that the stitch needs and that the cam gives over the turn, surplus and tension, best design and reference.

``python studies/takeup/figure.py FOLDER`` reads the optimum in FOLDER and writes FOLDER/balance.parquet and
FOLDER/figures/balance.svg.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

import sweep
from sweep.report.figures import OPTIMUM, REFERENCE, WIDTH, house_style, new_figure, save
from sweep.study import Study, load_study

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAMES = ("upper_needed", "upper_given", "upper_surplus", "upper_excess", "upper_tension", "upper_wrap", "cam.wrap")
DEGREES = np.arange(0.0, 360.5, 1.0)
GRAM_FORCE = 9.80665e-3  # N
MET = (180.0, 216.0)  # the needle is lowest; the looper meets it


def balance(study: Study, designs: dict[str, pd.Series | dict[str, float]]) -> pd.DataFrame:
    """Thread over the turn, one row per design and degree of the main shaft."""
    parts = []
    for label, design in designs.items():
        table = {name: float(design[name]) for name in study.family.parameter_names}
        found = sweep.evaluate(study.bare, table, list(NAMES), phi=np.radians(DEGREES))
        parts.append(found.assign(label=label, degrees=DEGREES))
    return pd.concat(parts, ignore_index=True)


def chart(turn: pd.DataFrame) -> Figure:
    """Supply and demand, what is left over, and the tension at the stitch."""
    figure = new_figure(WIDTH, 9.0)
    supply, left, pull = figure.subplots(3, 1, sharex=True)
    colours = dict(zip(turn["label"].unique(), (OPTIMUM, REFERENCE), strict=False))
    for k, (label, rows) in enumerate(turn.groupby("label", sort=False)):
        if k == 0:
            supply.plot(rows["degrees"], rows["upper_needed"], color="#14181f", label="needed by the stitch")
            allowed = rows["upper_surplus"] - rows["upper_excess"]
            left.plot(rows["degrees"], allowed, color="#14181f", linestyle="--", linewidth=1.0, label="allowed")
        supply.plot(rows["degrees"], rows["upper_given"], color=colours[label], label=f"given, {label}")
        left.plot(rows["degrees"], rows["upper_surplus"], color=colours[label], label=label)
        pull.plot(rows["degrees"], rows["upper_tension"] / GRAM_FORCE, color=colours[label], label=label)
    left.axhline(0.0, color="#14181f", linewidth=1.0)
    for axes, words in ((supply, "thread [mm]"), (left, "surplus [mm]"), (pull, "tension at the stitch [gf]")):
        _mark(axes, words)
    pull.set_xlabel("main shaft [°]")
    pull.set_xticks(np.arange(0, 361, 60))
    supply.set_title("supply and demand")
    return figure


def _mark(axes: Axes, words: str) -> None:
    axes.set_ylabel(words)
    axes.axvspan(*MET, color="#14181f", alpha=0.06, linewidth=0.0)
    axes.legend(fontsize="small", loc="upper right" if words != "surplus [mm]" else "lower left", ncols=1)
    if words == "surplus [mm]":
        axes.set_ylim(bottom=-0.9)  # room for the legend


def main() -> None:
    """Read the optimum of a run, compute the turn, write table and chart."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="results of the study, with its designs/")
    folder: Path = parser.parse_args().folder
    study = load_study(Path(__file__).parent)
    designs: dict[str, pd.Series | dict[str, float]] = {
        "best cam": pd.read_parquet(folder / "_optimum.parquet").iloc[0]
    }
    if study.reference is not None:
        designs["cam that fits the demand"] = study.reference
    turn = balance(study, designs)
    turn.to_parquet(folder / "balance.parquet", index=False)
    peaks = turn.groupby("label", sort=False)[["upper_surplus", "upper_tension"]].agg(["min", "max"])
    print(peaks.to_string(float_format="{:.4g}".format))  # noqa: T201
    with house_style():
        print(save(chart(turn), folder / "figures" / "balance.svg").path)  # noqa: T201


if __name__ == "__main__":
    main()
