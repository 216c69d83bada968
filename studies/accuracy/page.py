"""The page: docs/accuracy.md and the same as HTML with the figures in it, written from the measured tables alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from studies.accuracy.reference import ORDERS
from studies.accuracy.tables import pipe_table, reached_table
from studies.accuracy.tables import significant as sig

if TYPE_CHECKING:
    import pandas as pd

    from sweep.report.figures import Saved

HARD = ("change point",)


@dataclass(frozen=True)
class Measured:
    """Everything one run of the study found."""

    machine: str
    smoke: bool
    regions: tuple[tuple[str, str], ...]
    marks: pd.DataFrame
    positions: pd.DataFrame
    exact: pd.DataFrame
    extrema: pd.DataFrame
    outputs: pd.DataFrame
    storage: pd.DataFrame
    optimiser: pd.DataFrame
    oracle: pd.DataFrame
    worst: pd.DataFrame
    peers: pd.DataFrame | None

    def tables(self) -> Iterator[tuple[str, pd.DataFrame]]:
        """The tables by name."""
        names = [field.name for field in fields(self)][3:-1]  # the peers have been written by their own command
        return ((name, getattr(self, name)) for name in names)


def markdown(m: Measured) -> str:
    """The whole page."""
    parts = [
        "# What accuracy costs in time",
        "",
        "Written by `make study-accuracy`; do not edit. Ratios travel between machines, nanoseconds do not.",
        "",
        f"Measured on {m.machine}." + (" Smoke version: few designs, rough figures." if m.smoke else ""),
        *_advice(m),
        *_marks(m),
        *_regions(m),
        *_extrema(m),
        *_outputs(m),
        *_positions(m),
        *_peers(m),
        *_oracle(m),
    ]
    return "\n".join(parts) + "\n"


def _points(m: Measured, quantity: str, method: str, setting: float) -> pd.DataFrame:
    t = m.extrema
    return t[(t["quantity"] == quantity) & (t["method"] == method) & np.isclose(t["setting"], setting)]


def _advice(m: Measured) -> list[str]:
    target = sorted(m.extrema.loc[m.extrema["method"] == "accuracy=", "setting"].unique())
    grids = m.extrema.loc[m.extrema["method"] == "grid, float64", "setting"]
    grid = grids.iloc[(grids - 360.0).abs().argmin()]
    rough, fine = target[-1], target[0]
    lines = ["", "## What to use", ""]
    rows = []
    for name, method, setting in (
        (f"nightly map: `accuracy = {rough:g}`", "accuracy=", rough),
        (f"drawing, optimum, comparison with a measurement: `accuracy = {fine:g}`", "accuracy=", fine),
        (f"plain grid, `samples = {grid:g}`, for comparison", "grid, float64", grid),
    ):
        points = _points(m, "max_abs_d2psi", method, setting)
        easy = points[~points["region"].isin(HARD)]
        hard = points[points["region"].isin(HARD)]
        rows.append(
            [
                name,
                f"{easy['ns_per_design'].median():.0f}",
                sig(easy["largest_error"].max()),
                f"{hard['ns_per_design'].max():.0f}",
                sig(hard["largest_error"].max()) + _unanswered(hard),
            ]
        )
    lines += pipe_table(
        ["max of abs d2psi", "ns per design", "largest error", "ns at change points", "error there"], rows
    )
    lines += [
        "",
        "For a nightly map take the coarsest target: the maximum is refined between the samples anyway, so it",
        "costs about what the finest does, and less than a grid that is wrong by percents. For a drawing take the",
        "finest; what it adds is paid only by designs near a change point. A grid pays only where the whole curve is",
        "wanted. float32 halves the time of a grid and is good for sorting out, not for a number that is kept.",
        "The largest error is that of long couplers, where it is the rounding of their own length; without them it is",
        f"{sig(_easiest(m, rough))} and {sig(_easiest(m, fine))}.",
    ]
    return lines


def _easiest(m: Measured, target: float) -> float:
    points = _points(m, "max_abs_d2psi", "accuracy=", target)
    return float(points.loc[~points["region"].isin((*HARD, "long coupler")), "largest_error"].max())


def _unanswered(points: pd.DataFrame) -> str:
    count, total = int(points["unanswered"].sum()), int(points["designs"].sum())
    return f" ({count} of {total} not answered)" if count else ""


def _marks(m: Measured) -> list[str]:
    rows = [
        [r.name_, r.asked, r.measured, "yes" if r.met else "**no**"]
        for r in m.marks.rename(columns={"name": "name_"}).itertuples()
    ]
    return ["", "## Marks", "", *pipe_table(["mark", "asked", "measured", "met"], rows)]


def _regions(m: Measured) -> list[str]:
    return [
        "",
        "## Regions",
        "",
        *pipe_table(["region", "what its designs have in common"], [list(r) for r in m.regions]),
    ]


def _extrema(m: Measured) -> list[str]:
    lines = ["", "## Work and precision", ""]
    lines += [
        "Error: largest relative error over the designs of a region against 65 536 samples, a quarter of them",
        "crowded about the least discriminant, and halving. Time: one thread, shortest of three. Each cell: the",
        "cheapest setting whose largest error is below the bound, its time per design, and the ratio to",
        "`accuracy=`; - where no setting reaches it. The reference's height of the acceleration is computed in 60",
        "digits; at change points the rounding of the discriminant alone leaves 1e-6 to any method in float64.",
    ]
    for quantity, title in (("max_abs_d2psi", "Largest acceleration over the turn"), ("swing", "Swing")):
        for bound in (1e-3, 1e-6, 1e-9):
            part = m.extrema[m.extrema["quantity"] == quantity]
            lines += ["", f"### {title}, error below {bound:g}", "", *reached_table(part, bound)]
    return lines


def _outputs(m: Measured) -> list[str]:
    rows = [
        [r.kind, r.outputs, sig(r.ns_per_pose), sig(r.times_position), f"{r.ns_per_design:.0f}"]
        for r in m.outputs.itertuples()
    ]
    lines = ["", "## What each further output costs", ""]
    lines += ["Crank-rocker, 720 poses a turn, each line computed alone; x psi: times the angle psi at a pose."]
    lines += ["", *pipe_table(["kind", "outputs", "ns per pose", "x psi", "ns per design"], rows)]
    stored = [
        [r.dtype, sig(r.bytes_per_row), f"{r.ns_per_design:.0f}", sig(r.largest_error_of_storing)]
        for r in m.storage.itertuples()
    ]
    lines += ["", "## float32 or float64 on disk", ""]
    lines += [
        "A Sobol sample, rotatable designs kept, three outputs with their error estimates, seven parameters in float64."
    ]
    lines += [
        "",
        *pipe_table(["dtype", "bytes per row", "ns per design swept", "largest relative error added"], stored),
    ]
    digits = [
        [f"{r.accuracy:g}", sig(r.seconds_per_start), str(r.converged), sig(r.difference_from_finest)]
        for r in m.optimiser.itertuples()
    ]
    lines += ["", "## One more digit in the optimiser", ""]
    lines += [
        "Least acceleration for a swing of 45 degrees and a pressure angle of at most 45 degrees, four variables."
    ]
    return [
        *lines,
        "",
        *pipe_table(["accuracy", "s per start", "converged", "optimum differs from the finest by"], digits),
    ]


def _positions(m: Measured) -> list[str]:
    rows = [
        [
            r.region,
            r.output,
            str(r.poses),
            sig(r.largest_error),
            sig(r.largest_factor),
            sig(r.largest_error_stored_float32),
        ]
        for r in m.positions.itertuples()
    ]
    head = ["region", "output", "poses", "largest error", "x 2^-53 max(cond, abs y)", "if stored in float32"]
    return [
        "",
        "## Positions and derivatives against 60 digits",
        "",
        "Random crank angles. cond is the sum over all inputs of abs(x dy/dx): what one rounding of each input does.",
        "",
        *pipe_table(head, rows),
        *_exact(m),
    ]


def _exact(m: Measured) -> list[str]:
    rows = [
        [r.region, r.closure, sig(r.psi), sig(r.dpsi), sig(r.d2psi), sig(r.d3psi), f"{r.ns_per_pose:.0f}"]
        for r in m.exact.itertuples()
    ]
    head = ["region", "closure", "psi [rad]", "dpsi", "d2psi", "d3psi", "ns per pose"]
    return [
        "",
        "## Doubles meant to the last bit",
        "",
        "A long coupler multiplies the rounding of its own length; that is in cond, and a drawing loses nothing by it.",
        "Where the given doubles are exact (a comparison with exact arithmetic), it is lost. `sweep.evaluate` closes",
        "the linkage in twice the working precision; sweeps do not, and are several times faster on grids.",
        "Largest errors, of the derivatives relative to their own size plus that of the velocity; times with a design",
        "per pose:",
        "",
        *pipe_table(head, rows),
    ]


def _peers(m: Measured) -> list[str]:
    lines = ["", "## The planar case next to another tool", ""]
    if m.peers is None:
        return [*lines, "Not measured in this results folder: `make bench-peers` first."]
    rows = [[r.what, sig(r.ns_per_angle), sig(r.ratio)] for r in m.peers.itertuples()]
    distance = sig(m.peers["distance_of_rocker_pins"].max())
    return [
        *lines,
        "One planar four-bar, rocker at evenly spaced crank angles, each tool by its fastest way, on this machine",
        f"(`make bench-peers`); their rocker pins differ by at most {distance} cranks.",
        "",
        *pipe_table(["what", "ns per crank angle", "times as fast"], rows),
    ]


def _oracle(m: Measured) -> list[str]:
    lines = [
        "",
        "## Largest known factors",
        "",
        "Every row of the 25-digit tables, in units of 2^-53 max(cond, abs y); for the geared dwell drive, whose",
        "table has no cond, of abs y, its lower derivatives and what one rounding of phi does.",
        f"Rows declared undecidable: {int(m.oracle['undecidable'].sum())}. `make search-worse` looks for worse poses.",
    ]
    for table, part in m.oracle.groupby("table", sort=False):
        quantities = list(dict.fromkeys(part["quantity"]))
        rows = []
        for kind, cells in part.groupby("kind", sort=False):
            known = dict(zip(cells["quantity"], cells["factor"], strict=True))
            count = str(int(cells["rows"].max()))
            rows.append([str(kind).replace("_", " "), count, *(sig(known.get(q, np.nan)) for q in quantities)])
        lines += ["", f"### {table}, allowed {part['allowed'].iloc[0]:g}", ""]
        lines += pipe_table(["kind of rows", "rows", *quantities], rows)
    worst = [
        [str(region), *(sig(part.loc[part["output"] == name, "factor"].max()) for name in ORDERS)]
        for region, part in m.worst.groupby("region", sort=False)
    ]
    return [*lines, "", "### Largest found by search", "", *pipe_table(["region", *ORDERS], worst)]


def html(page: str, figures: list[Saved]) -> str:
    """The page with its diagrams, self-contained."""
    from html import escape

    from studies.accuracy.tables import html_body

    images = "".join(f'<img alt="{escape(figure.path.stem)}" src="{figure.uri}">' for figure in figures)
    style = "body{font:15px/1.45 system-ui,sans-serif;max-width:1150px;margin:2em auto;padding:0 1em;color:#222}" \
        "table{border-collapse:collapse;margin:.6em 0}td,th{padding:.15em .7em;border-bottom:1px solid #e4e7eb;" \
        "text-align:left;font-variant-numeric:tabular-nums}img{width:100%}code{background:#f3f4f6}"  # fmt: skip
    head = (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Accuracy and time</title><style>{style}</style>'
    )
    return head + html_body(page, after="## Work and precision", inserted=images) + "</html>\n"
