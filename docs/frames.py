"""Draw the frames of all families, docs/figures/frame-NAME.svg, from their examples: ``make frames``."""

from __future__ import annotations

import math
from pathlib import Path

from sweep.exchange.scene import is_spatial, over, projection
from sweep.families import NAMES, family
from sweep.plot.drawing import draw_frame, separate_names
from sweep.report.figures import house_style, new_figure, save

FOLDER = Path(__file__).parent / "figures"
FIRST = math.radians(50.0)  # a crank angle at which no two joints lie on each other
# A heddle drive with all its links: the example has equal lever angles and a long rod, which need none of them.
MORE = {"heddle": {"O3D": 80.0, "O4F": 70.0, "O3O4": 200.0, "DF": math.hypot(200.0, 10.0), "EG": 150.0, "x_s": 130.0}}


def main() -> None:
    """Draw every family."""
    with house_style():
        for name in NAMES:
            found = over(name, dict(family(name).example) | MORE.get(name, {}), FIRST, 180)
            spatial = is_spatial(found)
            figure = new_figure(5.2, 4.2)
            axes = figure.subplots()
            draw_frame(axes, found, projection("space" if spatial else "xy"))
            axes.set_axis_off()
            if axes.get_legend_handles_labels()[0]:
                axes.legend(loc="best", fontsize="small")
            separate_names(figure)
            save(figure, FOLDER / f"frame-{name}.svg")


if __name__ == "__main__":
    main()
