"""The space of the planar study: every box of the certificate, coloured by what excludes it."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from matplotlib.collections import PolyCollection
from matplotlib.patches import Patch

from sweep.report.figures import WIDTH, house_style, new_figure, save

COLOURS = {
    "pressure angle above 45 deg": "#c9d7e8",
    "rocker shorter than 20 mm": "#d9c9e8",
    "not a mechanism: limits, sides or branch": "#dddddd",
    "acceleration not below the bound": "#f2c38f",
    "open": "#d62728",
}
SHOWN = 75  # degrees; beyond there is no mechanism at all
PRESSURE, ROCKER_TOO_SHORT = 15, 7


def reason(leaf: dict[str, object]) -> str:
    """Return what excludes a box, one of the keys of COLOURS."""
    kinds = leaf["kinds"]
    if leaf["outcome"] == "bound":
        return "acceleration not below the bound"
    if leaf["outcome"] != "empty":
        return "open"
    if PRESSURE in kinds:  # type: ignore[operator]
        return "pressure angle above 45 deg"
    if ROCKER_TOO_SHORT in kinds:  # type: ignore[operator]
        return "rocker shorter than 20 mm"
    return "not a mechanism: limits, sides or branch"


def main(folder: Path) -> None:
    """Draw the certificate in ``folder`` into its report."""
    leaves = pq.read_table(folder / "_proof.parquet").to_pylist()
    reasons = [reason(leaf) for leaf in leaves]
    with house_style():
        figure = new_figure(WIDTH, 0.62 * WIDTH)
        axes = figure.add_subplot()
        ends = np.degrees([[leaf[f"{n}_{e}"] for n in ("phi_ext", "phi0") for e in ("low", "high")] for leaf in leaves])
        corners = [[(x0, y0), (x1, y0), (x1, y1), (x0, y1)] for x0, x1, y0, y1 in ends]
        colours = [COLOURS[word] for word in reasons]
        axes.add_collection(PolyCollection(corners, facecolors=colours, edgecolors="white", linewidths=0.3))
        axes.set_xlim(0, SHOWN)
        axes.set_ylim(150, 210)
        axes.set_xlabel("crank angle of the extended position [deg]")
        axes.set_ylabel("crank angle between the limits [deg]")
        shown = [word for word in COLOURS if word in reasons]
        handles = [Patch(color=COLOURS[word], label=word) for word in shown]
        figure.legend(handles=handles, loc="outside upper center", ncols=2, frameon=False)
        save(figure, folder / "figures" / "space.svg")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
