"""Pages docs/accuracy/families.md and crank-rocker.md: error and time of every family by every method and region."""

from __future__ import annotations

from collections.abc import Hashable
from typing import TYPE_CHECKING

from studies.accuracy.measured import Measured
from studies.accuracy.prices import CERTIFIED, GRID, PROVEN, REFINED
from studies.accuracy.subjects import TEXTS
from studies.accuracy.tables import USUAL, USUAL_HEAD, Parts, cells, duration, pipe_table, power, prose
from studies.accuracy.tables import significant as sig

if TYPE_CHECKING:
    import pandas as pd

WAYS = (*USUAL, (CERTIFIED, PROVEN))
HEAD = ("number", "designs", *USUAL_HEAD, f"proven, `{power(PROVEN)}`", "reference sure to", "no answer")
PURPOSES = {"For a nightly map": 1e-3, "For a drawing, an optimum, a comparison with a measurement": 1e-9}


def families_parts(m: Measured) -> Parts:
    """Return tables of all families, region by region, and the spread of timings."""
    return {"regions": _by_region(m.families), "spread": _spread(m.families)}


def crank_rocker_parts(m: Measured) -> Parts:
    """Return the table of the crank-rocker's own regions, and advice for each purpose."""
    texts = m.regions[["region", "text"]].drop_duplicates()
    rows = [_row(str(name), part) for name, part in m.regions.groupby("region", sort=False)]
    return {
        "prices": pipe_table(("region", *HEAD), rows),
        "regions": pipe_table(("region", "what its designs have in common"), texts.to_numpy().tolist()),
        "advice": [f"* {line}" for line in advice(m.regions)],
    }


def advice(table: pd.DataFrame) -> list[str]:
    """Return for every purpose the cheapest setting that keeps its bound in every region except change points."""
    plain = table[table["region"] != "change point"]
    lines = [f"**{purpose}** (to {power(bound)}): {_choice(plain, bound)}" for purpose, bound in PURPOSES.items()]
    return [*lines, f"**For a proof that no peak was missed**: {_proof(plain)}"]


def _choice(table: pd.DataFrame, bound: float) -> str:
    """Describe the cheapest setting within the bound; ``accuracy=`` settings are at least as fine as the bound."""
    promised = (table["method"] == GRID) | ((table["method"] == REFINED) & (table["setting"] <= bound * (1.0 + 1e-9)))
    ways: dict[Hashable, pd.DataFrame] = {}
    for (method, _), rows in table[promised].groupby(["method", "setting"]):
        kept = (rows["largest_error"] <= rows["reference_error"].clip(lower=bound)).all()
        # Groups are in order of their settings: the coarsest grid comes first, the coarsest target last.
        if kept and not rows["unanswered"].any() and (method == REFINED or method not in ways):
            ways[method] = rows
    if not ways:
        return "nothing measured here keeps that bound."
    rows = min(ways.values(), key=lambda rows: float(rows["ns_per_design"].mean()))
    first, dear = rows.iloc[0], rows.sort_values("ns_per_design").iloc[-1]
    worst = rows.sort_values("largest_error").iloc[-1]
    refined = first["method"] == REFINED
    used = f"`accuracy = {power(first['setting'])}`" if refined else f"a grid of {first['setting']:.0f}"
    return (
        f"use {used}. {duration(rows['ns_per_design'].mean())} a design on average, {duration(dear['ns_per_design'])}"
        f" in the dearest region ({dear['region']}); largest error {sig(worst['largest_error'])}, where the reference"
        f" is sure to {sig(worst['reference_error'])}."
    )


def _proof(table: pd.DataFrame) -> str:
    """Describe the cost of the certificate relative to the search that it checks."""
    proven = table[table["method"] == CERTIFIED]
    searched = table[(table["method"] == REFINED) & (table["setting"] <= PROVEN)]
    searched = searched[searched["setting"] == searched["setting"].max()]
    took, alone = (float(rows["ns_per_design"].mean()) for rows in (proven, searched))
    return (
        f"add `certify = true`. {duration(took)} a design on average at `accuracy = {power(PROVEN)}`,"
        f" {sig(took / alone)} times as long as the search alone. Use it for survivors and optima."
        f" {proven['unanswered'].sum()} of {proven['designs'].sum()} proofs failed."
    )


def _by_region(table: pd.DataFrame) -> list[str]:
    lines = []
    for region in dict.fromkeys(table["region"]):
        part = table[table["region"] == region].groupby("family", sort=False)
        lines += [f"## {region[0].upper()}{region[1:]}", "", f"{TEXTS[region][0].upper()}{TEXTS[region][1:]}.", ""]
        lines += [*pipe_table(("family", *HEAD), [_row(f"`{name}`", rows) for name, rows in part]), ""]
    return lines[:-1]


def _row(name: str, rows: pd.DataFrame) -> list[str]:
    first, missing = rows.iloc[0], int((rows["unanswered"] + rows["unjudged"]).max())
    sure = sig(rows["reference_error"].max())
    return [name, f"`{first['measure']}`", str(first["designs"]), *cells(rows, WAYS), sure, str(missing)]


def _spread(table: pd.DataFrame) -> list[str]:
    """Describe the spread of the timings of one call, over all rows of the table."""
    width = (table["ns_per_design_upper"] - table["ns_per_design_lower"]) / table["ns_per_design"]
    return prose(
        f"Every time is the median of five runs. The quartiles differ by {sig(100.0 * width.median())} % of it in the",
        f"middle of the table, by {sig(100.0 * width.quantile(0.95))} % in the worst twentieth; they are in",
        "`results/accuracy/families.parquet`.",
    )
