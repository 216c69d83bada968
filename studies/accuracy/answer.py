"""The first screen of the page: what a digit costs, and what to use, picked from the measured table."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.accuracy.tables import HOUSE, allowed, coarsest, duration, pipe_table, power, prose, setting_of
from studies.accuracy.tables import significant as sig

if TYPE_CHECKING:
    import pandas as pd

QUANTITIES = {
    "psi": "rocker angle at 360 crank angles",
    "max_abs_d2psi": "largest acceleration of the turn",
    "swing": "swing",
}
EASY, STEEP, EDGE, INHERENT = "ordinary", "pressure angle beyond 84", "change point", "long coupler"
BOUNDS = (1e-3, 1e-6, 1e-9)
# Measured for comparison; the package does not offer them as an answer.
COMPARED = (
    "direct, float32",
    "direct, twice float64",
    "grid, float32",
    "grid + parabola",
    "grid + refined top sample",
)
CERTIFIED = "certified, accuracy="  # the same search, proven
PROVEN = 1e-8 * (1.0 + 1e-9)
PURPOSES = (
    ("For a nightly map", "max_abs_d2psi", 1e-3),
    ("For a drawing, an optimum, a comparison with a measurement", "max_abs_d2psi", 1e-8),
    ("For the limit positions of a drawing", "swing", 1e-8),
    ("For a curve to look at", "psi", 1e-3),
    ("For positions to compute on with", "psi", 1e-9),
)


def in_short(work: pd.DataFrame) -> str:
    """Return the page in a sentence: the largest acceleration of ordinary designs by a grid
    and by the package's own way.
    """
    part = work[(work["quantity"] == "max_abs_d2psi") & (work["region"] == EASY)]
    told = []
    for method, words in (("grid, float64", "a plain grid"), (HOUSE["max_abs_d2psi"], "`accuracy=`")):
        cells = [(bound, coarsest(part[part["method"] == method], bound)) for bound in BOUNDS]
        reached = [f"{power(bound)} for {duration(at['ns_per_design'])}" for bound, at in cells if at is not None]
        told.append(f"{words} gives {', '.join(reached) or 'none of these'}")
    return f"In short, for the largest acceleration of an ordinary crank-rocker: {'; '.join(told)} a design."


def answer(work: pd.DataFrame) -> list[str]:
    """Return the table of times by error, and what it says in words."""
    rows, named = [], ""
    for quantity, text in QUANTITIES.items():
        part = work[work["quantity"] == quantity]
        methods = list(dict.fromkeys(part["method"]))
        for method in sorted(methods, key=lambda name: name != HOUSE[quantity]):
            curve = part[part["method"] == method]
            cells = [
                [coarsest(curve[curve["region"] == region], bound) for bound in BOUNDS] for region in (EASY, STEEP)
            ]
            rows.append(
                [
                    text if text != named else "",
                    f"**{_shown(method)}**" if method == HOUSE[quantity] else _shown(method),
                    *(_cell(at) for region in cells for at in region),
                    _per_digit(cells[0]),
                ]
            )
            named = text
    head = ["wanted", "how"]
    head += [f"{region}, {power(bound)}" for region in ("ordinary", "beyond 84 degrees") for bound in BOUNDS]
    return [
        *prose(
            "Time per design for an error below 1e-3, 1e-6, 1e-9 (relative; of positions in rad): of ordinary",
            "crank-rockers, pressure angle below 60 degrees, and of hard ones, beyond 84 degrees. In brackets the",
            "setting it takes, - where no setting reaches it; in bold what the package does when asked. Last",
            "column: by what one digit more multiplies the time, ordinary designs.",
        ),
        "",
        *pipe_table([*head, "one digit more"], rows),
    ]


def _shown(method: str) -> str:
    return method.replace("accuracy=", "`accuracy=`")


def _cell(at: pd.Series | None) -> str:
    if at is None:
        return "-"
    setting = setting_of(at)
    return f"{duration(at['ns_per_design'])}" + (f" ({setting})" if setting else "")


def _per_digit(cells: list[pd.Series | None]) -> str:
    """Return the factor per digit between the coarsest and the finest of the bounds that are reached."""
    reached = [(bound, at["ns_per_design"]) for bound, at in zip(BOUNDS, cells, strict=True) if at is not None]
    if len(reached) < 2:
        return "-"
    (coarse, cheap), (fine, dear) = reached[0], reached[-1]
    return f"x {(dear / cheap) ** (1.0 / np.log10(coarse / fine)):.2f}"


def advice(work: pd.DataFrame, storage: pd.DataFrame) -> list[str]:
    """Return what to use for what: the cheapest method that keeps the bound in every region,
    at its coarsest setting.
    """
    offered = work[~work["method"].isin((*COMPARED, CERTIFIED))]
    lines = [
        f"* **{purpose}** ({QUANTITIES[quantity]} to {power(bound)}): {_choice(offered, quantity, bound)}"
        for purpose, quantity, bound in PURPOSES
    ]
    return [
        *lines,
        f"* **For a proof that no peak was missed**: {_proof(work)}",
        f"* **Near a change point**: {_edge(work)}",
        f"* **On disk**: {_disk(storage)}",
    ]


def _choice(work: pd.DataFrame, quantity: str, bound: float) -> str:
    """Return the cheapest method that keeps the bound everywhere but at change points,
    and how much dearer the next is.
    """
    part = work[(work["quantity"] == quantity) & (work["region"] != EDGE)]
    without = ""
    ranked = _ranked(part, bound)
    if not ranked:
        # The rounding of a long coupler's own length is in every method; what is left is judged without it.
        part, without = part[part["region"] != INHERENT], f" or {INHERENT}s, where one rounding of an input costs more"
        ranked = _ranked(part, bound)
    if not ranked:
        return "nothing measured here keeps that bound."
    mean, at = ranked[0]
    dearest = at.sort_values("ns_per_design").iloc[-1]
    text = f"use {_setting(at.iloc[0])}. {duration(mean)} a design on average, {duration(dearest['ns_per_design'])} in"
    text += f" the dearest region ({dearest['region']}); largest error {sig(at['largest_error'].max())} in every region"
    text += f" but {EDGE}s{without}."
    if len(ranked) == 1:
        return f"{text} Nothing else measured keeps that bound."
    other, next_best = ranked[1]
    return f"{text} Next best: {_setting(next_best.iloc[0])}, {sig(other / mean)} times as long."


def _setting(at: pd.Series) -> str:
    setting = setting_of(at)
    if str(at["method"]).endswith("="):
        return f"`accuracy = {setting}`" + (", certified" if str(at["method"]).startswith("certified") else "")
    return f"{at['method']}, {setting}" if setting else str(at["method"])


def _ranked(part: pd.DataFrame, bound: float) -> list[tuple[float, pd.DataFrame]]:
    """Return for every method its coarsest setting that keeps the bound in every region:
    mean time and rows, the cheapest first.
    """
    found = []
    for method, curve in part.groupby("method", sort=False):
        good = [
            (float(rows["ns_per_design"].mean()), rows)
            for _, rows in curve.groupby("setting")
            if (rows["largest_error"] <= bound).all() and not rows["unanswered"].any() and allowed(rows, bound).all()
        ]
        if good:
            order = -1 if str(method).endswith("=") else 1
            found.append(min(good, key=lambda pair: order * float(pair[1]["setting"].iloc[0])))
    return sorted(found, key=lambda pair: pair[0])


def _proof(work: pd.DataFrame) -> str:
    """Return what the certificate costs beside the search that it checks, at the coarsest setting below 1e-8."""
    part = work[(work["quantity"] == "max_abs_d2psi") & (work["region"] != EDGE) & (work["setting"] <= PROVEN)]
    searched, proven = (part[part["method"] == name] for name in (HOUSE["max_abs_d2psi"], CERTIFIED))
    setting = proven["setting"].max()
    times = [rows.loc[rows["setting"] == setting, "ns_per_design"].mean() for rows in (searched, proven)]
    unproven, asked = proven["unanswered"].sum(), proven["designs"].sum()
    return (
        f"add `certify = true`. {duration(times[1])} a design on average at `accuracy = {power(setting)}`,"
        f" {sig(times[1] / times[0])} times as long as the search alone: for survivors and optima. {unproven} of"
        f" {asked} proofs failed."
    )


def _edge(work: pd.DataFrame) -> str:
    part = work[(work["quantity"] == "max_abs_d2psi") & (work["region"] == EDGE)]
    own, grid = part[part["method"] == HOUSE["max_abs_d2psi"]], part[part["method"] == "grid, float64"]
    first, last = own.sort_values("setting").iloc[-1], own.sort_values("setting").iloc[0]
    finest = grid.sort_values("setting").iloc[-1]
    return (
        f"`accuracy = {power(first['setting'])}` leaves {sig(first['largest_error'])} of the largest acceleration at"
        f" {duration(first['ns_per_design'])} a design, `accuracy = {power(last['setting'])}` leaves"
        f" {sig(last['largest_error'])} at {duration(last['ns_per_design'])}: what plain arithmetic leaves there, poses"
        f" in twice the precision finish. A grid of {finest['setting']:.0f} is off by"
        f" {100.0 * finest['largest_error']:.0f} %."
    )


def _disk(storage: pd.DataFrame) -> str:
    double, single = (storage[storage["dtype"] == name].iloc[0] for name in ("float64", "float32"))
    saved = 1.0 - single["bytes_per_row"] / double["bytes_per_row"]
    added = single[["margin", "max_pressure_angle", "max_abs_d2psi"]].max()
    return (
        f'`dtype = "float32"` saves {100.0 * saved:.0f} % of the bytes and adds {sig(added)} relative: for maps, not'
        " for a design that is taken on."
    )
