"""Draw the chart of the atlas: least acceleration and least pressure angle over swing and phi0.

``python studies/crank-rocker-atlas/figure.py FOLDER`` reads FOLDER/designs.  It writes FOLDER/figures/atlas.svg and
FOLDER/atlas.parquet.  For both angles of the axes and each swing and phi0 they give the design of least acceleration
whose pressure angle is at most 45 degrees, and the least pressure angle of all designs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

import sweep
from studies.figure import folder_asked, save_chart
from sweep.report.figures import WIDTH, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure

    from sweep.families.base import Array

STEEPEST = np.radians(45.0)
CELL = ["alpha", "swing", "phi0"]
LENGTHS = ["a", "b", "c", "e", "f", "g"]
TITLES = {0.0: "parallel axes (planar)", 90.0: "axes at right angles"}


def atlas(designs: pd.DataFrame) -> pd.DataFrame:
    """Return the design of least acceleration per radian of swing for every cell, lengths over c; angles in deg."""
    rows = designs[designs.status == 0].copy()
    rows["acceleration"] = rows.max_abs_d2psi / rows.swing
    # Prescribed values return with rounding errors; whole degrees name the cell.
    rows[CELL] = np.degrees(rows[CELL]).round()
    cells = rows.groupby(CELL)
    least = cells.max_pressure_angle.min().rename("least_pressure_angle")
    good = rows[rows.max_pressure_angle <= STEEPEST]
    best = good.loc[good.groupby(CELL).acceleration.idxmin()].set_index(CELL)
    best[LENGTHS] = best[LENGTHS].div(best.c, axis=0)
    best[["phi_ext", "max_pressure_angle"]] = np.degrees(best[["phi_ext", "max_pressure_angle"]])
    shown = best[["acceleration", "max_pressure_angle", "phi_ext", "branch", *LENGTHS]]
    table: pd.DataFrame = pd.concat([np.degrees(least), shown], axis=1).reset_index()
    return table


def chart(table: pd.DataFrame) -> Figure:
    """Draw four panels: acceleration above, pressure angle below, one column per angle of the axes."""
    figure = new_figure(WIDTH, 8.6)
    panels = figure.subplots(2, 2, sharex=True, sharey=True)
    quantities = (
        ("acceleration", "least max |ψ″| / swing, pressure angle ≤ 45° [1/rad²]", np.arange(0.45, 0.81, 0.05)),
        ("least_pressure_angle", "least max pressure angle [°]", np.arange(0.0, 61.0, 10.0)),
    )
    for k, (name, label, levels) in enumerate(quantities):
        for axes, (angle, title) in zip(panels[k], TITLES.items(), strict=True):
            mesh = _panel(axes, table[table.alpha == angle], name, levels)
            axes.set_title(title if k == 0 else "")
        figure.colorbar(mesh, ax=panels[k], label=label, extend="max" if k == 0 else "neither")
        panels[k][0].set_ylabel("swing [°]")
    for axes in panels[1]:
        axes.set_xlabel("crank angle φ₀ from the extended to the folded position [°]")
    return figure


def _panel(axes: Axes, table: pd.DataFrame, name: str, levels: Array) -> QuadMesh:
    grid = table.pivot_table(index="swing", columns="phi0", values=name)
    axes.set_facecolor("#eceef1")
    axes.grid(False)
    mesh = axes.pcolormesh(
        grid.columns, grid.index, grid.to_numpy(), cmap="viridis_r", vmin=levels[0], vmax=levels[-1], rasterized=True
    )
    lines = axes.contour(grid.columns, grid.index, grid.to_numpy(), levels=levels, colors="#14181f", linewidths=0.8)
    axes.clabel(lines, fmt="%g")
    return mesh


def main() -> None:
    """Read the designs of a run, write table and chart beside them."""
    folder = folder_asked(__doc__)
    table = atlas(sweep.load(folder / "designs"))
    table.to_parquet(folder / "atlas.parquet", index=False)
    save_chart(folder, "atlas", lambda: chart(table))


if __name__ == "__main__":
    main()
