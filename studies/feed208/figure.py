"""Draw the speeds at which the presser foot leaves the rack, and the loss of stitch over the speed.

``python studies/feed208/figure.py FOLDER`` writes FOLDER/contact.parquet and FOLDER/figures/contact.svg.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pandas as pd

import sweep
from studies.figure import folder_asked, print_table, save_chart
from sweep.report.figures import WIDTH, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RPM = 30.0 / math.pi  # rpm per rad/s
COLOURS = ("#1f5aa6", "#c8551b", "#2f8f5b")
LOSSES_OF = 20.0  # preload of the drawn stitch losses [N], the softest one


def contact(designs: pd.DataFrame) -> pd.DataFrame:
    """Return the least speed of the map at which the foot leaves the rack, per spring and preload; nan if it stays.

    Without rebound: with one the foot hops at every entry.
    """
    still = designs[designs["restitution"] == 0.0]
    lost = still[still["flights"] > 0.0].groupby(["k", "F0"])["omega"].min() * RPM
    pairs = pd.MultiIndex.from_frame(still[["k", "F0"]].drop_duplicates().sort_values(["k", "F0"]))
    return lost.reindex(pairs).rename("rpm").reset_index()


def chart(table: pd.DataFrame, designs: pd.DataFrame) -> Figure:
    """Draw the speed at which contact is lost against the preload, and the lost share of the stitch against speed."""
    figure = new_figure(WIDTH, 4.2)
    left, right = figure.subplots(1, 2)
    highest = designs["omega"].max() * RPM
    losses = designs[(designs["restitution"] == 0.0) & (designs["F0"] == LOSSES_OF)]
    for (k, rows), colour in zip(table.groupby("k"), COLOURS, strict=True):
        left.plot(rows["F0"], rows["rpm"], "o-", color=colour, label=f"k = {k:g} N/mm")
        own = losses[losses["k"] == k].sort_values("omega")
        right.plot(own["omega"] * RPM, 100.0 * own["stitch_error"], "-", color=colour, label=f"k = {k:g} N/mm")
    never = sorted(table.loc[table["rpm"].isna(), "F0"].unique())
    for preload in never:
        left.annotate("never", (preload, highest), xytext=(0, -14), textcoords="offset points", ha="center")
    left.axhline(highest, color="#8a8f98", linewidth=1.0, linestyle="--", label=f"highest speed, {highest:.0f} rpm")
    left.set_xlabel("preload F0 [N]")
    left.set_ylabel("least speed at which contact is lost [rpm]")
    left.set_xlim(table["F0"].min() - 2.0, table["F0"].max() + 2.0)
    right.set_xlabel("speed [rpm]")
    right.set_ylabel(f"stitch lost at F0 = {LOSSES_OF:g} N [%]")
    for axes in (left, right):
        axes.legend(fontsize="small")
    return figure


def main() -> None:
    """Read the designs of a run, write table and chart beside them."""
    folder = folder_asked(__doc__)
    designs = sweep.load(folder / "designs")
    table = contact(designs)
    table.to_parquet(folder / "contact.parquet", index=False)
    print_table(table, "{:.0f}", "never")
    save_chart(folder, "contact", lambda: chart(table, designs))


if __name__ == "__main__":
    main()
