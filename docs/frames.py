"""Draw the frames of all families, docs/figures/frame-NAME.svg, from their examples: ``make frames``."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from sweep.evaluation.joints import parts
from sweep.families import NAMES, family
from sweep.families.capabilities import Skeleton
from sweep.plot.space import draw_frame, is_spatial, projection
from sweep.report.figures import house_style, new_figure, save

DRAWN = [name for name in NAMES if family(name).find(Skeleton) is not None]
FOLDER = Path(__file__).parent / "figures"
FIRST = math.radians(50.0)  # a crank angle at which no two joints lie on each other


def main() -> None:
    """Draw every family."""
    phi = FIRST + np.linspace(0.0, 2.0 * math.pi, 180, endpoint=False)
    with house_style():
        for name in DRAWN:
            found = parts(name, dict(family(name).example), phi)
            spatial = is_spatial(found)
            figure = new_figure(5.2, 4.2)
            axes = figure.subplots()
            draw_frame(axes, found, projection("space" if spatial else "xy"))
            axes.set_axis_off()
            if axes.get_legend_handles_labels()[0]:
                axes.legend(loc="best", fontsize="small")
            save(figure, FOLDER / f"frame-{name}.svg")


if __name__ == "__main__":
    main()
