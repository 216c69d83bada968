"""Show which effects matter at which speed, and which pressure angle the bearings permit.

``python studies/joint-loads/figure.py FOLDER`` reads FOLDER/designs.  It writes FOLDER/figures/effects.svg and
FOLDER/effects.parquet.  Each row of the table has a speed and an effect, with the median, the 5 % and 95 % quantiles
and the threshold of the effect's rule.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

import sweep
from studies.figure import folder_asked, print_table, save_chart
from sweep.report.figures import WIDTH, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Measure of each effect, its rule's threshold (docs/effects.md), and the column of its values.
RULES = {
    "friction: what it adds to the peak torque": (0.01, "friction"),
    "uneven crank speed: unevenness": (0.01, "unevenness"),
    "elastic coupler: lag of the rocker [rad]": (1e-4, "max_abs_lag"),
    "vibration: what it adds to the lag": (0.01, "vibration"),
    "plain bearings: utilisation": (0.5, "max_sliding_utilisation"),
}
# The torque that the bearings must transmit is that of inertia at the speed: study.toml.
TORQUES = {3000: 350.0, 5000: 950.0, 7000: 1850.0}


def table(designs: pd.DataFrame) -> pd.DataFrame:
    """Return quantiles of each effect's measure over the feasible designs at every speed, and whether it matters."""
    rows = []
    for speed, torque in TORQUES.items():
        of_speed = np.isclose(designs["speed"], speed * np.pi / 30.0)
        found = designs[of_speed & np.isclose(designs["resisting_torque"], torque)]
        friction = found["max_abs_drive_torque_friction"] / found["max_abs_drive_torque"] - 1.0
        vibration = found["max_abs_lag_dynamic"] / found["max_abs_lag"] - 1.0
        values = found.assign(friction=friction.abs(), vibration=vibration.abs())
        for label, (threshold, name) in RULES.items():
            low, middle, high = values[name].quantile([0.05, 0.5, 0.95])
            rows.append((label, speed, low, middle, high, threshold, bool(middle >= threshold)))
    names = ["effect", "speed", "low", "median", "high", "threshold", "matters"]
    return pd.DataFrame(rows, columns=names)


def chart(effects: pd.DataFrame, designs: pd.DataFrame) -> Figure:
    """Draw measures relative to their thresholds against speed, and utilisation against the largest pressure angle."""
    figure = new_figure(WIDTH, 8.4)
    above, below = figure.subplots(2, 1)
    for k, label in enumerate(RULES):
        rows = effects[effects["effect"] == label]
        place = rows["speed"] + 60.0 * (k - 2)
        middle, low, high = (rows[name] / rows["threshold"] for name in ("median", "low", "high"))
        above.errorbar(place, middle, [middle - low, high - middle], fmt="o-", capsize=3.0, label=label)
    _mark(above, "log")
    above.set_xticks(list(TORQUES))
    above.set_xlabel("speed [1/min]")
    above.set_ylabel("measure over the threshold of its rule")
    above.set_title("above 1 the effect matters (median, 5 to 95 % of the designs)")
    above.legend(fontsize="small")
    for speed, torque in TORQUES.items():
        rows = designs[np.isclose(designs["resisting_torque"], torque)]
        angles = np.degrees(rows["max_pressure_angle"])
        below.plot(angles, rows["max_sliding_utilisation"], ".", markersize=2.5, label=f"{torque:g} N mm ({speed}/min)")
    _mark(below, "linear")
    below.set_xlabel("largest pressure angle [°]")
    below.set_ylabel("utilisation of the plain bearings")
    below.set_title("what the bearings permit: below 1, as a limit of the pressure angle")
    below.legend(fontsize="small", markerscale=4.0)
    return figure


def _mark(axes: Axes, scale: str) -> None:
    axes.set_yscale(scale)
    axes.axhline(1.0, color="#14181f", linewidth=1.0)


def main() -> None:
    """Read the designs of a run, write table and chart beside them."""
    folder = folder_asked(__doc__)
    designs = sweep.load(folder / "designs")
    effects = table(designs)
    effects.to_parquet(folder / "effects.parquet", index=False)
    print_table(effects, "{:.3g}")
    save_chart(folder, "effects", lambda: chart(effects, designs))


if __name__ == "__main__":
    main()
