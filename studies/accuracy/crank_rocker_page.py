"""docs/accuracy/crank-rocker.md: the crank-rocker in depth, by every method and region, and what else costs time."""

from __future__ import annotations

from studies.accuracy.answer import BOUNDS, QUANTITIES, advice, answer, in_short
from studies.accuracy.measured import Measured
from studies.accuracy.tables import HOUSE, duration, pipe_table, power, prose, reached_table
from studies.accuracy.tables import significant as sig


def crank_rocker_page(m: Measured) -> list[str]:
    """Return the page, line by line."""
    return [
        "# What accuracy costs: the crank-rocker in depth",
        "",
        *prose(in_short(m.work), "Back to [what the next digit costs](../accuracy.md)."),
        "",
        *_picture(
            "accuracy-methods", "Time per design against largest error, ordinary crank-rockers, one curve per method"
        ),
        *answer(m.work),
        "",
        "## What to use",
        "",
        "Picked from the measurements: the cheapest method that keeps the bound, at its coarsest setting that does.",
        "",
        *advice(m.work, m.storage),
        *_regions(m),
        *_work(m),
        *_outputs(m),
        *_storage(m),
        *_optimiser(m),
        *_positions(m),
        *_exact(m),
    ]


def _picture(name: str, text: str) -> list[str]:
    return [f"![{text}](../figures/{name}.svg)", ""]


def _regions(m: Measured) -> list[str]:
    counts = m.work[m.work["quantity"] == "max_abs_d2psi"].groupby("region")["designs"].max()
    return [
        "",
        "## Work and precision by region",
        "",
        "Crank-rockers with random proportions, sorted by what makes them hard for float64 and for a grid:",
        "",
        *pipe_table(
            ["region", "what its designs have in common", "designs"],
            [[*region, str(counts[region[0]])] for region in m.regions],
        ),
        "",
    ]


def _work(m: Measured) -> list[str]:
    lines = [
        *prose(
            "Time: processor time of one thread, median of five. Extrema: largest relative error over the",
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
            "Every output and every effect of the register, 360 poses a turn: outputs of the crank-rocker in one run,",
            "alone with all they need; effects as `make bench` measured them, on the first family named, all their",
            "outputs together, the motion they share apart. Pose outputs, and how many times the angle psi:",
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
