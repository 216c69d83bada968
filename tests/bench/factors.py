"""Largest known errors of the oracle tables: ``python -m tests.bench.factors``.

Writes docs/accuracy/factors.md; tests/families/test_hard_oracle.py holds every figure to what its sheet allows.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import pandas as pd

from studies.accuracy.tables import pipe_table, prose
from studies.accuracy.tables import significant as sig
from tests.support.oracle_factors import factors
from tests.support.sixty_digits import ORDERS

ROOT = Path(__file__).resolve().parents[2]
ORACLE = ROOT / "tests" / "oracle"
PAGE = ROOT / "docs" / "accuracy" / "factors.md"


def main() -> None:
    """Judge every table and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.factors", description=__doc__)
    parser.add_argument("--out", type=Path, default=PAGE, help="the page")
    out: Path = parser.parse_args().out
    found = pd.DataFrame([worst.__dict__ for worst in factors(ORACLE)])
    worst = pd.DataFrame(json.loads((ORACLE / "worst_found.json").read_text())["rows"])
    out.write_text("\n".join(page(found, worst)) + "\n", encoding="utf-8")


def page(found: pd.DataFrame, worst: pd.DataFrame) -> list[str]:
    """One line per table, then what the search found."""
    beyond = int((~(found["factor"] <= found["allowed"])).sum())
    rows = int(found.groupby(["table", "kind"])["rows"].max().sum())
    lines = [
        "# Largest known errors",
        "",
        *prose(
            "The largest errors over all rows of the 25-digit tables, with their quantity and kind of rows. Hard",
            "rows, where a table tells them apart, have dead points, change points, extreme proportions and",
            "scales. The unit is 2^-53 times max(cond, abs y). In some tables another size takes the place of",
            "this maximum: for the geared dwell drive, whose table has no cond, the largest of abs y, its lower",
            "derivatives and the change by one rounding of phi; for the largest pressure angle one radian; for",
            "other pressure angles and joint loads the tabulated sensitivity; with friction the largest force.",
            "Back to [what the next digit costs](../accuracy.md).",
        ),
        "",
        f"{beyond} of {len(found)} quantities and kinds exceed the factor of their sheet, over {rows} rows;",
        f"{int(found['undecidable'].sum())} rows are declared undecidable.",
        "",
    ]
    lines += pipe_table(
        ["table", "rows", "allowed", "largest of other rows", "largest of hard rows"],
        [_summary(*one) for one in found.groupby("table", sort=False)],
    )
    searched = [
        [str(poses), str(region), *(sig(part.loc[part["output"] == name, "factor"].max()) for name in ORDERS)]
        for (poses, region), part in worst.groupby(["poses", "region"])
    ]
    return [
        *lines,
        "",
        "### Largest found by search",
        "",
        *prose(
            "These are crank-rockers outside the tables. `make search-worse` looks for poses with larger factors than",
            "any known; the tests replay them.",
        ),
        "",
        *pipe_table(["poses of", "region", *ORDERS], searched),
    ]


def _summary(table: object, part: pd.DataFrame) -> list[str]:
    rows = part.groupby("quantity")["rows"].sum().max()
    hard = part["kind"].str.startswith("hard")
    return [str(table), str(rows), f"{part['allowed'].iloc[0]:g}", _largest(part[~hard]), _largest(part[hard])]


def _largest(part: pd.DataFrame) -> str:
    if part.empty:
        return "-"
    top = part.sort_values("factor").iloc[-1]
    return f"{sig(top['factor'])} ({top['quantity']}, {str(top['kind']).replace('_', ' ')})"


if __name__ == "__main__":
    main()
