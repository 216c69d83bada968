"""The page: docs/accuracy.md and the same as HTML with the figures in it, written from the measured tables alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from studies.accuracy.answer import BOUNDS, QUANTITIES, advice, answer, in_short
from studies.accuracy.reference import ORDERS
from studies.accuracy.tables import HOUSE, duration, html_body, pipe_table, power, prose, reached_table
from studies.accuracy.tables import significant as sig

if TYPE_CHECKING:
    import pandas as pd

    from sweep.report.figures import Saved


@dataclass(frozen=True)
class Measured:
    """Everything one run of the study found."""

    machine: str
    smoke: bool
    regions: tuple[tuple[str, str], ...]
    marks: pd.DataFrame
    positions: pd.DataFrame
    exact: pd.DataFrame
    work: pd.DataFrame
    outputs: pd.DataFrame
    storage: pd.DataFrame
    digits: pd.DataFrame
    targets: pd.DataFrame
    oracle: pd.DataFrame
    worst: pd.DataFrame
    peers: pd.DataFrame | None

    def tables(self) -> Iterator[tuple[str, pd.DataFrame]]:
        """Yield the tables by name."""
        names = [field.name for field in fields(self)][3:-1]  # the peers have been written by their own command
        return ((name, getattr(self, name)) for name in names)


def markdown(m: Measured) -> str:
    """Return the whole page."""
    parts = [
        "# What accuracy costs in time",
        "",
        *prose(
            "Smoke version: few designs, rough figures."
            if m.smoke
            else "Every figure here is measured, none is typed.",
            f"Machine: {m.machine}. Ratios travel between machines, nanoseconds do not. `make study-accuracy` writes",
            "this page and the tables behind it, `results/accuracy/*.parquet`; what is promised is in promises.md.",
        ),
        "",
        *prose(in_short(m.work)),
        "",
        *_picture("accuracy", "Time per design against largest error, ordinary crank-rockers, one curve per method"),
        *answer(m.work),
        "",
        "## What to use",
        "",
        "Picked from the measurements: the cheapest method that keeps the bound, at its coarsest setting that does.",
        "",
        *advice(m.work, m.storage),
        *_marks(m),
        *_regions(m),
        *_work(m),
        *_outputs(m),
        *_storage(m),
        *_optimiser(m),
        *_positions(m),
        *_exact(m),
        *_peers(m),
        *_known(m),
    ]
    return "\n".join(parts) + "\n"


def _picture(name: str, text: str) -> list[str]:
    return [f"![{text}](figures/{name}.svg)", ""]


def marks_table(marks: pd.DataFrame) -> list[str]:
    """Return the marks: what was asked, what was measured, whether it was met."""
    rows = [[mark, asked, measured, "yes" if met else "**no**"] for mark, asked, measured, met in marks.to_numpy()]
    return pipe_table(["mark", "asked", "measured", "met"], rows)


def _marks(m: Measured) -> list[str]:
    return [
        "",
        "## Marks",
        "",
        "Set before the code was written; missed ones are named as such.",
        "",
        *marks_table(m.marks),
    ]


def _regions(m: Measured) -> list[str]:
    return [
        "",
        "## Work and precision by region",
        "",
        "Crank-rockers with random proportions, sorted by what makes them hard for float64 and for a grid:",
        "",
        *pipe_table(["region", "what its designs have in common"], [list(r) for r in m.regions]),
        "",
    ]


def _work(m: Measured) -> list[str]:
    lines = [
        *prose(
            "Time: processor time of one thread, shortest of three. Extrema: largest relative error over the",
            "designs of a region against 65 536 samples, a quarter of them crowded about the least discriminant,",
            "and halving; the height of the acceleration in 60 digits. At change points the rounding of the",
            "discriminant alone leaves 1e-6 to any method in float64. Positions: each design is asked for its",
            "rocker angle at 360 random crank angles; a table is made first and read between its samples. Error in",
            "rad against 60 digits, at angles a third of which crowd about the sharpest place of the motion.",
        ),
        "",
    ]
    for quantity, title in QUANTITIES.items():
        lines += [f"### {title[0].upper()}{title[1:]}", ""]
        lines += _picture(
            f"accuracy-{quantity}", f"Time per design against largest error: {title}, one panel per region"
        )
        for bound in BOUNDS:
            part = m.work[m.work["quantity"] == quantity]
            lines += [
                f"Error below {power(bound)}: coarsest setting that keeps it, its time per design, how many times that"
                f" of {HOUSE[quantity]}; - where none does.",
                "",
                *reached_table(part, bound),
                "",
            ]
    return lines[:-1]


def _outputs(m: Measured) -> list[str]:
    rows = [
        [r.kind, r.what, r.family, f"{sig(r.nanoseconds)} ns", sig(r.times_position)]
        for r in m.outputs[m.outputs["per"] == "pose"].itertuples()
    ]
    turns = [
        [r.kind, r.what, r.family, duration(r.nanoseconds), sig(r.times_position)]
        for r in m.outputs[m.outputs["per"] == "design"].itertuples()
    ]
    return [
        "",
        "## What each further output costs",
        "",
        *prose(
            "Every output and every effect of the register in one run, 360 poses a turn: outputs of the",
            "crank-rocker alone with all they need; effects (`make bench`) on the first family named, all",
            "their outputs together, the motion they share apart. Pose outputs, and how many times the angle psi:",
        ),
        "",
        *pipe_table(["how", "outputs", "families", "per pose", "x psi"], rows),
        "",
        "Outputs of a whole turn, and how many times psi at its 360 poses (extrema to 1e-8):",
        "",
        *pipe_table(["how", "outputs", "families", "per design", "x a turn of psi"], turns),
        "",
        *_picture("accuracy-prices", "What each output and effect costs, per pose and per design"),
    ][:-1]


def _storage(m: Measured) -> list[str]:
    rows = [
        [
            r.dtype,
            sig(r.bytes_per_row),
            f"{r.ns_per_design:.0f}",
            sig(r.margin),
            sig(r.max_pressure_angle),
            sig(r.max_abs_d2psi),
        ]
        for r in m.storage.itertuples()
    ]
    head = ["dtype", "bytes per row", "ns per design swept", "margin", "max_pressure_angle", "max_abs_d2psi"]
    return [
        "",
        "## float32 or float64 on disk",
        "",
        *prose(
            "A Sobol sample, rotatable designs kept, three outputs with their error estimates, seven parameters in",
            "float64; processor time of the whole sweep, and the largest relative error that storing adds.",
        ),
        "",
        *pipe_table(head, rows),
    ]


def _optimiser(m: Measured) -> list[str]:
    first, last = m.digits.iloc[0], m.digits.iloc[-1]
    coarse, fine = m.targets.iloc[0], m.targets.iloc[-1]
    rows = [[f"1e-{r.digits}", f"{r.looks:.0f}", f"{r.milliseconds:.0f}"] for r in m.digits.itertuples()]
    more = (last["milliseconds"] / first["milliseconds"]) ** (1.0 / (last["digits"] - first["digits"]))
    return [
        "",
        "## One more digit in the optimiser",
        "",
        *prose(
            "Least acceleration for a swing of 45 degrees and a pressure angle of at most 45 degrees, four",
            "variables: looks at the mechanism, and processor time, until the best design stays that near to the",
            f"end of the search. Medians of {first['converged']:.0f} of {first['starts']:.0f} starts.",
        ),
        "",
        *pipe_table(["optimum within", "looks", "ms"], rows),
        "",
        *prose(
            f"One digit more multiplies the time by {more:.2f}. The extrema inside are refined to rounding whatever",
            f"`accuracy` says: `accuracy = {power(coarse['accuracy'])}` and `{power(fine['accuracy'])}` find optima",
            f"that differ by {sig(coarse['difference_from_finest'])}, in {coarse['ms_per_start']:.0f} and",
            f"{fine['ms_per_start']:.0f} ms a start.",
        ),
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
        *prose(
            "A long coupler multiplies the rounding of its own length; that is in cond, and a drawing loses nothing",
            "by it. Where the given doubles are exact (a comparison with exact arithmetic), it is lost.",
            "`sweep.evaluate` closes the linkage in twice the working precision; sweeps do not, and are several",
            "times faster on grids. Largest errors, of the derivatives relative to their own size plus that of the",
            "velocity; times with a design per pose:",
        ),
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
        *prose(
            "One planar four-bar, rocker at evenly spaced crank angles, each tool by its fastest way, on this",
            f"machine (`make bench-peers`); their rocker pins differ by at most {distance} cranks.",
        ),
        "",
        *pipe_table(["what", "ns per crank angle", "times as fast"], rows),
    ]


def _known(m: Measured) -> list[str]:
    """Return the largest factors: one line per table, then by quantity and kind of row, then what the search found."""
    lines = [
        "",
        "## Largest known factors",
        "",
        *prose(
            "Every row of the 25-digit tables, in units of 2^-53 max(cond, abs y); for the geared dwell drive,",
            "whose table has no cond, of abs y, its lower derivatives and what one rounding of phi does; for the",
            "largest pressure angle of a rounding of one radian. Rows declared undecidable:",
            f"{int(m.oracle['undecidable'].sum())}.",
        ),
        "",
    ]
    tables = m.oracle.groupby("table", sort=False)
    summary = []
    for table, part in tables:
        top = part.sort_values("factor").iloc[-1]
        count = f"{part.groupby('quantity')['rows'].sum().max()}"
        kind = str(top["kind"]).replace("_", " ")
        summary.append([table, count, f"{top['allowed']:g}", sig(top["factor"]), top["quantity"], kind])
    lines += pipe_table(["table", "rows", "allowed", "largest known", "of", "among"], summary)
    for table, part in tables:
        quantities = list(dict.fromkeys(part["quantity"]))
        rows = []
        for name, cells in part.groupby("kind", sort=False):
            known = dict(zip(cells["quantity"], cells["factor"], strict=True))
            count = str(int(cells["rows"].max()))
            rows.append([str(name).replace("_", " "), count, *(sig(known.get(q, np.nan)) for q in quantities)])
        lines += ["", f"### {table}, allowed {part['allowed'].iloc[0]:g}", ""]
        lines += pipe_table(["kind of rows", "rows", *quantities], rows)
    worst = [
        [str(poses), str(region), *(sig(part.loc[part["output"] == name, "factor"].max()) for name in ORDERS)]
        for (poses, region), part in m.worst.groupby(["poses", "region"])
    ]
    return [
        *lines,
        "",
        "### Largest found by search",
        "",
        *prose(
            "Crank-rockers outside the tables: `make search-worse` looks for poses with larger factors than any",
            "known; the tests replay them.",
        ),
        "",
        *pipe_table(["poses of", "region", *ORDERS], worst),
    ]


def html(page: str, figures: list[Saved]) -> str:
    """Return the page with its diagrams, self-contained."""
    images = {f"figures/{figure.path.name}": figure.uri for figure in figures}
    style = "body{font:15px/1.45 system-ui,sans-serif;max-width:1350px;margin:2em auto;padding:0 1em;color:#222}" \
        "table{border-collapse:collapse;margin:.6em 0}td,th{padding:.15em .5em;border-bottom:1px solid #e4e7eb;" \
        "text-align:left;font-variant-numeric:tabular-nums}td:nth-child(n+3){white-space:nowrap}" \
        "img{width:100%}code{background:#f3f4f6}"  # fmt: skip
    head = (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Accuracy and time</title><style>{style}</style>'
    )
    return head + html_body(page, images) + "</html>\n"
